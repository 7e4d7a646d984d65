"""Criteria for a line of a series: evidence, misfit, location, width, rivals."""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.band_fit import STRONG_EVIDENCE
from asperity.resonance.line_fit import JointFit
from asperity.resonance.spectrum_model import SpectrumBlocks, expected_density, whittle_costs
from asperity.resonance.template_search import Templates

LARGEST_MISFIT = 0.3  # relative rms residual beyond chance
LARGEST_DAMPING_RATIO = (
    0.1  # of a contact: 0.01 dry to 0.1 in boundary lubrication, the paper's section 2.1
)
RIVAL_EVIDENCE = 10.0  # required lead in ln likelihood over every other location in the band


class JudgedLine(NamedTuple):
    """Criteria of a recording's line.

    `lead` is the ln likelihood over that of a line at `rival`, the best other location [Hz].
    """

    f0: float
    f0_std: float
    damping: float
    evidence: float
    misfit: float
    rival: float
    lead: float

    @property
    def width(self) -> float:
        """Half-power width [Hz]."""
        return 2.0 * self.damping * self.f0


def best_rival(f0: float, damping: float, cost: Field, templates: Templates) -> tuple[float, float]:
    """Return the best frequency more than three widths away, and the ln likelihood lead over it."""
    distant = np.abs(templates.f0 - f0) > 6.0 * damping * f0
    if np.all(distant) or not np.any(distant):
        return np.nan, np.inf
    return float(templates.f0[distant][np.argmin(cost[distant])]), float(
        np.min(cost[distant]) - np.min(cost[~distant])
    )


def line_objection(line: JudgedLine, band_hz: tuple[float, float]) -> str | None:
    """Return the reason why a line is not accepted as the contact's, or None."""
    low, high = band_hz
    if line.evidence < STRONG_EVIDENCE:
        return (
            "no line moves or changes height relative to the shared spectrum between "
            f"{low:.0f} and {high:.0f} Hz (BIC {line.evidence:+.1f})"
        )
    if line.misfit > LARGEST_MISFIT:
        return (
            "the spectrum is not the shared spectrum plus one line (misfit "
            f"{100 * line.misfit:.0f} % beyond chance)"
        )
    if not low + 3.0 * line.f0_std < line.f0 < high - 3.0 * line.f0_std:
        return f"the line peaks at or beyond the edge of the band {low:.0f} to {high:.0f} Hz"
    if line.width > (high - low) / 2.0:
        return (
            f"the line at {line.f0:.0f} Hz is wider than half the band ({line.width:.0f} Hz): a "
            "slope, not a resonance"
        )
    if line.damping > LARGEST_DAMPING_RATIO:
        return (
            f"the line at {line.f0:.0f} Hz is wider than a contact's damping allows "
            f"({line.width:.0f} Hz, damping ratio {line.damping:.2g}; at most "
            f"{LARGEST_DAMPING_RATIO:g}): a slope, or part of the machine"
        )
    if line.lead < RIVAL_EVIDENCE:
        return f"a line at {line.rival:.0f} Hz fits as well as the one at {line.f0:.0f} Hz"
    if line.f0_std > line.width:
        return (
            f"the line at {line.f0:.0f} Hz cannot be separated from the shared spectrum "
            f"(± {line.f0_std:.0f} Hz)"
        )
    return None


def line_gain(blocks: SpectrumBlocks, joint: JointFit) -> tuple[Field, Field]:
    """Return 2 ln likelihood gained by the line, and the density of the shared spectrum alone."""
    base = np.exp(joint.parameters.base)
    relative = np.sum(blocks.weight * blocks.density / base, axis=1) / blocks.weight.sum(axis=1)
    alone = relative[:, None] * base
    with_line = whittle_costs(blocks, expected_density(blocks, joint.parameters))
    return 2.0 * (whittle_costs(blocks, alone) - with_line), alone
