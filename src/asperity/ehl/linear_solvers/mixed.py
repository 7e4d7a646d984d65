"""Linearised mixed contact, and its Newton step by GMRES, in single precision.

Unknowns are the changes of oil pressure in lubricated cells and of total pressure in touching ones;
free cells have one pressure, those of ruptured and capped cells are known. The approximate inverse
treats the oil's rows by blocks and lines, like `asperity.ehl.linear_solvers.single_pressure`, and a
touching cell's row by its own compliance.

Two differences reduce GMRES steps fivefold where oil is stiff. A cell's pressure changes its own
gap only: oil carries its film downstream unchanged, and a stencil of three cells would damp it. And
mobilities are linearised: beside asperities this outweighs the mobilities themselves.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import KRYLOV, MIXED_SOLVER, PRECONDITIONER, RESIDUALS, STEP_LIMITS
from asperity.ehl.linear_solvers.gmres import Workspace, gmres
from asperity.ehl.linear_solvers.single_pressure import (
    BlockSolver,
    LineRelaxation,
    MultigridSolver,
    StoredOil,
    fold_at_mirror,
    single_faces,
)
from asperity.ehl.models.mixed import (
    ConservedOil,
    MixedBalance,
    Pressures,
    has_thin_film,
    limiter_slopes,
)
from asperity.ehl.models.oil_advection import (
    OPENING_RANGE,
    advected_outflow,
    is_lagrangian,
    limiter_outflow,
    upwind_at_outlet,
)
from asperity.ehl.models.single_pressure import CLOSED_WITHIN, Precision
from asperity.kernels import load_sharing, reynolds, stencils
from asperity.kernels.load_sharing import FREE
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Film, Rows
from asperity.kernels.stencils import OuterNeighbours, Stencil


class MixedLinear:
    """Linearisation of a balance: `product` applies it, `precondition` approximately inverts it.

    All fields are (nx, ny). `with_limiter` includes the slope limiter of the wedge in the lines,
    for equations solved far closer than to a tenth.
    """

    def __init__(
        self,
        balance: MixedBalance,
        dtype: Precision = np.float32,
        *,
        with_limiter: bool = False,
    ) -> None:
        self.balance, problem = balance, balance.problem
        self.cells, self.real = problem.cells, dtype
        self.full = balance.rows.state == LUBRICATED
        self.lubricated = balance.solved
        self.free, self.touching = balance.solid == FREE, balance.solid == TOUCHING
        self.oil = balance.oil_pressure.astype(self.real)
        # on one line the stencil of own pressures works better
        self.follows_wedge = problem.accurate and problem.cells[1] > 1
        state = np.where(self.lubricated, np.int8(LUBRICATED), balance.rows.state)
        self.rows = Rows(
            state, balance.rows.fluid_scale.astype(self.real), balance.rows.contact_scale
        )
        self.scale = np.where(self.lubricated, self.rows.fluid_scale, self.real(0.0))
        self.full_film = Film(*(part.astype(self.real) for part in balance.film))
        self.faces = single_faces(balance.faces, dtype)
        self.lagrangian = is_lagrangian(problem)
        self.film = self.full_film.without_wedge if self.lagrangian else self.full_film
        self.with_limiter = with_limiter and self.limiter is not None

    @cached_property
    def conserved(self) -> ConservedOil | None:
        """Derivatives of conserved oil."""
        return ConservedOil.of_balance(self.balance, self.real)

    @cached_property
    def limiter(self) -> tuple[Field, Field] | None:
        """Derivatives of the limited correction in the own and in the upstream content."""
        limited = np.any(self.balance.limiter)
        return limiter_slopes(self.balance, self.real) if limited else None

    @cached_property
    def storage(self) -> StoredOil | None:
        """Storage of oil; see `asperity.ehl.linear_solvers.single_pressure`.

        The wedge is neglected in the first rows of Lagrangian oil.
        """
        past, film = self.balance.problem.past, self.full_film
        if past is None:
            return None
        scaled = self.scale * self.real(past.rate)
        return StoredOil(scaled * film.content_by_gap, scaled * film.content_by_pressure)

    @cached_property
    def inverse(self) -> tuple[BlockSolver | MultigridSolver, LineRelaxation]:
        """Blocks and lines, built on first use."""
        stencil, outer = self._stencil()
        weight = np.where(self.full & self.lubricated, 1.0 / self.rows.fluid_scale, self.real(0.0))
        multigrid = (
            not self.follows_wedge
            and min(self.cells) >= PRECONDITIONER.max_coarse_cells
            and (self.with_limiter or is_firm(self.balance))
        )
        blocks = (MultigridSolver if multigrid else BlockSolver)(stencil, weight)
        if self.with_limiter and self.limiter:
            return blocks, LineRelaxation(*self._with_limiter(stencil, *self.limiter))
        return blocks, LineRelaxation(stencil, outer)

    def _stencil(self) -> tuple[Stencil, OuterNeighbours | None]:
        """Return the stencil, with outer neighbours if it includes the wedge."""
        problem, stencil = self.balance.problem, Stencil(*np.empty((5, *self.cells), self.real))
        state = np.where(self.lubricated, np.int8(LUBRICATED), np.int8(RUPTURED))
        rows, film = self.rows._replace(state=state), self.film.with_fixed_gap(~self.free)
        own_compliance, outer = 1.0 / self.rows.contact_scale, None
        equations = rows, film, self.faces, self.oil
        if self.follows_wedge:
            outer = OuterNeighbours(*np.empty((2, *self.cells), self.real))
            compliances = own_compliance, problem.deflection.next_compliance
            stencils.wedge_stencil(*equations, compliances, problem.spacing, stencil, outer)
        else:
            stencils.own_stencil(*equations, own_compliance, problem.spacing, stencil)
        if self.storage is not None:
            by_gap = np.where(self.free, self.storage.by_gap, self.real(0.0))
            by_pressure = by_gap * self.real(own_compliance) + self.storage.by_pressure
            stencil.centre[:] += np.where(self.lubricated, by_pressure, 0.0)
        fold_at_mirror(stencil, problem.mirror)
        if self.conserved is not None:
            self._advect_surplus(stencil, self.conserved.surplus_by_oil)
        return stencil, outer

    def _with_limiter(
        self, stencil: Stencil, by_own: Field, by_upstream: Field
    ) -> tuple[Stencil, OuterNeighbours]:
        """Return the stencil and its outer neighbours with the limited correction of the wedge.

        Beside closed cells films thin many times over from one cell to the next; the correction
        there may reduce a cell's own entry to a sixth of its first-order value.
        """
        film, dx = self.film.with_fixed_gap(~self.free), self.real(self.balance.problem.spacing[0])
        content = film.content_by_gap * self.real(1.0 / self.rows.contact_scale)
        content += film.content_by_pressure
        entry, upstream = np.zeros_like(content), np.zeros_like(content)  # limited flow, east faces
        entry[1:-1] = (by_own * content)[1:-1] / dx
        upstream[1:-1] = by_upstream[1:-1] * content[:-2] / dx
        outer = OuterNeighbours(*np.zeros((2, *self.cells), self.real))
        stencil.centre[:] += self.scale * entry
        stencil.west[1:] -= self.scale[1:] * (upstream[1:] + entry[:-1])
        outer.west[2:] += self.scale[2:] * upstream[1:-1]
        return stencil, outer

    def _advect_surplus(self, stencil: Stencil, by_oil: Field) -> None:
        """Couple cells whose unknown is not a pressure to the next one downstream only."""
        past, real, scale = self.balance.problem.past, self.real, self.rows.fluid_scale
        loose = self.lubricated & ~self.full
        lagrangian = past is not None and past.lagrangian
        wedge = real(0.0 if lagrangian else 1.0 / self.balance.problem.spacing[0])
        rate = wedge + real(0.0 if past is None else past.rate)
        stencil.centre[loose] = (by_oil * rate * scale)[loose]
        stencil.west[1:][loose[:-1]] = (-wedge * by_oil[:-1] * scale[1:])[loose[:-1]]
        stencil.west[1:][loose[:-1] & ~self.lubricated[1:]] = 0.0
        stencil.east[:-1][loose[1:]] = 0.0
        stencil.north[np.roll(loose, -1, axis=1)] = 0.0
        stencil.south[np.roll(loose, 1, axis=1)] = 0.0

    def product(self, d_oil: Field, d_total: Field, d_approach: float) -> tuple[Field, Field]:
        """Return changes of the oil's equations and of touching cells' equations.

        Known unknowns have identity rows.
        """
        problem = self.balance.problem
        d_gap = problem.deflection(d_total)
        if d_approach:
            d_gap += self.real(d_approach)
        return self.of_gap(d_oil, d_gap)

    def of_gap(self, d_oil: Field, d_gap: Field) -> tuple[Field, Field]:
        """Return the same for a change of the oil's unknown and of the gap."""
        problem, wet = self.balance.problem, np.empty(self.cells, self.real)
        d_pressure, d_height = self.pressure_of(d_oil), problem.filmed(d_gap)
        if self.conserved is not None:
            d_height = np.where(self.balance.sealed, self.real(0.0), d_gap)
            d_height = d_height + self.conserved.growth_by_oil * d_oil
        change = reynolds.PressureChange(d_pressure, d_height)
        reynolds.jacobian_product(
            self.rows, self.film, self.faces, self.oil, change, problem.spacing, 0.0, wet
        )
        if self.storage is not None:
            wet += self.storage.by_gap * d_height + self.storage.by_pressure * d_pressure
        correction = self._content_outflow(d_oil, d_gap, d_height)
        if correction is not None:
            wet += correction * self.scale
        return wet, d_gap * self.real(self.rows.contact_scale)

    def _content_outflow(self, d_oil: Field, d_gap: Field, d_height: Field) -> Field | None:
        """Return the outflow due to surplus or to the second order of the wedge; None without."""
        problem, d_pressure = self.balance.problem, self.pressure_of(d_oil)
        if self.conserved is not None:
            d_surplus = (
                self.conserved.missing_by_oil * d_oil + self.conserved.surplus_by_gap * d_height
            )
            outflow = advected_outflow(problem, d_surplus)
            upwind_at_outlet(problem, self._content(d_height, d_pressure), outflow)
            return outflow
        if self.limiter is None:
            return None
        return limiter_outflow(problem, self._content(d_gap, d_pressure), *self.limiter)

    def _content(self, d_gap: Field, d_pressure: Field) -> Field:
        """Return the change of a full film's content."""
        film = self.full_film
        return film.content_by_gap * d_gap + film.content_by_pressure * d_pressure

    def precondition(self, wet: Field) -> Field:
        """Return an approximate change of the oil's pressure for a residual of its rows."""
        blocks, lines = self.inverse
        return lines(wet, blocks(wet))

    def total(self, d_oil: Field, d_closed: Field) -> Field:
        """Return the change of total pressure.

        It is that of the oil in free cells and `d_closed` in touching ones.
        """
        return np.where(self.free, self.pressure_of(d_oil), d_closed)

    def pressure_of(self, d_oil: Field) -> Field:
        """Return the change of the oil's pressure: zero where its unknown is not a pressure."""
        return np.where(self.full, d_oil, d_oil.dtype.type(0.0)) if self.conserved else d_oil


