"""One line on several sensors: what is the contact's lies at one place for all of them, whatever is between.

Each sensor's series is separated by itself, then each recording's line is fitted to all sensors
together. What the errors of two sensors have in common is measured: an interval narrows only by
what is independent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum
from asperity.resonance.indicators import STRONG_EVIDENCE
from asperity.resonance.residuals import Brought, brought, left_over
from asperity.resonance.resonance import Resonance, fitted_resonance, no_resonance
from asperity.resonance.sensor_agreement import Agreement, Fit, differ, in_common, shares_in_common
from asperity.resonance.sensor_change import moved_at
from asperity.resonance.separation import Heard, alone_beside, coarser, each, levelled, places
from asperity.resonance.series import (
    FEWEST_RECORDINGS,
    LARGEST_MISFIT,
    JudgedLine,
    Separated,
    Shared,
    gain_of,
    is_silent,
    objection_to,
    rival_of,
    separated,
    separated_beside,
)
from asperity.resonance.spectrum_model import Blocks, expected_density, shares_of

ESTABLISHED, FEWEST_AGREED = (
    0.5,
    3,
)  # share and number of recordings in which sensors have heard one line
DISAGREE = "the sensors disagree"
MOST_COMMON = 0.9  # of the errors of two sensors, where they are compared
SpectraBySensor = Mapping[str, Sequence[Spectrum | None]]  # one a recording, None where it has none
MasksBySensor = Mapping[str, Sequence[Mask | None]]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLines:
    """What several sensors say of each recording.

    `resonances` one a recording, its height that on the first sensor, nan where that hears none;
    `heard_on` the names of the sensors that hear its line; `alone` what each sensor's series says
    by itself, None where it has no spectrum. `common` is the share of the sensors' errors that
    they have in common, nan where too little tells. `moved` are recordings with which a sensor
    hears through another structure, by number, and the sensor.
    """

    resonances: tuple[Resonance, ...]
    heard_on: tuple[tuple[str, ...], ...]
    alone: Mapping[str, tuple[Resonance | None, ...]]
    common: float
    moved: tuple[tuple[int, str], ...] = ()


def resonances_of_sensors(
    spectra: SpectraBySensor,
    *,
    band_hz: tuple[float, float],
    kept: MasksBySensor | None = None,
) -> SensorLines:
    """Find the contact resonance that the sensors of one machine have in common, in each recording.

    A line is the contact's where two sensors hear it at one place. Where they have done so in half
    of the recordings, one of them is enough for another; a line that only one sensor ever hears is
    a structure's as likely, and lines that differ are no line.

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
    return learn_sensors(spectra, band_hz=band_hz, kept=kept)[0]


def learn_sensors(
    spectra: SpectraBySensor,
    *,
    band_hz: tuple[float, float],
    kept: MasksBySensor | None = None,
) -> tuple[SensorLines, "SharedBySensors"]:
    """The lines of `resonances_of_sensors`, and what they rest on, by which further recordings can be judged.

    Where a sensor is moved, all recordings behind it are a series of their own.
    """
    counted = _counted(spectra, band_hz)
    if not counted:
        raise BadInput(
            f"no sensor has {FEWEST_RECORDINGS} recordings, which the joint separation needs; record more"
        )
    by_sensor = {}
    for name in counted:
        used, masks = _used(spectra, kept, name, band_hz)
        by_sensor[name] = separated(used, band_hz=band_hz, kept=masks)
    rows = _rows(spectra, band_hz)
    moves = {name: moved_at(one.blocks, one.found.joint) for name, one in by_sensor.items()}
    where = [(rows[name][first], name) for name, first in moves.items() if first is not None]
    if where:
        return _parted(spectra, band_hz, kept, min(where))
    lines, agreement = _Together(by_sensor, spectra, band_hz).judged()
    shared = {name: one.shared for name, one in by_sensor.items()}
    return lines, SharedBySensors(by_sensor=shared, agreement=agreement, band_hz=band_hz)


