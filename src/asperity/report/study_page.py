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
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from asperity.files import make_folder, require_writable, whole_file
from asperity.paper import CITATION, SPLIT_ANCHOR, Anchor, rig_deviation
from asperity.report import study_figures, sweep_figures
from asperity.report.figures import MICRO
from asperity.report.page import NOT_FOUND, Tile, in_print, page_template, picture, with_deviation
from asperity.report.study_figures import ON_PAGE, ON_PAPER, Medium
from asperity.report.sweep_figures import OUTPUTS, Output, axis_label, place_in_words
from asperity.study import (
    GROUPS,
    SEED_KEYS,
    FailureReason,
    StudyOverview,
    StudyResult,
    WearCurve,
    as_written,
)

MOST_POINTS = 60  # in a table of the page; the csv has all
MOST_OUTPUTS = 8  # beside each other in it

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
    report = StudyReport(StudyOverview(result, anchors, progress), progress)
    if figures is not None:
        folder = _folder(Path(figures))
    page = report.page()
    if figures is not None:
        report.write_figures(folder)
        report.write_tables(folder)
    with whole_file(path) as part:
        part.write_text(page, encoding="utf-8", newline="\n")
    return path


def _folder(path: Path) -> Path:
    make_folder(path)
    require_writable(path / "captions.md")
    return path


