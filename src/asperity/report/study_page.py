"""One HTML page of a study, and its figures and tables for a paper.

A study of Sq alone gets the paper's Figs 5 to 8 and 13 with the printed numbers in them; any other gets each output
against each swept quantity. The maps of a few levels are solved anew; nothing else is computed here.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from asperity.case import Case
from asperity.errors import AsperityError, BadInput
from asperity.files import make_folder, read_manifest, require_writable, versions, whole_file
from asperity.report import study_figures, sweep_figures
from asperity.report.figures import MICRO
from asperity.report.page import NOT_FOUND, PAPER, Tile, in_print, page_template, picture, with_deviation
from asperity.report.study_figures import ON_PAGE, ON_PAPER, Medium
from asperity.report.sweep_figures import Axis, Output, axis_of, outputs_of
from asperity.results import Run, solve_case
from asperity.study import BOTH_PRESETS as PRESETS
from asperity.study import (
    DONE,
    FORMAT,
    PAPER_ANCHORS,
    SEEDS,
    SPLIT,
    SQ_KEY,
    Anchor,
    StudyResult,
    WearCurve,
    as_written,
    compare_with_anchors,
    curve_of,
    is_wear_study,
    rig_deviation,
    rig_prediction,
)

if TYPE_CHECKING:
    import pandas

MOST_MAPS = 8  # the paper's Figs 5 and 6 have eight
MOST_POINTS = 60  # in a table of the page; the csv has all
MOST_OUTPUTS = 8  # beside each other in it
MOST_REASONS = 10
MOST_NAMED = 5  # failed cases named for one reason
SHOWS = 5e-4  # a difference between shares that a map's percentages would show
NEAR = 0.1  # of the rig's own values: the paper prints speed and radius in more than one way


LEVEL_COLUMNS = {
    "clr": "CLR",
    "car": "CAR, Hertz zone",
    "car_domain": "CAR, domain",
    "crf_sound_hz": "CRF, sound",
    "crfa_sound": "CRFA, sound",
    "crf_paper_hz": "CRF, paper",
    "crfa_paper": "CRFA, paper",
}


class Shown(NamedTuple):
    """A figure: its file's name, how it is drawn for a medium, and what is said of it."""

    name: str
    draw: Callable[[Medium], Figure]
    caption: str
    alt: str


class Cell(NamedTuple):
    """A value in a table, and what stands small below it."""

    value: str
    below: str = ""


class Reason(NamedTuple):
    """Why cases failed, how many, and which."""

    text: str
    number: int
    cases: str


