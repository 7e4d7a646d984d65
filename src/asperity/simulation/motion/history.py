"""A contact over time: a row a step, maps of some steps, and what both come to."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.arrays import Field, Mask, finite_or_none
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
    """Maps of one step in single precision, (nx, ny): film [m], pressure [Pa], where bodies touch."""

    number: int
    time: float
    gap: Field
    pressure: Field
    in_contact: Mask


@dataclass(frozen=True, kw_only=True)
class History:
    """A contact over time.

    `table` has a row a step, step 0 the start: `step`, `heat_j` (friction's and the flow's, summed
    over time by the trapezoidal rule) and the columns of `simulation.motion.rows`, which the catalogue of
    quantities describes; `resonance_hz` is nan without an oscillator. `seconds` is what computing
    took this time, of `computed` steps; `folder` where it is kept, `memory` what the next step
    needs to know, `remarks` what the folder's files have to say of themselves.
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
        """Sentences that a reader of the numbers has to know."""
        return (*self.remarks, *self.case.surface_notes, *self.case.notes)

    @property
    def failed(self) -> tuple[int, ...]:
        """Steps that did not converge."""
        return tuple(int(number) for number in self.table["step"][~self.table["converged"]])

    @property
    def settled(self) -> pandas.DataFrame:
        """The steps that means are of: oil has crossed the domain once, or else the second half.

        Where surfaces are flattened nothing repeats, and it is the last pass.
        """
        if self.case.motion.flattening:
            length = steps_a_pass(self.case, self.case.moving_surfaces())
            if length < self.steps:
                last: pandas.DataFrame = self.table[self.table["step"] > self.steps - length + 1e-9]
                return last
        crossing = math.ceil(self.case.grid.cells[0] / self.case.motion.time_step)
        return self.table[self.table["step"] >= min(crossing, (self.steps + 1) // 2)]

    def by_pass(self) -> pandas.DataFrame:
        """Each whole pass of the rough surface's track (of two, the slower one's), the start apart: means of its steps.

        Columns as in `table`, `pass` in place of `step`; of what only grows or falls (`time_s`,
        `track_sq_m`, `flattened_m`, `heat_j`) the value at its end.
        """
        length = steps_a_pass(self.case, self.case.moving_surfaces())
        moving = self.table[self.table["step"] > 0]
        number = np.ceil(moving["step"] / length - 1e-9).astype(int)
        whole = moving[number * length <= self.steps + 1e-9]
        grouped = whole.groupby(number.rename("pass"))
        means: pandas.DataFrame = grouped.mean(numeric_only=True).drop(columns="step").reset_index()
        for column in ("time_s", "track_sq_m", "flattened_m", "heat_j"):
            means[column] = grouped[column].last().to_numpy()
        return means

    @cached_property
    def vibration(self) -> Vibration | None:
        """What the mean contact of the settled steps sounds like.

        None without [vibration], or where its stiffness or excitation is that of one solved
        contact.
        """
        model, case = self.case.vibration, self.case
        if model is None or model.needs_solution:
            return None
        with case.naming("vibration"):
            return contact_vibration(self.mean_state, case.conditions, model)

    @property
    def mean_state(self) -> ContactState:
        """The mean contact of the settled steps; it has no lambda ratio."""
        return mean_state(self.settled.mean(numeric_only=True))

    def surfaces(self) -> MovingSurfaces:
        """The case's surfaces, as far pressed flat as they are at the end."""
        surfaces = self.case.moving_surfaces()
        if self.case.motion.flattening and self.memory is not None:
            return surfaces.lowered(self.memory["lowered_first"], self.memory["lowered_second"])
        return surfaces

    def scalars(self) -> dict[str, Any]:
        """What `asperity run --json` says of the history: means and standard deviations over the settled steps."""
        rows, first = self.settled, self.table.iloc[0]
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
        """One sentence: what moving did to the contact."""
        rows, first = self.settled, self.table.iloc[0]
        at_start = "snapshot" if self.case.motion.start == "steady" else "contact at rest"
        sentence = (
            f"Asperities carry {100 * rows['clr'].mean():.1f} ± {100 * rows['clr'].std(ddof=0):.1f} % of the load in "
            f"motion, {100 * first['clr']:.1f} % in the {at_start}: {self.steps} steps, "
            f"{1e6 * self.table['time_s'].iloc[-1]:.4g} us"
        )
        if self.case.motion.flattening and len(passes := self.by_pass()):
            sentence += f", the mean of the last of {len(passes)} passes"
        if self.failed:
            sentence = (
                f"NOT CONVERGED at step {self.failed[0]}, do not use what follows it: {sentence}"
            )
        return f"{sentence}."


def steps_a_pass(case: Case, surfaces: MovingSurfaces) -> float:
    """Length of a pass of the rough surface's whole track, of two the slower one's."""
    rough = surfaces.rough if any(surfaces.rough) else (True, True)
    passage = max(surfaces.passage_time(index) for index in (0, 1) if rough[index])
    return passage / step_seconds(case.conditions, surfaces, case.motion.time_step)
