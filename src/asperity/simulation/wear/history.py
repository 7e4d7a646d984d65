"""Wear history: a table with a row per jump, the surfaces before and after, and derived results."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas
import scipy

from asperity.case import Case
from asperity.core.arrays import finite_or_none
from asperity.core.coverage import PERCENT, UPPER
from asperity.core.displayed import Displayed
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.ehl import ContactState
from asperity.paper import Moment
from asperity.simulation.wear.frames import WearFrame
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.lift_off import LiftOffChange, Progress, lift_off_change
from asperity.simulation.wear.notes import history_notes
from asperity.simulation.wear.rows import RESONANCE, body_column, state_of_row
from asperity.simulation.wear.state import WearState
from asperity.simulation.wear.tracks import BODIES
from asperity.surface import MovingSurfaces
from asperity.trend import StageErrors, Stages, split_stages

HOUR = 3600.0
MIN_ROWS = 4  # for a drift
SAFETY = 1.25  # of error estimates by a second rule (Roache, J. Fluids Eng. 116 (1994) 405)
MAX_STAGE_POINTS = 60  # for the detection of stages
ENDS = ("sq_m", "clr", "car", "h_mean_m", "friction_coefficient", "crf_hz", "crfa")


class _Slope(NamedTuple):
    slope: float
    scatter: float


class WearDrift(NamedTuple):
    """Rate of change of a quantity per hour, and its interval."""

    per_hour: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, repr=False)
class WearHistory(Displayed):
    """Wear of a contact over hours.

    `table` has a row per jump, with the contact at its beginning, and one for the end;
    `docs/quantities.md` describes its columns, of which `..._1_m` etc. are those of one body.
    `initial_surfaces` and `worn` are the initial tracks and the final state; `frames` the contact
    at one position of selected jumps and of the end; `seconds` the computing time of this call,
    for `computed` jumps; `failed` the number of positions, over all jumps, that could not be
    solved and were left out of means; `folder` where it is stored, `path` of its table and `files`
    of its surfaces.
    """

    contact: WearingContact
    table: pandas.DataFrame
    worn: WearState
    frames: tuple[WearFrame, ...] = ()
    folder: Path | None = None
    path: Path | None = None
    files: tuple[Path, ...] = ()
    seconds: float = 0.0
    computed: int = 0
    remarks: tuple[str, ...] = field(default=())

    @property
    def case(self) -> Case:
        """Case that was worn."""
        return self.contact.case

    @property
    def hours(self) -> float:
        """Duration of the wear."""
        return self.worn.time / HOUR

    @property
    def initial_surfaces(self) -> MovingSurfaces:
        """Initial tracks of both bodies."""
        return self.contact.surfaces

    @property
    def final_surfaces(self) -> MovingSurfaces:
        """Final tracks of both bodies."""
        return self.contact.worn_surfaces(self.worn)

    @property
    def overrollings(self) -> tuple[float, float]:
        """Number of times that a point of each body has passed the contact."""
        first, second = (rate * self.worn.time for rate in self.contact.overrolling)
        return first, second

    @property
    def worn_volume(self) -> tuple[float, float]:
        """Volume lost by each body all round [m^3], by law and mechanisms, without flattening."""
        return self._lost(0), self._lost(1)

    def _lost(self, body: int) -> float:
        return self.contact.volume(self.worn.worn[body] - self.worn.changed[body], body)

    @property
    def volume_error(self) -> float:
        """Relative error of the worn volume by the length of jumps; the larger of both bodies.

        A jump removes at its initial rate. The error is the difference to the trapezoidal rule,
        times SAFETY, plus `balance_error`; nan in a history of a version without wear rates.
        """
        seconds = HOUR * np.diff(self.table["hours"].to_numpy(float))
        errors = [0.0]
        for body in BODIES:
            column = body_column("wear_rate_m3_s", body)
            if column not in self.table:
                return math.nan
            rates = self.table[column].to_numpy(float)
            removed, change = float(rates[:-1] @ seconds), float(np.diff(rates) @ seconds)
            if removed != 0.0:  # true for nan
                errors.append(0.5 * SAFETY * abs(change) / removed)
        return float(np.max(errors)) + self.balance_error

    @property
    def balance_error(self) -> float:
        """Relative difference of the lost volume and the booked one; the larger of both bodies.

        The booked volume is k times asperity load times sliding distance, and that of mechanisms.
        """
        booked = [self.worn.booked[body] + self.worn.mechanical[body] for body in BODIES]
        misses = [abs(self._lost(body) - booked[body]) for body in BODIES]
        scale = [abs(self.worn.booked[body]) + abs(self.worn.mechanical[body]) for body in BODIES]
        return max(
            (miss / total for miss, total in zip(misses, scale, strict=True) if total > 0.0),
            default=0.0,
        )

    def row_at(self, row: int) -> dict[str, float | None]:
        """Return a row by column, -1 the last; None for unknown values."""
        values = self.table.iloc[row].items()
        return {str(key): finite_or_none(float(value)) for key, value in values}

    @property
    def failed(self) -> int:
        """Positions that could not be solved, over all jumps."""
        return int(self.table["failed"].sum())

    @property
    def k_interval(self) -> tuple[float, float] | None:
        """Ends of k's interval relative to k, if wear scales with k times time; else None.

        With removal only, and the same interval for both bodies, a different k only stretches time.
        """
        first, second = self.contact.model.coefficients
        same = (
            first.k == 0.0
            or second.k == 0.0
            or (first.low, first.high) == (second.low, second.high)
        )
        if not self.contact.model.only_removal or not same:
            return None
        coefficient = second if first.k == 0.0 else first
        return coefficient.low, coefficient.high

    def values_at(self, hours: float) -> dict[str, float]:
        """Return all quantities at a moment, interpolated linearly between rows.

        Raises
        ------
        BadInput
            for a moment before the beginning or after the end.
        """
        last = float(self.table["hours"].iloc[-1])
        if not 0.0 <= hours <= last * (1.0 + 1e-12):
            raise BadInput(f"the wear history has 0 to {last:g} h, got {hours:g} h; extend it")
        along = self.table["hours"].to_numpy()
        return {
            key: float(np.interp(hours, along, self.table[key].to_numpy(float)))
            for key in self.table.columns
        }

    def state(self, hours: float) -> ContactState:
        """Return the mean contact state at a moment; raises as `values_at`."""
        return state_of_row(self.values_at(hours))

    def moments(self, hours: Sequence[float] | None = None, count: int = 12) -> list[Moment]:
        """Return moments for recordings of a simulated rig (`paper.simulate_rig`).

        They are at `hours`, or `count` moments spread evenly. Raises as `values_at`.
        """
        times = hours or list(np.linspace(0.0, float(self.table["hours"].iloc[-1]), count))
        return [Moment(float(time), self.state(float(time))) for time in times]

    def interval_by_k(self, key: str) -> "pandas.DataFrame | None":
        """Return a quantity's interval by k over time: columns `hours`, `low`, `high`.

        The interval is the range of the quantity between the ends of the interval of k times the
        time; nan where the history would have to be longer. None where wear does not scale with k
        (`k_interval`).
        """
        if self.k_interval is None:
            return None
        slow, fast = self.k_interval
        hours = self.table["hours"].to_numpy(float)
        values = self.table[key].to_numpy(float)
        ranges = []
        for time in hours:
            inside = values[(hours >= slow * time) & (hours <= fast * time)]
            candidates = np.append(
                inside, np.interp([slow * time, min(fast * time, hours[-1])], hours, values)
            )
            covered = fast * time <= hours[-1] * (1.0 + 1e-12)
            ranges.append(
                (float(np.min(candidates)), float(np.max(candidates)))
                if covered
                else (math.nan, math.nan)
            )
        low, high = np.array(ranges).T
        return pandas.DataFrame({"hours": hours, "low": low, "high": high})

    def drift(self, key: str, since: float = 0.0, until: float | None = None) -> WearDrift:
        """Return the rate of change of a column between two moments [h], by linear regression.

        The interval is Student's for the slope, given the scatter of the rows, and, where wear
        scales with k (`k_interval`), also covers the slopes with k at the ends of its interval:
        those of the history stretched in time, as far as it extends.

        Raises
        ------
        BadInput
            for an unknown column, or fewer than MIN_ROWS known rows between the moments.
        """
        if key not in self.table:
            raise BadInput(
                f"the wear history has no column {key}; "
                f"it has {', '.join(map(str, self.table.columns))}"
            )
        end = float(self.table["hours"].iloc[-1])
        moments = since, end if until is None else until
        base = self._slope(key, *moments)
        if base is None:
            raise BadInput(
                f"a drift of {key} needs {MIN_ROWS} rows with a value, got fewer from "
                f"{moments[0]:g} to {moments[1]:g} h; choose moments further apart, or a smaller "
                "wear.step"
            )
        limits = [sign * base.scatter + base.slope for sign in (-1.0, 1.0)]
        for factor in self.k_interval or ():
            other = self._slope(key, factor * moments[0], min(factor * moments[1], end)) or base
            limits += [factor * (other.slope + sign * other.scatter) for sign in (-1.0, 1.0)]
        return WearDrift(base.slope, min(limits), max(limits))

    def _slope(self, key: str, since: float, until: float) -> "_Slope | None":
        """Return slope and half its interval by linear regression; None with too few rows."""
        rows = self.table[self.table["hours"].between(since, until) & self.table[key].notna()]
        if len(rows) < MIN_ROWS:
            return None
        fitted = scipy.stats.linregress(rows["hours"].to_numpy(float), rows[key].to_numpy(float))
        return _Slope(
            float(fitted.slope), float(scipy.stats.t.ppf(UPPER, len(rows) - 2) * fitted.stderr)
        )

    def volume_interval(self, body: int) -> tuple[float, float] | None:
        """Return the interval of a body's worn volume [m^3], by k.

        It is extrapolated beyond the end at the last rate: too high where wear slows down.
        """
        if self.k_interval is None:
            return None
        hours = self.table["hours"].to_numpy(float)
        volume = self.table[body_column("worn_volume_m3", body)].to_numpy(float)
        slow, fast = (end * hours[-1] for end in self.k_interval)
        rate = (volume[-1] - volume[-2]) / (hours[-1] - hours[-2]) if len(hours) > 1 else 0.0
        return float(np.interp(slow, hours, volume)), float(volume[-1] + rate * (fast - hours[-1]))

    def lift_off(self, progress: Progress | None = None) -> LiftOffChange:
        """Return the lift-off speeds of the initial and the final tracks.

        Each takes about ten running contacts; `progress` is called after each with its entrainment
        speed [m/s] and load share.
        """
        return lift_off_change(self.case, self.initial_surfaces, self.final_surfaces, progress)

    @cached_property
    def stages(self) -> Stages | None:
        """Wear stages detected in CRF over hours; None without CRF."""
        rows = self.table[self.table["crf_hz"].notna()]
        if len(rows) < 2:
            return None
        indices = np.unique(
            np.linspace(0, len(rows) - 1, min(MAX_STAGE_POINTS, len(rows))).round().astype(int)
        )
        selected = rows.iloc[indices]
        crf_error = selected["crf_std_hz"] if bool(selected["crf_std_hz"].notna().all()) else None
        return split_stages(
            selected["hours"],
            selected["crf_hz"],
            selected["crfa"],
            errors=StageErrors(crf_hz=crf_error),
            unit="h",
        )

    def scalars(self) -> JsonObject:
        """Return the values of `asperity wear --json`."""
        first = self.table.iloc[0]
        last = self.table.iloc[-1]
        scalars: JsonObject = {
            "verdict": self.verdict(),
            "hours": self.hours,
            "overrollings": list(self.overrollings),
            "worn_volume_m3": list(self.worn_volume),
            "worn_volume_interval_m3": [self.volume_interval(body) for body in BODIES],
            "worn_depth_m": [float(last[body_column("worn_depth_m", body)]) for body in BODIES],
            "volume_error": finite_or_none(self.volume_error),
            "balance_error": self.balance_error,
            "jump_error": self.worn.error,
            "jumps": len(self.table) - 1,
            "computed": self.computed,
            "failed": self.failed,
            "patches": self.contact.patches,
            "seconds": self.seconds,
            "folder": None if self.folder is None else str(self.folder),
            "table": None if self.path is None else str(self.path),
            "surfaces": list(map(str, self.files)),
            "notes": list(self.notes),
        }
        for key in ENDS:
            scalars[key] = [finite_or_none(first[key]), finite_or_none(last[key])]
        for key in ("clr_low", "clr_high", "clr_mean_low", "clr_mean_high", *RESONANCE):
            scalars[key] = finite_or_none(last[key])
        scalars["stage"] = None if self.stages is None else self.stages.kind
        return scalars

    def printed_row(self, row: int) -> dict[str, float | None]:
        """Return a row with the intervals that are printed.

        Those of CLR and CRF are of the mean over positions, as the bands in the report, where
        those for a further position are not determined; without either they are left out.
        """
        values = self.row_at(row)
        if values["clr_low"] is None:
            ends = {end: end.replace("_mean", "") for end in RESONANCE if "_mean" in end}
            ends |= {RESONANCE[end]: RESONANCE[printed] for end, printed in ends.items()}
            values |= {printed: values[end] for end, printed in ends.items()}
            if values["clr_low"] is None:
                values = {key: values[key] for key in values if key not in ends.values()}
                values["crf_std_hz"] = None
        return values

    def _interval_words(self) -> str:
        """Return the end of the verdict where the intervals are not those for a further position.

        It is empty where they are.
        """
        if self.row_at(-1)["clr_low"] is not None:
            return ""
        known = "clr_low" in self.printed_row(-1)
        return f"; {PERCENT} intervals " + (
            "of the mean over positions" if known else "are not determined"
        )

    def verdict(self) -> str:
        """Return one sentence: worn depths, and changes of Sq, CLR and CRF."""
        first, last = self.row_at(0), self.printed_row(-1)
        depths = " and ".join(
            _depth_text(last[body_column("worn_depth_m", body)] or 0.0) for body in BODIES
        )
        changes = ", ".join(
            f"{quantity(key).short} {quantity(key).number(first[key])} to "
            f"{quantity(key).text_in(last)}"
            for key in ("sq_m", "clr", "crf_hz")
            if last[key] is not None and first[key] is not None
        )
        return (
            f"After {self.hours:.4g} h the bodies have worn by {depths}: {changes}"
            f"{self._interval_words()}."
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for a reader of the numbers, one sentence each."""
        model = self.contact.model
        contact = self.contact
        notes = [*self.remarks, *self.case.notes]
        if self.row_at(-1)["clr_low"] is None:
            notes.append(
                f"The {PERCENT} intervals of CLR and CRF for a further position, which include the "
                "error due to the cells, are not determined."
            )
        if model.overrolling is None:
            rates = " and ".join(f"{rate:.4g}" for rate in contact.overrolling)
            notes.append(
                f"Bodies of equal radius are assumed, with {rates} over-rollings per second; "
                "state wear.overrolling if that is wrong."
            )
        if self.failed:
            notes.append(
                f"{self.failed} contacts could not be solved and are left out of the means of "
                "their jumps."
            )
        if self.case.conditions.sliding_speed == 0.0:
            notes.append("There is no sliding, so no wear occurs.")
        notes += history_notes(contact, self.table, self.worn)
        acting = [name for name in ("fatigue", "ploughing", "scuffing") if name in model.mechanisms]
        acting += ["flattening"] if model.flattening else []
        notes.append(
            f"Modelled besides removal: {', '.join(acting)}."
            if acting
            else "Only removal is modelled, no roughening."
        )
        return tuple(notes)


def _depth_text(depth: float) -> str:
    """Return a depth with three digits, below 0.1 µm in nm."""
    return f"{1e9 * depth:.3g} nm" if abs(depth) < 1e-7 else f"{1e6 * depth:.3g} µm"
