"""Drawing of the machine whose contact the page shows."""

from collections.abc import Callable

from markupsafe import Markup

from asperity.app.contact_jobs import Drawing, MachineDrawer, draw_machine
from asperity.app.jobs import JobQueue, VisitPool
from asperity.app.widgets import DRAWING, text_block
from asperity.case import MachineCase


class MachineDrawing:
    """Drawing to scale of the current machine; empty for a single contact."""

    def __init__(
        self,
        worker_pool: VisitPool,
        deliver: Callable[[Callable[[], None]], None],
        draw: MachineDrawer,
    ) -> None:
        self._queue, self._draw = JobQueue(worker_pool, deliver), draw
        self._machine: MachineCase | None = None
        self.model = text_block(DRAWING)

    def show(self, machine: MachineCase | None) -> None:
        """Draw a machine that has changed."""
        if machine is self._machine:
            return
        self._machine = machine
        if machine is None:
            self.model.text = ""
            return
        if not self.model.text:
            self.model.text = Markup("<p>Drawing the machine ...</p>")
        self._queue.submit((draw_machine, (machine, self._draw)), self._drawn)

    def close(self) -> None:
        """Release the queue."""
        self._queue.close()

    def _drawn(self, result: object) -> None:
        if self._machine is None:
            return
        if isinstance(result, Drawing):
            self.model.text = Markup('<img src="{}" alt="{}"><p>{}</p>').format(*result)
        else:
            self.model.text = Markup("<p>This machine could not be drawn.</p>")
