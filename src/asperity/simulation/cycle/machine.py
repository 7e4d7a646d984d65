"""Cycle of a machine: revolution of a cam, passage of a tooth or of a rolling element."""

from asperity.case import Case, MachineCase
from asperity.contact.cycle import OperatingCycle
from asperity.core.errors import BadInput
from asperity.machine import machine_cycle


def machine_contact_cycle(case: MachineCase) -> tuple[Case, OperatingCycle]:
    """Return the case of a machine's contact, and the cycle that it passes through.

    A [cycle] of the machine's case applies to its most heavily loaded contact; without one, the
    cycle is the machine's own.

    Raises
    ------
    BadInput
        for a case without an oil or a surface, and a machine whose contact is constant.
    """
    if not case.complete:
        raise BadInput(f"{case.source}: solving needs [lubricant] and [surface]; add them")
    if "cycle" in case.tables:
        moving = [contact for contact in case.contacts if not contact.stands_still]
        worst = case.case(max(moving, key=lambda contact: contact.load))
        section = worst.contents.cycle
        assert section is not None
        with worst.naming("cycle"):
            return worst, section.cycle(worst.conditions, worst.folder)
    try:
        contact, cycle = machine_cycle(case.machine, case.pair)
    except BadInput as refusal:
        raise BadInput(f"{case.source}: {refusal}") from None
    return case.case(contact), cycle
