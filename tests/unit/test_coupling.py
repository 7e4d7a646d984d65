import numpy as np
import pytest

from asperity.conditions import ContactConditions, ElasticPair
from asperity.coupling import (
    VibrationModel,
    contact_vibration,
    cutoff_hz,
    excitation,
    oscillator,
    profile_density,
    search_band,
)
from asperity.ehl.state import ContactState
from asperity.errors import BadInput

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


def test_full_load_gives_the_stiffness_worked_out_by_hand():
    """physics.md section 4: z0 6.855 um, S0 4.3765e7 N/m, f0 3329.5 Hz at 200 N, E* 113.74 GPa, R 5.4 mm."""
    spring = oscillator(state(), CONDITIONS, MODEL)
    assert spring.stiffness == pytest.approx(4.3765e7, rel=2e-4)
    assert spring.natural_frequency_hz == pytest.approx(3329.5, rel=1e-4)


def test_resonance_grows_with_the_sixth_root_of_the_load_share():
    full, shared = (oscillator(state(clr=clr), CONDITIONS, MODEL) for clr in (1.0, 0.2))
    assert shared.natural_frequency_hz == pytest.approx(full.natural_frequency_hz * 0.2 ** (1 / 6), rel=1e-12)


def test_cutoff_follows_the_area_share():
    assert cutoff_hz(state(car=1.0), MODEL) == pytest.approx(30.0)
    proportional = VibrationModel(mass=0.1, damping_ratio=0.02, cutoff_exponent=1.0, car_reference=0.5)
    assert cutoff_hz(state(car=0.25), proportional) == pytest.approx(15.0)


def test_profile_density_integrates_to_the_height():
    frequency = np.linspace(0.0, 30e3, 3_000_001)
    assert np.trapezoid(profile_density(frequency, 2e-6, 30.0), frequency) == pytest.approx(4e-12, rel=1e-6)


def test_profile_has_the_roughness_as_its_height_and_the_butterworth_autocovariance():
    """R(t) = h^2 e^(-a t) (cos a t + sin a t), a = sqrt(2) pi fc, at lags of a few ms, over 400 s."""
    model = VibrationModel(mass=0.1, damping_ratio=0.02, rate_hz=4e3, duration_s=400.0)
    heights = excitation(state(sq=2e-6), model).values
    assert heights.size == 1_600_000
    assert np.std(heights) == pytest.approx(2e-6, rel=0.03)
    a = np.sqrt(2.0) * np.pi * 30.0
    for lag in (1, 20, 60):
        t = lag / 4e3
        expected = 4e-12 * np.exp(-a * t) * (np.cos(a * t) + np.sin(a * t))
        assert np.mean(heights[lag:] * heights[:-lag]) == pytest.approx(expected, abs=0.05 * 4e-12)


def test_profile_at_the_resonance_has_the_continuous_filters_power():
    """Where a bilinear filter would lack 1.6 % and more: band power against the closed form, to statistical error."""
    from asperity.signals import power_spectrum

    model = VibrationModel(mass=0.1, damping_ratio=0.02, rate_hz=20e3, duration_s=100.0)
    spectrum = power_spectrum(excitation(state(), model), segment=20_000, window="blackmanharris")
    band = (spectrum.frequency_hz > 2500) & (spectrum.frequency_hz < 4000)
    f = spectrum.frequency_hz[band]
    folded = sum(profile_density(np.abs(f + k * 20e3), 2e-6, 30.0) for k in range(-3, 4))
    assert np.mean(spectrum.density[band] / folded) == pytest.approx(1.0, abs=0.012)


def test_band_follows_from_the_contact_alone():
    low, high = search_band(CONDITIONS, MODEL)
    assert low == pytest.approx(0.95 * 3329.5 * 0.01 ** (1 / 6), rel=1e-4)
    assert high == pytest.approx(1.05 * 3329.5, rel=1e-4)
    assert contact_vibration(state(clr=0.4), CONDITIONS, MODEL).band_hz == (low, high)


def test_one_seed_is_one_record():
    first, again = (contact_vibration(state(clr=0.5, car=0.3), CONDITIONS, MODEL) for _ in range(2))
    assert np.array_equal(first.response.values, again.response.values)
    assert first.resonance == again.resonance
    other = excitation(state(clr=0.5, car=0.3), VibrationModel(mass=0.1, damping_ratio=0.02, seed=2))
    assert not np.array_equal(first.profile.values, other.values)


def test_record_scatters_about_the_expected_spectrum():
    seen = contact_vibration(state(clr=0.5, car=0.3), CONDITIONS, MODEL)
    inside = (seen.spectrum.frequency_hz > seen.band_hz[0]) & (seen.spectrum.frequency_hz < seen.band_hz[1])
    ratio = seen.spectrum.density[inside] / seen.expected.density[inside]
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 / np.sqrt(ratio.size) + 0.01)


@pytest.mark.parametrize(
    ("silent", "why"), [(state(clr=0.0, car=0.0), "no asperity"), (state(car=0.0), "outside"), (state(sq=0.0), "flat")]
)
def test_without_touching_asperities_there_is_no_resonance_but_a_reason(silent, why):
    seen = contact_vibration(silent, CONDITIONS, MODEL)
    assert seen.oscillator is None
    assert seen.spectrum is None
    assert not seen.resonance.found
    assert why in seen.resonance.reason
    assert seen.full_load_crf_hz == pytest.approx(3329.5, rel=1e-4)


def test_a_share_too_small_for_the_band_is_not_found():
    seen = contact_vibration(state(clr=0.003, car=0.02), CONDITIONS, MODEL)
    assert not seen.resonance.found
    assert "edge" in seen.resonance.reason


def test_bad_input_is_named():
    slow = VibrationModel(mass=0.1, damping_ratio=0.02, rate_hz=20e3)
    with pytest.raises(BadInput, match=r"15 times the full-load resonance of 33\d\d Hz, got 20000 Hz"):
        contact_vibration(state(), CONDITIONS, slow)
    with pytest.raises(BadInput, match="hertz-point"):
        VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="hertz-line")
    with pytest.raises(BadInput, match="likelihood, peak"):
        VibrationModel(mass=0.1, damping_ratio=0.02, method="highest")
    with pytest.raises(BadInput, match=r"got -0\.1 kg"):
        VibrationModel(mass=-0.1, damping_ratio=0.02)
    with pytest.raises(BadInput, match="CLR"):
        oscillator(state(clr=0.0), CONDITIONS, MODEL)
    with pytest.raises(BadInput, match="cut-off must lie"):
        excitation(state(), VibrationModel(mass=0.1, damping_ratio=0.02, duration_s=0.01))
