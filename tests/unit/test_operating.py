"""Load, speed and oil temperature as covariates of a series: changes they explain or leave."""

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


def crf(values, exponents=CRF, **recording_conditions):
    """Observed series with the operating conditions of each recording; nan where not stated."""
    rows = [
        OperatingPoint(
            **{
                key: None if np.isnan(value) else value
                for key, value in zip(recording_conditions, row, strict=True)
            }
        )
        for row in zip(*recording_conditions.values(), strict=True)
    ]
    conditions = conditions_of(rows, exponents, ANY_CONTACT.oil)
    return MonitoredSeries(
        name="CRF",
        values=values,
        smallest_change=0.05,
        contact=True,
        describe="by {:.3f}".format,
        conditions=conditions,
        relative=True,
    )


def judged(series):
    return sequential_alarm(NUMBER, [series], [RecordingStatus()] * NUMBER.size)


def test_a_stated_load_step_explains_the_change():
    values = (LOADS / 500.0) ** (1.0 / 6.0) + scatter(1)
    unknown, given = judged(crf(values)), judged(crf(values, load_n=LOADS))
    assert (unknown.state, unknown.explained) == ("alert", "")
    assert given.state == "none"
    assert set(given.states[8:]) == {"none"}
    assert given.explained.startswith("CRF by 0.10")
    assert "load from 500 to 900 N explains it (by 0.10" in given.explained


def test_a_load_step_explains_at_most_the_physical_response():
    """CRF ~ (CLR F)^(1/6): 4 % more load cannot change it by 10 %."""
    values = np.where(NUMBER < 18, 1.0, 1.1) + scatter(2)
    alarm = judged(crf(values, load_n=np.where(NUMBER < 18, 500.0, 520.0)))
    assert (alarm.state, alarm.explained) == ("alert", "")
    assert "in one step at 18" in alarm.reason


def test_a_response_of_the_wrong_sign_explains_nothing():
    values = (LOADS / 500.0) ** (-1.0 / 6.0) + scatter(3)
    assert judged(crf(values, load_n=LOADS)).state == "alert"


@pytest.mark.parametrize("grade", ["VG 32", "VG 320"])
def test_a_warm_up_follows_the_viscosity_of_any_oil(grade):
    """CRF as a power of the viscosity of an unspecified oil."""
    degrees = 70.0 - 45.0 * np.exp(-NUMBER / 5.0)
    oil = OilSheet(grade=grade)
    viscosities = np.array([oil.viscosity(degree + 273.15) for degree in degrees])
    values = (viscosities / viscosities[0]) ** -0.05 + scatter(4)
    alarm = judged(crf(values, temperature_degc=degrees))
    assert set(alarm.states[8:]) == {"none"}
    assert "oil temperature from" in alarm.explained
    assert alarm.explained.count("degC explains it") == 1


def test_a_knee_is_detected_under_varying_loads():
    course = 1.0 + np.where(NUMBER < 18, 0.0136 * NUMBER, 0.245 + 0.0025 * (NUMBER - 18))
    loads = np.where(np.random.default_rng(1).random(40) < 0.5, 500.0, 800.0)
    values = course * (loads / 500.0) ** 0.2 + scatter(5)
    assert "alarm" not in judged(crf(values)).states[: 18 + 5]  # not detectable in the raw scatter
    alarm_index = judged(crf(values, load_n=loads)).states.index("alarm")
    assert 18 < alarm_index <= 18 + 4


def test_recordings_without_a_condition_are_excluded_if_most_state_it():
    values, loads = (LOADS / 500.0) ** (1.0 / 6.0), LOADS.copy()
    loads[[3, 25]] = np.nan
    values[[3, 25]] = 7.0  # whatever their CRF
    series = crf(values, load_n=loads)
    assert judged(series).state == "none"
    points = [OperatingPoint(load_n=None if np.isnan(load) else load) for load in loads]
    assert unstated(points) == [
        "The load is not stated for 2 of 40 recordings; these are excluded from trend and alarm."
    ]
    few = [replace(series, load_n=None) for series in points[5:]] + points[:5]
    assert unstated(few)[0].endswith("36 of 40 recordings; it is not used.")
    speeds = [OperatingPoint(speed_hz=25.0)] * 30 + [OperatingPoint()] * 10
    assert unstated(speeds) == [
        "The speed is not stated for 10 of 40 recordings; these are excluded from trend and alarm."
    ]
    assert conditions_of(few, CRF, ANY_CONTACT.oil) == ()


