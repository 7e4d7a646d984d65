"""Linearised single-pressure contact and its preconditioner, both in single precision.

Newton's step is needed to a tenth only, and its residual is evaluated in double precision: single
precision changes neither the solution nor the number of steps, and halves the memory traffic.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from asperity.core.arrays import Field
from asperity.ehl.controls import PRECONDITIONER
from asperity.ehl.deflection import MIRROR_BETWEEN
from asperity.ehl.grid_transfer import Index
from asperity.ehl.models.single_pressure import Balance, Precision
from asperity.ehl.models.transient_term import TransientTerm
from asperity.kernels import line_relaxation, multigrid, reynolds, stencils
from asperity.kernels.multigrid import GridHierarchy
from asperity.kernels.reynolds import LUBRICATED, Faces, Film
from asperity.kernels.stencils import OuterNeighbours, Stencil


class StoredOil(NamedTuple):
    """Storage of oil in the scaled equations of lubricated cells.

    Per change of gap and of pressure.
    """

    by_gap: Field
    by_pressure: Field


class Linear:
    """Linearisation of a balance: `product` applies it, a call approximately inverts it.

    The approximate inverse has two parts. The five-point stencil of the lubricated cells,
    aggregated onto blocks of cells and factored, removes slow, smooth modes (thick, low-pressure
    valleys); zebra line relaxation along x removes the rest.
    """

    def __init__(
        self, balance: Balance, *, storing: float = 0.0, dtype: Precision = np.float32
    ) -> None:
        self.balance, self.dtype = balance, dtype
        self.cells = balance.problem.cells
        self.unknown = balance.unknown
        self.pressure = balance.pressure.astype(dtype)
        scale = balance.rows.fluid_scale.astype(dtype)
        self.rows = balance.rows._replace(fluid_scale=scale)
        self.film = (
            None if balance.film is None else Film(*(part.astype(dtype) for part in balance.film))
        )
        self.faces = None if balance.faces is None else single_faces(balance.faces, dtype)
        self.storing, self.storage = storing, self._storage(balance.problem.past, storing)
        if (
            self.film is not None
            and balance.problem.past is not None
            and balance.problem.past.lagrangian
        ):
            self.film = self.film.without_wedge
        self.stencil = self._stencil()
        self.lines = LineRelaxation(self.stencil)
        if self.film is not None:
            self.blocks = BlockSolver(
                self.stencil, np.where(balance.rows.state == LUBRICATED, 1.0 / scale, dtype(0.0))
            )

    def product(self, d_pressure: Field, d_approach: float) -> Field:
        """Apply the linearised equations to a change of pressure and approach."""
        problem = self.balance.problem
        d_gap = problem.deflection(d_pressure)
        d_gap += self.dtype(d_approach)
        return self.of_gap(d_pressure, d_gap)

    def of_gap(self, d_pressure: Field, d_gap: Field) -> Field:
        """Apply the linearised equations to a change of pressure and gap."""
        problem = self.balance.problem
        if self.film is None or self.faces is None:
            touching = self.rows.state == reynolds.TOUCHING
            return np.where(touching, d_gap * self.dtype(self.rows.contact_scale), d_pressure)
        out, d_gap = np.empty(self.cells, self.dtype), problem.filmed(d_gap)
        reynolds.jacobian_product(
            self.rows,
            self.film,
            self.faces,
            self.pressure,
            reynolds.PressureChange(d_pressure, d_gap),
            problem.spacing,
            self.storing,
            out,
        )
        if self.storage is not None:
            out += self.storage.by_gap * d_gap
            out += self.storage.by_pressure * d_pressure
        return out

    def __call__(self, residual: Field) -> Field:
        """Return an approximate change of pressure for a residual, both (nx, ny).

        Zero in cells whose pressure is known.
        """
        change = np.zeros(self.cells, self.dtype) if self.film is None else self.blocks(residual)
        return self.lines(residual, change)

    def _storage(self, past: TransientTerm | None, storing: float) -> StoredOil | None:
        """Return the storage that the kernels leave out: all of it for Lagrangian oil.

        The wedge's inflow into the first two rows is neglected: so far from the contact only the
        Poiseuille flow depends on pressure.
        """
        if past is None or self.film is None:
            return None
        rate = self.dtype(past.rate + (storing if past.lagrangian else 0.0))
        scaled = np.where(
            self.rows.state == LUBRICATED, self.rows.fluid_scale * rate, self.dtype(0.0)
        )
        return StoredOil(scaled * self.film.content_by_gap, scaled * self.film.content_by_pressure)

    def _stencil(self) -> Stencil:
        """Return the five-point stencil."""
        stencil = Stencil(*np.empty((5, *self.cells), self.dtype))
        zero = np.zeros(self.cells, self.dtype)
        film = self.film or Film(*[zero] * 8)
        faces = self.faces or Faces._make([*[zero] * 6, zero[0], zero[0], *[zero] * 4, 0])
        problem = self.balance.problem
        compliance = problem.deflection.local_compliance
        stencils.local_stencil(
            self.rows, film, faces, compliance, problem.spacing, self.storing, stencil
        )
        if self.storage is not None:
            centre, neighbour = (self.dtype(compliance[k] - compliance[3]) for k in (0, 1))
            stencil.centre[:] += self.storage.by_gap * centre + self.storage.by_pressure
            stencil.west[:] += self.storage.by_gap * neighbour
            stencil.east[:] += self.storage.by_gap * neighbour
        fold_at_mirror(stencil, problem.mirror)
        return stencil


def fold_at_mirror(stencil: Stencil, mirror: int) -> None:
    """Couple the last line of cells to its mirror image, in place, if there is a mirror."""
    if mirror:
        image = stencil.centre if mirror == MIRROR_BETWEEN else stencil.south
        image[:, -1] += stencil.north[:, -1]
        stencil.north[:, -1] = 0.0


class LineRelaxation:
    """Zebra relaxation of a five-point stencil, or a seven-point one with outer neighbours.

    It solves even, odd and even x lines exactly, in turn. Seven-point lines are not diagonally
    dominant.
    """

    def __init__(self, stencil: Stencil, far: OuterNeighbours | None = None) -> None:
        nx, ny = stencil.centre.shape
        empty = np.empty((0, 0), stencil.centre.dtype)
        self.stencil, self.far = stencil, far or OuterNeighbours(empty, empty)
        for parity in (0, 1):
            compliance = np.empty((5, nx, (ny + 1 - parity) // 2), stencil.centre.dtype)
            outer = (
                np.empty((2, *compliance.shape[1:]), compliance.dtype) if far else (empty, empty)
            )
            lines = line_relaxation.LineFactors(*compliance, *outer)
            line_relaxation.factor_lines(
                stencil, self.far, parity, PRECONDITIONER.min_pivot if far else 0.0, lines
            )
            if parity:
                self.odd = lines
            else:
                self.even = lines

    def __call__(self, residual: Field, change: Field) -> Field:
        """Improve `change`, (nx, ny), in place by relaxation, and return it."""
        line_relaxation.relax_zebra(self.stencil, self.far, self.even, self.odd, residual, change)
        return change


class SingularFactor(ArithmeticError):
    """Linearised equations without a unique solution."""


class BlockSolver:
    """Five-point stencil, rows times `weight`, summed over blocks and factored by sparse LU."""

    def __init__(self, stencil: Stencil, weight: Field) -> None:
        self.weight, (nx, ny) = weight, weight.shape
        self.block = _block_size(nx), _block_size(ny)
        self.cells = -(-nx // self.block[0]), -(-ny // self.block[1])
        coarse = Stencil(*np.empty((5, *self.cells)))
        line_relaxation.aggregate_stencil(stencil, weight, self.block, coarse)
        self.pattern = five_point_pattern(self.cells)
        self.factors = self.pattern.factored(coarse)

    def __call__(self, residual: Field) -> Field:
        """Return the change, one number per block, for a residual; zero in cells without weight."""
        coarse = np.empty(self.cells)
        change = np.zeros_like(self.weight)
        line_relaxation.restrict(residual, self.weight, self.block, coarse)
        line_relaxation.prolong(
            self.pattern.solve(self.factors, coarse), self.weight, self.block, change
        )
        return change


class MultigridSolver:
    """Five-point stencil, rows times `weight`, summed over nested two-by-two blocks.

    It is relaxed on every level and inverted on the last.
    """

    def __init__(self, stencil: Stencil, weight: Field) -> None:
        self.weight = weight
        self.hierarchy = _allocate_hierarchy(weight.shape, weight.dtype)
        if not multigrid.build_hierarchy(stencil, weight, PRECONDITIONER.min_pivot, self.hierarchy):
            raise SingularFactor("the last of nested grids has no inverse")

    def __call__(self, residual: Field) -> Field:
        """Return the change, one number per block, for a residual; zero in cells without weight."""
        change = np.zeros_like(self.weight)
        multigrid.apply_hierarchy(
            self.hierarchy, residual, self.weight, PRECONDITIONER.cycles, change
        )
        return change


def _allocate_hierarchy(cells: tuple[int, int], dtype: np.dtype) -> GridHierarchy:
    """Allocate the levels of nested blocks."""
    grids = [(-(-cells[0] // 2), -(-cells[1] // 2))]
    while max(grids[-1]) >= PRECONDITIONER.min_halved_cells:
        nx, ny = (-(-n // 2) if n >= PRECONDITIONER.min_halved_cells else n for n in grids[-1])
        grids.append((nx, ny))
    starts = np.cumsum(
        [(0, 0, 0), *((nx * ny, nx * ((ny + 1) // 2), nx * (ny // 2)) for nx, ny in grids)], axis=0
    )
    count, even, odd = starts[-1]
    layout = np.concatenate([grids, starts[:-1]], axis=1)
    cells_of = (count,)
    last = grids[-1][0] * grids[-1][1]
    shapes = [(5, count), cells_of, cells_of, (5, even), (5, odd), cells_of, cells_of, (last, last)]
    return GridHierarchy._make([layout, *(np.empty(shape, dtype) for shape in shapes)])


def _block_size(cells: int) -> int:
    """Return the cells per block along an axis of the factored grid."""
    smallest = 1 if cells < 32 else 2 if cells < 128 else 4
    return max(smallest, -(-cells // PRECONDITIONER.max_coarse_cells))


def single_faces(faces: Faces, dtype: Precision = np.float32) -> Faces:
    """Convert faces to another precision, with values that would be denormal set to zero."""
    single = np.finfo(np.float32)
    least = float(single.tiny / single.eps) * float(max(faces.east.max(), faces.north.max()))
    # the same array may stand for several parts
    fields = {id(part): part for part in faces if isinstance(part, np.ndarray) and part.ndim == 2}
    converted = dict(zip(fields, np.empty((len(fields), *faces.east.shape), dtype), strict=True))
    for number, part in fields.items():
        reynolds.convert_precision(converted[number], part, least)
    inlet = np.where(faces.inlet > least, faces.inlet, 0.0).astype(dtype)
    parts = [converted.get(id(part), part) for part in faces]
    return Faces._make(parts)._replace(inlet=inlet, wedge=faces.wedge.astype(dtype))


class _Pattern(NamedTuple):
    """Sparsity pattern of a five-point matrix on `cells`, in an order of little fill."""

    cells: tuple[int, int]
    order: Index
    position: Index
    rows: npt.NDArray[np.int32]
    columns: npt.NDArray[np.int32]

    def factored(self, stencil: Stencil) -> scipy.sparse.linalg.SuperLU:
        """Return LU factors of the stencil's matrix."""
        count = self.order.size
        entries = np.stack([part.ravel() for part in stencil]).ravel()
        values = np.bincount(self.position, weights=entries, minlength=self.rows.size + 1)[:-1]
        matrix = scipy.sparse.csc_array((values, self.rows, self.columns), shape=(count, count))
        # small panels: these matrices are too sparse for the dense blocks of SuperLU
        try:
            return scipy.sparse.linalg.splu(
                matrix,
                permc_spec="NATURAL",
                diag_pivot_thresh=0.0,
                relax=1,
                panel_size=1,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SingularFactor(str(error)) from None

    def solve(self, factors: scipy.sparse.linalg.SuperLU, rhs: Field) -> Field:
        """Solve the factored matrix for `rhs`, (cx, cy)."""
        solved = np.empty(self.order.size)
        solved[self.order] = factors.solve(rhs.ravel()[self.order])
        return solved.reshape(self.cells)


@lru_cache(maxsize=16)
def five_point_pattern(cells: tuple[int, int]) -> _Pattern:
    """Return the pattern of a grid; cached."""
    columns, rows = _couplings(cells)
    inside = columns >= 0
    size = cells[0] * cells[1]
    model = scipy.sparse.csc_array(
        (np.where(columns == rows, 5.0, -1.0)[inside], (rows[inside], columns[inside])),
        shape=(size, size),
    )
    fill = scipy.sparse.linalg.splu(
        model, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    order = np.argsort(fill.perm_c)
    rank = np.empty(size, int)
    rank[order] = np.arange(size)
    keys = np.where(inside, rank[columns] * size + rank[rows], -1).ravel()
    entries, position = np.unique(keys[inside.ravel()], return_inverse=True)
    full = np.full(keys.size, entries.size)  # couplings across the ends are dropped
    full[inside.ravel()] = position
    starts = np.searchsorted(entries, np.arange(size + 1) * size)
    return _Pattern(cells, order, full, (entries % size).astype(np.int32), starts.astype(np.int32))


def _couplings(cells: tuple[int, int]) -> tuple[Index, Index]:
    """Return columns and rows of a five-point matrix, (5, cells); columns across ends are -1."""
    index = np.arange(cells[0] * cells[1]).reshape(cells)
    nowhere = np.full((1, cells[1]), -1)
    columns = np.stack(
        [
            index,
            np.concatenate([nowhere, index[:-1]]),
            np.concatenate([index[1:], nowhere]),
            np.roll(index, -1, 1),
            np.roll(index, 1, 1),
        ]
    ).reshape(5, -1)
    return columns, np.broadcast_to(index.ravel(), columns.shape)
