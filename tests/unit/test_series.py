from dataclasses import replace

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum
from asperity.resonance import learn_series, series_resonances
from asperity.resonance.line_judgement import JudgedLine, line_objection
from asperity.resonance.resonance import line_shape
from asperity.resonance.separation import _fit_jointly, _with_positive_base, separate
from asperity.resonance.series import separate_series
from asperity.resonance.spectrum_model import (
    ModelParameters,
    SpectrumBlocks,
    joint_scoring_point,
    line_densities,
    line_densities_and_slopes,
    line_scoring_point,
    recording_costs,
    relative_columns,
)
from asperity.resonance.transfer import unit_transfer

BAND = (1800.0, 4000.0)
FREQUENCY = np.arange(0.0, 6000.0, 1.0)
TRUTH = np.linspace(2900.0, 3750.0, 12)


def machine() -> np.ndarray:
    """What stays: two structural modes, one of them where the contact passes, over a sloping
    floor.
    """
    f = np.maximum(FREQUENCY, 1.0)
    modes = sum(
        height * (f / f0) ** 4 / ((1 - (f / f0) ** 2) ** 2 + (2 * z * f / f0) ** 2) * 4 * z**2
        for f0, z, height in ((2300.0, 0.01, 1.0), (3400.0, 0.006, 0.8))
    )
    return 0.1 * (f / 2000.0) ** -0.7 + modes


def series(contact_height=0.7, *, averages=100.0, seed=0, truth=TRUTH, damping=0.02, passed=1.0):
    rng = np.random.default_rng(seed)
    gains = np.exp(0.2 * rng.standard_normal(truth.size))
    densities = [
        g * machine() + passed * contact_height * line_shape(FREQUENCY, f, damping)
        for g, f in zip(gains, truth, strict=True)
    ]
    return [
        Spectrum(
            frequency_hz=FREQUENCY,
            density=density * rng.gamma(averages, 1.0 / averages, density.size),
            unit="(m/s^2)^2/Hz",
            duration_s=averages,
            segment=12_000,
            window="boxcar",
            resolution_hz=1.0,
            averages=averages,
        )
        for density in densities
    ]


def test_the_moving_line_is_told_from_standing_modes_as_high():
    found = series_resonances(series(), band_hz=BAND)
    assert all(one.found for one in found)
    errors = np.array([one.crf_hz for one in found]) - TRUTH
    assert np.max(np.abs(errors)) < 3.0
    assert [one.crfa for one in found] == pytest.approx(np.full(TRUTH.size, 0.7), rel=0.1)
    fooled = series_resonances(series(), band_hz=BAND, method="peak")
    assert (
        np.mean([abs(one.crf_hz - f) > 100.0 for one, f in zip(fooled, TRUTH, strict=True)]) > 0.5
    )


def test_a_further_recording_is_judged_beside_what_others_have_settled():
    """As if all had been separated together, within the deviations; and what is no line of the
    contact is none.
    """
    truth = 3300.0 + 300.0 * np.random.default_rng(5).standard_normal(60).clip(-1.3, 1.3)
    spectra = series(truth=truth, seed=5)
    together = series_resonances(spectra, band_hz=BAND)
    first, shared, moved = learn_series(spectra[:40], band_hz=BAND)
    assert moved == ()
    assert [one.crf_hz for one in first] == [
        one.crf_hz for one in series_resonances(spectra[:40], band_hz=BAND)
    ]
    beside = shared.resonances(spectra[40:])
    pulls = [
        (one.crf_hz - all_.crf_hz) / all_.crf_std
        for one, all_ in zip(beside, together[40:], strict=True)
    ]
    assert np.max(np.abs(pulls)) < 1.0
    errors = [(one.crf_hz - f) / one.crf_std for one, f in zip(beside, truth[40:], strict=True)]
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.6
    assert [one.crf_std for one in beside] == pytest.approx(
        [one.crf_std for one in together[40:]], rel=0.3
    )
    (silent,) = shared.resonances(series(0.0, truth=truth[:1], seed=6))
    assert not silent.found
    with pytest.raises(BadInput, match="not belong to this series"):
        shared.resonances([replace(spectra[0], frequency_hz=2.0 * FREQUENCY)])