def test_exponents_are_exact_without_scatter_and_bounded():
    speeds = np.random.default_rng(2).uniform(1.0, 3.0, 40)
    points = [
        OperatingPoint(load_n=load, entrainment_m_s=speed)
        for load, speed in zip(LOADS, speeds, strict=True)
    ]
    conditions = conditions_of(points, LEVEL, ANY_CONTACT.oil)
    values = 0.7 * np.log(LOADS) + 2.5 * np.log(speeds)
    fitted = fit_conditions(values, conditions, smallest_change=0.7)
    assert fitted.coefficients == pytest.approx([0.7, 2.5], abs=1e-6)
    assert values - fitted.effect == pytest.approx(
        np.full(40, (values - fitted.effect)[0]), abs=1e-9
    )
    clipped = fit_conditions(9.0 * np.log(LOADS), conditions, smallest_change=0.7)
    assert clipped.coefficients[0] == pytest.approx(2.0)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_the_likelihood_with_conditions_equals_regression_with_a_prior(memory):
    """Reference: dense generalised least squares with one pseudo-observation per coefficient."""
    values, loads = scatter(6)[:20] + 0.02 * NUMBER[:20], np.log(LOADS[10:30] / 500.0)
    condition_rows = sequential.ConditionRows(loads[None], np.array([3.0]))
    rows = sequential._saturating_curves(NUMBER[:20])[::9]
    weight = np.linalg.inv(
        np.pad(toeplitz(memory ** np.arange(20.0)), (0, 1)) + np.diag([*[0.0] * 20, 1.0])
    )

    def likelihood(row):
        design = np.stack(
            [np.append(np.ones(20), 0.0), np.append(loads, 3.0), np.append(row, 0.0)], axis=1
        )
        observed = np.append(values, 0.0)
        residual = observed - design @ np.linalg.solve(
            design.T @ weight @ design, design.T @ weight @ observed
        )
        return (
            -10.0 * np.log(residual @ weight @ residual)
            - 0.5 * np.linalg.slogdet(toeplitz(memory ** np.arange(20.0)))[1]
        )

    whiteners = sequential._whiteners(20, condition_rows)
    computed = sequential._log_likelihoods(values, rows, whiteners=whiteners)[
        list(sequential.CORRELATIONS).index(memory)
    ]
    assert computed == pytest.approx([likelihood(row) for row in rows], abs=1e-6)


def test_collinear_wear_and_load_drift_are_separated():
    """Wear of 0.5 % per recording and a load drift of 1 % per recording with exponent 0.1."""
    load = 0.01 * NUMBER + 0.05 * np.random.default_rng(8).standard_normal(NUMBER.size)
    condition = Condition(
        name="load", values=load, low=0.0, high=1.0 / 3.0, shown=np.exp(load), unit="N"
    )
    fitted = fit_conditions(0.005 * NUMBER + 0.1 * load, [condition], smallest_change=0.05)
    assert fitted.coefficients[0] == pytest.approx(0.1, abs=1e-6)


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
hardness = "2 GPa"
[surface]
kind = "gaussian"
sq = "2 um"
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


def test_a_dry_contact_follows_its_load_by_hertz_and_no_speed(tmp_path, monkeypatch):
    """All load on asperities: S ~ F^(1/3), so CRF ~ F^(1/6) at any speed; the bound is at least
    0.05.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    exponents = contact_exponents(load_case('lubricant = "none"\n' + SMALL))
    assert exponents.load == pytest.approx((1.0 / 12.0, 1.0 / 4.0), abs=1e-3)
    assert exponents.viscosity == exponents.speed == pytest.approx((-0.05, 0.05), abs=1e-3)


def test_a_strong_response_of_the_contact_is_not_clipped():
    """Clipping to the usual range left an interval of zero width and no fit."""
    exponents = operating._with_uncertainty(0.9, -1.58)
    assert exponents.load == pytest.approx((0.45, 1.35))
    assert exponents.speed == pytest.approx((-2.37, -0.79))
    speeds = np.where(NUMBER < 18, 1.0, 1.1)
    alarm = judged(crf(speeds**-1.5 + scatter(1), exponents, entrainment_m_s=speeds))
    assert alarm.state == "none"


def test_a_fault_that_heats_its_oil_still_alarms():
    """Oil warming from 60 to 85 degC does not explain a fourfold level."""
    warm = np.interp(NUMBER, [15.0, 39.0], [60.0, 85.0])
    level = np.interp(NUMBER, [15.0, 39.0], [0.0, np.log(4.0)]) + scatter(2, 0.03)
    assert (
        judged(
            replace(crf(level, LEVEL, temperature_degc=warm), contact=False, relative=False)
        ).state
        == "alarm"
    )
    assert (
        conditions_of(
            [OperatingPoint(temperature_degc=value) for value in warm], PULSES, ANY_CONTACT.oil
        )
        == ()
    )


def test_the_crf_response_of_a_case_is_computed_once(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    case = load_case(SMALL + OIL)
    exponents = contact_exponents(case)
    assert 0.1 < sum(exponents.load) / 2.0 < 0.3
    assert exponents.speed[0] < -0.05  # a thicker film carries more of the load
    monkeypatch.setattr(operating, "_resonance", None)
    assert contact_exponents(load_case(SMALL + OIL)) == exponents


def test_an_unsolved_case_is_reported(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    points = [OperatingPoint(load_n=load) for load in (500.0, 900.0)]
    steady = [OperatingPoint(load_n=500.0)] * 2
    coarse = load_case(SMALL.replace("40 um", "4 um") + OIL)
    assert operating_response(coarse, points).crf == CRF
    assert operating_response(coarse, points).note.startswith(
        "The response of CRF to load and speed is that of any contact"
    )
    assert operating_response(coarse, steady).note == ""  # no conditions to solve for
