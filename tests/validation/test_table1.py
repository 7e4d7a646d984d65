"""All twelve rows of the paper's Table 1, and its trends (issue 4, item 1)."""

import csv
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.coupling import VibrationModel
from asperity.paper import TABLE1_PRINTED, continuous_crfa, expected_crfa, reproduce_table1
from asperity.paper.table1 import highest_point, oscillator_on_noise

TABLE = Path(__file__).parents[1] / "reference" / "table1.csv"
ROWS = list(csv.DictReader(TABLE.read_text().splitlines()))
PAPER = VibrationModel.preset("paper", mass=0.1, damping_ratio=0.02)
LOADS = (100.0, 200.0, 300.0, 400.0)


def exponent(x, y) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


@pytest.fixture(scope="module")
def ours():
    return reproduce_table1(records=60)


def test_the_reference_rows_are_the_twelve_rows_of_the_paper():
    assert [tuple(map(float, row.values())) for row in ROWS] == list(TABLE1_PRINTED)
    assert len(TABLE1_PRINTED) == 12


@pytest.mark.parametrize("number", range(12))
def test_median_crf_agrees_with_the_printed_value_within_035_percent(ours, number):
    """With E = 207 GPa (from section 4, E* = 113.74 GPa). The printed 219.78 GPa, used as E*, would
    give 25 % more.
    """
    assert ours[number].crf_hz == pytest.approx(ours[number].paper_crf_hz, rel=0.0035)


def test_printed_crfas_lie_between_the_5th_and_95th_percentiles(ours):
    assert sum(row.within for row in ours) >= 11


@pytest.mark.parametrize("preset", ["paper", "sound"])
def test_crf_is_proportional_to_load_to_the_power_of_one_sixth(preset):
    model = VibrationModel.preset(preset, mass=0.1, damping_ratio=0.02)
    crf = [oscillator_on_noise(model, 30.0, 2e-6, load)[0].natural_frequency_hz for load in LOADS]
    assert exponent(LOADS, crf) == pytest.approx(1 / 6, abs=1e-9)


def test_median_crf_of_the_records_is_proportional_to_load_to_the_power_of_one_sixth(ours):
    assert exponent(LOADS, [row.crf_hz for row in ours[:4]]) == pytest.approx(1 / 6, abs=0.002)


def test_crfa_of_each_record_is_proportional_to_height_squared(ours):
    crfa = np.array([[row.crfa, row.crfa_low, row.crfa_high] for row in ours[4:8]])
    assert crfa / crfa[0] == pytest.approx(
        np.repeat([[1.0], [4.0], [9.0], [16.0]], 3, axis=1), rel=1e-6
    )


@pytest.mark.parametrize(("coefficient", "power"), [("kept", 4.0), ("readjusted", 3.0)])
@pytest.mark.parametrize("height_of", ["record", "process"])
def test_crfa_is_a_power_of_the_cutoff(coefficient, power, height_of):
    model = VibrationModel.preset(
        "paper",
        mass=0.1,
        damping_ratio=0.02,
        coefficient=coefficient,
        height_of=height_of,
        response="exact",
    )
    cutoffs = (10.0, 20.0, 30.0, 40.0)
    crfa = [expected_crfa(model, cutoff, 2e-6, 200.0) for cutoff in cutoffs]
    assert exponent(cutoffs, crfa) == pytest.approx(power, abs=0.01)


def test_median_crfa_of_the_records_is_proportional_to_cutoff_to_the_power_of_four(ours):
    cutoffs = [row.cutoff_hz for row in ours[8:]]
    assert exponent(cutoffs, [row.crfa for row in ours[8:]]) == pytest.approx(4.0, abs=0.05)


# values at 10 and 50 kHz from physics.md, section 4
@pytest.mark.parametrize(
    ("rate", "slope"), [(10e3, -1.25), (20e3, -0.20), (50e3, -0.03), (200e3, -0.002)]
)
def test_crfa_decreases_with_load_only_because_of_the_sampling(rate, slope):
    model = VibrationModel.preset("paper", mass=0.1, damping_ratio=0.02, rate_hz=rate)
    sampled = [expected_crfa(model, 30.0, 2e-6, load) for load in LOADS]
    assert exponent(LOADS, sampled) == pytest.approx(slope, abs=max(0.02, 0.1 * abs(slope)))
    assert exponent(
        LOADS, [continuous_crfa(model, 30.0, 2e-6, load) for load in LOADS]
    ) == pytest.approx(0, abs=1e-6)


def test_the_closed_form_is_the_mean_over_many_records():
    """Mean periodogram at f0 over 300 records as in the paper, within four standard errors."""
    from asperity.core.signals import power_spectrum
    from asperity.vibration import acceleration

    spring, noise = oscillator_on_noise(PAPER, 30.0, 2e-6, 200.0)
    density = []
    for seed in range(300):
        record = acceleration(spring, noise.profile(16_384, 10e3, seed))
        spectrum = power_spectrum(record, window="boxcar")
        density.append(spectrum.density[round(spring.natural_frequency_hz / spectrum.spacing_hz)])
    assert np.mean(density) == pytest.approx(
        expected_crfa(PAPER, 30.0, 2e-6, 200.0), abs=4 * np.std(density) / np.sqrt(300)
    )


def test_the_highest_point_of_a_sine_is_at_its_frequency():
    values = np.sin(2 * np.pi * 2500.0 * np.arange(16_384) / 10e3)
    frequency, density = highest_point(values, 10e3)
    assert frequency == pytest.approx(2500.0, abs=0.4)
    assert density == pytest.approx(0.5 * 1.6384, rel=0.01)


def test_invalid_input_is_named():
    with pytest.raises(BadInput, match="at least 20"):
        reproduce_table1(records=5)
    with pytest.raises(BadInput, match="sound, paper"):
        reproduce_table1(preset="loud")