def test_the_fit_scatters_as_it_says():
    pulls = []
    for seed in range(12):
        for one, f in zip(series_resonances(series(seed=seed), band_hz=BAND), TRUTH, strict=True):
            pulls.append([(one.crf_hz - f) / one.crf_std, (one.crfa - 0.7) / one.crfa_std])
    assert np.mean(np.abs(pulls) < 1.645, axis=0) == pytest.approx(0.9, abs=0.06)


@pytest.fixture
def fit_of_seven():
    """Blocks of seven spectra of chance, and parameters that say something else of them."""
    rng = np.random.default_rng(4)
    centre = np.linspace(2000.0, 4000.0, 50)
    blocks = SpectrumBlocks(centre, rng.gamma(5.0, 0.2, (7, 50)), np.full((7, 50), 30.0))
    own = np.column_stack(
        [
            rng.normal(0, 1, 7),
            np.log(rng.uniform(2500, 3500, 7)),
            rng.normal(-4, 0.3, 7),
            rng.normal(0, 1, 7),
        ]
    )
    passed = unit_transfer(1900.0, 4100.0)
    passed = passed._replace(coefficients=rng.normal(0.0, 0.3, passed.coefficients.size))
    return blocks, ModelParameters(own, rng.normal(0.0, 0.5, 50), passed)


def test_the_score_is_the_slope_of_the_cost(fit_of_seven):
    blocks, at = fit_of_seven
    own, passed = at.own, at.transfer
    point, d = joint_scoring_point(blocks, at, np.zeros((passed.coefficients.size,) * 2)), 1e-6
    for row, column in ((0, 0), (3, 1), (5, 2), (6, 3)):
        shift = np.zeros_like(own)
        shift[row, column] = d
        up, down = (
            np.sum(recording_costs(blocks, at._replace(own=own + side * shift)))
            for side in (1.0, -1.0)
        )
        slope = (up - down) / (2 * d)
        assert point.own_score[row, column] == pytest.approx(-slope, rel=1e-4, abs=1e-3)
    shift = np.zeros(50)
    shift[20] = d
    up, down = (
        np.sum(recording_costs(blocks, at._replace(base=at.base + side * shift)))
        for side in (1.0, -1.0)
    )
    assert point.base_score[20] == pytest.approx(-(up - down) / (2 * d), rel=1e-4, abs=1e-3)
    for number in (0, 7, 30):
        shift = np.zeros(passed.coefficients.size)
        shift[number] = d
        ends = [
            passed._replace(coefficients=passed.coefficients + side * shift) for side in (1.0, -1.0)
        ]
        up, down = (np.sum(recording_costs(blocks, at._replace(transfer=end))) for end in ends)
        assert point.transfer_score[number] == pytest.approx(
            -(up - down) / (2 * d), rel=1e-4, abs=1e-3
        )


def test_lines_beside_what_is_settled_are_those_of_the_whole_fit(fit_of_seven):
    """What the transfer does to a line, in sums over blocks, is what it does block by block."""
    blocks, at = fit_of_seven
    whole = joint_scoring_point(blocks, at, np.zeros((at.transfer.coefficients.size,) * 2))
    alone = line_scoring_point(blocks, at)
    np.testing.assert_array_equal(alone.score, whole.own_score)
    np.testing.assert_array_equal(alone.information, whole.own_information)
    np.testing.assert_allclose(
        alone.transfer_coupling(blocks.centre, at), whole.transfer_own, rtol=1e-12, atol=1e-9
    )
    np.testing.assert_array_equal(
        line_densities(blocks.centre, at), line_densities_and_slopes(blocks.centre, at)[0]
    )
    level, f0, damping = (np.exp(at.own[:, column, None]) for column in range(3))
    apart = np.exp(relative_columns(blocks.centre, at) @ at.transfer.coefficients)
    told = level * apart * line_shape(blocks.centre, f0, damping)
    np.testing.assert_allclose(line_densities(blocks.centre, at), told, rtol=1e-12)


