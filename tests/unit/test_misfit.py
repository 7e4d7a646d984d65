"""What fits leave of a structure, and what that makes of deviations."""

import numpy as np
import pytest

from asperity.resonance.line_fit import JointFit
from asperity.resonance.residuals import ResidualStatistics, systematic_errors
from asperity.resonance.spectrum_model import ModelParameters, SpectrumBlocks, line_densities
from asperity.resonance.transfer import unit_transfer

CENTRE = np.linspace(2000.0, 5000.0, 600)
LEFT = 0.1


@pytest.mark.parametrize("damping", [0.005, 0.02])
def test_what_a_structure_brings_does_not_hang_on_where_the_band_begins(damping):
    """One line, moved over one spline's spacing."""
    passed = unit_transfer(2000.0, 5000.0)
    f0 = 3000.0 + passed.spacing_hz * np.linspace(0.0, 1.0, 21)
    own = np.stack([np.zeros(21), np.log(f0), np.full(21, np.log(damping)), np.zeros(21)], axis=1)
    own[:, 0] += np.log(10.0) - np.log(
        line_densities(CENTRE, ModelParameters(own, np.zeros(600), passed)).max(axis=1)
    )
    joint = JointFit(
        ModelParameters(own, np.zeros(600), passed), 0.0, np.zeros((21, 4)), np.zeros((49, 49))
    )
    blocks = SpectrumBlocks(CENTRE, np.ones((21, 600)), np.full((21, 600), 20.0))
    nothing = np.zeros((0, 600))
    statistics = ResidualStatistics(nothing.astype(bool), nothing, nothing, np.full(600, LEFT**2))
    std = systematic_errors(blocks, joint, statistics).model_error
    assert np.ptp(std, axis=0) == pytest.approx(np.zeros(4), abs=0.03 * std.mean())
    assert np.all(
        std[:, 1] < LEFT * 2.0 * damping
    )  # less than what is left would move the whole line's width by
    assert np.all(std[:, 0] > 0.5 * LEFT)
