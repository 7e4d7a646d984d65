"""From a solved contact to its vibration: the only module that knows both. The paper's section 3.3, each law named.

Load share -> stiffness and damping, roughness -> height of the profile, area share -> its cut-off frequency; or, in
place of the paper's laws, the alternatives in the tables below. `PRESETS` are two coherent sets of choices.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, cast

import numpy as np

from asperity.conditions import ContactConditions
from asperity.ehl import ContactSolution, ContactState, roller_depth, tangent_stiffness
from asperity.errors import BadInput, NotConverged, require_positive
from asperity.hertz import line_stiffness, point_contact, point_stiffness
from asperity.signals import Signal, Spectrum, power_spectrum
from asperity.vibration import (
    PATCHES,
    RESPONSE_METHODS,
    ContactOscillator,
    Excitation,
    FilteredNoise,
    PatchAverage,
    SurfaceTrack,
    acceleration,
    expected_spectrum,
    mass_motion,
    require_damping_ratio,
    require_filter,
)
from asperity.wear import INDICATOR_METHODS, IndicatorMethod, Resonance, contact_resonance, no_resonance

SMALLEST_SHARE = 0.01  # CLR at the lower end of the search band: below it the film is full and nothing resonates
BAND_MARGIN = 0.05
BAND_FACTOR = 1.5  # where the load share does not bound the resonance: the band about it, up and down
SAMPLES_PER_PERIOD = 15.0  # below it the straight lines between samples cost the resonance over 3 % of its power
LINEAR_UP_TO = 0.2  # rms dynamic force over load; the CRF is then 0.4 % lower than the linear spring's
FILM_EXPONENT = 0.13  # h ~ load^-0.13: Dowson and Higginson's film of a line contact
ROUGHNESS_FACTOR = 0.48  # γ in K = F/(γ Sq): S. Akarapu, T. Sharp, M. O. Robbins, Phys. Rev. Lett. 106 (2011) 204301


class Pressed(NamedTuple):
    """What a stiffness law may look at; `clr` in place of the state's own. No solution: only scalars are known."""

    clr: float
    state: ContactState
    conditions: ContactConditions
    reference_depth: float
    solution: ContactSolution | None


def hertz_point(pressed: Pressed) -> float:
    """Stiffness of a sphere on a plane [N/m] under the asperities' load, Rx and E* of the contact: paper Eqs 2-3."""
    conditions = pressed.conditions
    load = pressed.clr * conditions.load
    return point_stiffness(load, conditions.radius_along_rolling, conditions.pair.reduced_modulus)


def hertz_line(pressed: Pressed) -> float:
    """Stiffness of a smooth line contact [N/m] under the asperities' load: π E* L / (2 ln(2d/a))."""
    conditions = pressed.conditions
    if conditions.length is None:
        raise BadInput(f"stiffness law hertz-line needs a line contact, got a {conditions.geometry} contact")
    return line_stiffness(
        pressed.clr * conditions.load,
        conditions.length,
        conditions.radius_along_rolling,
        conditions.pair.reduced_modulus,
        pressed.reference_depth,
    )


def parallel_film(pressed: Pressed) -> float:
    """Asperity layer and oil film side by side, both on the elastic bodies [N/m].

    1/S = 1/S_bodies + 1/(k_a + k_f): S_bodies Hertz's point spring under the whole load, k_a = CLR F / (γ Sq) the
    stiffness of a randomly rough layer, k_f = (1 - CLR) F / (0.13 h) that of a film with h ~ load^-0.13, h its mean
    over the Hertz zone.
    """
    state, load = pressed.state, pressed.conditions.load
    layers = 0.0
    if state.sq > 0.0:
        layers += pressed.clr * load / (ROUGHNESS_FACTOR * state.sq)
    if state.h_mean > 0.0:
        layers += (1.0 - pressed.clr) * load / (FILM_EXPONENT * state.h_mean)
    bodies = hertz_point(pressed._replace(clr=1.0))
    return bodies if layers == 0.0 else 1.0 / (1.0 / bodies + 1.0 / layers)


def tangent(pressed: Pressed) -> float:
    """Tangent stiffness of the solved contact itself [N/m], asperities and film: `asperity.ehl.stiffness`."""
    if pressed.solution is None:
        raise BadInput("stiffness law tangent needs the solved contact; solve the case, or take another law")
    return tangent_stiffness(pressed.solution, reference_depth=pressed.reference_depth).total


