"""Contact spectroscopy: closed forms, reference libraries, and an emulator that is a formula."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import threadpool_info, threadpool_limits

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.coupling import dry_full_load, excitation, oscillator
from asperity.inference import (
    ChannelPrediction,
    ForwardModel,
    Inference,
    LogMeasurement,
    Observation,
    ObservationPoint,
    Unknown,
    infer_contact,
    infer_observations,
    inference_setting,
    with_measured_surface,
    with_observation,
)
from asperity.inference import emulator as emulator_module
from asperity.inference.estimates import information_gain, quantity_estimate, quantity_estimates
from asperity.inference.gaussian_process import GaussianProcess, fit_process
from asperity.inference.likelihood import (
    COMMON_SHARE,
    EMULATED_HEIGHT_STD,
    EXPONENT_STD,
    FORCE_LENGTH,
    GAIN_STD,
    POINT_SHARE,
    SIZES,
    log_likelihood,
)
from asperity.inference.observations import operating_points
from asperity.inference.outputs import OUTPUTS
from asperity.inference.sampling import Pool, importance, nested
from asperity.surface import MeasuredSurface
from support.emulated import CASE, formula_emulator, formula_setting

SIX_POINTS = [(load, speed) for load in (300.0, 500.0, 900.0) for speed in (0.8, 2.5)]


@pytest.fixture(scope="module")
def setting():
    return formula_setting()


@pytest.fixture(scope="module")
def emulator(setting):
    return formula_emulator(setting)


def truth(setting):
    """Return the unknowns at the centre of their priors, with a smoother surface."""
    z = np.zeros((1, len(setting.unknowns)))
    z[0, 0] = -0.4
    return z


def simulated_observations(setting, emulator, points, *, law="hertz-point", std=1e-3, seed=1):
    """Simulate the true contact at operating points, with measurement errors."""
    rng = np.random.default_rng(seed)
    forward = ForwardModel(
        setting, emulator, tuple(ObservationPoint(load, speed) for load, speed in points)
    )
    predicted = forward.predict(truth(setting), law)
    crf = np.exp(predicted.crf[0] + std * rng.standard_normal(len(points)))
    return [
        Observation(
            load_n=load,
            entrainment_m_s=speed,
            crf_hz=float(hertz),
            crf_std_hz=float(std * hertz),
            damping_ratio=float(np.exp(predicted.damping[0, number])),
            damping_std=0.001,
            name=f"{load:g}-{speed:g}",
        )
        for number, ((load, speed), hertz) in enumerate(zip(points, crf, strict=True))
    ]


@pytest.fixture(scope="module")
def one_point(setting, emulator):
    return infer_observations(
        setting, emulator, simulated_observations(setting, emulator, SIX_POINTS[2:3])
    )


@pytest.fixture(scope="module")
def six_points(setting, emulator):
    return infer_observations(
        setting, emulator, simulated_observations(setting, emulator, SIX_POINTS)
    )


# Parts
# -------------------------------------------------------------------------------------------------


def test_the_process_agrees_with_scikit_learn():
    rng = np.random.default_rng(0)
    x, at = rng.random((30, 2)), rng.random((7, 2))
    noise = rng.uniform(0.01, 0.05, 30)
    y = np.sin(5.0 * x[:, 0]) + x[:, 1] + np.sqrt(noise) * rng.standard_normal(30)
    process = fit_process(x, y, noise)
    kernel = ConstantKernel(process.level, "fixed") * Matern(process.lengths, "fixed", nu=2.5)
    reference = GaussianProcessRegressor(
        kernel + WhiteKernel(process.rough, "fixed"), alpha=noise / process._scale**2
    )
    trend = np.hstack([np.ones((30, 1)), x]) @ process._trend
    reference.fit(x, (y - trend) / process._scale)
    mean, std = reference.predict(at, return_std=True)
    own_mean, own_std = process(at)
    assert own_mean == pytest.approx(
        np.hstack([np.ones((7, 1)), at]) @ process._trend + process._scale * mean, abs=1e-5
    )
    assert own_std == pytest.approx(process._scale * std, rel=1e-4)
    assert np.array_equal(process.mean(at), own_mean)


@pytest.mark.parametrize("key", list(OUTPUTS))
def test_a_scale_inverts_and_gives_its_slope(key):
    output, value = OUTPUTS[key], np.array([1e-3, 0.02, 0.4, 0.97])
    assert output.back(output.forward(value)) == pytest.approx(value, rel=1e-9)
    by_differences = (output.forward(value * (1 + 1e-6)) - output.forward(value * (1 - 1e-6))) / (
        2e-6 * value
    )
    assert output.slope(value) == pytest.approx(by_differences, rel=1e-5)


def test_priors_have_the_stated_quantiles():
    z = norm.ppf(np.array([0.05, 0.5, 0.95]))
    span = formula_setting().unknowns[0]
    assert 1e6 * span.value(z) == pytest.approx([0.25 * 16**0.05, 1.0, 0.25 * 16**0.95], rel=1e-9)
    known = Unknown.stated("sq_m", "surface.sq", 0.8, 0.1, "um")
    assert 1e6 * known.value(z) == pytest.approx([0.8 - 0.1645, 0.8, 0.8 + 0.1645], abs=1e-4)
    wide = Unknown.stated(
        "sq_m", "surface.sq", 0.8, 0.5, "um"
    )  # a normal distribution would reach below 0
    assert 1e6 * wide.value(z) == pytest.approx(
        0.8 * np.exp(np.sqrt(np.log1p((5 / 8) ** 2)) * z), rel=1e-9
    )
    for unknown in (span, known, wide):
        assert np.all(
            (unknown.share(np.array([-9.0, 0.0, 9.0])) >= -1e-12)
            & (unknown.share(z) <= 1.0 + 1e-12)
        )


@pytest.mark.parametrize("discrepancy", [True, False])
def test_the_likelihood_is_the_multivariate_normal(discrepancy):
    """Four channels, each with its own size of the law's error; covariances written out."""
    rng = np.random.default_rng(2)
    crf, damping, crfa, log_force, capacitance = rng.standard_normal((5, 3, 4))
    stds = rng.uniform(0.1, 0.3, (4, 3, 4))
    predicted = ChannelPrediction(
        crf, stds[0], damping, stds[1], crfa, stds[2], log_force, capacitance, stds[3]
    )
    measured = [
        LogMeasurement(0.3, 0.2),
        LogMeasurement(),
        LogMeasurement(-0.1, 0.5),
        LogMeasurement(1.0, 0.1),
    ]
    points = [
        ObservationPoint(
            500.0 * 1.01**i, 1.0, crf=value, damping=value, crfa=value, capacitance=value
        )
        for i, value in enumerate(measured)
    ]
    used = [0, 2, 3]
    correlation = norm.pdf(np.subtract.outer(used, used) * np.log(1.01) / 0.03) / norm.pdf(0.0)
    sizes = SIZES if discrepancy else (0.0,)
    for row in range(3):
        force, expected = log_force[row, used], 0.0
        steep = EXPONENT_STD * discrepancy * (force - force.mean())
        common = {
            "crf": np.outer(steep, steep),
            "damping": 0.0,
            "crfa": GAIN_STD**2,
            "capacitance": 0.0,
        }
        emulator_std = {
            "crf": 0.0,
            "damping": 0.0,
            "crfa": EMULATED_HEIGHT_STD,
            "capacitance": 0.0,
        }
        for number, (channel, weight) in enumerate(
            {"crf": 1.0, "damping": 5.0, "crfa": 10.0, "capacitance": 2.0}.items()
        ):
            std = np.hypot(stds[number, row, used], emulator_std[channel])
            known = common[channel] + np.outer(std, std) * (
                COMMON_SHARE + (1.0 - COMMON_SHARE) * correlation
            )
            known = known + np.diag([measured[i].std ** 2 for i in used])
            correlated = POINT_SHARE * correlation + (1.0 - POINT_SHARE) * norm.pdf(
                np.subtract.outer(force, force) / FORCE_LENGTH
            ) / norm.pdf(0.0)
            if channel == "capacitance":
                correlated = 0.9 + 0.1 * correlation
            densities = [
                multivariate_normal(
                    getattr(predicted, channel)[row, used],
                    known + (weight * size) ** 2 * correlated,
                ).pdf([measured[i].value for i in used])
                for size in sizes
            ]
            expected += np.log(np.mean(densities))
        assert log_likelihood(predicted, points, discrepancy=discrepancy)[row] == pytest.approx(
            expected, abs=1e-8
        )


