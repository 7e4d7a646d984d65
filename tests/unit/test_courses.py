"""Contacts that change: the filter against a normal distribution written out, forecasts, and what
keeps CLR low.
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
from asperity.inference.drifting_contact import (
    DRIFT_STD,
    KNOTS,
    ChannelTable,
    DriftModel,
    DriftParameters,
    between_knots,
)
from asperity.inference.forecast import Limit
from asperity.inference.gaussian_process import GaussianProcess
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
SIZE, RESTLESS, SCATTER = {"crf": 0.02, "damping": 0.005, "crfa": 0.08}, 0.2, 0.003
EMULATED, ALIKE = (
    {"crf": 0.01, "damping": 0.02, "crfa": EMULATED_HEIGHT_STD},
    0.6,
)  # deviations, and their correlation


@pytest.fixture(scope="module")
def setting():
    return formula_setting()


@pytest.fixture(scope="module")
def emulator(setting):
    return formula_emulator(setting)


def recording(x, crf=3000.0, std=6.0, **more):
    return Observation(load_n=500.0, entrainment_m_s=1.91, crf_hz=crf, crf_std_hz=std, x=x, **more)


HEARD = ObservedSeries(observations=(recording(1.0),))


def heard_along(setting, emulator, shares, *, seed=0, std=2e-3):
    """What a contact in the middle of its priors shows while its Sq goes along its range."""
    rng = np.random.default_rng(seed)
    forward = ForwardModel(setting, emulator, (ObservationPoint(500.0, 1.91),))
    z = np.zeros((len(shares), len(setting.unknowns)))
    z[:, 0] = setting.unknowns[0].at_share(shares)
    shown = forward.predict(z, "hertz-point")
    clr = forward.states(z, ["clr"])["clr"][:, 0]
    x = np.linspace(0.0, 100.0, len(shares))
    hertz = np.exp(shown.crf[:, 0] + std * rng.standard_normal(len(shares)))
    damping = np.exp(shown.damping[:, 0] + 0.05 * rng.standard_normal(len(shares)))
    heard = [
        recording(time, crf, std * crf, damping_ratio=zeta, damping_std=0.05 * zeta)
        for time, crf, zeta in zip(x, hertz, damping, strict=True)
    ]
    return heard, clr


def test_a_kept_forecast_knows_how_many_contacts_its_emulator_had(setting, emulator):
    asked = SeriesForecaster(setting, emulator, Limit("clr", 0.5))
    extended = SeriesForecaster(
        setting, replace(emulator, points=emulator.points + 8), Limit("clr", 0.5)
    )
    assert asked.question != extended.question
    assert asked.question == SeriesForecaster(setting, emulator, Limit("clr", 0.5)).question


# The filter
# -------------------------------------------------------------------------------------------------


def straight_table(share, memory, places=2):
    """Contacts whose channels are straight lines over the range: one of them here, twice."""
    knots = np.linspace(0.0, 1.0, KNOTS)
    lines = {"crf": 8.0 + 0.4 * knots, "damping": -4.0 - 0.1 * knots, "crfa": 1.0 + 2.0 * knots}
    count = 2
    return ChannelTable(
        {key: np.tile(line, (count, places, 1)) for key, line in lines.items()},
        {
            key: np.tile(std**2 * np.array([[1.0, ALIKE], [ALIKE, 1.0]]), (count, 1, 1))
            for key, std in EMULATED.items()
        },
        np.tile([-0.3, 0.3], (count, 1)),
        np.full(count, share),
        DriftParameters(
            {key: np.full(count, size) for key, size in SIZE.items()},
            *(np.full(count, value) for value in (RESTLESS, SCATTER, memory)),
        ),
    )


@pytest.mark.parametrize(
    ("changing", "memory", "offset"),
    [(False, 0.0, 0.0), (True, 0.0, 0.0), (True, 0.65, 0.0), (True, 0.0, 0.02)],
)
def test_the_filter_is_the_normal_distribution_of_all_that_was_heard(
    setting, emulator, changing, memory, offset
):
    """Twenty logarithms' joint density, their covariance by the integrated Wiener process's own
    formula.
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
    walked = model._filter(straight_table(0.4, memory), changing=changing)
    measurements = model.measurements
    assert len(model.slope_scatter) == (3 if offset else 0)  # of each channel, with load
    slope = np.array([{"crf": 0.4, "crfa": 2.0}[entry.channel] for entry in measurements])
    begin = (
        np.array([{"crf": 8.0, "crfa": 1.0}[entry.channel] for entry in measurements]) + 0.4 * slope
    )
    log_force = np.array(
        [(-0.3, 0.3)[entry.point] if entry.channel == "crf" else 0.0 for entry in measurements]
    )
    time = np.array([entry.time for entry in measurements])
    early, late = np.minimum.outer(time, time), np.maximum.outer(time, time)
    wandered = RESTLESS**2 * (early**2 * late / 2.0 - early**3 / 6.0)
    covariance = (
        np.outer(slope, slope) * changing * (DRIFT_STD**2 * np.outer(time, time) + wandered)
    )
    covariance += EXPONENT_STD**2 * np.outer(log_force, log_force)
    for row, one in enumerate(measurements):
        weight, emulated = WEIGHTS[one.channel], EMULATED[one.channel]
        for column, other in enumerate(measurements):
            if one.channel == other.channel == "crfa":
                covariance[row, column] += GAIN_STD**2
            if one.channel == other.channel:
                covariance[row, column] += emulated**2 * (
                    1.0 if one.point == other.point else ALIKE
                )
            if one.channel == other.channel:
                apart = 0.0 if one.point == other.point else 0.6  # of their levers
                alike = POINT_SHARE * (apart == 0.0) + (1.0 - POINT_SHARE) * np.exp(
                    -0.5 * (apart / FORCE_LENGTH) ** 2
                )
                covariance[row, column] += (weight * SIZE[one.channel]) ** 2 * alike
            if (
                offset and one.channel == other.channel
            ):  # a contact that is moved too far once is so each time
                lean = model.slope_scatter[one.channel, 0]
                covariance[row, column] += (
                    one.offset[0] * lean[one.point] * other.offset[0] * lean[other.point]
                )
            if memory and one.channel == other.channel == "crf":
                covariance[row, column] += SCATTER**2 * memory ** (
                    abs(one.time - other.time) * (len(TIMES) - 1)
                )
        white = one.channel != "crf" or not memory
        covariance[row, row] += one.measured.std**2 + white * (weight * SCATTER) ** 2
    values = np.array([entry.measured.value for entry in measurements])
    assert walked.log == pytest.approx(
        multivariate_normal(begin, covariance).logpdf(values), abs=1e-6
    )


