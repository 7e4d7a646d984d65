"""From a solved contact to its vibration: the only module that knows both. The paper's section 3.3, each law named.

Load share -> stiffness and damping, roughness -> height of the profile, area share -> its cut-off frequency.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.state import ContactState
from asperity.errors import BadInput, require_positive
from asperity.hertz import point_stiffness
from asperity.signals import Signal, Spectrum, power_spectrum
from asperity.vibration import ContactOscillator, acceleration, expected_spectrum, require_damping_ratio
from asperity.wear import INDICATOR_METHODS, Resonance, contact_resonance, no_resonance

SMALLEST_SHARE = 0.01  # CLR at the lower end of the search band: below it the film is full and nothing resonates
BAND_MARGIN = 0.05
SAMPLES_PER_PERIOD = 15  # below it the straight lines between samples cost the resonance over 3 % of its power


def hertz_point(asperity_load: float, conditions: ContactConditions) -> float:
    """Stiffness of a sphere on a plane [N/m] under the asperities' load, Rx and E* of the contact: paper Eqs 2-3."""
    return point_stiffness(asperity_load, conditions.radius_along_rolling, conditions.pair.reduced_modulus)


STIFFNESS_LAWS: dict[str, Callable[[float, ContactConditions], float]] = {"hertz-point": hertz_point}


@dataclass(frozen=True, kw_only=True)
class VibrationModel:
    """How a contact state becomes a vibration record.

    Parameters
    ----------
    mass : mass that rides on the contact [kg]
    damping_ratio : of the contact oscillator; 0.01 dry to 0.1 in boundary lubrication (the paper's section 2.1)
    stiffness_law : name in STIFFNESS_LAWS; "hertz-point" is the paper's, a line contact's own stiffness is far higher
    cutoff_reference_hz, car_reference, cutoff_exponent : the profile's cut-off fc = fc_ref (CAR/CAR_ref)^q [Hz]. The
        paper names no law. 30 Hz is the base case of its dry section 2, in which everything touches, hence CAR_ref = 1;
        q = 0.18 is where its "the two effects offset" holds (in proportion, q = 1, CRFA would grow 60 000-fold)
    rate_hz : samples a second; at least 15 times the full-load resonance, or straight lines between samples bias CRFA
        (at 100 kHz and 3.5 kHz by -0.8 %)
    duration_s : length of the record [s]; sd(CRF) = sqrt(ζ f0 / (2π duration)), 1.7 Hz for the paper's case and 4 s
    seed : of the profile; one seed, one record
    method : how the resonance is found, name in INDICATOR_METHODS

    Raises
    ------
    BadInput
        for a quantity out of range or a name that is not in its table.
    """

    mass: float
    damping_ratio: float
    stiffness_law: str = "hertz-point"
    cutoff_reference_hz: float = 30.0
    car_reference: float = 1.0
    cutoff_exponent: float = 0.18
    rate_hz: float = 100e3
    duration_s: float = 4.0
    seed: int = 1
    method: str = "likelihood"

    def __post_init__(self) -> None:
        require_positive("oscillator mass", self.mass, "kg")
        require_damping_ratio(self.damping_ratio)
        require_positive("cut-off reference frequency", self.cutoff_reference_hz, "Hz")
        require_positive("reference CAR", self.car_reference)
        require_positive("vibration sampling rate", self.rate_hz, "Hz")
        require_positive("vibration duration", self.duration_s, "s")
        if not 0.0 <= self.cutoff_exponent <= 2.0:
            raise BadInput(
                f"cut-off exponent must lie between 0 and 2, got {self.cutoff_exponent:g}; 0.18 is the default"
            )
        if self.seed < 0:
            raise BadInput(f"vibration seed must be 0 or more, got {self.seed}")
        if self.stiffness_law not in STIFFNESS_LAWS:
            raise BadInput(f"stiffness law must be one of {', '.join(STIFFNESS_LAWS)}, got {self.stiffness_law!r}")
        if self.method not in INDICATOR_METHODS:
            raise BadInput(f"indicator method must be one of {', '.join(INDICATOR_METHODS)}, got {self.method!r}")


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """What a contact state sounds like.

    `resonance` was searched in `band_hz`, which follows from the contact alone; `full_load_crf_hz` is the resonance
    with all load on asperities [Hz]. `profile` [m], `response` [m/s^2] and its `spectrum` are the record. When no
    asperity touches there is no spring and no record: all but the last three are None and `resonance.reason` says so.
    """

    oscillator: ContactOscillator | None
    profile: Signal | None
    response: Signal | None
    spectrum: Spectrum | None
    expected: Spectrum | None  # what `spectrum` scatters about: the closed form, without any record
    resonance: Resonance
    band_hz: tuple[float, float]
    full_load_crf_hz: float


