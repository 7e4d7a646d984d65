"""Result of a cycle: film over time, rough contact at some instants, totals per cycle."""

import math
from dataclasses import dataclass

import numpy as np

from asperity.case import Case
from asperity.contact.cycle import OperatingCycle
from asperity.core.arrays import Field, finite_or_none
from asperity.core.displayed import Displayed
from asperity.core.documents import JsonObject
from asperity.core.quantities import UNKNOWN
from asperity.simulation.cycle.film import FilmCourse
from asperity.wear import WearCoefficient

STEP_ERROR = 0.02  # of a film by the time steps, the largest that half of them has changed
FINE = 2000  # intervals of an integral over a cycle


@dataclass(frozen=True, kw_only=True)
class CycleInstant:
    """Rough contact at an instant: means over tracks and a short time, SI.

    `half_widths` are those of the intervals by key, None where not determined: of the scatter
    between the tracks and, if `grid` is known, the difference to a grid of half as many cells.
    `friction_sides` are the errors of the friction coefficient by the oil, below and above. A
    `reason` states why there are no numbers.
    """

    time: float
    numbers: dict[str, float]
    half_widths: dict[str, float | None]
    friction_sides: tuple[float, float] = (0.0, 0.0)
    tracks: int = 0
    reason: str = ""

    def interval(self, key: str) -> tuple[float | None, float | None]:
        """Return the interval of a number; (None, None) where not determined."""
        value, half = self.numbers.get(key), self.half_widths.get(key)
        if value is None or half is None:
            return None, None
        below = above = half
        if key == "friction_coefficient":
            below, above = (math.hypot(half, side) for side in self.friction_sides)
        top = 1.0 if key in ("clr", "car") else math.inf
        return max(value - below, 0.0), min(value + above, top)


@dataclass(frozen=True, kw_only=True)
class CycleTotal:
    """Integral over a cycle with its interval; None where not determined."""

    value: float | None
    low: float | None = None
    high: float | None = None

    def scalars(self, key: str, unit: str) -> JsonObject:
        """Return value and ends by JSON key."""
        return {
            f"{key}_{unit}": self.value,
            f"{key}_low_{unit}": self.low,
            f"{key}_high_{unit}": self.high,
        }


