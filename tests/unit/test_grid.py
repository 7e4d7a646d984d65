import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput


def test_samples_are_at_cell_centres():
    grid = Grid((8, 10), (-3.0, 0.0), (1.0, 5.0))
    assert grid.spacing == (0.5, 0.5)
    assert grid.extent == (4.0, 5.0)
    np.testing.assert_allclose(
        grid.x, [-2.75, -2.25, -1.75, -1.25, -0.75, -0.25, 0.25, 0.75], rtol=1e-15
    )
    np.testing.assert_allclose(grid.y, np.linspace(0.25, 4.75, 10), rtol=1e-15)
    assert grid.periodic == (False, True)


@pytest.mark.parametrize(
    ("cells", "upper", "message"),
    [
        ((3, 64), (1.0, 1.0), "at least 8 cells along x, got 3"),
        ((64, 7), (1.0, 1.0), "at least 8 cells along y, got 7"),
        ((64, 64), (-1.0, 1.0), "upper x"),
        ((64, 64), (1.0, 0.0), "upper y"),
        ((64, 64), (float("nan"), 1.0), "upper x"),
    ],
)
def test_an_empty_or_too_coarse_grid_is_refused(cells, upper, message):
    with pytest.raises(BadInput, match=message):
        Grid(cells, (0.0, 0.0), upper)
