import re
from dataclasses import replace

import numpy as np
import pytest

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.core.errors import BadInput
from asperity.coupling import VibrationModel, dry_full_load, oscillator
from asperity.trend import RecordingFacts, asperity_load_share, comparability

FACTS = RecordingFacts(
    name="a.csv", rate_hz=20e3, segment=20_000, window="hann", unit="m/s^2", duration_s=300.0
)


def test_the_load_share_is_recovered_from_its_resonance():
    conditions = ContactConditions(
        pair=ElasticPair((207e9, 207e9), (0.3, 0.3)),
        geometry="point",
        radius=5.4e-3,
        load=500.0,
        surface_speeds=(2.12, 1.70),
    )
    model = VibrationModel(mass=0.1, damping_ratio=0.02)
    full = dry_full_load(conditions, 1e-6)
    crf = {
        clr: oscillator(replace(full, clr=clr), conditions, model).natural_frequency_hz
        for clr in (0.2, 0.9, 1.0)
    }
    assert crf[1.0] == pytest.approx(3879.0, abs=1.0)  # physics of the rig: 3879 Hz for 207 GPa
    inferred = asperity_load_share(np.array([crf[0.2], crf[0.9]]), 0.0, crf[1.0])
    assert inferred.clr == pytest.approx([0.2, 0.9], rel=1e-9)


def test_the_interval_of_the_load_share_agrees_with_monte_carlo():
    rng = np.random.default_rng(0)
    crf, full = (
        3300.0 + 20.0 * rng.standard_normal(200_000),
        3879.0 + 30.0 * rng.standard_normal(200_000),
    )
    inferred = asperity_load_share(3300.0, 20.0, 3879.0, full_load_std_hz=30.0)
    assert [*inferred.interval] == pytest.approx(
        np.quantile((crf / full) ** 6, [0.05, 0.95]), rel=0.01
    )


def test_recordings_without_a_resonance_have_no_load_share():
    assert np.isnan(asperity_load_share(np.array([np.nan]), np.array([np.nan]), 3879.0).clr).all()


@pytest.mark.parametrize(("full", "std"), [(0.0, 1.0), (3879.0, -1.0)])
def test_impossible_frequencies_are_refused(full, std):
    with pytest.raises(BadInput):
        asperity_load_share(3300.0, std, full)


def test_comparable_recordings_have_no_problems():
    longer = replace(FACTS, name="b.csv", duration_s=200.0, rate_hz=20_001.0)
    assert comparability([FACTS, longer]) == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"rate_hz": 10e3, "segment": 10_000},
            "sampling rate differs between recordings, from 10000 Hz \\(b.csv",
        ),
        ({"segment": 10_000}, "resolution differs"),
        ({"unit": "V"}, "unit differs between recordings: m/s\\^2 \\(a.csv\\), V \\(b.csv\\)"),
        ({"unit": None}, "none \\(b.csv\\)"),
        ({"window": "boxcar"}, "window differs"),
        ({"load_n": 500.0}, "load is stated for 1 of 2 recordings, not for a.csv"),
    ],
)
def test_a_difference_is_reported_in_one_sentence_with_both_values(change, message):
    problems = comparability([FACTS, replace(FACTS, name="b.csv", **change)])
    assert len(problems) == 1
    assert re.search(message, problems[0])


def test_different_loads_and_speeds_are_reported():
    known = replace(FACTS, load_n=500.0, speed_hz=56.25)
    assert comparability([known, known]) == ()
    problems = comparability([known, replace(known, load_n=400.0, speed_hz=50.0)])
    assert [problem.split()[1] for problem in problems] == ["load", "speed"]
