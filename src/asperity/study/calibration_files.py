"""What a calibration leaves on disk: the case it found, as a file, and its misses as one table."""

from pathlib import Path
from typing import TYPE_CHECKING

from asperity.case import Case, relative_path
from asperity.study.calibration_result import Calibration
from asperity.study.ranges import stated_value

if TYPE_CHECKING:
    import pandas

SURFACE_FILES = ("surface.file", "surface.second.file")


def calibrated_text(calibration: Calibration, folder: Path) -> str:
    """The calibrated case as a file in `folder`, what it meets above it."""
    heading = f"# {calibration.case.source}, calibrated by asperity. {calibration.verdict()}"
    return f"{heading}\n\n{_moved(calibration.calibrated, folder).text}"


def anchor_table(calibration: Calibration) -> "pandas.DataFrame":
    """A row an anchor and curve: the case as given, fitted, and checked on its own cells and new surfaces."""
    import pandas

    tables = {
        "as given": calibration.start,
        "fitted": calibration.fit,
        "checked": calibration.check,
    }
    return pandas.concat([table.assign(curve=name) for name, table in tables.items()])


def _moved(case: Case, folder: Path) -> Case:
    """The case with its surface files named as seen from `folder`."""
    files = {key: stated_value(case, key) for key in SURFACE_FILES}
    moved = {
        key: relative_path(case.folder / name, folder)
        for key, name in files.items()
        if name is not None
    }
    return case.with_overrides(moved) if moved else case
