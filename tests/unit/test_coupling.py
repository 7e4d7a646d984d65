import pickle
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pytest

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter
from asperity.coupling import (
    DAMPING_LAWS,
    PRESETS,
    STIFFNESS_LAWS,
    HertzForRadian,
    HertzLine,
    HertzPoint,
    LoadedContact,
    NoiseExcitation,
    StiffnessLaw,
    Tangent,
    VibrationModel,
    contact_vibration,
    dry_full_load,
    excitation,
    oscillator,
    preset_choices,
    search_band,
    vibration_choices,
)
from asperity.ehl import ContactState, solve_contact
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian
from asperity.surface import flat_surface

CONDITIONS = ContactConditions(
    pair=ElasticPair((207e9, 207e9), (0.3, 0.3)),
    geometry="line",
    radius=5.4e-3,
    load=200.0,
    surface_speeds=(2.12, 1.70),
    length=10e-3,
)
MODEL = VibrationModel(mass=0.1, damping_ratio=0.02)


def state(clr: float = 1.0, car: float = 1.0, sq: float = 2e-6) -> ContactState:
    return ContactState(
        car=car,
        car_domain=car,
        clr=clr,
        capped_oil_load_ratio=0.0,
        sq=sq,
        h_min=0.0,
        h_central=0.0,
        h_mean=0.0,
        lambda_ratio=None,
        p_max=1e9,
        reynolds_residual=0.0,
        load_error=0.0,
        mass_flux_imbalance=0.0,
    )


def test_full_load_stiffness_matches_the_hand_calculation():
    """physics.md section 4: z0 6.855 um, S0 4.3765e7 N/m, f0 3329.5 Hz at 200 N, E* 113.74 GPa, R
    5.4 mm.
    """
    spring = oscillator(state(), CONDITIONS, MODEL)
    assert spring.stiffness == pytest.approx(4.3765e7, rel=2e-4)
    assert spring.natural_frequency_hz == pytest.approx(3329.5, rel=1e-4)


def test_resonance_grows_with_the_sixth_root_of_the_load_share():
    full, shared = (oscillator(state(clr=clr), CONDITIONS, MODEL) for clr in (1.0, 0.2))
    assert shared.natural_frequency_hz == pytest.approx(
        full.natural_frequency_hz * 0.2 ** (1 / 6), rel=1e-12
    )


def test_cutoff_follows_the_area_share():
    assert MODEL.excitation.cutoff_hz(1.0) == pytest.approx(30.0)
    proportional = VibrationModel(
        mass=0.1, damping_ratio=0.02, cutoff_exponent=1.0, car_reference=0.5
    )
    assert proportional.excitation.cutoff_hz(0.25) == pytest.approx(15.0)


def test_the_search_band_follows_from_the_contact_alone():
    low, high = search_band(CONDITIONS, MODEL)
    assert low == pytest.approx(0.95 * 3329.5 * 0.01 ** (1 / 6), rel=1e-4)
    assert high == pytest.approx(1.05 * 3329.5, rel=1e-4)
    assert contact_vibration(state(clr=0.4), CONDITIONS, MODEL).band_hz == (low, high)


def test_one_seed_gives_one_record():
    first, again = (contact_vibration(state(clr=0.5, car=0.3), CONDITIONS, MODEL) for _ in range(2))
    assert np.array_equal(first.response.values, again.response.values)
    assert first.resonance == again.resonance
    other = contact_vibration(
        state(clr=0.5, car=0.3), CONDITIONS, VibrationModel(mass=0.1, damping_ratio=0.02, seed=2)
    )
    assert not np.array_equal(first.profile.values, other.profile.values)


def test_record_scatters_about_the_expected_spectrum():
    result = contact_vibration(state(clr=0.5, car=0.3), CONDITIONS, MODEL)
    inside = (result.spectrum.frequency_hz > result.band_hz[0]) & (
        result.spectrum.frequency_hz < result.band_hz[1]
    )
    ratio = result.spectrum.density[inside] / result.expected.density[inside]
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 / np.sqrt(ratio.size) + 0.01)


@pytest.mark.parametrize(
    ("contact", "reason"),
    [
        (state(clr=0.0, car=0.0), "no asperity"),
        (state(car=0.0), "outside"),
        (state(sq=0.0), "flat"),
    ],
)
def test_without_touching_asperities_a_reason_replaces_the_resonance(contact, reason):
    result = contact_vibration(contact, CONDITIONS, MODEL)
    assert result.oscillator is None
    assert result.spectrum is None
    assert not result.resonance.found
    assert reason in result.resonance.reason
    assert result.full_load_crf_hz == pytest.approx(3329.5, rel=1e-4)


def test_a_load_share_too_small_for_the_band_is_not_detected():
    result = contact_vibration(state(clr=0.003, car=0.02), CONDITIONS, MODEL)
    assert not result.resonance.found
    assert "edge" in result.resonance.reason