@dataclass(frozen=True, kw_only=True, repr=False)
class CycleResult(Displayed):
    """Contact over a cycle of load and speeds.

    `film` is the smooth contact in time, `coarse` the same with half of the cells
    (None if that was not solved), `steady` its
    steady central and minimum film [m] at the times of `instants`, which are the rough contact,
    empty for smooth bodies. `steady_thinnest` is the steady minimum film where the film in time is
    thinnest, nan without entrainment. `seconds` of computing, `notes` are sentences for a reader.
    """

    case: Case
    cycle: OperatingCycle
    film: FilmCourse
    coarse: FilmCourse | None
    steady_times: Field
    steady: list[tuple[float, float]]
    steady_thinnest: float
    instants: tuple[CycleInstant, ...]
    wear_coefficients: tuple[WearCoefficient, WearCoefficient] | None
    seconds: float
    notes: tuple[str, ...] = ()

    @property
    def solved(self) -> tuple[CycleInstant, ...]:
        """Instants with numbers."""
        return tuple(instant for instant in self.instants if not instant.reason)

    @property
    def failures(self) -> tuple[CycleInstant, ...]:
        """Instants that were not solved."""
        return tuple(instant for instant in self.instants if instant.reason)

    @property
    def thinnest(self) -> tuple[float, float]:
        """Time [s] and smallest minimum film [m] of the smooth contact."""
        index = int(np.argmin(self.film.h_min))
        return float(self.film.times[index]), float(self.film.h_min[index])

    def film_interval(self, name: str, time: float) -> tuple[float | None, float | None]:
        """Return the interval of a film at a time [s] by cells and time steps [m]."""
        if self.coarse is None:
            return None, None
        value, other = (
            float(course.interpolated(name, np.array([time]))[0])
            for course in (self.film, self.coarse)
        )
        error = math.hypot(value - other, STEP_ERROR * value)
        return max(value - error, 0.0), value + error

    @property
    def touches(self) -> bool:
        """True if the smooth bodies touch at a time, so that the film is the contact film."""
        return self.thinnest[1] <= self.case.options.contact_film * (1.0 + 1e-6)

    def worst(self, key: str) -> CycleInstant | None:
        """Return the instant with the largest value of a number; None without one."""
        known = [
            instant for instant in self.solved if math.isfinite(instant.numbers.get(key, math.nan))
        ]
        return max(
            known,
            key=lambda instant: instant.numbers[key],
            default=None,
        )

    def over_time(self, key: str, times: Field, end: int | None = None) -> Field | None:
        """Return a number at some times between the instants, or the low (0) or high (1) `end`."""
        if key in self.film.measured and end is None:
            course: Field = np.interp(
                times,
                self.film.times,
                self.film.measured[key],
            )
            return course
        if len(self.solved) < 2:
            return None
        values = [
            instant.numbers[key] if end is None else instant.interval(key)[end]
            for instant in self.solved
        ]
        if any(value is None for value in values):
            return None
        period = self.cycle.period if self.cycle.repeats else None
        known = [instant.time for instant in self.solved]
        numbers: Field = np.interp(
            times,
            known,
            np.array(values, float),
            period=period,
        )
        return numbers

    @property
    def friction_energy(self) -> CycleTotal:
        """Energy dissipated by sliding friction in a cycle [J]."""
        return self._total("friction_coefficient", 1.0)

    @property
    def mean_clr(self) -> CycleTotal:
        """Mean of the load share over a cycle, weighted by load and time."""
        times, load, _ = self._conditions()
        weight = float(np.trapezoid(load, times))
        return self._integral("clr", load / weight)

    def wear_volume(self, body: int) -> CycleTotal:
        """Return the volume that wears from the first (0) or second (1) body in a cycle [m^3].

        By Archard's law; the interval includes that of the wear coefficient.
        """
        if self.wear_coefficients is None:
            return CycleTotal(value=None)
        coefficient = self.wear_coefficients[body]
        volume = self._total("clr", coefficient.k)
        if not volume.value or volume.low is None or volume.high is None:
            return volume
        below, above = (
            math.hypot(math.log(share), math.log(end)) if share > 0.0 and end > 0.0 else math.inf
            for share, end in (
                (volume.low / volume.value, coefficient.low),
                (volume.high / volume.value, coefficient.high),
            )
        )
        return CycleTotal(
            value=volume.value,
            low=volume.value * math.exp(-below),
            high=volume.value * math.exp(above),
        )

    def _conditions(self) -> tuple[Field, Field, Field]:
        """Return times, loads [N] and sliding speeds [m/s], without sign, for integrals."""
        rows = np.asarray(self.cycle.times, float)
        times = np.unique(
            np.concatenate(
                [
                    rows,
                    np.linspace(
                        0.0,
                        self.cycle.period,
                        FINE + 1,
                    ),
                ]
            )
        )
        _, sliding, load = self.cycle.columns(times)
        return times, load, np.abs(sliding)

    def _total(self, key: str, factor: float) -> CycleTotal:
        """Return the integral of a share of the load times the sliding speed."""
        _, load, sliding = self._conditions()
        return self._integral(key, factor * load * sliding)

    def _integral(self, key: str, weight: Field) -> CycleTotal:
        """Return the integral of a number times a weight, with the error of its interpolation."""
        times, _, _ = self._conditions()
        value = self.over_time(key, times)
        if value is None:
            return CycleTotal(value=None)
        total = float(np.trapezoid(value * weight, times))
        ends = [self.over_time(key, times, end) for end in (0, 1)]
        if ends[0] is None or ends[1] is None:
            return CycleTotal(value=total)
        low, high = (float(np.trapezoid(end * weight, times)) for end in ends if end is not None)
        coarse = self._with_half_the_instants(key, times)
        if coarse is None:  # the error of the interpolation is not known
            return CycleTotal(value=total)
        change = float(np.trapezoid(coarse * weight, times)) - total
        return CycleTotal(
            value=total,
            low=max(total - math.hypot(total - low, change), 0.0),
            high=total + math.hypot(high - total, change),
        )

    def _with_half_the_instants(self, key: str, times: Field) -> Field | None:
        """Return a number interpolated between every other instant; None with too few."""
        every_other = self.solved[::2]
        if len(every_other) < 2:
            return None
        values = [instant.numbers[key] for instant in every_other]
        period = self.cycle.period if self.cycle.repeats else None
        numbers: Field = np.interp(
            times, [instant.time for instant in every_other], values, period=period
        )
        return numbers

    def scalars(self) -> JsonObject:
        """Return the values of `asperity cycle --json`."""
        time, least = self.thinnest
        worst = self.worst("clr")
        share = (None, None) if worst is None else worst.interval("clr")
        flash = self.worst("flash_temperature_max_k")
        mean = self.mean_clr
        return {
            "verdict": self.verdict(),
            "period_s": self.cycle.period,
            "repeats": self.cycle.repeats,
            "h_min_m": least,
            "h_min_low_m": self.film_interval("h_min", time)[0],
            "h_min_high_m": self.film_interval("h_min", time)[1],
            "h_min_time_s": time,
            "h_min_steady_m": finite_or_none(self.steady_thinnest),
            "clr_max": None if worst is None else worst.numbers["clr"],
            "clr_max_low": share[0],
            "clr_max_high": share[1],
            "clr_max_time_s": None if worst is None else worst.time,
            "clr": mean.value,
            "clr_low": mean.low,
            "clr_high": None if mean.high is None else min(mean.high, 1.0),
            "flash_temperature_max_k": None
            if flash is None
            else flash.numbers["flash_temperature_max_k"],
            **self.friction_energy.scalars("friction_energy", "j"),
            **self.wear_volume(0).scalars("wear_volume_first", "m3"),
            **self.wear_volume(1).scalars("wear_volume_second", "m3"),
            "steps": self.film.steps,
            "failed": self.film.failed,
            "load_error": self.film.load_error,
            "periods": self.film.periods,
            "cells": list(self.film.grid.cells),
            "seconds": self.seconds,
            "notes": list(self.notes),
            "film": self.film_rows(),
            "instants": self.instant_rows(),
        }

    def film_rows(self) -> list[JsonObject]:
        """Return a row per output time of the smooth contact."""
        rows: list[JsonObject] = []
        for index, time in enumerate(self.film.times):
            instant = self.cycle.state(float(time))
            low, high = self.film_interval("h_min", float(time))
            rows.append(
                {
                    "time_s": float(time),
                    **self._place(float(time)),
                    "load_n": instant.carried,
                    "entrainment_speed_m_s": instant.entrainment_speed,
                    "sliding_speed_m_s": instant.sliding_speed,
                    "radius_m": instant.radius,
                    "h_central_m": float(self.film.h_central[index]),
                    "h_min_m": float(self.film.h_min[index]),
                    "h_min_low_m": low,
                    "h_min_high_m": high,
                    "p_max_pa": float(self.film.p_max[index]),
                }
            )
        return rows

    def instant_rows(self) -> list[JsonObject]:
        """Return a row per instant: rough contact, smooth film in time, and steady film."""
        rows: list[JsonObject] = []
        by_time = {instant.time: instant for instant in self.instants}
        for time, (central, least) in zip(
            self.steady_times,
            self.steady,
            strict=True,
        ):
            state = self.cycle.state(float(time))
            row: JsonObject = {
                "time_s": float(time),
                **self._place(float(time)),
                "load_n": state.carried,
                "entrainment_speed_m_s": state.entrainment_speed,
                "sliding_speed_m_s": state.sliding_speed,
                "h_central_smooth_m": float(self.film.interpolated("h_central", time)),
                "h_min_smooth_m": float(self.film.interpolated("h_min", time)),
                "h_central_steady_m": finite_or_none(central),
                "h_min_steady_m": finite_or_none(least),
            }
            instant = by_time.get(float(time))
            if instant is not None:
                row |= _numbers_of(instant)
            rows.append(row)
        return rows

    def _film_text(self) -> str:
        """Return a clause on the thinnest film of the smooth bodies."""
        time, least = self.thinnest
        if self.touches:
            return f"the smooth bodies touch, at {_time_text(time)}"
        thinner, thicker = self.film_interval("h_min", time)
        interval = UNKNOWN
        if thinner is not None and thicker is not None:
            interval = f"{1e6 * thinner:.3g} to {1e6 * thicker:.3g} um"
        steady = "there is no steady film"
        if math.isfinite(self.steady_thinnest):
            steady = f"steady: {1e6 * self.steady_thinnest:.3g} um"
        return (
            f"the film of the smooth bodies is at least {1e6 * least:.3g} um ({interval}; "
            f"{steady}), at {_time_text(time)}"
        )

    def _place(self, time: float) -> JsonObject:
        """Return where in a machine's cycle the contact is at a time [s]."""
        position = self.cycle.position(time)
        return {} if position is None else {self.cycle.place: position}

    def verdict(self) -> str:
        """Return one sentence: thinnest film with the steady one, largest load share, wear."""
        sentence = f"Over a cycle of {_time_text(self.cycle.period)} {self._film_text()}"
        worst = self.worst("clr")
        if worst is not None:
            low, high = worst.interval("clr")
            interval = "" if low is None else f" ({100 * low:.0f} to {100 * (high or 0.0):.0f} %)"
            mean = self.mean_clr.value
            sentence += (
                f"; asperities carry up to {100 * worst.numbers['clr']:.0f} %{interval} of the "
                f"load, at {_time_text(worst.time)}"
            )
            sentence += "" if mean is None else f", {100 * mean:.3g} % on average"
        if self.film.failed:
            sentence = (
                f"NOT CONVERGED at {self.film.failed} of {self.film.steps} time steps, do not use "
                f"the film: {sentence}"
            )
        return f"{sentence}."


def _numbers_of(instant: CycleInstant) -> JsonObject:
    """Return numbers and intervals of an instant by JSON key."""
    row: JsonObject = {"tracks": instant.tracks, "reason": instant.reason}
    for key, value in instant.numbers.items():
        row[key] = finite_or_none(value)
        if key in ("clr", "car", "friction_coefficient"):
            row[f"{key}_low"], row[f"{key}_high"] = instant.interval(key)
    return row


def _time_text(seconds: float) -> str:
    """Return a time with a suitable unit."""
    factor, unit = (1.0, "s") if seconds >= 1.0 else (1e3, "ms") if seconds >= 1e-3 else (1e6, "us")
    return f"{factor * seconds:.4g} {unit}"
