"""One line on several sensors: what is the contact's lies at one place for all of them, whatever is between.

Each sensor's series is separated by itself, then each recording's line is fitted to all sensors together. What the
errors of two sensors have in common is measured: an interval narrows only by what is independent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from asperity.arrays import Field, Mask
from asperity.errors import BadInput
from asperity.signals import Spectrum
from asperity.wear.expected import Blocks, expected_density
from asperity.wear.indicators import STRONG_EVIDENCE
from asperity.wear.resonance import Resonance, fitted_resonance, no_resonance
from asperity.wear.separation import Heard, Joint, Lines, alone_beside, best_of, coarser, each, places, search
from asperity.wear.series import (
    FEWEST_RECORDINGS,
    LARGEST_MISFIT,
    JudgedLine,
    Separated,
    gain_of,
    left_over,
    misfit_std,
    objection_to,
    rival_of,
    separated,
    shares_of,
)

APART, APART_WIDTHS = 3.0, 0.25  # deviations, and half-power widths, by both of which two lines are not one
ESTABLISHED, FEWEST_AGREED = 0.5, 3  # share and number of recordings in which sensors have heard one line
DISAGREE = "the sensors disagree"
MOST_COMMON = 0.9  # of the errors of two sensors, where they are compared


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLines:
    """What several sensors say of each recording.

    `resonances` one a recording, its height that on the first sensor, nan where that hears none; `heard_on` the names
    of the sensors that hear its line; `alone` what each sensor's series says by itself, None where it has no spectrum.
    `common` is the share of the sensors' errors that they have in common, nan where too little tells.
    """

    resonances: tuple[Resonance, ...]
    heard_on: tuple[tuple[str, ...], ...]
    alone: Mapping[str, tuple[Resonance | None, ...]]
    common: float


def resonances_of_sensors(
    spectra: Mapping[str, Sequence[Spectrum | None]],
    *,
    band_hz: tuple[float, float],
    kept: Mapping[str, Sequence[Mask | None]] | None = None,
) -> SensorLines:
    """Find the contact resonance that the sensors of one machine have in common, in each recording.

    A line is the contact's where two sensors hear it at one place. Where they have done so in half of the recordings,
    one of them is enough for another; a line that only one sensor ever hears is a structure's as likely, and lines that
    differ are no line.

    Parameters
    ----------
    spectra : by sensor, one a recording and None where it has none, all on the same lines
    band_hz : where to look [Hz]
    kept : masks (lines,) of the lines that count, as `spectra`; all by default

    Raises
    ------
    BadInput
        as `series_resonances`, or where no sensor has 6 recordings.
    """
    rows = {name: [i for i, one in enumerate(every) if one is not None] for name, every in spectra.items()}
    counted = [name for name, there in rows.items() if len(there) >= FEWEST_RECORDINGS]
    if not counted:
        raise BadInput(f"no sensor has {FEWEST_RECORDINGS} recordings, which the joint separation needs; record more")
    by_sensor: dict[str, Separated] = {}
    for name in counted:
        used = [one for one in spectra[name] if one is not None]
        masks = None if kept is None else [mask for mask in kept[name] if mask is not None]
        by_sensor[name] = separated(used, band_hz=band_hz, kept=masks)
    count = len(next(iter(spectra.values())))
    alone: dict[str, tuple[Resonance | None, ...]] = {}
    for name, there in rows.items():
        found: list[Resonance | None] = [None] * count
        for place, number in enumerate(there):
            found[number] = by_sensor[name].resonances[place] if name in by_sensor else _too_few(len(there), band_hz)
        alone[name] = tuple(found)
    if len(counted) == 1:
        (only,) = counted
        nothing = no_resonance(f"only {only} has enough recordings, and none here", band_hz, "joint")
        every = tuple(one or nothing for one in alone[only])
        return SensorLines(
            resonances=every, heard_on=tuple((only,) * one.found for one in every), alone=alone, common=np.nan
        )
    return _Together(by_sensor, {name: rows[name] for name in counted}, alone, band_hz).judged(count)


def _too_few(count: int, band_hz: tuple[float, float]) -> Resonance:
    reason = f"the joint separation needs {FEWEST_RECORDINGS} recordings of a sensor, and this one has {count}"
    return no_resonance(reason, band_hz, "joint")


class _Fit(NamedTuple):
    """Recordings fitted on the same sensors: what each hears of them, the lines, and how likely they are elsewhere."""

    names: list[str]
    numbers: list[int]
    heard: list[Heard]
    lines: Lines
    elsewhere: Field  # -ln likelihood of a line at each template, all sensors together

    def joint(self, sensor: int) -> Joint:
        """The fit as one sensor has it."""
        heard = self.heard[sensor]
        own = self.lines.own[sensor]
        return Joint(heard.at._replace(own=own), 0.0, np.full_like(own, np.nan), heard.doubt)


class _Together:
    """Sensors whose series have been separated, to be judged together."""

    def __init__(
        self,
        by_sensor: Mapping[str, Separated],
        rows: Mapping[str, list[int]],
        alone: Mapping[str, tuple[Resonance | None, ...]],
        band_hz: tuple[float, float],
    ) -> None:
        self.by_sensor, self.rows, self.alone, self.band_hz = by_sensor, rows, alone, band_hz

    def judged(self, count: int) -> SensorLines:
        """Every recording, by the sensors that it has."""
        there: dict[tuple[str, ...], list[int]] = {}
        for number in range(count):
            there.setdefault(tuple(name for name, rows in self.rows.items() if number in rows), []).append(number)
        fits = [self._fitted([*names], numbers) for names, numbers in there.items() if len(names) > 1]
        common = {
            pair: share for pair in combinations(self.by_sensor, 2) if np.isfinite(share := _in_common(pair, fits))
        }
        wider = self._wider(common)
        heard_on: list[tuple[str, ...]] = [()] * count
        lines: list[Resonance] = [no_resonance("no sensor has a spectrum here", self.band_hz, "joint")] * count
        for fit in fits:
            for number, (line, names) in zip(fit.numbers, self._agreed(fit, common, wider), strict=True):
                lines[number], heard_on[number] = line, names
        for number in range(count):
            if not heard_on[number] and not self._apart(number):
                lines[number], heard_on[number] = self._by_one(number, lines[number], heard_on, wider)
        shares = [*common.values()]
        return SensorLines(
            resonances=tuple(lines),
            heard_on=tuple(heard_on),
            alone=self.alone,
            common=float(np.mean(shares)) if shares else np.nan,
        )

    def _fitted(self, names: list[str], numbers: list[int]) -> _Fit:
        """One line for all sensors in each of some recordings, beside what each sensor's series has settled."""
        heard, values, templates = [], [], self.by_sensor[names[0]].found.templates
        total = np.zeros((len(numbers), templates.f0.size))
        for name in names:
            one = self.by_sensor[name]
            rows = [self.rows[name].index(number) for number in numbers]
            blocks = Blocks(one.blocks.centre, one.blocks.density[rows], one.blocks.weight[rows])
            coarse, settled = coarser(blocks), one.found.joint.parameters
            base = np.exp(np.interp(coarse.centre, blocks.centre, settled.base))
            cost, at_best = search(coarse, base, templates)
            total = total + cost
            values.append(at_best)
            heard.append(Heard(blocks, settled, one.found.joint.doubt))
        starts = [best_of(total, at_best, templates) for at_best in values]
        heard = [one._replace(at=one.at._replace(own=own)) for one, own in zip(heard, starts, strict=True)]
        return _Fit(names, numbers, heard, each(heard), total)

    def _wider(self, common: Mapping[tuple[str, str], float]) -> float:
        """By how much sensors differ more than their deviations say: what is between changes their lines, too."""
        squares = []
        for first, second in combinations(self.by_sensor, 2):
            share = min(common.get((first, second), 0.0), MOST_COMMON)
            for one, other in zip(self.alone[first], self.alone[second], strict=True):
                if one is not None and other is not None and one.found and other.found and not _differ(one, other):
                    variance = one.crf_std**2 + other.crf_std**2 - 2.0 * share * one.crf_std * other.crf_std
                    squares.append((one.crf_hz - other.crf_hz) ** 2 / variance)
        return float(np.sqrt(max(float(np.mean(squares)), 1.0))) if len(squares) >= FEWEST_AGREED else 1.0

    def _apart(self, number: int) -> str:
        """That sensors hear different lines in a recording, in words; empty where they do not."""
        found = [(name, one) for name, all_ in self.alone.items() if (one := all_[number]) is not None and one.found]
        for (name, one), (other_name, other) in combinations(found, 2):
            if _differ(one, other):
                return (
                    f"{DISAGREE}: a line at {one.crf_hz:.0f} ± {one.crf_std:.0f} Hz on {name}, at "
                    f"{other.crf_hz:.0f} ± {other.crf_std:.0f} Hz on {other_name}"
                )
        return ""

    def _agreed(
        self, fit: _Fit, common: Mapping[tuple[str, str], float], wider: float
    ) -> list[tuple[Resonance, tuple[str, ...]]]:
        """The lines that two sensors hear, and who does; else why there is none."""
        shares = _shares(fit.names, common)
        counts_as = 1.0 + np.sum(shares, axis=1).mean()  # one sensor and its copy are one
        gains, misfits, weights = [], [], []
        for sensor, heard in enumerate(fit.heard):
            joint = fit.joint(sensor)
            gains.append(gain_of(heard.blocks, joint)[0])
            misfits.append(left_over(heard.blocks, expected_density(heard.blocks, joint.parameters)))
            weights.append(heard.blocks.weight.sum(axis=1))
        hears = (np.array(gains) - np.log(weights) > STRONG_EVIDENCE) & (np.array(misfits) <= LARGEST_MISFIT)
        evidence = np.sum(gains, axis=0) / counts_as - (2.0 + len(fit.names)) * np.log(np.sum(weights, axis=0))
        std = self._deviations(fit, shares)
        std[:, :, 1] *= wider
        return [
            self._line(
                fit, place, [name for name, there in zip(fit.names, hears[:, place], strict=True) if there],
                float(evidence[place]), float(np.min(np.array(misfits)[:, place])), float(counts_as), std[:, place],
            )
            for place in range(len(fit.numbers))
        ]  # fmt: skip

    def _line(
        self,
        fit: _Fit,
        place: int,
        names: list[str],
        evidence: float,
        misfit: float,
        counts_as: float,
        std: Field,
    ) -> tuple[Resonance, tuple[str, ...]]:
        """One recording's line, if two sensors hear it."""
        number = fit.numbers[place]
        if disagreement := self._apart(number):
            return no_resonance(disagreement, self.band_hz, "joint"), ()
        fitted = np.exp(fit.lines.own[0, place, :3])
        deviations = std[0, :3] * fitted
        f0, zeta = float(fitted[1]), float(fitted[2])
        templates = self.by_sensor[fit.names[0]].found.templates
        rival = rival_of(f0, zeta, fit.elsewhere[place] / counts_as, templates)
        line = JudgedLine(f0, float(deviations[1]), zeta, evidence, misfit, *rival)
        objection = objection_to(line, self.band_hz)
        if objection is None and len(names) < 2:
            objection = f"a line at {f0:.0f} Hz is heard on {names[0]} only" if names else "no two sensors hear a line"
        if objection is not None:
            return no_resonance(objection, self.band_hz, "joint", evidence=evidence), ()
        first = fit.heard[0]
        resonance = fitted_resonance(
            fitted,
            np.where([self.by_sensor[fit.names[0]].found.stands, False, False], np.nan, deviations),
            reason=f"a line {line.width:.0f} Hz wide on {' and '.join(names)} (BIC {evidence:+.0f})",
            band_hz=self.band_hz,
            method="joint",
            evidence=evidence,
            background=(first.blocks.centre, np.exp(fit.lines.own[0, place, 3] + first.at.base)),
        )
        if fit.names[0] != next(iter(self.alone)):
            resonance = replace(resonance, crfa=np.nan, crfa_std=np.nan)
        return resonance, tuple(names)

    def _by_one(
        self, number: int, line: Resonance, heard_on: Sequence[tuple[str, ...]], wider: float
    ) -> tuple[Resonance, tuple[str, ...]]:
        """A line that one sensor hears, where it has elsewhere been the one that others hear too."""
        found = [(name, one) for name, all_ in self.alone.items() if (one := all_[number]) is not None and one.found]
        if not found:
            return line, ()
        name, own = found[0]
        together = [names for names in heard_on if name in names and len(names) > 1]
        ever = sum(one is not None and one.found for one in self.alone[name])
        if len(together) < max(FEWEST_AGREED, ESTABLISHED * ever):
            others = " and ".join(other for other in self.by_sensor if other != name)
            reason = (
                f"a line at {own.crf_hz:.0f} Hz is heard on {name} only, not on {others}: a structure's looks the same"
            )
            return no_resonance(reason, self.band_hz, "joint", evidence=own.evidence), ()
        first = name == next(iter(self.alone))
        height = (own.crfa, own.crfa_std) if first else (np.nan, np.nan)
        return replace(
            own, crf_std=own.crf_std * wider, crfa=height[0], crfa_std=height[1],
            reason=f"{own.reason}, here on {name} only",
        ), (name,)  # fmt: skip

    def _deviations(self, fit: _Fit, shares: Field) -> Field:
        """Standard deviations (sensors, recordings, 4): what is independent, what is common, what a machine brings."""
        inverse, dragged = fit.lines.inverse, fit.lines.dragged
        variance = np.einsum("npp->np", inverse).copy()
        relative = [shares_of(heard.blocks, fit.joint(sensor))[0] for sensor, heard in enumerate(fit.heard)]
        information = np.array([point.own_information[:, 1, 1] for point in fit.lines.points])
        part = information / information.sum(axis=0)
        brought = np.zeros(inverse.shape[:2])
        of_base = []
        for sensor, heard in enumerate(fit.heard):
            at = places(sensor)
            misfit = misfit_std(heard.blocks, fit.joint(sensor), self.by_sensor[fit.names[sensor]].found.witnesses)
            brought[:, [at[0], at[3]]] += misfit[:, [0, 3]]
            brought[:, [1, 2]] += part[sensor][:, None] * misfit[:, [1, 2]]
            base = self._of_the_base(fit, sensor)
            variance[:, [at[0], at[3]]] += base[:, [0, 3]] ** 2
            of_base.append(part[sensor][:, None] * base[:, [1, 2]])
            for other in range(len(fit.heard)):
                if other != sensor:
                    weight = np.sqrt(heard.blocks.weight * fit.heard[other].blocks.weight)
                    score = np.einsum("npb,nqb,nb->npq", relative[sensor], relative[other], weight, optimize=True)
                    both = inverse[:, :, at] @ score @ inverse[:, places(other), :]
                    variance += shares[sensor, other] * np.einsum("npp->np", both)
        alike = shares + np.eye(len(fit.heard))
        variance[:, [1, 2]] += np.einsum("snp,st,tnp->np", of_base, alike, of_base)
        of_transfer = [
            np.sqrt(np.einsum("npc,cd,npd->np", one, heard.doubt, one, optimize=True))
            for one, heard in zip(dragged, fit.heard, strict=True)
        ]
        variance += np.einsum("snp,st,tnp->np", of_transfer, alike, of_transfer)
        std = np.hypot(np.sqrt(variance), brought)
        return np.stack([std[:, places(sensor)] for sensor in range(len(fit.heard))])

    def _of_the_base(self, fit: _Fit, sensor: int) -> Field:
        """What a base, known as well as its series tells, adds to the deviations of lines; (recordings, 4)."""
        name, heard = fit.names[sensor], fit.heard[sensor]
        rows = [self.rows[name].index(number) for number in fit.numbers]
        settled = self.by_sensor[name].found.joint
        own = settled.parameters.own[rows]
        known = alone_beside(heard.blocks, settled.parameters._replace(own=own), heard.doubt).std
        return np.asarray(np.sqrt(np.maximum(settled.std[rows] ** 2 - known**2, 0.0)))


