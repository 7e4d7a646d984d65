"""GMRES, right-preconditioned, without restart, in the precision of the right-hand side.

Real or complex; also for equations with a frequency that may change between steps. SciPy's GMRES
preconditions from the left, so that it stops on the preconditioned residual, and orthogonalises
vector by vector; at 65 000 unknowns and a few dozen steps that costs as much as the physics.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import scipy

from asperity.ehl.controls import KRYLOV

Vector: TypeAlias = np.ndarray
Operator = Callable[[Vector], Vector]

INITIAL_VECTORS = 7  # allocated at first
ADJOINT = 2  # BLAS code of the conjugate transpose


class Workspace:
    """Memory for successive GMRES solves: allocating it anew takes as long as the solve."""

    def __init__(self) -> None:
        self.parts: tuple[Vector, Vector] = (np.empty(0), np.empty(0))

    def rows(self, count: int, vector: Vector) -> tuple[Vector, Vector]:
        """Return two arrays of at least `count` rows like `vector`, keeping earlier rows."""
        size = vector.size
        if self.parts[0].dtype != vector.dtype or self.parts[0].size < count * size:
            previous = self.parts
            self.parts = np.empty(count * size, vector.dtype), np.empty(count * size, vector.dtype)
            for old, new in zip(previous, self.parts, strict=True):
                if old.dtype == new.dtype:
                    new[: old.size] = old
        capacity = self.parts[0].size // size
        first, second = (part[: capacity * size].reshape(capacity, size) for part in self.parts)
        return first, second


@np.errstate(over="ignore", invalid="ignore")  # overflow is detected below
def gmres(
    product: Operator,
    precondition: Operator,
    rhs: Vector,
    *,
    tolerance: float,
    max_steps: int,
    workspace: Workspace | None = None,
) -> Vector:
    """Solve product(x) = rhs to a relative residual `tolerance`; return the best x.

    At most `max_steps` steps. Successive solves may share one `workspace`.
    """
    norm = _norm(rhs)
    if norm == 0.0:
        return np.zeros_like(rhs)
    workspace = workspace or Workspace()
    basis, corrections = workspace.rows(min(INITIAL_VECTORS, max_steps) + 1, rhs)
    projection = _Projection(norm, max_steps, np.result_type(rhs.dtype, float))
    count = 0
    np.divide(rhs, norm, out=basis[0])
    while count < max_steps:
        if count + 1 == len(basis):
            basis, corrections = workspace.rows(len(basis) + len(basis) // 2, rhs)
        corrections[count] = precondition(basis[count])
        vector = product(corrections[count])
        initial_length = _norm(vector)
        column, length = _orthogonalise(vector, initial_length, basis[: count + 1])
        if not np.isfinite(length):  # overflow: use the corrections so far
            break
        count += 1
        residual = projection.append(column, length)
        if residual < tolerance * norm or length < np.finfo(rhs.dtype).eps * initial_length:
            break
        np.divide(vector, length, out=basis[count])
    return projection.combine(corrections[:count])


def _orthogonalise(vector: Vector, norm: float, basis: Vector) -> tuple[Vector, float]:
    """Make a vector orthogonal to a basis in place; return its overlaps and its new length.

    This is repeated if most of its `norm` cancels.
    """
    overlaps = (basis @ vector.conj()).conj()
    vector -= overlaps @ basis
    column = overlaps.astype(np.result_type(vector.dtype, float))
    length = _norm(vector)
    if length < KRYLOV.reorthogonalise * norm:
        overlaps = (basis @ vector.conj()).conj()
        vector -= overlaps @ basis
        column, length = column + overlaps, _norm(vector)
    return column, length


class _Projection:
    """Least-squares problem in the basis: a Hessenberg matrix, made triangular by rotations."""

    def __init__(self, norm: float, max_steps: int, dtype: np.dtype) -> None:
        self.triangle = np.zeros((max_steps, max_steps), dtype)
        self.rotations = np.zeros((max_steps, 2), dtype)  # Givens rotations, cosine and sine
        self.target = np.zeros(max_steps + 1, dtype)
        self.target[0] = norm

    def append(self, column: Vector, length: float) -> float:
        """Append a column of overlaps and the length below it; return the residual."""
        step = column.size - 1
        for i, (cosine, sine) in enumerate(self.rotations[:step]):
            column[i : i + 2] = (
                cosine.conj() * column[i] + sine * column[i + 1],
                cosine * column[i + 1] - sine * column[i],
            )
        slant = float(np.hypot(abs(column[step]), length))
        cosine, sine = self.rotations[step] = (
            (column[step] / slant, length / slant) if slant else (1.0, 0.0)
        )
        column[step] = slant
        self.triangle[: step + 1, step] = column
        start = self.target[step]
        self.target[step : step + 2] = np.conj(cosine) * start, -sine * start
        return float(abs(self.target[step + 1]))

    def combine(self, corrections: Vector) -> Vector:
        """Return the best combination of corrections; NaN if there are none."""
        count, size = corrections.shape
        if count == 0:
            return np.full(size, np.nan, corrections.dtype)
        weights = np.linalg.lstsq(self.triangle[:count, :count], self.target[:count], rcond=None)[0]
        return np.asarray(weights.astype(corrections.dtype) @ corrections)


def _norm(vector: Vector) -> float:
    """Return the Euclidean norm."""
    return float(np.sqrt(np.vdot(vector, vector).real))


class Shifted:
    """Solver of (A + iΩ B) x = a + iΩ b whose frequency Ω may change between steps.

    Adaptive simpler GMRES: a step preconditions the residual or, if that hardly fell, the last
    basis vector. Either alone loses digits: the former while nothing falls, the latter once the
    residual has fallen far. Source: P. Jiránek and M. Rozložník, Numerical Algorithms 53 (2010)
    93-112.

    Parameters
    ----------
    product, precondition : A v and B v of a complex vector; approximate inverse of A
    rhs : a and b
    bearing : weights of the unknowns in `sum`, available after every step
    frequency : initial Ω
    max_steps : largest number of corrections
    """

    def __init__(
        self,
        product: Callable[[Vector], tuple[Vector, Vector]],
        precondition: Operator,
        rhs: tuple[Vector, Vector],
        bearing: Vector,
        frequency: float,
        max_steps: int,
    ) -> None:
        self.product, self.precondition, self.rhs, self.frequency = (
            product,
            precondition,
            rhs,
            frequency,
        )
        self.kind = rhs[0].dtype
        self.bearing, self.count = bearing.astype(self.kind), 0
        self.basis, self.corrections, self.stored = np.empty((3, max_steps, rhs[0].size), self.kind)
        self.triangle = np.zeros((max_steps, max_steps), complex)
        self.times, self.plus = scipy.linalg.get_blas_funcs(("gemv", "axpy"), (self.basis,))
        self.sums: list[complex] = []
        self.continues: bool  # from the last basis vector, not from the residual
        self._begin()

    @property
    def residual(self) -> float:
        """Relative residual, within this precision."""
        return _norm(self.defect) / self.size

    @property
    def sum(self) -> complex:
        """Weighted sum of the unknowns."""
        return complex(self._combination() @ np.array(self.sums)) if self.count else 0.0j

    @property
    def full(self) -> bool:
        """True if no further correction can be stored."""
        return self.count == len(self.basis)

    def solution(self) -> Vector:
        """Return the unknowns."""
        return np.asarray(self._combination().astype(self.kind) @ self.corrections[: self.count])

    def step(self) -> bool:
        """Add a correction; return False if it is linearly dependent."""
        if self.continues:
            vector = self.basis[self.count - 1]
        else:
            vector = self.defect / self.kind.type(_norm(self.defect))
        correction = self.precondition(vector)
        rows, stored = self.product(correction)
        if not self._append(self.plus(stored, rows, a=1j * self.frequency)):
            return False
        self.corrections[self.count], self.stored[self.count] = correction, stored
        self.sums.append(complex(correction @ self.bearing))
        self.count, self.continues = self.count + 1, True
        return True

    def move(self, frequency: float) -> None:
        """Recombine the corrections for another Ω."""
        count = self.count
        change = self.kind.type(1j * (frequency - self.frequency))
        rows = self.triangle[:count, :count].T.astype(self.kind) @ self.basis[:count]
        rows += change * self.stored[:count]
        self.frequency, self.count = frequency, 0
        self._begin()
        for row in rows:
            if not self._append(row):
                raise ArithmeticError(
                    f"corrections are linearly dependent at frequency {frequency:g}"
                )
            self.count += 1

    def _begin(self) -> None:
        """Reset the residual."""
        a, b = self.rhs
        self.defect = a + self.kind.type(1j * self.frequency) * b
        self.size = _norm(self.defect)
        self.continues = False
        self.target: list[complex] = []

    def _append(self, vector: Vector) -> bool:
        """Orthogonalise a vector and update the residual; return False if it is dependent."""
        count = self.count
        basis = self.basis[:count].T
        initial_length = _norm(vector)
        column = np.zeros(count, complex)
        for _ in range(2 if count else 0):
            overlaps = self.times(1.0, basis, vector, trans=ADJOINT)
            vector = self.times(-1.0, basis, overlaps, beta=1.0, y=vector, overwrite_y=True)
            column += overlaps
            length = _norm(vector)
            if length >= KRYLOV.reorthogonalise * initial_length:
                break
        else:
            length = _norm(vector)
        if not length > np.finfo(self.kind).eps * initial_length:
            return False
        self.triangle[:count, count], self.triangle[count, count] = column, length
        np.divide(vector, length, out=self.basis[count])
        projection = complex(np.vdot(self.basis[count], self.defect))
        self.defect = self.plus(self.basis[count], self.defect, a=-projection)
        self.target.append(projection)
        return True

    def _combination(self) -> Vector:
        """Return the weights of the corrections."""
        triangle = self.triangle[: self.count, : self.count]
        return np.asarray(scipy.linalg.solve_triangular(triangle, np.array(self.target)))
