"""What recordings say of a contact: posteriors with intervals, what was learned, and what cannot be told."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.inference.emulator import Emulator
from asperity.inference.estimates import Estimate, quantity_estimates
from asperity.inference.forward import LAWS, Forward, Law
from asperity.inference.next_point import NextPoint
from asperity.inference.observations import Observation, OperatingPoint
from asperity.inference.outputs import CLR, FILM, OUTPUTS
from asperity.inference.posterior import Draws, ModelEvidence
from asperity.inference.sampling import Pool
from asperity.inference.settings import Setting
from asperity.results import BOUNDARY_FROM, FULL_FILM_BELOW

STAGES = ("full film", "mixed lubrication", "boundary lubrication")
KEY_QUANTITIES = (CLR, "sq_m")  # what the product is asked for
IDENTIFIED_BITS = (
    1.0  # of CLR or Sq, from which on it is called told: half of what was possible is ruled out
)
TIED = 0.7  # correlation from which on two unknowns are said to stand in for one another
LAW_OFF = 0.05  # of CRF, in the mean: before any recording 0.035
UNLIKELY = 0.1  # probability of the case's law, below which it is said to be wrong


@dataclass(frozen=True)
class PointEstimates:
    """An operating point: its conditions, the contact's state there, and the stage with its probabilities."""

    HEADS: ClassVar[tuple[str, ...]] = (
        "load",
        "speed",
        "recordings",
        "CLR, 90 %",
        "mean film, 90 %",
        "stage",
    )

    point: OperatingPoint
    state: Mapping[str, Estimate]
    stages: Mapping[str, float]

    def cells(self) -> list[str]:
        """A row of `HEADS`, in words."""
        clr, film = self.state[CLR], self.state[FILM]
        stage, probability = max(self.stages.items(), key=lambda entry: entry[1])
        return [
            quantity("load_n").text(self.point.load_n),
            quantity("entrainment_speed_m_s").text(self.point.entrainment_m_s),
            str(len(self.point.names)),
            quantity(CLR).interval(clr.low, clr.high),
            quantity(FILM).interval(film.low, film.high),
            f"{stage} ({100.0 * probability:.0f} %)",
        ]

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "load_n": self.point.load_n,
            "entrainment_m_s": self.point.entrainment_m_s,
            "temperature_k": self.point.temperature_k,
            "files": list(self.point.names),
            "state": {key: one.scalars() for key, one in self.state.items()},
            "stages": dict(self.stages),
        }


