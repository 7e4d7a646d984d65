"""How often the alarm speaks: series of indicators without wear, with the severe stage, and
machines run to failure.

Each series is judged after every one of its 40 recordings, as `watch` does. `python -m
benchmarks.alarms` runs this part alone; `--fast` a tenth of it.
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
)  # the paper's end, the rig's rise to its knee, slope behind it over before
SCATTERS = (0.001, 0.003, 0.005, 0.01)  # of CRF, drawn one a series
LEVEL_SCATTER = 0.1  # of the logarithm of the level: 0.9 dB
DEPTH_SCATTER = 0.14  # of the logarithm of a depth, as white noise of a second shows it
CYCLES = (6.0, 8.0, 12.0, 24.0)  # recordings a day


class Drawn(NamedTuple):
    """CRF over its first value, logarithm of the level; the recording at which the severe stage
    begins, if it does.

    `depth` is the logarithm of how deep the envelope is modulated at a fault's rate, `bands` those
    of velocity and two bands. `load` [N] and `temperature` [degC] as measured, where they are
    given.
    """

    crf: np.ndarray
    level: np.ndarray
    depth: np.ndarray
    bands: np.ndarray
    begins: float = np.nan
    load: np.ndarray | None = None
    temperature: np.ndarray | None = None


def remembered(rng: np.random.Generator, memory: float) -> np.ndarray:
    """Scatter of size 1 of which each recording keeps a share."""
    fresh = rng.standard_normal(RECORDINGS)
    kept = np.empty(RECORDINGS)
    kept[0] = fresh[0]
    for number in range(1, RECORDINGS):
        kept[number] = memory * kept[number - 1] + np.sqrt(1.0 - memory**2) * fresh[number]
    return kept


def drawn(
    rng: np.random.Generator,
    course: np.ndarray | float = 1.0,
    level: np.ndarray | float = 0.0,
    memory: float = 0.0,
    source: np.ndarray | float = 0.0,
) -> Drawn:
    """Courses of CRF and levels with scatter on them; `source` is by how much more of a bearing is
    heard than usual.
    """
    crf = course + rng.choice(SCATTERS) * remembered(rng, memory)
    heard = np.exp(2.0 * np.asarray(source))
    whole = level + 0.5 * np.log(0.5 * (1.0 + heard))
    depth = np.log(heard / (1.0 + heard)) + DEPTH_SCATTER * remembered(rng, memory)
    levels = [whole + LEVEL_SCATTER * remembered(rng, memory) for _ in range(4)]
    return Drawn(crf, levels[0], depth, np.array(levels[1:]))


def after(rng: np.random.Generator) -> np.ndarray:
    """0 up to a recording drawn, 1 from it on."""
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
    """CRF as load to the power of 0.1 to 0.3, the level as that of 0 to 1; the load measured to 1
    %.
    """
    ln = np.log(load / load[0])
    one = drawn(rng, np.exp(rng.uniform(0.1, 0.3) * ln), rng.uniform(0.0, 1.0) * ln, memory)
    return one._replace(load=load * (1.0 + 0.01 * rng.standard_normal(RECORDINGS)))


def given_step(rng: np.random.Generator, memory: float = 0.0) -> Drawn:
    return under_load(
        rng, 500.0 * rng.uniform(1.1, 2.0) ** (rng.choice([-1.0, 1.0]) * after(rng)), memory
    )


def in_turns(rng: np.random.Generator) -> Drawn:
    return under_load(rng, np.where(rng.random(RECORDINGS) < 0.5, 500.0, 800.0))


def warmth(rng: np.random.Generator, temperature: np.ndarray, memory: float = 0.0) -> Drawn:
    """CRF and level as powers of an oil's viscosity: Vogel's, of 30 to 300 mPa s at 40 degC;
    measured to 0.5 K.
    """
    thin = 1000.0 * (1.0 / (temperature + 95.0) - 1.0 / 135.0)
    size = rng.uniform(0.02, 0.12) / np.ptp(thin)
    one = drawn(
        rng, np.exp(-size * (thin - thin[-1])), -rng.uniform(0.0, 0.3) * (thin - thin[-1]), memory
    )
    return one._replace(temperature=temperature + 0.5 * rng.standard_normal(RECORDINGS))


def given_warm_up(rng: np.random.Generator, memory: float = 0.0) -> Drawn:
    cold = np.exp(-NUMBER / rng.uniform(2.0, 8.0))
    return warmth(rng, rng.uniform(50.0, 80.0) - rng.uniform(25.0, 45.0) * cold, memory)


def given_days(rng: np.random.Generator) -> Drawn:
    return warmth(
        rng, 60.0 + rng.uniform(5.0, 15.0) * np.sin(2.0 * np.pi * (NUMBER / rng.choice(CYCLES)))
    )


def given_season(rng: np.random.Generator) -> Drawn:
    return warmth(rng, 45.0 + rng.uniform(-20.0, 20.0) * NUMBER / RECORDINGS)


GIVEN: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "load step, load given": given_step,
    "load step, load given, scatter remembers 0.7": lambda rng: given_step(rng, 0.7),
    "two loads in turns, load given": in_turns,
    "warm-up, oil temperature given": given_warm_up,
    "warm-up, oil temperature given, scatter remembers 0.7": lambda rng: given_warm_up(rng, 0.7),
    "days of 10 to 30 K, oil temperature given": given_days,
    "season of up to 20 K, oil temperature given": given_season,
}

WITHOUT_WEAR: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "white scatter": drawn,
    "scatter that remembers 0.7": lambda rng: drawn(rng, memory=0.7),
    "scatter that remembers 0.9": lambda rng: drawn(rng, memory=0.9),
    "daily cycle of 1 %": lambda rng: daily(rng, 0.01),
    "daily cycle of 2 %": lambda rng: daily(rng, 0.02),
    "load step, CRF by 2 to 12 %, not given": load_step,
    "warm-up, CRF by 2 to 12 %": warm_up,
    "moved sensor, level by up to 13 dB": moved_sensor,
    "drift of modes, 2 %": drift_of_modes,
    "gain change, up to 20 dB": lambda rng: drawn(rng, level=rng.uniform(-2.3, 2.3) * after(rng)),
    "saturating trend, 5 to 30 %": saturating,
    "straight trend, 5 to 30 %": straight,
    "flat, then rising": steepening,
    "saturating trend, scatter remembers 0.7": lambda rng: saturating(rng, 0.7),
    "straight trend, scatter remembers 0.7": lambda rng: straight(rng, 0.7),
    "Hill curve, 50 %": hill,
}


def knee(
    rng: np.random.Generator, scatter_hz: float, memory: float = 0.0, *, between: bool = False
) -> Drawn:
    """The rig's course of CRF over recordings, its knee drawn among the 12th to the 24th, or
    anywhere between them.
    """
    begins = float(rng.uniform(12.0, 24.0) if between else rng.integers(12, 25))
    pace = RISE_HZ / begins
    course = CRF_HZ + np.where(
        begins > NUMBER, pace * NUMBER, RISE_HZ + AFTER * pace * (NUMBER - begins)
    )
    crf = (course + scatter_hz * remembered(rng, memory)) / CRF_HZ
    return drawn(rng)._replace(crf=crf, begins=begins)


def knee_under_load(rng: np.random.Generator, scatter_hz: float) -> Drawn:
    """The rig's knee under two loads in turns, which move CRF by 9 %."""
    one, load = knee(rng, scatter_hz), np.where(rng.random(RECORDINGS) < 0.5, 500.0, 800.0)
    measured = load * (1.0 + 0.01 * rng.standard_normal(RECORDINGS))
    return one._replace(crf=one.crf * (load / 500.0) ** (1.0 / 6.0), load=measured)


