"""Stiffness and damping of a machine's contacts as a table for rotor dynamics.

The contacts are solved as snapshots of standing roughness. A bearing's coefficients are sums over
its rolling elements, inner and outer contact in series; rings are rigid, free along the axis and,
unless their tilt is stated, free to tilt. The mass of the rolling elements is left out.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas

from asperity.case import MachineCase
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.files import save_csv
from asperity.machine import BallBearing, CylindricalRollerBearing, MachineContact, TwinDisc
from asperity.machines.sweep import sweep_points
from asperity.results import solve_case
from asperity.solution import OscillatingContact

STIFFNESSES = ("kxx", "kxy", "kyx", "kyy")
DAMPINGS = ("cxx", "cxy", "cyx", "cyy")
Springs = Mapping[str, complex]  # k + iωc by name of the contact


@dataclass(frozen=True, eq=False)
class StiffnessTable:
    """Stiffness and damping of a bearing, or of each contact of another machine.

    A bearing has a row for each point of [study]: the values of the study as written, the speed of
    the shaft as `frequency` [rad/s], stiffness kxx, kxy, kyx and kyy [N/m] and damping cxx to cyy
    [N s/m], x along the radial load. Another machine has a row for each contact too, with
    `contact`, `load_n`, kxx and cxx along its normal.
    """

    table: pandas.DataFrame

    def verdict(self) -> str:
        """Return one sentence: the range of stiffness and damping."""
        count = len(self.table)
        return (
            f"Stiffness {_span(1e-6 * self.table['kxx'])} N/um and damping "
            f"{_span(self.table['cxx'])} N s/m in {count} row{'' if count == 1 else 's'}."
        )

    def scalars(self) -> dict[str, object]:
        """Return the JSON output."""
        return {"verdict": self.verdict(), "rows": self.table.to_dict("records")}

    def save(self, path: str | Path) -> Path:
        """Write the table as .csv; raises as `asperity.core.files.save_csv`."""
        return save_csv(path, self.table, "a stiffness table")


def _span(values: pandas.Series) -> str:
    """Return least and greatest value as text; one if they are equal."""
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"


def stiffness_table(
    case: MachineCase, *, progress: Callable[[int, int], None] | None = None
) -> StiffnessTable:
    """Compute stiffness and damping at every point of a machine's [study], at the shaft's speed.

    Parameters
    ----------
    case : from `load_machine`; without [study] it is the only point
    progress : called with the numbers of solved contacts and of all

    Raises
    ------
    BadInput
        without a lubricant, and as `sweep_points`.
    NotConverged
        if a contact cannot be solved.
    """
    if not case.complete:
        raise BadInput(
            f"{case.source}: a stiffness table needs [lubricant] and [surface]; add them"
        )
    points = sweep_points(case) if case.sweep else [{}]
    machines = [case.with_written({**point, "study": "none"}) for point in points]
    total = sum(len(_distinct(machine)) for machine in machines)
    rows: list[dict[str, object]] = []
    solved = 0

    def count() -> None:
        nonlocal solved
        solved += 1
        if progress is not None:
            progress(solved, total)

    for point, machine in zip(points, machines, strict=True):
        springs = _springs(machine, count)
        rows.extend({**point, **row} for row in _rows(machine, springs))
    return StiffnessTable(pandas.DataFrame(rows))


def _distinct(case: MachineCase) -> dict[str, MachineContact]:
    """Return the contacts that differ, by their conditions."""
    moving = [contact for contact in case.contacts if not contact.stands_still]
    return {json.dumps(case.contact_table(contact)): contact for contact in reversed(moving)}


def _springs(case: MachineCase, count: Callable[[], None]) -> Springs:
    """Return k + iωc of every contact [N/m] at the shaft's speed."""
    by_conditions = {}
    speed = _shaft_speed(case)
    for key, contact in _distinct(case).items():
        snapshot = case.case(contact).with_written(
            {"contact.roughness": "standing", "solver.surfaces": 1}
        )
        run = solve_case(snapshot.among_many, groups=())
        spring = OscillatingContact(run.solution).evaluate(speed / (2.0 * math.pi))
        # the most loaded slice is solved over the whole length
        loaded = contact.load / snapshot.conditions.load
        by_conditions[key] = loaded * complex(spring.stiffness, speed * spring.damping)
        count()
    return {
        contact.name: by_conditions[json.dumps(case.contact_table(contact))]
        for contact in case.contacts
        if not contact.stands_still
    }


def _shaft_speed(case: MachineCase) -> float:
    """Return the speed of the driving shaft, of the first disc [rad/s]."""
    machine = case.machine
    if isinstance(machine, TwinDisc):
        return machine.turning[0]
    return float(vars(machine)["speed"])


def _rows(case: MachineCase, springs: Springs) -> list[dict[str, object]]:
    speed = _shaft_speed(case)
    if isinstance(case.machine, BallBearing | CylindricalRollerBearing):
        matrix = _bearing_matrix(case, springs)
        stiffness = dict(zip(STIFFNESSES, matrix.real.ravel().tolist(), strict=True))
        damping = dict(zip(DAMPINGS, (matrix.imag.ravel() / speed).tolist(), strict=True))
        return [{"frequency": speed, **stiffness, **damping}]
    return [
        {
            "contact": contact.name,
            "load_n": contact.load,
            "frequency": speed,
            "kxx": springs[contact.name].real,
            "cxx": springs[contact.name].imag / speed,
        }
        for contact in case.contacts
        if contact.name in springs
    ]


def _bearing_matrix(case: MachineCase, springs: Springs) -> npt.NDArray[np.complex128]:
    """Return the complex stiffness of the inner ring across its axis, shape (2, 2) [N/m].

    Under constant thrust and, if the ring is free to tilt, without moment.
    """
    machine = case.machine
    angles = machine.loads(case.pair)[1] if isinstance(machine, BallBearing) else None
    elements: dict[str, list[MachineContact]] = {}
    for contact in case.contacts:
        elements.setdefault(contact.name.partition(",")[0], []).append(contact)
    matrix = np.zeros((5, 5), dtype=complex)
    for name, contacts in elements.items():
        series = 1.0 / sum(1.0 / springs[contact.name] for contact in contacts)
        angle = 0.0 if angles is None else float(angles[int(name.split()[1])])
        normal = _normal(contacts[0].position, angle)
        matrix += series * np.outer(normal, normal)
    free_tilt = isinstance(machine, BallBearing) and machine.tilt is None
    free = slice(2, 5 if free_tilt else 3)
    coupled = matrix[:2, free]
    across = matrix[:2, :2] - coupled @ np.linalg.pinv(matrix[free, free], rcond=1e-9) @ coupled.T
    rounding = 1e-12 * np.abs(across).max()
    return np.where(np.abs(across) > rounding, across, 0.0)


def _normal(position: float, contact_angle: float) -> Field:
    """Return the approach in a contact per motion: across x and y, along the axis, two tilts."""
    cosine, sine = math.cos(position), math.sin(position)
    across, along = math.cos(contact_angle), math.sin(contact_angle)
    return np.array([across * cosine, across * sine, along, along * cosine, along * sine])
