"""History of a moving contact: a table with a row per step, maps of some steps, and results."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.arrays import Field, Mask, finite_or_none
from asperity.core.displayed import Displayed
from asperity.core.quantities import quantity
from asperity.coupling import Vibration, contact_vibration
from asperity.ehl import ContactState
from asperity.simulation.motion.rows import mean_state
from asperity.surface import MovingSurfaces
from asperity.transient import Memory, step_seconds

SUMMARISED = (
    "car",
    "car_domain",
    "clr",
    "h_min_m",
    "h_central_m",
    "h_mean_m",
    "p_max_pa",
    "friction_coefficient",
    "friction_power_w",
    "flow_power_w",
    "contact_force_n",
    "resonance_hz",
    "mass_flux_imbalance",
)
OVER_PASSES = (
    "pass",
    "time_s",
    "car",
    "clr",
    "track_sq_m",
    "flattened_m",
    "friction_coefficient",
    "resonance_hz",
)


class MotionFrame(NamedTuple):
    """Maps of one step in single precision, (nx, ny): film [m], pressure [Pa], contact mask."""

    number: int
    time: float
    gap: Field
    pressure: Field
    in_contact: Mask


@dataclass(frozen=True, kw_only=True, repr=False)
class History(Displayed):
    """Moving contact over time.

    `table` has a row per step, step 0 being the start: `step`, `heat_j` (friction's and the flow's,
    integrated over time by the trapezoidal rule) and the columns of `motion.rows`, which the
    catalogue of quantities describes; `resonance_hz` is nan without an oscillator. `seconds` is the
    computing time of this call, for `computed` steps; `folder` where it is stored, `memory` the
    state for the next step, `remarks` notes on the version of a stored history.
    """

    case: Case
    table: pandas.DataFrame
    frames: tuple[MotionFrame, ...]
    folder: Path | None
    seconds: float = 0.0
    computed: int = 0
    memory: Memory | None = field(default=None, repr=False)
    remarks: tuple[str, ...] = ()

    @property
    def steps(self) -> int:
        """Number of the last step."""
        return int(self.table["step"].iloc[-1])

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for a reader of the numbers, one sentence each."""
        return (*self.remarks, *self.case.surface_notes, *self.case.notes)

    @property
    def failed(self) -> tuple[int, ...]:
        """Steps that did not converge."""
        return tuple(int(number) for number in self.table["step"][~self.table["converged"]])

    @property
    def settled(self) -> pandas.DataFrame:
        """Rows after settling: after oil has crossed the domain once, or else the second half.

        With flattening nothing repeats, and the last pass is used.
        """
        if self.case.motion.flattening:
            length = steps_a_pass(self.case, self.case.moving_surfaces())
            if length < self.steps:
                last: pandas.DataFrame = self.table[self.table["step"] > self.steps - length + 1e-9]
                return last
        crossing = math.ceil(self.case.grid.cells[0] / self.case.motion.time_step)
        return self.table[self.table["step"] >= min(crossing, (self.steps + 1) // 2)]

    def by_pass(self) -> pandas.DataFrame:
        """Return means over each whole pass of the rough surface's track, without the start.

        Of two rough surfaces, the slower one's track counts. The columns are those of `table`, with
        `pass` in place of `step`; cumulative quantities (`time_s`, `track_sq_m`, `flattened_m`,
        `heat_j`) have their value at the end of the pass.
        """
        length = steps_a_pass(self.case, self.case.moving_surfaces())
        moving = self.table[self.table["step"] > 0]
        number = np.ceil(moving["step"] / length - 1e-9).astype(int)
        complete = moving[number * length <= self.steps + 1e-9]
        grouped = complete.groupby(number.rename("pass"))
        means: pandas.DataFrame = grouped.mean(numeric_only=True).drop(columns="step").reset_index()
        for column in ("time_s", "track_sq_m", "flattened_m", "heat_j"):
            means[column] = grouped[column].last().to_numpy()
        return means

    @cached_property
    def vibration(self) -> Vibration | None:
        """Vibration of the mean contact of the settled steps.

        It is None without [vibration] or where stiffness or excitation requires a solved contact.
        """
        model = self.case.vibration
        case = self.case
        if model is None or model.needs_solution:
            return None
        with case.naming("vibration"):
            return contact_vibration(self.mean_state, case.conditions, model)

    @property
    def mean_state(self) -> ContactState:
        """Mean contact state of the settled steps, without a lambda ratio."""
        return mean_state(self.settled.mean(numeric_only=True))

    def surfaces(self) -> MovingSurfaces:
        """Return the case's surfaces with their final plastic flattening."""
        surfaces = self.case.moving_surfaces()
        if self.case.motion.flattening and self.memory is not None:
            return surfaces.lowered(self.memory["lowered_first"], self.memory["lowered_second"])
        return surfaces

    def scalars(self) -> dict[str, Any]:
        """Return the values of `asperity run --json`: statistics of the settled steps."""
        rows = self.settled
        first = self.table.iloc[0]
        scalars: dict[str, Any] = {
            "verdict": self.verdict(),
            "steps": self.steps,
            "computed": self.computed,
            "failed": list(self.failed),
            "time_s": float(self.table["time_s"].iloc[-1]),
            "step_s": float(self.table["time_s"].iloc[1]) if self.steps else None,
            "settled_from_step": int(rows["step"].iloc[0]),
            "seconds": self.seconds,
            "folder": None if self.folder is None else str(self.folder),
        }
        for key in SUMMARISED:
            scalars[key] = finite_or_none(rows[key].mean())
            scalars[f"{key}_std"] = finite_or_none(rows[key].std(ddof=0))
            scalars[f"{key}_start"] = finite_or_none(first[key])
        for key in quantity("friction_coefficient").ends:
            scalars[key] = finite_or_none(rows[key].mean())
        if self.case.motion.flattening:
            passes = self.by_pass()[list(OVER_PASSES)].astype(object)
            scalars["passes"] = passes.where(passes.notna(), None).to_dict("records")
        resonance = (
            self.vibration.resonance
            if self.vibration is not None and self.vibration.resonance.found
            else None
        )
        return scalars | {
            key: finite_or_none(getattr(resonance, key, None)) for key in ("crf_hz", "crfa")
        }

    def verdict(self) -> str:
        """Return one sentence: load share in motion and at the start."""
        rows = self.settled
        first = self.table.iloc[0]
        at_start = "snapshot" if self.case.motion.start == "steady" else "contact at rest"
        mean = 100 * rows["clr"].mean()
        deviation = 100 * rows["clr"].std(ddof=0)
        sentence = (
            f"Asperities carry {mean:.1f} ± {deviation:.1f} % of the load in "
            f"motion, {100 * first['clr']:.1f} % in the {at_start}: {self.steps} steps, "
            f"{1e6 * self.table['time_s'].iloc[-1]:.4g} us"
        )
        if self.case.motion.flattening and len(passes := self.by_pass()):
            sentence += f", mean over the last of {len(passes)} passes"
        if self.failed:
            sentence = f"NOT CONVERGED at step {self.failed[0]}, do not use later steps: {sentence}"
        return f"{sentence}."


def steps_a_pass(case: Case, surfaces: MovingSurfaces) -> float:
    """Return the steps per pass of the rough surface's whole track; of two, the slower one's."""
    rough = surfaces.rough if any(surfaces.rough) else (True, True)
    passage = max(surfaces.passage_time(index) for index in (0, 1) if rough[index])
    return passage / step_seconds(case.conditions, surfaces, case.motion.time_step)