def test_errors_of_near_operating_points_are_nearly_the_same():
    """The process's own posterior covariance, written out."""
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


def test_tables_are_straight_between_knots_and_level_beyond():
    table = np.tile(np.linspace(0.0, 1.0, KNOTS) ** 2, (3, 1))
    value, slope = between_knots(table, np.array([0.5, -0.2, 1.3]))
    assert value == pytest.approx([0.25, 0.0, 1.0])
    assert slope[0] == pytest.approx(1.0, abs=0.07)
    assert list(slope[1:]) == [0.0, 0.0]


def test_a_share_of_a_range_goes_both_ways(setting):
    for unknown in setting.unknowns:
        if unknown.key != "grid_error":
            assert unknown.share(unknown.at_share(np.array([0.2, 0.5, 0.8]))) == pytest.approx(
                [0.2, 0.5, 0.8]
            )


# Forecasts
# -------------------------------------------------------------------------------------------------


def test_a_roughening_contact_is_foretold(setting, emulator):
    """Sq goes along its range at a steady rate; the load share reaches one half after the last
    recording.
    """
    shares = np.linspace(0.3, 1.0, 61)
    heard, clr = heard_along(setting, emulator, shares)
    there, limit = int(np.argmax(clr >= 0.5)), 0.5
    seen = there - 12
    found = forecast_observations(setting, emulator, heard[: seen + 1 : 2], limit=("clr", limit))
    crossing = np.interp(limit, clr[there - 1 : there + 1], [heard[there - 1].x, heard[there].x])
    crossing -= heard[: seen + 1 : 2][-1].x
    assert found.change_detected
    assert found.alarm
    assert found.rising
    assert found.time.low < crossing < found.time.high
    assert found.time.high < 10.0 * found.time.low
    assert found.by.median <= found.time.median * (1.0 + 1e-9) or found.within < 1.0
    assert (found.by.high == np.inf) == (found.within < 0.95 * (1.0 - found.already))
    assert found.clr.low < clr[seen] < found.clr.high
    assert "rises above 50.0 %" in found.sentence()
    json.dumps(found.scalars(), allow_nan=False)
    falling = replace(found, rising=False, already=0.0, within=0.9)  # from above, where it still is
    assert falling.alarm
    fallen = replace(falling, already=1.0, within=0.0)  # run in
    assert not fallen.alarm
    assert fallen.sentence() == "CLR is below 50.0 % (probability 1.00)."
    assert replace(fallen, limit=Limit("oil_viscosity_pa_s", 0.02)).alarm  # of oil less is worse