class _Step:
    """Newton step as one vector: oil, total pressure of touching cells, approach.

    The last equation is the load, or an identity at fixed approach.
    """

    def __init__(self, linear: MixedLinear) -> None:
        self.linear, self.problem = linear, linear.balance.problem
        self.count, self.touching = linear.balance.gap.size, np.flatnonzero(linear.touching)
        self.approach_is_free = self.problem.fixed is None
        self.weight = linear.real(1.0 / np.sqrt(self.count))
        self.load_weights = (linear.free & linear.full if linear.conserved else linear.free).astype(
            linear.real
        )
        by_approach = linear.of_gap(
            np.zeros(linear.cells, linear.real), np.ones(linear.cells, linear.real)
        )
        self.response = self._preconditioned(
            self.joined(np.where(linear.lubricated, by_approach[0], 0.0), by_approach[1], 0.0)
        )
        self.load_response = self._load_change(self.response)

    def joined(self, oil: Field, solid: Field, last: float) -> Field:
        """Assemble a vector from fields of the oil and of touching cells, and its last entry."""
        vector = np.empty(self.count + self.touching.size + 1, self.linear.real)
        vector[: self.count], vector[-1] = oil.ravel(), last
        vector[self.count : -1] = solid.ravel()[self.touching]
        return vector

    def oil(self, vector: Field) -> Field:
        """Return the part of the oil, (nx, ny)."""
        return vector[: self.count].reshape(self.linear.cells)

    def total(self, vector: Field) -> Field:
        """Return the change of the total pressure, (nx, ny)."""
        total: Field = self.oil(vector) * self.load_weights
        total.ravel()[self.touching] = vector[self.count : -1]
        return total

    def product(self, vector: Field) -> Field:
        """Apply the linearised equations."""
        total, rows = self.total(vector), np.empty_like(vector)
        wet, closed = self.linear.product(self.oil(vector), total, float(vector[-1]))
        rows[: self.count], rows[self.count : -1] = wet.ravel(), closed.ravel()[self.touching]
        rows[-1] = (
            self.weight * self.problem.sum_over_cells(total)
            if self.approach_is_free
            else vector[-1]
        )
        return rows

    def precondition(self, rows: Field) -> Field:
        """Apply the approximate inverse."""
        change = self._preconditioned(rows)
        if self.approach_is_free:
            d_approach = self.linear.real(
                (self._load_change(change) - rows[-1] / self.weight) / self.load_response
            )
            change -= d_approach * self.response
            change[-1] = d_approach
        return change

    def load_missing(self, known: Field) -> np.floating:
        """Return the load that known changes of the total pressure leave to the unknown ones."""
        if not self.approach_is_free:
            return np.float64(0.0)
        (dx, dy), balance = self.problem.spacing, self.linear.balance
        missing = -balance.load_error * self.problem.load / (dx * dy)
        return missing - self.problem.sum_over_cells(known)

    def right_side(self, known_oil: Field, known: Field, missing: np.floating) -> Field:
        """Return the negative residuals after known changes, and the missing load."""
        linear, balance = self.linear, self.linear.balance
        wet, closed = -balance.oil_residual, -balance.solid_residual
        if np.any(known_oil) or np.any(known):
            by_known = linear.product(known_oil.astype(linear.real), known.astype(linear.real), 0.0)
            wet, closed = wet - by_known[0], closed - by_known[1]
        wet = np.where(linear.lubricated, wet, linear.real(0.0))
        return self.joined(wet, closed, float(self.weight * missing))

    def _preconditioned(self, rows: Field) -> Field:
        """Apply the approximate inverse to the oil's rows."""
        change = rows.copy()
        change[: self.count] = self.linear.precondition(self.oil(rows)).ravel()
        return change

    def _load_change(self, vector: Field) -> float:
        """Return the change of the load."""
        if self.problem.mirror:
            return float(self.problem.sum_over_cells(self.total(vector)))
        return float(
            vector[: self.count] @ self.load_weights.ravel() + vector[self.count : -1].sum()
        )


