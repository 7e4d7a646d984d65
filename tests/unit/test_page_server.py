"""Access, file upload and start-up of the page; widgets escape what they show."""

import asyncio
import socket
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest

from asperity.core.errors import BadInput, UnreadableFile

pytest.importorskip("panel", reason="the extra page is not installed")

from asperity.app import open_page, uploads
from asperity.app.serving import server
from asperity.app.serving.access import PASSWORD, host_names, password_for
from asperity.app.serving.server import require_free
from asperity.app.uploads import FileDrop, safe_name
from asperity.app.widgets import sentences, tiles

NAMES = {
    "ring.x3p": "ring.x3p",
    "../../etc/passwd": "passwd",
    "..\\..\\boot.ini": "boot.ini",
    "a b$(rm -rf).csv": "a_b_rm_-rf_.csv",
    "<b>.npy": "_b_.npy",
    ".hidden": "hidden",
    "...": "file",
    "-rf": "rf",
    "x" * 300 + ".csv": "x" * 76 + ".csv",
    "\x00\n": "_",
    "..%2f..%2fetc%2fpasswd.x3p": "_2f.._2fetc_2fpasswd.x3p",
    "`touch pwned`.x3p": "_touch_pwned_.x3p",
    "{file=1}\n[surface].x3p": "_file_1_surface_.x3p",
}


def test_local_access_needs_no_password(monkeypatch):
    monkeypatch.delenv(PASSWORD, raising=False)
    for address in ("127.0.0.1", "::1", "localhost"):
        assert password_for(address) is None
    assert host_names("127.0.0.1", 5006) == {"127.0.0.1:5006", "localhost:5006"}


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.0.2.7", "example.org"])
@pytest.mark.parametrize("password", [None, "", "short"])
def test_remote_access_needs_a_password(monkeypatch, address, password):
    monkeypatch.delenv(PASSWORD, raising=False)
    if password is not None:
        monkeypatch.setenv(PASSWORD, password)
    with pytest.raises(
        BadInput, match=f"--listen {address} allows remote access, which requires a password"
    ):
        password_for(address)
    monkeypatch.setenv(PASSWORD, "long enough")
    assert password_for(address) == "long enough"


def test_a_server_answers_to_its_own_host_names():
    assert host_names("192.0.2.7", 80) == {"192.0.2.7", "192.0.2.7:80"}
    assert host_names("Example.org", 81) == {"example.org:81"}
    all_interfaces = host_names("0.0.0.0", 81)
    host = socket.gethostname().lower()
    assert {"127.0.0.1:81", "localhost:81", f"{host}:81", f"{host}.local:81"} <= all_interfaces
    assert "*" not in "".join(all_interfaces)


def test_an_occupied_port_is_named():
    with socket.socket() as occupied:
        occupied.bind(("127.0.0.1", 0))
        occupied.listen()
        port = occupied.getsockname()[1]
        with pytest.raises(
            BadInput, match=f"cannot listen on 127.0.0.1, port {port}: address already in use"
        ):
            require_free("127.0.0.1", port)
    assert 0 < require_free("127.0.0.1", 0) < 65536
    with pytest.raises(BadInput, match=r"cannot listen on 192\.0\.2\.7"):
        require_free("192.0.2.7", 0)
    for address in ("::1", "::", "2001:db8::1"):
        with pytest.raises(BadInput, match="--listen needs an IPv4 address"):
            require_free(address, 0)


@pytest.mark.parametrize("name", NAMES)
def test_an_uploaded_files_name_has_no_path(name):
    assert safe_name(name) == NAMES[name]


def drop_of(limit):
    paths, errors = [], []
    return (
        FileDrop(limit=limit, on_file=paths.append, on_error=errors.append, several=True),
        paths,
        errors,
    )


def piece(number, total, data, name="a.csv"):
    about = {"name": name, "chunk": number, "total_chunks": total, "data": data, "type": ""}
    return SimpleNamespace(event_name="upload_event", data=about)


