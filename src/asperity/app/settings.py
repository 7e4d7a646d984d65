"""Settings: a case with some knobs turned, and the address that brings them back.

What stands in an address is somebody else's: every value goes through the case's own refusals, and
a key that is no knob of the case is left out.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from typing import NamedTuple
from urllib.parse import parse_qsl, urlencode

from asperity.app.inputs import LONGEST, Knob, knobs_of, overrides
from asperity.case import Case
from asperity.core.errors import BadInput

MOST_CELLS = 512 * 512  # that the page solves: more belongs on the command line
MOST_PAIRS = 100  # in an address
CASE, DROPPED, HELD = (
    "case",
    "dropped",
    "held",
)  # in an address: of which case, a dropped surface's name and its key


class Refusal(NamedTuple):
    """A value that a knob cannot take, and the sentence that says why."""

    key: str
    text: str
    sentence: str


def require_few(source: str, cells: tuple[int, int]) -> None:
    """BadInput for more cells than the page solves."""
    if cells[0] * cells[1] > MOST_CELLS:
        raise BadInput(
            f"{source}: grid.cells must be at most {MOST_CELLS} in all on this page, got {cells[0]} x {cells[1]}; "
            "take asperity solve for more"
        )


@dataclass(frozen=True)
class Settings:
    """A case and what was turned.

    `opened` is the case as it was given; `changes` are texts by the keys of knobs; `dropped` is
    the name of a surface that was dropped, `held` what the server holds it by.
    """

    opened: Case
    changes: Mapping[str, str] = field(default_factory=dict)
    dropped: str = ""
    held: str = ""

    @cached_property
    def case(self) -> Case:
        """The case with the changes; BadInput for what it refuses."""
        if not self.changes:
            return self.opened
        case = self.opened.with_overrides(overrides(self.opened, self.changes))
        if (
            case.contents.grid.cells != "auto"
        ):  # to choose cells may need a file, which is read elsewhere
            require_few(case.source, case.contents.grid.cells)
        return case

    @cached_property
    def knobs(self) -> dict[str, Knob]:
        """The knobs of the opened case."""
        return knobs_of(self.opened)

    def text(self, key: str) -> str:
        """What a knob is set to."""
        return self.changes.get(key, self.knobs[key].text)

    def turned(self, key: str, text: str) -> "Settings | Refusal":
        """With a knob set to what was typed; or why it cannot be."""
        text = text.strip()
        if len(text) > LONGEST:
            return Refusal(
                key,
                text[:LONGEST],
                f"is {len(text)} characters long; a value is shorter than {LONGEST}",
            )
        kept = {name: value for name, value in self.changes.items() if name != key}
        settings = replace(
            self, changes=kept if text == self.knobs[key].text else {**kept, key: text}
        )
        try:
            _ = settings.case
        except BadInput as refusal:
            return Refusal(key, text, str(refusal))
        return settings

    @property
    def fingerprint(self) -> str:
        """What the opened case is told by in an address."""
        return sha256(self.opened.text.encode()).hexdigest()[:10]

    @property
    def address(self) -> str:
        """The query that brings these settings back, without its question mark; empty where nothing was turned."""
        dropped = {DROPPED: self.dropped, HELD: self.held} if self.dropped else {}
        return (
            urlencode({CASE: self.fingerprint, **dropped, **self.changes})
            if self.changes or dropped
            else ""
        )

    def from_address(self, query: str) -> "tuple[Settings, list[str]]":
        """The opened case with what an address says, and a sentence for each part of it that was left out."""
        notes: list[str] = []
        pairs = parse_qsl(query.lstrip("?")[:20_000], max_num_fields=None)[:MOST_PAIRS]
        settings = replace(self, changes={})
        gone = next((text for key, text in pairs if key == DROPPED), "")
        if gone and (not self.held or held_in(query) != self.held):
            notes.append(
                f"The link was made with the dropped surface {gone[:80]}, held no more; drop it again."
            )
        for key, text in pairs:
            if key in (CASE, DROPPED, HELD):
                if key == CASE and text != self.fingerprint and not gone:
                    notes.append(
                        "The link was made with another case; what it turned is turned here."
                    )
            elif key not in self.knobs:
                notes.append(
                    f"The link turns {_named(key)}, which is no knob of this case; it is left out."
                )
            elif isinstance(turned := settings.turned(key, text), Settings):
                settings = turned
            else:
                notes.append(f"Of the link is left out: {turned.sentence}.")
        return settings, notes


def held_in(query: str) -> str:
    """What an address says that a dropped surface is held by; empty where it says nothing that could be."""
    given = dict(parse_qsl(query.lstrip("?")[:20_000])).get(HELD, "")
    return given if re.fullmatch(r"[0-9a-f]{32}", given) else ""


def _named(key: str) -> str:
    """A key as a sentence names it."""
    return key if re.fullmatch(r"[\w.\-]{1,60}", key) else "what has no name of a key"
