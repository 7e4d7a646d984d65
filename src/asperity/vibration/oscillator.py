"""Mass on a contact spring over a moving profile, and its acceleration.

Both are independent of the lubricant: `asperity.coupling` supplies the stiffness,
`asperity.vibration.excitation` the profile. Source: the paper's section 2, with the damping of its
Eq 5 taken at the angular frequency. docs/theory/vibration.md lists every equation with its function
and test.
"""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.signals import Signal, Spectrum, recursion

ResponseMethod: TypeAlias = Literal["exact", "rk5", "nonlinear"]
RESPONSE_METHODS: tuple[ResponseMethod, ...] = get_args(ResponseMethod)
SUBSTEPS = 8  # per sample: an error of 1e-5 at three samples a period
MAX_STEP = 0.8  # of 1/ω0; one step of 1e-4 s per sample, as in the paper, diverges from 200 N up


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactOscillator:
    """Linearised contact: m y'' = C (y_i' - y') + S (y_i - y), the paper's Eq 6.

    y_i is the profile under the mass. `mass` [kg], `stiffness` S [N/m], `damping_ratio` ζ between 0
    and 1, `load` F [N] that the spring carries at rest (for the nonlinear response only). Raises
    BadInput outside these ranges.

    Examples
    --------
    >>> from asperity.vibration import ContactOscillator
    >>> oscillator = ContactOscillator(mass=0.1, stiffness=350e6, damping_ratio=0.02)
    >>> f"{oscillator.natural_frequency_hz:.0f} Hz"
    '9416 Hz'
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
        """Angular natural frequency ω = sqrt(S/m) [rad/s]."""
        return float(np.sqrt(self.stiffness / self.mass))

    @property
    def natural_frequency_hz(self) -> float:
        """Contact resonance frequency f0 = sqrt(S/m) / 2π [Hz], the paper's Eq 4."""
        return self.angular_frequency / (2.0 * np.pi)

    @property
    def damping(self) -> float:
        """Damping coefficient C = 2 ζ ω m [N s/m], the paper's Eq 5."""
        return 2.0 * self.damping_ratio * self.angular_frequency * self.mass

    @property
    def static_compression(self) -> float:
        """Static compression z0 = 1.5 F/S0 [m] of a Hertz spring; needs a load."""
        if self.load is None:
            raise BadInput("a nonlinear contact needs its static load; give the oscillator a load")
        return 1.5 * self.load / self.stiffness

    def gain(self, frequency_hz: Field) -> Field:
        """Return |H|^2 from profile height to acceleration [1/s^4] at `frequency_hz` (any shape).

        (2π f)^4 (f0^4 + (2ζ f0 f)^2) / ((f0^2 - f^2)^2 + (2ζ f0 f)^2).
        """
        f0 = self.natural_frequency_hz
        damped = (2.0 * self.damping_ratio * f0 * frequency_hz) ** 2
        transmissibility = (f0**4 + damped) / ((f0**2 - frequency_hz**2) ** 2 + damped)
        return (2.0 * np.pi * frequency_hz) ** 4 * transmissibility

    def sampled_gain(self, frequency_hz: Field, rate_hz: float) -> Field:
        """Return |H|^2 from samples of the profile to those of the exact response [1/s^4].

        This is `gain` for a profile interpolated linearly between samples, including the aliases:
        near f0 it is `gain` times sinc^4(f0/rate).
        """
        denominator, numerator = self._recursion(
            rate_hz, np.array([self.stiffness, self.damping]) / self.mass
        )
        delay = np.exp(-2j * np.pi * np.asarray(frequency_hz) / rate_hz)
        slope_changes = rate_hz * (2.0 - 2.0 * delay.real)
        return np.asarray(
            np.abs(
                slope_changes
                * np.polyval(numerator[::-1], delay)
                / np.polyval(denominator[::-1], delay)
            )
            ** 2
        )

    def _recursion(self, rate_hz: float, output_weights: Field) -> tuple[Field, Field]:
        """Return denominator and numerator of the filter from slope changes to the output.

        See `_exact`.
        """
        drift = np.array([[0.0, 1.0], [-self.stiffness / self.mass, -self.damping / self.mass]])
        step = scipy.linalg.expm(drift / rate_hz)
        determinant = float(step[0, 0] * step[1, 1] - step[0, 1] * step[1, 0])
        denominator = np.array([1.0, -(step[0, 0] + step[1, 1]), determinant])
        # read (zI - step)^-1 step (0, 1), with Cayley-Hamilton for step^2, plus half of the jump
        numerator = 0.5 * output_weights[1] * denominator + np.array(
            [0.0, output_weights @ step[:, 1], -determinant * output_weights[1]]
        )
        return denominator, numerator