def knee_in_season(rng: np.random.Generator, scatter_hz: float) -> Drawn:
    """The rig's knee while the oil grows warmer all the time."""
    one, warm = (
        knee(rng, scatter_hz),
        warmth(rng, 35.0 + rng.uniform(5.0, 30.0) * NUMBER / RECORDINGS),
    )
    return one._replace(crf=one.crf * warm.crf, temperature=warm.temperature)


KNEES: dict[str, Callable[[np.random.Generator], Drawn]] = {
    "knee, CRF to 5 Hz": lambda rng: knee(rng, 5.0),
    "knee, CRF to 15 Hz": lambda rng: knee(rng, 15.0),
    "knee, CRF to 15 Hz, scatter remembers 0.7": lambda rng: knee(rng, 15.0, 0.7),
    "knee, CRF to 30 Hz": lambda rng: knee(rng, 30.0),
    "knee, CRF to 15 Hz, two loads in turns, given": lambda rng: knee_under_load(rng, 15.0),
    "knee, CRF to 15 Hz, a warming season, given": lambda rng: knee_in_season(rng, 15.0),
}


def to_failure(rng: np.random.Generator) -> Drawn:
    """Level only: steady, then up 15 to 25 times until the end, faster and faster; no contact
    resonance.
    """
    begins = rng.integers(15, 30)
    grown = np.maximum(NUMBER - begins, 0.0) / (RECORDINGS - 1 - begins)
    level = np.log(rng.uniform(15.0, 25.0)) * grown ** rng.uniform(1.0, 2.0)
    one = drawn(rng, np.nan, level, 0.5)
    return one._replace(begins=float(begins))


