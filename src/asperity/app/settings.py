"""Settings: a case with changed inputs, and the address that restores them.

An address is untrusted: every value is validated by the case, and unknown keys are ignored.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from typing import NamedTuple
from urllib.parse import parse_qsl, urlencode

from asperity.app.inputs import MAX_LENGTH, CaseInput, case_inputs, overrides
from asperity.case import Case
from asperity.core.errors import BadInput

MAX_CELLS = 512 * 512  # larger grids need the command line
MAX_PAIRS = 100  # in an address
# keys of an address: the case, and name and key of a dropped surface
CASE, DROPPED, HELD = "case", "dropped", "held"


class RejectedValue(NamedTuple):
    """An invalid value of an input, with its error message."""

    key: str
    text: str
    message: str


def limit_cells(source: str, cells: tuple[int, int]) -> None:
    """Raise BadInput for more cells than the page solves."""
    if cells[0] * cells[1] > MAX_CELLS:
        raise BadInput(
            f"{source}: grid.cells must be at most {MAX_CELLS} in all on this page, got "
            f"{cells[0]} x {cells[1]}; use asperity solve for larger grids"
        )


@dataclass(frozen=True)
class Settings:
    """A case and the changes of its inputs.

    `opened` is the case as opened; `changes` are texts by the keys of inputs; `dropped` is the name
    of a dropped surface, `held` its key in the surface store.
    """

    opened: Case
    changes: Mapping[str, str] = field(default_factory=dict)
    dropped: str = ""
    held: str = ""

    @cached_property
    def case(self) -> Case:
        """Case with the changes; raises BadInput for invalid ones."""
        if not self.changes:
            return self.opened
        case = self.opened.with_written(overrides(self.opened, self.changes))
        if case.contents.grid.cells != "auto":  # choosing cells may read a file: left to a worker
            limit_cells(case.source, case.contents.grid.cells)
        return case

    @cached_property
    def inputs(self) -> dict[str, CaseInput]:
        """Inputs of the opened case."""
        return case_inputs(self.opened)

    def text(self, key: str) -> str:
        """Return the value of an input."""
        return self.changes.get(key, self.inputs[key].text)

    def with_value(self, key: str, text: str) -> "Settings | RejectedValue":
        """Return settings with a typed value of an input, or its rejection."""
        text = text.strip()
        if len(text) > MAX_LENGTH:
            return RejectedValue(
                key,
                text[:MAX_LENGTH],
                f"value of {len(text)} characters; at most {MAX_LENGTH} are allowed",
            )
        others = {name: value for name, value in self.changes.items() if name != key}
        settings = replace(
            self, changes=others if text == self.inputs[key].text else {**others, key: text}
        )
        try:
            _ = settings.case
        except BadInput as error:
            return RejectedValue(key, text, str(error))
        return settings

    @property
    def fingerprint(self) -> str:
        """Hash that identifies the opened case in an address."""
        return sha256(self.opened.text.encode()).hexdigest()[:10]

    @property
    def address(self) -> str:
        """Query that restores these settings, without question mark; empty without changes."""
        dropped = {DROPPED: self.dropped, HELD: self.held} if self.dropped else {}
        return (
            urlencode({CASE: self.fingerprint, **dropped, **self.changes})
            if self.changes or dropped
            else ""
        )

    def from_address(self, query: str) -> "tuple[Settings, list[str]]":
        """Return the settings of an address, and a note for each part that was ignored."""
        notes: list[str] = []
        pairs = parse_qsl(query.lstrip("?")[:20_000], max_num_fields=None)[:MAX_PAIRS]
        settings = replace(self, changes={})
        surface = next((text for key, text in pairs if key == DROPPED), "")
        if surface and (not self.held or surface_key(query) != self.held):
            notes.append(
                f"The link uses the dropped surface {surface[:80]}, which is no longer stored; "
                "drop it again."
            )
        for key, text in pairs:
            if key in (CASE, DROPPED, HELD):
                if key == CASE and text != self.fingerprint and not surface:
                    notes.append(
                        "The link was made with another case; its changes are applied here."
                    )
            elif key not in self.inputs:
                notes.append(
                    f"The link changes {_printable(key)}, not an input of this case; ignored."
                )
            elif isinstance(changed := settings.with_value(key, text), Settings):
                settings = changed
            else:
                notes.append(f"The link has an invalid value, ignored: {changed.message}.")
        return settings, notes


def surface_key(query: str) -> str:
    """Return the key of a dropped surface in an address; empty if absent or malformed."""
    key = dict(parse_qsl(query.lstrip("?")[:20_000])).get(HELD, "")
    return key if re.fullmatch(r"[0-9a-f]{32}", key) else ""


def _printable(key: str) -> str:
    """Return a key if it is safe to print."""
    return key if re.fullmatch(r"[\w.\-]{1,60}", key) else "an invalid key"
