"""How often stages are right that are read from CRF, from the line's damping, or from both with one break.

`python -m benchmarks.damping_stages` runs this part alone. Indicators are drawn about known courses: the paper's
twelve rings, five tests each, CRF off by 15 Hz and damping by 10 % from test to test. Of the solved contact
(benchmarks.damping has its library) every ring is a surface of its own, and all else damps with 0.01.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.arrays import Field
from asperity.paper import SAMPLES_SQ_UM
from asperity.wear import StageSource, split_stages
from benchmarks.damping import REST, SEEDS, Point, between, points

TESTS, TRIALS = 5, 200
CRF_STD, DAMPING_STD = 15.0, 0.1  # Hz; relative
ENDS = (SAMPLES_SQ_UM[0], SAMPLES_SQ_UM[-1])
LOWEST, HIGHEST = 2921.93, 3811.88  # the paper's printed CRFs
FULL_LOAD = 3834.0
SOURCES: tuple[StageSource, ...] = ("crf", "damping", "both")
KINDS = ("severe", "running-in", "no distinct stage", "no change", "disagree")

Course = Callable[[Field], Field]


class Truth(NamedTuple):
    """CRF [Hz] and damping ratio over Sq [um], and where each breaks, if it does."""

    name: str
    crf: Course
    damping: Course
    knee: float | None = None


def frequency(knee: float, up: bool = True) -> Course:
    ends = (LOWEST, 3640.0, HIGHEST) if up else (HIGHEST, 3093.0, LOWEST)
    return lambda sq: np.interp(sq, (ENDS[0], knee, ENDS[1]), ends)


def width(knee: float, down: bool = True) -> Course:
    ends = np.log((0.04, 0.014, 0.012) if down else (0.012, 0.034, 0.04))
    return lambda sq: np.asarray(np.exp(np.interp(sq, (ENDS[0], knee, ENDS[1]), ends)))


def level(value: float) -> Course:
    return lambda sq: np.full(sq.shape, value)


def smooth(first: float, last: float) -> Course:
    def course(sq: Field) -> Field:
        grown = (1.0 - np.exp(-(sq - ENDS[0]) / 0.8)) / (1.0 - np.exp(-(ENDS[1] - ENDS[0]) / 0.8))
        return np.asarray(first + (last - first) * grown)

    return course


TRUTHS = (
    Truth("both break at 1.8 um", frequency(1.8), width(1.8), 1.8),
    Truth("CRF level, damping breaks at 1.8 um", level(3400.0), width(1.8), 1.8),
    Truth("CRF breaks at 1.8 um, damping level", frequency(1.8), level(0.02), 1.8),
    Truth("CRF breaks at 1.31 um, damping at 2.43 um", frequency(1.31), width(2.43)),
    Truth("both smooth", smooth(LOWEST, HIGHEST), smooth(0.04, 0.012)),
    Truth("both level", level(3400.0), level(0.02)),
    Truth("CRF breaks at 1.8 um, damping rises", frequency(1.8), width(1.8, down=False)),
)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Markdown, a line at a time."""
    yield f"## Stages from CRF, damping and both, {TRIALS} trials a row\n"
    heads = [
        "truth",
        "read from",
        *(f"said: {kind}" for kind in KINDS),
        "break, mean ± sd [um]",
        "90 % interval covers",
    ]
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    trials = TRIALS // 5 if fast else TRIALS
    for truth in TRUTHS:
        drawn = [draws(truth, np.random.default_rng([7, number])) for number in range(trials)]
        yield from rows(truth.name, truth.knee, drawn)
    library = points(SEEDS)
    for law in ("by the contact's own stiffness", "by (CLR F)^(1/6)"):
        drawn = [solved(library, law, np.random.default_rng([8, number])) for number in range(trials)]
        yield from rows(f"the solved contact, CRF {law}", None, drawn)


def draws(truth: Truth, rng: np.random.Generator) -> tuple[Field, Field]:
    """CRF and damping of every test."""
    sq = np.repeat(SAMPLES_SQ_UM, TESTS)
    return scattered(truth.crf(sq), truth.damping(sq), rng)


def solved(library: Sequence[Point], law: str, rng: np.random.Generator) -> tuple[Field, Field]:
    """The same of rings that are surfaces of the library each."""
    seeds = sorted({point.seed for point in library})
    rings = np.array([between(library, sq, int(rng.choice(seeds))) for sq in SAMPLES_SQ_UM])
    clr, stiffness, damping = np.repeat(rings, TESTS, axis=0).T
    crf = FULL_LOAD * np.maximum(clr, 0.02) ** (1.0 / 6.0)
    if law.startswith("by the contact"):  # of 1 kg, in hertz
        crf = np.sqrt(stiffness) / (2.0 * np.pi)
    return scattered(crf, REST + damping, rng)


def scattered(crf: Field, damping: Field, rng: np.random.Generator) -> tuple[Field, Field]:
    return crf + CRF_STD * rng.standard_normal(crf.size), damping * np.exp(
        DAMPING_STD * rng.standard_normal(damping.size)
    )


def rows(name: str, knee: float | None, drawn: Sequence[tuple[Field, Field]]) -> Iterator[str]:
    sq = np.repeat(SAMPLES_SQ_UM, TESTS)
    for source in SOURCES:
        found = [
            split_stages(
                sq, crf, crf_std_hz=CRF_STD, damping_ratio=damping, damping_std=DAMPING_STD * damping, source=source
            )
            for crf, damping in drawn
        ]
        share = [100.0 * np.mean([one.kind == kind for one in found]) for kind in KINDS]
        broken = [one for one in found if one.found]
        splits = np.array([one.split for one in broken])
        place = f"{splits.mean():.2f} ± {splits.std():.2f}" if len(broken) > 0.1 * len(found) else "-"
        covers = "-"
        if knee is not None and place != "-":
            covers = f"{100.0 * np.mean([one.interval[0] <= knee <= one.interval[1] for one in broken]):.0f} %"
        yield f"| {name} | {source} | {' | '.join(f'{part:.0f} %' for part in share)} | {place} | {covers} |"


def main() -> None:
    """Print the table as Markdown."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.damping_stages", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="a fifth of the trials")
    with threadpool_limits(1):
        for line in lines(fast=arguments.parse_args().fast):
            print(line, flush=True)


if __name__ == "__main__":
    main()
