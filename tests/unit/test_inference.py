"""Contact spectroscopy: against closed forms, libraries, and a contact whose emulator is a
formula.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

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
from asperity.inference.estimates import information_gain, quantity_estimate
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

SIX = [(load, speed) for load in (300.0, 500.0, 900.0) for speed in (0.8, 2.5)]


@pytest.fixture(scope="module")
def setting():
    return formula_setting()


@pytest.fixture(scope="module")
def emulator(setting):
    return formula_emulator(setting)


def truth(setting):
    """Unknowns in the middle of their priors, but for a smoother surface."""
    z = np.zeros((1, len(setting.unknowns)))
    z[0, 0] = -0.4
    return z


def heard(setting, emulator, points, *, law="hertz-point", std=1e-3, seed=1):
    """What the true contact shows at operating points, with errors of measurement."""
    rng = np.random.default_rng(seed)
    forward = ForwardModel(
        setting, emulator, tuple(ObservationPoint(load, speed) for load, speed in points)
    )
    shown = forward.predict(truth(setting), law)
    crf = np.exp(shown.crf[0] + std * rng.standard_normal(len(points)))
    return [
        Observation(
            load_n=load,
            entrainment_m_s=speed,
            crf_hz=float(hertz),
            crf_std_hz=float(std * hertz),
            damping_ratio=float(np.exp(shown.damping[0, number])),
            damping_std=0.001,
            name=f"{load:g}-{speed:g}",
        )
        for number, ((load, speed), hertz) in enumerate(zip(points, crf, strict=True))
    ]


@pytest.fixture(scope="module")
def of_one(setting, emulator):
    return infer_observations(setting, emulator, heard(setting, emulator, SIX[2:3]))


@pytest.fixture(scope="module")
def of_six(setting, emulator):
    return infer_observations(setting, emulator, heard(setting, emulator, SIX))


# Parts
# -------------------------------------------------------------------------------------------------


def test_a_process_says_what_scikit_learn_says():
    rng = np.random.default_rng(0)
    x, at = rng.random((30, 2)), rng.random((7, 2))
    noise = rng.uniform(0.01, 0.05, 30)
    y = np.sin(5.0 * x[:, 0]) + x[:, 1] + np.sqrt(noise) * rng.standard_normal(30)
    process = fit_process(x, y, noise)
    kernel = ConstantKernel(process.level, "fixed") * Matern(process.lengths, "fixed", nu=2.5)
    twin = GaussianProcessRegressor(
        kernel + WhiteKernel(process.rough, "fixed"), alpha=noise / process._scale**2
    )
    trend = np.hstack([np.ones((30, 1)), x]) @ process._trend
    twin.fit(x, (y - trend) / process._scale)
    mean, std = twin.predict(at, return_std=True)
    ours, deviation = process(at)
    assert ours == pytest.approx(
        np.hstack([np.ones((7, 1)), at]) @ process._trend + process._scale * mean, abs=1e-5
    )
    assert deviation == pytest.approx(process._scale * std, rel=1e-4)
    assert np.array_equal(process.mean(at), ours)


@pytest.mark.parametrize("key", list(OUTPUTS))
def test_a_scale_goes_both_ways_and_knows_its_slope(key):
    output, value = OUTPUTS[key], np.array([1e-3, 0.02, 0.4, 0.97])
    assert output.back(output.forward(value)) == pytest.approx(value, rel=1e-9)
    by_differences = (output.forward(value * (1 + 1e-6)) - output.forward(value * (1 - 1e-6))) / (
        2e-6 * value
    )
    assert output.slope(value) == pytest.approx(by_differences, rel=1e-5)


def test_priors_have_the_quantiles_that_are_stated():
    z = norm.ppf(np.array([0.05, 0.5, 0.95]))
    span = formula_setting().unknowns[0]
    assert 1e6 * span.value(z) == pytest.approx([0.25 * 16**0.05, 1.0, 0.25 * 16**0.95], rel=1e-9)
    known = Unknown.stated("sq_m", "surface.sq", 0.8, 0.1, "um")
    assert 1e6 * known.value(z) == pytest.approx([0.8 - 0.1645, 0.8, 0.8 + 0.1645], abs=1e-4)
    wide = Unknown.stated("sq_m", "surface.sq", 0.8, 0.5, "um")  # normal, it would reach below 0
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
    """Of three channels, each with a size of the law's error of its own, covariances written
    out.
    """
    rng = np.random.default_rng(2)
    crf, damping, crfa, log_force = rng.standard_normal((4, 3, 4))
    stds = rng.uniform(0.1, 0.3, (3, 3, 4))
    shown = ChannelPrediction(crf, stds[0], damping, stds[1], crfa, stds[2], log_force)
    said = [
        LogMeasurement(0.3, 0.2),
        LogMeasurement(),
        LogMeasurement(-0.1, 0.5),
        LogMeasurement(1.0, 0.1),
    ]
    points = [
        ObservationPoint(500.0 * 1.01**i, 1.0, crf=one, damping=one, crfa=one)
        for i, one in enumerate(said)
    ]
    here = [0, 2, 3]
    near = norm.pdf(np.subtract.outer(here, here) * np.log(1.01) / 0.03) / norm.pdf(0.0)
    sizes = SIZES if discrepancy else (0.0,)
    for row in range(3):
        force, expected = log_force[row, here], 0.0
        steep = EXPONENT_STD * discrepancy * (force - force.mean())
        common = {"crf": np.outer(steep, steep), "damping": 0.0, "crfa": GAIN_STD**2}
        beyond = {"crf": 0.0, "damping": 0.0, "crfa": EMULATED_HEIGHT_STD}
        for number, (channel, weight) in enumerate(
            {"crf": 1.0, "damping": 5.0, "crfa": 10.0}.items()
        ):
            std = np.hypot(stds[number, row, here], beyond[channel])
            known = common[channel] + np.outer(std, std) * (
                COMMON_SHARE + (1.0 - COMMON_SHARE) * near
            )
            known = known + np.diag([said[i].std ** 2 for i in here])
            alike = POINT_SHARE * near + (1.0 - POINT_SHARE) * norm.pdf(
                np.subtract.outer(force, force) / FORCE_LENGTH
            ) / norm.pdf(0.0)
            densities = [
                multivariate_normal(
                    getattr(shown, channel)[row, here], known + (weight * size) ** 2 * alike
                ).pdf([said[i].value for i in here])
                for size in sizes
            ]
            expected += np.log(np.mean(densities))
        assert log_likelihood(shown, points, discrepancy=discrepancy)[row] == pytest.approx(
            expected, abs=1e-8
        )


def test_importance_and_nested_sampling_find_a_known_posterior():
    """A line of two unknowns heard once: mean, variance and evidence in closed form."""
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
        told = 0.5 * np.log2(variance / noise**2) + 0.5 * (
            mean @ mean + noise**2 / variance - 1.0
        ) / np.log(2.0)
        assert sampled.information_bits == pytest.approx(told, abs=0.25)


def test_bits_are_those_of_a_narrowed_normal_and_nothing_of_chance():
    rng = np.random.default_rng(3)
    prior = rng.standard_normal(40_000)
    narrow = 0.3 + 0.25 * rng.standard_normal(40_000)
    told = -np.log2(0.25) + 0.5 * (0.25**2 + 0.3**2 - 1.0) / np.log(2.0)
    assert information_gain(narrow, prior, 40_000.0) == pytest.approx(
        told, abs=0.1
    )  # of 20 classes
    assert information_gain(rng.standard_normal(300), prior, 300.0) < 0.03
    against = quantity_estimate(2.0 + 0.2 * rng.standard_normal(4000), prior, 4000.0, bounded=True)
    assert (against.against, quantity_estimate(prior, prior, 4000.0, bounded=True).against) == (
        "high",
        "",
    )


# Laws
# -------------------------------------------------------------------------------------------------


def test_crf_and_crfa_are_those_of_the_coupling(setting, emulator):
    """The oscillator and its excitation as `solve` makes them, at the load share that is
    emulated.
    """
    forward = ForwardModel(
        setting, emulator, (ObservationPoint(300.0, 0.8), ObservationPoint(900.0, 2.5))
    )
    z = truth(setting)
    shown, states = forward.predict(z, "hertz-point"), forward.states(z, ["clr", "car"])
    model = replace_choices(setting, z)
    expected = []
    for place, point in enumerate(forward.points):
        conditions = setting.case.with_overrides({"contact.load": f"{point.load_n} N"}).conditions
        state = replace(
            dry_full_load(conditions, float(setting.unknowns[0].value(z[:, 0])[0])),
            clr=float(states["clr"][0, place]),
            car=float(states["car"][0, place]),
        )
        spring = oscillator(state, conditions, model)
        at = np.array(spring.natural_frequency_hz)
        height = spring.gain(at) * excitation(state, conditions, model).density(at, 1e9)
        expected.append((float(at), spring.damping_ratio, float(height)))
    crf, damping, height = np.array(expected).T
    assert np.exp(shown.crf[0]) == pytest.approx(crf, rel=1e-9)
    assert np.exp(shown.damping[0]) == pytest.approx(damping, rel=1e-9)
    assert shown.crfa[0, 1] - shown.crfa[0, 0] == pytest.approx(
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


def test_the_own_law_hears_stiffness_and_damping(setting, emulator):
    forward = ForwardModel(setting, emulator, (ObservationPoint(500.0, 1.91),))
    z = truth(setting)
    state = forward.states(z, ["contact_stiffness_n_m", "contact_damping_ratio"])
    shown = forward.predict(z, "own")
    hertz = np.sqrt(state["contact_stiffness_n_m"][0, 0] / 0.1) / (2.0 * np.pi)
    assert np.exp(shown.crf[0, 0]) == pytest.approx(hertz, rel=1e-9)
    assert np.exp(shown.damping[0, 0]) == pytest.approx(
        0.02 + state["contact_damping_ratio"][0, 0], rel=1e-3
    )


# Inference
# -------------------------------------------------------------------------------------------------


def test_one_operating_point_leaves_sq_open_and_six_do_not(setting, emulator, of_one, of_six):
    sq = float(setting.unknowns[0].value(truth(setting)[:, 0])[0])
    wide, narrow = of_one.posterior()["sq_m"], of_six.posterior()["sq_m"]
    assert not of_one.identifiable
    assert "one operating point gives one frequency" in of_one.reason
    assert narrow.information_bits > wide.information_bits + 0.5
    assert narrow.low < sq < narrow.high
    assert of_six.identifiable
    clr = ForwardModel(setting, emulator, of_six.forward.points[:1]).states(
        truth(setting), ["clr"]
    )["clr"][0, 0]
    told = of_six.posterior()["clr"]
    assert told.low < clr < told.high
    assert told.information_bits > 2.0
    assert of_six.verdict().startswith("CLR ")


def test_what_recordings_do_not_touch_is_as_assumed(of_six):
    known = of_six.posterior()
    assert not known["oil_alpha_1_pa"].learnt
    assert known["oil_alpha_1_pa"].low == pytest.approx(14e-9 * (24 / 14) ** 0.05, rel=0.05)


def test_the_law_that_made_the_recordings_has_the_evidence(setting, emulator, of_six):
    assert of_six.law_probability("hertz-point") > 0.999
    other = infer_observations(setting, emulator, heard(setting, emulator, SIX, law="own"))
    assert other.law_probability("own") > 0.999
    assert any("contact's own stiffness" in warning for warning in other.warnings())


def test_a_wrong_law_widens_the_intervals_and_is_said(setting, emulator, of_six):
    """Frequencies that jump by 10 % from point to point: no law does that."""
    wrong = [
        replace(one, crf_hz=one.crf_hz * (1.1 if number in (1, 2, 5) else 0.9))
        for number, one in enumerate(of_six.observations)
    ]
    found = infer_observations(setting, emulator, wrong)
    assert found.law_error > 0.05
    assert any("model error of about" in warning for warning in found.warnings())
    assert (
        found.models[0].log_evidence > found.models[1].log_evidence + 10.0
    )  # with the error against exact
    assert (
        found.posterior()["clr"].information_bits < of_six.posterior()["clr"].information_bits - 0.5
    )
    ratio = [one.high / one.low for one in (found.posterior()["sq_m"], of_six.posterior()["sq_m"])]
    assert ratio[0] > 1.1 * ratio[1]  # both allow for an exponent that is off


def test_nothing_heard_cannot_be_told(setting, emulator):
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
    assert all(one.information_bits < 0.1 for one in found.posterior().values())
    json.dumps(found.scalars(), allow_nan=False)


def test_json_has_the_contract(of_six):
    said = json.loads(json.dumps(of_six.scalars(), allow_nan=False))
    assert {"posterior", "identifiable", "reason", "next_point", "evidence", "verdict"} <= set(said)
    assert {"clr", "sq_m", "car"} <= set(said["posterior"])
    assert {"median", "low", "high", "information_bits"} <= set(said["posterior"]["clr"])
    assert {"load_n", "entrainment_m_s"} <= set(said["next_point"])
    assert [len(point["files"]) for point in said["points"]] == [1] * 6
    assert sum(model["probability"] for model in said["evidence"]) == pytest.approx(1.0)


def test_the_same_seed_gives_the_same_numbers(setting, emulator, of_one):
    again = infer_observations(setting, emulator, of_one.observations)
    assert again.scalars() == of_one.scalars()
    other = infer_observations(setting, emulator, of_one.observations, seed=1)
    assert other.posterior()["sq_m"] != of_one.posterior()["sq_m"]
    assert other.posterior()["sq_m"].median == pytest.approx(
        of_one.posterior()["sq_m"].median, rel=0.1
    )


def test_one_recording_more_is_what_all_together_are(setting, emulator, of_six):
    five = infer_observations(setting, emulator, of_six.observations[:5])
    added: Inference = with_observation(five, of_six.observations[5])
    for key in ("clr", "sq_m"):
        ours, whole = added.posterior()[key], of_six.posterior()[key]
        assert [ours.low, ours.median, ours.high] == pytest.approx(
            [whole.low, whole.median, whole.high], rel=0.15
        )
    assert [model.log_evidence for model in added.models[:2]] == pytest.approx(
        [model.log_evidence for model in of_six.models[:2]], abs=0.4
    )


def test_repeats_are_surer_together_and_no_surer_than_their_scatter(setting, emulator):
    one = heard(setting, emulator, SIX[:1])[0]
    repeats = [replace(one, crf_hz=one.crf_hz * factor) for factor in (0.98, 1.0, 1.02)]
    found = infer_observations(setting, emulator, repeats)
    point = found.forward.points[1]
    assert point.crf.std == pytest.approx(0.02 / np.sqrt(3.0), rel=0.01)
    assert point.crf.value == pytest.approx(np.log(one.crf_hz), abs=1e-3)


def test_what_repeats_have_in_common_does_not_average_away():
    one = Observation(
        load_n=500.0, entrainment_m_s=1.0, crf_hz=3000.0, crf_std_hz=5.0, crf_shared_std_hz=3.0
    )
    for count in (1, 4, 1000):
        assert 3000.0 * operating_points([one] * count)[0].crf.std == pytest.approx(
            np.hypot(3.0, 4.0 / np.sqrt(count))
        )


def test_loads_that_differ_in_the_last_digit_make_no_law_surer():
    """Five recordings that agree at what is as good as one place do not speak for a small error."""
    said = LogMeasurement(8.0, 2e-3)
    off = np.linspace(-0.4, 0.4, 2001)[:, None]

    def width(loads):
        points = [ObservationPoint(load, 1.0, crf=said) for load in loads]
        nothing, log_force = (
            np.full((len(off), len(loads)), np.nan),
            np.tile(np.log(loads), (len(off), 1)),
        )
        crf = 8.0 + off + np.zeros_like(nothing)
        shown = ChannelPrediction(
            crf, np.full_like(crf, 0.01), nothing, nothing, nothing, nothing, log_force
        )
        weights = np.exp(log_likelihood(shown, points, discrepancy=True))
        return np.sqrt(weights @ off[:, 0] ** 2 / weights.sum())

    assert width([200.0]) == pytest.approx(np.sqrt(np.mean(np.square(SIZES)) + 0.01**2), rel=0.02)
    assert width(200.0 + 1e-6 * np.arange(5)) == pytest.approx(width([200.0]), rel=1e-3)
    assert width([100.0, 150.0, 200.0, 300.0, 400.0]) < 0.5 * width(
        [200.0]
    )  # there agreement tells


# What is refused
# -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "said"),
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
def test_what_cannot_be_inferred_is_refused(change, said):
    with pytest.raises(BadInput, match=said):
        inference_setting(load_case(CASE).with_overrides(change))


def test_an_operating_point_beyond_the_emulator_is_refused(setting, emulator):
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
def test_an_observation_that_is_none_is_refused(wrong):
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


def test_a_missing_extra_is_said_with_its_remedy(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "sklearn.gaussian_process", None)
    with pytest.raises(BadInput, match=r"pip install 'asperity\[infer\]'"):
        infer_contact([], case=load_case(CASE), emulator=tmp_path / "emulator")
    assert not (tmp_path / "emulator").exists()


def test_a_process_of_no_slope_is_flat():
    x = np.linspace(0.0, 1.0, 12)[:, None]
    process = GaussianProcess(x, np.full(12, 2.0), np.full(12, 1e-4), np.ones(1), 1.0, 1e-4)
    mean, std = process(np.array([[0.35], [0.9]]))
    assert mean == pytest.approx([2.0, 2.0], abs=1e-6)
    assert np.all(std >= 0.0)


def test_the_height_of_one_line_says_nothing_of_the_contact(setting, emulator):
    """The gain of what excites and hears it is free: any CRFA at all leaves Sq and damping where
    they are.
    """
    plain = heard(setting, emulator, SIX[2:3])[0]
    loud = [replace(plain, crfa=height, crfa_std=0.03 * height) for height in (1e-6, 1e6)]
    quiet, noisy = (
        infer_observations(setting, emulator, [one]).posterior()["sq_m"] for one in loud
    )
    assert [quiet.low, quiet.median, quiet.high] == pytest.approx(
        [noisy.low, noisy.median, noisy.high], rel=0.2
    )


def test_a_measured_surface_is_what_is_known_of_sq(setting, emulator, of_one):
    """Its Sq, with what places and instruments differ by; recordings are then told from a narrower
    prior.
    """
    rng = np.random.default_rng(6)
    grid = Grid((64, 64), (-1e-3, -1e-3), (1e-3, 1e-3), (False, False))
    measured = MeasuredSurface(0.7e-6 * rng.standard_normal((64, 64)), grid, "ring.csv", "text")
    known, said = with_measured_surface(setting, measured)
    z = np.array([-1.0, 0.0, 1.0])
    assert 1e6 * known.contact[0].value(z) == pytest.approx(
        [0.7 - 0.022, 0.7, 0.7 + 0.022], abs=0.006
    )
    assert known.ranges == setting.ranges  # the emulator's own
    assert said.startswith("The prior of Sq is that of ring.csv, 0.7")
    told = infer_observations(known, emulator, of_one.observations).posterior()["clr"]
    alone = of_one.posterior()["clr"]
    assert told.high - told.low < 0.8 * (alone.high - alone.low)
    with pytest.raises(BadInput, match=r"widen infer\.sq"):
        with_measured_surface(setting, replace(measured, heights=10.0 * measured.heights))
    with pytest.raises(BadInput, match="Sq is known in the case"):
        with_measured_surface(replace(setting, contact=setting.contact[1:]), measured)


def test_further_points_never_take_a_folder_that_is_there(monkeypatch, tmp_path):
    """A damaged one is deleted, as its error says, and the next stands behind those that are
    left.
    """
    base = formula_emulator(formula_setting())
    held = replace(base, folder=tmp_path)
    (tmp_path / "emulator.json").write_text("{}")
    monkeypatch.setattr(emulator_module, "build_emulator", lambda *_, **__: held)
    for _ in range(3):
        emulator_module.extend_emulator(formula_setting(), held, np.full((1, 2), 0.5))
    (tmp_path / "further" / "001" / "shares.json").unlink()
    (tmp_path / "further" / "001").rmdir()
    emulator_module.extend_emulator(formula_setting(), held, np.full((1, 2), 0.25))
    kept = {
        path.parent.name: path.read_text() for path in (tmp_path / "further").glob("*/shares.json")
    }
    assert [*sorted(kept)] == ["000", "002", "003"]
    assert "0.5" in kept["002"]