def test_importance_and_nested_sampling_find_a_known_posterior():
    """One measurement of a linear function of two unknowns: mean, variance and evidence in closed
    form.
    """
    gradient, value, noise = np.array([1.0, -2.0]), 3.0, 0.5

    def target(z):
        return -0.5 * ((z @ gradient - value) / noise) ** 2 - np.log(noise * np.sqrt(2.0 * np.pi))

    variance = gradient @ gradient + noise**2
    mean, evidence = gradient * value / variance, norm(0.0, np.sqrt(variance)).logpdf(value)
    pool = Pool(lambda z: z, lambda a, b: np.concatenate([a, b]), lambda a, rows: a[rows], 2, 0)
    for sampled in (importance(pool, target), nested(lambda z: z, target, 2, 0)):
        assert sampled.log_evidence == pytest.approx(
            evidence, abs=4.0 * sampled.log_evidence_std + 0.02
        )
        found = sampled.weights @ sampled.z
        spread = np.sqrt(sampled.weights @ (sampled.z - found) ** 2)
        assert found == pytest.approx(mean, abs=0.12)
        assert spread == pytest.approx(np.sqrt(1.0 - gradient**2 / variance), rel=0.12)
        bits = 0.5 * np.log2(variance / noise**2) + 0.5 * (
            mean @ mean + noise**2 / variance - 1.0
        ) / np.log(2.0)
        assert sampled.information_bits == pytest.approx(bits, abs=0.25)