def flattened_cells(balance: MixedBalance) -> Mask:
    """Return the cells that the cap keeps closed and oil cannot open."""
    closed = balance.gap <= (1.0 + CLOSED_WITHIN) * balance.problem.contact_gap
    return np.asarray(closed & (balance.solid == CAPPED))


def extend_lubrication(balance: MixedBalance) -> MixedBalance:
    """Return the balance with flattened cells lubricated as far downstream as oil fills them.

    Otherwise a cell is ruptured until oil has arrived: a line of closed cells would fill by one
    cell per step.
    """
    problem, rows, residual = balance.problem, balance.rows, balance.oil_residual.copy()
    state, highest = rows.state.copy(), (1.0 + CLOSED_WITHIN) * problem.contact_gap
    balanced = balance.outflow, rows.fluid_scale
    load_sharing.extend_lubrication(
        balance.gap, highest, balance.solid, problem.rim, balanced, state, residual
    )
    return replace(balance, rows=rows._replace(state=state), oil_residual=residual)


def is_firm(balance: MixedBalance) -> bool:
    """Return True if few cells are nearly closed, compared with flattened ones.

    Otherwise coarse blocks of unlike cells precondition badly.
    """
    gap, film = balance.gap, balance.problem.contact_gap
    nearly = (gap > (1.0 + CLOSED_WITHIN) * film) & (gap < (1.0 + OPENING_RANGE) * film)
    return bool(nearly.sum() < MIXED_SOLVER.max_nearly_closed * flattened_cells(balance).sum())


