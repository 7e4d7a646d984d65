"""View of a sensor on a machine structure: modes with a contact whose roughness wears."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from asperity.case import Case
from asperity.core.errors import BadInput
from asperity.ehl import Iteration
from asperity.results.run import Run
from asperity.results.solve import solve_case
from asperity.solution import OscillatingContact
from asperity.structure import (
    CoupledMode,
    NamedStructure,
    Receptances,
    Structure,
    receptance_modes,
    sensor_response,
    settled_modes,
)

ROUGHNESS_FACTORS = (1.25, 1.0, 0.8)  # of Sq, from rough to worn
RESOLUTION = 1e-3  # relative, of a frequency
BAND_HZ = (50.0, 20_000.0)  # of the modes
FREQUENCIES = 6  # at which the contact's stiffness and damping are computed
MAX_MODES = 12
MIN_SHARE = 0.05  # of the contact: modes with less say little about it


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedMode:
    """Mode of the structure with its contact, over the course of wear.

    `mode` is that with the case's own roughness, `frequencies_hz` those over the course.
    `shift_per_clr` is the relative change of the frequency per unit of load share; None where the
    load share does not change. `amplitude_at_sensor` is the density of the acceleration at the
    frequency of the mode [m/s²/√Hz], None without an excitation.
    """

    mode: CoupledMode
    frequencies_hz: tuple[float, ...]
    shift_per_clr: float | None
    amplitude_at_sensor: float | None

    @property
    def movement(self) -> float:
        """Relative range of the frequency over the course."""
        return (max(self.frequencies_hz) - min(self.frequencies_hz)) / self.mode.frequency_hz

    def row(self) -> dict[str, object]:
        """Return the mode for `--json`."""
        return {
            "frequency_hz": self.mode.frequency_hz,
            "damping_ratio": self.mode.damping_ratio,
            "contact_share": self.mode.contact_share,
            "contact_stiffness_n_m": self.mode.stiffness,
            "frequencies_hz": list(self.frequencies_hz),
            "movement": self.movement,
            "shift_per_clr": self.shift_per_clr,
            "amplitude_at_sensor": self.amplitude_at_sensor,
        }


@dataclass(frozen=True, kw_only=True)
class SensorView:
    """Modes of a structure with its contact; `sq` [m] and `clr` over the course of wear."""

    case: Case
    named: NamedStructure = field(repr=False)
    resolution: float
    sq: tuple[float, ...]
    clr: tuple[float, ...]
    modes: tuple[ObservedMode, ...]

    @property
    def visible(self) -> tuple[ObservedMode, ...]:
        """Modes that move by more than the resolution, and rise above the noise if it is known."""
        noise = self.named.noise
        return tuple(
            observed
            for observed in self.modes
            if observed.movement > self.resolution
            and (
                noise is None
                or observed.amplitude_at_sensor is None
                or observed.amplitude_at_sensor > noise.interpolate(observed.mode.frequency_hz)
            )
        )

    def verdict(self) -> str:
        """Return one sentence: whether the sensor can see the contact, and by which mode."""
        course = (
            f"CLR {100.0 * self.clr[0]:.0f} to {100.0 * self.clr[-1]:.0f} % in a snapshot of "
            f"standing roughness, Sq {1e6 * self.sq[0]:.3g} to {1e6 * self.sq[-1]:.3g} um"
        )
        if not self.modes:
            return (
                f"This sensor cannot see this contact: {self.named.name} has no mode from "
                f"{BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz."
            )
        if len(self.sq) < 2:
            largest = max(self.modes, key=lambda observed: observed.mode.contact_share).mode
            return (
                "Not determined whether this sensor can see this contact: the case has no Sq that "
                f"could wear; the contact has {100.0 * largest.contact_share:.3g} % of the strain "
                f"energy of the mode of {self.named.name} at {largest.frequency_hz:.0f} Hz."
            )
        best = max(self.visible or self.modes, key=lambda observed: observed.movement)
        can = "can" if self.visible else "cannot"
        reason = "" if best.movement <= self.resolution or self.visible else ", below the noise"
        weak = "" if best.mode.contact_share >= MIN_SHARE else ", which says little about it"
        return (
            f"This sensor {can} see this contact: the mode of {self.named.name} at "
            f"{best.mode.frequency_hz:.0f} Hz moves by {100.0 * best.movement:.2g} % against a "
            f"resolution of {100.0 * self.resolution:.2g} %{reason} ({course}); the contact has "
            f"{100.0 * best.mode.contact_share:.3g} % of its strain energy{weak}."
        )

    def scalars(self) -> dict[str, object]:
        """Return the result for `--json`."""
        return {
            "verdict": self.verdict(),
            "structure": self.named.name,
            "resolution": self.resolution,
            "visible": bool(self.visible) if len(self.sq) > 1 else None,
            "sq_m": list(self.sq),
            "clr": list(self.clr),
            "modes": [observed.row() for observed in self.modes],
        }


def observe_contact(
    case: Case,
    named: NamedStructure | None = None,
    *,
    resolution: float = RESOLUTION,
    progress: Callable[[Iteration], None] | None = None,
) -> SensorView:
    """Compute the modes of a structure with the contact of a case, as its roughness wears.

    The contact is a snapshot of standing roughness, with 1.25, 1 and 0.8 times its Sq.

    Parameters
    ----------
    named : the structure, from `load_structure`; None: the mass of [vibration] on the contact
    resolution : relative resolution of a frequency
    progress : called after every solver iteration

    Raises
    ------
    BadInput
        for a case without [vibration] if no structure is stated, or a resolution outside 0 to 1.
    NotConverged
        if a contact does not converge.
    AsperityError
        if its dynamic stiffness, or the frequency of a mode, does not settle.
    """
    if not 0.0 < resolution < 1.0:
        raise BadInput(f"resolution must be between 0 and 1, got {resolution:g}; 0.001 is 0.1 %")
    named = named or _single_mass(case)
    still = case.with_written({"contact.roughness": "standing", "solver.surfaces": 1})
    sq = still.surface().sq
    scalable = hasattr(still.contents.surface, "sq") and still.stored is None
    factors = ROUGHNESS_FACTORS if scalable and sq > 0.0 else (1.0,)
    runs = [
        solve_case(
            still if factor == 1.0 else still.with_overrides({"surface.sq": factor * sq}),
            groups=(),
            progress=progress,
        )
        for factor in factors
    ]
    shares = tuple(run.state.clr for run in runs)
    own = factors.index(1.0)
    return SensorView(
        case=case,
        named=named,
        resolution=resolution,
        sq=tuple(factor * sq for factor in factors),
        clr=shares,
        modes=_observed(named.structure, runs, own),
    )


def _observed(
    structure: Structure | Receptances, runs: Sequence[Run], own: int
) -> tuple[ObservedMode, ...]:
    """Return the modes in the band over the course of `runs`, of which `own` is the case's own."""
    courses = [_modes(structure, run) for run in runs]
    shares = [run.state.clr for run in runs]
    observed = []
    for number, mode in enumerate(courses[own]):
        if not BAND_HZ[0] <= mode.frequency_hz <= BAND_HZ[1]:
            continue
        over_course = tuple(
            course[number].frequency_hz
            if len(course) == len(courses[own])
            # of receptances, a mode may leave the measured frequencies
            else min(
                (other.frequency_hz for other in course),
                key=lambda frequency_hz: abs(frequency_hz - mode.frequency_hz),
                default=mode.frequency_hz,
            )
            for course in courses
        )
        observed.append(
            ObservedMode(
                mode=mode,
                frequencies_hz=over_course,
                shift_per_clr=_slope(shares, over_course),
                amplitude_at_sensor=_amplitude(structure, runs[own], mode),
            )
        )
    return tuple(observed[:MAX_MODES])


