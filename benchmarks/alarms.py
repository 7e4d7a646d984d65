"""Alarm statistics: false alarms without wear, detection of the severe stage, and machines run to
failure.

Each series is judged after every one of its 40 recordings, as `watch` does. `python -m
benchmarks.alarms` runs this part alone; `--fast` uses a tenth of the series.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from functools import partial
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

import asperity
from asperity.monitoring.alarm import CRF_LEAST, LEVEL_LEAST, RMS, Warming
from asperity.monitoring.operating_point import ANY_CONTACT, LEVEL, OperatingPoint, conditions_of
from asperity.trend import (
    FALSE_ALARM_RATE,
    Alarm,
    AlarmChecks,
    MonitoredSeries,
    RecordingStatus,
    knee_weight,
    sequential_alarm,
    split_stages,
)

KEPT = Path("build/alarms.json")
CODE = Path(asperity.__file__).parent
SOURCES = [
    Path(__file__),
    *(
        CODE / "trend" / f"{name}.py"
        for name in (
            "alarm",
            "alarm_inputs",
            "decision",
            "level_monitors",
            "level_rule",
            "sequential",
            "regressors",
            "warming",
            "stages",
            "stage_models",
            "change_points",
        )
    ),
    *(CODE / "monitoring" / f"{name}.py" for name in ("alarm", "operating_point")),
]
SERIES, RECORDINGS = 300, 40
NUMBER = np.arange(float(RECORDINGS))
CRF_HZ, RISE_HZ, AFTER = (
    2921.93,
    718.0,
    0.18,
)  # published end of the paper, the rig's rise to its knee, slope after over before the knee
SCATTERS = (0.001, 0.003, 0.005, 0.01)  # of CRF; one value per series
LEVEL_SCATTER = 0.1  # of the logarithm of the level: 0.9 dB
DEPTH_SCATTER = 0.14  # of the logarithm of a depth, as in one second of white noise
CYCLES = (6.0, 8.0, 12.0, 24.0)  # recordings per day


class Drawn(NamedTuple):
    """Simulated series: CRF over its first value, log of the level, onset of the severe stage.

    `depth` is the logarithm of the modulation depth of the envelope at a fault's rate; `bands` are
    levels of velocity and of two bands. `load` [N] and `temperature` [degC] are the measured
    values, if given.
    """

    crf: np.ndarray
    level: np.ndarray
    depth: np.ndarray
    bands: np.ndarray
    begins: float = np.nan
    load: np.ndarray | None = None
    temperature: np.ndarray | None = None


def autocorrelated(rng: np.random.Generator, memory: float) -> np.ndarray:
    """Return unit scatter with autocorrelation `memory` from recording to recording."""
    fresh = rng.standard_normal(RECORDINGS)
    scatter = np.empty(RECORDINGS)
    scatter[0] = fresh[0]
    for number in range(1, RECORDINGS):
        scatter[number] = memory * scatter[number - 1] + np.sqrt(1.0 - memory**2) * fresh[number]
    return scatter


def drawn(
    rng: np.random.Generator,
    course: np.ndarray | float = 1.0,
    level: np.ndarray | float = 0.0,
    memory: float = 0.0,
    source: np.ndarray | float = 0.0,
) -> Drawn:
    """Return CRF and levels with scatter; `source` is the logarithmic gain of the bearing's
    signal.
    """
    crf = course + rng.choice(SCATTERS) * autocorrelated(rng, memory)
    source_power = np.exp(2.0 * np.asarray(source))
    whole = level + 0.5 * np.log(0.5 * (1.0 + source_power))
    depth = np.log(source_power / (1.0 + source_power)) + DEPTH_SCATTER * autocorrelated(
        rng, memory
    )
    levels = [whole + LEVEL_SCATTER * autocorrelated(rng, memory) for _ in range(4)]
    return Drawn(crf, levels[0], depth, np.array(levels[1:]))


def after(rng: np.random.Generator) -> np.ndarray:
    """Return 0 before a random recording, 1 from it on."""
    return np.asarray(rng.integers(5, 35) <= NUMBER, dtype=float)


def daily(rng: np.random.Generator, size: float) -> Drawn:
    phase = 2.0 * np.pi * (NUMBER / rng.choice(CYCLES) + rng.random())
    return drawn(rng, 1.0 + size * np.sin(phase), 0.2 * np.sin(phase))


def load_step(rng: np.random.Generator) -> Drawn:
    there = after(rng)
    return drawn(
        rng, 1.0 + rng.uniform(0.02, 0.12) * there, rng.uniform(0.0, 0.7) * there, 0.0, 0.5 * there
    )


def warm_up(rng: np.random.Generator) -> Drawn:
    cold = np.exp(-NUMBER / rng.uniform(2.0, 8.0))
    return drawn(rng, 1.0 - rng.uniform(0.02, 0.12) * cold, -0.5 * cold)


def moved_sensor(rng: np.random.Generator) -> Drawn:
    there = after(rng)
    return drawn(
        rng,
        1.0 + rng.uniform(-0.02, 0.02) * there,
        rng.uniform(-1.5, 1.5) * there,
        0.0,
        rng.uniform(-1.5, 1.5) * there,
    )


def drift_of_modes(rng: np.random.Generator) -> Drawn:
    return drawn(
        rng, 1.0 + rng.uniform(-0.02, 0.02) * NUMBER / RECORDINGS, 0.3 * NUMBER / RECORDINGS
    )


def saturating(rng: np.random.Generator, memory: float = 0.0) -> Drawn:
    left = np.exp(-NUMBER / rng.uniform(5.0, 40.0))
    return drawn(rng, 1.0 - rng.uniform(0.05, 0.3) * left, memory=memory)


def straight(rng: np.random.Generator, memory: float = 0.0) -> Drawn:
    return drawn(rng, 1.0 + rng.uniform(0.05, 0.3) * NUMBER / RECORDINGS, memory=memory)


def hill(rng: np.random.Generator) -> Drawn:
    return drawn(rng, 1.0 + 0.5 * NUMBER**2 / (NUMBER**2 + rng.uniform(5.0, 15.0) ** 2))


def steepening(rng: np.random.Generator) -> Drawn:
    return drawn(rng, 1.0 + 0.012 * np.maximum(NUMBER - rng.integers(10, 30), 0.0))


def under_load(rng: np.random.Generator, load: np.ndarray, memory: float = 0.0) -> Drawn:
    """Return CRF ∝ load^(0.1 to 0.3) and level ∝ load^(0 to 1); the load is measured to 1 %."""
    ln = np.log(load / load[0])
    course = drawn(rng, np.exp(rng.uniform(0.1, 0.3) * ln), rng.uniform(0.0, 1.0) * ln, memory)
    return course._replace(load=load * (1.0 + 0.01 * rng.standard_normal(RECORDINGS)))


def given_step(rng: np.random.Generator, memory: float = 0.0) -> Drawn:
    return under_load(
        rng, 500.0 * rng.uniform(1.1, 2.0) ** (rng.choice([-1.0, 1.0]) * after(rng)), memory
    )


def in_turns(rng: np.random.Generator) -> Drawn:
    return under_load(rng, np.where(rng.random(RECORDINGS) < 0.5, 500.0, 800.0))


def warmth(rng: np.random.Generator, temperature: np.ndarray, memory: float = 0.0) -> Drawn:
    """Return CRF and level as powers of an oil's viscosity.

    Vogel's law, 30 to 300 mPa s at 40 degC; the temperature is measured to 0.5 K.
    """
    thin = 1000.0 * (1.0 / (temperature + 95.0) - 1.0 / 135.0)
    size = rng.uniform(0.02, 0.12) / np.ptp(thin)
    course = drawn(
        rng, np.exp(-size * (thin - thin[-1])), -rng.uniform(0.0, 0.3) * (thin - thin[-1]), memory
    )
    return course._replace(temperature=temperature + 0.5 * rng.standard_normal(RECORDINGS))


def given_warm_up(rng: np.random.Generator, memory: float = 0.0) -> Drawn:
    cold = np.exp(-NUMBER / rng.uniform(2.0, 8.0))
    return warmth(rng, rng.uniform(50.0, 80.0) - rng.uniform(25.0, 45.0) * cold, memory)


def given_days(rng: np.random.Generator) -> Drawn:
    return warmth(
        rng, 60.0 + rng.uniform(5.0, 15.0) * np.sin(2.0 * np.pi * (NUMBER / rng.choice(CYCLES)))
    )


def given_season(rng: np.random.Generator) -> Drawn:
    return warmth(rng, 45.0 + rng.uniform(-20.0, 20.0) * NUMBER / RECORDINGS)


def season(rng: np.random.Generator) -> Drawn:
    """Return CRF and level over half a year of oil temperature that is not stated."""
    phase = np.pi * (NUMBER / RECORDINGS + rng.uniform(-0.5, 0.5))
    return warmth(rng, 45.0 + rng.uniform(10.0, 20.0) * np.sin(phase))._replace(temperature=None)


GIVEN: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "load step, load given": given_step,
    "load step, load given, autocorrelated scatter 0.7": lambda rng: given_step(rng, 0.7),
    "two alternating loads, load given": in_turns,
    "warm-up, oil temperature given": given_warm_up,
    "warm-up, oil temperature given, autocorrelated scatter 0.7": lambda rng: given_warm_up(
        rng, 0.7
    ),
    "days of 10 to 30 K, oil temperature given": given_days,
    "season of up to 20 K, oil temperature given": given_season,
}

WITHOUT_WEAR: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "white scatter": drawn,
    "autocorrelated scatter 0.7": lambda rng: drawn(rng, memory=0.7),
    "autocorrelated scatter 0.9": lambda rng: drawn(rng, memory=0.9),
    "daily cycle of 1 %": lambda rng: daily(rng, 0.01),
    "daily cycle of 2 %": lambda rng: daily(rng, 0.02),
    "load step, CRF by 2 to 12 %, not given": load_step,
    "warm-up, CRF by 2 to 12 %": warm_up,
    "moved sensor, level by up to 13 dB": moved_sensor,
    "half a year of 10 to 20 K, not given": season,
    "drift of modes, 2 %": drift_of_modes,
    "gain change, up to 20 dB": lambda rng: drawn(rng, level=rng.uniform(-2.3, 2.3) * after(rng)),
    "saturating trend, 5 to 30 %": saturating,
    "straight trend, 5 to 30 %": straight,
    "flat, then rising": steepening,
    "saturating trend, autocorrelated scatter 0.7": lambda rng: saturating(rng, 0.7),
    "straight trend, autocorrelated scatter 0.7": lambda rng: straight(rng, 0.7),
    "Hill curve, 50 %": hill,
}


def knee(
    rng: np.random.Generator, scatter_hz: float, memory: float = 0.0, *, between: bool = False
) -> Drawn:
    """Return the rig's course of CRF, with its knee at a random recording (12 to 24).

    `between` places the knee anywhere between two recordings.
    """
    begins = float(rng.uniform(12.0, 24.0) if between else rng.integers(12, 25))
    pace = RISE_HZ / begins
    course = CRF_HZ + np.where(
        begins > NUMBER, pace * NUMBER, RISE_HZ + AFTER * pace * (NUMBER - begins)
    )
    crf = (course + scatter_hz * autocorrelated(rng, memory)) / CRF_HZ
    return drawn(rng)._replace(crf=crf, begins=begins)


def rounded_knee(rng: np.random.Generator, scatter_hz: float) -> Drawn:
    """Return the rig's knee, rounded over a fifth of the series."""
    course, width = knee(rng, scatter_hz), RECORDINGS / 5.0
    pace = RISE_HZ / course.begins
    from_knee = np.clip(NUMBER - course.begins, -0.5 * width, 0.5 * width)
    loss = (1.0 - AFTER) * pace * (from_knee + 0.5 * width) ** 2 / (2.0 * width)
    sharp = (1.0 - AFTER) * pace * np.clip(NUMBER - course.begins, 0.0, 0.5 * width)
    return course._replace(crf=course.crf - (loss - sharp) / CRF_HZ * (from_knee < 0.5 * width))


