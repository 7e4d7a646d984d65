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
    """Transfer of the structure: two modes, one of them in the contact's range, and a sloping
    floor.
    """
    f = np.maximum(FREQUENCY, 1.0)
    modes = sum(
        height * (f / f0) ** 4 / ((1 - (f / f0) ** 2) ** 2 + (2 * z * f / f0) ** 2) * 4 * z**2
        for f0, z, height in ((2300.0, 0.01, 1.0), (3400.0, 0.006, 0.8))
    )
    return 0.1 * (f / 2000.0) ** -0.7 + modes


def series(contact_height=0.7, *, averages=100.0, seed=0, truth=TRUTH, damping=0.02, gain=1.0):
    rng = np.random.default_rng(seed)
    gains = np.exp(0.2 * rng.standard_normal(truth.size))
    densities = [
        g * machine() + gain * contact_height * line_shape(FREQUENCY, f, damping)
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


def test_a_moving_line_is_separated_from_equally_high_fixed_modes():
    resonances = series_resonances(series(), band_hz=BAND)
    assert all(resonance.found for resonance in resonances)
    errors = np.array([resonance.crf_hz for resonance in resonances]) - TRUTH
    assert np.max(np.abs(errors)) < 3.0
    assert [resonance.crfa for resonance in resonances] == pytest.approx(
        np.full(TRUTH.size, 0.7), rel=0.1
    )
    by_peak = series_resonances(series(), band_hz=BAND, method="peak")
    assert (
        np.mean(
            [abs(resonance.crf_hz - f) > 100.0 for resonance, f in zip(by_peak, TRUTH, strict=True)]
        )
        > 0.5
    )


def test_a_further_recording_is_judged_with_the_fitted_series():
    """Agrees with the joint fit within its deviations; a spectrum without a line yields none."""
    truth = 3300.0 + 300.0 * np.random.default_rng(5).standard_normal(36).clip(-1.3, 1.3)
    spectra = series(truth=truth, seed=5)
    joint = series_resonances(spectra, band_hz=BAND)
    first, shared, moved = learn_series(spectra[:24], band_hz=BAND)
    assert moved == ()
    assert [resonance.crf_hz for resonance in first] == [
        resonance.crf_hz for resonance in series_resonances(spectra[:24], band_hz=BAND)
    ]
    further = shared.resonances(spectra[24:])
    differences = [
        (resonance.crf_hz - joint_resonance.crf_hz) / joint_resonance.crf_std
        for resonance, joint_resonance in zip(further, joint[24:], strict=True)
    ]
    assert np.max(np.abs(differences)) < 1.0
    errors = [
        (resonance.crf_hz - f) / resonance.crf_std
        for resonance, f in zip(further, truth[24:], strict=True)
    ]
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.6
    assert [resonance.crf_std for resonance in further] == pytest.approx(
        [resonance.crf_std for resonance in joint[24:]], rel=0.3
    )
    (without_line,) = shared.resonances(series(0.0, truth=truth[:1], seed=6))
    assert not without_line.found
    with pytest.raises(BadInput, match="not belong to this series"):
        shared.resonances([replace(spectra[0], frequency_hz=2.0 * FREQUENCY)])


def test_the_fit_scatters_as_its_deviations_state():
    errors = []
    for seed in range(5):
        for resonance, f in zip(
            series_resonances(series(seed=seed), band_hz=BAND), TRUTH, strict=True
        ):
            errors.append(
                [
                    (resonance.crf_hz - f) / resonance.crf_std,
                    (resonance.crfa - 0.7) / resonance.crfa_std,
                ]
            )
    assert np.mean(np.abs(errors) < 1.645, axis=0) == pytest.approx(
        0.9, abs=0.08
    )  # two sigma of 60


@pytest.fixture
def fit_of_seven():
    """Seven blocks of random spectra, and parameters that do not match them."""
    rng = np.random.default_rng(4)
    centre = np.linspace(2000.0, 4000.0, 50)
    blocks = SpectrumBlocks(centre, rng.gamma(5.0, 0.2, (7, 50)), np.full((7, 50), 30.0))
    lines = np.column_stack(
        [
            rng.normal(0, 1, 7),
            np.log(rng.uniform(2500, 3500, 7)),
            rng.normal(-4, 0.3, 7),
            rng.normal(0, 1, 7),
        ]
    )
    transfer = unit_transfer(1900.0, 4100.0)
    transfer = transfer._replace(coefficients=rng.normal(0.0, 0.3, transfer.coefficients.size))
    return blocks, ModelParameters(lines, rng.normal(0.0, 0.5, 50), transfer)


def test_the_score_is_the_gradient_of_the_cost(fit_of_seven):
    blocks, parameters = fit_of_seven
    lines, transfer = parameters.own, parameters.transfer
    point, d = (
        joint_scoring_point(blocks, parameters, np.zeros((transfer.coefficients.size,) * 2)),
        1e-6,
    )
    for row, column in ((0, 0), (3, 1), (5, 2), (6, 3)):
        shift = np.zeros_like(lines)
        shift[row, column] = d
        up, down = (
            np.sum(recording_costs(blocks, parameters._replace(own=lines + side * shift)))
            for side in (1.0, -1.0)
        )
        slope = (up - down) / (2 * d)
        assert point.own_score[row, column] == pytest.approx(-slope, rel=1e-4, abs=1e-3)
    shift = np.zeros(50)
    shift[20] = d
    up, down = (
        np.sum(recording_costs(blocks, parameters._replace(base=parameters.base + side * shift)))
        for side in (1.0, -1.0)
    )
    assert point.base_score[20] == pytest.approx(-(up - down) / (2 * d), rel=1e-4, abs=1e-3)
    for number in (0, 7, 30):
        shift = np.zeros(transfer.coefficients.size)
        shift[number] = d
        ends = [
            transfer._replace(coefficients=transfer.coefficients + side * shift)
            for side in (1.0, -1.0)
        ]
        up, down = (
            np.sum(recording_costs(blocks, parameters._replace(transfer=end))) for end in ends
        )
        assert point.transfer_score[number] == pytest.approx(
            -(up - down) / (2 * d), rel=1e-4, abs=1e-3
        )


def test_lines_with_a_fixed_transfer_equal_those_of_the_full_fit(fit_of_seven):
    """The transfer's effect on a line, summed over blocks, equals that block by block."""
    blocks, parameters = fit_of_seven
    joint = joint_scoring_point(
        blocks, parameters, np.zeros((parameters.transfer.coefficients.size,) * 2)
    )
    lines = line_scoring_point(blocks, parameters)
    np.testing.assert_array_equal(lines.score, joint.own_score)
    np.testing.assert_array_equal(lines.information, joint.own_information)
    np.testing.assert_allclose(
        lines.transfer_coupling(blocks.centre, parameters),
        joint.transfer_own,
        rtol=1e-12,
        atol=1e-9,
    )
    np.testing.assert_array_equal(
        line_densities(blocks.centre, parameters),
        line_densities_and_slopes(blocks.centre, parameters)[0],
    )
    level, f0, damping = (np.exp(parameters.own[:, column, None]) for column in range(3))
    transfer = np.exp(
        relative_columns(blocks.centre, parameters) @ parameters.transfer.coefficients
    )
    density = level * transfer * line_shape(blocks.centre, f0, damping)
    np.testing.assert_allclose(line_densities(blocks.centre, parameters), density, rtol=1e-12)


def test_a_line_distorted_by_a_structure_is_covered_by_its_interval():
    """A frequency-dependent transfer shifts the line equally in all recordings."""
    mode = 1.0 + 0.8 * 0.03j / (1.0 - (FREQUENCY / 3150.0) ** 2 + 0.03j * FREQUENCY / 3150.0)
    errors = []
    for seed in range(3):
        truth = TRUTH + 20.0 * np.random.default_rng(seed).standard_normal(TRUTH.size)
        spectra = series(truth=truth, seed=seed, gain=np.abs(mode) ** 2)
        for resonance, f in zip(series_resonances(spectra, band_hz=BAND), truth, strict=True):
            errors.append((resonance.crf_hz - f) / resonance.crf_std)
    assert 0.85 <= np.mean(np.abs(errors) < 1.645) <= 1.0


def test_a_recording_without_contact_is_reported_as_such():
    spectra = series()
    without_contact = series(contact_height=1e-12, seed=5)[4]
    resonances = series_resonances([*spectra[:4], without_contact, *spectra[5:]], band_hz=BAND)
    assert [resonance.found for resonance in resonances] == [True] * 4 + [False] + [True] * 7
    assert "no line moves" in resonances[4].reason
    assert np.isnan(resonances[4].crf_hz)


def test_without_a_moving_line_nothing_is_found():
    resonances = series_resonances(series(contact_height=1e-12), band_hz=BAND)
    assert not any(resonance.found for resonance in resonances)


def test_a_fixed_line_is_detected_by_its_varying_share_without_exact_height():
    detected = [
        resonance
        for resonance in series_resonances(series(truth=np.full(12, 3100.0)), band_hz=BAND)
        if resonance.found
    ]
    assert detected
    for resonance in detected:
        assert abs(resonance.crf_hz - 3100.0) < 4.0 * resonance.crf_std
        assert resonance.crfa < 0.7
        assert np.isnan(resonance.crfa_std)
        assert "lower bound" in resonance.reason


def test_masked_lines_are_ignored():
    spectra = series()
    masks = [np.ones(FREQUENCY.size, dtype=bool) for _ in spectra]
    disturbed = []
    for number, (spectrum, mask) in enumerate(zip(spectra, masks, strict=True)):
        index = 2600 + 17 * number
        density = spectrum.density.copy()
        density[index - 1 : index + 2] *= 1e4
        mask[index - 1 : index + 2] = False
        disturbed.append(replace(spectrum, density=density))
    clean = series_resonances(spectra, band_hz=BAND)
    masked = series_resonances(disturbed, band_hz=BAND, kept=masks)
    assert [resonance.crf_hz for resonance in masked] == pytest.approx(
        [resonance.crf_hz for resonance in clean], abs=0.5
    )


def test_the_fitted_curve_equals_the_spectrum():
    spectra = series(averages=1e4)
    in_band = (FREQUENCY > 1900) & (FREQUENCY < 3900)
    for spectrum, resonance in zip(spectra, series_resonances(spectra, band_hz=BAND), strict=True):
        error = resonance.curve(FREQUENCY[in_band]) / spectrum.density[in_band] - 1.0
        assert np.sqrt(np.mean(error**2)) < 0.03


@pytest.mark.parametrize(
    ("spectra", "method", "message"),
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
        (
            lambda: [replace(spectrum, smoothing_passes=3) for spectrum in series()],
            "joint",
            "unsmoothed",
        ),
    ],
)
def test_spectra_that_cannot_be_separated_are_refused(spectra, method, message):
    with pytest.raises(BadInput, match=message):
        series_resonances(spectra(), band_hz=BAND, method=method)


