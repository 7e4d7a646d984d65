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

from asperity.app.inputs import (
    MAX_LENGTH,
    MOST_PRESSED,
    POSITION,
    CaseInput,
    case_inputs,
    overrides,
    written,
)
from asperity.case import Case, MachineCase, read_length
from asperity.core.errors import BadInput

MAX_CELLS = 512 * 512  # larger grids need the command line
MAX_PAIRS = 100  # in an address
# keys of an address: the case, a preset, and name and key of a dropped surface
CASE, PRESET, DROPPED, HELD = "case", "preset", "dropped", "held"
MAX_STEEPNESS = 0.1  # Sq over correlation length: a gradient of 0.2, where slopes are still small


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

    `opened` is the case or machine as opened; `changes` are texts by the keys of inputs; `dropped`
    is the name of a dropped surface, `held` its key in the surface store; `preset` is the key of a
    preset.
    """

    opened: Case | MachineCase
    changes: Mapping[str, str] = field(default_factory=dict)
    dropped: str = ""
    held: str = ""
    preset: str = ""

    @cached_property
    def machine(self) -> MachineCase | None:
        """Machine with the changes; None for a single contact."""
        if not isinstance(self.opened, MachineCase):
            return None
        changed = overrides(self.opened, self.changes)
        return self.opened.with_written(changed) if changed else self.opened

    @cached_property
    def case(self) -> Case:
        """Case of the contact with the changes; raises BadInput for invalid ones."""
        if isinstance(self.opened, MachineCase):
            assert self.machine is not None
            case = contact_of(self.machine, self.changes.get(POSITION, MOST_PRESSED))
        elif not self.changes:
            return self.opened
        else:
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
        text = written(text.strip())
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
            return RejectedValue(key, text, self._in_page_words(str(error)))
        return settings

    def failure(self, message: str) -> str:
        """Return why these settings were not solved, in the words of the page.

        Values beyond their sliders are named first; they explain a refusal of the case.
        """
        beyond = [self.inputs[key].beyond(text) for key, text in self.changes.items()]
        sentences = [sentence for sentence in beyond if sentence]
        if not sentences or not message.startswith(f"{self.opened.source}: "):
            sentences.append(self._in_page_words(message))
        return " ".join(sentences)

    def _in_page_words(self, message: str) -> str:
        """Replace keys of the case file by titles of inputs, and omit the name of the case."""
        message = message.replace(f"{self.opened.source}: ", "")
        for key in sorted(self.inputs, key=len, reverse=True):
            name = re.escape(re.sub(r"\.(\d+)$", r"[\1]", key))
            message = re.sub(rf"(?<![\w.]){name}(?![\w.\[])", self.inputs[key].title, message)
        return message

    def remark(self, key: str) -> str:
        """Return a remark on a valid but doubtful value of an input; empty without one."""
        stem, _, name = key.rpartition(".")
        lengths = [f"{stem}.correlation_length.{axis}" for axis in (0, 1)]
        if name != "sq" or not set(lengths) <= set(self.inputs):
            return ""
        sq, *pair = (read_length(part, self.text(part)) for part in (key, *lengths))
        ratio = sq / min(pair)
        if ratio <= MAX_STEEPNESS:
            return ""
        return (
            f"Sq is {ratio:.2g} times the correlation length: the model assumes gentle slopes, Sq "
            f"of at most {MAX_STEEPNESS:g} times. Decrease Sq or increase the correlation length."
        )

    @property
    def fingerprint(self) -> str:
        """Hash that identifies the opened case in an address."""
        return sha256(self.opened.text.encode()).hexdigest()[:10]

    @property
    def address(self) -> str:
        """Query that restores these settings, without question mark; empty without changes."""
        dropped = {DROPPED: self.dropped, HELD: self.held} if self.dropped else {}
        preset = {PRESET: self.preset} if self.preset else {}
        if not self.changes and not dropped:
            return urlencode(preset)
        return urlencode({CASE: self.fingerprint, **preset, **dropped, **self.changes})

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
            if key in (CASE, PRESET, DROPPED, HELD):
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


def contact_of(machine: MachineCase, name: str) -> Case:
    """Return the case of a machine's contact by its name; BadInput for one without load."""
    moving = [contact for contact in machine.contacts if not contact.stands_still]
    if not machine.complete:
        raise BadInput(f"{machine.source}: add [lubricant] and [surface] to solve its contacts")
    if not moving:
        raise BadInput(f"{machine.source}: no contact carries load and moves")
    if name == MOST_PRESSED:
        pressures = [contact.conditions(machine.pair).hertz.p_max for contact in moving]
        return machine.case(moving[pressures.index(max(pressures))])
    for contact in moving:
        if contact.name == name:
            return machine.case(contact)
    raise BadInput(
        f"{machine.source}: {_printable(name)} carries no load now; select another contact"
    )


def preset_key(query: str) -> str:
    """Return the key of a preset in an address; empty if absent."""
    return dict(parse_qsl(query.lstrip("?")[:20_000])).get(PRESET, "")


def surface_key(query: str) -> str:
    """Return the key of a dropped surface in an address; empty if absent or malformed."""
    key = dict(parse_qsl(query.lstrip("?")[:20_000])).get(HELD, "")
    return key if re.fullmatch(r"[0-9a-f]{32}", key) else ""


def _printable(key: str) -> str:
    """Return a key if it is safe to print."""
    return key if re.fullmatch(r"[\w.\-]{1,60}", key) else "an invalid key"