def _single_mass(case: Case) -> NamedStructure:
    """Return the mass of [vibration] on the contact alone."""
    if case.vibration is None:
        raise BadInput(f"{case.source}: state a structure, or a mass in [vibration] of the case")
    mass = case.vibration.mass
    return NamedStructure(
        name=f"the single mass of {mass:g} kg", structure=Structure.single_mass(mass)
    )


def _modes(structure: Structure | Receptances, run: Run) -> tuple[CoupledMode, ...]:
    """Return all modes with the contact's stiffness and damping at their frequencies."""
    contact = OscillatingContact(run.solution)
    grid = np.geomspace(*BAND_HZ, FREQUENCIES)
    values = [contact.evaluate(float(frequency_hz)) for frequency_hz in grid]
    stiffness, damping = ([getattr(v, name) for v in values] for name in ("stiffness", "damping"))

    def spring(frequency_hz: float) -> tuple[float, float]:
        place = math.log(min(max(frequency_hz, grid[0]), grid[-1]))
        return (
            float(np.interp(place, np.log(grid), stiffness)),
            float(np.interp(place, np.log(grid), damping)),
        )

    if isinstance(structure, Receptances):
        return receptance_modes(structure, spring)
    return settled_modes(structure, spring)


def _slope(shares: Sequence[float], frequencies_hz: Sequence[float]) -> float | None:
    """Return the relative change of a frequency per unit of load share, over the whole course."""
    change = shares[-1] - shares[0]
    if abs(change) < 1e-3:
        return None
    return math.log(frequencies_hz[-1] / frequencies_hz[0]) / change


def _amplitude(structure: Structure | Receptances, run: Run, mode: CoupledMode) -> float | None:
    """Return the acceleration density at the sensor [m/s²/√Hz] where a mode resonates."""
    vibration = run.vibration
    if vibration is None or vibration.excitation is None or vibration.profile is None:
        return None
    frequency_hz = mode.frequency_hz
    if 2.0 * frequency_hz > vibration.profile.rate_hz:
        return None
    density = vibration.excitation.density(np.array([frequency_hz]), vibration.profile.rate_hz)
    response = (
        structure.response(mode.stiffness, mode.damping, frequency_hz)
        if isinstance(structure, Receptances)
        else sensor_response(structure, mode.stiffness, mode.damping, frequency_hz)
    )
    return (2.0 * math.pi * frequency_hz) ** 2 * abs(response) * math.sqrt(float(density[0]))
