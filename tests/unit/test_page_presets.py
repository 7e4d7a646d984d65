"""Presets of the page, and their stored results."""

import numpy as np
import pytest

from asperity.app import presets
from asperity.app.contact_tools import seamless
from asperity.app.inputs import case_inputs, shown, written
from asperity.app.settings import RejectedValue, Settings
from support.stored_results import solved


@pytest.mark.parametrize("name", presets.TITLES)
def test_every_preset_has_a_stored_result_of_its_exact_case(name):
    case = Settings(presets.preset_case(name)).case
    stored = presets.stored_result(case)
    assert stored is not None, "cd tests; python -m support.stored_results"
    assert stored.result.text == case.text
    assert stored.result.converged
    assert stored.result.regime == "Mixed lubrication"
    assert stored.result.row["crf_hz"] is not None
    assert presets.stored_result(case.with_written({"contact.load": "123 N"})) is None


def test_a_stored_result_is_that_of_the_solver():
    result, stored = solved("paper"), presets.stored_result(presets.default_case()).result
    assert stored.verdict == result.verdict
    assert stored.row == pytest.approx(result.row, rel=1e-6)
    assert stored.tiles == result.tiles
    np.testing.assert_allclose(stored.pressure, result.pressure, rtol=1e-3, atol=1e3)
    np.testing.assert_array_equal(stored.cells, result.cells)
    np.testing.assert_allclose(stored.spectrum.density, result.spectrum.density, rtol=1e-4)


def test_the_sound_has_its_peak_at_the_resonance():
    result = solved("paper")
    density = np.abs(np.fft.rfft(result.sound)) ** 2
    frequency = np.fft.rfftfreq(result.sound.size, 1.0 / result.sound_rate_hz)
    low, high = result.spectrum.band_hz
    band = (frequency > low) & (frequency < high)
    mean = np.average(frequency[band], weights=density[band])
    assert mean == pytest.approx(result.row["crf_hz"], rel=0.05)


def test_a_loop_has_no_step_at_its_end():
    ramp = np.linspace(0.0, 1.0, 1000, dtype=np.float32)
    loop = seamless(ramp, 50)
    assert loop.size == 950
    assert abs(loop[0] - loop[-1]) < 0.01


@pytest.mark.parametrize(
    ("text", "printed"),
    [("1 um", "1 µm"), ("20 deg", "20°"), ("80 degC", "80 °C"), ("500 N", "500 N"), ("2", "2")],
)
def test_units_are_printed_and_read_back(text, printed):
    assert shown(text) == printed
    assert written(printed) == text


def test_a_machine_is_set_by_its_own_inputs():
    settings = Settings(presets.preset_case("nu206"))
    heavier = settings.with_value("machine.radial_load", "8 kN")
    assert heavier.case.conditions.load > 1.5 * settings.case.conditions.load
    other = settings.with_value("position", "roller 1, outer ring")
    assert other.case.conditions.load < settings.case.conditions.load
    assert other.machine is not None
    rejected = settings.with_value("position", "roller 6, outer ring")
    assert isinstance(rejected, RejectedValue)
    assert "carries no load" in rejected.message
    restored, notes = settings.from_address(other.address)
    assert restored.changes == other.changes
    assert notes == []


def test_steep_roughness_gets_a_remark():
    settings = Settings(presets.default_case())
    assert settings.remark("surface.sq") == ""
    steep = settings.with_value("surface.sq", "50 um")
    assert steep.remark("surface.sq").startswith("Sq is 2.5 times the correlation length")


@pytest.mark.parametrize("name", presets.TITLES)
def test_every_number_has_a_hint_with_its_key(name):
    for key, entry in case_inputs(presets.preset_case(name)).items():
        if not entry.choices:
            assert entry.hint.endswith(f"Case file: {key}")