def require_damping_ratio(damping_ratio: float) -> float:
    """Return the ratio if it is between 0 and 1; raise BadInput otherwise.

    Examples
    --------
    >>> from asperity.vibration import require_damping_ratio
    >>> require_damping_ratio(0.02)
    0.02
    """
    if not 0.0 < damping_ratio < 1.0:
        raise BadInput(
            f"damping ratio must be between 0 and 1, got {damping_ratio:g}; typical of steel is "
            "0.01 to 0.1"
        )
    return damping_ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class MassMotion:
    """Motion of the mass at the samples of the profile, shape (samples,).

    `compression` of the spring beyond its static one, y_i - y [m]; `displacement` y [m]; `velocity`
    y' [m/s]; `acceleration` y'' [m/s^2], at a slope change of the profile the mean of both sides;
    `in_contact`, always True for a linear spring.
    """

    compression: Field
    displacement: Field
    velocity: Field
    acceleration: Field
    in_contact: Mask

    @property
    def contact_loss(self) -> float:
        """Fraction of the samples without contact, 0 to 1."""
        return float(1.0 - np.mean(self.in_contact))


@usual_float_errors
def acceleration(
    oscillator: ContactOscillator,
    profile: Signal,
    *,
    method: ResponseMethod = "exact",
    substeps: int = SUBSTEPS,
) -> Signal:
    """Compute the acceleration of the mass [m/s^2] at the samples of `profile` [m].

    The mass starts with the velocity of the profile.

    Parameters
    ----------
    method : "exact", the linear response to linear interpolation between samples, exact to
        rounding. "rk5", the same by fifth-order Runge-Kutta, as in the paper: errors of 4e-4 with 4
        sub-steps, 1e-5 with 8 at three samples a period. "nonlinear", Hertz's spring S (y_i - y +
        z0)^1.5 with loss of contact, by the same Runge-Kutta. In all of them linear interpolation
        weakens the resonance by sinc^4(f0/rate) in power: 0.8 % at rate = 29 f0, 3 % at 15 f0.
    substeps : Runge-Kutta steps between two samples

    Raises
    ------
    BadInput
        for an unknown method, a profile not in metres or not finite, unstable sub-steps (ω0 h >
        0.8), or a nonlinear response of an oscillator without `load`.
    """
    if method == "exact":
        _check(profile, method)
        output_weights = np.array([oscillator.stiffness, oscillator.damping]) / oscillator.mass
        return Signal(_exact(oscillator, profile, output_weights), profile.rate_hz, "m/s^2")
    motion = mass_motion(oscillator, profile, method=method, substeps=substeps)
    return Signal(motion.acceleration, profile.rate_hz, "m/s^2")


def mass_motion(
    oscillator: ContactOscillator,
    profile: Signal,
    *,
    method: ResponseMethod = "exact",
    substeps: int = SUBSTEPS,
) -> MassMotion:
    """Compute the motion of the mass (the paper's Fig 4); arguments as for `acceleration`.

    Examples
    --------
    >>> from asperity.core.signals import Signal
    >>> from asperity.vibration import ContactOscillator, mass_motion, white_noise
    >>> oscillator = ContactOscillator(mass=1.0, stiffness=1e6, damping_ratio=0.05, load=100.0)
    >>> profile = Signal(1e-6 * white_noise(2000, seed=1), rate_hz=20_000.0, unit="m")
    >>> motion = mass_motion(oscillator, profile)
    >>> f"rms {motion.displacement.std() * 1e6:.2f} um"
    'rms 2.15 um'
    """
    _check(profile, method)
    slopes: Field = np.diff(profile.values) * profile.rate_hz
    if method == "exact":
        compression = _exact(oscillator, profile, np.array([1.0, 0.0]))
        compression_rate = _exact(oscillator, profile, np.array([0.0, 1.0]))
        velocity: Field = _mean_of_both_sides(slopes) - compression_rate
        mass_acceleration: Field = (
            oscillator.stiffness * compression + oscillator.damping * compression_rate
        ) / oscillator.mass
        in_contact = np.ones(compression.size, dtype=bool)
    else:
        compression, velocity, mass_acceleration, in_contact = _runge_kutta(
            oscillator, profile.rate_hz, slopes, method, substeps
        )
    return MassMotion(
        compression=compression,
        displacement=profile.values - compression,
        velocity=velocity,
        acceleration=mass_acceleration,
        in_contact=in_contact,
    )


def _check(profile: Signal, method: ResponseMethod) -> None:
    require_choice("response method", method, RESPONSE_METHODS)
    if profile.unit != "m":
        raise BadInput(f"a profile must be in m, got {profile.unit!r}; convert its heights")
    if not np.isfinite(profile.values).all():
        raise BadInput(
            "a profile must be finite at every sample; fill or remove values that are not"
        )


