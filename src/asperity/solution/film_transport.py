"""Heat that the oil of a film carries along, on a grid: upwind and conserved."""

from collections.abc import Callable

import numpy as np
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field


class FilmTransport:
    """Transport of a temperature T by the flow of heat capacity W [W/m/K], div(W T).

    Oil enters the grid at T = 0.

    Parameters
    ----------
    along : component of W along x on the faces of cells, the outer ones included, (nx + 1, ny)
    across : component along y, (nx, ny + 1)
    """

    def __init__(self, grid: Grid, along: Field, across: Field) -> None:
        dx, dy = grid.spacing
        self.cells, self.periodic, self.cell_area = grid.cells, grid.periodic[1], dx * dy
        self.east, self.north = dy * along, dx * across  # heat per temperature [W/K]
        self.leaving_edge = self._leaving_edge()
        self.matrix = self._matrix()

    def _leaving_edge(self) -> Field:
        """Return the outflow of each cell through the edges of the grid [W/K]."""
        outflow: Field = np.zeros(self.cells)
        outflow[0] += np.maximum(-self.east[0], 0.0)
        outflow[-1] += np.maximum(self.east[-1], 0.0)
        if not self.periodic:
            outflow[:, 0] += np.maximum(-self.north[:, 0], 0.0)
            outflow[:, -1] += np.maximum(self.north[:, -1], 0.0)
        return outflow

    def _matrix(self) -> scipy.sparse.csc_array:
        """Return the net outflow of each cell [W/K], a sparse matrix over temperatures."""
        number = np.arange(self.leaving_edge.size).reshape(self.cells)
        inner = [
            (number[:-1], number[1:], self.east[1:-1]),
            (number[:, :-1], number[:, 1:], self.north[:, 1:-1]),
        ]
        if self.periodic:
            inner.append((number[:, -1], number[:, 0], self.north[:, 0]))
        behind, ahead, through = (
            np.concatenate([part.ravel() for part in parts]) for parts in zip(*inner, strict=True)
        )
        forward, back = np.maximum(through, 0.0), np.maximum(-through, 0.0)
        own = number.ravel()
        rows = np.concatenate([behind, ahead, ahead, behind, own])
        columns = np.concatenate([behind, behind, ahead, ahead, own])
        values = np.concatenate([forward, -forward, back, -back, self.leaving_edge.ravel()])
        return scipy.sparse.csc_array((values, (rows, columns)), shape=2 * (own.size,))

    def apply(self, temperature: Field) -> Field:
        """Return div(W T) [W/m^2]."""
        flat = self.matrix @ temperature.ravel()
        return np.asarray(flat.reshape(self.cells) / self.cell_area)

    def solver(self, conduction: Field) -> Callable[[Field], Field]:
        """Return a function that solves div(W T) + G T = q for T.

        Parameters
        ----------
        conduction : G [W/m^2/K], (nx, ny), positive
        """
        diagonal = scipy.sparse.diags_array(self.cell_area * conduction.ravel(), format="csc")
        factors = scipy.sparse.linalg.splu(self.matrix + diagonal)

        def solve(source: Field) -> Field:
            return np.asarray(factors.solve(self.cell_area * source.ravel())).reshape(self.cells)

        return solve

    def leaving(self, temperature: Field) -> float:
        """Return the heat that leaves through the edges of the grid [W]."""
        return float((self.leaving_edge * temperature).sum())