def knee_after_run_in(rng: np.random.Generator, scatter_hz: float) -> Drawn:
    """Return the rig's knee after a run-in, in which CRF falls by 3 to 10 %."""
    course = knee(rng, scatter_hz)
    run_in = rng.uniform(0.03, 0.1) * np.exp(-NUMBER / rng.uniform(2.0, 4.0))
    return course._replace(crf=course.crf + run_in)


def knee_under_load(rng: np.random.Generator, scatter_hz: float) -> Drawn:
    """Return the rig's knee under two alternating loads that change CRF by 9 %."""
    course, load = knee(rng, scatter_hz), np.where(rng.random(RECORDINGS) < 0.5, 500.0, 800.0)
    measured = load * (1.0 + 0.01 * rng.standard_normal(RECORDINGS))
    return course._replace(crf=course.crf * (load / 500.0) ** (1.0 / 6.0), load=measured)


def knee_in_season(rng: np.random.Generator, scatter_hz: float) -> Drawn:
    """Return the rig's knee while the oil temperature rises steadily."""
    course, warm = (
        knee(rng, scatter_hz),
        warmth(rng, 35.0 + rng.uniform(5.0, 30.0) * NUMBER / RECORDINGS),
    )
    return course._replace(crf=course.crf * warm.crf, temperature=warm.temperature)


