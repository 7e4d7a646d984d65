"""Session of one visitor without widgets: settings, results, pinned contact and earlier results.

After a change the contact is solved twice: coarsely, from the previous coarse solution, and in
full, at the same time if a worker is idle. A callback reports every change.
"""

from collections.abc import Callable
from dataclasses import dataclass

from asperity.app.contact_jobs import CoarseResult, JobFailure, solve_coarsely, solve_fully
from asperity.app.contact_result import ContactResult
from asperity.app.jobs import JobQueue
from asperity.app.presets import stored_result
from asperity.app.settings import RejectedValue, Settings
from asperity.ehl import ContactSolution

MAX_TRIALS = 200


@dataclass(frozen=True, slots=True)
class Trial:
    """Settings that were solved, with roughness, load share and resonance."""

    settings: Settings
    sq: float
    clr: float
    crf_hz: float | None
    determined: bool


class ContactSession:
    """A contact with its settings and results.

    Parameters
    ----------
    settings : initial settings
    queue : queue of coarse solutions
    changed : called after every change
    full_queue : queue of full solutions, started early if it has room; None: use `queue`
    """

    def __init__(
        self,
        settings: Settings,
        queue: JobQueue,
        changed: Callable[[], None],
        full_queue: JobQueue | None = None,
    ) -> None:
        self.settings = settings
        self.rejected: dict[str, RejectedValue] = {}
        self.result: ContactResult | None = None
        self.problem = ""
        self.pinned: ContactResult | None = None
        self.trials: list[Trial] = []
        self._queue, self._changed, self._full_queue = queue, changed, full_queue
        self.stored = ""  # version that computed the stored result on display
        self.pending = False  # the full result of the current settings is not available yet
        self._full_submitted = False
        self._start: ContactSolution | None = None

    @property
    def status(self) -> str:
        """State of the solution as a sentence."""
        if self.rejected:
            return f"Not solved: {self._invalid} The numbers are those of the last valid values."
        if self.stored and self.pending:
            return f"Stored solution of asperity {self.stored}, being solved again ..."
        if self.pending and self.result is None:
            return "Solving the first contact ..."
        if self.pending:
            return (
                "Coarse solution, refining ..."
                if self.result and self._is_current
                else "Solving ..."
            )
        if self.problem:
            return f"Not solved: {self.problem}"
        if self.result is None:
            return ""
        if not self.result.converged:
            return f"NOT CONVERGED, do not use: {self.result.explained}"
        nx, ny = self.result.gap.shape
        moving = self.result.instant_area is not None
        kind = ", a grid for running roughness," if moving else ""
        return f"Solved on {nx} × {ny} cells{kind} in {self.result.seconds:.2f} s"

    @property
    def state(self) -> str:
        """State of the solution in a word or two."""
        if self.rejected or self.problem:
            return "outdated: input not solved"
        if self.pending:
            return "stored" if self.stored else "solving ..."
        return "solved" if self.result is not None and self.result.converged else "not converged"

    @property
    def _invalid(self) -> str:
        titles = [self.settings.inputs[key].title for key in self.rejected]
        return f"invalid value of {', '.join(titles)}."

    @property
    def _is_current(self) -> bool:
        return self.result is not None and self.result.text == self.settings.case.text

    @property
    def stale(self) -> bool:
        """True if the figures do not show the current settings in full."""
        waiting = self.pending and not self.stored
        return waiting or bool(self.problem) or bool(self.rejected)

    def solve(self) -> None:
        """Solve the contact with the current settings, showing its stored result meanwhile."""
        self.problem, self.stored = "", ""
        known = stored_result(self.settings.case)
        if known is not None:
            self.result, self.stored = known
        self.pending, self._full_submitted = True, False
        self._queue.submit(
            (solve_coarsely, (self.settings.case, self._start)),
            self._if_current(self._receive_coarse),
        )
        if self._full_queue is not None and self._full_queue.has_room:
            self._solve_fully(self._full_queue)
        self._changed()

    def _solve_fully(self, queue: JobQueue) -> None:
        self._full_submitted = True
        queue.submit((solve_fully, (self.settings.case,)), self._if_current(self._receive_full))

    def _if_current(self, receive: Callable[[object], None]) -> Callable[[object], None]:
        """Return a callback that ignores results of settings that have changed since."""
        submitted = self.settings

        def callback(result: object) -> None:
            if self.settings is submitted:
                receive(result)

        return callback

    def change(self, key: str, text: str) -> None:
        """Change an input and solve the contact, or store the error of an invalid value."""
        changed = self.settings.with_value(key, text)
        if isinstance(changed, RejectedValue):
            self.rejected[key] = changed
            self._changed()
            return
        previous_error = self.rejected.pop(key, None)
        if changed.changes == self.settings.changes:
            if previous_error is not None:
                self._changed()
            return
        self.settings = changed
        self.solve()

    def go_to(self, query: str) -> list[str]:
        """Apply the settings of an address; return a note for each part that was ignored."""
        self.settings, notes = self.settings.from_address(query)
        self.rejected.clear()
        self.solve()
        return notes

    def go_back(self, number: int) -> None:
        """Restore the settings of an earlier result."""
        if 0 <= number < len(self.trials) and self.trials[number].settings is not self.settings:
            self.settings = self.trials[number].settings
            self.rejected.clear()
            self.solve()

    def open(self, settings: Settings, result: ContactResult | None = None) -> None:
        """Start with another case, such as one with a dropped surface, and its result if known."""
        self.settings, self._start, self.stored = settings, None, ""
        self.rejected.clear()
        if result is None:
            self.solve()
        else:
            self._receive_full(result)

    def pin(self) -> None:
        """Pin the current result for comparison, if there is one."""
        if self.result is not None and not self.stale:
            self.pinned = self.result
            self._changed()

    def unpin(self) -> None:
        """Remove the pinned result."""
        self.pinned = None
        self._changed()

    def close(self) -> None:
        """Close the queues and release the results."""
        self._queue.close()
        if self._full_queue is not None:
            self._full_queue.close()
        self.result = self.pinned = self._start = None
        self.trials.clear()

    def _receive_coarse(self, outcome: object) -> None:
        if isinstance(outcome, JobFailure):
            self._fail(outcome)
            return
        assert isinstance(outcome, CoarseResult)
        if outcome.solution is not None:
            self._start = outcome.solution
        if not self.pending:
            return  # the full result arrived first
        if not self.stored:
            self.result = outcome.result or self.result
        if not self._full_submitted:
            self._solve_fully(self._full_queue or self._queue)
        self._changed()

    def _receive_full(self, result: object) -> None:
        if isinstance(result, JobFailure):
            self._fail(result)
            return
        assert isinstance(result, ContactResult)
        self.result, self.pending, self.stored = result, False, ""
        if result.converged:
            row = result.row
            trial = Trial(
                self.settings, row["sq_m"], row["clr"], row.get("crf_hz"), result.determined
            )
            if all(trial.settings is not earlier.settings for earlier in self.trials):
                self.trials = [*self.trials[1 - MAX_TRIALS :], trial]
        self._changed()

    def _fail(self, failure: JobFailure) -> None:
        self.problem = self.settings.failure(failure.message)
        self.pending, self.stored = False, ""
        self._changed()