STIFFNESS_LAWS: dict[str, Callable[[Pressed], float]] = {
    "hertz-point": hertz_point,
    "hertz-line": hertz_line,
    "parallel-film": parallel_film,
    "tangent": tangent,
}
ASPERITIES_ALONE = ("hertz-point", "hertz-line")  # no spring without touching asperities, and it grows with their load

DAMPING_LAWS: dict[str, Callable[["VibrationModel", float], float]] = {  # (model, S) -> ζ
    "ratio": lambda model, _: model.damping_ratio,
    "constant": lambda model, stiffness: (model.damping or 0.0) / (2.0 * float(np.sqrt(stiffness * model.mass))),
    "hertz-for-radian": lambda model, _: model.damping_ratio / (2.0 * float(np.pi)),
}

PRESETS: dict[str, dict[str, Any]] = {
    "paper": {
        "damping_law": "hertz-for-radian",
        "stiffness_law": "hertz-point",
        "excitation": "noise",
        "cutoff_reference_hz": 30.0,
        "filter": "bilinear",
        "filter_order": 2,
        "height_as": "rms",
        "height_of": "record",
        "coefficient": "kept",
        "patch": "none",
        "rate_hz": 10e3,
        "duration_s": 1.6384,
        "response": "rk5",
        "substeps": 8,
        "samples_per_period": 2.0,
        "method": "peak",
    }
}


@dataclass(frozen=True, kw_only=True)
class VibrationModel:
    """How a contact state becomes a vibration record. The defaults are the preset `sound`; `preset` makes the other.

    Parameters
    ----------
    mass : mass that rides on the contact [kg]
    damping_ratio : of the contact oscillator; 0.01 dry to 0.1 in boundary lubrication (the paper's section 2.1)
    damping_law : name in DAMPING_LAWS. "ratio" C = 2ζωm; "constant" C = `damping`, whatever the load;
        "hertz-for-radian" the paper's Eq 5 with Eq 4's hertz in it, a damping ratio of ζ/2π
    damping : C of the law "constant" [N s/m]
    stiffness_law : name in STIFFNESS_LAWS; "hertz-point" is the paper's, a line contact's own stiffness is far higher
    reference_depth : depth from which a line contact's approach is measured [m], for "hertz-line" and "tangent"; None:
        2R/e, a roller held at its centre
    excitation : "noise", filtered, its height Sq; "surface", the surface's own spectrum run over
    cutoff_reference_hz, car_reference, cutoff_exponent : the profile's cut-off fc = fc_ref (CAR/CAR_ref)^q [Hz]. The
        paper names no law. 30 Hz is the base case of its dry section 2, in which everything touches, hence CAR_ref = 1;
        q = 0.18 is where its "the two effects offset" holds (in proportion, q = 1, CRFA would grow 60 000-fold)
    filter, filter_order, height_as, height_of : of the noise, see `asperity.vibration.excitation.FilteredNoise`
    coefficient : of the noise: "readjusted" to the height at every cut-off, or "kept" from the reference cut-off
    patch : "none", or the contact patch over which the profile is averaged: "line" (half-width of the smooth line
        contact under the whole load), "point" (radius of the sphere's contact under the asperities' load)
    passing_speed : speed at which roughness passes, for "surface" and `patch` [m/s]; None: the sliding speed
    response, substeps : "exact", "rk5" or "nonlinear", see `asperity.vibration.oscillator.acceleration`
    rate_hz : samples a second; at least `samples_per_period` times the full-load resonance
    samples_per_period : 15 keeps the loss to the straight lines between samples below 3 % of CRFA (at 100 kHz and
        3.5 kHz it is 0.8 %)
    duration_s : length of the record [s]; sd(CRF) = sqrt(ζ f0 / (2π duration)), 1.7 Hz for the paper's case and 4 s
    seed : of the profile; one seed, one record
    method : how the resonance is found, name in INDICATOR_METHODS. The likeliest line supposes a base that is white in
        acceleration, as noise behind a filter of order 2 is; over a surface's own spectrum, or averaged by a patch,
        take "peak", or `Vibration.expected`

    Raises
    ------
    BadInput
        for a quantity out of range or a name that is not in its table.
    """

    mass: float
    damping_ratio: float
    damping_law: str = "ratio"
    damping: float | None = None
    stiffness_law: str = "hertz-point"
    reference_depth: float | None = None
    excitation: str = "noise"
    cutoff_reference_hz: float = 30.0
    car_reference: float = 1.0
    cutoff_exponent: float = 0.18
    filter: str = "continuous"
    filter_order: int = 2
    height_as: str = "rms"
    height_of: str = "process"
    coefficient: str = "readjusted"
    patch: str = "none"
    passing_speed: float | None = None
    response: str = "exact"
    substeps: int = 8
    rate_hz: float = 100e3
    samples_per_period: float = SAMPLES_PER_PERIOD
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
        for name, unit in (("damping", "N s/m"), ("reference_depth", "m"), ("passing_speed", "m/s")):
            if getattr(self, name) is not None:
                require_positive(name.replace("_", " "), getattr(self, name), unit)
        if not 0.0 <= self.cutoff_exponent <= 2.0:
            raise BadInput(
                f"cut-off exponent must lie between 0 and 2, got {self.cutoff_exponent:g}; 0.18 is the default"
            )
        if not self.samples_per_period >= 2.0:
            raise BadInput(
                f"samples per period must be at least 2, got {self.samples_per_period:g}; "
                f"{SAMPLES_PER_PERIOD:g} is the default"
            )
        if self.seed < 0:
            raise BadInput(f"vibration seed must be 0 or more, got {self.seed}")
        if self.substeps < 1:
            raise BadInput(f"sub-steps must be 1 or more, got {self.substeps}; 8 is the default")
        for thing, value, known in (
            ("stiffness law", self.stiffness_law, STIFFNESS_LAWS),
            ("damping law", self.damping_law, DAMPING_LAWS),
            ("excitation", self.excitation, ("noise", "surface")),
            ("noise coefficient", self.coefficient, ("readjusted", "kept")),
            ("contact patch", self.patch, ("none", *PATCHES)),
            ("response", self.response, RESPONSE_METHODS),
            ("indicator method", self.method, INDICATOR_METHODS),
        ):
            if value not in known:
                raise BadInput(f"{thing} must be one of {', '.join(known)}, got {value!r}")
        require_filter(self.filter_order, self.filter, self.height_as, self.height_of)
        if self.damping_law == "constant" and self.damping is None:
            raise BadInput("damping law constant needs damping, in N s/m; add it, or take the law ratio")
        if self.response == "nonlinear" and self.stiffness_law != "hertz-point":
            raise BadInput(
                f"a nonlinear response is that of Hertz's point spring, got the stiffness law {self.stiffness_law!r}; "
                "take hertz-point, or the exact response"
            )

    @classmethod
    def preset(cls, name: str, **choices: Any) -> "VibrationModel":
        """The preset `name` with `choices` (mass and damping_ratio at least) on top; BadInput for an unknown name."""
        return cls(**{**preset_choices(name), **choices})


