"""Ratings of a machine by standards, and the Dang Van criterion below a solved contact.

A rating uses the machine, the oil and, if its standard requires it, a roughness number, but no
solved quantity, so that roughness is not counted twice. The Dang Van criterion uses the stresses
of a solved contact and no roughness number.
"""

from asperity.case import MachineCase
from asperity.machine import BallBearing, CylindricalRollerBearing, SpurGear
from asperity.machines.bearing_ratings import bearing_ratings
from asperity.machines.gear_ratings import gear_ratings
from asperity.machines.rating_facts import Rating, rated_case


def machine_ratings(case: MachineCase) -> tuple[Rating, ...]:
    """Return the ratings of a bearing or gear pair; none for other machines or without oil."""
    stated = rated_case(case)
    if stated is None:
        return ()
    if isinstance(case.machine, SpurGear):
        return gear_ratings(case, case.machine, stated)
    if isinstance(case.machine, CylindricalRollerBearing | BallBearing):
        return bearing_ratings(case, case.machine, stated)
    return ()