def _exact(oscillator: ContactOscillator, profile: Signal, output_weights: Field) -> Field:
    """Return output_weights · (r, r') for the compression r = y_i - y by first-order hold.

    It is exact to rounding, without cancellation of large terms. Between samples r'' = -(C r' + S
    r)/m, free; at each sample the profile's slope, and r' with it, jumps by d. So x⁺ = e^(Fh) (x +
    (0, d)) with x = (r, r'), output in the middle of the jump.
    """
    denominator, numerator = oscillator._recursion(profile.rate_hz, output_weights)
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
    """Return compression beyond the static one, velocity, acceleration, and contact."""
    from asperity.kernels.oscillator import ContactSpring, integrate_contact

    _require_stable(oscillator, rate_hz, substeps)
    nonlinear = method == "nonlinear"
    mass = oscillator.mass
    static_compression = oscillator.static_compression if nonlinear else 0.0
    load = (oscillator.load or 0.0) / mass if nonlinear else 0.0
    stiffness_per_mass = (
        load / static_compression**1.5 if nonlinear else oscillator.stiffness / mass
    )
    damping_per_mass = oscillator.damping / mass
    compression = np.empty(slopes.size + 1)
    velocity = np.empty(slopes.size + 1)
    compression[0], velocity[0] = static_compression, slopes[0]
    integrate_contact(
        ContactSpring(stiffness_per_mass, damping_per_mass, load, nonlinear),
        slopes,
        1.0 / rate_hz,
        substeps,
        compression,
        velocity,
    )

    compression_rate = _mean_of_both_sides(slopes) - velocity
    if not nonlinear:
        return (
            compression,
            velocity,
            stiffness_per_mass * compression + damping_per_mass * compression_rate,
            np.ones(compression.size, dtype=bool),
        )
    in_contact = compression > 0.0
    mass_acceleration = (
        np.where(
            in_contact,
            stiffness_per_mass * np.maximum(compression, 0.0) ** 1.5
            + damping_per_mass * compression_rate,
            0.0,
        )
        - load
    )
    return compression - static_compression, velocity, mass_acceleration, in_contact


def _require_stable(oscillator: ContactOscillator, rate_hz: float, substeps: int) -> None:
    if substeps < 1:
        raise BadInput(
            f"Runge-Kutta needs at least 1 sub-step, got {substeps}; the default is {SUBSTEPS}"
        )
    phase_per_sample = oscillator.angular_frequency / rate_hz
    if phase_per_sample / substeps > MAX_STEP:
        raise BadInput(
            f"Runge-Kutta steps must be at most {MAX_STEP:g} of 1/ω0, got "
            f"{phase_per_sample / substeps:.2g} ({oscillator.natural_frequency_hz:.0f} Hz, "
            f"sampling rate {rate_hz:g} Hz, {substeps} sub-steps); use at least "
            f"{int(np.ceil(phase_per_sample / MAX_STEP))} sub-steps"
        )


def _mean_of_both_sides(slopes: Field) -> Field:
    """Return the slope at each sample from the slopes between samples."""
    return np.concatenate([slopes[:1], (slopes[:-1] + slopes[1:]) / 2.0, slopes[-1:]])


def expected_spectrum(
    oscillator: ContactOscillator, profile: Spectrum, *, rate_hz: float | None = None
) -> Spectrum:
    """Return the expected acceleration spectrum for a profile spectrum [m^2/Hz].

    With `rate_hz`, it is the spectrum of the sampled record instead of the continuous motion:
    linear interpolation between the samples costs it sinc^4(f0/rate) near the resonance.

    Raises
    ------
    BadInput
        for a spectrum of anything but heights in metres.

    Examples
    --------
    >>> from asperity.core.signals import Signal, power_spectrum
    >>> from asperity.vibration import ContactOscillator, expected_spectrum, white_noise
    >>> oscillator = ContactOscillator(mass=1.0, stiffness=1e6, damping_ratio=0.05)
    >>> profile = power_spectrum(Signal(white_noise(20_000, seed=1), rate_hz=2000.0, unit="m"))
    >>> response = expected_spectrum(oscillator, profile)
    >>> f"{oscillator.natural_frequency_hz:.0f} Hz, {response.unit}"
    '159 Hz, (m/s^2)^2/Hz'
    """
    if profile.unit != "m^2/Hz":
        raise BadInput(
            f"a profile's spectrum must be in m^2/Hz, got {profile.unit!r}; compute it from "
            "heights in m"
        )
    frequency = profile.frequency_hz
    gain = (
        oscillator.gain(frequency)
        if rate_hz is None
        else oscillator.sampled_gain(frequency, rate_hz)
    )
    return replace(profile, density=gain * profile.density, unit="(m/s^2)^2/Hz")