def _parted(
    spectra: SpectraBySensor,
    band_hz: tuple[float, float],
    kept: MasksBySensor | None,
    move: tuple[int, str],
) -> tuple[SensorLines, "SharedBySensors"]:
    """Recordings before a move and behind it, each part by itself; what it rests on is that of the last."""
    first, _ = move
    (before, _), (behind, shared) = (
        learn_sensors(
            {name: every[part] for name, every in spectra.items()},
            band_hz=band_hz,
            kept=None if kept is None else {name: every[part] for name, every in kept.items()},
        )
        for part in (slice(first), slice(first, None))
    )
    lines = SensorLines(
        resonances=before.resonances + behind.resonances,
        heard_on=before.heard_on + behind.heard_on,
        alone={name: every + behind.alone[name] for name, every in before.alone.items()},
        common=behind.common,
        moved=(*before.moved, move, *((first + number, name) for number, name in behind.moved)),
    )
    return lines, shared


@dataclass(frozen=True, eq=False, kw_only=True)
class SharedBySensors:
    """What the recordings of several sensors share, as some of them have settled it: enough to judge others beside."""

    by_sensor: Mapping[str, Shared]
    agreement: Agreement
    band_hz: tuple[float, float]

    def fits(self, spectra: SpectraBySensor, band_hz: tuple[float, float]) -> bool:
        """Whether spectra are of these sensors, on their lines."""
        if band_hz != self.band_hz or set(_counted(spectra, self.band_hz)) != {*self.by_sensor}:
            return False
        first = {
            name: next(one for one in spectra[name] if one is not None) for name in self.by_sensor
        }
        return all(shared.fits(first[name]) for name, shared in self.by_sensor.items())

    def lines(self, spectra: SpectraBySensor, kept: MasksBySensor | None = None) -> SensorLines:
        """The contact resonance in each of further recordings, as `resonances_of_sensors` finds it.

        Its height is that on the first sensor of those that settled this, whichever is named first
        now.

        Raises
        ------
        BadInput
            for spectra on other lines, or without any vibration.
        """
        spectra = {
            name: spectra[name]
            for name in dict.fromkeys((*self.by_sensor, *spectra))
            if name in spectra
        }
        there = [
            name
            for name, rows in _rows(spectra, self.band_hz).items()
            if rows and name in self.by_sensor
        ]
        by_sensor = {
            name: separated_beside(self.by_sensor[name], *_used(spectra, kept, name, self.band_hz))
            for name in there
        }
        return _Together(by_sensor, spectra, self.band_hz).judged(self.agreement)[0]


def _count(spectra: SpectraBySensor) -> int:
    """How many recordings there are."""
    return len(next(iter(spectra.values())))


def _rows(spectra: SpectraBySensor, band_hz: tuple[float, float]) -> dict[str, list[int]]:
    """Which recordings each sensor hears anything of."""
    return {
        name: [
            number
            for number, one in enumerate(every)
            if one is not None and not is_silent(one, band_hz)
        ]
        for name, every in spectra.items()
    }


def _counted(spectra: SpectraBySensor, band_hz: tuple[float, float]) -> list[str]:
    """Sensors with enough recordings to be separated."""
    heard = {
        name: (one for one in every if one is not None and not is_silent(one, band_hz))
        for name, every in spectra.items()
    }
    return [
        name
        for name, some in heard.items()
        if len([*islice(some, FEWEST_RECORDINGS)]) == FEWEST_RECORDINGS
    ]


def _used(
    spectra: SpectraBySensor, kept: MasksBySensor | None, name: str, band_hz: tuple[float, float]
) -> tuple[list[Spectrum], list[Mask] | None]:
    """A sensor's spectra and masks, those that it has."""
    rows = _rows(spectra, band_hz)[name]
    used = [one for number in rows if (one := spectra[name][number]) is not None]
    if kept is None:
        return used, None
    return used, [mask for number in rows if (mask := kept[name][number]) is not None]


