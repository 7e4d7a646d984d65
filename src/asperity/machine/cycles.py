"""Cycles of machines in time: revolution of a cam, passage of a tooth or of a rolling element."""

import math
from dataclasses import replace
from functools import singledispatch
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from asperity.contact.conditions import ElasticPair
from asperity.contact.cycle import OperatingCycle
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.machine.ball import BallBearing
from asperity.machine.cam import Cam
from asperity.machine.element import Machine, MachineContact
from asperity.machine.gear import SpurGear
from asperity.machine.helical import HelicalGear
from asperity.machine.roller import CylindricalRollerBearing

CAM_ANGLES = 720  # of a revolution
TOOTH_POINTS = 240  # of the path of contact
BEARING_ANGLES = 720  # of a revolution of the cage
LEAST_LOAD = 0.02  # of the largest, at which a load zone begins and ends
STEP_SHARE = 1e-3  # of the passage, over which a load share changes that does so at once


class MachineCycle(NamedTuple):
    """Cycle of a machine, and the contact whose bodies and geometry it has."""

    contact: MachineContact
    cycle: OperatingCycle


@singledispatch
def machine_cycle(machine: Machine, pair: ElasticPair) -> MachineCycle:  # noqa: ARG001
    """Return a machine's cycle, as one of its contacts passes through it.

    Raises
    ------
    BadInput
        for a machine whose contact is constant.
    """
    raise BadInput(
        f"the contact of a {machine.title()} has no cycle of its own; state one in [cycle]"
    )


@machine_cycle.register
def _of_cam(machine: Cam, pair: ElasticPair) -> MachineCycle:  # noqa: ARG001 (rigid valve train)
    """Return the revolution of a cam, from the base circle over the nose."""
    angles = np.linspace(-math.pi, math.pi, CAM_ANGLES + 1)
    contacts = [machine.contact(float(angle)) for angle in angles]
    return _cycle(contacts, (angles + math.pi) / machine.speed, machine.place)


@machine_cycle.register
def _of_spur_gear(machine: SpurGear, pair: ElasticPair) -> MachineCycle:  # noqa: ARG001 (rigid teeth)
    """Return the passage of a tooth from the start to the end of the path of contact."""
    distances = _tooth_distances(machine)
    contacts = [machine.contact("tooth", float(distance)) for distance in distances]
    return _cycle(
        contacts,
        _tooth_times(machine, distances),
        machine.place,
        continuous=False,
    )


@machine_cycle.register
def _of_helical_gear(machine: HelicalGear, pair: ElasticPair) -> MachineCycle:  # noqa: ARG001 (rigid teeth)
    """Return the passage of the slice in the middle of the face through the path of contact."""
    distances = _tooth_distances(machine)
    ahead = 0.5 * machine.face_width * math.tan(machine.base_helix_angle)
    line_loads = machine.line_load(distances, distances - ahead)
    contacts = [
        replace(machine.contact("slice", float(distance)), load=float(load) * machine.line_length)
        for distance, load in zip(distances, line_loads, strict=True)
    ]
    across = machine.face_width / math.cos(machine.base_helix_angle)  # all slices of the face
    return _cycle(
        contacts,
        _tooth_times(machine, distances),
        machine.place,
        continuous=False,
        carried=across * line_loads,
    )


@machine_cycle.register(BallBearing)
@machine_cycle.register(CylindricalRollerBearing)
def _of_bearing(machine: BallBearing | CylindricalRollerBearing, pair: ElasticPair) -> MachineCycle:
    """Return the passage of a rolling element through the load zone, at the inner ring.

    Positions are those from the direction of the radial load; the element moves with the cage. A
    zone that ends is entered and left at a fiftieth of the largest load.
    """
    positions = np.linspace(-math.pi, math.pi, BEARING_ANGLES + 1)[:-1]
    inner = {
        contact.position: contact
        for contact in machine.contacts_at(positions, pair)
        if contact.bodies[0] == "inner ring"
    }
    largest = max(contact.load for contact in inner.values())
    loaded = np.array(
        [
            position in inner and inner[position].load > LEAST_LOAD * largest
            for position in positions.tolist()
        ]
    )
    order = _zone(loaded, int(np.argmax([_load(inner.get(p)) for p in positions.tolist()])))
    zone = [inner[positions[index % BEARING_ANGLES]] for index in order]
    angles = 2.0 * math.pi / BEARING_ANGLES * (order - order[0])
    if loaded.all():  # the element comes back to where it was
        zone, angles = [*zone, zone[0]], np.append(angles, 2.0 * math.pi)
    return _cycle(
        zone,
        angles / machine.cage_speed,
        machine.place,
        continuous=bool(loaded.all()),
    )


def _load(contact: MachineContact | None) -> float:
    return 0.0 if contact is None else contact.load


def _zone(loaded: npt.NDArray[np.bool_], heaviest: int) -> npt.NDArray[np.int_]:
    """Return the successive indices of the loaded zone around the heaviest one, on a circle."""
    count = len(loaded)
    if loaded.all():
        return np.arange(count)
    begin, end = heaviest, heaviest
    while loaded[(begin - 1) % count]:
        begin -= 1
    while loaded[(end + 1) % count]:
        end += 1
    return np.arange(begin, end + 1)


def _tooth_distances(machine: SpurGear) -> Field:
    """Return distances along the path of contact [m], close together where the load share jumps."""
    points = machine.path
    start, end = points["A"], points["E"]
    step = STEP_SHARE * (end - start)
    jumps = np.array([points[name] + side * step for name in ("B", "D") for side in (-0.5, 0.5)])
    jumps = jumps[(jumps > start + step) & (jumps < end - step)]
    distances = np.linspace(start, end, TOOTH_POINTS + 1)
    clear = [np.all(np.abs(jumps - distance) > 0.25 * step) for distance in distances]
    return np.sort(np.concatenate([distances[clear], jumps]))


def _tooth_times(machine: SpurGear, distances: Field) -> Field:
    """Return the times [s] at which the contact passes distances along the path of contact [m]."""
    times: Field = (distances - distances[0]) / (machine.speed * machine.base_radii[0])
    return times


def _cycle(
    contacts: list[MachineContact],
    times: Field,
    place: str,
    *,
    continuous: bool = True,
    carried: Field | None = None,
) -> MachineCycle:
    """Return the cycle of successive contacts, solved for the largest line load of each.

    Energy and wear count the loads of the contacts, unless others are `carried`.
    """
    loads = [
        contact.load if contact.line_load is None else contact.line_load * (contact.length or 0.0)
        for contact in contacts
    ]
    radii = [
        contact.radius[0] if isinstance(contact.radius, tuple) else contact.radius
        for contact in contacts
    ]
    cycle = OperatingCycle(
        times=times,
        loads=loads,
        speeds=[contact.surface_speeds for contact in contacts],
        radii=radii,
        positions=np.unwrap([contact.position for contact in contacts]),
        place=place,
        continuous=continuous,
        carried=[contact.load for contact in contacts] if carried is None else carried,
    )
    moving = [contact for contact in contacts if not contact.stands_still]
    if not moving:
        raise BadInput("no contact of the cycle entrains oil; correct the speeds")
    return MachineCycle(max(moving, key=lambda contact: contact.load), cycle)
