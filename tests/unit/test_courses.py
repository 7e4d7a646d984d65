"""Drifting contacts: filter against an explicit normal distribution, forecasts, and design for low
CLR.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from asperity.core.errors import BadInput
from asperity.inference import (
    ForwardModel,
    Observation,
    ObservationPoint,
    ObservedSeries,
    SeriesForecaster,
    design_contact,
    forecast_observations,
    forecast_series,
    latest_observations,
    read_limit,
    wear_drift,
)
from asperity.inference.drifting_contact import DRIFT_STD, DriftModel
from asperity.inference.forecast import Limit
from asperity.inference.gaussian_process import GaussianProcess
from asperity.inference.kalman_filter import KNOTS, ChannelTable, DriftParameters, between_knots
from asperity.inference.likelihood import (
    EMULATED_HEIGHT_STD,
    EXPONENT_STD,
    FORCE_LENGTH,
    GAIN_STD,
    POINT_SHARE,
    WEIGHTS,
)
from asperity.inference.sampling import RULED_OUT, Pool, importance
from asperity.inference.visits import MAX_POINTS, MAX_VISITS, visit_series
from support.emulated import formula, formula_emulator, formula_setting

TIMES = np.array([0.0, 0.15, 0.4, 0.75, 1.0])
SIZE, DIFFUSION, SCATTER = {"crf": 0.02, "damping": 0.005, "crfa": 0.08}, 0.2, 0.003
EMULATED, POINT_CORRELATION = (
    {"crf": 0.01, "damping": 0.02, "crfa": EMULATED_HEIGHT_STD},
    0.6,
)  # standard deviations, and their correlation


@pytest.fixture(scope="module")
def setting():
    return formula_setting()


@pytest.fixture(scope="module")
def emulator(setting):
    return formula_emulator(setting)


def recording(x, crf=3000.0, std=6.0, **more):
    return Observation(load_n=500.0, entrainment_m_s=1.91, crf_hz=crf, crf_std_hz=std, x=x, **more)


OBSERVED = ObservedSeries(observations=(recording(1.0),))


def simulated_series(setting, emulator, shares, *, seed=0, std=2e-3):
    """Simulate observations of a contact at prior medians while its Sq moves through its range."""
    rng = np.random.default_rng(seed)
    forward = ForwardModel(setting, emulator, (ObservationPoint(500.0, 1.91),))
    z = np.zeros((len(shares), len(setting.unknowns)))
    z[:, 0] = setting.unknowns[0].at_share(shares)
    predicted = forward.predict(z, "hertz-point")
    clr = forward.states(z, ["clr"])["clr"][:, 0]
    x = np.linspace(0.0, 100.0, len(shares))
    hertz = np.exp(predicted.crf[:, 0] + std * rng.standard_normal(len(shares)))
    damping = np.exp(predicted.damping[:, 0] + 0.05 * rng.standard_normal(len(shares)))
    observations = [
        recording(time, crf, std * crf, damping_ratio=zeta, damping_std=0.05 * zeta)
        for time, crf, zeta in zip(x, hertz, damping, strict=True)
    ]
    return observations, clr


def test_a_stored_forecast_depends_on_the_number_of_emulator_points(setting, emulator):
    forecaster = SeriesForecaster(setting, emulator, Limit("clr", 0.5))
    extended = SeriesForecaster(
        setting, replace(emulator, points=emulator.points + 8), Limit("clr", 0.5)
    )
    assert forecaster.question != extended.question
    assert forecaster.question == SeriesForecaster(setting, emulator, Limit("clr", 0.5)).question


# The filter
# -------------------------------------------------------------------------------------------------


def straight_table(share, memory, places=2):
    """Channels that are linear over the range, for two identical contacts."""
    knots = np.linspace(0.0, 1.0, KNOTS)
    lines = {"crf": 8.0 + 0.4 * knots, "damping": -4.0 - 0.1 * knots, "crfa": 1.0 + 2.0 * knots}
    count = 2
    return ChannelTable(
        {key: np.tile(line, (count, places, 1)) for key, line in lines.items()},
        {
            key: np.tile(
                std**2 * np.array([[1.0, POINT_CORRELATION], [POINT_CORRELATION, 1.0]]),
                (count, 1, 1),
            )
            for key, std in EMULATED.items()
        },
        np.tile([-0.3, 0.3], (count, 1)),
        np.full(count, share),
        DriftParameters(
            {key: np.full(count, size) for key, size in SIZE.items()},
            *(np.full(count, value) for value in (DIFFUSION, SCATTER, memory)),
        ),
    )


@pytest.mark.parametrize(
    ("changing", "memory", "offset"),
    [(False, 0.0, 0.0), (True, 0.0, 0.0), (True, 0.65, 0.0), (True, 0.0, 0.02)],
)
def test_the_filter_equals_the_joint_normal_distribution_of_all_observations(
    setting, emulator, changing, memory, offset
):
    """Joint density of twenty logarithms, with the integrated Wiener process's covariance in closed
    form.
    """
    rng = np.random.default_rng(3)
    observations = [
        replace(
            recording(
                time, 2980.0 * (1.0 + 0.01 * rng.standard_normal()), 15.0, crfa=2.9, crfa_std=0.2
            ),
            load_n=load * (1.0 + offset * (number % 2)),
        )
        for number, time in enumerate(TIMES)
        for load in (400.0, 700.0)
    ]
    series = visit_series(observations)
    forward = ForwardModel(setting, emulator, series.points)
    model = DriftModel(forward, series, "hertz-point", "sq_m")
    filtered = model._filter(straight_table(0.4, memory), changing=changing)
    measurements = model.measurements
    assert len(model.slope_scatter) == (3 if offset else 0)  # per channel, with respect to load
    slope = np.array([{"crf": 0.4, "crfa": 2.0}[entry.channel] for entry in measurements])
    begin = (
        np.array([{"crf": 8.0, "crfa": 1.0}[entry.channel] for entry in measurements]) + 0.4 * slope
    )
    log_force = np.array(
        [(-0.3, 0.3)[entry.point] if entry.channel == "crf" else 0.0 for entry in measurements]
    )
    time = np.array([entry.time for entry in measurements])
    earlier, later = np.minimum.outer(time, time), np.maximum.outer(time, time)
    wiener = DIFFUSION**2 * (earlier**2 * later / 2.0 - earlier**3 / 6.0)
    covariance = np.outer(slope, slope) * changing * (DRIFT_STD**2 * np.outer(time, time) + wiener)
    covariance += EXPONENT_STD**2 * np.outer(log_force, log_force)
    for row, row_entry in enumerate(measurements):
        weight, emulated = WEIGHTS[row_entry.channel], EMULATED[row_entry.channel]
        for column, column_entry in enumerate(measurements):
            if row_entry.channel == column_entry.channel == "crfa":
                covariance[row, column] += GAIN_STD**2
            if row_entry.channel == column_entry.channel:
                covariance[row, column] += emulated**2 * (
                    1.0 if row_entry.point == column_entry.point else POINT_CORRELATION
                )
            if row_entry.channel == column_entry.channel:
                force_distance = (
                    0.0 if row_entry.point == column_entry.point else 0.6
                )  # difference of log force
                total_correlation = POINT_SHARE * (force_distance == 0.0) + (
                    1.0 - POINT_SHARE
                ) * np.exp(-0.5 * (force_distance / FORCE_LENGTH) ** 2)
                covariance[row, column] += (
                    weight * SIZE[row_entry.channel]
                ) ** 2 * total_correlation
            if (
                offset and row_entry.channel == column_entry.channel
            ):  # the error of moving to the common load is fully correlated
                slope_std = model.slope_scatter[row_entry.channel, 0]
                covariance[row, column] += (
                    row_entry.offset[0]
                    * slope_std[row_entry.point]
                    * column_entry.offset[0]
                    * slope_std[column_entry.point]
                )
            if memory and row_entry.channel == column_entry.channel == "crf":
                covariance[row, column] += SCATTER**2 * memory ** (
                    abs(row_entry.time - column_entry.time) * (len(TIMES) - 1)
                )
        white = row_entry.channel != "crf" or not memory
        covariance[row, row] += row_entry.measured.std**2 + white * (weight * SCATTER) ** 2
    values = np.array([entry.measured.value for entry in measurements])
    assert filtered.log == pytest.approx(
        multivariate_normal(begin, covariance).logpdf(values), abs=1e-6
    )


def test_errors_of_close_operating_points_are_highly_correlated():
    """Posterior covariance of the process in closed form."""
    rng = np.random.default_rng(2)
    x, at = rng.random((20, 2)), rng.random((4, 3, 2))
    at[:, 1] = at[:, 0] + 1e-3
    process = GaussianProcess(
        x, np.sin(4.0 * x[:, 0]), np.full(20, 0.01), np.array([0.5, 2.0]), 1.3, 1e-3
    )
    kernel = ConstantKernel(1.3) * Matern([0.5, 2.0], nu=2.5)
    known = kernel(x) + np.diag(process.noise / process._scale**2 + process.rough)
    for group, found in zip(at, process.correlations(at), strict=True):
        across = kernel(group, x)
        covariance = kernel(group) * (1.0 + 1e-3 / 1.3) - across @ np.linalg.solve(known, across.T)
        deviation = np.sqrt(np.diag(covariance))
        assert found == pytest.approx(covariance / np.outer(deviation, deviation), abs=2e-3)
        assert found[0, 1] > 0.99


def test_tables_are_linear_between_knots_and_constant_beyond():
    table = np.tile(np.linspace(0.0, 1.0, KNOTS) ** 2, (3, 1))
    value, slope = between_knots(table, np.array([0.5, -0.2, 1.3]))
    assert value == pytest.approx([0.25, 0.0, 1.0])
    assert slope[0] == pytest.approx(1.0, abs=0.07)
    assert list(slope[1:]) == [0.0, 0.0]


def test_share_and_value_of_a_range_are_inverse_functions(setting):
    for unknown in setting.unknowns:
        if unknown.key != "grid_error":
            assert unknown.share(unknown.at_share(np.array([0.2, 0.5, 0.8]))) == pytest.approx(
                [0.2, 0.5, 0.8]
            )


# Forecasts
# -------------------------------------------------------------------------------------------------


def test_the_forecast_interval_covers_the_crossing_of_a_roughening_contact(setting, emulator):
    """Sq rises at a constant rate; CLR reaches one half after the last recording."""
    shares = np.linspace(0.3, 1.0, 61)
    observations, clr = simulated_series(setting, emulator, shares)
    crossing_index, limit = int(np.argmax(clr >= 0.5)), 0.5
    last = crossing_index - 12
    found = forecast_observations(
        setting, emulator, observations[: last + 1 : 2], limit=("clr", limit)
    )
    crossing = np.interp(
        limit,
        clr[crossing_index - 1 : crossing_index + 1],
        [observations[crossing_index - 1].x, observations[crossing_index].x],
    )
    crossing -= observations[: last + 1 : 2][-1].x
    assert found.change_detected
    assert found.alarm
    assert found.rising
    assert found.time.low < crossing < found.time.high
    assert found.time.high < 10.0 * found.time.low
    assert found.by.median <= found.time.median * (1.0 + 1e-9) or found.within < 1.0
    assert (found.by.high == np.inf) == (found.within < 0.95 * (1.0 - found.already))
    assert found.clr.low < clr[last] < found.clr.high
    assert "rises above 50.0 %" in found.sentence()
    json.dumps(found.scalars(), allow_nan=False)
    falling = replace(found, rising=False, already=0.0, within=0.9)  # from above, not yet crossed
    assert falling.alarm
    fallen = replace(falling, already=1.0, within=0.0)  # after running-in
    assert not fallen.alarm
    assert fallen.sentence() == "CLR is below 50.0 % (probability 1.00)."
    assert replace(
        fallen, limit=Limit("oil_viscosity_pa_s", 0.02)
    ).alarm  # for oil a lower viscosity is worse


def test_a_constant_contact_is_not_classed_as_changing(setting, emulator):
    observations, _ = simulated_series(setting, emulator, np.full(12, 0.55), seed=5)
    found = forecast_observations(
        setting, emulator, observations, limit=read_limit("sq=3 um", setting)
    )
    assert (found.change_detected, found.alarm) == (False, False)
    assert found.sentence().startswith("No change of the contact is detected over 12 visits")
    assert found.drifting == "sq_m"
    json.dumps(found.scalars(), allow_nan=False)


class Worn:
    """Stand-in for a wear history: Sq grows from 0.5 to 1 um in 200 h."""

    def __init__(self, hours=200.0):
        self.hours = hours

    @staticmethod
    def values_at(hours):
        return {"sq_m": 0.5e-6 * 2.0 ** (hours / 200.0)}


def test_a_wear_history_gives_the_prior_of_the_drift(setting, emulator):
    """A quarter of the range 0.25 to 4 um, that is an eighth in 100 h."""
    assert wear_drift(setting, Worn(), 100.0) == pytest.approx((0.125, 0.125))
    assert wear_drift(setting, Worn(), 400.0) == pytest.approx((0.5, 0.5))
    observations, _ = simulated_series(
        setting, emulator, np.full(6, 0.5), std=0.3
    )  # almost uninformative
    ends = []
    for drift in ((0.6, 0.05), (-0.6, 0.05)):
        found = forecast_observations(
            setting, emulator, observations, drift=drift, laws=("hertz-point",)
        )
        ends.append(found.bands.ends[:, -1])
    assert np.all(ends[0] > ends[1] + 0.03)
    assert ends[0][1] > ends[1][1] + 0.2
    with pytest.raises(BadInput, match="cannot drift"):
        wear_drift(replace(setting, contact=()), Worn(), 1.0)
    with pytest.raises(BadInput, match="has no hours"):
        wear_drift(setting, Worn(0.0), 1.0)


def test_many_visits_are_grouped_without_loss():
    series = visit_series([recording(float(number), 3000.0 + number) for number in range(200)])
    assert len(series.x) == MAX_VISITS
    assert series.span == pytest.approx(199.0, abs=3.0)
    assert np.exp([entry.measured.value for entry in series.measurements]) == pytest.approx(
        3000.0 + np.array(series.x), abs=0.01
    )


def test_close_operating_points_are_merged_and_their_difference_is_corrected(setting, emulator):
    """Load varies between visits: one table; CRF is corrected within the spread of contacts."""
    rng = np.random.default_rng(8)
    loads = 500.0 * np.exp(0.012 * rng.standard_normal(12))
    observations = [
        replace(recording(float(number)), load_n=load)
        for number, load in enumerate([500.0, *loads, 800.0])
    ]
    series = visit_series(observations)
    assert [place.load_n for place in series.points] == [500.0, 800.0]
    assert series.main_point == 0
    forward = ForwardModel(setting, emulator, series.points)
    model = DriftModel(forward, series, "hertz-point", "sq_m")
    z = rng.standard_normal((400, forward.dims))
    moved_predictions = (
        ForwardModel(setting, emulator, tuple(ObservationPoint(load, 1.91) for load in loads))
        .predict(z, "hertz-point")
        .crf
    )
    predicted = forward.predict(z, "hertz-point").crf[:, 0]
    for load, moved, raw, entry in zip(
        loads, moved_predictions.T, series.measurements[1:], model.measurements[1:], strict=False
    ):
        change = moved - predicted
        assert raw.measured.value - entry.measured.value == pytest.approx(change.mean(), abs=2e-4)
        assert entry.measured.std == raw.measured.std
        assert (entry.offset[0] * model.slope_scatter["crf", 0][0]) ** 2 == pytest.approx(
            change.var(), rel=0.5, abs=1e-8
        )
        assert np.sign(change.mean()) == np.sign(load - 500.0)
    many = [replace(recording(float(number)), load_n=250.0 + 45.0 * number) for number in range(15)]
    assert len(visit_series(many).points) <= MAX_POINTS
    close = [replace(recording(float(number)), load_n=500.0 * 1.02**number) for number in range(8)]
    assert visit_series(close[::-1]) == visit_series(close)  # grouping does not depend on the order


def test_only_recent_recordings_describe_a_changing_contact():
    observations = [
        replace(recording(x), load_n=load)
        for x, load in ((0.0, 300.0), (80.0, 700.0), (91.0, 500.0))
    ]
    latest = latest_observations(ObservedSeries(observations=(*observations, recording(100.0))))
    assert [entry.x for entry in latest.observations] == [
        100.0
    ]  # 500 N; the last recording at 700 N is too old
    assert latest.notes[-1].endswith("Operating points recorded only before: 2.")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda _: visit_series(
                [replace(recording(float(x)), temperature_k=(None, 340.0)[x % 2]) for x in range(6)]
            ),
            "some recordings have a temperature and some have none",
        ),
        (
            lambda setting: read_limit("crf=3000 Hz", setting),
            "`limit` takes a limit such as clr=0.5, of clr, sq or",
        ),
        (
            lambda setting: read_limit("clr=half", setting),
            "`limit` clr takes a share of the load",
        ),
        (lambda setting: read_limit("sq=2 N", setting), "`limit` sq must be"),
        (
            lambda _: visit_series([recording(float("nan"))]),
            "has no time; give a column x",
        ),
        (lambda _: visit_series([recording(float("inf"))]), "has no time"),
        (
            lambda _: visit_series([recording(1.0)] * 9),
            "at least 4 recordings at different times, got 1",
        ),
        (
            lambda setting: forecast_observations(setting, None, [], limit=("clr", 1.5)),
            "must lie between 0 and 1",
        ),
        (
            lambda setting: forecast_observations(
                setting, None, [], limit=("sq_m", 1e-6), drifting="oil_alpha_1_pa"
            ),
            "a limit must be of clr or oil_alpha_1_pa",
        ),
        (
            lambda setting: forecast_observations(setting, None, [], limit=("sq_m", 1e-5)),
            "a limit of Sq must lie within the range in .infer., 0.25 µm to 4 µm, got 10 µm",
        ),
        (
            lambda setting: forecast_series(
                setting, None, OBSERVED, read_limit("hardness=2 GPa", setting), worn="worn"
            ),
            "`worn` is a prior for the drift of Sq, but the limit is of hardness_pa",
        ),
        (
            lambda setting: forecast_series(
                setting, None, OBSERVED, Limit("clr", 0.5), worn="worn"
            ),
            "at least 4 recordings at different times, got 1",
        ),
    ],
)
def test_a_forecast_without_basis_is_refused(setting, call, message):
    with pytest.raises(BadInput, match=message):
        call(setting)


# Design
# -------------------------------------------------------------------------------------------------


def test_the_design_bound_keeps_the_load_share_low_in_95_per_cent_of_contacts(setting, emulator):
    """At the stated bound, evaluated with the exact formula and with other contacts."""
    rng = np.random.default_rng(11)
    conditions = setting.case.conditions
    forward = ForwardModel(
        setting, emulator, (ObservationPoint(conditions.load, conditions.entrainment_speed),)
    )
    found = design_contact(forward, rng.standard_normal((600, forward.dims)), clr=0.3)
    levers = {entry.key: entry for entry in found.levers}
    assert list(levers) == ["sq_m", "oil_viscosity_pa_s", "load_n", "entrainment_speed_m_s"]
    assert levers["sq_m"].way == "at most"
    z = rng.standard_normal((4000, forward.dims))
    sq = setting.unknowns[0]
    for bound, expected in ((levers["sq_m"].bound, 0.95), (None, found.now)):
        if bound is not None:
            z[:, 0] = sq.at_share(
                np.interp(
                    bound, sq.value(sq.at_share(np.linspace(0, 1, 400))), np.linspace(0, 1, 400)
                )
            )
        x = emulator.features(forward.shares(z)[:, 0])
        clr = formula(x[:, len(setting.contact) + 1], sq.value(z[:, 0]))["clr"]
        assert np.mean(clr < 0.3) == pytest.approx(expected, abs=0.02)
        z = rng.standard_normal((4000, forward.dims))
    chances = levers["entrainment_speed_m_s"].chances
    assert np.all(np.diff(chances) > -1e-9)
    assert np.all(np.diff(levers["load_n"].chances) < 0.0)
    assert "composite roughness: at most" in found.sentence()
    json.dumps(found.scalars(), allow_nan=False)
    with pytest.raises(BadInput, match="`clr` must be a load share"):
        design_contact(forward, z, clr=1.2)


def test_a_difficult_posterior_gets_more_rounds_unless_its_model_is_ruled_out():
    """A narrow ridge in six dimensions, evidence in closed form; a ruled-out model costs no further
    round.
    """
    direction = np.array([1.0, -2.0, 3.0, 1.0, -1.0, 2.0])

    def target(z):
        return -0.5 * ((z @ direction - 9.0) / 0.01) ** 2 - np.log(0.01 * np.sqrt(2.0 * np.pi))

    evidence = norm(0.0, np.sqrt(direction @ direction + 0.01**2)).logpdf(9.0)

    def found(best=-np.inf, longest=0):
        pool = Pool(lambda z: z, lambda a, b: np.concatenate([a, b]), lambda a, rows: a[rows], 6, 0)
        return (
            importance(pool, target, rounds=2, best=best, least=200.0, longest=longest),
            pool.drawn,
        )

    short, drawn = found()
    assert short.effective < 200.0
    longer, more = found(longest=60)
    assert longer.effective >= 200.0
    assert longer.log_evidence == pytest.approx(evidence, abs=4.0 * longer.log_evidence_std)
    assert more > drawn
    assert found(best=evidence + RULED_OUT + 5.0, longest=60)[1] == drawn
