"""Files of a calibration: the calibrated case and the table of anchors."""

from pathlib import Path
from typing import TYPE_CHECKING

from asperity.case import Case, relative_path
from asperity.study.calibration_result import Calibration
from asperity.study.ranges import stated_value

if TYPE_CHECKING:
    import pandas

SURFACE_FILES = ("surface.file", "surface.second.file")


def calibrated_text(calibration: Calibration, folder: Path) -> str:
    """Return the text of the calibrated case file in `folder`, headed by the verdict."""
    heading = f"# {calibration.case.source}, calibrated by asperity. {calibration.verdict()}"
    return f"{heading}\n\n{_relocated(calibration.calibrated, folder).text}"


def anchor_table(calibration: Calibration) -> "pandas.DataFrame":
    """Return one row per anchor and curve: as given, fitted, and checked on new surfaces."""
    import pandas

    tables = {
        "as given": calibration.start,
        "fitted": calibration.fit,
        "checked": calibration.check,
    }
    return pandas.concat([table.assign(curve=name) for name, table in tables.items()])


def _relocated(case: Case, folder: Path) -> Case:
    """Return the case with its surface files relative to `folder`."""
    files = {key: stated_value(case, key) for key in SURFACE_FILES}
    moved = {
        key: relative_path(case.folder / name, folder)
        for key, name in files.items()
        if name is not None
    }
    return case.with_written(moved) if moved else case
