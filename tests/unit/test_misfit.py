"""Systematic errors of fitted lines from unmodelled structural resonances."""

import numpy as np
import pytest

from asperity.resonance.line_fit import JointFit
from asperity.resonance.residuals import ResidualStatistics, systematic_errors
from asperity.resonance.spectrum_model import ModelParameters, SpectrumBlocks, line_densities
from asperity.resonance.transfer import unit_transfer

CENTRE = np.linspace(2000.0, 5000.0, 600)
RESIDUAL_STD = 0.1


@pytest.mark.parametrize("damping", [0.005, 0.02])
def test_the_structural_error_does_not_depend_on_the_lower_band_edge(damping):
    """One line, moved over one spacing of the spline."""
    transfer = unit_transfer(2000.0, 5000.0)
    f0 = 3000.0 + transfer.spacing_hz * np.linspace(0.0, 1.0, 21)
    parameters = np.stack(
        [np.zeros(21), np.log(f0), np.full(21, np.log(damping)), np.zeros(21)], axis=1
    )
    parameters[:, 0] += np.log(10.0) - np.log(
        line_densities(CENTRE, ModelParameters(parameters, np.zeros(600), transfer)).max(axis=1)
    )
    joint = JointFit(
        ModelParameters(parameters, np.zeros(600), transfer),
        0.0,
        np.zeros((21, 4)),
        np.zeros((49, 49)),
    )
    blocks = SpectrumBlocks(CENTRE, np.ones((21, 600)), np.full((21, 600), 20.0))
    no_residuals = np.zeros((0, 600))
    statistics = ResidualStatistics(
        no_residuals.astype(bool), no_residuals, no_residuals, np.full(600, RESIDUAL_STD**2)
    )
    std = systematic_errors(blocks, joint, statistics).model_error
    assert np.ptp(std, axis=0) == pytest.approx(np.zeros(4), abs=0.03 * std.mean())
    assert np.all(
        std[:, 1] < RESIDUAL_STD * 2.0 * damping
    )  # less than the shift of the whole line by the residual
    assert np.all(std[:, 0] > 0.5 * RESIDUAL_STD)
