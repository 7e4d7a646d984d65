"""Server of the live page: local by default, one document per visit, no external resources."""

import errno
import logging
import socket
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib.metadata import version
from importlib.resources import files
from typing import Any
from urllib.parse import urlencode

import panel
from bokeh.models import UIElement
from tornado.ioloop import IOLoop, PeriodicCallback
from tornado.iostream import StreamClosedError
from tornado.web import RedirectHandler
from tornado.websocket import WebSocketClosedError

from asperity.app import contact_page as contact
from asperity.app import history_page as history
from asperity.app import recordings_page as recordings
from asperity.app import study_page as study
from asperity.app.jobs import VisitPool, WorkerPool
from asperity.app.opening import OpenedPage
from asperity.app.recording_jobs import RecordingContext
from asperity.app.serving.access import LOCALHOST, MAX_BODY, AccessPolicy, password_for
from asperity.app.serving.session_cleanup import CLEANUP_MS, SessionSweeper, freeze_objects
from asperity.app.settings import Settings
from asperity.app.surface_store import SurfaceStore
from asperity.app.widgets import PageBlock, PageSection
from asperity.case import Case
from asperity.core.errors import BadInput

PORT = 5006
FOLDER_CHECK_MS, FRAME_MS = 5000, 250  # intervals of folder checks, and of frames of a history
CONNECTION_CHECK_MS = 50  # interval, until the browser of a visit is connected
READY_MS = 4000  # figures are created after this time of a connection even without a ready event
UNUSED_MS = 120_000  # lifetime of a session before its browser connects
PING_S = 120  # interval of keep-alive pings, and the time to answer
HTTP_LIMITS = {  # sizes [bytes], and times [s] after which a silent connection is closed
    "max_body_size": MAX_BODY,
    "max_header_size": 16_384,
    "idle_connection_timeout": 20,
    "body_timeout": 10,
}
MAX_MESSAGE = 24_000_000  # bytes that a browser may send at a time


def require_free(address: str, port: int) -> int:
    """Return the port, or a free one for 0; raise BadInput if it is not available."""
    if ":" in address:
        raise BadInput(f"--listen needs an IPv4 address or a host name, got {address}; use 0.0.0.0")
    try:
        with socket.socket() as probe:
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


_BLOCK: PageBlock = {
    "heading": "",
    "live": False,
    "first": False,
    "key": (),
}  # defaults of a block of a page


class PageSite:
    """All pages of one server, and their worker processes."""

    def __init__(
        self, opened: OpenedPage, worker_pool: WorkerPool, tools: contact.ReportTools
    ) -> None:
        self.opened, self.worker_pool, self.tools = opened, worker_pool, tools
        self.surfaces = SurfaceStore()
        panel.extension("filedropper", notifications=False)
        self.template = files("asperity.app").joinpath("page.html.j2").read_text("utf-8")
        self.style = files("asperity.app").joinpath("style.css").read_text("utf-8")
        self.links = [("contact", "Contact"), ("recordings", "Recordings")]
        if opened.kind in ("study", "history"):
            self.links.append((opened.kind, opened.kind.capitalize()))

    def close(self) -> None:
        """Remove the dropped files."""
        self.surfaces.close()

    def contact(self) -> Any:
        """Create the page of a contact for one visit."""
        pool, document = self._visit_pool(), _document()
        view = contact.ContactView(
            Settings(self.opened.case, preset=self.opened.preset),
            pool,
            _callback_scheduler(),
            _address(),
            self.tools,
            self.surfaces,
        )
        parts, sections = contact.layout(view)
        view.begin(_query(), self.opened.result)
        document.on_event("document_ready", lambda _event: view.create_next_figure())
        pool.when_connected(
            partial(document.add_timeout_callback, view.create_next_figure, READY_MS)
        )  # in case the event never arrives
        document.js_on_event("document_ready", view.stale_mark.update_page)
        panel.state.on_session_destroyed(lambda _context: view.close())
        return self._page("contact", "Contact", parts, sections, headline=view.strip.html)

    def recordings(self) -> Any:
        """Create the page of recordings for one visit."""
        folder = self.opened.path if self.opened.kind == "recordings" else None
        context = RecordingContext(
            self.opened.case if self.opened.stated else None, self.opened.table
        )
        view = recordings.RecordingsView(folder, context, self._visit_pool(), _callback_scheduler())
        panel.state.on_session_destroyed(lambda _context: view.close())
        if folder is not None:
            _document().add_periodic_callback(view.refresh, FOLDER_CHECK_MS)
            view.refresh()
        return self._page("recordings", "Recordings", *recordings.layout(view))

    def study(self) -> Any:
        """Create the page of a study for one visit."""
        assert self.opened.path is not None
        assert isinstance(self.opened.case, Case)
        view = study.StudyView(
            self.opened.path, self.opened.case, self._visit_pool(), _callback_scheduler()
        )
        panel.state.on_session_destroyed(lambda _context: view.close())
        view.begin()
        return self._page("study", "Study", *study.layout(view))

    def history(self) -> Any:
        """Create the page of a history for one visit."""
        assert self.opened.path is not None
        view = history.HistoryView(self.opened.path, self._visit_pool(), _callback_scheduler())
        panel.state.on_session_destroyed(lambda _context: view.close())
        _document().add_periodic_callback(view.advance, FRAME_MS)
        view.begin()
        return self._page("history", "History", *history.layout(view))

    def pages(self) -> dict[str, Callable[[], Any]]:
        """Return the functions that create the pages, by path."""
        creators = {
            "contact": self.contact,
            "recordings": self.recordings,
            "study": self.study,
            "history": self.history,
        }
        return {name: creators[name] for name, _ in self.links}

    def _folder_name(self, kind: str) -> str:
        """Return the folder that a page shows; empty for pages whose content visitors choose."""
        return f", {self.opened.name}" if kind in ("study", "history") else ""

    def _visit_pool(self) -> VisitPool:
        """Return the worker pool of the current visit, which starts when its browser connects."""
        pool, document = VisitPool(self.worker_pool), _document()

        def check() -> None:
            session = document.session_context and document.session_context.session
            if session and session.connection_count > 0:
                document.remove_periodic_callback(periodic)
                pool.connect()

        periodic = document.add_periodic_callback(check, CONNECTION_CHECK_MS)
        return pool

    def _page(
        self,
        kind: str,
        heading: str,
        parts: dict[str, object],
        sections: list[PageSection],
        *,
        headline: str = "",
    ) -> Any:
        page = panel.Template(self.template, location=True)
        document = _document()
        with document.models.freeze():  # update the model list once, not after every part
            for name, part in parts.items():
                if isinstance(part, UIElement):
                    part.name = name
                    document.add_root(part)
                else:
                    page.add_panel(name, part)
        for section in sections:
            section["blocks"] = [{**_BLOCK, **block} for block in section["blocks"]]
        variables = {
            "heading": heading,
            "here": kind,
            "places": self.links,
            "sections": sections,
            "style": self.style,
            "kind": kind,
            "headline": headline,
            "compiling": self.worker_pool.is_compiling,
            "foot": f"asperity {version('asperity')}{self._folder_name(kind)}",
        }
        for name, value in variables.items():
            page.add_variable(name, value)
        return page