class _Together:
    """Recordings of sensors whose series have been separated, to be judged together."""

    def __init__(
        self,
        by_sensor: Mapping[str, Separated],
        spectra: SpectraBySensor,
        band_hz: tuple[float, float],
    ) -> None:
        self.by_sensor, self.rows, self.band_hz = by_sensor, _rows(spectra, band_hz), band_hz
        self.count = len(next(iter(spectra.values())))
        self.alone = {name: self._by_itself(name, every) for name, every in spectra.items()}

    def judged(self, agreement: Agreement | None = None) -> tuple[SensorLines, Agreement]:
        """Every recording, by the sensors that it has; how they agree, of these recordings if it is not known."""
        count = self.count
        there: dict[tuple[str, ...], list[int]] = {}
        for number in range(count):
            there.setdefault(
                tuple(name for name in self.by_sensor if number in self.rows[name]), []
            ).append(number)
        fits = [
            self._fitted([*names], numbers) for names, numbers in there.items() if len(names) > 1
        ]
        common = self._common(fits) if agreement is None else agreement.common
        wider = self._wider(common) if agreement is None else agreement.wider
        heard_on: list[tuple[str, ...]] = [()] * count
        silent = no_resonance("no sensor has a spectrum here", self.band_hz, "joint")
        lines = [
            next(filter(None, heard), silent) for heard in zip(*self.alone.values(), strict=True)
        ]
        for fit in fits:
            for number, (line, names) in zip(
                fit.numbers, self._agreed(fit, common, wider), strict=True
            ):
                lines[number], heard_on[number] = line, names
        established = self._established(heard_on) if agreement is None else agreement.established
        for number in range(count):
            if not heard_on[number] and not self._apart(number):
                lines[number], heard_on[number] = self._by_one(
                    number, lines[number], established, wider
                )
        shares = [*common.values()]
        told = SensorLines(
            resonances=tuple(lines),
            heard_on=tuple(heard_on),
            alone=self.alone,
            common=float(np.mean(shares)) if shares else np.nan,
        )
        return told, Agreement(common, wider, established)

    def _by_itself(
        self, name: str, spectra: Sequence[Spectrum | None]
    ) -> tuple[Resonance | None, ...]:
        """What a sensor's series says of each recording, None where it has none."""
        own = self.by_sensor.get(name)
        reason = f"the joint separation needs {FEWEST_RECORDINGS} recordings of a sensor, and this one has fewer"
        too_few = no_resonance(reason, self.band_hz, "joint")
        low, high = self.band_hz
        nothing = no_resonance(
            f"the spectrum holds no vibration at all between {low:.0f} and {high:.0f} Hz",
            self.band_hz,
            "joint",
        )
        found = [None if one is None else nothing for one in spectra]
        for place, number in enumerate(self.rows[name]):
            found[number] = too_few if own is None else own.resonances[place]
        return tuple(found)

    def _common(self, fits: Sequence[Fit]) -> dict[tuple[str, str], float]:
        """The share of their errors that two sensors have in common, where that can be told."""
        pairs = combinations(self.by_sensor, 2)
        return {pair: share for pair in pairs if np.isfinite(share := in_common(pair, fits))}

    def _established(self, heard_on: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
        """Sensors that have heard the line of others in most of the recordings in which they heard one."""
        if len(self.by_sensor) == 1:
            return (*self.by_sensor,)
        found = []
        for name, every in self.alone.items():
            together = sum(name in names and len(names) > 1 for names in heard_on)
            ever = sum(one is not None and one.found for one in every)
            if together >= max(FEWEST_AGREED, ESTABLISHED * ever):
                found.append(name)
        return tuple(found)

    def _fitted(self, names: list[str], numbers: list[int]) -> Fit:
        """One line for all sensors in each of some recordings, beside what each sensor's series has settled."""
        heard, templates = [], self.by_sensor[names[0]].found.templates
        rows = {name: [self.rows[name].index(number) for number in numbers] for name in names}
        total = np.sum([self.by_sensor[name].found.elsewhere[rows[name]] for name in names], axis=0)
        best = np.argmin(total, axis=1)
        for name in names:
            one, settled = self.by_sensor[name], self.by_sensor[name].found.joint
            blocks = Blocks(
                one.blocks.centre, one.blocks.density[rows[name]], one.blocks.weight[rows[name]]
            )
            coarse = coarser(blocks)
            base = np.exp(np.interp(coarse.centre, blocks.centre, settled.parameters.base))
            own = levelled(coarse, base, templates, best)
            heard.append(Heard(blocks, settled.parameters._replace(own=own), settled.doubt))
        return Fit(names, numbers, heard, each(heard), total)

    def _wider(self, common: Mapping[tuple[str, str], float]) -> float:
        """By how much sensors differ more than their deviations say: what is between changes their lines, too."""
        squares = []
        for first, second in combinations(self.by_sensor, 2):
            share = min(common.get((first, second), 0.0), MOST_COMMON)
            for one, other in zip(self.alone[first], self.alone[second], strict=True):
                if (
                    one is not None
                    and other is not None
                    and one.found
                    and other.found
                    and not differ(one, other)
                ):
                    variance = (
                        one.crf_std**2
                        + other.crf_std**2
                        - 2.0 * share * one.crf_std * other.crf_std
                    )
                    squares.append((one.crf_hz - other.crf_hz) ** 2 / variance)
        return (
            float(np.sqrt(max(float(np.mean(squares)), 1.0)))
            if len(squares) >= FEWEST_AGREED
            else 1.0
        )

    def _apart(self, number: int) -> str:
        """That sensors hear different lines in a recording, in words; empty where they do not."""
        found = [
            (name, one)
            for name, all_ in self.alone.items()
            if (one := all_[number]) is not None and one.found
        ]
        for (name, one), (other_name, other) in combinations(found, 2):
            if differ(one, other):
                return (
                    f"{DISAGREE}: a line at {one.crf_hz:.0f} ± {one.crf_std:.0f} Hz on {name}, at "
                    f"{other.crf_hz:.0f} ± {other.crf_std:.0f} Hz on {other_name}"
                )
        return ""

    def _agreed(
        self, fit: Fit, common: Mapping[tuple[str, str], float], wider: float
    ) -> list[tuple[Resonance, tuple[str, ...]]]:
        """The lines that two sensors hear, and who does; else why there is none."""
        shares = shares_in_common(fit.names, common)
        counts_as = 1.0 + np.sum(shares, axis=1).mean()  # one sensor and its copy are one
        gains, misfits, weights = [], [], []
        for sensor, heard in enumerate(fit.heard):
            joint = fit.joint(sensor)
            gains.append(gain_of(heard.blocks, joint)[0])
            misfits.append(
                left_over(heard.blocks, expected_density(heard.blocks, joint.parameters))
            )
            weights.append(heard.blocks.weight.sum(axis=1))
        hears = (np.array(gains) - np.log(weights) > STRONG_EVIDENCE) & (
            np.array(misfits) <= LARGEST_MISFIT
        )
        hears &= ~np.array([self.by_sensor[name].found.shaped for name in fit.names])[:, None]
        evidence = np.sum(gains, axis=0) / counts_as - (2.0 + len(fit.names)) * np.log(
            np.sum(weights, axis=0)
        )
        beyond = [
            brought(heard.blocks, fit.joint(sensor), self.by_sensor[name].found.witnesses)
            for sensor, (heard, name) in enumerate(zip(fit.heard, fit.names, strict=True))
        ]
        of_structures = sum(
            part * one.lacking[:, 1] for part, one in zip(_parts(fit), beyond, strict=True)
        )
        std, shared = self._deviations(fit, shares, beyond), wider * np.asarray(of_structures)
        std[:, :, 1] *= wider
        return [
            self._line(
                fit,
                place,
                [name for name, there in zip(fit.names, hears[:, place], strict=True) if there],
                float(evidence[place]),
                float(np.min(np.array(misfits)[:, place])),
                float(counts_as),
                std[:, place],
                float(shared[place]),
            )
            for place in range(len(fit.numbers))
        ]

    def _line(
        self,
        fit: Fit,
        place: int,
        names: list[str],
        evidence: float,
        misfit: float,
        counts_as: float,
        std: Field,
        shared: float,
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
            objection = (
                f"a line at {f0:.0f} Hz is heard on {names[0]} only"
                if names
                else "no two sensors hear a line"
            )
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
            crf_shared_std=shared * f0,
        )
        lead = next(iter(self.alone))
        if fit.names[0] != lead or lead not in names:
            resonance = replace(resonance, crfa=np.nan, crfa_std=np.nan)
        return resonance, tuple(names)

    def _by_one(
        self, number: int, line: Resonance, established: Sequence[str], wider: float
    ) -> tuple[Resonance, tuple[str, ...]]:
        """A line that one sensor hears, where it has elsewhere been the one that others hear too."""
        there = {
            name: one for name, every in self.alone.items() if (one := every[number]) is not None
        }
        found = [(name, one) for name, one in there.items() if one.found]
        if not found:
            return line, ()
        name, own = next((one for one in found if one[0] in established), found[0])
        if name not in established:
            others = " and ".join(other for other in there if other != name)
            only = (
                f"only, not on {others}" if others else "and no other sensor heard this recording"
            )
            reason = f"a line at {own.crf_hz:.0f} Hz is heard on {name} {only}: a structure's looks the same"
            return no_resonance(reason, self.band_hz, "joint", evidence=own.evidence), ()
        height = (own.crfa, own.crfa_std) if name == next(iter(self.alone)) else (np.nan, np.nan)
        said = f"{own.reason}, here on {name} only" if len(self.by_sensor) > 1 else own.reason
        return replace(
            own,
            crf_std=own.crf_std * wider,
            crf_shared_std=own.crf_shared_std * wider,
            crfa=height[0],
            crfa_std=height[1],
            reason=said,
        ), (name,)

    def _deviations(self, fit: Fit, shares: Field, beyond: Sequence[Brought]) -> Field:
        """Standard deviations (sensors, recordings, 4): what is independent, what is common, what a machine brings."""
        inverse, dragged = fit.lines.inverse, fit.lines.dragged
        variance = np.einsum("npp->np", inverse).copy()
        relative = [
            shares_of(heard.blocks, fit.joint(sensor).parameters)[0]
            for sensor, heard in enumerate(fit.heard)
        ]
        part = _parts(fit)
        brought = np.zeros(inverse.shape[:2])
        of_base = []
        for sensor, heard in enumerate(fit.heard):
            at = places(sensor)
            misfit = beyond[sensor].std
            brought[:, [at[0], at[3]]] += misfit[:, [0, 3]]
            brought[:, [1, 2]] += part[sensor][:, None] * misfit[:, [1, 2]]
            base = self._of_the_base(fit, sensor)
            variance[:, [at[0], at[3]]] += base[:, [0, 3]] ** 2
            of_base.append(part[sensor][:, None] * base[:, [1, 2]])
            for other in range(len(fit.heard)):
                if other != sensor:
                    weight = np.sqrt(heard.blocks.weight * fit.heard[other].blocks.weight)
                    score = (relative[sensor] * weight[:, None]) @ relative[other].swapaxes(1, 2)
                    both = inverse[:, :, at] @ score @ inverse[:, places(other), :]
                    variance += shares[sensor, other] * np.einsum("npp->np", both)
        alike = shares + np.eye(len(fit.heard))
        variance[:, [1, 2]] += np.einsum("snp,st,tnp->np", of_base, alike, of_base)
        of_transfer = [
            np.sqrt(np.sum(one @ heard.doubt * one, axis=2))
            for one, heard in zip(dragged, fit.heard, strict=True)
        ]
        variance += np.einsum("snp,st,tnp->np", of_transfer, alike, of_transfer)
        std = np.hypot(np.sqrt(variance), brought)
        return np.stack([std[:, places(sensor)] for sensor in range(len(fit.heard))])

    def _of_the_base(self, fit: Fit, sensor: int) -> Field:
        """What a base, known as well as its series tells, adds to the deviations of lines; (recordings, 4)."""
        name, heard = fit.names[sensor], fit.heard[sensor]
        rows = [self.rows[name].index(number) for number in fit.numbers]
        settled = self.by_sensor[name].found.joint
        if self.by_sensor[name].beside:  # the base's doubt is not in their deviations
            return np.zeros_like(settled.std[rows])
        own = settled.parameters.own[rows]
        known = alone_beside(heard.blocks, settled.parameters._replace(own=own), heard.doubt).std
        return np.asarray(np.sqrt(np.maximum(settled.std[rows] ** 2 - known**2, 0.0)))


def _parts(fit: Fit) -> Field:
    """What each sensor says of a line's place, as a share; (sensors, recordings)."""
    information = np.array([point.information[:, 1, 1] for point in fit.lines.points])
    return np.asarray(information / information.sum(axis=0))
