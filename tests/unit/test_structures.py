"""What a structure between contact and sensor does to a line: deviations that carry it, lines that
it alone makes.
"""

import numpy as np
import pytest
from benchmarks import failures
from benchmarks.indicators import NINETY, drawn, joint, spectra_of, transferred
from benchmarks.sensors import BAND, FREQUENCY, _spectrum, machine

from asperity.resonance import line_shape, series_resonances
from asperity.resonance import residuals as misfit


def held(rig):
    found = joint(spectra_of(rig))
    off = [
        abs(one.crf_hz - true.crf_hz) < NINETY * one.crf_std
        for one, true in zip(found, rig.recordings, strict=True)
    ]
    return np.mean(off), np.array([one.crf_std for one in found])


@pytest.fixture
def without(monkeypatch):
    """Deviations as they were before they carried what fits leave."""

    def left_out():
        monkeypatch.setattr(
            misfit, "_model_error_std", lambda _, line, *__: np.zeros((len(line), 4))
        )

    return left_out


def test_intervals_hold_what_splines_do_not_follow(without):
    """Modes as loud as the direct way, one of them narrower than the splines; 60 recordings of 300
    s.
    """
    rig = transferred(drawn(6.0, 3102), 1.0, 102)
    share, _ = held(rig)
    without()
    before, _ = held(rig)
    assert share > 0.8
    assert before < 0.65


def test_intervals_are_no_wider_where_no_structure_is_heard(without):
    rig = drawn(6.0, 3101, duration_s=60.0)
    _, std = held(rig)
    without()
    _, before = held(rig)
    assert np.median(std / before) == pytest.approx(1.0, abs=0.02)


def test_a_housing_that_impulses_ring_is_no_contact():
    """Snapshots of a second of an outer race that fails: healthy and failing spectra differ in
    shape, nothing moves.
    """
    for seed in (0, 1):
        assert failures.outcome("outer race", seed, 1.0, 20_000.0).claims == 0


def test_a_line_that_keeps_its_place_is_found_by_its_height():
    rng = np.random.default_rng(5)
    rest = machine(rng)
    spectra = []
    for height in np.geomspace(0.1, 2.0, 12):
        density = rest + height * line_shape(FREQUENCY, 3100.0, 0.02)
        spectra.append(_spectrum(density * rng.gamma(50.0, 1.0 / 50.0, density.size), 50))
    found = [one for one in series_resonances(spectra, band_hz=BAND) if one.found]
    assert len(found) >= 8
    assert np.mean([one.crf_hz for one in found]) == pytest.approx(3100.0, abs=10.0)
    assert all("keeps its frequency" in one.reason for one in found)
