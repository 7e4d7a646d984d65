"""Wear coefficient from the friction trace and scar of a ball- or pin-on-disc test.

k = V/(F s) of the disc alone, the scar's volume V over load and sliding distance (ASTM G99): the
track radius cancels, so k is the scar's area over load and laps. Material piled up beside the
scar either is the disc's own, displaced but not lost, or comes from the ball: the profile cannot
distinguish them. All shares between are taken as equally likely, as long as the disc does not
gain material.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity import recording, surface
from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT, QUANTILES
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput, UnreadableFile, require_positive
from asperity.core.quantities import quantity
from asperity.wear.laws import SCATTER
from asperity.wear.scar import Scar, find_scar

# relative scatter of the scar's area round the track, which one profile does not show; assumed
AREA_SCATTER = 0.2
DRAWS = 20_000
_COLUMNS = {
    "distance": ("distance", "path", "sliding"),
    "laps": ("lap", "rev", "turn", "cycle"),
    "coefficient": ("mu", "µ", "μ", "cof", "coefficient"),
    "force": ("friction force", "frictionforce", "ff"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionTrace:
    """Load, distance and friction of a test.

    `load` [N], sliding `distance` [m], `laps`, `track_radius` [m], `friction_energy` [J] and the
    mean `coefficient` of friction. `notes` state where a number comes from, or that two disagree.
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
class WearEstimate:
    """Median and its interval."""

    median: float
    low: float
    high: float

    @classmethod
    def from_draws(cls, draws: Field) -> "WearEstimate":
        """Return median and interval of equally likely values."""
        low, median, high = np.quantile(draws, QUANTILES)
        return cls(float(median), float(low), float(high))

    def as_dict(self) -> dict[str, float]:
        """Return the values by name."""
        return {"median": self.median, "low": self.low, "high": self.high}


