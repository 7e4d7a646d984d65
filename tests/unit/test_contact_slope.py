from dataclasses import replace

import numpy as np
import pytest

from asperity import Surface, contact_state, solve_contact
from asperity.solution import regime_card
from support.paper import contact, grid


def test_the_mean_slope_of_waves_matches_the_closed_form():
    wave_grid = grid((96, 48))
    length, height = wave_grid.extent[0] / 4.0, 0.2e-6
    waves = (
        height * np.sin(2.0 * np.pi * (wave_grid.x[:, None] - wave_grid.lower[0]) / length)
        + 0.0 * wave_grid.y
    )
    solution = solve_contact(contact(), None, Surface(waves, wave_grid), strict=False)
    assert solution.in_contact.any()
    everywhere = replace(solution, in_contact=np.ones_like(solution.in_contact))
    exact = height * 2.0 * np.pi / length * 2.0 / np.pi
    assert contact_state(everywhere).contact_slope == pytest.approx(exact, rel=0.01)
    nowhere = replace(solution, in_contact=np.zeros_like(solution.in_contact))
    assert contact_state(nowhere).contact_slope is None
    # all of the zone: 2 π height/length times the share of cos² there
    zone = np.abs(wave_grid.x) <= contact().hertz.half_widths[0]
    phase = 2.0 * np.pi * (wave_grid.x[zone] - wave_grid.lower[0]) / length
    rms = height * 2.0 * np.pi / length * np.sqrt(np.mean(np.cos(phase) ** 2))
    assert contact_state(solution).rms_slope == pytest.approx(rms, rel=0.02)
    card = regime_card(solution)
    assert card.rms_slope == card.to_dict()["rms_slope"] == contact_state(solution).rms_slope
    assert ("roughness", f"Sdq {card.rms_slope:.3g}") in card.rows()
