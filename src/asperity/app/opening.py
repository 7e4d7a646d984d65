"""What the page is opened with: a case, a kept run, the folder of a study, a history, wear or recordings; nothing."""

from dataclasses import dataclass
from pathlib import Path

from asperity.app.contact_jobs import open_run
from asperity.app.contact_result import Answer
from asperity.app.settings import require_few
from asperity.case import Case, load_case
from asperity.core.errors import UnreadableFile
from asperity.core.storage import MANIFEST
from asperity.paper import papers_case
from asperity.simulation import is_history_folder, is_wear_folder, load_history, load_wear
from asperity.study import load_study

FIRST = {
    "grid.cells": [192, 128]
}  # of the paper's contact, where nothing is named; 128 x 128 cannot tell its CLR


@dataclass(frozen=True, kw_only=True)
class Opened:
    """What is looked at: which page comes first, its name, the contact, and the path of what else there is.

    `answer` is the contact's where it is solved already. `stated` says whether the case was named,
    and not the paper's.
    """

    kind: str
    name: str
    case: Case
    answer: Answer | None = None
    path: Path | None = None
    stated: bool = False


def paper() -> Case:
    """The paper's contact on cells that are solved while one waits."""
    return papers_case().with_overrides(FIRST)


def open_page(what: Path | None) -> Opened:
    """Read what the page is opened with.

    Raises
    ------
    UnreadableFile
        for a path that leads nowhere, or to a file that is neither a case nor a run.
    BadInput
        for a case that is refused.
    """
    if what is None:
        return Opened(kind="contact", name="the paper's contact", case=paper())
    if what.is_dir():
        if is_history_folder(what):
            return Opened(kind="history", name=what.name, case=load_history(what).case, path=what)
        if is_wear_folder(what):
            return Opened(kind="history", name=what.name, case=load_wear(what).case, path=what)
        if (what / MANIFEST).is_file():
            return Opened(kind="study", name=what.name, case=load_study(what).plan.case, path=what)
        return Opened(kind="recordings", name=what.name, case=paper(), path=what)
    if not what.exists():
        raise UnreadableFile(f"{what} does not exist; check its name")
    if what.suffix == ".nc":
        case, answer = open_run(what)
        return Opened(kind="contact", name=what.name, case=case, answer=answer, stated=True)
    case = load_case(what)
    if case.contents.grid.cells != "auto":
        require_few(case.source, case.contents.grid.cells)
    return Opened(kind="contact", name=what.name, case=case, stated=True)