def test_a_line_heard_through_a_structure_is_held_by_its_interval():
    """What is passed on more at one frequency than at another draws the line there, alike in all
    recordings.
    """
    mode = 1.0 + 0.8 * 0.03j / (1.0 - (FREQUENCY / 3150.0) ** 2 + 0.03j * FREQUENCY / 3150.0)
    pulls = []
    for seed in range(6):
        truth = TRUTH + 20.0 * np.random.default_rng(seed).standard_normal(TRUTH.size)
        heard = series(truth=truth, seed=seed, passed=np.abs(mode) ** 2)
        for one, f in zip(series_resonances(heard, band_hz=BAND), truth, strict=True):
            pulls.append((one.crf_hz - f) / one.crf_std)
    assert 0.85 <= np.mean(np.abs(pulls) < 1.645) <= 1.0


def test_a_recording_without_the_contact_is_said_to_have_none():
    spectra = series()
    lifted = series(contact_height=1e-12, seed=5)[4]
    found = series_resonances([*spectra[:4], lifted, *spectra[5:]], band_hz=BAND)
    assert [one.found for one in found] == [True] * 4 + [False] + [True] * 7
    assert "no line moves" in found[4].reason
    assert np.isnan(found[4].crf_hz)


def test_where_nothing_moves_nothing_is_found():
    found = series_resonances(series(contact_height=1e-12), band_hz=BAND)
    assert not any(one.found for one in found)


def test_a_line_that_keeps_its_place_is_found_by_its_changing_share_and_has_no_exact_height():
    found = [
        one
        for one in series_resonances(series(truth=np.full(12, 3100.0)), band_hz=BAND)
        if one.found
    ]
    assert found
    for one in found:
        assert abs(one.crf_hz - 3100.0) < 4.0 * one.crf_std
        assert one.crfa < 0.7
        assert np.isnan(one.crfa_std)
        assert "lower bound" in one.reason


def test_lines_that_do_not_count_are_not_seen():
    spectra = series()
    kept = [np.ones(FREQUENCY.size, dtype=bool) for _ in spectra]
    spoilt = []
    for number, (spectrum, mask) in enumerate(zip(spectra, kept, strict=True)):
        at = 2600 + 17 * number
        density = spectrum.density.copy()
        density[at - 1 : at + 2] *= 1e4
        mask[at - 1 : at + 2] = False
        spoilt.append(replace(spectrum, density=density))
    clean = series_resonances(spectra, band_hz=BAND)
    masked = series_resonances(spoilt, band_hz=BAND, kept=kept)
    assert [one.crf_hz for one in masked] == pytest.approx([one.crf_hz for one in clean], abs=0.5)


def test_the_fitted_curve_is_the_spectrum():
    spectra = series(averages=1e4)
    inside = (FREQUENCY > 1900) & (FREQUENCY < 3900)
    for spectrum, one in zip(spectra, series_resonances(spectra, band_hz=BAND), strict=True):
        off = one.curve(FREQUENCY[inside]) / spectrum.density[inside] - 1.0
        assert np.sqrt(np.mean(off**2)) < 0.03


@pytest.mark.parametrize(
    ("spectra", "method", "named"),
    [
        (lambda: series()[:5], "joint", "at least 6 recordings"),
        (lambda: series(), "loudest", "series method"),
        (
            lambda: [*series()[:6], replace(series()[0], frequency_hz=2 * FREQUENCY)],
            "joint",
            "same lines",
        ),
        (
            lambda: [*series()[:6], replace(series()[0], density=0 * FREQUENCY)],
            "joint",
            "no vibration",
        ),
        (lambda: [replace(one, smoothing_passes=3) for one in series()], "joint", "unsmoothed"),
    ],
)
def test_what_cannot_be_separated_is_refused(spectra, method, named):
    with pytest.raises(BadInput, match=named):
        series_resonances(spectra(), band_hz=BAND, method=method)


def test_other_methods_take_each_spectrum_by_itself():
    spectra = series(averages=50.0)[:3]
    alone = series_resonances(spectra, band_hz=(2600.0, 3300.0), method="likelihood")
    assert len(alone) == 3
    assert alone[0].method == "likelihood"


