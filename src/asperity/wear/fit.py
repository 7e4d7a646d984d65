"""One wear coefficient from a test: friction trace and scar of a ball or pin on a disc; and what another would lose.

k = V/(F s) of the disc alone, the scar's volume V over load and sliding distance (ASTM G99): the
radius of the track cancels, so k is the scar's area over load and laps. What stands beside the
scar is the disc's own, moved but not lost, or has come from the ball: the profile cannot say
which. All shares between are taken as likely, as far as the disc does not gain by them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity import recording, surface
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile, require_positive
from asperity.core.quantities import quantity
from asperity.wear.laws import SCATTER
from asperity.wear.scar import Scar, find_scar

AROUND = 0.2  # of the scar's area round the track, relative: one profile does not tell; ours
DRAWS = 20_000
INTERVAL = (0.05, 0.95)
_COLUMNS = {
    "distance": ("distance", "path", "sliding"),
    "laps": ("lap", "rev", "turn", "cycle"),
    "coefficient": ("mu", "µ", "μ", "cof", "coefficient"),
    "force": ("friction force", "frictionforce", "ff"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionTrace:
    """A test: `load` [N], sliding `distance` [m], `laps`, `track_radius` [m], `friction_energy` [J], mean coefficient.

    `notes` say in a sentence each where a number is from, or that two of them disagree.
    """

    load: float
    distance: float
    laps: float
    track_radius: float
    friction_energy: float
    coefficient: float
    distance_error: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Estimate:
    """A median and the 90 % interval about it."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, draws: Field) -> "Estimate":
        """Of equally likely values."""
        low, median, high = np.quantile(draws, [INTERVAL[0], 0.5, INTERVAL[1]])
        return cls(float(median), float(low), float(high))

    def ends(self) -> dict[str, float]:
        """By name."""
        return {"median": self.median, "low": self.low, "high": self.high}


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedWear:
    """What a test says of the disc's wear.

    `k` [1/Pa] with its interval in this test; `energy_coefficient` [m^3/J] the same over the
    friction's energy; `k_all_lost` and `k_none_lost` [1/Pa] if all that is piled up is foreign, or
    the disc's own (0 where more stands up than is missing); `volume` [m^3]; `second_volume` [m^3]
    what a second test of the same kind would lose, with the scatter from test to test in its
    interval.
    """

    trace: FrictionTrace
    scar: Scar
    k: Estimate
    energy_coefficient: Estimate
    k_all_lost: float
    k_none_lost: float
    volume: Estimate
    second_volume: Estimate
    second_load: float
    second_distance: float
    notes: tuple[str, ...]

    def scalars(self) -> dict[str, Any]:
        """What `asperity wear --json` says of a fit; an estimate as its median and the ends of its interval."""
        trace, scar = self.trace, self.scar
        return {
            "verdict": self.verdict(),
            "wear_coefficient": self.k.ends(),
            "wear_coefficient_all_lost": self.k_all_lost,
            "wear_coefficient_none_lost": self.k_none_lost,
            "energy_wear_coefficient": self.energy_coefficient.ends(),
            "scar_volume_m3": self.volume.ends(),
            "second_volume_m3": self.second_volume.ends(),
            "second_load_n": self.second_load,
            "second_distance_m": self.second_distance,
            "load_n": trace.load,
            "distance_m": trace.distance,
            "laps": trace.laps,
            "track_radius_m": trace.track_radius,
            "friction_coefficient": trace.coefficient,
            "friction_energy_j": trace.friction_energy,
            "scar_width_m": scar.width,
            "scar_missing_m2": scar.missing,
            "scar_piled_m2": scar.piled,
            "profile_roughness_m": scar.roughness,
            "notes": list(self.notes),
        }

    def verdict(self) -> str:
        """One sentence: k, between what bounds, and what a second test would lose."""
        k, second, ends = (
            quantity("wear_coefficient"),
            quantity("second_volume_m3"),
            self.second_volume,
        )
        return (
            f"k is {k.text(self.k.median)}, {k.number(self.k.low)} to {k.text(self.k.high)} at 90 %; a second test of "
            f"{self.second_load:.4g} N over {self.second_distance:.4g} m would lose {second.number(ends.low)} to "
            f"{second.text(ends.high)}."
        )


def read_friction_trace(
    path: str | Path, *, load: float | None = None, track_radius: float | None = None
) -> FrictionTrace:
    """Read a tribometer's record with columns for distance [m] or laps, and coefficient or friction force [N].

    Parameters
    ----------
    load : [N]; by default what force over coefficient says
    track_radius : [m]; by default what distance over laps says

    Raises
    ------
    BadInput
        for a record that lacks a column and its stand-in, and what `open_channels` refuses.
    """
    opened = recording.open_channels(path, rate_hz=1.0)  # nothing here hangs on time
    columns = {role: _column(opened, names) for role, names in _COLUMNS.items()}
    name, notes = Path(path).name, []
    mu, force = columns["coefficient"], columns["force"]
    if load is None:
        if mu is None or force is None:
            raise BadInput(
                f"{name} has no two columns of coefficient and friction force; give the load"
            )
        known = np.abs(mu) > 0.01
        load = float(np.median(force[known] / mu[known]))
        notes.append(f"load {load:.4g} N: friction force over coefficient")
    require_positive("load", load, "N")
    if mu is None:
        if force is None:
            raise BadInput(
                f"{name} has no column of coefficient or friction force; name one mu or FrictionForce"
            )
        mu = force / load
    distance, laps, radius, error = _way(
        name, columns["distance"], columns["laps"], track_radius, notes
    )
    passed = next(columns[role] for role in ("distance", "laps") if columns[role] is not None)
    energy = float(
        np.trapezoid(mu * load, np.asarray(passed) / float(np.asarray(passed)[-1]) * distance)
    )
    return FrictionTrace(
        load=load,
        distance=distance,
        laps=laps,
        track_radius=radius,
        friction_energy=energy,
        coefficient=energy / (load * distance),
        distance_error=error,
        notes=tuple(notes),
    )