@dataclass(frozen=True)
class StudyReport:
    """What is said about a study: the page, and the figures and tables for a paper. See `write_study_report`."""

    study: StudyOverview
    progress: Callable[[str], None] | None = None

    @cached_property
    def outputs(self) -> list[Output]:
        """What is shown of the rows."""
        return [output for output in OUTPUTS if output.column in self.study.outputs]

    def _drawing(self, name: str) -> None:
        if self.progress is not None:
            self.progress(f"drawing {name}")

    # Figures ---------------------------------------------------------------------------------------------------------

    @cached_property
    def figures(self) -> list[Shown]:
        """Every figure, in the order of the page."""
        if not len(self.study.used):
            return []
        return (
            self._sweep_figures()
            if self.study.curve is None
            else [*self._curve_figures(self.study.curve), *self._maps()]
        )

    def _curve_figures(self, curve: WearCurve) -> list[Shown]:
        seeds = f"Means over {self._seeds()} a level with the 90 % interval of the mean; dots are single surfaces."
        first, last = curve.sq[0] * MICRO, curve.sq[-1] * MICRO
        anchored = " Hollow marks: what should be met, with its tolerance." if self.study.anchors else ""
        if self.study.papers:
            anchored = (
                " Diamonds: CAR as printed, which does not say of which area; crosses: CLR behind the CRF printed for "
                "the rig's smoothest and roughest ring. Their bars are tolerances of ours."
            )
        ends = {name: [100.0 * end for end in curve.mean(name)[[0, -1]]] for name in ("clr", "car", "car_domain")}
        shown = [
            Shown(
                "shares",
                partial(study_figures.shares, curve, self.study.anchors),
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
        if self.study.papers:
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
                partial(study_figures.resonance, curve, self.study.anchors),
                "Contact resonance frequency (CRF) and its height in the spectrum (CRFA), by the two vibration presets "
                "on the same contacts: sound, and as the paper prints it. A shaded strip is where the split lies with "
                f"90 %. {seeds} {stages}",
                f"CRF and CRFA against Sq. {stages}",
            )
        )
        return shown

    def _maps(self) -> list[Shown]:
        if not self.study.runs or isinstance(self.study.runs, str):
            return []
        runs = self.study.runs
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
        others = " over all values of the other swept quantities" if len(self.study.axes) > 1 else ""
        for axis in self.study.axes:
            means = f"means of {GROUPS} groups of neighbours" if axis.binned else "means at each value"
            shown.append(
                Shown(
                    f"against-{_file_name(axis.key)}",
                    partial(sweep_figures.against, self.study.used, axis, self.outputs),
                    f"Every output against {axis.key}: cases as dots, and {means}{others}, with the 90 % interval of "
                    "each mean.",
                    f"Outputs of the study against {axis.key}.",
                )
            )
        if len(self.study.axes) == 2 and not any(axis.binned for axis in self.study.axes):
            one, other = self.study.axes
            shown.append(
                Shown(
                    f"over-{_file_name(one.key)}-and-{_file_name(other.key)}",
                    partial(sweep_figures.over_two, self.study.used, (one, other), self.outputs),
                    f"Means over seeds at each pair of {one.key} and {other.key}. Hatched: no case that may be used.",
                    f"Outputs of the study over {one.key} and {other.key}.",
                )
            )
        return shown

    def _seeds(self) -> str:
        count = self.study.result.plan.realisations
        return f"{count} surfaces" if count > 1 else "one surface"

    def write_figures(self, folder: Path) -> None:
        """Each figure as PDF and PNG, and what to print below them."""
        for shown in self.figures:
            self._drawing(shown.name)
            figure = shown.draw(ON_PAPER)
            with ON_PAPER.drawing():
                with whole_file(folder / f"{shown.name}.pdf") as part:
                    figure.savefig(part, format="pdf", dpi=300, metadata={"CreationDate": None})
                with whole_file(folder / f"{shown.name}.png") as part:
                    figure.savefig(part, format="png", dpi=300, metadata={"Software": None})
        with whole_file(folder / "captions.md") as part:
            text = "\n\n".join(f"**{shown.name}**: {shown.caption}" for shown in self.figures)
            part.write_text(f"{text}\n\nasperity {version('asperity')}; method: doi:{CITATION.doi}\n", "utf-8")

    # Tables ----------------------------------------------------------------------------------------------------------

    def write_tables(self, folder: Path) -> None:
        """Each table as csv."""
        for name, table in self.study.tables.items():
            with whole_file(folder / f"{name}.csv") as part:
                table.to_csv(part, index=False, lineterminator="\n", encoding="utf-8")

    # The page --------------------------------------------------------------------------------------------------------

    def page(self) -> str:
        """The page as HTML text."""
        plan = self.study.result.plan
        pictures = []
        for shown in self.figures:
            self._drawing(shown.name)
            pictures.append(picture(shown.draw(ON_PAGE), shown.caption, shown.alt))
        return page_template("study.html.j2").render(
            title=self._title(),
            version=version("asperity"),
            verdict=_printed(self.study.verdict()),
            failed=self.study.result.failed,
            total=len(self.study.result.table),
            tiles=self._tiles(),
            notes=[in_print(note) for note in self.study.notes],
            reasons=[FailureReason(_printed(why.text), why.number, _printed(why.cases)) for why in self.study.reasons],
            pictures=pictures,
            wear=self.study.curve is not None,
            anchors=self._anchor_rows(),
            printed=self.study.papers,
            levels=self._level_rows(),
            points=self._point_rows(),
            many=self.study.curve is None and len(plan.points) > MOST_POINTS,
            facts=self._facts(),
            case_text=plan.case.text,
            paper=CITATION,
        )

    def _title(self) -> str:
        if self.study.curve is not None:
            first, last = self.study.curve.sq[0] * MICRO, self.study.curve.sq[-1] * MICRO
            return f"Wear study, Sq {first:.3g} to {last:.3g} µm"
        keys = [key for key in self.study.result.plan.axes if key not in SEED_KEYS]
        return f"Study over {', '.join(keys) or 'seeds'}"

    def _tiles(self) -> list[Tile]:
        table, plan = self.study.result.table, self.study.result.plan
        tiles = [
            Tile("Cases", f"{len(table)}", f"of {len(plan.cases)}" if self.study.result.missing else ""),
            Tile("Failed or not converged", f"{self.study.result.failed}", f"of {len(table)}"),
        ]
        if self.study.curve is None:
            return tiles
        for name, label, scale, unit in (
            ("clr", "CLR", 100.0, "%"),
            ("car", "CAR of the Hertz zone", 100.0, "%"),
            ("car_domain", "CAR of the domain", 100.0, "%"),
            ("crf_sound_hz", "CRF, preset sound", 1.0, "Hz"),
        ):
            if name in self.study.curve.table:
                ends = self.study.curve.mean(name)[[0, -1]] * scale
                if np.isfinite(ends).all():
                    tiles.append(Tile(label, f"{ends[0]:.0f} to {ends[1]:.0f}", unit))
        for preset, stages in self.study.curve.stages.items():
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
        if self.study.curve is None or not self.study.anchors:
            return []
        rows = []
        for _, row in self.study.tables["anchors"].iterrows():
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
        if self.study.curve is None:
            return []
        summary, stages = self.study.tables["levels"], self.study.curve.stages.get("sound")
        columns = [name for name in LEVEL_COLUMNS if name in summary]
        rows = [[Cell("Sq [µm]"), Cell("Used"), *(Cell(LEVEL_COLUMNS[name], _display(name).unit) for name in columns)]]
        staged = stages is not None and stages.found
        if staged:
            rows[0].append(Cell("Stage", "preset sound"))
        for level in range(len(summary)):
            row = summary.iloc[level]
            cells = [Cell(f"{row['sq_um']:.4g}"), Cell(str(self.study.curve.values("clr", level).size))]
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
        if self.study.curve is not None or len(self.study.result.plan.points) > MOST_POINTS or not len(self.study.used):
            return []
        points, shown = self.study.tables["points"], self.outputs[:MOST_OUTPUTS]
        head = [*(Cell(axis_label(axis)) for axis in self.study.axes), Cell("Used")]
        rows = [[*head, *(Cell(output.name, output.unit) for output in shown)]]
        for _, point in points.iterrows():
            first = int(np.argmax(self.study.used["point"].to_numpy() == point["point"]))
            cells = [
                *(Cell(place_in_words(axis, axis.values[first])) for axis in self.study.axes),
                Cell(f"{point['cases']:.0f}"),
            ]
            for output in shown:
                mean, std = (point[name] * output.scale for name in (output.column, f"{output.column}_std"))
                cells.append(Cell(*with_deviation(mean, std)) if np.isfinite(mean) else Cell(NOT_FOUND))
            rows.append(cells)
        return rows

    def _facts(self) -> list[tuple[str, str]]:
        """What the study was."""
        plan = self.study.result.plan
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
        if self.study.result.folder is not None:
            rows.append(("Folder", self.study.result.folder.resolve().name))
        rows.append(("Versions", ", ".join(f"{name} {number}" for name, number in self.study.result.versions.items())))
        return rows

    def _range(self, key: str) -> str:
        """The values of a swept key in words."""
        values = list(dict.fromkeys(as_written(point[key]) for point in self.study.result.plan.points if key in point))
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
    if quantity == SPLIT_ANCHOR:
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
