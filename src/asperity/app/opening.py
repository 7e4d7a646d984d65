"""Opening of the page with a case, a run, or the folder of a study, history or recordings."""

from dataclasses import dataclass
from pathlib import Path

from asperity.app.contact_jobs import open_run
from asperity.app.contact_result import ContactResult
from asperity.app.inputs import MOST_PRESSED
from asperity.app.presets import PAPER, default_case
from asperity.app.settings import contact_of, limit_cells
from asperity.case import Case, MachineCase, has_machine, load_case, load_machine
from asperity.core.errors import UnreadableFile
from asperity.core.storage import MANIFEST
from asperity.simulation import is_history_folder, is_wear_folder, load_history, load_wear
from asperity.study import load_study

TABLE = "table.csv"  # of a folder of recordings


@dataclass(frozen=True, kw_only=True)
class OpenedPage:
    """First page, its name, the contact's case, and the path of a folder.

    `result` is the result of a stored run. `stated` is True if the user named the case. `table` is
    the csv file of a folder of recordings that places them in the series.
    """

    kind: str
    name: str
    case: Case | MachineCase
    result: ContactResult | None = None
    path: Path | None = None
    stated: bool = False
    table: Path | None = None
    preset: str = ""


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
        return OpenedPage(
            kind="contact", name="contact of the paper", case=default_case(), preset=PAPER
        )
    name = path.name
    if path.is_dir():
        if is_history_folder(path):
            return OpenedPage(kind="history", name=name, case=load_history(path).case, path=path)
        if is_wear_folder(path):
            return OpenedPage(kind="history", name=name, case=load_wear(path).case, path=path)
        if (path / MANIFEST).is_file():
            return OpenedPage(kind="study", name=name, case=load_study(path).plan.case, path=path)
        return _recordings(path)
    if not path.exists():
        raise UnreadableFile(f"{path} does not exist; check its name")
    if path.suffix == ".nc":
        case, result = open_run(path)
        return OpenedPage(kind="contact", name=name, case=case, result=result, stated=True)
    if has_machine(path):
        machine = load_machine(path)
        contact_of(machine, MOST_PRESSED)  # reports a machine whose contacts cannot be solved
        return OpenedPage(kind="contact", name=name, case=machine, stated=True)
    case = load_case(path)
    if case.contents.grid.cells != "auto":
        limit_cells(case.source, case.contents.grid.cells)
    return OpenedPage(kind="contact", name=name, case=case, stated=True)


def _recordings(folder: Path) -> OpenedPage:
    """Open a folder of recordings with its table and case, if it has one of each.

    The table is `table.csv`; the case is the only TOML file of the folder.
    """
    table, cases = folder / TABLE, sorted(folder.glob("*.toml"))
    case: Case | MachineCase = default_case()
    if len(cases) == 1:
        case = load_machine(cases[0]) if has_machine(cases[0]) else load_case(cases[0])
    return OpenedPage(
        kind="recordings",
        name=folder.name,
        case=case,
        path=folder,
        stated=len(cases) == 1,
        table=table if table.is_file() else None,
    )
