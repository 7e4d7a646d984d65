"""A contact worn over hours: a row a jump, the surfaces before and after, and what they come to."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas
import scipy

from asperity.case import Case
from asperity.core.arrays import finite_or_none
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.ehl import ContactState
from asperity.paper import Moment
from asperity.simulation.wear.frames import WearFrame
from asperity.simulation.wear.jump import BODIES, WearingContact
from asperity.simulation.wear.notes import told
from asperity.simulation.wear.rows import RESONANCE, body_column, state_of_row
from asperity.simulation.wear.state import WearState
from asperity.surface import MovingSurfaces
from asperity.trend import Stages, split_stages

HOUR = 3600.0
FEWEST_ROWS = 4  # that a drift is read from
MOST_PLACES = 60  # that stages are read from
ENDS = ("sq_m", "clr", "car", "h_mean_m", "friction_coefficient", "crf_hz", "crfa")


class _Slope(NamedTuple):
    slope: float
    scatter: float


class WearDrift(NamedTuple):
    """How fast a number changes as the contact wears, in its unit an hour, and the ends of its 90 % interval."""

    per_hour: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class WearHistory:
    """A contact worn over hours.

    `table` has a row a jump, the contact at its beginning, and one for the end;
    `docs/quantities.md` describes its columns, of which `..._1_m` and so on are one body's.
    `before` and `worn` are the tracks at first, and what they have come to; `frames` the contact
    at one position of some jumps and of the end; `seconds` what computing took this time, of
    `computed` jumps; `failed` how many positions of all jumps could not be solved and were left
    out of means; `folder` where it is kept, `path` of its table and `files` of its surfaces.
    """

    ageing: WearingContact
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
        """What wore."""
        return self.ageing.case

    @property
    def hours(self) -> float:
        """How long it wore."""
        return self.worn.time / HOUR

    @property
    def before(self) -> MovingSurfaces:
        """Both tracks at first."""
        return self.ageing.surfaces

    @property
    def after(self) -> MovingSurfaces:
        """Both tracks at the end."""
        return self.ageing.worn_surfaces(self.worn)

    @property
    def overrollings(self) -> tuple[float, float]:
        """How often a point of each body has passed the contact."""
        first, second = (rate * self.worn.time for rate in self.ageing.overrolling)
        return first, second

    @property
    def worn_volume(self) -> tuple[float, float]:
        """What each body has lost all round it [m^3]: by law and mechanisms, not what was pressed flat."""
        return self._lost(0), self._lost(1)

    def _lost(self, body: int) -> float:
        return self.ageing.volume(self.worn.worn[body] - self.worn.changed[body], body)

    @property
    def volume_error(self) -> float:
        """How far what the tracks lost is from k times asperity load times sliding distance, and mechanisms; relative.

        The larger of both bodies'.
        """
        booked = [self.worn.booked[body] + self.worn.mechanical[body] for body in BODIES]
        misses = [abs(self._lost(body) - booked[body]) for body in BODIES]
        scale = [abs(self.worn.booked[body]) + abs(self.worn.mechanical[body]) for body in BODIES]
        return max(
            (miss / whole for miss, whole in zip(misses, scale, strict=True) if whole > 0.0),
            default=0.0,
        )

    @property
    def numbers_at_end(self) -> dict[str, float | None]:
        """The last row by its columns; None for what is not known."""
        return {
            str(key): finite_or_none(float(value)) for key, value in self.table.iloc[-1].items()
        }

    @property
    def failed(self) -> int:
        """Positions that could not be solved, over all jumps."""
        return int(self.table["failed"].sum())

    @property
    def scaled_by(self) -> tuple[float, float] | None:
        """Ends of the 90 % interval of k over k, the same for both bodies; None where it is not the only clock.

        Removal alone depends on k times time: with another k, all that happens, happens so much
        earlier or later.
        """
        first, second = self.ageing.model.coefficients
        same = (
            first.k == 0.0
            or second.k == 0.0
            or (first.low, first.high) == (second.low, second.high)
        )
        if not self.ageing.model.only_removal or not same:
            return None
        known = second if first.k == 0.0 else first
        return known.low, known.high

    def at(self, hours: float) -> dict[str, float]:
        """Every number at a moment, straight between the rows.

        Raises
        ------
        BadInput
            for a moment before the beginning or after the end.
        """
        last = float(self.table["hours"].iloc[-1])
        if not 0.0 <= hours <= last * (1.0 + 1e-12):
            raise BadInput(
                f"the wear history has 0 to {last:g} h, got {hours:g} h; wear it for longer"
            )
        along = self.table["hours"].to_numpy()
        return {
            key: float(np.interp(hours, along, self.table[key].to_numpy(float)))
            for key in self.table.columns
        }

    def state(self, hours: float) -> ContactState:
        """The mean contact at a moment; raises as `at`."""
        return state_of_row(self.at(hours))

    def moments(self, hours: Sequence[float] | None = None, count: int = 12) -> list[Moment]:
        """When it may be recorded (`paper.simulate_rig`): at these hours, or so many spread evenly; raises as `at`."""
        places = hours or list(np.linspace(0.0, float(self.table["hours"].iloc[-1]), count))
        return [Moment(float(place), self.state(float(place))) for place in places]

    def with_k(self, key: str) -> "pandas.DataFrame | None":
        """A number over the hours with its interval by k: columns `hours`, `low`, `high`.

        It is the range that the number has between the ends of the interval of k times the time;
        nan from where the history would have to be longer. None where k is not the only clock
        (`scaled_by`).
        """
        if self.scaled_by is None:
            return None
        slow, fast = self.scaled_by
        hours, values = self.table["hours"].to_numpy(float), self.table[key].to_numpy(float)
        ends = []
        for now in hours:
            inside = values[(hours >= slow * now) & (hours <= fast * now)]
            reached = np.append(
                inside, np.interp([slow * now, min(fast * now, hours[-1])], hours, values)
            )
            whole = fast * now <= hours[-1] * (1.0 + 1e-12)
            ends.append(
                (float(np.min(reached)), float(np.max(reached))) if whole else (math.nan, math.nan)
            )
        low, high = np.array(ends).T
        return pandas.DataFrame({"hours": hours, "low": low, "high": high})

    def drift(self, key: str, since: float = 0.0, until: float | None = None) -> WearDrift:
        """How fast a number of the table changes between two moments [h], by the line nearest to its rows there.

        The interval is Student's of the line's slope, as rows scatter with the positions that they
        are the mean of, and, where k is the only clock (`scaled_by`), it reaches over the slopes
        with k at the ends of its interval: that of the history so much earlier or later, as far as
        it goes, so much slower or faster.

        Raises
        ------
        BadInput
            for a number that the table has not, or fewer than FEWEST_ROWS rows between the moments that know it.
        """
        if key not in self.table:
            raise BadInput(
                f"the wear history has no number {key}; it has {', '.join(map(str, self.table.columns))}"
            )
        end = float(self.table["hours"].iloc[-1])
        moments = since, end if until is None else until
        here = self._slope(key, *moments)
        if here is None:
            raise BadInput(
                f"a drift of {key} needs {FEWEST_ROWS} rows that know it, got fewer from {moments[0]:g} to "
                f"{moments[1]:g} h; take moments further apart, or wear it with a smaller wear.step"
            )
        ends = [sign * here.scatter + here.slope for sign in (-1.0, 1.0)]
        for factor in self.scaled_by or ():
            there = self._slope(key, factor * moments[0], min(factor * moments[1], end)) or here
            ends += [factor * (there.slope + sign * there.scatter) for sign in (-1.0, 1.0)]
        return WearDrift(here.slope, min(ends), max(ends))

    def _slope(self, key: str, since: float, until: float) -> "_Slope | None":
        """Of the line nearest to the rows between, with half of its 90 % interval; None of too few rows."""
        rows = self.table[self.table["hours"].between(since, until) & self.table[key].notna()]
        if len(rows) < FEWEST_ROWS:
            return None
        fitted = scipy.stats.linregress(rows["hours"].to_numpy(float), rows[key].to_numpy(float))
        return _Slope(
            float(fitted.slope), float(scipy.stats.t.ppf(0.95, len(rows) - 2) * fitted.stderr)
        )

    def volume_interval(self, body: int) -> tuple[float, float] | None:
        """The 90 % interval of a body's worn volume [m^3], by k.

        Beyond the end it goes on as it last went: its upper end is too high where wear slows down.
        """
        if self.scaled_by is None:
            return None
        hours = self.table["hours"].to_numpy(float)
        volume = self.table[body_column("worn_volume_m3", body)].to_numpy(float)
        slow, fast = (end * hours[-1] for end in self.scaled_by)
        rate = (volume[-1] - volume[-2]) / (hours[-1] - hours[-2]) if len(hours) > 1 else 0.0
        return float(np.interp(slow, hours, volume)), float(volume[-1] + rate * (fast - hours[-1]))

    @cached_property
    def stages(self) -> Stages | None:
        """Stages of wear that the present detectors find in CRF over hours; None where there is no CRF."""
        rows = self.table[self.table["crf_hz"].notna()]
        if len(rows) < 2:
            return None
        places = np.unique(
            np.linspace(0, len(rows) - 1, min(MOST_PLACES, len(rows))).round().astype(int)
        )
        chosen = rows.iloc[places]
        off = chosen["crf_std_hz"] if bool(chosen["crf_std_hz"].notna().all()) else None
        return split_stages(
            chosen["hours"], chosen["crf_hz"], chosen["crfa"], crf_std_hz=off, unit="h"
        )

    def scalars(self) -> dict[str, Any]:
        """What `asperity wear --json` says of it."""
        first, last = self.table.iloc[0], self.table.iloc[-1]
        scalars: dict[str, Any] = {
            "verdict": self.verdict(),
            "hours": self.hours,
            "overrollings": list(self.overrollings),
            "worn_volume_m3": list(self.worn_volume),
            "worn_volume_interval_m3": [self.volume_interval(body) for body in BODIES],
            "worn_depth_m": [float(last[body_column("worn_depth_m", body)]) for body in BODIES],
            "volume_error": self.volume_error,
            "jump_error": self.worn.error,
            "jumps": len(self.table) - 1,
            "computed": self.computed,
            "failed": self.failed,
            "patches": self.ageing.patches,
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

    def verdict(self) -> str:
        """One sentence: what wear did to the contact."""
        first, last = self.table.iloc[0], self.table.iloc[-1]
        depths = " and ".join(
            quantity("worn_depth_m").text(last[body_column("worn_depth_m", body)])
            for body in BODIES
        )
        changes = ", ".join(
            f"{quantity(key).short} {quantity(key).number(first[key])} to {quantity(key).text(last[key])}"
            for key in ("sq_m", "clr", "crf_hz")
            if math.isfinite(float(last[key])) and math.isfinite(float(first[key]))
        )
        return f"After {self.hours:.4g} h the bodies have worn by {depths}: {changes}."

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the numbers has to know, a sentence each."""
        model, ageing = self.ageing.model, self.ageing
        notes = [*self.remarks, *self.case.notes]
        if model.overrolling is None:
            rates = " and ".join(f"{rate:.4g}" for rate in ageing.overrolling)
            notes.append(
                f"Bodies of equal radius are assumed: {rates} over-rollings a second; state wear.overrolling."
            )
        if self.failed:
            notes.append(
                f"{self.failed} contacts could not be solved and were left out of the means of their jumps."
            )
        if self.case.conditions.sliding_speed == 0.0:
            notes.append("Without sliding nothing is worn off.")
        notes += told(ageing, self.table, self.worn)
        acting = [name for name in ("fatigue", "ploughing", "scuffing") if name in model.mechanisms]
        acting += ["flattening"] if model.flattening else []
        notes.append(
            f"Besides removal: {', '.join(acting)}." if acting else "Nothing but removal acts."
        )
        return tuple(notes)
