"""Load, speed and oil temperature beside recordings: what they explain, and what they do not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz

from asperity.case import load_case
from asperity.lubricant import OilSheet
from asperity.monitoring import operating_point as operating
from asperity.monitoring.operating_point import (
    ANY_CONTACT,
    CRF,
    LEVEL,
    PULSES,
    OperatingPoint,
    conditions_of,
    contact_exponents,
    operating_response,
    unstated,
)
from asperity.trend import Condition, MonitoredSeries, RecordingStatus, sequential, sequential_alarm
from asperity.trend.regressors import fit_conditions

NUMBER = np.arange(40.0)
LOADS = np.where(NUMBER < 18, 500.0, 900.0)


def scatter(seed, size=0.004):
    return size * np.random.default_rng(seed).standard_normal(NUMBER.size)


def crf(values, follows=CRF, **met):
    """The series as it is watched, beside what it was recorded at, by its keys; nan where nothing
    is stated.
    """
    rows = [
        OperatingPoint(
            **{key: None if np.isnan(value) else value for key, value in zip(met, row, strict=True)}
        )
        for row in zip(*met.values(), strict=True)
    ]
    conditions = conditions_of(rows, follows, ANY_CONTACT.oil)
    return MonitoredSeries(
        name="CRF",
        values=values,
        smallest_change=0.05,
        contact=True,
        describe="by {:.3f}".format,
        conditions=conditions,
        relative=True,
    )


def judged(one):
    return sequential_alarm(NUMBER, [one], [RecordingStatus()] * NUMBER.size)


def test_a_load_step_that_is_given_explains_the_change():
    values = (LOADS / 500.0) ** (1.0 / 6.0) + scatter(1)
    unknown, given = judged(crf(values)), judged(crf(values, load_n=LOADS))
    assert (unknown.state, unknown.explained) == ("cannot-tell", "")
    assert given.state == "none"
    assert set(given.states[8:]) == {"none"}
    assert given.explained.startswith("CRF by 0.10")
    assert "load from 500 to 900 N explains it (by 0.10" in given.explained


def test_a_load_step_explains_no_more_than_a_contact_can_do():
    """CRF goes with (CLR F)^(1/6), so 4 % of load cannot move it by 10 %."""
    values = np.where(NUMBER < 18, 1.0, 1.1) + scatter(2)
    alarm = judged(crf(values, load_n=np.where(NUMBER < 18, 500.0, 520.0)))
    assert (alarm.state, alarm.explained) == ("cannot-tell", "")
    assert "in one step at 18" in alarm.reason


def test_what_has_the_wrong_sign_for_a_contact_explains_nothing():
    values = (LOADS / 500.0) ** (-1.0 / 6.0) + scatter(3)
    assert judged(crf(values, load_n=LOADS)).state == "cannot-tell"


@pytest.mark.parametrize("grade", ["VG 32", "VG 320"])
def test_a_warm_up_is_that_of_any_oil(grade):
    """CRF by a power of the viscosity of an oil that nobody stated."""
    degrees = 70.0 - 45.0 * np.exp(-NUMBER / 5.0)
    oil = OilSheet(grade=grade)
    thick = np.array([oil.viscosity(degree + 273.15) for degree in degrees])
    values = (thick / thick[0]) ** -0.05 + scatter(4)
    alarm = judged(crf(values, temperature_degc=degrees))
    assert set(alarm.states[8:]) == {"none"}
    assert "oil temperature from" in alarm.explained
    assert alarm.explained.count("degC explains it") == 1


def test_a_knee_is_found_under_loads_that_change():
    course = 1.0 + np.where(NUMBER < 18, 0.0136 * NUMBER, 0.245 + 0.0025 * (NUMBER - 18))
    loads = np.where(np.random.default_rng(1).random(40) < 0.5, 500.0, 800.0)
    values = course * (loads / 500.0) ** 0.2 + scatter(5)
    assert "alarm" not in judged(crf(values)).states[: 18 + 5]  # in that scatter nobody sees it
    raised = judged(crf(values, load_n=loads)).states.index("alarm")
    assert 18 < raised <= 18 + 4


def test_recordings_without_a_condition_are_left_out_where_most_state_it():
    values, loads = (LOADS / 500.0) ** (1.0 / 6.0), LOADS.copy()
    loads[[3, 25]] = np.nan
    values[[3, 25]] = 7.0  # whatever they show
    one = crf(values, load_n=loads)
    assert judged(one).state == "none"
    met = [OperatingPoint(load_n=None if np.isnan(load) else load) for load in loads]
    assert unstated(met) == [
        "The load is not stated for 2 of 40 recordings; these are excluded from trend and alarm."
    ]
    few = [replace(one, load_n=None) for one in met[5:]] + met[:5]
    assert unstated(few)[0].endswith("36 of 40 recordings; it is not used.")
    spun = [OperatingPoint(speed_hz=25.0)] * 30 + [OperatingPoint()] * 10
    assert unstated(spun) == [
        "The speed is not stated for 10 of 40 recordings; these are excluded from trend and alarm."
    ]
    assert conditions_of(few, CRF, ANY_CONTACT.oil) == ()


def test_powers_are_found_exactly_where_nothing_scatters_and_held_within_their_bounds():
    speeds = np.random.default_rng(2).uniform(1.0, 3.0, 40)
    met = [
        OperatingPoint(load_n=load, entrainment_m_s=speed)
        for load, speed in zip(LOADS, speeds, strict=True)
    ]
    conditions = conditions_of(met, LEVEL, ANY_CONTACT.oil)
    values = 0.7 * np.log(LOADS) + 2.5 * np.log(speeds)
    told = fit_conditions(values, conditions, smallest_change=0.7)
    assert told.coefficients == pytest.approx([0.7, 2.5], abs=1e-6)
    assert values - told.effect == pytest.approx(np.full(40, (values - told.effect)[0]), abs=1e-9)
    beyond = fit_conditions(9.0 * np.log(LOADS), conditions, smallest_change=0.7)
    assert beyond.coefficients[0] == pytest.approx(2.0)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_the_likelihood_beside_conditions_is_that_of_regression_with_a_prior(memory):
    """Slow twin: dense generalised least squares of the places and of one made-up reading of each
    coefficient.
    """
    values, loads = scatter(6)[:20] + 0.02 * NUMBER[:20], np.log(LOADS[10:30] / 500.0)
    beside = sequential.ConditionRows(loads[None], np.array([3.0]))
    rows = sequential._saturating_curves(NUMBER[:20])[::9]
    weight = np.linalg.inv(
        np.pad(toeplitz(memory ** np.arange(20.0)), (0, 1)) + np.diag([*[0.0] * 20, 1.0])
    )

    def likelihood(row):
        design = np.stack(
            [np.append(np.ones(20), 0.0), np.append(loads, 3.0), np.append(row, 0.0)], axis=1
        )
        told = np.append(values, 0.0)
        off = told - design @ np.linalg.solve(design.T @ weight @ design, design.T @ weight @ told)
        return (
            -10.0 * np.log(off @ weight @ off)
            - 0.5 * np.linalg.slogdet(toeplitz(memory ** np.arange(20.0)))[1]
        )

    whiteners = sequential._whiteners(20, beside)
    own = sequential._log_likelihoods(values, rows, whiteners=whiteners)[
        list(sequential.CORRELATIONS).index(memory)
    ]
    assert own == pytest.approx([likelihood(row) for row in rows], abs=1e-6)


def test_wear_and_a_condition_that_drift_alike_are_not_taken_for_one_another():
    """Wear of 0.5 % a recording beside a load that grows by 1 % a recording and scatters: by its
    power of 0.1.
    """
    load = 0.01 * NUMBER + 0.05 * np.random.default_rng(8).standard_normal(NUMBER.size)
    met = Condition(name="load", values=load, low=0.0, high=1.0 / 3.0, shown=np.exp(load), unit="N")
    told = fit_conditions(0.005 * NUMBER + 0.1 * load, [met], smallest_change=0.05)
    assert told.coefficients[0] == pytest.approx(0.1, abs=1e-6)


SMALL = """model = "mixed"
[contact]
geometry = "line"
radius = "5.4 mm"
length = "10 mm"
load = "500 N"
entrainment_speed = "1 m/s"
[material]
youngs_modulus = ["200 GPa", "200 GPa"]
poisson_ratio = [0.3, 0.3]
[surface]
kind = "gaussian"
sq = "1 um"
correlation_length = ["40 um", "40 um"]
seed = 7
[grid]
cells = [32, 16]
x = [-1.9, 1.9]
y = [-1.6, 1.6]
[vibration]
mass = "0.1 kg"
damping_ratio = 0.02
"""
OIL = """[lubricant]
viscosity = { law = "barus", eta0 = "0.096 Pa s", alpha = "18.2 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.88 g/cm^3" }
rheology = { law = "newtonian" }
"""


def test_a_dry_contact_follows_its_load_as_hertz_has_it_and_no_speed(tmp_path, monkeypatch):
    """All load on asperities: S ~ F^(1/3), so CRF ~ F^(1/6) whatever the speed. The doubt is never
    less than 0.05.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    follows = contact_exponents(load_case('lubricant = "none"\n' + SMALL))
    assert follows.load == pytest.approx((1.0 / 12.0, 1.0 / 4.0), abs=1e-3)
    assert follows.viscosity == follows.speed == pytest.approx((-0.05, 0.05), abs=1e-3)