def test_linear_algebra_of_sampling_uses_one_thread():
    """Several threads would change the order of summation and, on a busy machine, take longer."""
    threads = set()

    def target(z):
        threads.update(
            pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"
        )
        return -0.5 * z[:, 0] ** 2

    pool = Pool(lambda z: z, lambda a, b: np.concatenate([a, b]), lambda a, rows: a[rows], 1, 0)
    with threadpool_limits(2, "blas"):
        importance(pool, target)
    assert threads == {1}


def test_information_bits_match_a_narrowed_normal_and_ignore_chance():
    rng = np.random.default_rng(3)
    prior = rng.standard_normal(40_000)
    narrow = 0.3 + 0.25 * rng.standard_normal(40_000)
    bits = -np.log2(0.25) + 0.5 * (0.25**2 + 0.3**2 - 1.0) / np.log(2.0)
    assert information_gain(narrow, prior, 40_000.0) == pytest.approx(
        bits, abs=0.1
    )  # error from 20 classes
    assert information_gain(rng.standard_normal(300), prior, 300.0) < 0.03
    against = quantity_estimate(2.0 + 0.2 * rng.standard_normal(4000), prior, 4000.0, bounded=True)
    assert (against.against, quantity_estimate(prior, prior, 4000.0, bounded=True).against) == (
        "high",
        "",
    )


# Laws
# -------------------------------------------------------------------------------------------------


def test_crf_and_crfa_agree_with_the_coupling(setting, emulator):
    """Compared with the oscillator and excitation of `solve` at the emulated CLR."""
    forward = ForwardModel(
        setting, emulator, (ObservationPoint(300.0, 0.8), ObservationPoint(900.0, 2.5))
    )
    z = truth(setting)
    predicted, states = forward.predict(z, "hertz-point"), forward.states(z, ["clr", "car"])
    model = replace_choices(setting, z)
    expected = []
    for number, point in enumerate(forward.points):
        conditions = setting.case.with_overrides({"contact.load": f"{point.load_n} N"}).conditions
        state = replace(
            dry_full_load(conditions, float(setting.unknowns[0].value(z[:, 0])[0])),
            clr=float(states["clr"][0, number]),
            car=float(states["car"][0, number]),
        )
        spring = oscillator(state, conditions, model)
        at = np.array(spring.natural_frequency_hz)
        height = spring.gain(at) * excitation(state, conditions, model).density(at, 1e9)
        expected.append((float(at), spring.damping_ratio, float(height)))
    crf, damping, height = np.array(expected).T
    assert np.exp(predicted.crf[0]) == pytest.approx(crf, rel=1e-9)
    assert np.exp(predicted.damping[0]) == pytest.approx(damping, rel=1e-9)
    assert predicted.crfa[0, 1] - predicted.crfa[0, 0] == pytest.approx(
        np.log(height[1] / height[0]), abs=1e-3
    )


