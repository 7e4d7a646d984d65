"""Effect of a structure between contact and sensor on a resonance line: wider standard deviations,
and lines that the structure alone causes.
"""

import numpy as np
import pytest
from benchmarks import failures
from benchmarks.indicators import NINETY, drawn, joint, spectra_of, transferred
from benchmarks.sensors import BAND, FREQUENCY, _spectrum, machine

from asperity.resonance import line_shape, series_resonances
from asperity.resonance import residuals as misfit


def coverage_and_std(rig, spectra):
    resonances = joint(spectra)
    covered = [
        abs(resonance.crf_hz - true.crf_hz) < NINETY * resonance.crf_std
        for resonance, true in zip(resonances, rig.recordings, strict=True)
    ]
    return np.mean(covered), np.array([resonance.crf_std for resonance in resonances])


@pytest.fixture
def without_model_error(monkeypatch):
    """Function that removes the model error from the standard deviations."""

    def set_to_zero():
        monkeypatch.setattr(
            misfit, "_model_error_std", lambda _, line, *__: np.zeros((len(line), 4))
        )

    return set_to_zero


def test_intervals_cover_structural_modes_that_the_splines_do_not_resolve(without_model_error):
    """Modes as strong as the direct path, one narrower than the splines; 60 recordings of 300 s."""
    rig = transferred(drawn(6.0, 3102), 1.0, 102)
    spectra = spectra_of(rig)
    full, _ = coverage_and_std(rig, spectra)
    without_model_error()
    reduced, _ = coverage_and_std(rig, spectra)
    assert full > 0.8
    assert reduced < 0.65


def test_intervals_are_no_wider_without_structural_modes(without_model_error):
    rig = drawn(6.0, 3101, duration_s=60.0)
    spectra = spectra_of(rig)
    _, std = coverage_and_std(rig, spectra)
    without_model_error()
    _, reduced = coverage_and_std(rig, spectra)
    assert np.median(std / reduced) == pytest.approx(1.0, abs=0.02)


def test_a_housing_resonance_excited_by_impulses_is_not_taken_for_the_contact():
    """One-second snapshots of a failing outer race: the spectrum changes its shape, but no line
    moves. `python -m benchmarks.failures` repeats it.
    """
    assert failures.outcome("outer race", 0, 1.0, 20_000.0).claims == 0


def test_a_line_at_constant_frequency_is_detected_by_its_height():
    rng = np.random.default_rng(5)
    background = machine(rng)
    spectra = []
    for height in np.geomspace(0.1, 2.0, 12):
        density = background + height * line_shape(FREQUENCY, 3100.0, 0.02)
        spectra.append(_spectrum(density * rng.gamma(50.0, 1.0 / 50.0, density.size), 50))
    detected = [item for item in series_resonances(spectra, band_hz=BAND) if item.found]
    assert len(detected) >= 8
    assert np.mean([item.crf_hz for item in detected]) == pytest.approx(3100.0, abs=10.0)
    assert all("keeps its frequency" in item.reason for item in detected)
