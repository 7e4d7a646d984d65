"""View of a sensor on a machine structure: modes with a contact whose roughness wears."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.displayed import Displayed
from asperity.core.errors import BadInput
from asperity.ehl import Iteration
from asperity.results.contact_course import BAND_HZ, ContactCourse, solve_course
from asperity.results.run import Run
from asperity.structure import (
    MIN_CONTACT_SHARE,
    CoupledMode,
    NamedStructure,
    Receptances,
    Structure,
    receptance_modes,
    sensor_response,
    settled_modes,
)

RESOLUTION = 1e-3  # relative, of a frequency
MAX_MODES = 12
BLIND = 1e-6  # of the motion at the sensor over the approach in the contact


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedMode:
    """Mode of the structure with its contact, over the course of wear.

    `mode` is that with the case's own roughness, `frequencies_hz` and `damping_ratios` those over
    the course.
    `shift_per_clr` is the relative change of the frequency per unit of load share; None where the
    load share does not change. `amplitude_at_sensor` is the density of the acceleration at the
    frequency of the mode [m/s²/√Hz], None without an excitation.
    """

    mode: CoupledMode
    frequencies_hz: tuple[float, ...]
    damping_ratios: tuple[float, ...]
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
            "damping_ratios": list(self.damping_ratios),
            "movement": self.movement,
            "shift_per_clr": self.shift_per_clr,
            "amplitude_at_sensor": self.amplitude_at_sensor,
        }


@dataclass(frozen=True, kw_only=True)
class SensorView(Displayed):
    """Modes of a structure with its contact, over the course of wear."""

    course: ContactCourse = field(repr=False)
    named: NamedStructure = field(repr=False)
    resolution: float
    modes: tuple[ObservedMode, ...]

    @property
    def sq(self) -> tuple[float, ...]:
        """Roughness over the course [m]."""
        return self.course.sq

    @property
    def clr(self) -> tuple[float, ...]:
        """Load share of the asperities over the course."""
        return self.course.clr

    @property
    def measured_band_hz(self) -> tuple[float, float] | None:
        """First and last frequency of measured receptances; None for another structure."""
        structure = self.named.structure
        if not isinstance(structure, Receptances):
            return None
        return float(structure.frequencies_hz[0]), float(structure.frequencies_hz[-1])

    def response(self, frequencies_hz: ArrayLike) -> Field:
        """Return the displacement at the sensor per displacement that roughness imposes.

        The absolute value, shape (roughnesses, n); of measured receptances only within their band.
        """
        places = np.atleast_1d(np.asarray(frequencies_hz, dtype=float))
        responses = []
        for spring in self.course.springs:
            stiffness, damping = np.array([spring(float(place)) for place in places]).T
            responses.append(
                np.abs(sensor_response(self.named.structure, stiffness, damping, places))
            )
        return np.array(responses)

    @property
    def visible(self) -> tuple[ObservedMode, ...]:
        """Modes that move by more than the resolution, and rise above the noise if it is known."""
        noise = self.named.noise
        return tuple(
            observed
            for observed in self.modes
            if observed.movement > self.resolution
            and abs(observed.mode.sensor_shape) > BLIND * abs(observed.mode.contact_shape)
            and (
                noise is None
                or observed.amplitude_at_sensor is None
                or observed.amplitude_at_sensor > noise.interpolate(observed.mode.frequency_hz)
            )
        )

    def noise_at(self, observed: ObservedMode) -> float | None:
        """Return the sensor's noise at a mode [m/s²/√Hz]; None if it is not known."""
        noise = self.named.noise
        return None if noise is None else noise.interpolate(observed.mode.frequency_hz)

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
        if self.visible and self.named.noise is None:
            reason = " (the sensor's noise is not stated)"
        weak = (
            "" if best.mode.contact_share >= MIN_CONTACT_SHARE else ", which says little about it"
        )
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
            "modes": [
                {**observed.row(), "noise_at_sensor": self.noise_at(observed)}
                for observed in self.modes
            ],
        }


def observe_contact(
    case: Case | ContactCourse,
    named: NamedStructure | None = None,
    *,
    resolution: float = RESOLUTION,
    progress: Callable[[Iteration], None] | None = None,
) -> SensorView:
    """Compute the modes of a structure with the contact of a case, as its roughness wears.

    Parameters
    ----------
    case : the case, or its contacts from `solve_course`, which serve for several structures
    named : the structure, from `load_structure`; None: that of the case, else the mass of
        [vibration] on the contact
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
    contact = case if isinstance(case, Case) else case.case
    named = named or contact.structure or _single_mass(contact)
    course = solve_course(case, progress=progress) if isinstance(case, Case) else case
    return SensorView(
        course=course,
        named=named,
        resolution=resolution,
        modes=_observed(named.structure, course),
    )


def _observed(
    structure: Structure | Receptances, course: ContactCourse
) -> tuple[ObservedMode, ...]:
    """Return the modes in the band over the course."""
    modes = [
        receptance_modes(structure, spring)
        if isinstance(structure, Receptances)
        else settled_modes(structure, spring)
        for spring in course.springs
    ]
    observed = []
    for mode in modes[course.own]:
        if not BAND_HZ[0] <= mode.frequency_hz <= BAND_HZ[1]:
            continue
        over_course = [_same_mode(at_roughness, modes[course.own], mode) for at_roughness in modes]
        frequencies_hz = tuple(entry.frequency_hz for entry in over_course)
        observed.append(
            ObservedMode(
                mode=mode,
                frequencies_hz=frequencies_hz,
                damping_ratios=tuple(entry.damping_ratio for entry in over_course),
                shift_per_clr=_slope(course.clr, frequencies_hz),
                amplitude_at_sensor=_amplitude(structure, course.runs[course.own], mode),
            )
        )
    return tuple(observed[:MAX_MODES])


def _same_mode(
    modes: Sequence[CoupledMode], own: Sequence[CoupledMode], mode: CoupledMode
) -> CoupledMode:
    """Return a mode at another roughness: the same number, or the nearest.

    A mode of receptances may leave the measured frequencies.
    """
    if len(modes) == len(own):
        return modes[own.index(mode)]
    return min(modes, key=lambda other: abs(other.frequency_hz - mode.frequency_hz), default=mode)


def _single_mass(case: Case) -> NamedStructure:
    """Return the mass of [vibration] on the contact alone."""
    if case.vibration is None:
        raise BadInput(f"{case.source}: state a structure, or a mass in [vibration] of the case")
    mass = case.vibration.mass
    return NamedStructure(
        name=f"the single mass of {mass:g} kg", structure=Structure.single_mass(mass)
    )


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
    (response,) = sensor_response(structure, mode.stiffness, mode.damping, [frequency_hz])
    motion = (2.0 * math.pi * frequency_hz) ** 2 * float(abs(response))
    return motion * math.sqrt(float(density[0]))
