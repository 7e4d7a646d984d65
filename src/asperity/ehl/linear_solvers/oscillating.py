"""Linear response of a solved contact to small oscillations of the bodies.

With every cell in its present state, an approach oscillating as e^(iωt) requires pressures x with
(J + iΩ S) x = j + iΩ s: J and j are the linearisation of Newton's step in pressure and approach, S
and s the oil that lubricated cells gain, Ω = ω a/u. One complex GMRES, preconditioned by Newton's
approximate inverse of J; but oil too stiff to flow carries its film along, so that its gap is
practically known, and such cells are solved together with touching ones. Dimensionless; the
roughness does not move.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import KRYLOV
from asperity.ehl.deflection import Deflection
from asperity.ehl.linear_solvers.gmres import Shifted, gmres
from asperity.ehl.linear_solvers.mixed import MixedLinear
from asperity.ehl.linear_solvers.single_pressure import Linear
from asperity.ehl.models.mixed import MixedBalance
from asperity.ehl.models.single_pressure import Balance, Precision
from asperity.kernels.load_sharing import FREE
from asperity.kernels.reynolds import CAPPED, LUBRICATED, TOUCHING

Waves: TypeAlias = npt.NDArray[np.complexfloating]


class OscillationResponse(NamedTuple):
    """Complex amplitudes of oil and total pressure, (nx, ny), per unit of closing approach.

    `residual` is relative, `steps` those of GMRES, `unknowns` the solution vector.
    """

    oil: Waves
    total: Waves
    residual: float
    steps: int
    unknowns: Waves


class _Equations(Protocol):
    """Linearised equations of a model over one vector of unknowns."""

    size: int
    real: Precision  # the precision of all

    def product(self, vector: Field, d_approach: float) -> tuple[Field, Field]:
        """Return the rows of J and of S for a change of the unknowns and of the approach."""

    def precondition(self, rows: Field) -> Field:
        """Apply an approximate inverse of J."""

    def pressures(self, vector: Waves) -> tuple[Waves, Waves]:
        """Return the oil and the total pressure, (nx, ny)."""

    def load_weights(self) -> Field:
        """Return the weight of each unknown in the sum of the total pressure."""


class _OnePressure:
    """Equations of the single-pressure model."""

    def __init__(self, balance: Balance, real: Precision) -> None:
        self.real, self.linear = real, Linear(balance, dtype=real)
        self.unknown, self.cells, self.size = (
            balance.unknown,
            balance.problem.cells,
            balance.gap.size,
        )
        self.deflection = balance.problem.deflection
        film = balance.film
        wet = balance.rows.state == LUBRICATED
        scale = np.where(wet, balance.rows.fluid_scale, 0.0)
        zero = np.zeros_like(scale)
        self.by_gap = (zero if film is None else scale * film.content_by_gap).astype(real)
        self.by_pressure = (zero if film is None else scale * film.content_by_pressure).astype(real)

    def product(self, vector: Field, d_approach: float) -> tuple[Field, Field]:
        d_pressure = vector.reshape(self.cells)
        d_gap = self.deflection(d_pressure) + self.real(d_approach)
        rows = self.linear.of_gap(d_pressure, d_gap)
        stored = self.by_gap * d_gap + self.by_pressure * d_pressure
        return np.where(self.unknown, rows, d_pressure).ravel(), stored.ravel()

    def precondition(self, rows: Field) -> Field:
        return self.linear(rows.reshape(self.cells)).ravel()

    def pressures(self, vector: Waves) -> tuple[Waves, Waves]:
        pressure = vector.reshape(self.cells)
        return pressure, pressure

    def load_weights(self) -> Field:
        return np.ones(self.size, self.real)


class _TwoPressures:
    """Equations of the mixed model: oil pressure of every cell, total pressure of touching ones."""

    def __init__(self, balance: MixedBalance, real: Precision) -> None:
        self.real, self.linear = real, (linear := MixedLinear(balance, real, with_limiter=True))
        self.cells, self.count = linear.cells, balance.gap.size
        self.touching = np.flatnonzero(linear.touching)
        self.size = self.count + self.touching.size
        self.deflection = balance.problem.deflection
        scale = np.where(linear.lubricated, balance.rows.fluid_scale, 0.0)
        self.by_gap = (scale * balance.film.content_by_gap).astype(real)
        self.by_pressure = (scale * balance.film.content_by_pressure).astype(real)
        self.own, self.stiff = real(1.0 / linear.rows.contact_scale), self._stiff()
        self.weights = self._weights()
        self.opening_cells = 1.0 / self.weights

    @cached_property
    def patch(self) -> tuple[slice, Deflection] | None:
        """Lines whose cells are solved together, built on first use."""
        return self._patch()

    def _split(self, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        closed = np.zeros(self.count, vector.dtype)
        closed[self.touching] = vector[self.count :]
        return vector[: self.count].reshape(self.cells), closed.reshape(self.cells)

    def _joined(self, oil: Field, closed: Field) -> Field:
        return np.concatenate([oil.ravel(), closed.ravel()[self.touching]])

    def product(self, vector: Field, d_approach: float) -> tuple[Field, Field]:
        d_oil, closed = self._split(vector)
        d_total = self.linear.total(d_oil, closed)
        d_gap = self.deflection(d_total) + self.real(d_approach)
        wet, gap_rows = self.linear.of_gap(d_oil, d_gap)
        stored = self.by_gap * d_gap + self.by_pressure * d_oil
        rows = self._joined(np.where(self.linear.lubricated, wet, d_oil), gap_rows)
        rows *= self.weights
        storage = np.zeros_like(rows)
        np.multiply(stored.ravel(), self.weights[: self.count], out=storage[: self.count])
        return rows, storage

    def precondition(self, rows: Field) -> Field:
        """Apply Newton's approximate inverse, with cells of known gap solved together.

        No cell changes its state here.
        """
        wet, gap_rows = self._split(rows * self.opening_cells)
        oil = self.linear.precondition(wet)
        closed = gap_rows * self.own
        if self.patch is not None:
            lines, deflection = self.patch
            stiff = self.stiff[lines]
            joint = deflection.approximate_inverse(
                np.where(stiff, self.own * oil[lines], closed[lines])
            )
            oil[lines] = np.where(stiff, joint, oil[lines])
            closed[lines] = joint
        return self._joined(oil, closed)

    def _stiff(self) -> Mask:
        """Return free cells whose film is carried along at any pressure, unaffected by flow.

        Line relaxation alone would let each of them deform by itself.
        """
        film = self.linear.balance.film
        problem = self.linear.balance.problem
        dx, dy = problem.spacing
        flow = film.mobility * (2.0 / dx**2 + 2.0 / dy**2) + film.content_by_pressure / dx
        carried = film.content_by_gap / (dx * self.linear.rows.contact_scale)
        return np.asarray(self.linear.free & self.linear.lubricated & (flow < carried))

    def _patch(self) -> tuple[slice, Deflection] | None:
        """Return the lines with cells of known gap and their deflection; None without any."""
        (lines,) = np.nonzero((self.stiff | self.linear.touching).any(axis=1))
        if not lines.size:
            return None
        if self.deflection.mirror:
            return slice(None), self.deflection
        span = slice(int(lines[0]), int(lines[-1]) + 1)
        return span, self.deflection.restrict_to(span.stop - span.start)

    def _weights(self) -> Field:
        """Return weights of the rows: a touching cell's oil counts by its onward flow.

        Its pressure follows from the small compressibility and flow of its film only, and is not
        needed.
        """
        wide = self.linear.balance.problem.spacing[0] * self.linear.rows.contact_scale
        scale = self.linear.balance.rows.fluid_scale
        closed = self.linear.touching & self.linear.lubricated
        wet = np.where(closed, np.minimum(1.0, wide / np.where(closed, scale, 1.0)), 1.0)
        return self._joined(wet.astype(self.real), np.ones(self.cells, self.real))

    def pressures(self, vector: Waves) -> tuple[Waves, Waves]:
        oil, closed = self._split(vector)
        return oil, np.where(self.linear.free, oil, closed)

    def load_weights(self) -> Field:
        return self._joined(self.linear.free.astype(self.real), np.ones(self.cells, self.real))


class Oscillating:
    """A balance prepared for its response at any number of frequencies.

    GMRES runs in single precision, in rounds; the residual of a round is evaluated in double. A
    contact on one line of cells is cheap, and too stiff for single precision: double throughout.
    """

    def __init__(self, balance: Balance | MixedBalance) -> None:
        one_line = balance.problem.cells[1] == 1
        self.exact = _equations(balance, np.float64)
        self.rough = self.exact if one_line else _equations(balance, np.float32)
        self.by_approach = self.exact.product(np.zeros(self.exact.size), 1.0)

    def response(
        self, frequency: float, *, tolerance: float, start: OscillationResponse | None = None
    ) -> OscillationResponse:
        """Return the response to a unit approach at the dimensionless angular frequency Ω.

        The relative residual is at most `tolerance`. `start` is a response at the same frequency:
        that at another one has the wrong phase in the oil.
        """
        steps, solver = 0, self.rough
        rows, stored = self.by_approach
        rhs = rows + 1j * frequency * stored
        size = float(np.linalg.norm(rhs))
        vector = np.zeros(self.exact.size, complex)
        residual = rhs
        ratio = 1.0
        if start is not None:
            vector = start.unknowns
            residual, ratio = self._residual(rhs, vector, frequency, size)
        while ratio > tolerance:
            target = max(tolerance / ratio, float(np.finfo(solver.real).eps))
            change, count = _solved(solver, residual, frequency, target)
            residual, updated_ratio = self._residual(rhs, vector + change, frequency, size)
            steps += count
            if not updated_ratio <= max(KRYLOV.tolerance, target) * ratio:
                if solver is self.exact:
                    break
                solver = self.exact
            if updated_ratio < ratio:
                vector, ratio = vector + change, updated_ratio
            else:
                residual, ratio = self._residual(rhs, vector, frequency, size)
        return OscillationResponse(*self.exact.pressures(vector), ratio, steps, vector)

    def sweep(self, frequency: float) -> Shifted:
        """Start a solve at Ω = `frequency`: one round of GMRES whose Ω may change."""
        equations = self.rough
        kind = np.result_type(equations.real, np.complex64)
        return Shifted(
            lambda vector: _both(equations, vector),
            lambda vector: np.asarray(_each_part(equations.precondition, vector)),
            (self.by_approach[0].astype(kind), self.by_approach[1].astype(kind)),
            self.load_weights,
            frequency,
            KRYLOV.max_steps,
        )

    def swept(self, sweep: Shifted) -> OscillationResponse:
        """Return the response of a sweep, with its residual in double precision."""
        rows, stored = self.by_approach
        vector = sweep.solution().astype(complex)
        rhs = rows + 1j * sweep.frequency * stored
        _, ratio = self._residual(rhs, vector, sweep.frequency, float(np.linalg.norm(rhs)))
        return OscillationResponse(*self.exact.pressures(vector), ratio, sweep.count, vector)

    @cached_property
    def load_weights(self) -> Field:
        """Weights of the unknowns in the sum of the total pressure."""
        return self.rough.load_weights()

    def _residual(
        self, rhs: Waves, vector: Waves, frequency: float, size: float
    ) -> tuple[Waves, float]:
        """Return the residual and its relative norm."""
        residual = rhs - _product(self.exact, vector, frequency)
        return residual, float(np.linalg.norm(residual)) / size


def _equations(balance: Balance | MixedBalance, real: Precision) -> _Equations:
    """Return the equations of a balance in a precision."""
    return (
        _TwoPressures(balance, real)
        if isinstance(balance, MixedBalance)
        else _OnePressure(balance, real)
    )


def _solved(
    equations: _Equations, rhs: Waves, frequency: float, tolerance: float
) -> tuple[Waves, int]:
    """Solve to a relative residual in the precision of the equations; return unknowns and steps."""
    steps = 0

    def product(vector: Waves) -> Waves:
        nonlocal steps
        steps += 1
        return _product(equations, vector, frequency)

    def precondition(vector: Waves) -> Waves:
        return np.asarray(_each_part(equations.precondition, vector))

    kind = np.result_type(equations.real, np.complex64)
    scale = float(np.linalg.norm(rhs))
    solution = gmres(
        product,
        precondition,
        (rhs / scale).astype(kind),
        tolerance=tolerance,
        max_steps=KRYLOV.max_steps,
    )
    return np.asarray(scale * solution, dtype=complex), steps


def _product(equations: _Equations, vector: Waves, frequency: float) -> Waves:
    """Apply J + iΩ S."""
    rows, stored = _both(equations, vector)
    return np.asarray(rows + vector.dtype.type(1j * frequency) * stored)


def _each_part(operator: Callable[[Field], Field], vector: Waves) -> Waves:
    """Apply a real linear operator to a complex vector."""
    real = operator(np.ascontiguousarray(vector.real))
    imaginary = operator(np.ascontiguousarray(vector.imag))
    result = np.empty(real.shape, vector.dtype)
    result.real, result.imag = real, imaginary
    return result


def _both(equations: _Equations, vector: Waves) -> tuple[Waves, Waves]:
    """Return the rows of J and of S for complex changes of the unknowns."""
    parts = [
        equations.product(np.ascontiguousarray(part), 0.0) for part in (vector.real, vector.imag)
    ]
    rows = np.empty(vector.size, vector.dtype)
    stored = np.empty(vector.size, vector.dtype)
    (rows.real, stored.real), (rows.imag, stored.imag) = parts
    return rows, stored


def at_cap(balance: Balance | MixedBalance) -> bool:
    """Return True if any cell is at the pressure cap, of the oil or of the bodies."""
    capped = balance.rows.state == CAPPED
    return bool(
        np.any(capped | (balance.solid == CAPPED) if isinstance(balance, MixedBalance) else capped)
    )


def elastic(balance: Balance | MixedBalance) -> Balance | MixedBalance:
    """Return the balance with its capped cells elastic, as yielded cells are below their last load.

    Overlapping bodies stay in contact; oil at the cap between separated bodies is ordinary oil.
    """
    state = balance.rows.state
    touching: Mask = balance.in_contact
    if isinstance(balance, MixedBalance):
        solid = np.where(touching, np.int8(TOUCHING), np.int8(FREE))
        solid = np.where(balance.solid == CAPPED, solid, balance.solid)
        oil = np.where(state == CAPPED, np.int8(LUBRICATED), state)
        return replace(balance, solid=solid, rows=balance.rows._replace(state=oil))
    elastic_state = np.where(
        touching | (balance.film is None), np.int8(TOUCHING), np.int8(LUBRICATED)
    )
    return replace(
        balance, rows=balance.rows._replace(state=np.where(state == CAPPED, elastic_state, state))
    )
