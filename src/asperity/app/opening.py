"""Opening of the page with a case, a run, or the folder of a study, history or recordings."""

from dataclasses import dataclass
from pathlib import Path

from asperity.app.contact_jobs import open_run
from asperity.app.contact_result import ContactResult
from asperity.app.settings import limit_cells
from asperity.case import Case, load_case
from asperity.core.errors import UnreadableFile
from asperity.core.storage import MANIFEST
from asperity.paper import papers_case
from asperity.simulation import is_history_folder, is_wear_folder, load_history, load_wear
from asperity.study import load_study

DEFAULT_GRID = {"grid.cells": [192, 128]}  # 128 x 128 cells do not determine the paper's CLR


@dataclass(frozen=True, kw_only=True)
class OpenedPage:
    """First page, its name, the contact's case, and the path of a folder.

    `result` is the result of a stored run. `stated` is True if the user named the case.
    """

    kind: str
    name: str
    case: Case
    result: ContactResult | None = None
    path: Path | None = None
    stated: bool = False


def default_case() -> Case:
    """Return the contact of the paper on a grid that is quick to solve."""
    return papers_case().with_written(DEFAULT_GRID)


def open_page(path: Path | None) -> OpenedPage:
    """Open a case file, a run file or a folder; the contact of the paper for None.

    Raises
    ------
    UnreadableFile
        if the path does not exist, or is neither a case nor a run.
    BadInput
        for an invalid case.
    """
    if path is None:
        return OpenedPage(kind="contact", name="contact of the paper", case=default_case())
    name = path.name
    if path.is_dir():
        if is_history_folder(path):
            return OpenedPage(kind="history", name=name, case=load_history(path).case, path=path)
        if is_wear_folder(path):
            return OpenedPage(kind="history", name=name, case=load_wear(path).case, path=path)
        if (path / MANIFEST).is_file():
            return OpenedPage(kind="study", name=name, case=load_study(path).plan.case, path=path)
        return OpenedPage(kind="recordings", name=name, case=default_case(), path=path)
    if not path.exists():
        raise UnreadableFile(f"{path} does not exist; check its name")
    if path.suffix == ".nc":
        case, result = open_run(path)
        return OpenedPage(kind="contact", name=name, case=case, result=result, stated=True)
    case = load_case(path)
    if case.contents.grid.cells != "auto":
        limit_cells(case.source, case.contents.grid.cells)
    return OpenedPage(kind="contact", name=name, case=case, stated=True)