def test_an_upload_is_written_in_chunks_and_removed_with_its_session():
    drop, paths, errors = drop_of(1_000_000)
    for number, data in enumerate((b"one,", b"two,", b"three"), 1):
        assert paths == []
        drop._process_event(piece(number, 3, data))
    assert paths[0].name == "a.csv"
    assert paths[0].read_bytes() == b"one,two,three"
    assert drop.value == {}  # nothing stays in memory
    drop._process_event(piece(1, 1, b"again"))
    assert [path.read_bytes() for path in paths] == [b"one,two,three", b"again"]
    drop.close()
    assert not paths[0].exists()
    assert errors == []


@pytest.mark.parametrize(
    "pieces",
    [
        [(1, 2, b"x" * 600), (2, 2, b"x" * 600)],  # over the limit
        [(1, 3, b"x"), (3, 3, b"x")],  # one chunk is missing
        [(1, "many", b"x")],
        [(1, float("inf"), b"x")],
        [(1, 1, None)],
        [(1, 1, 10**12)],
    ],
)
def test_too_large_or_damaged_uploads_are_refused(pieces):
    drop, paths, errors = drop_of(1000)
    for arguments in pieces:
        drop._process_event(piece(*arguments))
    drop._process_event(piece(2, 2, b"late"))
    assert paths == []
    assert len(errors) == 1
    drop.close()


def test_the_uploads_of_a_visit_are_limited(monkeypatch):
    monkeypatch.setattr(uploads, "MAX_VISIT", 2500)
    drop, paths, errors = drop_of(1000)
    for _ in range(5):
        drop._process_event(piece(1, 2, b"x" * 800))  # restarted under one name
    assert len(errors) == 2
    assert "in one visit" in errors[0]
    kept = sum(path.stat().st_size for path in drop.folder.rglob("*.csv"))
    assert (paths, kept <= 800) == ([], True)
    drop.close()
    monkeypatch.setattr(uploads, "MAX_FILES", 3)
    drop, paths, errors = drop_of(1000)
    for number in range(5):
        drop._process_event(piece(1, 1, b"x", f"{number}.csv"))
    assert (len(paths), len(errors)) == (3, 2)
    assert len(list(drop.folder.iterdir())) == 3
    drop.close()


def test_displayed_text_is_escaped():
    assert sentences(["<script>"], '"') == '<p class="&#34;">&lt;script&gt;</p>'
    tile = SimpleNamespace(key="clr", name="<b>", value="<i>", uncertainty="<u>")
    result = SimpleNamespace(converged=True, row={})
    assert "<b>" not in tiles([tile], result, None, stale=False)
    assert "<dt>&lt;b&gt;</dt>" in tiles([tile], result, None, stale=False)


def test_the_page_opens_with_the_named_files(tmp_path):
    assert (open_page(None).kind, open_page(None).case.grid.cells) == ("contact", (192, 128))
    (tmp_path / "manifest.json").write_text("{}", "utf-8")
    with pytest.raises(UnreadableFile, match="has no digest"):
        open_page(tmp_path)
    (tmp_path / "recordings").mkdir()
    assert open_page(tmp_path / "recordings").kind == "recordings"
    with pytest.raises(UnreadableFile, match="does not exist"):
        open_page(tmp_path / "absent.toml")
    (tmp_path / "case.toml").write_text("[contact]\n", "utf-8")
    with pytest.raises(BadInput, match="is missing"):
        open_page(tmp_path / "case.toml")


def test_a_missing_panel_names_the_extra():
    without = (
        "import sys; sys.modules['panel'] = None; from asperity.cli import main; main(['page',"
        " '--port', '0'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", without], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr == (
        "error: the live page needs Panel; pip install 'asperity[page]', in a clone pip install "
        "'.[page]'\n"
    )


def test_results_of_jobs_reach_the_document_in_the_thread_of_the_server(monkeypatch):
    """One page in some fifty stayed at "Solving ..." when the thread of a job added a callback."""
    threads = []
    document = SimpleNamespace(
        session_context=SimpleNamespace(destroyed=False),
        add_next_tick_callback=lambda function: (threads.append(threading.get_ident()), function()),
    )
    monkeypatch.setattr(server, "_document", lambda: document)

    async def visit():
        deliver, done = server._callback_scheduler(), asyncio.Event()
        await asyncio.to_thread(deliver, done.set)
        await asyncio.wait_for(done.wait(), 10.0)

    asyncio.run(visit())
    assert threads == [threading.get_ident()]
