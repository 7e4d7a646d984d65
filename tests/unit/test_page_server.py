"""Who is let in, what is dropped where, what the page is opened with; and widgets that escape what
they show.
"""

import socket
import subprocess
import sys
from types import SimpleNamespace

import pytest

from asperity.core.errors import BadInput, UnreadableFile

pytest.importorskip("panel", reason="the extra page is not installed")

from asperity.app import open_page
from asperity.app.server import PASSWORD, origins, password_for, require_free
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
}


def test_on_this_machine_alone_nobody_needs_a_password(monkeypatch):
    monkeypatch.delenv(PASSWORD, raising=False)
    for address in ("127.0.0.1", "::1", "localhost"):
        assert password_for(address) is None
    assert origins("127.0.0.1", 5006) == ["127.0.0.1:5006", "localhost:5006"]


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.0.2.7", "example.org"])
@pytest.mark.parametrize("password", [None, "", "short"])
def test_others_are_let_in_with_a_password_only(monkeypatch, address, password):
    monkeypatch.delenv(PASSWORD, raising=False)
    if password is not None:
        monkeypatch.setenv(PASSWORD, password)
    with pytest.raises(
        BadInput, match=f"--listen {address} allows remote access, which requires a password"
    ):
        password_for(address)
    monkeypatch.setenv(PASSWORD, "long enough")
    assert password_for(address) == "long enough"


def test_a_pages_own_names_may_talk_to_it_and_no_others():
    assert origins("192.0.2.7", 80) == ["192.0.2.7:80"]
    assert origins("2001:db8::1", 80) == ["[2001:db8::1]:80"]
    everywhere = origins("0.0.0.0", 80)
    assert {"127.0.0.1:80", "localhost:80", f"{socket.gethostname()}:80"} <= set(everywhere)
    assert "*" not in "".join(everywhere)


def test_a_port_that_is_taken_is_named():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            BadInput, match=f"cannot listen on 127.0.0.1, port {port}: address already in use"
        ):
            require_free("127.0.0.1", port)
    assert 0 < require_free("127.0.0.1", 0) < 65536
    with pytest.raises(BadInput, match=r"cannot listen on 192\.0\.2\.7"):
        require_free("192.0.2.7", 0)


@pytest.mark.parametrize("name", NAMES)
def test_a_dropped_files_name_is_only_a_name(name):
    assert safe_name(name) == NAMES[name]


def drop_of(limit):
    paths, said = [], []
    return (
        FileDrop(limit=limit, on_file=paths.append, on_error=said.append, several=True),
        paths,
        said,
    )


def piece(number, total, data, name="a.csv"):
    about = {"name": name, "chunk": number, "total_chunks": total, "data": data, "type": ""}
    return SimpleNamespace(event_name="upload_event", data=about)


def test_a_dropped_file_goes_to_disk_piece_by_piece_and_with_the_session():
    drop, paths, said = drop_of(1_000_000)
    for number, data in enumerate((b"one,", b"two,", b"three"), 1):
        assert paths == []
        drop._process_event(piece(number, 3, data))
    assert paths[0].name == "a.csv"
    assert paths[0].read_bytes() == b"one,two,three"
    assert drop.value == {}  # nothing of it in memory
    drop._process_event(piece(1, 1, b"again"))
    assert [path.read_bytes() for path in paths] == [b"one,two,three", b"again"]
    drop.close()
    assert not paths[0].exists()
    assert said == []


@pytest.mark.parametrize(
    "pieces",
    [
        [(1, 2, b"x" * 600), (2, 2, b"x" * 600)],  # too much
        [(1, 3, b"x"), (3, 3, b"x")],  # one is missing
        [(1, "many", b"x")],
        [(1, 1, None)],
    ],
)
def test_what_is_too_large_or_damaged_is_not_taken(pieces):
    drop, paths, said = drop_of(1000)
    for arguments in pieces:
        drop._process_event(piece(*arguments))
    drop._process_event(piece(2, 2, b"late"))
    assert paths == []
    assert len(said) == 1
    drop.close()


def test_what_is_shown_is_escaped():
    assert sentences(["<script>"], '"') == '<p class="&#34;">&lt;script&gt;</p>'
    shown = SimpleNamespace(key="clr", name="<b>", value="<i>", uncertainty="<u>")
    result = SimpleNamespace(converged=True, row={})
    assert "<b>" not in tiles([shown], result, None, stale=False)
    assert "<dt>&lt;b&gt;</dt>" in tiles([shown], result, None, stale=False)


def test_the_page_is_opened_with_what_is_named(tmp_path):
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


def test_without_panel_the_extra_is_named():
    without = (
        "import sys; sys.modules['panel'] = None; from asperity.cli import main; main(['page',"
        " '--port', '0'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", without], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr == "error: the live page needs Panel; pip install 'asperity[page]'\n"