def replace_choices(setting, z):
    values = {
        unknown.key: float(unknown.value(z[:, i])[0]) for i, unknown in enumerate(setting.unknowns)
    }
    return setting.case.vibration.with_choices(
        mass=values["mass_kg"],
        damping_ratio=values["damping_ratio"],
        cutoff_exponent=values["cutoff_exponent"],
    )


def test_the_own_law_uses_contact_stiffness_and_damping(setting, emulator):
    forward = ForwardModel(setting, emulator, (ObservationPoint(500.0, 1.91),))
    z = truth(setting)
    state = forward.states(z, ["contact_stiffness_n_m", "contact_damping_ratio"])
    predicted = forward.predict(z, "own")
    hertz = np.sqrt(state["contact_stiffness_n_m"][0, 0] / 0.1) / (2.0 * np.pi)
    assert np.exp(predicted.crf[0, 0]) == pytest.approx(hertz, rel=1e-9)
    assert np.exp(predicted.damping[0, 0]) == pytest.approx(
        0.02 + state["contact_damping_ratio"][0, 0], rel=1e-3
    )


# Inference
# -------------------------------------------------------------------------------------------------


def test_six_operating_points_identify_sq_and_one_does_not(
    setting, emulator, one_point, six_points
):
    sq = float(setting.unknowns[0].value(truth(setting)[:, 0])[0])
    wide, narrow = one_point.posterior()["sq_m"], six_points.posterior()["sq_m"]
    assert not one_point.identifiable
    assert "one operating point gives one frequency" in one_point.reason
    assert narrow.information_bits > wide.information_bits + 0.5
    assert narrow.low < sq < narrow.high
    assert six_points.identifiable
    clr = ForwardModel(setting, emulator, six_points.forward.points[:1]).states(
        truth(setting), ["clr"]
    )["clr"][0, 0]
    posterior = six_points.posterior()["clr"]
    assert posterior.low < clr < posterior.high
    assert posterior.information_bits > 2.0
    assert six_points.verdict().startswith("CLR ")


def test_an_unobserved_quantity_keeps_its_prior(six_points):
    known = six_points.posterior()
    assert not known["oil_alpha_1_pa"].learnt
    assert known["oil_alpha_1_pa"].low == pytest.approx(14e-9 * (24 / 14) ** 0.05, rel=0.05)


def test_the_law_that_generated_the_recordings_has_the_highest_evidence(
    setting, emulator, six_points
):
    assert six_points.law_probability("hertz-point") > 0.999
    other = infer_observations(
        setting, emulator, simulated_observations(setting, emulator, SIX_POINTS, law="own")
    )
    assert other.law_probability("own") > 0.999
    assert any("contact's own stiffness" in warning for warning in other.warnings())


def test_a_wrong_law_widens_the_intervals_and_raises_a_warning(setting, emulator, six_points):
    """Frequencies that jump by 10 % from point to point, which no law predicts."""
    wrong = [
        replace(entry, crf_hz=entry.crf_hz * (1.1 if number in (1, 2, 5) else 0.9))
        for number, entry in enumerate(six_points.observations)
    ]
    found = infer_observations(setting, emulator, wrong)
    assert found.law_error > 0.05
    assert any("model error of about" in warning for warning in found.warnings())
    assert (
        found.models[0].log_evidence > found.models[1].log_evidence + 10.0
    )  # with model error against exact law
    assert (
        found.posterior()["clr"].information_bits
        < six_points.posterior()["clr"].information_bits - 0.5
    )
    ratio = [
        entry.high / entry.low
        for entry in (found.posterior()["sq_m"], six_points.posterior()["sq_m"])
    ]
    assert ratio[0] > 1.1 * ratio[1]  # both include an uncertain exponent


def test_without_a_resonance_the_contact_is_not_identified(setting, emulator):
    excluded = (
        ("a.wav", "one spectrum cannot tell"),
        ("b.wav", "too short"),
        ("c.wav", "one spectrum cannot tell"),
    )
    found = infer_observations(setting, emulator, [], excluded=excluded)
    assert found.verdict().startswith(
        "Not identified: no recording shows a contact resonance (2 of 3: one spectrum"
    )
    assert not found.identifiable
    assert all(entry.information_bits < 0.1 for entry in found.posterior().values())
    json.dumps(found.scalars(), allow_nan=False)