def newton_step(
    balance: MixedBalance, workspace: Workspace | None = None, *, extended: bool = False
) -> Pressures:
    """Return changes of all unknowns that solve the linearised equations and the load to a tenth.

    If `extended`, oil is extended along flattened cells of a steady contact. Steps on one grid may
    share a GMRES `workspace`.
    """
    problem = balance.problem
    steady = not problem.conserve and problem.past is None and problem.fixed is None
    if extended and steady:
        balance = extend_lubrication(balance)
    linear = MixedLinear(balance)
    known_oil, known_total = _known_changes(linear)
    step = _Step(linear)
    missing = step.load_missing(known_total)
    # all cells ruptured or capped: only the approach can change the load
    if step.load_response == 0.0:
        d_approach = -STEP_LIMITS.max_pressure_step * float(np.sign(missing))
        return Pressures(known_oil, known_total, d_approach / balance.rows.contact_scale)
    solved = gmres(
        step.product,
        step.precondition,
        step.right_side(known_oil, known_total, missing),
        tolerance=_linear_tolerance(linear),
        max_steps=KRYLOV.max_steps,
        workspace=workspace,
    )
    d_oil = known_oil + np.where(linear.lubricated, step.oil(solved), linear.real(0.0))
    d_total = np.where(linear.free, linear.pressure_of(d_oil) - balance.solid_residual, known_total)
    d_total.ravel()[step.touching] = solved[step.count : -1]
    return Pressures(d_oil, d_total, float(solved[-1]))


def _known_changes(linear: MixedLinear) -> tuple[Field, Field]:
    """Return changes of oil pressure and total pressure in cells where they are known."""
    balance = linear.balance
    oil = np.where(linear.lubricated, 0.0, -balance.oil_residual)
    total = np.where(balance.solid == CAPPED, -balance.solid_residual, 0.0)
    return oil, np.where(linear.free, linear.pressure_of(oil) - balance.solid_residual, total)


def _linear_tolerance(linear: MixedLinear) -> float:
    """Return the tolerance of GMRES."""
    balance, residual = linear.balance, linear.balance.residual_rms
    conserve, exact = balance.problem.conserve, balance.problem.exact
    if conserve and not linear.lagrangian and has_thin_film(balance):
        return MIXED_SOLVER.tolerance_close
    if exact and balance.problem.past is not None:
        least, largest = MIXED_SOLVER.tolerance_close, MIXED_SOLVER.max_tolerance_time_step
        return min(max(least, residual), largest)
    if (exact or (conserve and linear.lagrangian)) and residual < RESIDUALS.initial_guess:
        return MIXED_SOLVER.tolerance_close
    return KRYLOV.tolerance