KNEES: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "knee, CRF to 5 Hz": lambda rng: knee(rng, 5.0),
    "knee, CRF to 15 Hz": lambda rng: knee(rng, 15.0),
    "knee, CRF to 15 Hz, autocorrelated scatter 0.7": lambda rng: knee(rng, 15.0, 0.7),
    "knee, CRF to 30 Hz": lambda rng: knee(rng, 30.0),
    "knee, CRF to 15 Hz, rounded over a fifth": lambda rng: rounded_knee(rng, 15.0),
    "knee, CRF to 15 Hz, after a run-in": lambda rng: knee_after_run_in(rng, 15.0),
    "knee, CRF to 15 Hz, two alternating loads, given": lambda rng: knee_under_load(rng, 15.0),
    "knee, CRF to 15 Hz, a warming season, given": lambda rng: knee_in_season(rng, 15.0),
}


def to_failure(rng: np.random.Generator) -> Drawn:
    """Return a level that is steady, then rises 15 to 25 times at a growing rate; no contact
    resonance.
    """
    begins = rng.integers(15, 30)
    grown = np.maximum(NUMBER - begins, 0.0) / (RECORDINGS - 1 - begins)
    level = np.log(rng.uniform(15.0, 25.0)) * grown ** rng.uniform(1.0, 2.0)
    course = drawn(rng, np.nan, level, 0.5)
    return course._replace(begins=float(begins))


