"""Joint judgement of recordings of several sensors whose series have been separated."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.core.signals import Spectrum
from asperity.resonance.band_fit import STRONG_EVIDENCE
from asperity.resonance.line_fit import (
    CommonLines,
    SensorData,
    fit_common_lines,
    fit_lines,
    parameter_indices,
)
from asperity.resonance.line_judgement import (
    LARGEST_MISFIT,
    JudgedLine,
    best_rival,
    line_gain,
    line_objection,
)
from asperity.resonance.residuals import SystematicErrors, relative_residual, systematic_errors
from asperity.resonance.resonance import Resonance, fitted_resonance, no_resonance
from asperity.resonance.sensor_agreement import (
    Agreement,
    SensorFit,
    SensorLines,
    SpectraBySensor,
    common_error_matrix,
    common_error_share,
    lines_differ,
    recordings_with_vibration,
)
from asperity.resonance.series import FEWEST_RECORDINGS, SeparatedSeries
from asperity.resonance.spectrum_model import SpectrumBlocks, expected_density, model_shares
from asperity.resonance.template_search import coarser, lines_at_templates

# share and number of recordings in which a sensor must have detected the line of others
ESTABLISHED_SHARE, FEWEST_AGREEMENTS = 0.5, 3
SENSORS_DISAGREE = "the sensors disagree"
LARGEST_COMMON_SHARE = 0.9  # of the errors of two sensors, where their lines are compared


class _Evidence(NamedTuple):
    """Evidence for the lines of a joint fit, (recordings,), and the sensors that detect them."""

    detects: Mask  # (sensors, recordings)
    bic: Field
    misfit: Field  # smallest over the sensors
    effective_sensors: float  # a sensor and its copy count once
    std: Field  # (sensors, recordings, 4)
    shared_std: Field  # relative; part common to lines at the same place


class JointJudgement:
    """Recordings of several sensors, each with its separated series, to be judged together."""

    def __init__(
        self,
        by_sensor: Mapping[str, SeparatedSeries],
        spectra: SpectraBySensor,
        band_hz: tuple[float, float],
    ) -> None:
        self.by_sensor, self.band_hz = by_sensor, band_hz
        self.rows = recordings_with_vibration(spectra, band_hz)
        self.count = len(next(iter(spectra.values())))
        self.alone = {name: self._single_sensor(name, series) for name, series in spectra.items()}

    def judge(self, agreement: Agreement | None = None) -> tuple[SensorLines, Agreement]:
        """Judge every recording; estimate the agreement of the sensors unless it is given."""
        fits = self._fits()
        common = self._common_shares(fits) if agreement is None else agreement.common
        widening = self._widening(common) if agreement is None else agreement.widening
        detected_on: list[tuple[str, ...]] = [()] * self.count
        lines = self._first_lines()
        for fit in fits:
            for number, (line, names) in zip(
                fit.numbers, self._common_lines(fit, common, widening), strict=True
            ):
                lines[number], detected_on[number] = line, names
        established = self._established(detected_on) if agreement is None else agreement.established
        for number in range(self.count):
            if not detected_on[number] and not self.disagreement(number):
                lines[number], detected_on[number] = self._line_of_one_sensor(
                    number, lines[number], established, widening
                )
        shares = [*common.values()]
        judged = SensorLines(
            resonances=tuple(lines),
            detected_on=tuple(detected_on),
            alone=self.alone,
            common=float(np.mean(shares)) if shares else np.nan,
        )
        return judged, Agreement(common, widening, established)

    def _fits(self) -> list[SensorFit]:
        """Fit recordings of several sensors, those of the same sensors together."""
        by_names: dict[tuple[str, ...], list[int]] = {}
        for number in range(self.count):
            names = tuple(name for name in self.by_sensor if number in self.rows[name])
            by_names.setdefault(names, []).append(number)
        return [
            self._fit([*names], numbers) for names, numbers in by_names.items() if len(names) > 1
        ]

    def _first_lines(self) -> list[Resonance]:
        """Return each recording's line on the first sensor that has a spectrum of it."""
        no_spectrum = no_resonance(
            "no sensor has a spectrum of this recording", self.band_hz, "joint"
        )
        return [
            next(filter(None, candidates), no_spectrum)
            for candidates in zip(*self.alone.values(), strict=True)
        ]

    def disagreement(self, number: int) -> str:
        """Describe the different lines that two sensors detect in a recording; empty for none."""
        detected = [
            (name, line)
            for name, lines in self.alone.items()
            if (line := lines[number]) is not None and line.found
        ]
        for (name, line), (other_name, other) in combinations(detected, 2):
            if lines_differ(line, other):
                return (
                    f"{SENSORS_DISAGREE}: a line at {line.crf_hz:.0f} ± {line.crf_std:.0f} Hz on "
                    f"{name}, at {other.crf_hz:.0f} ± {other.crf_std:.0f} Hz on {other_name}"
                )
        return ""

    def _single_sensor(
        self, name: str, spectra: Sequence[Spectrum | None]
    ) -> tuple[Resonance | None, ...]:
        """Return the resonances of a sensor's own series; None where it has no spectrum."""
        series = self.by_sensor.get(name)
        too_few = no_resonance(
            f"the joint separation needs {FEWEST_RECORDINGS} recordings of a sensor; this one has "
            "fewer",
            self.band_hz,
            "joint",
        )
        low, high = self.band_hz
        no_vibration = no_resonance(
            f"the spectrum holds no vibration between {low:.0f} and {high:.0f} Hz",
            self.band_hz,
            "joint",
        )
        lines = [None if spectrum is None else no_vibration for spectrum in spectra]
        for row, number in enumerate(self.rows[name]):
            lines[number] = too_few if series is None else series.resonances[row]
        return tuple(lines)

    def _common_shares(self, fits: Sequence[SensorFit]) -> dict[tuple[str, str], float]:
        """Return the share of common errors of each pair of sensors, where it can be estimated."""
        pairs = combinations(self.by_sensor, 2)
        return {
            pair: share for pair in pairs if np.isfinite(share := common_error_share(pair, fits))
        }

    def _established(self, detected_on: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
        """Return the sensors whose lines were mostly those of other sensors too."""
        if len(self.by_sensor) == 1:
            return (*self.by_sensor,)
        established = []
        for name, lines in self.alone.items():
            agreements = sum(name in names and len(names) > 1 for names in detected_on)
            detected = sum(line is not None and line.found for line in lines)
            if agreements >= max(FEWEST_AGREEMENTS, ESTABLISHED_SHARE * detected):
                established.append(name)
        return tuple(established)

    def _fit(self, names: list[str], numbers: list[int]) -> SensorFit:
        """Fit one line per recording to all sensors, their shared spectra held."""
        sensors = []
        templates = self.by_sensor[names[0]].fit.templates
        rows = {name: [self.rows[name].index(number) for number in numbers] for name in names}
        total = np.sum(
            [self.by_sensor[name].fit.template_costs[rows[name]] for name in names], axis=0
        )
        best = np.argmin(total, axis=1)
        for name in names:
            series = self.by_sensor[name]
            joint = self.by_sensor[name].fit.joint
            blocks = SpectrumBlocks(
                series.blocks.centre,
                series.blocks.density[rows[name]],
                series.blocks.weight[rows[name]],
            )
            coarse = coarser(blocks)
            base = np.exp(np.interp(coarse.centre, blocks.centre, joint.parameters.base))
            values = lines_at_templates(coarse, base, templates, best)
            parameters = joint.parameters._replace(own=values)
            sensors.append(SensorData(blocks, parameters, joint.transfer_covariance))
        return SensorFit(names, numbers, sensors, fit_common_lines(sensors), total)

    def _widening(self, common: Mapping[tuple[str, str], float]) -> float:
        """Return the factor by which lines of sensors differ more than their deviations state.

        The path to each sensor shifts its line, too.
        """
        squares = []
        for first, second in combinations(self.by_sensor, 2):
            share = min(common.get((first, second), 0.0), LARGEST_COMMON_SHARE)
            for line, other in zip(self.alone[first], self.alone[second], strict=True):
                if line is None or other is None or not line.found or not other.found:
                    continue
                if lines_differ(line, other):
                    continue
                variance = (
                    line.crf_std**2 + other.crf_std**2 - 2.0 * share * line.crf_std * other.crf_std
                )
                squares.append((line.crf_hz - other.crf_hz) ** 2 / variance)
        if len(squares) < FEWEST_AGREEMENTS:
            return 1.0
        return float(np.sqrt(max(float(np.mean(squares)), 1.0)))

    def _common_lines(
        self, fit: SensorFit, common: Mapping[tuple[str, str], float], widening: float
    ) -> list[tuple[Resonance, tuple[str, ...]]]:
        """Return the lines that two sensors detect, and the sensors; else why there is none."""
        evidence = self._evidence(fit, common, widening)
        return [self._common_line(fit, row, evidence) for row in range(len(fit.numbers))]

    def _evidence(
        self, fit: SensorFit, common: Mapping[tuple[str, str], float], widening: float
    ) -> _Evidence:
        shares = common_error_matrix(fit.names, common)
        effective = 1.0 + np.sum(shares, axis=1).mean()
        gain, misfit, ordinates = _evidence_by_sensor(fit)
        detects = (gain - np.log(ordinates) > STRONG_EVIDENCE) & (misfit <= LARGEST_MISFIT)
        detects &= ~np.array([self.by_sensor[name].fit.shaped for name in fit.names])[:, None]
        bic = np.sum(gain, axis=0) / effective - (2.0 + len(fit.names)) * np.log(
            np.sum(ordinates, axis=0)
        )
        errors = [
            systematic_errors(data.blocks, fit.joint(sensor), self.by_sensor[name].fit.statistics)
            for sensor, (data, name) in enumerate(zip(fit.sensors, fit.names, strict=True))
        ]
        of_structures = sum(
            part * error.model_error[:, 1]
            for part, error in zip(_frequency_weights(fit.lines), errors, strict=True)
        )
        std = self._deviations(fit, shares, errors)
        std[:, :, 1] *= widening
        return _Evidence(
            detects=detects,
            bic=bic,
            misfit=np.min(misfit, axis=0),
            effective_sensors=float(effective),
            std=std,
            shared_std=widening * np.asarray(of_structures),
        )

    def _common_line(
        self, fit: SensorFit, row: int, evidence: _Evidence
    ) -> tuple[Resonance, tuple[str, ...]]:
        """Return one recording's line and its sensors, if two sensors detect it."""
        if disagreement := self.disagreement(fit.numbers[row]):
            return no_resonance(disagreement, self.band_hz, "joint"), ()
        names = tuple(
            name
            for name, detects in zip(fit.names, evidence.detects[:, row], strict=True)
            if detects
        )
        line = self._judged_line(fit, row, evidence)
        objection = line_objection(line, self.band_hz)
        if objection is None and len(names) == 1:
            objection = f"a line at {line.f0:.0f} Hz is detected on {names[0]} only"
        elif objection is None and not names:
            objection = "no two sensors detect a line"
        if objection is not None:
            return no_resonance(objection, self.band_hz, "joint", evidence=line.evidence), ()
        reason = (
            f"a line {line.width:.0f} Hz wide on {' and '.join(names)} (BIC {line.evidence:+.0f})"
        )
        resonance = self._joint_resonance(fit, row, evidence, reason)
        lead = next(iter(self.alone))
        if fit.names[0] != lead or lead not in names:
            resonance = replace(resonance, crfa=np.nan, crfa_std=np.nan)
        return resonance, names

    def _joint_resonance(
        self, fit: SensorFit, row: int, evidence: _Evidence, reason: str
    ) -> Resonance:
        """Return one recording's line as fitted to all sensors, its height that on the first."""
        fitted = np.exp(fit.lines.own[0, row, :3])
        first = fit.sensors[0]
        base = np.exp(fit.lines.own[0, row, 3] + first.parameters.base)
        keeps_frequency = self.by_sensor[fit.names[0]].fit.stands
        return fitted_resonance(
            fitted,
            np.where([keeps_frequency, False, False], np.nan, evidence.std[0, row, :3] * fitted),
            reason=reason,
            band_hz=self.band_hz,
            method="joint",
            evidence=float(evidence.bic[row]),
            background=(first.blocks.centre, base),
            crf_shared_std=float(evidence.shared_std[row]) * float(fitted[1]),
        )

    def _judged_line(self, fit: SensorFit, row: int, evidence: _Evidence) -> JudgedLine:
        """Return the criteria of one recording's line, all sensors together."""
        _, f0, zeta = (float(value) for value in np.exp(fit.lines.own[0, row, :3]))
        costs = fit.template_costs[row] / evidence.effective_sensors
        rival = best_rival(f0, zeta, costs, self.by_sensor[fit.names[0]].fit.templates)
        f0_std = float(evidence.std[0, row, 1]) * f0
        return JudgedLine(
            f0, f0_std, zeta, float(evidence.bic[row]), float(evidence.misfit[row]), *rival
        )

    def _line_of_one_sensor(
        self, number: int, line: Resonance, established: Sequence[str], widening: float
    ) -> tuple[Resonance, tuple[str, ...]]:
        """Return the line of a single sensor, provided that the sensor is established."""
        available = {
            name: fit for name, lines in self.alone.items() if (fit := lines[number]) is not None
        }
        detected = [(name, fit) for name, fit in available.items() if fit.found]
        if not detected:
            return line, ()
        name, fit = next((pair for pair in detected if pair[0] in established), detected[0])
        if name not in established:
            others = " and ".join(other for other in available if other != name)
            only = (
                f"only, not on {others}"
                if others
                else "only, and no other sensor has a spectrum of this recording"
            )
            reason = (
                f"a line at {fit.crf_hz:.0f} Hz is detected on {name} {only}: a structural mode "
                "would look the same"
            )
            return no_resonance(reason, self.band_hz, "joint", evidence=fit.evidence), ()
        height = (fit.crfa, fit.crfa_std) if name == next(iter(self.alone)) else (np.nan, np.nan)
        several = len(self.by_sensor) > 1
        return replace(
            fit,
            crf_std=fit.crf_std * widening,
            crf_shared_std=fit.crf_shared_std * widening,
            crfa=height[0],
            crfa_std=height[1],
            reason=f"{fit.reason}, detected by sensor {name} only" if several else fit.reason,
        ), (name,)

    def _deviations(
        self, fit: SensorFit, shares: Field, errors: Sequence[SystematicErrors]
    ) -> Field:
        """Return standard deviations (sensors, recordings, 4): random, common and systematic."""
        variance = np.einsum("npp->np", fit.lines.inverse).copy()
        relative = [
            model_shares(data.blocks, fit.joint(sensor).parameters)[0]
            for sensor, data in enumerate(fit.sensors)
        ]
        weights = _frequency_weights(fit.lines)
        count = len(fit.sensors)
        frequency_of_base = []
        for sensor in range(count):
            height, _, _, gain = parameter_indices(sensor)
            base = self._base_std(fit, sensor)
            variance[:, [height, gain]] += base[:, [0, 3]] ** 2
            frequency_of_base.append(weights[sensor][:, None] * base[:, [1, 2]])
            for other in range(count):
                if other != sensor:
                    chance = _common_chance(fit, (sensor, other), relative)
                    variance += shares[sensor, other] * chance
        correlation = shares + np.eye(count)
        variance[:, [1, 2]] += _correlated_variance(frequency_of_base, correlation)
        variance += _correlated_variance(_transfer_std(fit), correlation)
        std = np.hypot(np.sqrt(variance), _systematic_std(weights, errors))
        return np.stack([std[:, parameter_indices(sensor)] for sensor in range(count)])

    def _base_std(self, fit: SensorFit, sensor: int) -> Field:
        """Return the deviations (recordings, 4) caused by the uncertainty of the shared base."""
        name = fit.names[sensor]
        data = fit.sensors[sensor]
        rows = [self.rows[name].index(number) for number in fit.numbers]
        joint = self.by_sensor[name].fit.joint
        if self.by_sensor[name].uses_shared:  # their deviations exclude that of the base
            return np.zeros_like(joint.std[rows])
        values = joint.parameters.own[rows]
        base_held = fit_lines(
            data.blocks, joint.parameters._replace(own=values), data.transfer_covariance
        ).std
        return np.asarray(np.sqrt(np.maximum(joint.std[rows] ** 2 - base_held**2, 0.0)))


def _evidence_by_sensor(fit: SensorFit) -> tuple[Field, Field, Field]:
    """Return the gain, misfit and number of ordinates of each line, (sensors, recordings) each."""
    gains, misfits, ordinates = [], [], []
    for sensor, data in enumerate(fit.sensors):
        joint = fit.joint(sensor)
        gains.append(line_gain(data.blocks, joint)[0])
        expected = expected_density(data.blocks, joint.parameters)
        misfits.append(relative_residual(data.blocks, expected))
        ordinates.append(data.blocks.weight.sum(axis=1))
    return np.array(gains), np.array(misfits), np.array(ordinates)


def _frequency_weights(lines: CommonLines) -> Field:
    """Return the sensors' shares of the information on frequency, (sensors, recordings)."""
    information = np.array([point.information[:, 1, 1] for point in lines.points])
    return np.asarray(information / information.sum(axis=0))


def _common_chance(fit: SensorFit, pair: tuple[int, int], relative: Sequence[Field]) -> Field:
    """Return the covariance of the parameters by noise that is the same on two sensors."""
    inverse = fit.lines.inverse
    (sensor, other) = pair
    weight = np.sqrt(fit.sensors[sensor].blocks.weight * fit.sensors[other].blocks.weight)
    score = (relative[sensor] * weight[:, None]) @ relative[other].swapaxes(1, 2)
    covariance = (
        inverse[:, :, parameter_indices(sensor)] @ score @ inverse[:, parameter_indices(other), :]
    )
    return np.asarray(np.einsum("npp->np", covariance))


def _transfer_std(fit: SensorFit) -> list[Field]:
    """Return the deviations (recordings, n) caused by the uncertainty of each transfer."""
    return [
        np.sqrt(np.sum(effect @ data.transfer_covariance * effect, axis=2))
        for effect, data in zip(fit.lines.transfer_effect, fit.sensors, strict=True)
    ]


def _correlated_variance(std: Sequence[Field], correlation: Field) -> Field:
    """Return the variance of the sum of errors that are correlated between sensors."""
    return np.asarray(np.einsum("snp,st,tnp->np", std, correlation, std))


def _systematic_std(weights: Field, errors: Sequence[SystematicErrors]) -> Field:
    """Return the systematic deviations (recordings, n) of all sensors together."""
    systematic = np.zeros((weights.shape[1], 2 + 2 * len(errors)))
    for sensor, error in enumerate(errors):
        height, _, _, gain = parameter_indices(sensor)
        systematic[:, [height, gain]] += error.std[:, [0, 3]]
        systematic[:, [1, 2]] += weights[sensor][:, None] * error.std[:, [1, 2]]
    return systematic