def oscillator(state: ContactState, conditions: ContactConditions, model: VibrationModel) -> ContactOscillator:
    """The mass on the spring of the touching asperities, which carry CLR times the load.

    Raises BadInput when they carry none.
    """
    require_positive("load share of the asperities (CLR)", state.clr)
    return _loaded_oscillator(state.clr, conditions, model)


def _loaded_oscillator(clr: float, conditions: ContactConditions, model: VibrationModel) -> ContactOscillator:
    stiffness = STIFFNESS_LAWS[model.stiffness_law](clr * conditions.load, conditions)
    return ContactOscillator(mass=model.mass, stiffness=stiffness, damping_ratio=model.damping_ratio)


def cutoff_hz(state: ContactState, model: VibrationModel) -> float:
    """Cut-off of the profile [Hz]: fc = fc_ref (CAR/CAR_ref)^q, CAR counted in the Hertz zone as the paper does."""
    return float(model.cutoff_reference_hz * (state.car / model.car_reference) ** model.cutoff_exponent)


def profile_density(frequency_hz: Field, height: float, cutoff_hz: float) -> Field:
    """One-sided spectrum of a profile of RMS `height` [m] behind a second-order Butterworth low pass [m^2/Hz].

    height^2 (2 sqrt(2) / (π fc)) / (1 + (f/fc)^4), which integrates to height^2.
    """
    plateau = height**2 * 2.0 * float(np.sqrt(2.0)) / (np.pi * cutoff_hz)
    return plateau / (1.0 + (frequency_hz / cutoff_hz) ** 4)


def excitation(state: ContactState, model: VibrationModel) -> Signal:
    """Profile that passes under the mass [m]: low-passed Gaussian white noise, its RMS height Sq.

    Sq is the height of the process, not of the one record: scaling each record to Sq would hand the chance of a few
    hundred slow waves on to CRFA (about 9 % at 30 Hz and 4 s). Sampled from the continuous process without error, where
    a bilinear filter lacks power at the resonance.

    Raises
    ------
    BadInput
        for a flat surface, a contact without touching asperities, a record shorter than one period of the cut-off.
    """
    height = require_positive("roughness Sq", state.sq, "m")
    require_positive("area share of the asperities (CAR)", state.car)
    fc = cutoff_hz(state, model)
    if not 1.0 / model.duration_s <= fc <= model.rate_hz / 10.0:
        raise BadInput(
            f"profile cut-off must lie between 1/duration ({1.0 / model.duration_s:g} Hz) and a tenth of the sampling "
            f"rate ({model.rate_hz / 10.0:g} Hz), got {fc:g} Hz; change the cut-off law, duration or rate"
        )
    samples = round(model.duration_s * model.rate_hz)
    return Signal(_butterworth_noise(samples, fc / model.rate_hz, height, model.seed), model.rate_hz, "m")