RELIABLE = (
    "white scatter",
    "scatter that remembers 0.7",
    "daily cycle of 1 %",
    "load step, CRF by 2 to 12 %, not given",
    "warm-up, CRF by 2 to 12 %",
    "drift of modes, 2 %",
    "saturating trend, 5 to 30 %",
    "straight trend, 5 to 30 %",
)
BINS = (0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.01)
CHANNELS = (RMS, "velocity", "band 1", "band 2", "depth")


def judged(one: Drawn) -> Alarm:
    """The alarm as `track` raises it, its stage asked for before an alarm by CRF."""
    met = [
        OperatingPoint(load_n=load, temperature_degc=warm)
        for load, warm in zip(_stated(one.load), _stated(one.temperature), strict=True)
    ]
    of_crf, of_level = (
        conditions_of(met, follows, ANY_CONTACT.oil) for follows in (ANY_CONTACT.crf, LEVEL)
    )
    choices = {"smallest_change": CRF_LEAST, "contact": True, "describe": str, "relative": True}
    crf = MonitoredSeries(name="CRF", values=one.crf, conditions=of_crf, **choices)
    choices = {
        "smallest_change": LEVEL_LEAST,
        "contact": False,
        "describe": str,
        "conditions": of_level,
    }
    every = zip(CHANNELS, (one.level, *one.bands, one.depth), strict=True)
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
        reference = crf.at_baseline_conditions(0, number + 1)[0]
        return split_stages(NUMBER[: number + 1], CRF_HZ * reference).kind == "severe"

    sight = (
        RecordingStatus()
        if np.isfinite(one.crf).any()
        else RecordingStatus("cannot-tell", "no contact resonance")
    )
    watched = [crf, *levels] if np.isfinite(one.crf).any() else levels
    excuses = Warming(NUMBER, watched[:1], levels, "").excuses
    return sequential_alarm(
        NUMBER, watched, [sight] * RECORDINGS, checks=AlarmChecks(severe, excuses)
    )


def _stated(values: np.ndarray | None) -> list[float | None]:
    return [None] * RECORDINGS if values is None else [*values]


class Rows:
    """Rows that are done, kept in a file as long as the code behind them is the same; a run goes on
    behind them.
    """

    def __init__(self, file: Path = KEPT) -> None:
        self.file, self.code = (
            file,
            sha256(b"".join(path.read_bytes() for path in SOURCES)).hexdigest(),
        )
        self.done: dict[str, str] = {}
        if file.is_file():
            told = json.loads(file.read_text("utf-8"))
            self.done = told["rows"] if told["code"] == self.code else {}

    def row(self, name: str, made: Callable[[], str]) -> str:
        """A row, made once."""
        if name not in self.done:
            self.done[name] = made()
            self.file.parent.mkdir(exist_ok=True)
            self.file.write_text(json.dumps({"code": self.code, "rows": self.done}), "utf-8")
        return self.done[name]


def lines(*, fast: bool = False) -> Iterator[str]:
    """Markdown, a line at a time; `fast` takes a tenth of the series. What was cut off goes on
    where it stopped.
    """
    series = SERIES // (10 if fast else 1)
    rows = Rows()
    yield (
        f"## Alarms: {series} series of {RECORDINGS} recordings a row, one false alarm in"
        f" {1.0 / FALSE_ALARM_RATE:.0f}\n"
    )
    yield (
        "| nothing wears | ever an alarm | ever an alert | ever cannot tell, behind the baseline |"
    )
    yield "|---|---|---|---|"
    for name, draw in (WITHOUT_WEAR | GIVEN).items():
        yield f"| {name} | {rows.row(f'{series} {name}', partial(quiet_row, draw, series))} |"
    yield (
        "\n| the severe stage begins | found | too early | recordings until then, median | 90 %"
        " within |"
    )
    yield "|---|---|---|---|---|"
    for name, draw in (KNEES | {"level alone, up 15 to 25 times by the end": to_failure}).items():
        yield f"| {name} | {rows.row(f'{series} {name}', partial(found_row, draw, series))} |"
    yield rows.row(f"{series} P(severe)", lambda: "\n".join(reliability_lines(10 * series)))


