"""The server: on this machine alone unless asked otherwise, one document a visit, nothing fetched from elsewhere."""

import ipaddress
import logging
import os
import secrets
import socket
from collections.abc import Callable
from importlib.metadata import version
from importlib.resources import files
from typing import Any
from urllib.parse import urlencode

import panel
from bokeh.models import UIElement
from tornado.ioloop import PeriodicCallback
from tornado.iostream import StreamClosedError
from tornado.web import RedirectHandler
from tornado.websocket import WebSocketClosedError

from asperity.app import contact_page as contact
from asperity.app import history_page as history
from asperity.app import recordings_page as recordings
from asperity.app import study_page as study
from asperity.app.contact_jobs import ReportWriter
from asperity.app.jobs import Workshop
from asperity.app.opening import Opened
from asperity.app.session_cleanup import LOOK_MS as SWEPT_MS
from asperity.app.session_cleanup import Sweeper, settle
from asperity.app.settings import Settings
from asperity.app.surface_store import Shelf
from asperity.core.errors import BadInput

HERE = "127.0.0.1"
PORT = 5006
PASSWORD = "ASPERITY_PAGE_PASSWORD"
USER = "asperity"  # under whom everybody comes in; the page for the password says so
SHORTEST = 8  # characters of a password
LOOK_MS, FRAME_MS = 5000, 250  # between two looks at a folder, and two steps of a history
READY_MS = (
    4000  # after which figures are made, whether or not the browser has said that it has the page
)
# for a visitor that has not come yet: without the document it was sent it would see an empty page
WAIT_MS = 120_000
PING_S = 120  # between two questions whether a visitor is still there, who has as long to answer
MESSAGE = 24_000_000  # bytes that a browser may send at a time


def origins(address: str, port: int) -> list[str]:
    """Hosts whose pages may talk to the server: itself by the names that it has."""
    names = {HERE, "localhost"} if _local(address) else {address}
    if address in ("0.0.0.0", "::"):
        names = {HERE, "localhost", socket.gethostname()}
        names |= {str(found[4][0]) for found in socket.getaddrinfo(socket.gethostname(), None)}
    return sorted(f"[{name}]:{port}" if ":" in name else f"{name}:{port}" for name in names)