def test_of_a_long_series_some_settle_what_all_share():
    truth = np.linspace(2900.0, 3750.0, 150)
    found = series_resonances(series(averages=60.0, truth=truth), band_hz=BAND)
    assert all(one.found for one in found)
    pulls = np.array([(one.crf_hz - f) / one.crf_std for one, f in zip(found, truth, strict=True)])
    assert np.mean(np.abs(pulls) < 1.645) == pytest.approx(0.9, abs=0.07)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, None),
        ({"evidence": 9.0}, "no line moves"),
        ({"misfit": 0.5}, "misfit 50 %"),
        ({"f0": 1805.0}, "edge of the band"),
        ({"damping": 0.15}, "wider than a contact's damping"),
        ({"damping": 0.2}, "half the band"),
        ({"lead": 5.0}, "a line at 2300 Hz fits as well"),
        ({"f0_std": 130.0}, "cannot be separated"),
    ],
)
def test_every_line_that_is_not_the_contacts_is_refused_with_its_reason(changes, words):
    line = JudgedLine(
        f0=2800.0, f0_std=2.0, damping=0.02, evidence=50.0, misfit=0.05, rival=2300.0, lead=40.0
    )
    said = line_objection(line._replace(**changes), BAND)
    assert said is None if words is None else words in said


def through_structures(seed, *, moved):
    """Twenty-four recordings through one structure, or through another one behind the twelfth."""
    truth = np.tile(np.linspace(2700.0, 3700.0, 12), 2)
    ways = []
    for at, height in ((3000.0, 1.5), (3350.0, -0.8)):
        passed = 1.0 + height * 2j * 0.02 / (
            1.0 - (FREQUENCY / at) ** 2 + 2j * 0.02 * FREQUENCY / at
        )
        ways.append(np.abs(passed) ** 2)
    first = series(truth=truth[:12], passed=ways[0], seed=seed)
    return [
        *first,
        *series(truth=truth[12:], passed=ways[1 if moved else 0], seed=100 + seed),
    ], truth


def test_a_moved_sensor_is_told_and_each_part_has_its_own_transfer():
    """Places twice over: what moves them there is the structure, and only the parts by themselves
    hold the truth.
    """
    spectra, truth = through_structures(1, moved=True)
    found, shared, moved = learn_series(spectra, band_hz=BAND)
    assert moved == (12,)
    errors = np.array([(one.crf_hz - f) / one.crf_std for one, f in zip(found, truth, strict=True)])
    assert np.sqrt(np.mean(errors**2)) < 1.5
    whole = separate_series(spectra, band_hz=BAND).resonances
    together = np.array(
        [(one.crf_hz - f) / one.crf_std for one, f in zip(whole, truth, strict=True)]
    )
    assert np.sqrt(np.mean(together**2)) > 2.0
    (beside,) = shared.resonances(spectra[-1:])  # what is learned is the last part's
    assert beside.crf_hz == pytest.approx(found[-1].crf_hz, abs=found[-1].crf_std)
    spectra, _ = through_structures(1, moved=False)
    assert learn_series(spectra, band_hz=BAND).moved == ()


def test_a_louder_sensor_and_modes_that_drift_have_not_moved():
    spectra, _ = through_structures(2, moved=False)
    louder = [
        replace(one, density=(2.0 if i >= 12 else 1.0) * one.density)
        for i, one in enumerate(spectra)
    ]
    assert learn_series(louder, band_hz=BAND).moved == ()
    drifting = [
        replace(one, density=np.interp(FREQUENCY / (1.0 + 1e-4 * number), FREQUENCY, one.density))
        for number, one in enumerate(spectra)
    ]
    assert learn_series(drifting, band_hz=BAND).moved == ()


def test_a_base_that_was_nil_below_a_line_comes_back():
    """The logarithm of nothing has no slope: a fit that began there stayed there, far from the
    best.
    """
    blocks = separate_series(series(), band_hz=BAND).blocks
    converged = separate(blocks).joint
    below = np.argmin(np.abs(blocks.centre - 3300.0))
    base = converged.parameters.base.copy()
    base[below - 20 : below + 20] = -60.0
    nil = converged.parameters._replace(base=base)
    stays, comes_back = (
        _fit_jointly(blocks, start, converged.step_std)
        for start in (nil, _with_positive_base(blocks, nil))
    )
    assert comes_back.cost == pytest.approx(converged.cost, abs=1.0)
    assert stays.cost > converged.cost + 100.0