def _differ(one: Resonance, other: Resonance) -> bool:
    """Whether two lines are not one."""
    apart = abs(one.crf_hz - other.crf_hz)
    width = 2.0 * max(one.damping_ratio * one.crf_hz, other.damping_ratio * other.crf_hz)
    return apart > max(APART * float(np.hypot(one.crf_std, other.crf_std)), APART_WIDTHS * width)


def _shares(names: Sequence[str], common: Mapping[tuple[str, str], float]) -> Field:
    """The share of their errors that sensors have in common, (sensors, sensors); 0 with themselves."""
    shares = np.zeros((len(names), len(names)))
    for (i, first), (j, second) in combinations(enumerate(names), 2):
        shares[i, j] = shares[j, i] = common.get((first, second), common.get((second, first), 1.0))
    return shares


def _in_common(pair: tuple[str, str], fits: Sequence[_Fit]) -> float:
    """The correlation of what is left of two sensors' spectra where it moves their line, and its own deviation."""
    product, weights, squares, powers = 0.0, 0.0, 0.0, np.zeros(2)
    for fit in fits:
        if not set(pair) <= set(fit.names):
            continue
        felt, off = [], []
        for name in pair:
            sensor = fit.names.index(name)
            blocks, joint = fit.heard[sensor].blocks, fit.joint(sensor)
            relative, expected = shares_of(blocks, joint)
            felt.append(np.sqrt(blocks.weight) * np.abs(relative[:, 1]))
            off.append(np.sqrt(blocks.weight) * (blocks.density / expected - 1.0))
        both = felt[0] * felt[1]
        product += float(np.sum(both * off[0] * off[1]))
        powers += [np.sum(both * one**2) for one in off]
        weights += float(np.sum(both))
        squares += float(np.sum(both**2))
    if not np.all(powers > 0.0):
        return np.nan
    return float(np.clip(product / np.sqrt(np.prod(powers)) + np.sqrt(squares) / weights, 0.0, 1.0))