def test_json_has_the_documented_keys(six_points):
    summary = json.loads(json.dumps(six_points.scalars(), allow_nan=False))
    assert {"posterior", "identifiable", "reason", "next_point", "evidence", "verdict"} <= set(
        summary
    )
    assert {"clr", "sq_m", "car"} <= set(summary["posterior"])
    assert {"median", "low", "high", "information_bits"} <= set(summary["posterior"]["clr"])
    assert {"load_n", "entrainment_m_s"} <= set(summary["next_point"])
    assert [len(point["files"]) for point in summary["points"]] == [1] * 6
    assert sum(model["probability"] for model in summary["evidence"]) == pytest.approx(1.0)


def test_the_same_seed_gives_the_same_numbers(setting, emulator, one_point):
    again = infer_observations(setting, emulator, one_point.observations)
    assert again.scalars() == one_point.scalars()
    other = infer_observations(setting, emulator, one_point.observations, seed=1)
    assert other.posterior()["sq_m"] != one_point.posterior()["sq_m"]
    assert other.posterior()["sq_m"].median == pytest.approx(
        one_point.posterior()["sq_m"].median, rel=0.1
    )


def test_adding_one_recording_agrees_with_the_joint_inference(setting, emulator, six_points):
    five = infer_observations(setting, emulator, six_points.observations[:5])
    added: Inference = with_observation(five, six_points.observations[5])
    for key in ("clr", "sq_m"):
        updated, joint = added.posterior()[key], six_points.posterior()[key]
        assert [updated.low, updated.median, updated.high] == pytest.approx(
            [joint.low, joint.median, joint.high], rel=0.15
        )
    assert [model.log_evidence for model in added.models[:2]] == pytest.approx(
        [model.log_evidence for model in six_points.models[:2]], abs=0.4
    )


def test_a_capacitance_alone_gives_the_film(setting, emulator):
    """C ∝ 1/film: with an exact law the film is known like the capacitance, and CLR follows."""
    z = np.zeros((1, len(setting.unknowns)))
    point = ObservationPoint(500.0, 2.0, capacitance=LogMeasurement(0.0, 1.0))
    forward = ForwardModel(setting, emulator, (point,))
    log_capacitance = float(forward.predict(z, "hertz-point").capacitance[0, 0])
    film = float(forward.states(z, ["h_mean_m"])["h_mean_m"][0, 0])
    value = float(np.exp(log_capacitance))
    measured = Observation(
        load_n=500.0, entrainment_m_s=2.0, capacitance_f=value, capacitance_std_f=0.01 * value
    )
    found = infer_observations(setting, emulator, [measured])
    before = infer_observations(setting, emulator, [])
    (at_point,) = found.point_estimates()
    exact = np.quantile(found.exact.states["h_mean_m"][:, 1], [0.05, 0.95])
    assert exact == pytest.approx(film * np.array([0.98, 1.02]), rel=0.02)
    estimate = at_point.state["h_mean_m"]
    assert estimate.low < film < estimate.high
    prior = quantity_estimates(
        before.values(before.prior),
        before.values(before.prior),
        before.draws.effective,
        frozenset(),
    )["h_mean_m"]
    assert estimate.high / estimate.low < (prior.high / prior.low) ** 0.6
    assert found.posterior()["h_mean_m"].learnt
    assert "frequency" not in found.reason


def test_a_capacitance_narrows_what_a_resonance_leaves_open(setting, emulator, one_point):
    point = ObservationPoint(500.0, 2.0, capacitance=LogMeasurement(0.0, 1.0))
    forward = ForwardModel(setting, emulator, (point,))
    z = truth(setting)
    value = float(np.exp(forward.predict(z, "hertz-point").capacitance[0, 0]))
    measured = Observation(
        load_n=500.0, entrainment_m_s=2.0, capacitance_f=value, capacitance_std_f=0.02 * value
    )
    both = infer_observations(setting, emulator, [*one_point.observations, measured])
    narrow, wide = both.posterior()["h_mean_m"], one_point.posterior()["h_mean_m"]
    assert narrow.high / narrow.low < 0.6 * wide.high / wide.low