@dataclass(frozen=True, slots=True, kw_only=True)
class WearFit:
    """Wear of the disc in a test.

    `k` [1/Pa] with its interval in this test; `energy_coefficient` [m^3/J] relative to the friction
    energy; `k_all_lost` and `k_none_lost` [1/Pa] if all piled-up material is foreign, or the disc's
    own (0 where more is piled up than missing); `volume` [m^3]; `second_volume` [m^3] predicted for
    a second test of the same kind, its interval including the scatter from test to test.
    """

    trace: FrictionTrace
    scar: Scar
    k: WearEstimate
    energy_coefficient: WearEstimate
    k_all_lost: float
    k_none_lost: float
    volume: WearEstimate
    second_volume: WearEstimate
    second_load: float
    second_distance: float
    notes: tuple[str, ...]

    def scalars(self) -> JsonObject:
        """Return the values of `asperity wear --json` for a fit."""
        trace, scar = self.trace, self.scar
        return {
            "verdict": self.verdict(),
            "wear_coefficient": self.k.as_dict(),
            "wear_coefficient_all_lost": self.k_all_lost,
            "wear_coefficient_none_lost": self.k_none_lost,
            "energy_wear_coefficient": self.energy_coefficient.as_dict(),
            "scar_volume_m3": self.volume.as_dict(),
            "second_volume_m3": self.second_volume.as_dict(),
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
        """Return one sentence: k with its interval, and the predicted loss in a second test."""
        k = quantity("wear_coefficient")
        second = quantity("second_volume_m3")
        loss = self.second_volume
        return (
            f"k is {k.text(self.k.median)} ({PERCENT} interval {k.number(self.k.low)} to "
            f"{k.text(self.k.high)}); predicted loss in a second test of "
            f"{self.second_load:.4g} N over {self.second_distance:.4g} m: "
            f"{second.number(loss.low)} to {second.text(loss.high)}."
        )


def read_friction_trace(
    path: str | Path, *, load: float | None = None, track_radius: float | None = None
) -> FrictionTrace:
    """Read a tribometer record: distance [m] or laps, and coefficient or friction force [N].

    Parameters
    ----------
    load : [N]; by default friction force over coefficient
    track_radius : [m]; by default from distance over laps

    Raises
    ------
    BadInput
        for a missing column without a substitute, and as `open_channels`.
    """
    channels = recording.open_channels(path, rate_hz=1.0)  # nothing here depends on time
    columns = {role: _column(channels, names) for role, names in _COLUMNS.items()}
    name, notes = Path(path).name, []
    mu = columns["coefficient"]
    force = columns["force"]
    if load is None:
        load = _median_load(name, mu, force)
        notes.append(f"load {load:.4g} N: friction force over coefficient")
    require_positive("load", load, "N")
    if mu is None:
        if force is None:
            raise BadInput(
                f"{name} has no column of coefficient or friction force; "
                "name one mu or FrictionForce"
            )
        mu = force / load
    distance, laps, radius, error = _sliding_path(
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


def _median_load(name: str, mu: Field | None, force: Field | None) -> float:
    if mu is None or force is None:
        raise BadInput(f"{name} lacks a column of coefficient or friction force; state the load")
    nonzero = np.abs(mu) > 0.01
    return float(np.median(force[nonzero] / mu[nonzero]))


def _column(channels: list[recording.OpenRecording], names: tuple[str, ...]) -> Field | None:
    """Return the values of the first column whose title matches one of the names."""
    for column in channels:
        title = column.channel.name.strip().lower()
        if any(title == name or (len(name) > 2 and name in title) for name in names):
            return np.asarray(column.read().values, dtype=float)
    return None


def _end(name: str, label: str, value: float | None) -> float | None:
    if value is not None and not 0.0 < value < np.inf:
        raise UnreadableFile(f"{name} ends with a {label} of {value:g}; it must be positive")
    return value


def _sliding_path(
    name: str, distance: Field | None, laps: Field | None, radius: float | None, notes: list[str]
) -> tuple[float, float, float, float]:
    """Return distance [m], laps, radius [m] and the relative mismatch of record and radius."""
    length = _end(name, "distance", None if distance is None else float(distance[-1]))
    turns = _end(name, "number of laps", None if laps is None else float(laps[-1]))
    radius = _end(name, "track radius", radius)
    if length is not None and turns is not None:
        recorded = length / turns / (2.0 * np.pi)
        if radius is None:
            notes.append(f"track radius {recorded * 1e3:.4g} mm: distance over laps")
            return length, turns, recorded, 0.0
        error = abs(recorded / radius - 1.0)
        if error > 1e-3:
            notes.append(
                f"distance over laps gives a radius of {recorded * 1e3:.4g} mm, "
                f"{error:.1%} off the stated one"
            )
        return length, turns, radius, error
    if radius is not None and length is not None:
        return length, length / (2.0 * np.pi * radius), radius, 0.0
    if radius is not None and turns is not None:
        return turns * 2.0 * np.pi * radius, turns, radius, 0.0
    if length is None and turns is None:
        raise BadInput(
            f"{name} has no column of distance or laps; name one Distance (in metres) or Laps"
        )
    raise BadInput(
        f"{name} has no column of {'laps' if turns is None else 'distance'}; state the track radius"
    )


def fit_wear_coefficient(
    trace: FrictionTrace,
    profile: surface.MeasuredSurface,
    *,
    second_load: float | None = None,
    second_distance: float | None = None,
    seed: int = 0,
) -> WearFit:
    """Fit the disc's wear coefficient to a friction trace and a profile across the scar.

    Parameters
    ----------
    second_load, second_distance : of a second test to predict [N, m]; by default those of the first
    seed : of the draws behind the intervals

    Raises
    ------
    BadInput
        for a second load or distance that is not positive, and as `find_scar`.
    """
    scar = find_scar(profile)
    load = require_positive("second load", trace.load if second_load is None else second_load, "N")
    length = require_positive(
        "second distance", trace.distance if second_distance is None else second_distance, "m"
    )
    rng = np.random.default_rng(seed)
    k = _drawn_coefficients(trace, scar, rng)
    volume = k * trace.load * trace.distance
    second_test_k = k * np.exp(
        np.sqrt(2.0) * SCATTER * rng.standard_normal(DRAWS)
    )  # the first test scatters about the mean, too
    per_area = 1.0 / (trace.load * trace.laps)
    return WearFit(
        trace=trace,
        scar=scar,
        k=WearEstimate.from_draws(k),
        energy_coefficient=WearEstimate.from_draws(volume / trace.friction_energy),
        k_all_lost=scar.missing * per_area,
        k_none_lost=max(scar.missing - scar.piled, 0.0) * per_area,
        volume=WearEstimate.from_draws(volume),
        second_volume=WearEstimate.from_draws(second_test_k * load * length),
        second_load=load,
        second_distance=length,
        notes=_notes(trace, scar),
    )


def _drawn_coefficients(trace: FrictionTrace, scar: Scar, rng: np.random.Generator) -> Field:
    """Draw wear coefficients; an unknown share of the material piled up is the disc's own."""
    missing, piled = _drawn_areas(scar, rng)
    own_share = rng.uniform(0.0, np.minimum(1.0, missing / np.maximum(piled, np.finfo(float).tiny)))
    lost = (missing - own_share * piled) * np.maximum(
        1.0 + AREA_SCATTER * rng.standard_normal(DRAWS), 0.0
    )
    error = 1.0 + trace.distance_error * rng.uniform(-1.0, 1.0, DRAWS)
    return np.asarray(lost / (trace.load * trace.laps) * error)


def _drawn_areas(scar: Scar, rng: np.random.Generator) -> tuple[Field, Field]:
    """Draw areas missing and piled up [m^2] over evaluation variants and waviness."""
    variant = rng.integers(len(scar.areas), size=DRAWS)
    table = np.array(
        [(area.missing, area.piled, area.missing_std, area.piled_std) for area in scar.areas]
    )[variant]
    missing, piled = (table[:, i] + table[:, i + 2] * rng.standard_normal(DRAWS) for i in (0, 1))
    return np.maximum(missing, 0.0), np.maximum(piled, 0.0)


def _notes(trace: FrictionTrace, scar: Scar) -> tuple[str, ...]:
    share = scar.piled / scar.missing if scar.missing > 0.0 else np.inf
    notes = [
        *trace.notes,
        f"track {scar.width * 1e6:.0f} um wide, detected as deviation beyond the roughness",
    ]
    if share > 1.0:
        notes.append(
            f"the area above the old surface is {share:.2g} times the area below it: the disc may "
            "have lost nothing, and k is an upper bound"
        )
    elif share > 0.05:
        notes.append(
            f"{share:.0%} of the missing area is piled up beside it; the profile cannot show "
            "which body it comes from"
        )
    notes.append(
        "the energy coefficient refers to all friction work, the energy law only to that of "
        "touching asperities: use it unchanged for a dry test, else divide it by the asperities' "
        "share"
    )
    notes.append("one profile represents the whole track; wear of the ball is not included")
    return tuple(notes)