def test_a_contact_that_stays_as_it_is_is_not_said_to_change(setting, emulator):
    heard, _ = heard_along(setting, emulator, np.full(20, 0.55), seed=5)
    found = forecast_observations(setting, emulator, heard, limit=read_limit("sq=3 um", setting))
    assert (found.change_detected, found.alarm) == (False, False)
    assert found.sentence().startswith("No change of the contact is detected over 20 visits")
    assert found.drifting == "sq_m"
    json.dumps(found.scalars(), allow_nan=False)


class Worn:
    """Sq that grows from 0.5 to 1 um in 200 h."""

    def __init__(self, hours=200.0):
        self.hours = hours

    @staticmethod
    def values_at(hours):
        return {"sq_m": 0.5e-6 * 2.0 ** (hours / 200.0)}


def test_a_wear_history_is_the_first_drift(setting, emulator):
    """A fourth of a range of 0.25 to 4 um, an eighth of it in 100 h."""
    assert wear_drift(setting, Worn(), 100.0) == pytest.approx((0.125, 0.125))
    assert wear_drift(setting, Worn(), 400.0) == pytest.approx((0.5, 0.5))
    heard, _ = heard_along(
        setting, emulator, np.full(6, 0.5), std=0.3
    )  # which tells next to nothing
    ends = []
    for drift in ((0.6, 0.05), (-0.6, 0.05)):
        found = forecast_observations(setting, emulator, heard, drift=drift, laws=("hertz-point",))
        ends.append(found.bands.ends[:, -1])
    assert np.all(ends[0] > ends[1] + 0.03)
    assert ends[0][1] > ends[1][1] + 0.2
    with pytest.raises(BadInput, match="cannot drift"):
        wear_drift(replace(setting, contact=()), Worn(), 1.0)
    with pytest.raises(BadInput, match="has no hours"):
        wear_drift(setting, Worn(0.0), 1.0)


def test_many_visits_are_taken_together_and_none_is_lost():
    series = visit_series([recording(float(number), 3000.0 + number) for number in range(200)])
    assert len(series.x) == MAX_VISITS
    assert series.span == pytest.approx(199.0, abs=3.0)
    assert np.exp([entry.measured.value for entry in series.measurements]) == pytest.approx(
        3000.0 + np.array(series.x), abs=0.01
    )