def _local(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def password_for(address: str) -> str | None:
    """The password that others have to know; None on this machine alone. BadInput where there has to be one."""
    if _local(address):
        return None
    given = os.environ.get(PASSWORD, "")
    if len(given) < SHORTEST:
        raise BadInput(
            f"--listen {address} lets others in, who need a password; put one of at least {SHORTEST} characters into "
            f"the environment variable {PASSWORD}, or leave --listen out"
        )
    return given


def require_free(address: str, port: int) -> int:
    """The port, or any that is free for 0; BadInput where it cannot be had."""
    try:
        with socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((address, port))
            return int(probe.getsockname()[1])
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise BadInput(
            f"cannot listen on {address}, port {port}: {reason}; choose another --port or --listen"
        ) from None
    except OverflowError:
        raise BadInput(f"--port must be 0 to 65535, got {port}") from None


_BLOCK: dict[str, Any] = {
    "heading": "",
    "live": False,
    "first": False,
    "key": (),
}  # of a page, where it says no more


class House:
    """All pages of one server, and the processes that work for them."""

    def __init__(self, opened: Opened, workshop: Workshop, write_report: ReportWriter) -> None:
        self.opened, self.workshop, self.write_report = opened, workshop, write_report
        self.shelf = Shelf()
        panel.extension("filedropper", notifications=False)
        self.template = files("asperity.app").joinpath("page.html.j2").read_text("utf-8")
        self.style = files("asperity.app").joinpath("style.css").read_text("utf-8")
        self.places = [("contact", "Contact"), ("recordings", "Recordings")]
        if opened.kind in ("study", "history"):
            self.places.append((opened.kind, opened.kind.capitalize()))

    def close(self) -> None:
        """Let go of what was dropped."""
        self.shelf.close()

    def contact(self) -> Any:
        """The page of a contact, for one visit."""
        view = contact.ContactView(
            Settings(self.opened.case),
            self.workshop,
            _deliver(),
            _address(),
            self.write_report,
            self.shelf,
        )
        parts, sections = contact.layout(view)
        view.begin(_query(), self.opened.answer)
        _document().on_event("document_ready", lambda _event: view.furnish())
        _document().add_timeout_callback(view.furnish, READY_MS)  # a browser may never say so
        _document().js_on_event("document_ready", view.old.tell)
        panel.state.on_session_destroyed(lambda _context: view.close())
        return self._page("contact", "Contact", parts, sections)

    def recordings(self) -> Any:
        """The page of recordings, for one visit."""
        folder = self.opened.path if self.opened.kind == "recordings" else None
        case = self.opened.case if self.opened.stated else None
        view = recordings.RecordingsView(folder, case, self.workshop, _deliver())
        panel.state.on_session_destroyed(lambda _context: view.close())
        if folder is not None:
            _document().add_periodic_callback(view.look, LOOK_MS)
            view.look()
        return self._page("recordings", "Recordings", *recordings.layout(view))

    def study(self) -> Any:
        """The page of a study, for one visit."""
        assert self.opened.path is not None
        view = study.StudyView(self.opened.path, self.opened.case, self.workshop, _deliver())
        panel.state.on_session_destroyed(lambda _context: view.close())
        view.begin()
        return self._page("study", "Study", *study.layout(view))

    def history(self) -> Any:
        """The page of a history, for one visit."""
        assert self.opened.path is not None
        view = history.HistoryView(self.opened.path, self.workshop, _deliver())
        panel.state.on_session_destroyed(lambda _context: view.close())
        _document().add_periodic_callback(view.advance, FRAME_MS)
        view.begin()
        return self._page("history", "History", *history.layout(view))

    def pages(self) -> dict[str, Callable[[], Any]]:
        """The pages by their places."""
        made = {
            "contact": self.contact,
            "recordings": self.recordings,
            "study": self.study,
            "history": self.history,
        }
        return {name: made[name] for name, _ in self.places}

    def _page(
        self, here: str, heading: str, parts: dict[str, Any], sections: list[dict[str, Any]]
    ) -> Any:
        page, document = panel.Template(self.template, location=True), _document()
        with document.models.freeze():  # the models are counted once, and not after every part
            for name, part in parts.items():
                if isinstance(part, UIElement):
                    part.name = name
                    document.add_root(part)
                else:
                    page.add_panel(name, part)
        for section in sections:
            section["blocks"] = [{**_BLOCK, **block} for block in section["blocks"]]
        told = {
            "heading": heading,
            "here": here,
            "places": self.places,
            "sections": sections,
            "style": self.style,
        }
        for name, value in {
            **told,
            "kind": here,
            "foot": f"asperity {version('asperity')}, {self.opened.name}",
        }.items():
            page.add_variable(name, value)
        return page


class _NobodyListens(logging.Filter):
    """Passes over what libraries say of a visitor that left in the middle of a message."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is told."""
        return not (
            record.exc_info and record.exc_info[0] in (WebSocketClosedError, StreamClosedError)
        )


def _quieten() -> None:
    """Let the terminal hear of mistakes, not of visitors that come and go."""
    logging.getLogger("asyncio").addFilter(_NobodyListens())
    for name in ("bokeh.server.views.ws", "tornado.access"):
        logging.getLogger(name).setLevel(logging.ERROR)


def _deliver() -> Callable[[Callable[[], None]], None]:
    """What lets a function run under the lock of the document that is being made, from any thread."""
    document = _document()

    def deliver(function: Callable[[], None]) -> None:
        if document.session_context is not None and not document.session_context.destroyed:
            document.add_next_tick_callback(function)

    return deliver


def _document() -> Any:
    """The document that is being made."""
    return panel.state.curdoc


def _address() -> Callable[[str], None]:
    """What puts a query into the address of the browser that is visiting."""
    location = panel.state.location

    def put(query: str) -> None:
        location.search = f"?{query}" if query else ""

    return put


def _query() -> str:
    """The query of the visit's address."""
    pairs = [
        (name, value.decode("utf-8", "replace"))
        for name, values in panel.state.session_args.items()
        if not name.startswith("bokeh-")
        for value in values
    ]
    return urlencode(pairs)


def serve_page(
    opened: Opened,
    *,
    port: int = PORT,
    listen: str = HERE,
    ready: Callable[[str], None],
    write_report: ReportWriter,
) -> None:
    """Serve the pages until interrupted.

    Parameters
    ----------
    opened : what is looked at
    port : 0 for any that is free
    listen : address to listen on; one that others can reach needs a password, in `ASPERITY_PAGE_PASSWORD`
    ready : called with the page's address when it can be visited
    write_report : makes the page of a run, `asperity.report.write_report`

    Raises
    ------
    BadInput
        for a port that is taken, an address that is none of this machine's, no password where there has to be one.
    """
    _quieten()
    password = password_for(listen)
    port = require_free(listen, port)
    workshop = Workshop()
    house = House(opened, workshop, write_report)
    try:
        workshop.warm()
        guarded: dict[str, Any] = {}
        if (
            password is not None
        ):  # by a name of its own: Panel would take a password alone for a file's, if there is one
            login = str(files("asperity.app").joinpath("login.html.j2"))
            guarded = {"basic_auth": {USER: password}, "basic_login_template": login}
            guarded["cookie_secret"] = secrets.token_hex(32)
        server = panel.serve(
            house.pages(),
            port=port,
            address=listen,
            websocket_origin=origins(listen, port),
            show=False,
            start=False,
            verbose=False,
            title="asperity",
            use_index=False,
            extra_patterns=[("/", RedirectHandler, {"url": f"/{opened.kind}", "permanent": False})],
            # Bokeh's own takes the session from a socket that has still to close
            keep_alive_milliseconds=0,
            websocket_ping_interval=PING_S,
            check_unused_sessions_milliseconds=SWEPT_MS,
            unused_session_lifetime_milliseconds=WAIT_MS,
            websocket_max_message_size=MESSAGE,
            **guarded,
        )
        server.start()
        settle()
        PeriodicCallback(Sweeper(server.get_sessions).look, SWEPT_MS).start()
        ready(f"http://{f'[{listen}]' if ':' in listen else listen}:{port}/")
        server.io_loop.start()
    finally:
        workshop.close()
        house.close()