@dataclass(frozen=True)
class Inference:
    """What recordings say of a contact. Made by `infer_contact`.

    Parameters
    ----------
    forward : what was asked: the setting, its emulator, and the operating points. The first point is the case's own
    observations : what was heard
    silent : recordings without a resonance, and why
    models : laws with and without a term for their error, with their evidence
    prior, draws, exact : possible contacts before, after, and after if no law had an error
    next_point : what to run next, the best of `candidates`
    pools : all draws, so that another recording needs few more
    notes : what a reader has to know
    """

    forward: Forward
    observations: tuple[Observation, ...]
    silent: tuple[tuple[str, str], ...]
    models: tuple[ModelEvidence, ...]
    prior: Draws
    draws: Draws
    exact: Draws
    candidates: tuple[NextPoint, ...]
    pools: Mapping[Law, Pool] = field(repr=False)
    seed: int = 0
    notes: tuple[str, ...] = ()

    @property
    def setting(self) -> Setting:
        """What was to be inferred."""
        return self.forward.setting

    @property
    def emulator(self) -> Emulator:
        """What answered."""
        return self.forward.emulator

    @property
    def next_point(self) -> NextPoint:
        """The load and speed at which one more recording is expected to tell most."""
        return max(self.candidates, key=lambda one: one.information_bits)

    def values(self, draws: Draws, place: int = 0) -> dict[str, Field]:
        """Every quantity of possible contacts by its key, SI: states at a point, and unknowns."""
        states = {key: columns[:, place] for key, columns in draws.states.items()}
        unknowns = {
            unknown.key: unknown.value(draws.z[:, number])
            for number, unknown in enumerate(self.setting.unknowns)
        }
        if "sq_m" in unknowns:
            states["lambda_ratio"] = states[FILM] / unknowns["sq_m"]
        return {**states, **unknowns}

    def posterior(self, *, discrepancy: bool = True) -> dict[str, Estimate]:
        """Every quantity at the case's own load and speed, with what was learned of it."""
        draws = self.draws if discrepancy else self.exact
        bounded = frozenset(unknown.key for unknown in self.setting.unknowns if unknown.bounded)
        return quantity_estimates(
            self.values(draws), self.values(self.prior), draws.effective, bounded
        )

    def point_estimates(self) -> tuple[PointEstimates, ...]:
        """The contact's state at each operating point that was recorded."""
        found = []
        for place, point in enumerate(self.forward.points):
            if np.isnan(point.crf.value):
                continue
            after, before = self.values(self.draws, place), self.values(self.prior, place)
            keys = [*self.draws.states, *(["lambda_ratio"] if "lambda_ratio" in after else [])]
            state = quantity_estimates(
                {key: after[key] for key in keys},
                {key: before[key] for key in keys},
                self.draws.effective,
                frozenset(),
            )
            found.append(PointEstimates(point, state, stages(after[CLR])))
        return tuple(found)

    def posterior_predictive(self) -> Field:
        """Logarithms of CRF that possible contacts would show, shape (n, points), with errors of emulator and law."""
        rng = np.random.default_rng([self.seed, 7])
        heard = np.empty((len(self.draws.z), len(self.forward.points)))
        for number, law in enumerate(LAWS):
            rows = self.draws.law == number
            if rows.any():
                shown = self.forward.shown(self.draws.z[rows], law, heights=False)
                spread = np.hypot(shown.crf_std, self.draws.sizes["crf"][rows][:, None])
                heard[rows] = shown.crf + spread * rng.standard_normal(shown.crf.shape)
        return heard

    def law_probability(self, law: Law) -> float:
        """Of a law among both, with its error."""
        return float(np.mean(self.draws.law == LAWS.index(law)))

    @property
    def law_error(self) -> float:
        """The law's error, relative to CRF, in the mean over what is possible."""
        return float(np.mean(self.draws.sizes["crf"]))

    @property
    def identifiable(self) -> bool:
        """Whether CLR and Sq are both told."""
        return bool(self.observations) and not self._untold()

    def _untold(self) -> list[str]:
        known = self.posterior()
        return [
            key
            for key in KEY_QUANTITIES
            if key in known and known[key].information_bits < IDENTIFIED_BITS
        ]

    @property
    def reason(self) -> str:
        """Why not all of CLR and Sq is told; empty where it is."""
        if not self.observations:
            return f"no recording shows a contact resonance ({_commonest(self.silent)})"
        untold, known = self._untold(), self.posterior()
        if not untold:
            return ""
        places = len({point.names for point in self.forward.points if point.names})
        names = " and ".join(quantity(key).short for key in untold)
        said = [
            f"{names}: {' and '.join(f'{known[key].information_bits:.1f}' for key in untold)} bits learned"
        ]
        if places == 1:
            said.append("one operating point is one frequency, which many contacts have in common")
        tied = self._tied()
        if tied:
            said.append(f"{tied[0]} and {tied[1]} stand in for one another")
        if self.law_error > LAW_OFF:
            said.append(f"the law of the spring is off by {100 * self.law_error:.0f} % of CRF")
        return "; ".join(said)

    def _tied(self) -> tuple[str, str] | None:
        """The two unknowns that are most alike in what they do, where they are."""
        count = len(self.setting.unknowns)
        if count < 2:
            return None
        alike = np.abs(np.corrcoef(self.draws.z.T)) - np.eye(count)
        first, second = np.unravel_index(int(np.argmax(alike)), alike.shape)
        if alike[first, second] < TIED:
            return None
        names = [
            quantity(self.setting.unknowns[int(number)].key).name for number in (first, second)
        ]
        return names[0], names[1]

    @property
    def grid_effect(self) -> tuple[float, float]:
        """What twice the cells change of CLR at its median, and half the width of its interval; shares of the load."""
        one, scale = self.posterior()[CLR], OUTPUTS[CLR]
        moved = self.emulator.grid[CLR].rms if CLR in self.emulator.grid else 0.0
        at = scale.forward(np.array(one.median))
        return float(abs(scale.back(at + moved) - scale.back(at - moved)) / 2.0), 0.5 * (
            one.high - one.low
        )

    def warnings(self) -> tuple[str, ...]:
        """What makes the intervals doubtful: a posterior against its prior's end, a law that does not fit."""
        said = []
        for key, one in self.posterior().items():
            if one.against:
                end = "lower" if one.against == "low" else "upper"
                said.append(
                    f"{quantity(key).name} lies against the {end} end of its prior, which decides its interval; widen "
                    "it in [infer] if more is possible."
                )
        if not self.observations:
            return tuple(said)
        by_grid, half = self.grid_effect
        if by_grid > half:
            said.append(
                f"The emulator's own grid is off by {100 * by_grid:.1f} points of CLR, more than half the interval's "
                f"width ({100 * half:.1f}); state more infer.cells."
            )
        paper = self.law_probability("hertz-point")
        if paper < UNLIKELY:
            said.append(
                f"The recordings fit the contact's own stiffness, not the paper's sphere (probability {paper:.2g}): "
                "CRF says little of the load share then, and damping more."
            )
        if self.law_error > LAW_OFF:
            said.append(
                f"No law of the spring fits within the deviations of what was heard: an error of about "
                f"{100 * self.law_error:.0f} % of CRF is needed, and the intervals allow for it."
            )
        return tuple(said)

    def verdict(self) -> str:
        """One or two sentences: what is told, or that it cannot be told and why; and what to run next."""
        if not self.observations:
            return f"Cannot be told: {self.reason}. What is stated is what was known before."
        known, following = self.posterior(), self.next_point
        parts = []
        for key in KEY_QUANTITIES:
            if key in known:
                one, shown = known[key], quantity(key)
                interval = shown.interval(one.low, one.high)
                value = (
                    f"{shown.text(one.median)} ({interval}, 90 %)"
                    if one.information_bits >= IDENTIFIED_BITS
                    else "not told"
                )
                parts.append(f"{shown.short} {value}")
        told = [
            key
            for key in KEY_QUANTITIES
            if key in known and known[key].information_bits >= IDENTIFIED_BITS
        ]
        first = "; ".join(parts) if told else f"Cannot be told: {self.reason}"
        why = f" ({self.reason})" if told and self.reason else ""
        load, speed = quantity("load_n"), quantity("entrainment_speed_m_s")
        return (
            f"{first}{why}. Next, run {load.text(following.load_n)} at {speed.text(following.entrainment_m_s)}: "
            f"{following.information_bits:.1f} bits expected."
        )

    def scalars(self) -> dict[str, Any]:
        """What `asperity infer --json` prints, SI."""
        conditions = self.setting.case.conditions
        return {
            "verdict": self.verdict(),
            "identifiable": self.identifiable,
            "reason": self.reason,
            "posterior": {key: one.scalars() for key, one in self.posterior().items()},
            "without_discrepancy": {
                key: one.scalars() for key, one in self.posterior(discrepancy=False).items()
            },
            "stages": stages(self.values(self.draws)[CLR]),
            "load_n": conditions.load,
            "entrainment_m_s": conditions.entrainment_speed,
            "points": [one.scalars() for one in self.point_estimates()],
            "next_point": self.next_point.scalars(),
            "evidence": [model.scalars() for model in self.models],
            "law_error": self.law_error if self.observations else None,
            "observations": len(self.observations),
            "silent": [{"file": name, "reason": reason} for name, reason in self.silent],
            "emulator": self.emulator.scalars(),
            "notes": [*self.warnings(), *self.notes],
        }


def stages(clr: Field) -> dict[str, float]:
    """Probability of each stage of lubrication, from possible load shares."""
    full, boundary = float(np.mean(clr < FULL_FILM_BELOW)), float(np.mean(clr >= BOUNDARY_FROM))
    return dict(zip(STAGES, (full, 1.0 - full - boundary, boundary), strict=True))


def _commonest(silent: tuple[tuple[str, str], ...]) -> str:
    """The reason that most recordings have, and how many."""
    reasons = [reason for _, reason in silent]
    if not reasons:
        return "none was given"
    most = max(dict.fromkeys(reasons), key=reasons.count)
    return f"{reasons.count(most)} of {len(reasons)}: {most.rstrip('.')}"