def test_other_methods_take_each_spectrum_alone():
    spectra = series(averages=50.0)[:3]
    resonances = series_resonances(spectra, band_hz=(2600.0, 3300.0), method="likelihood")
    assert len(resonances) == 3
    assert resonances[0].method == "likelihood"


def test_a_subset_of_a_long_series_determines_the_common_transfer():
    truth = np.linspace(2900.0, 3750.0, 150)
    resonances = series_resonances(series(averages=60.0, truth=truth), band_hz=BAND)
    assert all(resonance.found for resonance in resonances)
    errors = np.array(
        [
            (resonance.crf_hz - f) / resonance.crf_std
            for resonance, f in zip(resonances, truth, strict=True)
        ]
    )
    assert np.mean(np.abs(errors) < 1.645) == pytest.approx(0.9, abs=0.07)


@pytest.mark.parametrize(
    ("changes", "message"),
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
def test_other_lines_are_refused_with_their_reason(changes, message):
    line = JudgedLine(
        f0=2800.0, f0_std=2.0, damping=0.02, evidence=50.0, misfit=0.05, rival=2300.0, lead=40.0
    )
    objection = line_objection(line._replace(**changes), BAND)
    assert objection is None if message is None else message in objection


def through_structures(seed, *, moved):
    """Twenty-four recordings through one structure, or through another after the twelfth."""
    truth = np.tile(np.linspace(2700.0, 3700.0, 12), 2)
    gains = []
    for frequency, height in ((3000.0, 1.5), (3350.0, -0.8)):
        response = 1.0 + height * 2j * 0.02 / (
            1.0 - (FREQUENCY / frequency) ** 2 + 2j * 0.02 * FREQUENCY / frequency
        )
        gains.append(np.abs(response) ** 2)
    first = series(truth=truth[:12], gain=gains[0], seed=seed)
    return [
        *first,
        *series(truth=truth[12:], gain=gains[1 if moved else 0], seed=100 + seed),
    ], truth


def test_a_moved_sensor_is_reported_and_each_part_has_its_transfer():
    """The structure shifts the lines; only separate fits of both parts recover the truth."""
    spectra, truth = through_structures(1, moved=True)
    resonances, shared, moved = learn_series(spectra, band_hz=BAND)
    assert moved == (12,)
    errors = np.array(
        [
            (resonance.crf_hz - f) / resonance.crf_std
            for resonance, f in zip(resonances, truth, strict=True)
        ]
    )
    assert np.sqrt(np.mean(errors**2)) < 1.5
    unsplit = separate_series(spectra, band_hz=BAND).resonances
    unsplit_errors = np.array(
        [
            (resonance.crf_hz - f) / resonance.crf_std
            for resonance, f in zip(unsplit, truth, strict=True)
        ]
    )
    assert np.sqrt(np.mean(unsplit_errors**2)) > 2.0
    (further,) = shared.resonances(spectra[-1:])  # uses the transfer of the last part
    assert further.crf_hz == pytest.approx(resonances[-1].crf_hz, abs=resonances[-1].crf_std)
    spectra, _ = through_structures(1, moved=False)
    assert learn_series(spectra, band_hz=BAND).moved == ()


def test_a_louder_sensor_and_drifting_modes_are_not_reported_as_moved():
    spectra, _ = through_structures(2, moved=False)
    with_gain = [
        replace(spectrum, density=(2.0 if i >= 12 else 1.0) * spectrum.density)
        for i, spectrum in enumerate(spectra)
    ]
    assert learn_series(with_gain, band_hz=BAND).moved == ()
    drifting = [
        replace(
            spectrum,
            density=np.interp(FREQUENCY / (1.0 + 1e-4 * number), FREQUENCY, spectrum.density),
        )
        for number, spectrum in enumerate(spectra)
    ]
    assert learn_series(drifting, band_hz=BAND).moved == ()


def test_a_zero_base_below_a_line_recovers():
    """The logarithm of zero has no slope, so a fit started there did not leave it."""
    blocks = separate_series(series(), band_hz=BAND).blocks
    converged = separate(blocks).joint
    cell = np.argmin(np.abs(blocks.centre - 3300.0))
    base = converged.parameters.base.copy()
    base[cell - 20 : cell + 20] = -60.0
    zero_base = converged.parameters._replace(base=base)
    uncorrected, corrected = (
        _fit_jointly(blocks, start, converged.step_std)
        for start in (zero_base, _with_positive_base(blocks, zero_base))
    )
    assert corrected.cost == pytest.approx(converged.cost, abs=1.0)
    assert uncorrected.cost > converged.cost + 100.0
