"""Result of an inference: posterior intervals, information gain, warnings and verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT
from asperity.core.displayed import Brief
from asperity.core.documents import JsonObject
from asperity.core.quantities import quantity
from asperity.inference.emulator import Emulator
from asperity.inference.estimates import Estimate, quantity_estimates
from asperity.inference.forward import LAWS, ForwardModel, Law
from asperity.inference.next_point import NextPoint
from asperity.inference.observations import Observation, ObservationPoint
from asperity.inference.outputs import CLR, FILM, OUTPUTS
from asperity.inference.posterior import ContactPool, Draws, ModelEvidence
from asperity.inference.settings import Setting
from asperity.results import BOUNDARY_FROM, FULL_FILM_BELOW

REGIMES = ("full film", "mixed lubrication", "boundary lubrication")
KEY_QUANTITIES = (CLR, "sq_m")  # of the verdict
IDENTIFIED_BITS = (
    1.0  # information gain from which on CLR or Sq counts as identified: the range is halved
)
CONFOUNDED = 0.7  # posterior correlation from which on two unknowns count as confounded
LARGE_LAW_ERROR = 0.05  # mean relative error of CRF; 0.035 in the prior
UNLIKELY = 0.1  # probability of the case's law from which down a warning is given


@dataclass(frozen=True)
class PointEstimates:
    """The contact's state and the probabilities of its stages at an operating point."""

    HEADS: ClassVar[tuple[str, ...]] = (
        "load",
        "speed",
        "recordings",
        f"CLR, {PERCENT}",
        f"mean film, {PERCENT}",
        "stage",
    )

    point: ObservationPoint
    state: Mapping[str, Estimate]
    stages: Mapping[str, float]

    def cells(self) -> list[str]:
        """Return a table row with the columns `HEADS`."""
        clr = self.state[CLR]
        film = self.state[FILM]
        stage, probability = max(self.stages.items(), key=lambda entry: entry[1])
        return [
            quantity("load_n").text(self.point.load_n),
            quantity("entrainment_speed_m_s").text(self.point.entrainment_m_s),
            str(len(self.point.names)),
            quantity(CLR).interval(clr.low, clr.high),
            quantity(FILM).interval(film.low, film.high),
            f"{stage} ({100.0 * probability:.0f} %)",
        ]

    def scalars(self) -> JsonObject:
        """Return the JSON output."""
        return {
            "load_n": self.point.load_n,
            "entrainment_m_s": self.point.entrainment_m_s,
            "temperature_k": self.point.temperature_k,
            "files": list(self.point.names),
            "state": {key: estimate.scalars() for key, estimate in self.state.items()},
            "stages": dict(self.stages),
        }