RELIABLE = (
    "white scatter",
    "autocorrelated scatter 0.7",
    "daily cycle of 1 %",
    "load step, CRF by 2 to 12 %, not given",
    "warm-up, CRF by 2 to 12 %",
    "drift of modes, 2 %",
    "saturating trend, 5 to 30 %",
    "straight trend, 5 to 30 %",
)
BINS = (0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.01)
CHANNELS = (RMS, "velocity", "band 1", "band 2", "depth")


def judged(course: Drawn) -> Alarm:
    """Return the alarm of `track`, which tests the stage before it tests CRF."""
    operating_points = [
        OperatingPoint(load_n=load, temperature_degc=warm)
        for load, warm in zip(_stated(course.load), _stated(course.temperature), strict=True)
    ]
    of_crf, of_level = (
        conditions_of(operating_points, follows, ANY_CONTACT.oil)
        for follows in (ANY_CONTACT.crf, LEVEL)
    )
    choices = {"smallest_change": CRF_LEAST, "contact": True, "describe": str, "relative": True}
    crf = MonitoredSeries(name="CRF", values=course.crf, conditions=of_crf, **choices)
    choices = {
        "smallest_change": LEVEL_LEAST,
        "contact": False,
        "describe": str,
        "conditions": of_level,
    }
    every = zip(CHANNELS, (course.level, *course.bands, course.depth), strict=True)
    levels = [
        MonitoredSeries(
            name=name,
            values=values,
            gain_dependent=name != "depth",
            step_alarms=name == "depth",
            **choices,
        )
        for name, values in every
    ]

    def severe(number: int) -> bool:
        reference = crf.part(np.arange(number + 1)).at_baseline_conditions()[0]
        return split_stages(NUMBER[: number + 1], CRF_HZ * reference).kind == "severe"

    watched = [crf, *levels] if np.isfinite(course.crf).any() else levels
    excuses = Warming(NUMBER, watched[:1], levels, "").excuses
    return sequential_alarm(
        NUMBER, watched, [RecordingStatus()] * RECORDINGS, checks=AlarmChecks(severe, excuses)
    )