def test_repeats_reduce_the_deviation_no_further_than_their_scatter(setting, emulator):
    first = simulated_observations(setting, emulator, SIX_POINTS[:1])[0]
    repeats = [replace(first, crf_hz=first.crf_hz * factor) for factor in (0.98, 1.0, 1.02)]
    found = infer_observations(setting, emulator, repeats)
    point = found.forward.points[1]
    assert point.crf.std == pytest.approx(0.02 / np.sqrt(3.0), rel=0.01)
    assert point.crf.value == pytest.approx(np.log(first.crf_hz), abs=1e-3)


def test_a_shared_error_of_repeats_does_not_average_out():
    observation = Observation(
        load_n=500.0, entrainment_m_s=1.0, crf_hz=3000.0, crf_std_hz=5.0, crf_shared_std_hz=3.0
    )
    for count in (1, 4, 1000):
        assert 3000.0 * operating_points([observation] * count)[0].crf.std == pytest.approx(
            np.hypot(3.0, 4.0 / np.sqrt(count))
        )


def test_practically_equal_loads_do_not_reduce_the_model_error():
    """Five recordings that agree at practically one load are no evidence of a small model error."""
    measured = LogMeasurement(8.0, 2e-3)
    error = np.linspace(-0.4, 0.4, 2001)[:, None]

    def width(loads):
        points = [ObservationPoint(load, 1.0, crf=measured) for load in loads]
        missing, log_force = (
            np.full((len(error), len(loads)), np.nan),
            np.tile(np.log(loads), (len(error), 1)),
        )
        crf = 8.0 + error + np.zeros_like(missing)
        predicted = ChannelPrediction(
            *(crf, np.full_like(crf, 0.01), *(missing,) * 4, log_force),
            *(missing, missing),
        )
        weights = np.exp(log_likelihood(predicted, points, discrepancy=True))
        return np.sqrt(weights @ error[:, 0] ** 2 / weights.sum())

    assert width([200.0]) == pytest.approx(np.sqrt(np.mean(np.square(SIZES)) + 0.01**2), rel=0.02)
    assert width(200.0 + 1e-6 * np.arange(5)) == pytest.approx(width([200.0]), rel=1e-3)
    assert width([100.0, 150.0, 200.0, 300.0, 400.0]) < 0.5 * width(
        [200.0]
    )  # agreement at distinct loads is evidence


# Refusals
# -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"infer.sq": {"from": "1 um", "to": "0.5 um"}}, "must have an ascending range"),
        ({"infer.sq": {"from": "0.5 um", "to": "2 N"}}, "infer.sq.to must have the unit um"),
        (
            {"infer.radius": {"from": "1 mm", "to": "2 mm"}},
            "infer.radius cannot be inferred; possible are",
        ),
        (
            {"infer.correlation_length": {"from": "5 um", "to": "40 um"}},
            "which the emulator's grid resolves",
        ),
        (
            {"infer.load": {"value": "500 N", "std": "1 N"}},
            "is an operating range; give from and to",
        ),
        ({"infer.sq": {"value": "1 um", "std": "0 um"}}, "infer.surface.sq.std must be positive"),
        ({"infer.points": 3}, "infer.points must be greater than or equal to 16"),
        ({"vibration": "none"}, "vibration is missing"),
        ({"lubricant": "none"}, "the contact is dry"),
        ({"surface": {"kind": "flat"}}, "surface is flat"),
    ],
)
def test_invalid_inference_settings_are_refused(change, message):
    with pytest.raises(BadInput, match=message):
        inference_setting(load_case(CASE).with_overrides(change))


def test_an_operating_point_outside_the_emulator_is_refused(setting, emulator):
    far = Observation(
        load_n=2000.0, entrainment_m_s=1.0, crf_hz=3000.0, crf_std_hz=3.0, name="far.wav"
    )
    with pytest.raises(
        BadInput, match=r"load of far.wav must lie within 250 to 950 N.*widen infer.load"
    ):
        infer_observations(setting, emulator, [far])
    with pytest.raises(BadInput, match="needs an oil given by its data sheet"):
        infer_observations(setting, emulator, [replace(far, load_n=500.0, temperature_k=340.0)])


