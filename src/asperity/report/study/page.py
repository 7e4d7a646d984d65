"""HTML report of a study, with figures and tables for a paper.

A study of Sq alone shows Figs 5 to 8 and 13 of the paper with its published values; any other shows
each output over each swept quantity.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from asperity.core.coverage import PERCENT
from asperity.core.files import make_folder, require_writable, write_csv
from asperity.core.quantities import quantity
from asperity.paper import Anchor
from asperity.report.base import Exhibit, Picture, Tile, heading, render, write_exhibits, write_page
from asperity.report.study import contacts, tables
from asperity.report.study.curve import curve_exhibits, first_to_last
from asperity.report.study.dynamic import dynamic_exhibits
from asperity.report.study.sweep import sweep_exhibits
from asperity.study import SEED_KEYS, StudyOverview, StudyResult

TILES = ("clr", "car", "car_domain", "crf_sound_hz", "contact_damping_ratio")

Progress = Callable[[str], None]


def write_study_report(
    result: StudyResult,
    path: str | Path,
    *,
    figures: str | Path | None = None,
    anchors: Sequence[Anchor] | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a self-contained HTML report of a study, and figures and tables for a paper.

    Parameters
    ----------
    result : from `run_study` or `load_study`; missing, failed and unconverged cases are listed and
        excluded from all means
    path : file to write; its folder must exist
    figures : folder for each figure as PDF (85 and 175 mm wide), `captions.md` and the tables as
        csv; created if missing
    anchors : reference values of a study of Sq (default: the paper's published values, if it
        is the paper's contact)
    progress : called with a description of each step

    Returns
    -------
    Path
        File written. The same table and asperity version give the same bytes.

    Raises
    ------
    BadInput
        for a study without a computed case, or a path that is not writable.
    """
    require_writable(Path(path))
    study = StudyOverview(result, anchors, progress)
    folder = None if figures is None else Path(figures)
    if folder is not None:
        make_folder(folder)  # refused before anything is drawn
    messages = progress or (lambda _: None)

    def page() -> str:
        exhibits = study_exhibits(study)
        text = render_study_page(study, exhibits, messages)
        if folder is not None:
            write_exhibits(exhibits, folder, messages)
            _write_tables(study, folder)
        return text

    return write_page(path, page)


def _write_tables(study: StudyOverview, folder: Path) -> None:
    """Write each table as csv."""
    for name, table in study.tables.items():
        write_csv(folder / f"{name}.csv", table)


def study_exhibits(study: StudyOverview) -> list[Exhibit]:
    """Return all exhibits in the order of the page."""
    if not len(study.used):
        return []
    if study.curve is None:
        return list(sweep_exhibits(study))
    exhibits = [*curve_exhibits(study, study.curve), *dynamic_exhibits(study, study.curve)]
    if study.runs and not isinstance(study.runs, str):
        exhibits += [contacts.contact_maps(study.runs), contacts.surface_maps(study.runs)]
    return exhibits


def render_study_page(study: StudyOverview, exhibits: Sequence[Exhibit], progress: Progress) -> str:
    """Render the page as HTML text."""

    def picture(exhibit: Exhibit) -> Picture:
        progress(f"drawing {exhibit.name}")
        return exhibit.picture()

    return render(
        "study/page.html.j2",
        title=_title(study),
        study=study,
        failed=study.result.failed,
        total=len(study.result.table),
        tiles=_tiles(study),
        pictures=[picture(exhibit) for exhibit in exhibits],
        anchors=tables.anchor_rows(study),
        levels=tables.level_rows(study),
        points=tables.point_rows(study),
        many=tables.has_many_points(study),
        facts=tables.facts(study),
    )


def _title(study: StudyOverview) -> str:
    if study.curve is not None:
        return f"Wear study, Sq {first_to_last('sq_m', study.curve.sq)}"
    keys = [key for key in study.result.plan.axes if key not in SEED_KEYS]
    return f"Study over {', '.join(keys) or 'seeds'}"


def _tiles(study: StudyOverview) -> list[Tile]:
    result, curve = study.result, study.curve
    tiles = [
        Tile(
            "Cases",
            f"{len(result.table)}",
            f"of {len(result.plan.cases)}" if result.missing else "",
        ),
        Tile("Failed or not converged", f"{result.failed}", f"of {len(result.table)}"),
    ]
    if curve is None:
        return tiles
    for key in TILES:
        if key in curve.table:
            entry = quantity(key)
            (first, last) = curve.mean(key)[[0, -1]]
            if np.isfinite([first, last]).all():
                tiles.append(
                    Tile(
                        heading(entry),
                        f"{entry.number(first)} to {entry.number(last)}",
                        entry.display,
                    )
                )
    split = quantity("split")
    for preset, stages in curve.stages.items():
        if stages.kind == "too few":
            continue
        low, high = (split.number(end) for end in stages.interval)
        value, detail = (
            (split.text(stages.split), f"{PERCENT}: {low} to {high}")
            if stages.found
            else ("none", stages.kind)
        )
        tiles.append(Tile(f"Split, preset {preset}", value, detail))
    return tiles