def test_invalid_input_is_named():
    slow = VibrationModel(mass=0.1, damping_ratio=0.02, rate_hz=20e3)
    with pytest.raises(
        BadInput, match=r"15 times the full-load resonance of 33\d\d Hz, got 20000 Hz"
    ):
        contact_vibration(state(), CONDITIONS, slow)
    with pytest.raises(BadInput, match="hertz-point, hertz-line, parallel-film, tangent"):
        VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="palmgren")
    with pytest.raises(BadInput, match="likelihood, modes, peak"):
        VibrationModel(mass=0.1, damping_ratio=0.02, method="highest")
    with pytest.raises(BadInput, match=r"got -0\.1 kg"):
        VibrationModel(mass=-0.1, damping_ratio=0.02)
    with pytest.raises(BadInput, match="CLR"):
        oscillator(state(clr=0.0), CONDITIONS, MODEL)
    with pytest.raises(BadInput, match="cut-off must be"):
        contact_vibration(
            state(), CONDITIONS, VibrationModel(mass=0.1, damping_ratio=0.02, duration_s=0.01)
        )
    choices = {
        "damping_law": "stiff",
        "excitation": "hammer",
        "coefficient": "lost",
        "patch": "square",
        "response": "euler",
        "filter": "chebyshev",
        "height_as": "rz",
        "height_of": "peak",
    }
    for name, value in choices.items():
        with pytest.raises(BadInput, match=value):
            VibrationModel(mass=0.1, damping_ratio=0.02, **{name: value})
    for name in ("damping", "reference_depth", "passing_speed"):
        with pytest.raises(BadInput, match=name.replace("_", " ")):
            VibrationModel(mass=0.1, damping_ratio=0.02, **{name: -1.0})
    with pytest.raises(BadInput, match="N s/m"):
        VibrationModel(mass=0.1, damping_ratio=0.02, damping_law="constant")
    with pytest.raises(BadInput, match="point spring"):
        VibrationModel(
            mass=0.1, damping_ratio=0.02, response="nonlinear", stiffness_law="hertz-line"
        )
    with pytest.raises(BadInput, match="sound, paper"):
        VibrationModel.preset("papper", mass=0.1, damping_ratio=0.02)
    for name in ("tangent", "surface"):
        changed = {"stiffness_law": name} if name == "tangent" else {"excitation": name}
        fast = VibrationModel(mass=0.1, damping_ratio=0.02, rate_hz=300e3, **changed)
        with pytest.raises(BadInput, match="solve the case"):
            contact_vibration(state(), CONDITIONS, fast)


def test_presets_differ_in_the_papers_choices_and_sound_is_the_default():
    sound = VibrationModel.preset("sound", mass=0.1, damping_ratio=0.02)
    assert sound == MODEL
    assert set(preset_choices("sound")) == set(PRESETS["paper"])
    paper = VibrationModel.preset("paper", mass=0.1, damping_ratio=0.02)
    assert (paper.rate_hz, paper.damping_law) == (10e3, HertzForRadian())
    assert paper.excitation == NoiseExcitation(
        filter="bilinear", height_of="record", coefficient="kept"
    )
    vibration = contact_vibration(dry_full_load(CONDITIONS, 2e-6), CONDITIONS, paper)
    assert vibration.oscillator.damping_ratio == pytest.approx(0.02 / (2 * np.pi))
    assert vibration.response.rate_hz == 10e3
    assert vibration.resonance.found
    assert vibration.dynamic_load == pytest.approx(
        0.002, abs=0.001
    )  # physics.md section 4: 0.002 F


def test_a_law_is_given_by_name_and_parameters_or_as_an_object():
    line = VibrationModel(
        mass=0.1, damping_ratio=0.02, stiffness_law="hertz-line", reference_depth=1e-3
    )
    assert line.stiffness_law == HertzLine(1e-3)
    assert line == VibrationModel(
        mass=0.1, damping_ratio=0.02, stiffness_law=HertzLine(reference_depth=1e-3)
    )
    assert replace(line, rate_hz=2e5).stiffness_law == HertzLine(1e-3)
    assert replace(MODEL, filter_order=3).excitation == NoiseExcitation(filter_order=3)
    assert pickle.loads(pickle.dumps(line)) == line
    with pytest.raises(TypeError, match="filtre"):
        VibrationModel(mass=0.1, damping_ratio=0.02, filtre="bilinear")


def test_parameters_of_unused_laws_are_retained():
    model = VibrationModel(mass=0.1, damping_ratio=0.02, reference_depth=1e-3, cutoff_exponent=1.0)
    assert model.stiffness_law == HertzPoint()
    assert model.with_choices(stiffness_law="tangent").stiffness_law == Tangent(1e-3)
    surface = model.with_choices(excitation="surface")
    assert surface.needs_solution
    assert surface.with_choices(excitation="noise") == model
    assert model.with_choices(cutoff_exponent=None).excitation == NoiseExcitation()
    assert model.with_choices(excitation=NoiseExcitation()).excitation == NoiseExcitation()


@dataclass(frozen=True)
class Cushioned(StiffnessLaw):
    """A law written by the recipe in CONTRIBUTING."""

    cushion: Annotated[float, Parameter("N/m", "k")] = 1e6
    name = "cushioned"
    asperities_alone = True

    def __call__(self, contact: LoadedContact) -> float:
        return self.cushion * contact.clr


