"""Access to the live page over real sockets: who is refused, and what a refused visitor costs."""

import http.client
import os
import re
import resource
import socket
import threading
import time
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from support.browser import ONE_WORKER, Visit, chromium, serving, write_small_contact

pytest.importorskip("panel", reason="the extra page is not installed")

PASSWORD = "long enough"
PATHS = [
    "/",
    "/contact",
    "/contact/",
    "/contact/ws",
    "/contact/autoload.js?bokeh-autoload-element=1&bokeh-absolute-url=http://evil.example/contact",
    "/contact/metadata",
    "/recordings",
    "/static/js/bokeh.min.js",
    "/static/extensions/panel/panel.min.js",
    "/components/none",
    "/login",
    "/absent",
]
WEBSOCKET = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Protocol": "bokeh",
}
FOREIGN = [  # Host and Origin, of which PORT is the server's
    ("evil.example:PORT", "http://evil.example:PORT"),
    ("evil.example:PORT", None),
    ("evil.example", "http://evil.example"),
    ("127.0.0.1:PORT", "http://evil.example:PORT"),
    ("127.0.0.1:PORT", "https://127.0.0.1:PORT"),
    ("127.0.0.1:PORT", "null"),
    ("127.0.0.1:PORT", ""),
    ("127.0.0.1:1", None),
    ("127.0.0.1", None),
    ("127.0.0.1.evil.example:PORT", None),
    ("evil.example@127.0.0.1:PORT", None),
    ("", None),
    (None, None),
    ("169.254.1.1:PORT", None),
]

IDLE_S = 5  # in place of 20 s, after which the server closes a silent connection
SHORT_IDLE = f"""
from asperity.app.serving import server
assert 0.0 < server.HTTP_LIMITS["idle_connection_timeout"] <= 60.0
server.HTTP_LIMITS["idle_connection_timeout"] = {IDLE_S}
{ONE_WORKER}
"""