def test_a_contact_that_follows_far_is_taken_at_its_word():
    """Clipped to what most contacts do, the span had no width and nothing could be fitted."""
    follows = operating._with_uncertainty(0.9, -1.58)
    assert follows.load == pytest.approx((0.45, 1.35))
    assert follows.speed == pytest.approx((-2.37, -0.79))
    speeds = np.where(NUMBER < 18, 1.0, 1.1)
    told = judged(crf(speeds**-1.5 + scatter(1), follows, entrainment_m_s=speeds))
    assert told.state == "none"


def test_a_fault_that_heats_its_oil_alarms_all_the_same():
    """A level that grows fourfold while the oil warms from 60 to 85 degC is hardly the oil's
    doing.
    """
    warm = np.interp(NUMBER, [15.0, 39.0], [60.0, 85.0])
    louder = np.interp(NUMBER, [15.0, 39.0], [0.0, np.log(4.0)]) + scatter(2, 0.03)
    assert (
        judged(
            replace(crf(louder, LEVEL, temperature_degc=warm), contact=False, relative=False)
        ).state
        == "alarm"
    )
    assert (
        conditions_of(
            [OperatingPoint(temperature_degc=value) for value in warm], PULSES, ANY_CONTACT.oil
        )
        == ()
    )


def test_the_contact_of_a_case_says_how_crf_follows_and_is_solved_once(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    case = load_case(SMALL + OIL)
    follows = contact_exponents(case)
    assert 0.1 < sum(follows.load) / 2.0 < 0.3
    assert follows.speed[0] < -0.05  # a thicker film takes load off them
    monkeypatch.setattr(operating, "_resonance", None)
    assert contact_exponents(load_case(SMALL + OIL)) == follows


def test_a_case_that_is_not_solved_is_said(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    met = [OperatingPoint(load_n=load) for load in (500.0, 900.0)]
    steady = [OperatingPoint(load_n=500.0)] * 2
    coarse = load_case(SMALL.replace("40 um", "4 um") + OIL)
    assert operating_response(coarse, met).crf == CRF
    assert operating_response(coarse, met).note.startswith(
        "The response of CRF to load and speed is that of any contact"
    )
    assert operating_response(coarse, steady).note == ""  # nothing to solve it for