def _butterworth_noise(samples: int, cutoff: float, rms: float, seed: int) -> Field:
    """Samples of y'' + √2 ω y' + ω^2 y = white noise, of standard deviation `rms`; `cutoff` in cycles a sample.

    State x = (y, y') obeys x⁺ = A x + e with cov e = Q (Van Loan 1978): y is an ARMA(2, 1) series of one white noise.
    """
    from scipy.linalg import expm
    from scipy.signal import lfilter

    omega = 2.0 * np.pi * cutoff
    drift = np.array([[0.0, 1.0], [-(omega**2), -np.sqrt(2.0) * omega]])
    exponential = expm(np.block([[-drift, np.diag([0.0, 1.0])], [np.zeros((2, 2)), drift.T]]))
    step = exponential[2:, 2:].T
    noise = step @ exponential[:2, 2:]
    # y_n - tr(A) y_(n-1) + det(A) y_(n-2) = e1_(n-1) + (A12 e2 - A22 e1)_(n-2): its variance, neighbour covariance ...
    back = np.array([-step[1, 1], step[0, 1]])
    variance = noise[0, 0] + back @ noise @ back
    neighbour = back @ noise[:, 0]
    # ... are those of b0 w_n + b1 w_(n-1)
    plus, minus = np.sqrt(variance + 2.0 * neighbour), np.sqrt(variance - 2.0 * neighbour)
    numerator = np.array([plus + minus, plus - minus]) / 2.0
    denominator = np.array([1.0, -np.trace(step), np.linalg.det(step)])

    settling = int(np.ceil(12.0 * np.sqrt(2.0) / omega))  # 12 time constants: what is left of the start is e^-12
    white = np.random.default_rng(seed).standard_normal(settling + samples)
    to_rms = rms * np.sqrt(2.0 * np.sqrt(2.0) * omega**3)  # unit white noise would have variance 1 / (2 √2 ω^3)
    return np.asarray(to_rms * lfilter(numerator, denominator, white)[settling:])


def search_band(conditions: ContactConditions, model: VibrationModel) -> tuple[float, float]:
    """Where the contact resonance can be [Hz]: from f0 at CLR 0.01 to f0 at CLR 1, 5 % wider at both ends."""
    low, high = (_loaded_oscillator(share, conditions, model).natural_frequency_hz for share in (SMALLEST_SHARE, 1.0))
    return (1.0 - BAND_MARGIN) * low, (1.0 + BAND_MARGIN) * high


def contact_vibration(state: ContactState, conditions: ContactConditions, model: VibrationModel) -> Vibration:
    """Vibration of a contact, and the resonance found in it as it would be in a recording.

    The spectrum is the periodogram of the whole record without taper: nothing simulated leaks into the band.

    Raises
    ------
    BadInput
        for a sampling rate below 15 times the full-load resonance, or what `excitation` refuses.
    """
    full_load_crf_hz = _loaded_oscillator(1.0, conditions, model).natural_frequency_hz
    slowest = SAMPLES_PER_PERIOD * full_load_crf_hz
    if model.rate_hz < slowest:
        raise BadInput(
            f"vibration sampling rate must be at least {SAMPLES_PER_PERIOD} times the full-load resonance of "
            f"{full_load_crf_hz:.0f} Hz, got {model.rate_hz:g} Hz; raise it to {np.ceil(slowest):.0f} Hz"
        )
    band_hz = search_band(conditions, model)
    silence = _why_silent(state)
    if silence is not None:
        return Vibration(
            oscillator=None,
            profile=None,
            response=None,
            spectrum=None,
            expected=None,
            resonance=no_resonance(silence, band_hz, model.method),
            band_hz=band_hz,
            full_load_crf_hz=full_load_crf_hz,
        )
    spring = oscillator(state, conditions, model)
    profile = excitation(state, model)
    response = acceleration(spring, profile)
    spectrum = power_spectrum(response, window="boxcar")
    heights = profile_density(spectrum.frequency_hz, state.sq, cutoff_hz(state, model))
    return Vibration(
        oscillator=spring,
        profile=profile,
        response=response,
        spectrum=spectrum,
        expected=expected_spectrum(spring, replace(spectrum, density=heights, unit="m^2/Hz")),
        resonance=contact_resonance(spectrum, band_hz=band_hz, method=model.method),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
    )


def _why_silent(state: ContactState) -> str | None:
    if state.sq == 0.0:
        return "the surfaces are flat: there is no roughness to excite a vibration"
    if state.clr == 0.0:
        return "no asperity carries load: the oil separates the surfaces, and there is no contact spring to resonate"
    if state.car == 0.0:
        return "asperities touch outside the Hertz zone only, and the excitation is counted inside it"
    return None