def write_study_report(
    result: StudyResult,
    path: str | Path,
    *,
    figures: str | Path | None = None,
    anchors: Sequence[Anchor] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write one self-contained HTML page about a study, and its figures and tables for a paper.

    Parameters
    ----------
    result : from `run_study` or `load_study`; what is missing, failed or did not converge is said, and left out of
        every mean
    path : the file to write; its folder must exist
    figures : folder for each figure as PDF and as PNG (300 dpi, 84 or 174 mm wide), `captions.md` and the tables as
        csv; made if it is not there
    anchors : what a study of Sq should meet; by default the paper's printed numbers, if the case is its contact
    progress : told in words what is being solved or drawn

    Returns
    -------
    Path
        The page. The same table and asperity version give the same bytes.

    Raises
    ------
    BadInput
        for a study without a computed case, or a place that cannot be written to.
    """
    path = Path(path)
    require_writable(path)
    report = StudyReport(result, anchors, progress or (lambda _: None))
    if figures is not None:
        folder = _folder(Path(figures))
    page = report.page()
    if figures is not None:
        report.write_figures(folder)
        report.write_tables(folder)
    with whole_file(path) as part:
        part.write_text(page, encoding="utf-8", newline="\n")
    return path


def papers_contact(case: Case) -> bool:
    """Whether a case is the contact of the paper's rig, near enough for its printed numbers to belong beside it."""
    conditions = case.conditions
    if conditions.geometry != "line" or case.lubricant is None:
        return False
    rigs = {"radius_along_rolling": 5.4e-3, "length": 10e-3, "load": 500.0, "entrainment_speed": 1.91}
    return all(abs(getattr(conditions, name) - value) <= NEAR * value for name, value in rigs.items())


def _folder(path: Path) -> Path:
    make_folder(path)
    require_writable(path / "captions.md")
    return path


@dataclass(frozen=True)
class StudyReport:
    """What is said about a study: the page, and the figures and tables for a paper. See `write_study_report`."""

    result: StudyResult
    given: Sequence[Anchor] | None
    tell: Callable[[str], None]

    def __post_init__(self) -> None:
        if not len(self.result.table):
            raise BadInput(
                f"the study has no computed case yet, of {len(self.result.plan.cases)}; run it with asperity study"
            )

    # What there is ---------------------------------------------------------------------------------------------------

    @cached_property
    def used(self) -> "pandas.DataFrame":
        """The rows that may be used."""
        table = self.result.table
        return table[table["status"] == DONE]

    @cached_property
    def curve(self) -> WearCurve | None:
        """The wear curve of a study of Sq alone."""
        return curve_of(self.result) if len(self.used) and is_wear_study(self.result) else None

    @property
    def papers(self) -> bool:
        """Whether the paper's printed numbers stand beside the study's."""
        return self.given is None and self.curve is not None and papers_contact(self.result.plan.case)

    @cached_property
    def anchors(self) -> tuple[Anchor, ...]:
        """What the curve should meet."""
        if self.given is not None:
            return tuple(self.given)
        said = {SPLIT, *self.used} if self.curve is not None and self.curve.stages else set(self.used)
        return tuple(anchor for anchor in PAPER_ANCHORS if self.papers and anchor.quantity in said)

    @cached_property
    def axes(self) -> list[Axis]:
        """The swept quantities over the rows that may be used; those with one value are none."""
        keys = [key for key in self.result.plan.axes if key not in SEEDS]
        swept = [axis_of(self.result.plan, self.used, key) for key in keys]
        return [axis for axis in swept if axis.places.size > 1]

    @cached_property
    def outputs(self) -> list[Output]:
        """What is shown of the rows."""
        return outputs_of(self.used)

    @cached_property
    def mapped(self) -> list[int]:
        """The numbers of the cases whose maps are shown: one surface of a few levels, evenly over Sq."""
        if self.curve is None:
            return []
        wanted = np.linspace(self.curve.sq[0], self.curve.sq[-1], MOST_MAPS)
        levels = {float(self.curve.sq[np.argmin(np.abs(self.curve.sq - sq))]) for sq in wanted}
        firsts = self.used[self.used[SQ_KEY].isin(levels)].groupby(SQ_KEY, sort=True)["number"].first()
        return [int(number) for number in firsts]

    @cached_property
    def runs(self) -> list[Run] | str:
        """The mapped cases, solved anew with the seeds they had; or why they cannot be."""
        from threadpoolctl import threadpool_limits

        runs = []
        for place, number in enumerate(self.mapped, 1):
            self.tell(f"map {place} of {len(self.mapped)}")
            try:
                case = self.result.plan.case.with_overrides(self.result.plan.cases[number].overrides)
                with threadpool_limits(1):  # as in the study, so that it is the same to the last bit
                    runs.append(solve_case(case, strict=False))
            except AsperityError as refusal:
                return f"No maps of surface and contact: {refusal}."
        return runs

    @cached_property
    def notes(self) -> list[str]:
        """Sentences to read before the numbers."""
        said = []
        if self.result.missing:
            said.append(
                f"{self.result.missing} of {len(self.result.plan.cases)} cases have not been computed yet: run the "
                "study again."
            )
        if self.result.plan.realisations == 1:
            said.append("One surface a point: other seeds give other numbers, and there is no interval of them.")
        if isinstance(self.runs, str):
            said.append(self.runs)
        else:
            mapped = self.used[self.used["number"].isin(self.mapped)]
            said += [
                f"The contact mapped at Sq {run.state.sq * MICRO:.3g} µm, solved anew, has a CLR of "
                f"{100.0 * run.state.clr:.1f} % and {100.0 * clr:.1f} % in the study's table: other versions made that."
                for clr, run in zip(mapped["clr"] if len(mapped) else (), self.runs, strict=True)
                if abs(run.state.clr - clr) > SHOWS
            ]
        unheard = {name: self.used[f"crf_{name}_hz"].isna().sum() for name in PRESETS if f"crf_{name}_hz" in self.used}
        if self.curve is not None and not unheard:
            said.append("The case has no [vibration]: there is no contact resonance to show.")
        if any(unheard.values()):
            counts = ", ".join(f"{count} with the vibration preset {name}" for name, count in unheard.items())
            said.append(
                f"No contact resonance was found in some of the {len(self.used)} cases ({counts}); means of CRF and "
                "CRFA leave them out."
            )
        return said

    @cached_property
    def reasons(self) -> list[Reason]:
        """Why cases failed, the commonest first."""
        found = []
        for (status, text), rows in self.result.failures.groupby(["status", "reason"], sort=False):
            points = rows["point"].value_counts(sort=False)
            names = [self._point_in_words(int(str(point)), count) for point, count in points.head(MOST_NAMED).items()]
            more = f"; and {len(points) - len(names)} more points" if len(points) > len(names) else ""
            found.append(Reason(_printed(f"{status}: {text}"), len(rows), _printed("; ".join(names) + more)))
        found.sort(key=lambda reason: -reason.number)
        rest = found[MOST_REASONS:]
        if rest:
            others = Reason(f"{len(rest)} other reasons", sum(reason.number for reason in rest), "in failures.csv")
            return [*found[:MOST_REASONS], others]
        return found

    def _point_in_words(self, point: int, cases: int) -> str:
        """The swept values of a point, and how many of its surfaces are meant where it has several."""
        values = self.result.plan.points[point]
        words = ", ".join(f"{key} {as_written(value)}" for key, value in values.items()) or "its case"
        several = self.result.plan.realisations
        return words if several == 1 else f"{words} ({cases} of {several} surfaces)"

    # Figures ---------------------------------------------------------------------------------------------------------

    @cached_property
    def figures(self) -> list[Shown]:
        """Every figure, in the order of the page."""
        if not len(self.used):
            return []
        return self._sweep_figures() if self.curve is None else [*self._curve_figures(self.curve), *self._maps()]

    def _curve_figures(self, curve: WearCurve) -> list[Shown]:
        seeds = f"Means over {self._seeds()} a level with the 90 % interval of the mean; dots are single surfaces."
        first, last = curve.sq[0] * MICRO, curve.sq[-1] * MICRO
        anchored = " Hollow marks: what should be met, with its tolerance." if self.anchors else ""
        if self.papers:
            anchored = (
                " Diamonds: CAR as printed, which does not say of which area; crosses: CLR behind the CRF printed for "
                "the rig's smoothest and roughest ring. Their bars are tolerances of ours."
            )
        ends = {name: [100.0 * end for end in curve.mean(name)[[0, -1]]] for name in ("clr", "car", "car_domain")}
        shown = [
            Shown(
                "shares",
                partial(study_figures.shares, curve, self.anchors),
                "Share of the load on asperities (CLR), and of the area: contact cells over all cells of the Hertz "
                "zone (CAR of the Hertz zone), contact area of the domain over the Hertz area (CAR of the domain). "
                f"{seeds}{anchored}",
                f"CLR and CAR against Sq from {first:.3g} to {last:.3g} µm: "
                + ", ".join(
                    f"{label} from {ends[name][0]:.1f} to {ends[name][1]:.1f} %"
                    for name, label in (
                        ("clr", "CLR"),
                        ("car", "CAR of the Hertz zone"),
                        ("car_domain", "of the domain"),
                    )
                )
                + ".",
            )
        ]
        heard = [preset for preset in curve.stages if np.isfinite(curve.mean(f"crf_{preset}_hz")).any()]
        if not heard:
            return shown
        stages = " ".join(f"Preset {name}: {_printed(found.verdict)}" for name, found in curve.stages.items())
        if self.papers:
            off = rig_deviation(curve, f"crf_{heard[0]}_hz")
            shown.append(
                Shown(
                    "rig",
                    partial(study_figures.rig, curve),
                    "The rig's twelve rings. Filled: CRF as printed, of the smoothest and the roughest ring; the ten "
                    "others are drawn in the paper without numbers. Hollow: the study's CRF at each ring's Sq, with "
                    "the interval over seeds and the printed error of Sq. Strip: between these rings the paper's wear "
                    "turns severe. " + _deviations(off),
                    "CRF of the rig's rings as printed beside the study's prediction at their Sq.",
                )
            )  # fmt: skip
        shown.append(
            Shown(
                "resonance",
                partial(study_figures.resonance, curve, self.anchors),
                "Contact resonance frequency (CRF) and its height in the spectrum (CRFA), by the two vibration presets "
                "on the same contacts: sound, and as the paper prints it. A shaded strip is where the split lies with "
                f"90 %. {seeds} {stages}",
                f"CRF and CRFA against Sq. {stages}",
            )
        )
        return shown

    def _maps(self) -> list[Shown]:
        if not self.runs or isinstance(self.runs, str):
            return []
        runs = self.runs
        each = "; ".join(
            f"Sq {run.state.sq * MICRO:.3g} µm: CLR {100 * run.state.clr:.1f} %, CAR {100 * run.state.car:.1f} % of "
            f"the Hertz zone and {100 * run.state.car_domain:.1f} % of the domain"
            for run in runs
        )
        return [
            Shown(
                "contact-maps",
                partial(study_figures.contact_maps, runs),
                "Contact of one surface a level: asperities yellow, oil red, ruptured oil striped; oil comes from the "
                "left. The shares are those of this very surface.",
                f"Contact maps. {each}.",
            ),
            Shown(
                "surfaces",
                partial(study_figures.surfaces, runs),
                "The same surfaces before they deform, all in one scale of heights.",
                "Maps of the surfaces' heights at Sq "
                + ", ".join(f"{run.state.sq * MICRO:.3g}" for run in runs)
                + " µm.",
            ),
        ]

    def _sweep_figures(self) -> list[Shown]:
        if not self.outputs:
            return []
        shown = []
        others = " over all values of the other swept quantities" if len(self.axes) > 1 else ""
        for axis in self.axes:
            means = f"means of {sweep_figures.BINS} groups of neighbours" if axis.binned else "means at each value"
            shown.append(
                Shown(
                    f"against-{_file_name(axis.key)}",
                    partial(sweep_figures.against, self.used, axis, self.outputs),
                    f"Every output against {axis.key}: cases as dots, and {means}{others}, with the 90 % interval of "
                    "each mean.",
                    f"Outputs of the study against {axis.key}.",
                )
            )
        if len(self.axes) == 2 and not any(axis.binned for axis in self.axes):
            one, other = self.axes
            shown.append(
                Shown(
                    f"over-{_file_name(one.key)}-and-{_file_name(other.key)}",
                    partial(sweep_figures.over_two, self.used, (one, other), self.outputs),
                    f"Means over seeds at each pair of {one.key} and {other.key}. Hatched: no case that may be used.",
                    f"Outputs of the study over {one.key} and {other.key}.",
                )
            )
        return shown

    def _seeds(self) -> str:
        count = self.result.plan.realisations
        return f"{count} surfaces" if count > 1 else "one surface"

    def write_figures(self, folder: Path) -> None:
        """Each figure as PDF and PNG, and what to print below them."""
        for shown in self.figures:
            self.tell(f"drawing {shown.name}")
            figure = shown.draw(ON_PAPER)
            with ON_PAPER.drawing():
                with whole_file(folder / f"{shown.name}.pdf") as part:
                    figure.savefig(part, format="pdf", dpi=300, metadata={"CreationDate": None})
                with whole_file(folder / f"{shown.name}.png") as part:
                    figure.savefig(part, format="png", dpi=300, metadata={"Software": None})
        with whole_file(folder / "captions.md") as part:
            text = "\n\n".join(f"**{shown.name}**: {shown.caption}" for shown in self.figures)
            part.write_text(f"{text}\n\nasperity {version('asperity')}; method: doi:{PAPER['doi']}\n", "utf-8")

    # Tables ----------------------------------------------------------------------------------------------------------

    @cached_property
    def tables(self) -> "dict[str, pandas.DataFrame]":
        """Every table by its file's name, in SI but for columns whose name has another unit."""
        tables = {"cases": self.result.table, "failures": self.result.failures}
        if self.curve is None:
            return {**tables, "points": self._points()}
        tables["levels"] = self.curve.summary()
        if self.anchors:
            tables["anchors"] = compare_with_anchors(self.curve, self.anchors)
        if self.papers:
            tables |= {f"rig-{preset}": rig_prediction(self.curve, f"crf_{preset}_hz") for preset in self.curve.stages}
        return tables

    def _points(self) -> "pandas.DataFrame":
        """A row a point: how many cases may be used, mean and standard deviation of each output."""
        columns = [output.column for output in self.outputs]
        keys = [key for key in self.result.plan.axes if key in self.used]
        groups = self.used.groupby("point", sort=True)
        table = groups[keys].first() if keys else groups[["status"]].first()[[]]
        table["cases"] = groups.size()
        for column in columns:
            table[column], table[f"{column}_std"] = groups[column].mean(), groups[column].std()
        return table.reset_index()

    def write_tables(self, folder: Path) -> None:
        """Each table as csv."""
        for name, table in self.tables.items():
            with whole_file(folder / f"{name}.csv") as part:
                table.to_csv(part, index=False, lineterminator="\n", encoding="utf-8")

    # The page --------------------------------------------------------------------------------------------------------

    def page(self) -> str:
        """The page as HTML text."""
        plan = self.result.plan
        pictures = []
        for shown in self.figures:
            self.tell(f"drawing {shown.name}")
            pictures.append(picture(shown.draw(ON_PAGE), shown.caption, shown.alt))
        return page_template("study.html.j2").render(
            title=self._title(),
            version=version("asperity"),
            verdict=_printed(self._verdict()),
            failed=self.result.failed,
            total=len(self.result.table),
            tiles=self._tiles(),
            notes=[in_print(note) for note in self.notes],
            reasons=self.reasons,
            pictures=pictures,
            wear=self.curve is not None,
            anchors=self._anchor_rows(),
            printed=self.papers,
            levels=self._level_rows(),
            points=self._point_rows(),
            many=self.curve is None and len(plan.points) > MOST_POINTS,
            facts=self._facts(),
            case_text=plan.case.text,
            paper=PAPER,
        )

    def _title(self) -> str:
        if self.curve is not None:
            first, last = self.curve.sq[0] * MICRO, self.curve.sq[-1] * MICRO
            return f"Wear study, Sq {first:.3g} to {last:.3g} µm"
        keys = [key for key in self.result.plan.axes if key not in SEEDS]
        return f"Study over {', '.join(keys) or 'seeds'}"

    def _verdict(self) -> str:
        if self.curve is not None:
            return self.curve.verdict()
        failed, total = self.result.failed, len(self.result.table)
        sentence = f"{total} cases over {', '.join(self.result.plan.axes) or 'seeds'}"
        ranges = [output for output in self.outputs if output.column in ("clr", "crf_sound_hz", "crf_hz")]
        for output in ranges:
            values = self.used[output.column] * output.scale
            sentence += f"; {output.name} from {values.min():.4g} to {values.max():.4g} {output.unit}"
        return f"{failed} OF {total} CASES FAILED and are left out: {sentence}." if failed else f"{sentence}."

    def _tiles(self) -> list[Tile]:
        table, plan = self.result.table, self.result.plan
        tiles = [
            Tile("Cases", f"{len(table)}", f"of {len(plan.cases)}" if self.result.missing else ""),
            Tile("Failed or not converged", f"{self.result.failed}", f"of {len(table)}"),
        ]
        if self.curve is None:
            return tiles
        for name, label, scale, unit in (
            ("clr", "CLR", 100.0, "%"),
            ("car", "CAR of the Hertz zone", 100.0, "%"),
            ("car_domain", "CAR of the domain", 100.0, "%"),
            ("crf_sound_hz", "CRF, preset sound", 1.0, "Hz"),
        ):
            if name in self.curve.table:
                ends = self.curve.mean(name)[[0, -1]] * scale
                if np.isfinite(ends).all():
                    tiles.append(Tile(label, f"{ends[0]:.0f} to {ends[1]:.0f}", unit))
        for preset, stages in self.curve.stages.items():
            if stages.found:
                low, high = stages.interval
                tiles.append(
                    Tile(f"Split, preset {preset}", f"{stages.split:.2f} µm", f"90 %: {low:.2f} to {high:.2f}")
                )
            else:
                tiles.append(Tile(f"Split, preset {preset}", "none", stages.kind))
        return tiles

    def _anchor_rows(self) -> list[dict[str, str]]:
        """The table of anchors in display units."""
        if self.curve is None or not self.anchors:
            return []
        rows = []
        for _, row in self.tables["anchors"].iterrows():
            shown = _display(row["quantity"])
            sense = "" if row["sense"] == "about" else f"{row['sense']} "
            rows.append(
                {
                    "name": _printed(row["anchor"]),
                    "source": row["source"],
                    "wanted": f"{sense}{shown.number(row['printed'])} ± {shown.with_unit(row['tolerance'])}",
                    "ours": shown.with_unit(row["ours"]),
                    "interval": shown.interval(row["low"], row["high"]) or NOT_FOUND,
                    "miss": shown.number(row["miss"], "+"),
                    "met": "yes" if row["met"] else "within the interval" if row["possible"] else "NO",
                }
            )
        return rows

    def _level_rows(self) -> list[list[Cell]]:
        """Head and rows of the table of levels: means, and the interval below each."""
        if self.curve is None:
            return []
        summary, stages = self.tables["levels"], self.curve.stages.get("sound")
        columns = [name for name in LEVEL_COLUMNS if name in summary]
        rows = [[Cell("Sq [µm]"), Cell("Used"), *(Cell(LEVEL_COLUMNS[name], _display(name).unit) for name in columns)]]
        staged = stages is not None and stages.found
        if staged:
            rows[0].append(Cell("Stage", "preset sound"))
        for level in range(len(summary)):
            row = summary.iloc[level]
            cells = [Cell(f"{row['sq_um']:.4g}"), Cell(str(self.curve.values("clr", level).size))]
            for name in columns:
                shown = _display(name)
                cells.append(Cell(shown.number(row[name]), shown.interval(row[f"{name}_low"], row[f"{name}_high"])))
            if stages is not None and staged:
                before, after = study_figures.stage_names(stages)
                cells.append(Cell(after if row["sq_um"] >= stages.split else before))
            rows.append(cells)
        return rows

    def _point_rows(self) -> list[list[Cell]]:
        """Head and rows of the table of points, where there are not too many."""
        if self.curve is not None or len(self.result.plan.points) > MOST_POINTS or not len(self.used):
            return []
        points, shown = self.tables["points"], self.outputs[:MOST_OUTPUTS]
        head = [*(Cell(axis.label) for axis in self.axes), Cell("Used")]
        rows = [[*head, *(Cell(output.name, output.unit) for output in shown)]]
        for _, point in points.iterrows():
            first = int(np.argmax(self.used["point"].to_numpy() == point["point"]))
            cells = [*(Cell(axis.written(axis.values[first])) for axis in self.axes), Cell(f"{point['cases']:.0f}")]
            for output in shown:
                mean, std = (point[name] * output.scale for name in (output.column, f"{output.column}_std"))
                cells.append(Cell(*with_deviation(mean, std)) if np.isfinite(mean) else Cell(NOT_FOUND))
            rows.append(cells)
        return rows

    def _facts(self) -> list[tuple[str, str]]:
        """What the study was."""
        plan = self.result.plan
        points = f"{len(plan.points)} points" if len(plan.points) > 1 else "1 point"
        rows = [
            ("Computed", {"solve": "contact and vibration", "vibrate": "the vibration model alone"}[plan.kind]),
            ("Cases", f"{len(plan.cases)}: {points} of {self._seeds()}"),
        ]
        rows += [(key, self._range(key)) for key in plan.axes]
        seeding = {
            "independent": "drawn anew for every case from the case's own seed",
            "common": "the same at every point, realisation by realisation",
        }
        seeds = "surfaces' seeds given: " + ", ".join(map(str, plan.seeds)) if plan.seeds else seeding[plan.seeding]
        rows.append(("Seeds", f"{seeds}; each case's own stand in cases.csv"))
        used = versions()
        if self.result.folder is not None:
            used = read_manifest(self.result.folder, of="study", layout=FORMAT)["versions"]
            rows.append(("Folder", self.result.folder.resolve().name))
        rows.append(("Versions", ", ".join(f"{name} {number}" for name, number in used.items())))
        return rows

    def _range(self, key: str) -> str:
        """The values of a swept key in words."""
        values = list(dict.fromkeys(as_written(point[key]) for point in self.result.plan.points if key in point))
        if len(values) <= 8:
            return _printed(", ".join(values))
        return _printed(f"{len(values)} values, {values[0]} to {values[-1]}")


# In words and display units ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Display:
    """How a quantity of the study is written."""

    scale: float
    unit: str
    form: str

    def number(self, value: float, sign: str = "") -> str:
        """In display units, without the unit."""
        return f"{value * self.scale:{sign}{self.form}}".replace("-", "−") if np.isfinite(value) else NOT_FOUND

    def with_unit(self, value: float) -> str:
        """In display units."""
        return f"{self.number(value)} {self.unit}".rstrip() if np.isfinite(value) else NOT_FOUND

    def interval(self, low: float, high: float) -> str:
        """From low to high; empty where there is none."""
        return f"{self.number(low)} to {self.number(high)}" if np.isfinite(low) and np.isfinite(high) else ""


def _display(quantity: str) -> _Display:
    if quantity in ("clr", "car", "car_domain"):
        return _Display(100.0, "%", ".1f")
    if quantity == SPLIT:
        return _Display(1.0, "µm", ".2f")
    if quantity.startswith("crf_"):
        return _Display(1.0, "Hz", ".0f")
    if quantity.startswith("crfa"):
        return _Display(1.0, "(m/s²)²/Hz", ".3g")
    return _Display(1.0, "", ".4g")


def _printed(sentence: str) -> str:
    return in_print(re.sub(r"\bum\b", "µm", sentence))


def _deviations(off: dict[str, float]) -> str:
    if not np.isfinite(off["ends"]):
        return "The study does not reach over all rings."
    return (
        f"Root mean square of ours less theirs: {off['ends']:.0f} Hz over the two printed values; over all twelve Sq "
        f"{off['knee']:.0f} Hz from a bent line between those, {off['smooth']:.0f} Hz from a saturating one."
    )


def _file_name(key: str) -> str:
    return key.replace(".", "-").replace("_", "-")