def quiet_row(draw: Callable[[np.random.Generator], Drawn], series: int) -> str:
    """Shares of series without wear that are ever said to be anything but healthy."""
    states = [
        judged(draw(np.random.default_rng([11, number]))).states[8:] for number in range(series)
    ]
    shares = [
        100.0 * np.mean([kind in one for one in states])
        for kind in ("alarm", "alert", "cannot-tell")
    ]
    return " | ".join(f"{share:.1f} %" for share in shares)


BETWEEN: tuple[Callable[[np.random.Generator], Drawn], ...] = (
    lambda rng: knee(rng, 5.0, between=True),
    lambda rng: knee(rng, 15.0, between=True),
    lambda rng: knee(rng, 15.0, 0.7, between=True),
    lambda rng: knee(rng, 30.0, between=True),
)


def probabilities(one: Drawn, recordings: int) -> np.ndarray:
    """P(severe) of each recording, as `track` gives it after the last."""
    at, crf = NUMBER[:recordings], one.crf[:recordings]
    watched = MonitoredSeries(
        name="CRF", values=crf, smallest_change=CRF_LEAST, contact=True, describe=str
    )
    return split_stages(at, CRF_HZ * crf).probability * knee_weight(at, [watched])


def reliability_lines(series: int) -> Iterator[str]:
    """How often a recording is severe that is said to be so with some probability; half of the
    series wear.
    """
    said: list[np.ndarray] = []
    true: list[np.ndarray] = []
    rows = [[draw for name, draw in WITHOUT_WEAR.items() if name in RELIABLE], BETWEEN]
    for number in range(series):
        for several in rows:
            rng = np.random.default_rng([77, number, len(several)])
            one = several[number % len(several)](rng)
            recordings = int(rng.integers(14, RECORDINGS + 1))
            said.append(probabilities(one, recordings))
            true.append(NUMBER[:recordings] > one.begins)
    yield from _bins(
        "last recording", *(np.array([one[-1] for one in both]) for both in (said, true))
    )
    yield from _bins(
        "earlier recordings", *(np.concatenate([one[:-1] for one in both]) for both in (said, true))
    )
    yield from held_lines(series)


def held_lines(series: int) -> Iterator[str]:
    """How often the break's 90 % interval holds it, where a severe stage is found."""
    yield (
        "\n| the break of the stages | severe found | 90 % interval holds it | its length, median |"
    )
    yield "|---|---|---|---|"
    for scatter_hz in (5.0, 15.0, 30.0):
        for memory in (0.0, 0.7):
            held, lengths = [], []
            for number in range(series // 10):
                one = knee(np.random.default_rng([13, number]), scatter_hz, memory, between=True)
                found = split_stages(NUMBER, CRF_HZ * one.crf)
                if found.kind == "severe":
                    held.append(found.interval[0] <= one.begins <= found.interval[1])
                    lengths.append(found.interval[1] - found.interval[0])
            shares = (1000.0 * len(held) / series, 100.0 * np.mean(held))
            scatters = f"scatter {scatter_hz:g} Hz{', remembers 0.7' if memory else ''}"
            yield (
                f"| {scatters} | {shares[0]:.0f} % | {shares[1]:.0f} % | {np.median(lengths):.2g} |"
            )


def _bins(whose: str, chance: np.ndarray, severe: np.ndarray) -> Iterator[str]:
    yield f"\n| P(severe) of the {whose} | recordings | mean of P | severe indeed |"
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
    """Shares found and found too early, and delays from the beginning of the stage."""
    delays = []
    for number in range(series):
        one = draw(np.random.default_rng([12, number]))
        states = judged(one).states
        delays.append(states.index("alarm") - one.begins if "alarm" in states else np.inf)
    late = np.array(delays)
    found, early = 100.0 * np.mean(np.isfinite(late)), 100.0 * np.mean(late < 0.0)
    within = np.sort(late)[int(np.ceil(0.9 * late.size)) - 1]
    return f"{found:.1f} % | {early:.1f} % | {np.median(late):.0f} | {within:.0f}"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.alarms", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="a tenth of the series")
    for line in lines(fast=arguments.parse_args().fast):
        print(line, flush=True)
