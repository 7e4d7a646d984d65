"""Fixtures for the command-line tests: a command runner, a small emulator, a full disk."""

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from asperity.case import load_case
from asperity.cli import main
from asperity.inference import build_emulator, inference_setting
from asperity.monitoring.store import database
from support.emulated import CASE, SMALL

PAPER = (Path(__file__).parents[2] / "examples" / "paper.toml").read_text("utf-8")


@pytest.fixture(autouse=True)
def _without_workers(request):
    """Start worker processes only in tests marked `workers`, which compare both ways."""
    if request.node.get_closest_marker("workers") is None:
        request.getfixturevalue("in_this_process")


@pytest.fixture
def asp(tmp_path, monkeypatch, capsys, short_tracks):  # noqa: ARG001
    """Return a function that runs a command beside a small case: exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    few = "[solver]\nsurfaces = 1\nrunning_cells = 400"
    alone = PAPER.replace("[256, 256]", "[64, 64]").replace("[solver]", few)
    Path("case.toml").write_text(alone, "utf-8")

    def run(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            main(arguments)
        captured = capsys.readouterr()
        return end.value.code or 0, captured.out, captured.err

    return run


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """Settings, an emulator of a few small contacts, and its folder; tests that extend it use a
    copy.
    """
    folder = tmp_path_factory.mktemp("infer") / "emulator"
    setting = inference_setting(load_case(CASE).with_overrides(SMALL))
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as executor:
        patch.setattr("asperity.inference.emulator.FINER_POINTS", 3)
        yield setting, build_emulator(setting, folder=folder, executor=executor), folder


@pytest.fixture
def blank_figures(monkeypatch):
    """Draw the figures of pages, but do not render them, which takes most of a page's time.

    For tests of what pages are made from; of every kind of page, other tests render the figures.
    """

    def write(_: object, path: Path, **__: object) -> Path:
        path.write_bytes(b"")
        return path

    monkeypatch.setattr("asperity.report.base.svg", lambda _: "<svg/>")
    monkeypatch.setattr("asperity.report.base.write_figure", write)


@pytest.fixture
def two_passages(monkeypatch, short_tracks):  # noqa: ARG001
    """Solve running roughness over 2 passages of the Hertz zone, half of `short_tracks`."""
    for module in ("results.running", "transient.running"):
        monkeypatch.setattr(f"asperity.{module}.PASSAGES", 2)


@pytest.fixture
def page(shared):
    """Return the solved contact on the page that a file shares; a test leaves it as it found it."""
    yield shared.as_first()
    shared.require_no_error()


@pytest.fixture
def disk(monkeypatch):
    """A disk that is full while `full` is set: SQLite cannot write.

    While `closed`, the store cannot be opened either, except as an unchanging file: SQLite has no
    space for its index of a write-ahead log. While `lost`, not even that.
    """

    class Disk:
        full = closed = lost = False

    class Connection(sqlite3.Connection):
        file = ""

        def execute(self, statement, *values):
            on_disk = self.file != ":memory:"
            if on_disk and (Disk.lost or (Disk.closed and "immutable" not in self.file)):
                raise sqlite3.OperationalError("disk I/O error")
            if Disk.full and self.file != ":memory:" and statement.startswith(("INS", "UPD")):
                raise sqlite3.OperationalError("database or disk is full")
            return super().execute(statement, *values)

    def connect(file, **options):
        connection = original(file, factory=Connection, **options)
        connection.file = str(file)
        return connection

    original = sqlite3.connect
    monkeypatch.setattr(database.sqlite3, "connect", connect)
    yield Disk
    monkeypatch.undo()
