"""Equilibrium of rolling elements between two rigid rings, and their stiffness matrix.

Shifts of the inner ring: radial and axial [m], and tilt times an arm [m]; forces accordingly [N].
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.machine.rolling import double_until

EXPONENT = 1.5  # of the load over the approach of both rings
TOLERANCE = 1e-8  # unbalanced forces over the larger load


class ElementRow(Protocol):
    """Row of rolling elements between two rigid rings."""

    def energy(self, shifts: Field) -> float:
        """Return the elastic energy [J], a convex function of the shifts."""

    def forces(self, shifts: Field) -> Field:
        """Return the derivative of the energy, shape (3,): the forces on the inner ring [N]."""

    def tangent(self, shifts: Field) -> Field:
        """Return d(force)/d(shift), shape (3, 3) [N/m]."""


@dataclass(frozen=True, eq=False)
class BallRow:
    """Row of balls, each with one contact on either ring.

    Parameters
    ----------
    positions : of the balls, from the direction of the radial load [rad]
    groove_distance : of the groove centres without load and clearance [m]
    play : diametral clearance [m]
    stiffness : load over approach of both rings to the power 3/2 [N/m^1.5]
    side : -1 for a row whose contact angle counts against the axial shift
    offset : axial distance of the groove centres without a shift [m]
    """

    positions: Field
    groove_distance: float
    play: float
    stiffness: float
    side: float = 1.0
    offset: float = 0.0

    def loads(self, shifts: Field) -> tuple[Field, Field]:
        """Return loads [N] and contact angles [rad] of the balls."""
        across = self.groove_distance - self.play / 2.0 + shifts[0] * np.cos(self.positions)
        along = self.offset + self.side * (shifts[1] + shifts[2] * np.cos(self.positions))
        elastic = np.maximum(np.hypot(across, along) - self.groove_distance, 0.0)
        return self.stiffness * elastic**EXPONENT, np.arctan2(along, across)

    def energy(self, shifts: Field) -> float:
        """Return the elastic energy [J]: 2/5 of load times approach."""
        loads, _ = self.loads(shifts)
        return float(0.4 * loads @ self._approaches(loads))

    def forces(self, shifts: Field) -> Field:
        """Return radial force, axial force and moment over the arm [N]."""
        loads, angles = self.loads(shifts)
        axial = self.side * loads * np.sin(angles)
        cosines = np.cos(self.positions)
        return np.array([(loads * np.cos(angles)) @ cosines, axial.sum(), axial @ cosines])

    def tangent(self, shifts: Field) -> Field:
        """Return d(force)/d(shift), shape (3, 3) [N/m]."""
        loads, angles = self.loads(shifts)
        approaches = self._approaches(loads)
        cosines = np.cos(self.positions)
        across, along = np.cos(angles), self.side * np.sin(angles)
        normal = np.stack([across * cosines, along, along * cosines])
        tangential = np.stack([-along * cosines, across, across * cosines])
        of_contacts = EXPONENT * self.stiffness * np.sqrt(approaches)
        of_forces = loads / (self.groove_distance + approaches)
        return np.asarray(
            (normal * of_contacts) @ normal.T + (tangential * of_forces) @ tangential.T
        )

    def _approaches(self, loads: Field) -> Field:
        return np.asarray((loads / self.stiffness) ** (1.0 / EXPONENT))


@dataclass(frozen=True, eq=False)
class RingBalance:
    """Balance of an inner ring on one or two rows of rolling elements.

    Parameters
    ----------
    rows : the rows, at the same positions
    radial_load, axial_load : on the inner ring [N]
    approach : of one element under the larger load [m], the scale of the shifts
    tilt : imposed tilt times the arm [m]; None: free to tilt without moment
    """

    rows: tuple[ElementRow, ...]
    radial_load: float
    axial_load: float
    approach: float
    tilt: float | None = 0.0

    def shifts(self, start: Field, play: float) -> Field:
        """Return the shifts at equilibrium, shape (3,).

        `start` are shifts at which the elements touch, `play` the diametral clearance [m].
        """
        if self.radial_load == self.axial_load == 0.0:
            return np.array([0.0, 0.0, self.tilt or 0.0])
        if not self.tilt and (self.axial_load == 0.0 or self.radial_load == 0.0):
            return self._under_one_load(self.approach + abs(play))
        return self.approach * self._minimum(start / self.approach)

    def forces(self, shifts: Field) -> Field:
        """Return radial force, axial force and moment over the arm [N]."""
        return np.asarray(sum(row.forces(shifts) for row in self.rows))

    def _minimum(self, start: Field) -> Field:
        """Return the shifts over `approach` that minimise the potential energy under both loads.

        The minimum is unique: approaches are distances less a constant, so that they and their
        powers above 1 are convex in the shifts. An imposed tilt is not an unknown.
        """
        minimum = scipy.optimize.minimize(
            self._energy,
            start[: self._free],
            jac=self._residual,
            hess=self._tangent,
            method="trust-exact",
            options={"gtol": TOLERANCE, "maxiter": 2000},
        ).x
        polished = scipy.optimize.root(self._residual, minimum, options={"xtol": 1e-13}).x
        errors = [float(np.max(np.abs(self._residual(s)))) for s in (minimum, polished)]
        if min(errors) < TOLERANCE:
            return self._with_tilt(np.asarray(polished if errors[1] < errors[0] else minimum))
        raise AsperityError(
            f"no equilibrium was found under a radial load of {self.radial_load:g} N and an axial "
            f"load of {self.axial_load:g} N; leave a small axial load out, or check the diameters, "
            "and the osculation of balls"
        )

    def _under_one_load(self, start: float) -> Field:
        """Return the shifts under a radial or an axial load alone, along one axis only."""
        axis, load = (0, self.radial_load) if self.axial_load == 0.0 else (1, self.axial_load)
        direction = np.eye(3)[axis]

        def excess(shift: float) -> float:
            return float(self.forces(shift * direction)[axis]) - load

        upper = double_until(start, lambda shift: excess(shift) > 0.0)
        shift = float(scipy.optimize.brentq(excess, 0.0, upper, xtol=1e-18, rtol=1e-14))
        return np.asarray(shift * direction)

    @property
    def _free(self) -> int:
        """Number of free shifts."""
        return 3 if self.tilt is None else 2

    @property
    def _force(self) -> float:
        return max(self.radial_load, self.axial_load)

    @property
    def _applied(self) -> Field:
        return np.array([self.radial_load, self.axial_load, 0.0])[: self._free]

    def _with_tilt(self, free_shifts: Field) -> Field:
        """Return all three shifts: the free ones, and the imposed tilt if there is one."""
        tilt = (self.tilt or 0.0) / self.approach
        return np.concatenate([free_shifts, np.array([0.0, 0.0, tilt])[self._free :]])

    def _energy(self, shifts: Field) -> float:
        """Return the potential energy, per approach and the larger load."""
        displaced = self.approach * self._with_tilt(shifts)
        elastic = sum(row.energy(displaced) for row in self.rows) / self.approach
        return float(elastic - self._applied @ shifts) / self._force

    def _residual(self, shifts: Field) -> Field:
        """Return the unbalanced forces, per the larger load."""
        forces = self.forces(self.approach * self._with_tilt(shifts))
        return np.asarray((forces[: self._free] - self._applied) / self._force)

    def _tangent(self, shifts: Field) -> Field:
        """Return the tangent stiffness of the free shifts, in larger loads per approach."""
        displaced = self.approach * self._with_tilt(shifts)
        slopes = np.asarray(sum(row.tangent(displaced) for row in self.rows))
        return np.asarray(slopes[: self._free, : self._free] * self.approach / self._force)