def _stated(values: np.ndarray | None) -> list[float | None]:
    return [None] * RECORDINGS if values is None else [*values]


class Rows:
    """Finished rows, stored in a file while the code is unchanged; a run resumes after them."""

    def __init__(self, file: Path = KEPT) -> None:
        self.file, self.code = (
            file,
            sha256(b"".join(path.read_bytes() for path in SOURCES)).hexdigest(),
        )
        self.done: dict[str, str] = {}
        if file.is_file():
            stored = json.loads(file.read_text("utf-8"))
            self.done = stored["rows"] if stored["code"] == self.code else {}

    def row(self, name: str, made: Callable[[], str]) -> str:
        """Return a row; compute it once."""
        if name not in self.done:
            self.done[name] = made()
            self.file.parent.mkdir(exist_ok=True)
            self.file.write_text(json.dumps({"code": self.code, "rows": self.done}), "utf-8")
        return self.done[name]


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` uses a tenth of the series.

    An interrupted run resumes where it stopped.
    """
    series = SERIES // (10 if fast else 1)
    rows = Rows()
    yield (
        f"## Alarms: {series} series of {RECORDINGS} recordings per row, one false alarm in"
        f" {1.0 / FALSE_ALARM_RATE:.0f}\n"
    )
    yield "| series without wear | alarm at any time | alert at any time |"
    yield "|---|---|---|"
    for name, draw in (WITHOUT_WEAR | GIVEN).items():
        yield f"| {name} | {rows.row(f'{series} {name}', partial(quiet_row, draw, series))} |"
    yield (
        "\n| onset of the severe stage | found | too early | delay in recordings, median | 90 %"
        " within |"
    )
    yield "|---|---|---|---|---|"
    for name, draw in (KNEES | {"level only, rising 15 to 25 times": to_failure}).items():
        yield f"| {name} | {rows.row(f'{series} {name}', partial(found_row, draw, series))} |"
    yield rows.row(f"{series} P(severe)", lambda: "\n".join(reliability_lines(10 * series)))


def quiet_row(draw: Callable[[np.random.Generator], Drawn], series: int) -> str:
    """Return the shares of series without wear that ever leave the state healthy."""
    states = [
        judged(draw(np.random.default_rng([11, number]))).states[8:] for number in range(series)
    ]
    shares = [
        100.0 * np.mean([kind in series_states for series_states in states])
        for kind in ("alarm", "alert")
    ]
    return " | ".join(f"{share:.1f} %" for share in shares)


BETWEEN: tuple[Callable[[np.random.Generator], Drawn], ...] = (
    lambda rng: knee(rng, 5.0, between=True),
    lambda rng: knee(rng, 15.0, between=True),
    lambda rng: knee(rng, 15.0, 0.7, between=True),
    lambda rng: knee(rng, 30.0, between=True),
)


def probabilities(course: Drawn, recordings: int) -> np.ndarray:
    """Return P(severe) of each recording as `track` reports it after the last."""
    at, crf = NUMBER[:recordings], course.crf[:recordings]
    watched = MonitoredSeries(
        name="CRF", values=crf, smallest_change=CRF_LEAST, contact=True, describe=str
    )
    return split_stages(at, CRF_HZ * crf).probability * knee_weight(at, [watched])


def reliability_lines(series: int) -> Iterator[str]:
    """Yield calibration tables of P(severe); half of the series wear."""
    predicted: list[np.ndarray] = []
    true: list[np.ndarray] = []
    rows = [[draw for name, draw in WITHOUT_WEAR.items() if name in RELIABLE], BETWEEN]
    for number in range(series):
        for several in rows:
            rng = np.random.default_rng([77, number, len(several)])
            course = several[number % len(several)](rng)
            recordings = int(rng.integers(14, RECORDINGS + 1))
            predicted.append(probabilities(course, recordings))
            true.append(NUMBER[:recordings] > course.begins)
    yield from _bins(
        "last recording", *(np.array([values[-1] for values in both]) for both in (predicted, true))
    )
    yield from _bins(
        "earlier recordings",
        *(np.concatenate([values[:-1] for values in both]) for both in (predicted, true)),
    )
    yield from coverage_lines(series)


def coverage_lines(series: int) -> Iterator[str]:
    """Yield coverage of the break's 90 % interval in series where a severe stage is found."""
    yield ("\n| stage break | severe found | 90 % interval contains it | interval length, median |")
    yield "|---|---|---|---|"
    for scatter_hz in (5.0, 15.0, 30.0):
        for memory in (0.0, 0.7):
            held, lengths = [], []
            for number in range(series // 10):
                course = knee(np.random.default_rng([13, number]), scatter_hz, memory, between=True)
                found = split_stages(NUMBER, CRF_HZ * course.crf)
                if found.kind == "severe":
                    held.append(found.interval[0] <= course.begins <= found.interval[1])
                    lengths.append(found.interval[1] - found.interval[0])
            shares = (1000.0 * len(held) / series, 100.0 * np.mean(held))
            scatters = f"scatter {scatter_hz:g} Hz{', autocorrelation 0.7' if memory else ''}"
            yield (
                f"| {scatters} | {shares[0]:.0f} % | {shares[1]:.0f} % | {np.median(lengths):.2g} |"
            )


def _bins(whose: str, chance: np.ndarray, severe: np.ndarray) -> Iterator[str]:
    yield f"\n| P(severe) of the {whose} | recordings | mean of P | observed severe |"
    yield "|---|---|---|---|"
    for low, high in pairwise(BINS):
        inside = (chance >= low) & (chance < high)
        if inside.any():
            shares = (100.0 * chance[inside].mean(), 100.0 * severe[inside].mean())
            yield (
                f"| {low:g} to {min(high, 1.0):g} | {inside.sum()} | {shares[0]:.0f} % |"
                f" {shares[1]:.0f} % |"
            )


def found_row(draw: Callable[[np.random.Generator], Drawn], series: int) -> str:
    """Return shares detected and detected too early, and delays from the start of the stage."""
    delays = []
    for number in range(series):
        course = draw(np.random.default_rng([12, number]))
        states = judged(course).states
        delays.append(states.index("alarm") - course.begins if "alarm" in states else np.inf)
    late = np.array(delays)
    found, early = 100.0 * np.mean(np.isfinite(late)), 100.0 * np.mean(late < 0.0)
    within = np.sort(late)[int(np.ceil(0.9 * late.size)) - 1]
    delays = " | ".join(
        f"{delay:.0f}" if np.isfinite(delay) else "not reached"
        for delay in (np.median(late), within)
    )
    return f"{found:.1f} % | {early:.1f} % | {delays}"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.alarms", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="use a tenth of the series")
    for line in lines(fast=arguments.parse_args().fast):
        print(line, flush=True)