HOSTILE_HEADERS = [  # together unless the server may refuse the request for one of them
    {"Host": "evil.example"},
    {"Host": '"><script>pwned</script>'},
    {"Cookie": "is_guest=1; user=<script>pwned</script>"},
    {"Bokeh-Session-Id": "<script>pwned</script>"},
    {
        "X-Forwarded-Host": "<script>pwned</script>",
        "X-Forwarded-Proto": "javascript",
        "X-Forwarded-Prefix": "/<script>pwned</script>",
        "Referer": "<script>pwned</script>",
        "User-Agent": "<script>pwned</script>",
        "Accept-Language": "{{7*7}}<script>pwned</script>",
    },
]


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Serve a contact, started with the usual limit of 256 open files."""
    folder = tmp_path_factory.mktemp("local")
    name = write_small_contact(folder)
    with ExitStack() as stack:
        limits = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, limits[1]))
        try:
            started = stack.enter_context(serving(folder, name, program=("-c", SHORT_IDLE)))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)
        yield started


@pytest.fixture(scope="module")
def remote(tmp_path_factory):
    folder = tmp_path_factory.mktemp("remote")
    with serving(folder, "--listen", "0.0.0.0", ASPERITY_PAGE_PASSWORD=PASSWORD) as started:
        yield started


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


def ask(server, path, headers=(), method="GET", body=b""):
    """Send a request over a socket; return status, headers and body."""
    port = server.host.rpartition(":")[2]
    lines = [f"{method} {path} HTTP/1.1"]
    names = {"Host": server.host, "Connection": "close", **dict(headers)}
    lines += [f"{name}: {value}" for name, value in names.items() if value is not None]
    if body:
        lines.append("Content-Type: application/x-www-form-urlencoded")
        lines.append(f"Content-Length: {len(body)}")
    with socket.create_connection(("127.0.0.1", int(port)), timeout=30) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode() + body)
        reply = http.client.HTTPResponse(connection)
        reply.begin()
        text = b"" if reply.status == 101 else reply.read()
    return reply.status, reply.headers, text.decode("utf-8", "replace")


def processor_seconds(*processes):
    """Return the processor time of processes [s]."""
    ticks = 0
    for process in processes:
        stat = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()
        ticks += int(stat[11]) + int(stat[12])
    return ticks / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("path", PATHS)
def test_a_visitor_without_the_cookie_gets_nothing(server, path):
    for cookie in ({}, {"Cookie": "asperity-1=x"}, {"Cookie": re.sub("=.*", "=x", str(path))}):
        status, headers, text = ask(server, path, {**cookie, **WEBSOCKET})
        assert (status, "Set-Cookie" in headers) == (403, False)
        assert len(text) < 200
    assert ask(server, path)[0] == 403
    assert ask(server, path + ("&" if "?" in path else "?") + "token=wrong")[0] == 403


@pytest.mark.parametrize(("host", "origin"), FOREIGN)
def test_names_of_other_servers_are_refused_although_the_cookie_is_right(server, host, origin):
    port = server.host.rpartition(":")[2]
    given = {
        name: value and value.replace("PORT", port)
        for name, value in {"Host": host, "Origin": origin}.items()
    }
    for path in PATHS:
        for more in ({}, WEBSOCKET):
            status, _, text = ask(server, path, {**given, **server.cookie, **more})
            assert status in (400, 403), path
            assert "evil" not in text
    status, headers, _ = ask(server, f"/?token={server.token}", given)
    assert (status in (400, 403), "Set-Cookie" in headers) == (True, False)


@pytest.mark.parametrize("header", HOSTILE_HEADERS, ids=lambda header: next(iter(header)))
def test_a_header_does_not_appear_in_the_page(server, header):
    status, headers, text = ask(server, "/contact", {**server.cookie, **header})
    assert status in ((200,) if len(header) > 1 else (200, 400, 403))
    for hostile in ("pwned", "evil.example", "{{7*7}}"):
        assert hostile not in f"{headers.items()} {text}"


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:1", "null", "http://127.0.0.1.evil.example"]
)
def test_a_websocket_of_a_foreign_origin_gets_403(server, origin):
    headers = {**server.cookie, **WEBSOCKET, "Origin": origin}
    assert ask(server, "/contact/ws", headers)[0] == 403


def test_the_first_address_opens_the_contact(server):
    status, headers, _ = ask(server, "/", server.cookie)
    assert (status, headers["Location"]) == (302, "/contact")


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "LOCALHOST"])
def test_an_admitted_visitor_gets_page_and_websocket(server, name):
    host = f"{name}:{server.host.rpartition(':')[2]}"
    status, _, text = ask(server, "/contact", {"Host": host, **server.cookie})
    assert (status, "Bokeh" in text) == (200, True)
    headers = {"Host": host, "Origin": f"http://{host}", **server.cookie, **WEBSOCKET}
    token = re.search(r'"token":"([^"]+)"', text)[1]
    headers["Sec-WebSocket-Protocol"] = f"bokeh, {token}"
    assert ask(server, "/contact/ws", headers)[0] == 101


def test_every_response_forbids_frames_and_other_origins(server, remote):
    answers = [ask(server, path, server.cookie) for path in PATHS if not path.endswith("/ws")]
    answers += [ask(server, path) for path in PATHS]
    answers += [ask(remote, "/login"), ask(server, f"/?token={server.token}")]
    assert {status for status, _, _ in answers} >= {200, 302, 403, 404}
    for _, headers, _ in answers:
        assert headers["Content-Security-Policy"] == "frame-ancestors 'none'"
        assert headers["X-Frame-Options"] == "DENY"
        assert headers["Referrer-Policy"] == "same-origin"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert "Access-Control-Allow-Origin" not in headers


def test_the_printed_address_gives_a_strict_cookie_and_disappears(server, browser):
    status, headers, text = ask(server, f"/contact?token={server.token}&contact.load=600+N")
    cookie = headers["Set-Cookie"]
    assert (status, headers["Cache-Control"]) == (200, "no-store")
    assert cookie.startswith(server.cookie["Cookie"])
    assert {"HttpOnly", "Path=/", "SameSite=Strict"} <= set(cookie.split("; "))
    assert "expires" not in cookie.lower()
    assert 'content="0; url=/contact?contact.load=600+N"' in text
    assert server.token not in text
    visit = Visit(browser, server, admitted=False)
    visit.page.goto(f"{server.url}contact?token={server.token}&contact.load=600+N")
    visit.page.get_by_text(re.compile("^Solved on")).wait_for()
    assert "token" not in visit.page.url
    assert "contact.load=600" in visit.page.url
    visit.close()


@pytest.mark.parametrize(
    "path", ["//evil.example", "/login?next=///evil.example", "/%2f/evil.example"]
)
def test_no_answer_leads_to_another_host(server, remote, path):
    joint = "&" if "?" in path else "?"
    for _, headers, text in (
        ask(server, f"{path}{joint}token={server.token}"),
        ask(server, path, server.cookie),
        ask(remote, path),
        ask(remote, path, method="POST", body=f"password={PASSWORD}".encode()),
    ):
        assert headers.get("Location", "/") in ("/", "/login", "/contact")
        assert re.search(r'url=(?!/\?|/")', text) is None


def test_requests_alone_start_no_work(server):
    """Image tags of another web site started a solve each, and created figures 4 s later."""
    ask(server, "/contact", server.cookie)
    quiet = 0
    while quiet < 3:  # times, until all workers have loaded the solver
        before = processor_seconds(*server.workers)
        time.sleep(0.5)
        quiet = quiet + 1 if processor_seconds(*server.workers) - before < 0.03 else 0
    before = processor_seconds(*server.workers)
    for number in range(4):
        status, _, _ = ask(server, f"/contact?contact.load={500 + number}+N", server.cookie)
        assert status == 200
    answered = processor_seconds(server.process.pid)
    time.sleep(6.0)
    assert processor_seconds(*server.workers) - before < 0.1
    assert processor_seconds(server.process.pid) - answered < 0.5  # a page's figures take 0.3 s


class Site(BaseHTTPRequestHandler):
    """Another web site on this machine, whose pages hold the live page."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(self.server.page.encode())

    def log_message(self, *_arguments):
        pass


