"""Sweep of a machine: its [study] varies any value, and every point is a solved machine."""

import itertools
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas

from asperity.case import MachineCase, RangeSection
from asperity.core.errors import BadInput
from asperity.core.files import make_folder, write_csv
from asperity.core.quantities import quantity
from asperity.machines.result import MachineResult
from asperity.machines.solve import solve_machine
from asperity.study import StudyProgress

TABLE = "study.csv"
OF_WORST = (
    *("clr", "clr_low", "clr_high", "lambda_ratio", "h_min_m", "h_central_m", "p_max_pa"),
    *("von_mises_core_pa", "friction_coefficient", "friction_coefficient_low"),
    *("friction_coefficient_high", "flash_temperature_max_k"),
)
LOSSES = "friction_power_w", "rolling_friction_power_w"  # summed over the contacts
MAX_POINTS = 1000


@dataclass(frozen=True)
class MachineSweep:
    """Solved points of a machine's [study].

    `rows` has one row per point: the swept values as written, the worst contact with its numbers
    (SI), the losses of all contacts, and the machine's ratings. `folder` holds the table and the
    points, None if they were not stored.
    """

    case: MachineCase
    rows: tuple[dict[str, object], ...]
    seconds: float
    folder: Path | None = None

    def verdict(self) -> str:
        """Return one sentence: the point and contact with the highest asperity load share."""
        solved = [row for row in self.rows if row["clr"] is not None]
        if not solved:
            return f"None of {len(self.rows)} machines was solved."
        worst = max(solved, key=lambda row: (float(str(row["clr"])), -float(str(row["h_min_m"]))))
        at = ", ".join(f"{key} = {worst[key]}" for key in self.axes)
        return (
            f"Of {len(self.rows)} machines that with {at} is the worst: at {worst['worst']} "
            f"asperities carry {quantity('clr').text_in(worst)} of the load."
        )

    @property
    def axes(self) -> tuple[str, ...]:
        """Keys that the sweep varies."""
        return tuple(self.case.sweep)

    def scalars(self) -> dict[str, object]:
        """Return the JSON output."""
        return {
            "verdict": self.verdict(),
            "axes": list(self.axes),
            "machines": list(self.rows),
            "table": None if self.folder is None else str(self.folder / TABLE),
            "seconds": self.seconds,
        }


def sweep_machine(
    case: MachineCase,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> MachineSweep:
    """Solve a machine at every point of its [study], the product of its lists of values.

    Parameters
    ----------
    case : from `load_machine`, with [study]
    out : folder for the table and every point, which a second call resumes; None: in memory
    workers, progress : see `solve_machine`

    Raises
    ------
    BadInput
        without [study], for a range in place of a list, too many points, or a value that is
        invalid in the case file.
    """
    start = time.perf_counter()
    points = sweep_points(case)
    machines = [_machine_of(case, point) for point in points]
    folder = None if out is None else Path(out)
    rows = []
    for number, (point, machine) in enumerate(zip(points, machines, strict=True), 1):
        place = None if folder is None else folder / f"point-{number:03d}"
        result = solve_machine(machine, out=place, workers=workers, progress=progress)
        rows.append({**point, **_row(result)})
        if folder is not None:
            make_folder(folder)
            write_csv(folder / TABLE, pandas.DataFrame(rows))
    return MachineSweep(case, tuple(rows), time.perf_counter() - start, folder)


def sweep_points(case: MachineCase) -> list[dict[str, object]]:
    """Return the points of a machine's [study]; raises as `sweep_machine`."""
    if not case.sweep:
        raise BadInput(
            f"{case.source}: study is missing; add [study] with lists of values, such as "
            'machine.torque = ["200 N m", "300 N m"]'
        )
    lists: dict[str, tuple[object, ...]] = {}
    for key, values in case.sweep.items():
        if isinstance(values, RangeSection):
            raise BadInput(f"{case.source}: study.{key} must be a list of values for a machine")
        lists[key] = values
    points = [
        dict(zip(lists, values, strict=True)) for values in itertools.product(*lists.values())
    ]
    if len(points) > MAX_POINTS:
        raise BadInput(
            f"{case.source}: study has {len(points)} machines, more than {MAX_POINTS}; shorten its "
            "lists"
        )
    for point in points:
        _machine_of(case, point)  # checks the values
    return points


def _machine_of(case: MachineCase, point: Mapping[str, object]) -> MachineCase:
    return case.with_written({**point, "study": "none"})


def _row(result: MachineResult) -> dict[str, object]:
    """Return the numbers of a solved machine."""
    worst: Mapping[str, object] = result.worst
    losses = {key: _total(result, key) for key in LOSSES}
    ratings = {
        rating.key: rating.machine_value for rating in result.ratings if set(rating.values) <= {""}
    }
    numbers = {key: worst.get(key) for key in OF_WORST}
    return {"worst": worst["name"], **numbers, **losses, **ratings, "failed": len(result.failures)}


def _total(result: MachineResult, key: str) -> float | None:
    """Return the sum over all contacts; None if one was not solved."""
    values = [row.get(key) for row in result.rows]
    return None if None in values else sum(float(value) for value in values if value is not None)