def preset_choices(name: str) -> Mapping[str, Any]:
    """Every choice that tells the presets apart, as `name` has it.

    "paper": everything as the paper's section 2 did it, as far as it can be recovered (docs/theory/vibration.md);
    "sound", the default: fine sampling, the true damping, the likeliest line.
    """
    if name == "sound":
        return {entry.name: entry.default for entry in fields(VibrationModel) if entry.name in PRESETS["paper"]}
    if name not in PRESETS:
        raise BadInput(f"vibration preset must be one of sound, {', '.join(PRESETS)}, got {name!r}")
    return PRESETS[name]


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """What a contact state sounds like.

    `resonance` was searched in `band_hz`, which follows from the contact alone; `full_load_crf_hz` is the resonance
    with all load on asperities [Hz]. `profile` [m], `response` [m/s^2] and its `spectrum` are the record; `expected`
    is what `spectrum` scatters about, in closed form (of the linear spring), and `expected_crfa` its continuous height
    at the oscillator's own frequency [(m/s^2)^2/Hz]. `dynamic_load` is the rms dynamic force over the spring's load
    (above 0.2 a linear spring misleads), `contact_loss` the share of the time in the air. When no asperity touches
    there is no spring and no record: all of these are None and `resonance.reason` says so.
    """

    oscillator: ContactOscillator | None
    profile: Signal | None
    response: Signal | None
    spectrum: Spectrum | None
    expected: Spectrum | None
    resonance: Resonance
    band_hz: tuple[float, float]
    full_load_crf_hz: float
    expected_crfa: float | None = None
    dynamic_load: float | None = None
    contact_loss: float | None = None