def test_a_new_law_needs_a_class_and_a_table_entry(monkeypatch):
    monkeypatch.setitem(STIFFNESS_LAWS, Cushioned.name, Cushioned)
    assert vibration_choices()["cushion"] == (float, 1e6, "N/m")
    model = VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="cushioned", cushion=2e6)
    assert oscillator(state(clr=0.5), CONDITIONS, model).stiffness == 1e6
    assert search_band(CONDITIONS, model)[0] < search_band(CONDITIONS, model)[1]


def test_damping_laws_are_eq_5_with_radians_with_hertz_and_a_constant():
    springs = {
        law: oscillator(
            state(),
            CONDITIONS,
            VibrationModel(mass=0.1, damping_ratio=0.02, damping_law=law, damping=50.0),
        )
        for law in ("ratio", "hertz-for-radian", "constant")
    }
    f0 = springs["ratio"].natural_frequency_hz
    assert springs["ratio"].damping == pytest.approx(2 * 2 * np.pi * f0 * 0.1 * 0.02)
    assert springs["hertz-for-radian"].damping == pytest.approx(2 * f0 * 0.1 * 0.02)
    assert springs["constant"].damping == pytest.approx(50.0)


def test_the_contacts_own_damping_needs_a_solved_contact():
    model = VibrationModel(mass=0.1, damping_ratio=0.02, damping_law="contact")
    assert model.needs_solution
    with pytest.raises(BadInput, match='damping law "contact" needs a solved contact'):
        oscillator(state(), CONDITIONS, model)
    assert search_band(CONDITIONS, model) == search_band(CONDITIONS, MODEL)


def test_negative_total_damping_is_refused():
    """The smooth film alone has a damping ratio of -0.0075 at 10 kHz."""
    conditions = replace(CONDITIONS, pair=ElasticPair((200e9, 200e9), (0.3, 0.3)), load=500.0)
    a = conditions.hertz.half_widths[0]
    on = Grid((96, 8), (-4.5 * a, -a), (1.9 * a, a))
    oil = Lubricant(
        viscosity=Barus(0.096, 18.2e-9), density=DowsonHigginson(880.0), rheology=Newtonian()
    )
    film = solve_contact(conditions, oil, flat_surface(on))
    stiffness = 0.1 * (2.0 * np.pi * 10e3) ** 2
    assert (
        DAMPING_LAWS["contact"]()(mass=0.1, stiffness=stiffness, damping_ratio=0.02, solution=film)
        < 0.02
    )
    with pytest.raises(BadInput, match="oil excites vibration at 10000 Hz"):
        DAMPING_LAWS["contact"]()(mass=0.1, stiffness=stiffness, damping_ratio=0.005, solution=film)


def test_the_stiffness_of_a_line_contact_is_the_slope_of_its_approach():
    """dF/dδ of δ = (P'/πE*) (2 ln(4R/a) - 1), cylinder loaded at its centre (Johnson 1985, section
    5.6).
    """
    modulus, radius, length = CONDITIONS.pair.reduced_modulus, 5.4e-3, 10e-3

    def approach(load: float) -> float:
        a = np.sqrt(4 * load / length * radius / (np.pi * modulus))
        return load / length / (np.pi * modulus) * (2 * np.log(4 * radius / a) - 1)

    slope = 0.2 / (approach(100.1) - approach(99.9))
    law = VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="hertz-line")
    assert oscillator(state(clr=0.5), CONDITIONS, law).stiffness == pytest.approx(slope, rel=1e-6)


def test_the_film_beside_the_asperities_is_softer_than_the_bodies_and_stiffer_than_either():
    law = VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="parallel-film")
    bodies = oscillator(state(), CONDITIONS, MODEL).stiffness
    oily = replace(state(clr=0.3, sq=1e-6), h_mean=0.7e-6)
    both = oscillator(oily, CONDITIONS, law).stiffness
    layers = 1 / (1 / both - 1 / bodies)
    assert layers == pytest.approx(0.3 * 200 / (0.48 * 1e-6) + 0.7 * 200 / (0.13 * 0.7e-6))
    assert (
        oscillator(replace(oily, clr=0.0), CONDITIONS, law).stiffness < bodies
    )  # the spring remains without asperity contact


def test_excitation_choices_are_passed_to_the_noise():
    model = VibrationModel.preset(
        "paper", mass=0.1, damping_ratio=0.02, filter_order=3, patch="line"
    )
    averaged = excitation(state(car=0.3), CONDITIONS, model)
    assert averaged.half_width == pytest.approx(CONDITIONS.hertz.half_widths[0])
    assert averaged.speed == pytest.approx(0.42)
    noise = averaged.source
    assert (noise.filter_order, noise.filter, noise.height_of, noise.reference_cutoff_hz) == (
        3,
        "bilinear",
        "record",
        30.0,
    )
    with pytest.raises(BadInput, match="passing_speed"):
        excitation(state(), replace(CONDITIONS, surface_speeds=(1.9, 1.9)), model)