@dataclass(frozen=True, repr=False)
class Inference(Brief):
    """Posterior of a contact's state. Made by `infer_contact`.

    Parameters
    ----------
    forward : setting, emulator and operating points; the first point is the case's own
    observations : the data
    excluded : recordings without a usable resonance, with reasons
    models : laws with and without discrepancy, with their evidence
    prior, draws, exact : draws from the prior, the posterior, and the posterior without discrepancy
    candidates : operating points with their expected information gain
    pools : all draws, reused for further observations
    notes : assumptions and remarks
    """

    forward: ForwardModel
    observations: tuple[Observation, ...]
    excluded: tuple[tuple[str, str], ...]
    models: tuple[ModelEvidence, ...]
    prior: Draws
    draws: Draws
    exact: Draws
    candidates: tuple[NextPoint, ...]
    pools: Mapping[Law, ContactPool] = field(repr=False)
    seed: int = 0
    notes: tuple[str, ...] = ()

    @property
    def setting(self) -> Setting:
        """Unknowns, priors and ranges."""
        return self.forward.setting

    @property
    def emulator(self) -> Emulator:
        """Emulator of the contact."""
        return self.forward.emulator

    @property
    def next_point(self) -> NextPoint:
        """The candidate with the largest expected information gain."""
        return max(self.candidates, key=lambda candidate: candidate.information_bits)

    def values(self, draws: Draws, point: int = 0) -> dict[str, Field]:
        """Return every quantity of draws by key, SI: states at an operating point, and unknowns."""
        states = {key: columns[:, point] for key, columns in draws.states.items()}
        unknowns = {
            unknown.key: unknown.value(draws.z[:, number])
            for number, unknown in enumerate(self.setting.unknowns)
        }
        if "sq_m" in unknowns:
            states["lambda_ratio"] = states[FILM] / unknowns["sq_m"]
        return {**states, **unknowns}

    def posterior(self, *, discrepancy: bool = True) -> dict[str, Estimate]:
        """Return estimates of every quantity at the case's own load and speed."""
        draws = self.draws if discrepancy else self.exact
        bounded = frozenset(unknown.key for unknown in self.setting.unknowns if unknown.bounded)
        return quantity_estimates(
            self.values(draws), self.values(self.prior), draws.effective, bounded
        )

    def point_estimates(self) -> tuple[PointEstimates, ...]:
        """Return the contact's state at each measured operating point."""
        results = []
        for index, point in enumerate(self.forward.points):
            if not point.measured:
                continue
            after = self.values(self.draws, index)
            before = self.values(self.prior, index)
            keys = [*self.draws.states, *(["lambda_ratio"] if "lambda_ratio" in after else [])]
            state = quantity_estimates(
                {key: after[key] for key in keys},
                {key: before[key] for key in keys},
                self.draws.effective,
                frozenset(),
            )
            results.append(PointEstimates(point, state, stage_probabilities(after[CLR])))
        return tuple(results)

    def posterior_predictive(self) -> Field:
        """Draw ln CRF from the posterior predictive distribution, shape (n, points)."""
        rng = np.random.default_rng([self.seed, 7])
        log_crf = np.empty((len(self.draws.z), len(self.forward.points)))
        for number, law in enumerate(LAWS):
            rows = self.draws.law == number
            if rows.any():
                predicted = self.forward.predict(self.draws.z[rows], law, heights=False)
                spread = np.hypot(predicted.crf_std, self.draws.sizes["crf"][rows][:, None])
                log_crf[rows] = predicted.crf + spread * rng.standard_normal(predicted.crf.shape)
        return log_crf

    def law_probability(self, law: Law) -> float:
        """Return the posterior probability of a law, with discrepancy."""
        return float(np.mean(self.draws.law == LAWS.index(law)))

    @property
    def law_error(self) -> float:
        """Posterior mean of the law's error, relative to CRF."""
        return float(np.mean(self.draws.sizes["crf"]))

    @property
    def identifiable(self) -> bool:
        """True if both CLR and Sq are identified."""
        return bool(self.observations) and not self._unidentified()

    def _unidentified(self) -> list[str]:
        estimates = self.posterior()
        return [
            key
            for key in KEY_QUANTITIES
            if key in estimates and estimates[key].information_bits < IDENTIFIED_BITS
        ]

    @property
    def resonant(self) -> bool:
        """True if a contact resonance was measured, not capacitances alone."""
        return any(not np.isnan(point.crf.value) for point in self.forward.points)

    @property
    def reason(self) -> str:
        """Reason why CLR or Sq is not identified; empty if both are."""
        if not self.observations:
            return f"no recording shows a contact resonance ({_most_frequent(self.excluded)})"
        unidentified = self._unidentified()
        estimates = self.posterior()
        if not unidentified:
            return ""
        points = len({point.names for point in self.forward.points if point.names})
        names = " and ".join(quantity(key).short for key in unidentified)
        gains = " and ".join(f"{estimates[key].information_bits:.1f}" for key in unidentified)
        reasons = [f"{names}: information gain {gains} bits"]
        if points == 1 and self.resonant:
            reasons.append("one operating point gives one frequency, which many contacts share")
        confounded = self._confounded()
        if confounded:
            reasons.append(f"{confounded[0]} and {confounded[1]} are confounded")
        if self.law_error > LARGE_LAW_ERROR:
            reasons.append(f"the spring law has an error of {100 * self.law_error:.0f} % of CRF")
        return "; ".join(reasons)

    def _confounded(self) -> tuple[str, str] | None:
        """Return the two most correlated unknowns, if they are confounded."""
        count = len(self.setting.unknowns)
        if count < 2:
            return None
        correlation = np.abs(np.corrcoef(self.draws.z.T)) - np.eye(count)
        first, second = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
        if correlation[first, second] < CONFOUNDED:
            return None
        names = [
            quantity(self.setting.unknowns[int(number)].key).name for number in (first, second)
        ]
        return names[0], names[1]

    @property
    def grid_effect(self) -> tuple[float, float]:
        """Grid error of CLR at its median, and half the width of its interval (load shares)."""
        estimate = self.posterior()[CLR]
        scale = OUTPUTS[CLR]
        change = self.emulator.grid[CLR].rms if CLR in self.emulator.grid else 0.0
        median = scale.forward(np.array(estimate.median))
        effect = float(abs(scale.back(median + change) - scale.back(median - change)) / 2.0)
        return effect, 0.5 * (estimate.high - estimate.low)

    def warnings(self) -> tuple[str, ...]:
        """Return warnings: priors that limit the posterior, grid error, laws that do not fit."""
        warnings = []
        for key, estimate in self.posterior().items():
            if estimate.against:
                end = "lower" if estimate.against == "low" else "upper"
                warnings.append(
                    f"{quantity(key).name} is limited by the {end} end of its prior; widen its "
                    "range in [infer] if physically possible."
                )
        if not self.observations:
            return tuple(warnings)
        by_grid, half = self.grid_effect
        if by_grid > half:
            warnings.append(
                f"The emulator's grid error is {100 * by_grid:.1f} points of CLR, more than half "
                f"the interval's width ({100 * half:.1f}); increase infer.cells."
            )
        paper = self.law_probability("hertz-point")
        if paper < UNLIKELY:
            warnings.append(
                "The recordings fit the contact's own stiffness, not the paper's sphere "
                f"(probability {paper:.2g}): CRF then depends little on CLR, damping more."
            )
        if self.law_error > LARGE_LAW_ERROR:
            warnings.append(
                "No spring law fits within the measurement uncertainty: the intervals include a "
                f"model error of about {100 * self.law_error:.0f} % of CRF."
            )
        return tuple(warnings)

    def verdict(self) -> str:
        """Return CLR and Sq with intervals, or why they are not identified; and the next point."""
        if not self.observations:
            return f"Not identified: {self.reason}. The stated values are the prior."
        estimates = self.posterior()
        following = self.next_point
        parts = []
        for key in KEY_QUANTITIES:
            if key in estimates:
                estimate = estimates[key]
                entry = quantity(key)
                interval = entry.interval(estimate.low, estimate.high)
                value = (
                    f"{entry.text(estimate.median)} ({interval}, {PERCENT})"
                    if estimate.information_bits >= IDENTIFIED_BITS
                    else "not identified"
                )
                parts.append(f"{entry.short} {value}")
        identified = [
            key
            for key in KEY_QUANTITIES
            if key in estimates and estimates[key].information_bits >= IDENTIFIED_BITS
        ]
        first = "; ".join(parts) if identified else f"Not identified: {self.reason}"
        reason = f" ({self.reason})" if identified and self.reason else ""
        load = quantity("load_n").text(following.load_n)
        speed = quantity("entrainment_speed_m_s").text(following.entrainment_m_s)
        return (
            f"{first}{reason}. Next, run {load} at {speed}: "
            f"{following.information_bits:.1f} bits expected."
        )

    def scalars(self) -> JsonObject:
        """Return the JSON output of `asperity infer`, SI."""
        conditions = self.setting.case.conditions
        return {
            "verdict": self.verdict(),
            "identifiable": self.identifiable,
            "reason": self.reason,
            "posterior": {key: entry.scalars() for key, entry in self.posterior().items()},
            "without_discrepancy": {
                key: entry.scalars() for key, entry in self.posterior(discrepancy=False).items()
            },
            "stages": stage_probabilities(self.values(self.draws)[CLR]),
            "load_n": conditions.load,
            "entrainment_m_s": conditions.entrainment_speed,
            "points": [point.scalars() for point in self.point_estimates()],
            "next_point": self.next_point.scalars(),
            "evidence": [model.scalars() for model in self.models],
            "law_error": self.law_error if self.observations else None,
            "observations": len(self.observations),
            "silent": [{"file": name, "reason": reason} for name, reason in self.excluded],
            "emulator": self.emulator.scalars(),
            "notes": [*self.warnings(), *self.notes],
        }


def stage_probabilities(clr: Field) -> dict[str, float]:
    """Return the probability of each lubrication regime from draws of CLR."""
    full = float(np.mean(clr < FULL_FILM_BELOW))
    boundary = float(np.mean(clr >= BOUNDARY_FROM))
    return dict(zip(REGIMES, (full, 1.0 - full - boundary, boundary), strict=True))


def _most_frequent(excluded: tuple[tuple[str, str], ...]) -> str:
    """Return the most frequent reason and its number of recordings."""
    reasons = [reason for _, reason in excluded]
    if not reasons:
        return "none was given"
    mode = max(dict.fromkeys(reasons), key=reasons.count)
    return f"{reasons.count(mode)} of {len(reasons)}: {mode.rstrip('.')}"