def oscillator(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> ContactOscillator:
    """The mass on the contact spring, by the model's stiffness and damping laws.

    Raises BadInput when the law's spring is that of the asperities and they carry nothing, or when it needs the solved
    contact and there is none.
    """
    if model.stiffness_law in ASPERITIES_ALONE:
        require_positive("load share of the asperities (CLR)", state.clr)
    return _loaded_oscillator(state.clr, state, conditions, model, solution)


def _loaded_oscillator(
    clr: float,
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    solution: ContactSolution | None = None,
) -> ContactOscillator:
    depth = model.reference_depth or roller_depth(conditions)
    stiffness = STIFFNESS_LAWS[model.stiffness_law](Pressed(clr, state, conditions, depth, solution))
    load = (clr if model.stiffness_law in ASPERITIES_ALONE else 1.0) * conditions.load
    return damped_oscillator(stiffness, load, model)


def damped_oscillator(stiffness: float, load: float, model: VibrationModel) -> ContactOscillator:
    """The model's mass and damping on a spring of `stiffness` [N/m] that carries `load` [N]."""
    return ContactOscillator(
        mass=model.mass,
        stiffness=stiffness,
        damping_ratio=require_damping_ratio(DAMPING_LAWS[model.damping_law](model, stiffness)),
        load=load,
    )


def needs_solution(model: VibrationModel) -> bool:
    """Whether the model asks for more than the dry, fully loaded contact of the paper's section 2 can tell."""
    return model.stiffness_law not in ASPERITIES_ALONE or model.excitation == "surface"


def cutoff_hz(state: ContactState, model: VibrationModel) -> float:
    """Cut-off of the profile [Hz]: fc = fc_ref (CAR/CAR_ref)^q, CAR counted in the Hertz zone as the paper does."""
    return float(model.cutoff_reference_hz * (state.car / model.car_reference) ** model.cutoff_exponent)


def excitation(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> Excitation:
    """What passes under the mass: filtered Gaussian noise of height Sq, or the solution's surface run over.

    By default Sq is the height of the process, not of the one record: scaling each record to Sq would hand the chance
    of a few hundred slow waves on to CRFA (about 9 % at 30 Hz and 4 s).

    Raises
    ------
    BadInput
        for a flat surface, noise behind a contact without touching asperities, roughness that has to pass at a speed
        and does not, a surface that is not known because there is no solution.
    """
    speed = conditions.sliding_speed if model.passing_speed is None else model.passing_speed
    moving = model.excitation == "surface" or model.patch != "none"
    if moving and speed == 0.0:
        raise BadInput("roughness passes the contact at the sliding speed, which is 0; give passing_speed, or slip")
    source: Excitation
    if model.excitation == "surface":
        if solution is None:
            raise BadInput("excitation surface needs the solved contact's surface; solve the case, or take noise")
        source = SurfaceTrack.of(solution.surface, speed)
    else:
        require_positive("area share of the asperities (CAR)", state.car)
        source = FilteredNoise(
            height=require_positive("roughness Sq", state.sq, "m"),
            cutoff_hz=cutoff_hz(state, model),
            order=model.filter_order,
            filter=model.filter,
            height_as=model.height_as,
            height_of=model.height_of,
            reference_cutoff_hz=model.cutoff_reference_hz if model.coefficient == "kept" else None,
        )
    if model.patch == "none":
        return source
    if model.patch == "line":
        half_width = conditions.hertz.half_widths[0]
    else:
        load = require_positive("load share of the asperities (CLR)", state.clr) * conditions.load
        point = point_contact(load, conditions.radius_along_rolling, conditions.pair.reduced_modulus)
        half_width = point.half_widths[0]
    return PatchAverage(source=source, shape=model.patch, half_width=half_width, speed=speed)


def search_band(conditions: ContactConditions, model: VibrationModel) -> tuple[float, float]:
    """Where the resonance of the asperities' own spring can be [Hz]: f0 from CLR 0.01 to 1, 5 % wider at both ends."""
    shares = (SMALLEST_SHARE, 1.0)
    low, high = (
        _loaded_oscillator(share, dry_full_load(conditions, 0.0), conditions, model).natural_frequency_hz
        for share in shares
    )
    return (1.0 - BAND_MARGIN) * low, (1.0 + BAND_MARGIN) * high


def dry_full_load(conditions: ContactConditions, sq: float) -> ContactState:
    """The paper's section 2: no oil, and roughness `sq` [m] that touches everywhere and carries all the load."""
    return ContactState(
        car=1.0,
        car_domain=1.0,
        clr=1.0,
        capped_oil_load_ratio=0.0,
        sq=sq,
        h_min=0.0,
        h_central=0.0,
        h_mean=0.0,
        lambda_ratio=None,
        p_max=conditions.hertz.p_max,
        reynolds_residual=0.0,
        load_error=0.0,
        mass_flux_imbalance=0.0,
    )


def require_sampling(conditions: ContactConditions, model: VibrationModel, sq: float) -> float:
    """The full-load resonance [Hz] of a contact with roughness `sq` [m], where the model samples it finely enough.

    Needs no solved contact, so that it can be asked before one is solved. Raises BadInput for a sampling rate below
    `samples_per_period` times that resonance.
    """
    # a tangent stiffness belongs to its own load share; with all load on asperities the contact is smooth and dry
    smooth = "hertz-line" if conditions.geometry == "line" else "hertz-point"
    whole = replace(model, stiffness_law=smooth) if model.stiffness_law == "tangent" else model
    spring = _loaded_oscillator(1.0, dry_full_load(conditions, sq), conditions, whole)
    slowest = model.samples_per_period * spring.natural_frequency_hz
    if model.rate_hz < slowest:
        raise BadInput(
            f"vibration sampling rate must be at least {model.samples_per_period:g} times the full-load resonance of "
            f"{spring.natural_frequency_hz:.0f} Hz, got {model.rate_hz:g} Hz; raise it to {np.ceil(slowest):.0f} Hz"
        )
    return spring.natural_frequency_hz


def contact_vibration(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> Vibration:
    """Ride over the contact, record the acceleration and look for its resonance.

    Parameters
    ----------
    state, conditions, model : the contact, as scalars, and how it vibrates
    solution : the solved contact, for the stiffness law "tangent" and the excitation "surface"

    Raises
    ------
    BadInput
        for a sampling rate below `samples_per_period` times the full-load resonance, or what `oscillator`,
        `excitation` and its records refuse.
    """
    asperities_alone = model.stiffness_law in ASPERITIES_ALONE
    full_load_crf_hz = require_sampling(conditions, model, state.sq)
    silence = _why_silent(state, model)
    spring = None
    if silence is None:
        try:
            spring = oscillator(state, conditions, model, solution=solution)
        except NotConverged as unfinished:
            silence = f"the tangent stiffness takes neighbouring loads, and at one of them: {unfinished}"
    if asperities_alone:
        band_hz = search_band(conditions, model)
    else:
        middle = full_load_crf_hz if spring is None else spring.natural_frequency_hz
        band_hz = middle / BAND_FACTOR, min(middle * BAND_FACTOR, model.rate_hz / 2.0)
    if silence is not None or spring is None:
        return Vibration(
            oscillator=None,
            profile=None,
            response=None,
            spectrum=None,
            expected=None,
            resonance=no_resonance(silence or "", band_hz, model.method),
            band_hz=band_hz,
            full_load_crf_hz=full_load_crf_hz,
        )
    ridden_over = excitation(state, conditions, model, solution=solution)
    profile = ridden_over.profile(round(model.duration_s * model.rate_hz), model.rate_hz, model.seed)
    contact_loss = 0.0
    if model.response == "nonlinear":
        moved = mass_motion(spring, profile, method=model.response, substeps=model.substeps)
        response, contact_loss = Signal(moved.acceleration, profile.rate_hz, "m/s^2"), moved.contact_loss
    else:
        response = acceleration(spring, profile, method=model.response, substeps=model.substeps)
    spectrum = power_spectrum(response, window="boxcar")
    heights = ridden_over.density(spectrum.frequency_hz, model.rate_hz)
    f0 = np.array(spring.natural_frequency_hz)
    return Vibration(
        oscillator=spring,
        profile=profile,
        response=response,
        spectrum=spectrum,
        expected=expected_spectrum(spring, replace(spectrum, density=heights, unit="m^2/Hz"), rate_hz=model.rate_hz),
        resonance=contact_resonance(spectrum, band_hz=band_hz, method=cast(IndicatorMethod, model.method)),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
        expected_crfa=float(spring.gain(f0) * ridden_over.density(f0, model.rate_hz)),
        dynamic_load=float(model.mass * np.std(response.values) / (spring.load or conditions.load)),
        contact_loss=contact_loss,
    )


def _why_silent(state: ContactState, model: VibrationModel) -> str | None:
    if state.sq == 0.0:
        return "the surfaces are flat: there is no roughness to excite a vibration"
    if state.clr == 0.0 and model.stiffness_law in ASPERITIES_ALONE:
        return "no asperity carries load: the oil separates the surfaces, and there is no contact spring to resonate"
    if state.car == 0.0 and model.excitation == "noise":
        return "asperities touch outside the Hertz zone only, and the excitation is counted inside it"
    return None
