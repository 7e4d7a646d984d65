"""Access to the live page: own host names only, a token in the printed address, a password.

A web site can point its own name at this machine (DNS rebinding), so that a request is refused
unless its `Host` and `Origin` are names of this server. Other users of the machine and other web
sites do not have the cookie, which the token or the password gives.
"""

import asyncio
import html
import ipaddress
import os
import secrets
import socket
from collections import Counter
from hmac import compare_digest
from importlib.resources import files
from urllib.parse import urlencode

from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.template import Template
from tornado.web import Application, HTTPError, OutputTransform, RequestHandler

from asperity.core.errors import BadInput

LOCALHOST = "127.0.0.1"
PASSWORD = "ASPERITY_PAGE_PASSWORD"
MIN_PASSWORD = 8  # characters
MAX_BODY = 1000  # bytes of a request's body; uploads come by websocket
WRONG_PASSWORD_S = 1.0  # time that a wrong password takes, one at a time for all visitors
MAX_WAITING, MAX_WAITING_IN_ALL = 5, 20  # passwords that wait, of one address and of all
EVERY_INTERFACE = "0.0.0.0"
HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # with "no-referrer" a form would have no `Origin`
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}  # of every response
REFUSED_NAME = "This server accepts its own host names only. Open the printed address."
REFUSED_VISITOR = "Open the address that asperity page printed; it contains the token."

ENTRANCE = (
    '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>asperity</title>'
    '<link rel="icon" href="data:,"><meta http-equiv="refresh" content="0; url={0}"></head>'
    '<body><a href="{0}">Live page</a></body></html>'
)


