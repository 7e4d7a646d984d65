"""Desk: one user's contact without its widgets: what is turned, what is solved, pinned and tried.

A turned knob is answered twice, coarsely from the coarse solution before and in full: after that,
or at the same time where a processor has nothing else to do. Whoever draws a desk is told when it
changes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from asperity.app.contact_jobs import Coarse, Refused, solve_coarsely, solve_fully
from asperity.app.contact_result import Answer
from asperity.app.jobs import Queue
from asperity.app.settings import Refusal, Settings
from asperity.ehl import ContactSolution

MOST_TRIED = 200


@dataclass(frozen=True, slots=True)
class Tried:
    """A setting that was solved, and where it lies between roughness, load share and resonance."""

    settings: Settings
    sq: float
    clr: float
    crf_hz: float | None
    determined: bool


class Desk:
    """A contact, its knobs and what became of it.

    Parameters
    ----------
    settings : what is set at first
    queue : of coarse answers
    changed : called whenever there is something new to draw
    ahead : of full answers, which begins them early where it has room; None: `queue` takes them in their turn
    """

    def __init__(
        self,
        settings: Settings,
        queue: Queue,
        changed: Callable[[], None],
        ahead: Queue | None = None,
    ) -> None:
        self.settings = settings
        self.refusals: dict[str, Refusal] = {}
        self.answer: Answer | None = None
        self.problem = ""
        self.pinned: Answer | None = None
        self.trail: list[Tried] = []
        self._queue, self._changed, self._ahead = queue, changed, ahead
        self.pending = False  # whether what is shown is not yet the contact that is asked for
        self._begun = False  # whether the full answer is on its way
        self._start: ContactSolution | None = None

    @property
    def status(self) -> str:
        """How far the contact is, in a sentence."""
        if self.pending and self.answer is None:
            return "Solving the first contact ..."
        if self.pending:
            return (
                "Coarse answer, solving in full ..."
                if self.answer and self._is_current
                else "Solving ..."
            )
        if self.problem:
            return f"Not solved: {self.problem}"
        if self.answer is None:
            return ""
        if not self.answer.converged:
            return f"NOT CONVERGED, do not use: {self.answer.explained}"
        nx, ny = self.answer.gap.shape
        return f"Solved on {nx} × {ny} cells in {self.answer.seconds:.2f} s"

    @property
    def _is_current(self) -> bool:
        return self.answer is not None and self.answer.text == self.settings.case.text

    @property
    def stale(self) -> bool:
        """Whether the picture is of another setting than the knobs'."""
        return self.pending or bool(self.problem) or bool(self.refusals)

    def solve(self) -> None:
        """Have the contact solved as it is set."""
        self.problem = ""
        self.pending, self._begun = True, False
        self._queue.ask(
            (solve_coarsely, (self.settings.case, self._start)), self._if_still_set(self._coarsely)
        )
        if self._ahead is not None and self._ahead.has_room:
            self._solve_fully(self._ahead)
        self._changed()

    def _solve_fully(self, queue: Queue) -> None:
        self._begun = True
        queue.ask((solve_fully, (self.settings.case,)), self._if_still_set(self._fully))

    def _if_still_set(self, then: Callable[[Any], None]) -> Callable[[Any], None]:
        """What is done with an answer, unless the knobs have been turned meanwhile: it is no answer to what is set."""
        asked = self.settings

        def told(result: Any) -> None:
            if self.settings is asked:
                then(result)

        return told

    def turn(self, key: str, text: str) -> None:
        """Set a knob and have the contact solved, or keep the sentence that says why it cannot be."""
        turned = self.settings.turned(key, text)
        if isinstance(turned, Refusal):
            self.refusals[key] = turned
            self._changed()
            return
        refused = self.refusals.pop(key, None)
        if turned.changes == self.settings.changes:
            if refused is not None:
                self._changed()
            return
        self.settings = turned
        self.solve()

    def go_to(self, query: str) -> list[str]:
        """Set all knobs as an address says; a sentence for each part of it that was left out."""
        self.settings, notes = self.settings.from_address(query)
        self.refusals.clear()
        self.solve()
        return notes

    def go_back(self, number: int) -> None:
        """Set everything as it was for a setting that was tried."""
        if 0 <= number < len(self.trail) and self.trail[number].settings is not self.settings:
            self.settings = self.trail[number].settings
            self.refusals.clear()
            self.solve()

    def open(self, settings: Settings, answer: Answer | None = None) -> None:
        """Begin with another case, such as one with a dropped surface; `answer` where it is solved already."""
        self.settings, self._start = settings, None
        self.refusals.clear()
        if answer is None:
            self.solve()
        else:
            self._fully(answer)

    def pin(self) -> None:
        """Keep what is shown to compare with; nothing where it is not solved."""
        if self.answer is not None and not self.stale:
            self.pinned = self.answer
            self._changed()

    def unpin(self) -> None:
        """Compare with nothing."""
        self.pinned = None
        self._changed()

    def close(self) -> None:
        """Let go of everything that takes memory."""
        self._queue.close()
        if self._ahead is not None:
            self._ahead.close()
        self.answer = self.pinned = self._start = None
        self.trail.clear()

    def _coarsely(self, result: Any) -> None:
        if isinstance(result, Refused):
            self._refuse(result)
            return
        assert isinstance(result, Coarse)
        if result.solution is not None:
            self._start = result.solution
        if not self.pending:
            return  # the full answer was there before
        self.answer = result.answer or self.answer
        if not self._begun:
            self._solve_fully(self._ahead or self._queue)
        self._changed()

    def _fully(self, result: Any) -> None:
        if isinstance(result, Refused):
            self._refuse(result)
            return
        assert isinstance(result, Answer)
        self.answer, self.pending = result, False
        if result.converged:
            row = result.row
            tried = Tried(
                self.settings, row["sq_m"], row["clr"], row.get("crf_hz"), result.determined
            )
            if all(tried.settings is not before.settings for before in self.trail):
                self.trail = [*self.trail[1 - MOST_TRIED :], tried]
        self._changed()

    def _refuse(self, refused: Refused) -> None:
        self.problem, self.pending = refused.sentence, False
        self._changed()
