"""Lay of a surface, from its autocorrelation."""

import math
import re

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.surface import gaussian_surface, surface_parameters
from asperity.surface.parameters import lay_text


@pytest.mark.parametrize("degrees", [-60.0, -20.0, 0.0, 35.0, 90.0])
def test_the_lay_is_the_direction_of_the_slowest_decay(degrees):
    grid = Grid(cells=(256, 200), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    surface = gaussian_surface(
        grid,
        sq=1e-7,
        correlation_length=(80e-6, 12e-6),
        direction=math.radians(degrees),
        rng=np.random.default_rng(3),
    )
    found = surface_parameters(surface)
    off = (found.lay_deg - degrees + 90.0) % 180.0 - 90.0
    assert abs(off) < 3.0
    stated = int(re.search(r"lay at (\d+) degrees from rolling \(Str", lay_text(surface))[1])
    assert stated == pytest.approx(abs(degrees), abs=5)


def test_an_isotropic_surface_has_no_lay():
    grid = Grid(cells=(256, 256), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    rng = np.random.default_rng(3)
    surface = gaussian_surface(grid, sq=1e-7, correlation_length=20e-6, rng=rng)
    assert math.isnan(surface_parameters(surface).lay_deg)
    assert lay_text(surface).startswith("has no lay (Str 0.")