def is_local(address: str) -> bool:
    """Return True for an address that only this machine reaches."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def password_for(address: str) -> str | None:
    """Return the password for remote access, None for a local address; BadInput if missing."""
    if is_local(address):
        return None
    password = os.environ.get(PASSWORD, "")
    if len(password) < MIN_PASSWORD:
        raise BadInput(
            f"--listen {address} allows remote access, which requires a password; set the "
            f"environment variable {PASSWORD} to at least {MIN_PASSWORD} characters, or omit "
            "--listen"
        )
    return password


def host_names(address: str, port: int) -> set[str]:
    """Return the values of `Host` that name a server on this address."""
    names = {LOCALHOST, "localhost"}
    if address == EVERY_INTERFACE:
        host = socket.gethostname().lower()
        names |= {host, f"{host}.local", socket.getfqdn().lower()}
    elif not is_local(address):
        names = {address.lower()}
    with_port = {f"{name}:{port}" for name in names}
    return names | with_port if port == 80 else with_port  # browsers omit port 80


class AccessPolicy:
    """Decision about each request to one server.

    Parameters
    ----------
    address, port : what the server listens on
    pages : paths of the pages without slash
    password : password for other machines; None: there is none
    """

    def __init__(
        self, address: str, port: int, pages: list[str], password: str | None = None
    ) -> None:
        self.token = secrets.token_urlsafe(24)
        self.cookie = f"asperity-{port}"  # cookies are shared by all ports of a host
        self.password = password
        self._address, self._port, self._pages = address, port, pages
        self._names = host_names(address, port)
        self._any_interface = address == EVERY_INTERFACE
        self._guess = asyncio.Lock()
        self._waiting: Counter[str] = Counter()

    def printed_address(self) -> str:
        """Return the address that admits its visitor."""
        name = LOCALHOST if self._any_interface else self._address
        return f"http://{name}:{self._port}/?token={self.token}"

    def install(self, application: Application) -> None:
        """Put the rule before all handlers of a Tornado application, and the headers after."""
        rule = Rule(_NotAdmitted(self), AccessHandler, {"policy": self})
        application.default_router.rules.insert(0, application.default_router.process_rule(rule))
        application.add_transform(_SecurityHeaders)

    def admits(self, request: HTTPServerRequest) -> bool:
        """Return True if a page may answer this request."""
        given = request.cookies.get(self.cookie)
        return (
            self.names_this_server(request)
            and "token" not in request.query_arguments  # which is removed from the address first
            and given is not None
            and compare_digest(given.value.encode(), self.token.encode())
        )

    def names_this_server(self, request: HTTPServerRequest) -> bool:
        """Return True if `Host`, and `Origin` if there is one, are names of this server."""
        hosts, origins = (request.headers.get_list(name) for name in ("Host", "Origin"))
        if len(hosts) != 1 or len(origins) > 1:
            return False
        names = self._names | self._interface(request)
        return hosts[0].lower() in names and all(
            origin.lower().removeprefix("http://") in names for origin in origins
        )

    def _interface(self, request: HTTPServerRequest) -> set[str]:
        """Return the address that the request came to, which no web site can take as its name."""
        stream = getattr(request.connection, "stream", None)
        if not self._any_interface or stream is None or stream.socket is None:
            return set()
        return {f"{stream.socket.getsockname()[0]}:{self._port}"}

    def page_address(self, request: HTTPServerRequest) -> str:
        """Return the requested page and its settings without the token; "/" for other paths."""
        page = request.path.removeprefix("/")
        pairs = [
            (name, value)
            for name, values in request.query_arguments.items()
            if name != "token"
            for value in values
        ]
        return f"/{page if page in self._pages else ''}{'?' if pairs else ''}{urlencode(pairs)}"

    async def accepts(self, password: str, address: str) -> bool:
        """Return True for the password; a wrong one takes a second, in turn.

        Raises
        ------
        tornado.web.HTTPError
            429 if too many of this address wait.
        """
        if self._waiting[address] >= MAX_WAITING or self._waiting.total() >= MAX_WAITING_IN_ALL:
            raise HTTPError(429)
        self._waiting[address] += 1
        try:
            async with self._guess:
                right = self.password is not None and compare_digest(
                    password.encode(), self.password.encode()
                )
                if not right:
                    await asyncio.sleep(WRONG_PASSWORD_S)
                return right
        finally:
            self._waiting[address] -= 1
            if not self._waiting[address]:
                del self._waiting[address]


class _NotAdmitted(Matcher):  # type: ignore[misc]
    """Matches the requests that no page may answer."""

    def __init__(self, policy: AccessPolicy) -> None:
        self._policy = policy

    def match(self, request: HTTPServerRequest) -> dict[str, object] | None:
        return None if self._policy.admits(request) else {}


class _SecurityHeaders(OutputTransform):  # type: ignore[misc]
    """Sets the headers of every response, and no permission for other web sites."""

    def __init__(self, request: HTTPServerRequest) -> None:
        pass

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, *_finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        headers.pop("Access-Control-Allow-Origin", None)
        headers.update(HEADERS)
        return status_code, headers, chunk


class AccessHandler(RequestHandler):  # type: ignore[misc]
    """Admits visitors with the token or the password, and refuses all others."""

    def initialize(self, policy: AccessPolicy) -> None:
        """Store the policy."""
        self._policy = policy

    def prepare(self) -> None:
        """Refuse requests with names of other servers."""
        self.set_header("Cache-Control", "no-store")
        if not self._policy.names_this_server(self.request):
            self._refuse(REFUSED_NAME)

    def get(self) -> None:
        """Admit a visitor with the token; otherwise ask for the password if there is one."""
        token = self.get_query_argument("token", "")
        if compare_digest(token.encode(), self._policy.token.encode()):
            self._admit()
            # not a redirect, whose request would have no cookie after a link on another site
            self.write(ENTRANCE.format(html.escape(self._policy.page_address(self.request))))
        elif self._policy.password is None or "Upgrade" in self.request.headers:
            self._refuse(REFUSED_VISITOR)
        elif self.request.path == "/login":
            self._ask_password(wrong=False)
        else:
            self.redirect("/login")

    async def post(self) -> None:
        """Admit a visitor with the password."""
        if self._policy.password is None or self.request.path != "/login":
            self._refuse(REFUSED_VISITOR)
            return
        password = self.get_body_argument("password", "", strip=False)
        if await self._policy.accepts(password, str(self.request.remote_ip)):
            self._admit()
            self.redirect("/", status=303)
        else:
            self.set_status(403)
            self._ask_password(wrong=True)

    def _admit(self) -> None:
        self.set_cookie(
            self._policy.cookie,
            self._policy.token,
            expires_days=None,
            httponly=True,
            samesite="Strict",
        )

    def _ask_password(self, *, wrong: bool) -> None:
        text = files("asperity.app.serving").joinpath("login.html").read_text("utf-8")
        self.write(Template(text).generate(wrong=wrong))

    def _refuse(self, reason: str) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{reason}\n")
