"""A mass riding on a contact spring over a moving profile, and the acceleration it shows.

Knows nothing of oil: how stiff the spring is comes from `asperity.coupling`, what it rides over
from `asperity.vibration.excitation`. Source: the paper's section 2, with the damping of its Eq 5
taken at the angular frequency. docs/theory/vibration.md sets every equation beside its function
and its test.
"""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.signals import Signal, Spectrum, recursion

ResponseMethod: TypeAlias = Literal["exact", "rk5", "nonlinear"]
RESPONSE_METHODS: tuple[ResponseMethod, ...] = get_args(ResponseMethod)
SUBSTEPS = 8  # between two samples: at three samples a period 1e-5 off
LONGEST_STEP = (
    0.8  # of 1/ω0: one step of 1e-4 s a sample, as the paper's would be, diverges from 200 N up
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactOscillator:
    """The linearised contact: m y'' = C (y_i' - y') + S (y_i - y), the paper's Eq 6, y_i the profile under the mass.

    `mass` [kg], `stiffness` S [N/m], `damping_ratio` ζ between 0 and 1, `load` F [N] that the
    spring carries at rest (only the nonlinear response asks for it). Raises BadInput outside
    these.
    """

    mass: float
    stiffness: float
    damping_ratio: float
    load: float | None = None

    def __post_init__(self) -> None:
        require_positive("oscillator mass", self.mass, "kg")
        require_positive("contact stiffness", self.stiffness, "N/m")
        require_damping_ratio(self.damping_ratio)
        if self.load is not None:
            require_positive("load on the contact spring", self.load, "N")

    @property
    def angular_frequency(self) -> float:
        """ω = sqrt(S/m) [rad/s]."""
        return float(np.sqrt(self.stiffness / self.mass))

    @property
    def natural_frequency_hz(self) -> float:
        """f0 = sqrt(S/m) / 2π [Hz]: the contact resonance frequency, the paper's Eq 4."""
        return self.angular_frequency / (2.0 * np.pi)

    @property
    def damping(self) -> float:
        """C = 2 ζ ω m [N s/m]: the paper's Eq 5."""
        return 2.0 * self.damping_ratio * self.angular_frequency * self.mass

    @property
    def static_compression(self) -> float:
        """z0 = 1.5 F/S0 [m] of a Hertz spring with this incremental stiffness; raises BadInput without a load."""
        if self.load is None:
            raise BadInput(
                "a nonlinear contact needs the load it carries at rest; give the oscillator its load"
            )
        return 1.5 * self.load / self.stiffness

    def gain(self, frequency_hz: Field) -> Field:
        """|H|^2 from profile height to acceleration [1/s^4] at `frequency_hz` (any shape).

        (2π f)^4 (f0^4 + (2ζ f0 f)^2) / ((f0^2 - f^2)^2 + (2ζ f0 f)^2).
        """
        f0 = self.natural_frequency_hz
        damped = (2.0 * self.damping_ratio * f0 * frequency_hz) ** 2
        transmissibility = (f0**4 + damped) / ((f0**2 - frequency_hz**2) ** 2 + damped)
        return (2.0 * np.pi * frequency_hz) ** 4 * transmissibility

    def sampled_gain(self, frequency_hz: Field, rate_hz: float) -> Field:
        """|H|^2 from samples of the profile to samples of the exact response, 0 to rate/2 [1/s^4].

        What `gain` becomes when the profile is straight lines between samples, aliases of the
        lines included: near f0 it is `gain` times sinc^4(f0/rate).
        """
        denominator, numerator = self._recursion(
            rate_hz, np.array([self.stiffness, self.damping]) / self.mass
        )
        delay = np.exp(-2j * np.pi * np.asarray(frequency_hz) / rate_hz)
        kinks = rate_hz * (2.0 - 2.0 * delay.real)
        return np.asarray(
            np.abs(
                kinks * np.polyval(numerator[::-1], delay) / np.polyval(denominator[::-1], delay)
            )
            ** 2
        )

    def _recursion(self, rate_hz: float, read: Field) -> tuple[Field, Field]:
        """Denominator and numerator of the filter from the profile's kinks to read · (r, r'); see `_exact`."""
        drift = np.array([[0.0, 1.0], [-self.stiffness / self.mass, -self.damping / self.mass]])
        step = scipy.linalg.expm(drift / rate_hz)
        determinant = float(step[0, 0] * step[1, 1] - step[0, 1] * step[1, 0])
        denominator = np.array([1.0, -(step[0, 0] + step[1, 1]), determinant])
        # read (zI - step)^-1 step (0, 1), with Cayley-Hamilton for step^2, and half a jump passed
        # straight on
        numerator = 0.5 * read[1] * denominator + np.array(
            [0.0, read @ step[:, 1], -determinant * read[1]]
        )
        return denominator, numerator


def require_damping_ratio(damping_ratio: float) -> float:
    """Return the ratio, or say that a resonance needs one between 0 and 1."""
    if not 0.0 < damping_ratio < 1.0:
        raise BadInput(
            f"damping ratio must lie between 0 and 1, got {damping_ratio:g}; steel has 0.01 to 0.1"
        )
    return damping_ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class MassMotion:
    """How the mass moves, at the samples of the profile, shape (samples,).

    `compression` of the spring beyond its static one, y_i - y [m]; `displacement` y [m];
    `velocity` y' [m/s]; `acceleration` y'' [m/s^2], where the profile has a kink the mean of both
    sides; `in_contact`, always for a linear spring.
    """

    compression: Field
    displacement: Field
    velocity: Field
    acceleration: Field
    in_contact: Mask

    @property
    def contact_loss(self) -> float:
        """Share of the samples at which the mass is in the air, 0 to 1."""
        return float(1.0 - np.mean(self.in_contact))


def acceleration(
    oscillator: ContactOscillator,
    profile: Signal,
    *,
    method: ResponseMethod = "exact",
    substeps: int = SUBSTEPS,
) -> Signal:
    """Acceleration of the mass [m/s^2] at the samples of `profile` [m]; at first the mass moves along with the profile.

    Parameters
    ----------
    method : "exact", the linear response to straight lines between the samples, exact to rounding. "rk5", the same by
        Runge-Kutta of fifth order, as the paper has it: off by 4e-4 with 4 sub-steps, 1e-5 with 8 at three samples a
        period. "nonlinear", Hertz's spring S (y_i - y + z0)^1.5 that lets go of the profile, by the same Runge-Kutta.
        In all of them the straight lines weaken the resonance by sinc^4(f0/rate) in power: 0.8 % at rate = 29 f0, 3 %
        at 15 f0.
    substeps : Runge-Kutta steps between two samples

    Raises
    ------
    BadInput
        for a method not in RESPONSE_METHODS, a profile not in metres or not finite, sub-steps too long to be stable
        (ω0 h > 0.8), a nonlinear response of an oscillator without `load`.
    """
    if method == "exact":
        _check(profile, method)
        read = np.array([oscillator.stiffness, oscillator.damping]) / oscillator.mass
        return Signal(_exact(oscillator, profile, read), profile.rate_hz, "m/s^2")
    moved = mass_motion(oscillator, profile, method=method, substeps=substeps)
    return Signal(moved.acceleration, profile.rate_hz, "m/s^2")


def mass_motion(
    oscillator: ContactOscillator,
    profile: Signal,
    *,
    method: ResponseMethod = "exact",
    substeps: int = SUBSTEPS,
) -> MassMotion:
    """Displacement, velocity and acceleration of the mass: the paper's Fig 4; arguments as for `acceleration`."""
    _check(profile, method)
    slopes: Field = np.diff(profile.values) * profile.rate_hz
    if method == "exact":
        compression = _exact(oscillator, profile, np.array([1.0, 0.0]))
        rate = _exact(oscillator, profile, np.array([0.0, 1.0]))
        velocity: Field = _mean_of_both_sides(slopes) - rate
        pushed: Field = (
            oscillator.stiffness * compression + oscillator.damping * rate
        ) / oscillator.mass
        touching = np.ones(compression.size, dtype=bool)
    else:
        compression, velocity, pushed, touching = _runge_kutta(
            oscillator, profile.rate_hz, slopes, method, substeps
        )
    return MassMotion(
        compression=compression,
        displacement=profile.values - compression,
        velocity=velocity,
        acceleration=pushed,
        in_contact=touching,
    )


def _check(profile: Signal, method: ResponseMethod) -> None:
    require_choice("response method", method, RESPONSE_METHODS)
    if profile.unit != "m":
        raise BadInput(f"a profile must be in m, got {profile.unit!r}; convert its heights")
    if not np.isfinite(profile.values).all():
        raise BadInput(
            "a profile must be finite at every sample, got some that are not; fill or cut them"
        )


def _exact(oscillator: ContactOscillator, profile: Signal, read: Field) -> Field:
    """First-order hold, exact to rounding, of read · (r, r') in the compression r = y_i - y: nothing large cancels.

    Between samples r'' = -(C r' + S r)/m, free; at each sample the profile's slope, and r' with
    it, jumps by d. So x⁺ = e^(Fh) (x + (0, d)) with x = (r, r'), read in the middle of the jump.
    """
    denominator, numerator = oscillator._recursion(profile.rate_hz, read)
    jumps = np.zeros(profile.values.size)
    jumps[1:-1] = np.diff(profile.values, 2) * profile.rate_hz
    return recursion(numerator, denominator, jumps)


def _runge_kutta(
    oscillator: ContactOscillator,
    rate_hz: float,
    slopes: Field,
    method: ResponseMethod,
    substeps: int,
) -> tuple[Field, Field, Field, Mask]:
    """Compression beyond the static one, velocity, acceleration, and whether the mass touches."""
    from asperity.kernels.oscillator import ContactSpring, integrate_contact

    if substeps < 1:
        raise BadInput(
            f"Runge-Kutta needs at least 1 sub-step, got {substeps}; {SUBSTEPS} is the default"
        )
    swing = oscillator.angular_frequency / rate_hz
    if swing / substeps > LONGEST_STEP:
        raise BadInput(
            f"Runge-Kutta steps must be at most {LONGEST_STEP:g} of 1/ω0, got {swing / substeps:.2g} "
            f"({oscillator.natural_frequency_hz:.0f} Hz at {rate_hz:g} samples a second in {substeps} sub-steps); "
            f"use at least {int(np.ceil(swing / LONGEST_STEP))} sub-steps"
        )
    hertz, mass = method == "nonlinear", oscillator.mass
    z0 = oscillator.static_compression if hertz else 0.0
    load = (oscillator.load or 0.0) / mass if hertz else 0.0
    spring = load / z0**1.5 if hertz else oscillator.stiffness / mass
    damper = oscillator.damping / mass
    compression, velocity = np.empty(slopes.size + 1), np.empty(slopes.size + 1)
    compression[0], velocity[0] = z0, slopes[0]
    integrate_contact(
        ContactSpring(spring, damper, load, hertz),
        slopes,
        1.0 / rate_hz,
        substeps,
        compression,
        velocity,
    )

    rate = _mean_of_both_sides(slopes) - velocity
    if not hertz:
        return (
            compression,
            velocity,
            spring * compression + damper * rate,
            np.ones(compression.size, dtype=bool),
        )
    touching = compression > 0.0
    pushed = (
        np.where(touching, spring * np.maximum(compression, 0.0) ** 1.5 + damper * rate, 0.0) - load
    )
    return compression - z0, velocity, pushed, touching


def _mean_of_both_sides(slopes: Field) -> Field:
    """Slope at each sample from the slopes between them."""
    return np.concatenate([slopes[:1], (slopes[:-1] + slopes[1:]) / 2.0, slopes[-1:]])


def expected_spectrum(
    oscillator: ContactOscillator, profile: Spectrum, *, rate_hz: float | None = None
) -> Spectrum:
    """Acceleration spectrum that a profile spectrum [m^2/Hz] leads to, without any record: |H|^2 times it.

    `rate_hz` asks for the spectrum of the sampled record instead of the continuous motion:
    straight lines between the samples cost it sinc^4(f0/rate) near the resonance. Raises BadInput
    for a spectrum of anything but heights in metres.
    """
    if profile.unit != "m^2/Hz":
        raise BadInput(
            f"a profile's spectrum must be in m^2/Hz, got {profile.unit!r}; take that of its heights"
        )
    frequency = profile.frequency_hz
    gain = (
        oscillator.gain(frequency)
        if rate_hz is None
        else oscillator.sampled_gain(frequency, rate_hz)
    )
    return replace(profile, density=gain * profile.density, unit="(m/s^2)^2/Hz")