def test_near_operating_points_are_one_place_and_what_lies_between_is_allowed_for(
    setting, emulator
):
    """A load that differs at every visit: one table, and CRF moved to it to within what contacts
    differ by.
    """
    rng = np.random.default_rng(8)
    loads = 500.0 * np.exp(0.012 * rng.standard_normal(12))
    heard = [
        replace(recording(float(number)), load_n=load)
        for number, load in enumerate([500.0, *loads, 800.0])
    ]
    series = visit_series(heard)
    assert [place.load_n for place in series.points] == [500.0, 800.0]
    assert series.main_point == 0
    forward = ForwardModel(setting, emulator, series.points)
    model = DriftModel(forward, series, "hertz-point", "sq_m")
    z = rng.standard_normal((400, forward.dims))
    there = (
        ForwardModel(setting, emulator, tuple(ObservationPoint(load, 1.91) for load in loads))
        .predict(z, "hertz-point")
        .crf
    )
    here = forward.predict(z, "hertz-point").crf[:, 0]
    for load, moved, raw, entry in zip(
        loads, there.T, series.measurements[1:], model.measurements[1:], strict=False
    ):
        change = moved - here
        assert raw.measured.value - entry.measured.value == pytest.approx(change.mean(), abs=2e-4)
        assert entry.measured.std == raw.measured.std
        assert (entry.offset[0] * model.slope_scatter["crf", 0][0]) ** 2 == pytest.approx(
            change.var(), rel=0.5, abs=1e-8
        )
        assert np.sign(change.mean()) == np.sign(load - 500.0)
    many = [replace(recording(float(number)), load_n=250.0 + 45.0 * number) for number in range(15)]
    assert len(visit_series(many).points) <= MAX_POINTS
    near = [replace(recording(float(number)), load_n=500.0 * 1.02**number) for number in range(8)]
    assert visit_series(near[::-1]) == visit_series(near)  # who is whose place hangs on no order


def test_the_last_recordings_of_a_contact_that_changes_are_of_one_age():
    heard = [
        replace(recording(x), load_n=load)
        for x, load in ((0.0, 300.0), (80.0, 700.0), (91.0, 500.0))
    ]
    now = latest_observations(ObservedSeries(observations=(*heard, recording(100.0))))
    assert [one.x for one in now.observations] == [
        100.0
    ]  # 500 N; 700 N was last heard too long ago
    assert now.notes[-1].endswith("Operating points recorded only before: 2.")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda _: visit_series(
                [replace(recording(float(x)), temperature_k=(None, 340.0)[x % 2]) for x in range(6)]
            ),
            "some recordings have a temperature and some have none",
        ),
        (
            lambda setting: read_limit("crf=3000 Hz", setting),
            "--forecast takes a limit such as clr=0.5, of clr, sq or",
        ),
        (
            lambda setting: read_limit("clr=half", setting),
            "--forecast clr takes a share of the load",
        ),
        (lambda setting: read_limit("sq=2 N", setting), "--forecast sq must be"),
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
                setting, None, HEARD, read_limit("hardness=2 GPa", setting), worn="worn"
            ),
            "--worn is a prior for the drift of Sq, but the limit is of hardness_pa",
        ),
        (
            lambda setting: forecast_series(setting, None, HEARD, Limit("clr", 0.5), worn="worn"),
            "at least 4 recordings at different times, got 1",
        ),
    ],
)
def test_a_forecast_of_nothing_is_refused(setting, call, said):
    with pytest.raises(BadInput, match=said):
        call(setting)


# Design
# -------------------------------------------------------------------------------------------------


def test_what_keeps_the_load_share_low_does_so_in_nineteen_contacts_of_twenty(setting, emulator):
    """At the bound that is stated, asked of the formula itself and of other contacts."""
    rng = np.random.default_rng(11)
    conditions = setting.case.conditions
    forward = ForwardModel(
        setting, emulator, (ObservationPoint(conditions.load, conditions.entrainment_speed),)
    )
    found = design_contact(forward, rng.standard_normal((600, forward.dims)), clr=0.3)
    ways = {entry.key: entry for entry in found.levers}
    assert list(ways) == ["sq_m", "oil_viscosity_pa_s", "load_n", "entrainment_speed_m_s"]
    assert ways["sq_m"].way == "at most"
    z = rng.standard_normal((4000, forward.dims))
    sq = setting.unknowns[0]
    for bound, expected in ((ways["sq_m"].bound, 0.95), (None, found.now)):
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
    chances = ways["entrainment_speed_m_s"].chances
    assert np.all(np.diff(chances) > -1e-9)
    assert np.all(np.diff(ways["load_n"].chances) < 0.0)
    assert "composite roughness: at most" in found.sentence()
    json.dumps(found.scalars(), allow_nan=False)
    with pytest.raises(BadInput, match="--design must be a load share"):
        design_contact(forward, z, clr=1.2)


def test_a_posterior_that_is_hard_to_find_is_drawn_for_longer_unless_it_is_ruled_out():
    """A narrow ridge in six dimensions: evidence in closed form; a model far behind costs no
    further round.
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