def _column(opened: list[recording.OpenRecording], names: tuple[str, ...]) -> Field | None:
    """The values of the first column that is called so."""
    for one in opened:
        title = one.channel.name.strip().lower()
        if any(title == name or (len(name) > 2 and name in title) for name in names):
            return np.asarray(one.read().values, dtype=float)
    return None


def _way(
    name: str, distance: Field | None, laps: Field | None, radius: float | None, notes: list[str]
) -> tuple[float, float, float, float]:
    """Distance [m], laps, radius [m] and the relative difference between what the record and the radius say."""
    length = None if distance is None else float(distance[-1])
    turns = None if laps is None else float(laps[-1])
    for what, value in (("distance", length), ("number of laps", turns), ("track radius", radius)):
        if value is not None and not 0.0 < value < np.inf:
            raise UnreadableFile(f"{name} ends with a {what} of {value:g}; it must be positive")
    if length is not None and turns is not None:
        said = length / turns / (2.0 * np.pi)
        if radius is None:
            notes.append(f"track radius {said * 1e3:.4g} mm: distance over laps")
            return length, turns, said, 0.0
        error = abs(said / radius - 1.0)
        if error > 1e-3:
            notes.append(
                f"distance over laps is a radius of {said * 1e3:.4g} mm, {error:.1%} off the one given"
            )
        return length, turns, radius, error
    if radius is not None and length is not None:
        return length, length / (2.0 * np.pi * radius), radius, 0.0
    if radius is not None and turns is not None:
        return turns * 2.0 * np.pi * radius, turns, radius, 0.0
    if length is None and turns is None:
        raise BadInput(
            f"{name} has no column of distance or laps; name one Distance, in metres, or Laps"
        )
    raise BadInput(
        f"{name} has no column of {'laps' if turns is None else 'distance'}; give the track radius"
    )


def fit_wear_coefficient(
    trace: FrictionTrace,
    profile: surface.MeasuredSurface,
    *,
    second_load: float | None = None,
    second_distance: float | None = None,
    seed: int = 0,
) -> FittedWear:
    """The disc's wear coefficient from a test's friction trace and a profile across its scar.

    Parameters
    ----------
    second_load, second_distance : of a second test [N, m]; those of the first unless given
    seed : of the draws behind the intervals

    Raises
    ------
    BadInput
        for what `find_scar` refuses, and a second test without load or distance.
    """
    scar = find_scar(profile)
    load = require_positive("second load", trace.load if second_load is None else second_load, "N")
    length = require_positive(
        "second distance", trace.distance if second_distance is None else second_distance, "m"
    )
    rng = np.random.default_rng(seed)
    missing, piled = _drawn_areas(scar, rng)
    own = rng.uniform(0.0, np.minimum(1.0, missing / np.maximum(piled, np.finfo(float).tiny)))
    lost = (missing - own * piled) * np.maximum(1.0 + AROUND * rng.standard_normal(DRAWS), 0.0)
    k = (
        lost
        / (trace.load * trace.laps)
        * (1.0 + trace.distance_error * rng.uniform(-1.0, 1.0, DRAWS))
    )
    volume = k * trace.load * trace.distance
    again = k * np.exp(
        np.sqrt(2.0) * SCATTER * rng.standard_normal(DRAWS)
    )  # the first test is one draw too
    per_area = 1.0 / (trace.load * trace.laps)
    return FittedWear(
        trace=trace,
        scar=scar,
        k=Estimate.of(k),
        energy_coefficient=Estimate.of(volume / trace.friction_energy),
        k_all_lost=scar.missing * per_area,
        k_none_lost=max(scar.missing - scar.piled, 0.0) * per_area,
        volume=Estimate.of(volume),
        second_volume=Estimate.of(again * load * length),
        second_load=load,
        second_distance=length,
        notes=_notes(trace, scar),
    )


def _drawn_areas(scar: Scar, rng: np.random.Generator) -> tuple[Field, Field]:
    """Areas missing and piled up [m^2], of a way to measure drawn at random, off by the old surface's waves."""
    way = rng.integers(len(scar.areas), size=DRAWS)
    table = np.array(
        [(one.missing, one.piled, one.missing_std, one.piled_std) for one in scar.areas]
    )[way]
    missing, piled = (table[:, i] + table[:, i + 2] * rng.standard_normal(DRAWS) for i in (0, 1))
    return np.maximum(missing, 0.0), np.maximum(piled, 0.0)


def _notes(trace: FrictionTrace, scar: Scar) -> tuple[str, ...]:
    share = scar.piled / scar.missing if scar.missing > 0.0 else np.inf
    notes = [
        *trace.notes,
        f"track {scar.width * 1e6:.0f} um wide, found by what stands out of the roughness",
    ]
    if share > 1.0:
        notes.append(
            f"{share:.2g} times as much stands above the old surface as is missing below it: the disc may have lost "
            "nothing, and k is an upper bound rather than a value"
        )
    elif share > 0.05:
        notes.append(
            f"{share:.0%} of what is missing stands beside it; whose it is the profile cannot tell"
        )
    notes.append(
        "the energy coefficient is over all friction work; the energy law counts that of touching asperities: put it "
        "there as it is if the test ran dry, and over the share that was theirs if not"
    )
    notes.append("one profile stands for the whole track; the ball's own wear is not in it")
    return tuple(notes)