def test_a_page_of_another_site_can_neither_hold_nor_read_nor_connect(server, browser):
    site = HTTPServer(("127.0.0.1", 0), Site)  # another port: the cookie is sent, the worst case
    site.page = f"""<iframe src="{server.url}contact"></iframe><script>
      const socket = new WebSocket("ws://{server.host}/contact/ws", ["bokeh", "x"])
      const opened = new Promise(done => {{ socket.onopen = () => done("open")
        socket.onerror = () => done("refused") }})
      const read = fetch("{server.url}contact", {{credentials: "include"}})
        .then(() => "read", () => "refused")
      window.outcome = Promise.all([opened, read])</script>"""
    threading.Thread(target=site.serve_forever, daemon=True).start()
    visit = Visit(browser, server, alone=True)
    visit.page.goto(f"http://127.0.0.1:{site.server_port}/")
    assert visit.page.evaluate("() => window.outcome") == ["refused", "refused"]
    visit.page.wait_for_timeout(500)
    assert len(visit.page.frames) == 2
    assert "Bokeh" not in visit.page.frames[1].content()
    visit.context.close()
    site.shutdown()
    site.server_close()


def log_in(server, password, seconds):
    """Send a password; store the status and the time [s] of the answer."""
    began = time.monotonic()
    status, headers, _ = ask(server, "/login", method="POST", body=b"password=" + password.encode())
    seconds.append((status, time.monotonic() - began))
    return headers


def test_wrong_passwords_take_a_second_each_however_many_are_sent(remote):
    answers, began = [], time.monotonic()
    threads = [
        threading.Thread(target=log_in, args=(remote, f"guess {number}", answers))
        for number in range(30)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    statuses = [status for status, _ in answers]
    assert (statuses.count(403), statuses.count(429)) == (5, 25)
    assert time.monotonic() - began >= 5.0
    headers = log_in(remote, PASSWORD, answers)
    assert answers[-1][0] == 303
    assert headers["Location"] == "/"
    cookie = headers["Set-Cookie"]
    assert "SameSite=Strict" in cookie
    assert ask(remote, "/contact", {"Cookie": cookie.partition(";")[0]})[0] == 200


def test_idle_connections_do_not_stop_the_server(server):
    """400 connections without a request, where 256 open files are permitted by default."""
    limits = Path(f"/proc/{server.process.pid}/limits").read_text("utf-8")
    assert int(re.search(r"Max open files +(\d+)", limits)[1]) > 400  # raised by the server itself
    port = int(server.host.rpartition(":")[2])
    idle = [socket.create_connection(("127.0.0.1", port), timeout=5) for _ in range(400)]
    assert ask(server, "/contact", server.cookie)[0] == 200
    idle[0].settimeout(60.0)
    assert idle[0].recv(1) == b""  # closed by the server
    for connection in idle:
        connection.close()
    assert server.log.stat().st_size < 10_000


@pytest.mark.parametrize("size", [2_000, 33_000_000])
def test_a_large_password_is_refused_at_once(remote, size):
    port = int(remote.host.rpartition(":")[2])
    before = time.monotonic()
    with socket.create_connection(("127.0.0.1", port), timeout=30) as connection:
        head = f"POST /login HTTP/1.1\r\nHost: {remote.host}\r\nContent-Length: {size}\r\n\r\n"
        connection.sendall(head.encode() + b"password=" + b"x" * 1000)
        assert b" 400 " in connection.recv(100)
    assert time.monotonic() - before < 1.0


def test_a_password_opens_the_page_in_a_browser(remote, browser):
    visit = Visit(browser, remote, admitted=False)
    page = visit.page
    page.goto(f"http://{remote.host}/contact")
    assert page.url == f"http://{remote.host}/login"
    page.locator("input[type=password]").fill("wrong one")
    page.keyboard.press("Enter")
    page.get_by_text("Wrong password.").wait_for()
    assert visit.errors.pop().endswith("403 (Forbidden)")
    assert page.get_by_role("textbox", name="Load, F").count() == 0
    page.locator("input[type=password]").fill(PASSWORD)
    page.keyboard.press("Enter")
    page.get_by_role("textbox", name="Load, F").wait_for()  # sent over the websocket
    visit.close()


def test_remote_visitors_need_the_password(remote):
    for path in PATHS:
        status, headers, text = ask(remote, path)
        assert "Bokeh" not in text
        expected = (200, None) if path == "/login" else (302, "/login")
        assert (status, headers["Location"]) == expected
        assert ask(remote, path, WEBSOCKET)[0] == 403
    assert ask(remote, "/contact", {**remote.cookie, "Host": "evil.example"})[0] == 403
    address = socket.gethostbyname(socket.gethostname())
    for name in (socket.gethostname(), address if address == "127.0.0.1" else "localhost"):
        host = f"{name}:{remote.host.rpartition(':')[2]}"
        assert ask(remote, "/contact", {**remote.cookie, "Host": host})[0] == 200