class _DisconnectFilter(logging.Filter):
    """Drops log records about visitors that disconnect, and about too many connections."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True for a record to keep."""
        kind, error = (record.exc_info or (None, None))[:2]
        too_many = isinstance(error, OSError) and error.errno == errno.EMFILE
        return not (too_many or kind in (WebSocketClosedError, StreamClosedError))


def _allow_open_files() -> None:
    """Allow as many open files, which connections are, as the system permits."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _limit_logging() -> None:
    """Log errors, not connections and disconnections."""
    logging.getLogger("asyncio").addFilter(_DisconnectFilter())
    logging.getLogger("tornado.application").addFilter(_DisconnectFilter())
    for name in ("bokeh.server.util", "bokeh.server.views.ws", "tornado.access"):
        logging.getLogger(name).setLevel(logging.ERROR)


def _callback_scheduler() -> Callable[[Callable[[], None]], None]:
    """Return a thread-safe function that schedules callbacks under the current document's lock.

    Bokeh loses a callback that another thread adds while it holds events back; callbacks are
    therefore added only by the server's thread.
    """
    document, loop = _document(), IOLoop.current()

    def add(function: Callable[[], None]) -> None:
        if document.session_context is not None and not document.session_context.destroyed:
            document.add_next_tick_callback(function)

    return partial(loop.add_callback, add)


def _document() -> Any:
    """Return the document of the current visit."""
    return panel.state.curdoc


def _address() -> Callable[[str], None]:
    """Return a function that sets the query of the browser's address."""
    location = panel.state.location

    def set_query(query: str) -> None:
        location.search = f"?{query}" if query else ""

    return set_query


def _query() -> str:
    """Return the query of the visit's address."""
    pairs = [
        (name, value.decode("utf-8", "replace"))
        for name, values in panel.state.session_args.items()
        if not name.startswith("bokeh-")
        for value in values
    ]
    return urlencode(pairs)


def serve_page(
    opened: OpenedPage,
    *,
    port: int = PORT,
    listen: str = LOCALHOST,
    ready: Callable[[str], None],
    tools: contact.ReportTools,
) -> None:
    """Serve the pages until interrupted.

    Parameters
    ----------
    opened : from `open_page`
    port : 0 for a free one
    listen : address to listen on; remote access needs a password in `ASPERITY_PAGE_PASSWORD`
    ready : called with the address of the page, which contains the token, when it is available
    tools : `write_report` and `machine_drawing` of `asperity.report`

    Raises
    ------
    BadInput
        for a port in use, an address of another machine, or a missing password.
    """
    _limit_logging()
    _allow_open_files()
    password = password_for(listen)
    port = require_free(listen, port)
    worker_pool = WorkerPool()
    site = PageSite(opened, worker_pool, tools)
    try:
        worker_pool.warm_up()
        server = panel.serve(
            site.pages(),
            port=port,
            address=listen,
            websocket_origin="*",  # the access policy examines every request
            show=False,
            start=False,
            verbose=False,
            title="asperity",
            use_index=False,
            extra_patterns=[("/", RedirectHandler, {"url": f"/{opened.kind}", "permanent": False})],
            # Bokeh's keep-alive removes the session of a socket that is still closing
            keep_alive_milliseconds=0,
            websocket_ping_interval=PING_S,
            check_unused_sessions_milliseconds=CLEANUP_MS,
            unused_session_lifetime_milliseconds=UNUSED_MS,
            websocket_max_message_size=MAX_MESSAGE,
            http_server_kwargs=HTTP_LIMITS,
        )
        policy = AccessPolicy(listen, port, list(site.pages()), password)
        policy.install(server._tornado)
        server.start()
        freeze_objects()
        PeriodicCallback(SessionSweeper(server.get_sessions).sweep, CLEANUP_MS).start()
        ready(policy.printed_address())
        server.io_loop.start()
    finally:
        worker_pool.close()
        site.close()