@pytest.mark.parametrize(
    "wrong", [{"load_n": 0.0}, {"crf_std_hz": float("nan")}, {"crf_shared_std_hz": 6.0}]
)
def test_an_invalid_observation_is_refused(wrong):
    with pytest.raises(
        BadInput, match=r"must be positive|must be at most crf_std_hz, 3 Hz, got 6 Hz"
    ):
        Observation(
            **{
                "load_n": 500.0,
                "entrainment_m_s": 1.0,
                "crf_hz": 3000.0,
                "crf_std_hz": 3.0,
                **wrong,
            }
        )


def test_a_missing_extra_is_reported_with_its_remedy(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "sklearn.gaussian_process", None)
    with pytest.raises(BadInput, match=r"pip install 'asperity\[infer\]'"):
        infer_contact([], case=load_case(CASE), emulator=tmp_path / "emulator")
    assert not (tmp_path / "emulator").exists()


def test_a_process_of_constant_data_is_constant():
    x = np.linspace(0.0, 1.0, 12)[:, None]
    process = GaussianProcess(x, np.full(12, 2.0), np.full(12, 1e-4), np.ones(1), 1.0, 1e-4)
    mean, std = process(np.array([[0.35], [0.9]]))
    assert mean == pytest.approx([2.0, 2.0], abs=1e-6)
    assert np.all(std >= 0.0)


def test_the_height_of_one_line_carries_no_information_about_the_contact(setting, emulator):
    """The gain of excitation and measurement chain is free: any CRFA leaves Sq unchanged."""
    plain = simulated_observations(setting, emulator, SIX_POINTS[2:3])[0]
    scaled = [replace(plain, crfa=height, crfa_std=0.03 * height) for height in (1e-6, 1e6)]
    low, high = (
        infer_observations(setting, emulator, [observation]).posterior()["sq_m"]
        for observation in scaled
    )
    assert [low.low, low.median, low.high] == pytest.approx(
        [high.low, high.median, high.high], rel=0.2
    )


def test_a_measured_surface_gives_the_prior_of_sq(setting, emulator, one_point):
    """The prior is the measured Sq with the scatter between places and instruments; the posterior
    narrows.
    """
    rng = np.random.default_rng(6)
    grid = Grid((64, 64), (-1e-3, -1e-3), (1e-3, 1e-3), (False, False))
    measured = MeasuredSurface(0.7e-6 * rng.standard_normal((64, 64)), grid, "ring.csv", "text")
    known, note = with_measured_surface(setting, measured)
    z = np.array([-1.0, 0.0, 1.0])
    assert 1e6 * known.contact[0].value(z) == pytest.approx(
        [0.7 - 0.022, 0.7, 0.7 + 0.022], abs=0.006
    )
    assert known.ranges == setting.ranges  # those of the emulator
    assert note.startswith("The prior of Sq is that of ring.csv, 0.7")
    informed = infer_observations(known, emulator, one_point.observations).posterior()["clr"]
    alone = one_point.posterior()["clr"]
    assert informed.high - informed.low < 0.8 * (alone.high - alone.low)
    with pytest.raises(BadInput, match=r"widen infer\.sq"):
        with_measured_surface(setting, replace(measured, heights=10.0 * measured.heights))
    with pytest.raises(BadInput, match="Sq is known in the case"):
        with_measured_surface(replace(setting, contact=setting.contact[1:]), measured)


def test_further_points_never_overwrite_a_folder(monkeypatch, tmp_path):
    """After a damaged folder is deleted, the next number follows the highest remaining one."""
    base = formula_emulator(formula_setting())
    stored = replace(base, folder=tmp_path)
    (tmp_path / "emulator.json").write_text("{}")
    monkeypatch.setattr(emulator_module, "build_emulator", lambda *_, **__: stored)
    for _ in range(3):
        emulator_module.extend_emulator(formula_setting(), stored, np.full((1, 2), 0.5))
    (tmp_path / "further" / "001" / "shares.json").unlink()
    (tmp_path / "further" / "001").rmdir()
    emulator_module.extend_emulator(formula_setting(), stored, np.full((1, 2), 0.25))
    kept = {
        path.parent.name: path.read_text() for path in (tmp_path / "further").glob("*/shares.json")
    }
    assert [*sorted(kept)] == ["000", "002", "003"]
    assert "0.5" in kept["002"]
