"""A structure without its contact: mass, stiffness and damping matrices, or modes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

MAX_MODES = 1000
ASYMMETRY = 1e-9  # largest relative difference between a matrix and its transpose


@dataclass(frozen=True, eq=False, kw_only=True)
class Structure:
    """Linear structure with n degrees of freedom, without the spring of its contact.

    Parameters
    ----------
    mass, stiffness, damping : matrices (n, n) [kg, N/m, N s/m]
    contact : approach of the two bodies in the contact per displacement of each degree of freedom,
        shape (n,): 1 for a body that moves towards the other, -1 for one that moves away
    sensor : displacement at the sensor per displacement of each degree of freedom, shape (n,)

    Raises
    ------
    BadInput
        for matrices that are not square, symmetric or of equal size, a mass matrix that is not
        positive definite, a stiffness with negative eigenvalues, or a contact that nothing moves.

    Examples
    --------
    >>> from asperity.structure import Structure
    >>> holder = Structure(
    ...     mass=[[0.1]], stiffness=[[1e6]], damping=[[5.0]], contact=[1.0], sensor=[1.0]
    ... )
    >>> holder.mass.shape
    (1, 1)
    """

    mass: Field
    stiffness: Field
    damping: Field
    contact: Field
    sensor: Field

    def __post_init__(self) -> None:
        for name in ("mass", "stiffness", "damping"):
            object.__setattr__(self, name, _matrix(name, getattr(self, name)))
        size = len(self.mass)
        for name in ("stiffness", "damping"):
            if len(getattr(self, name)) != size:
                raise BadInput(
                    f"{name} has {len(getattr(self, name))} degrees of freedom and mass {size}; "
                    "make them equal"
                )
        for name in ("contact", "sensor"):
            vector = np.asarray(getattr(self, name), dtype=float)
            if vector.shape != (size,) or not np.all(np.isfinite(vector)):
                raise BadInput(
                    f"{name} must be {size} finite numbers, one for each degree of freedom, got "
                    f"{vector.tolist()}"
                )
            object.__setattr__(self, name, vector)
        if not np.any(self.contact):
            raise BadInput("contact is 0 for every degree of freedom; state which ones move it")
        least_mass = float(np.linalg.eigvalsh(self.mass)[0])
        if not least_mass > 0.0:
            raise BadInput(
                f"the mass matrix must be positive definite, its least eigenvalue is "
                f"{least_mass:.3g} kg; remove degrees of freedom without mass"
            )
        for name, unit in (("stiffness", "N/m"), ("damping", "N s/m")):
            values = np.linalg.eigvalsh(getattr(self, name))
            if values[0] < -1e-9 * max(abs(values[-1]), 1e-3):
                raise BadInput(
                    f"the {name} matrix has a negative eigenvalue, {values[0]:.3g} {unit}; correct "
                    "its signs"
                )

    @classmethod
    def from_modes(
        cls,
        frequencies_hz: ArrayLike,
        damping_ratios: ArrayLike,
        *,
        contact: ArrayLike,
        sensor: ArrayLike,
    ) -> "Structure":
        """Return the structure of mass-normalised modes without the contact's spring.

        Parameters
        ----------
        frequencies_hz, damping_ratios : of every mode, shape (n,); 0 Hz for rigid-body motion
        contact, sensor : mode shapes [kg^-1/2] as approach in the contact and at the sensor, (n,)

        Raises
        ------
        BadInput
            for negative frequencies or damping ratios, and as for the class.
        """
        angular = 2.0 * np.pi * np.atleast_1d(np.asarray(frequencies_hz, dtype=float))
        if angular.size > MAX_MODES or np.size(damping_ratios) not in (1, angular.size):
            raise BadInput(
                f"modes need a damping ratio for each of at most {MAX_MODES} frequencies, got "
                f"{np.size(damping_ratios)} for {angular.size}"
            )
        ratios = np.broadcast_to(np.asarray(damping_ratios, dtype=float), angular.shape)
        if not (np.all(angular >= 0.0) and np.all(ratios >= 0.0)):
            raise BadInput(
                "frequencies and damping ratios of modes must be 0 or more; correct them"
            )
        return cls(
            mass=np.eye(angular.size),
            stiffness=np.diag(angular**2),
            damping=np.diag(2.0 * ratios * angular),
            contact=np.asarray(contact, dtype=float),
            sensor=np.asarray(sensor, dtype=float),
        )

    @classmethod
    def single_mass(cls, mass: float) -> "Structure":
        """Return a free mass [kg] on the contact, which is also the sensor's: the paper's model.

        Raises
        ------
        BadInput
            for a mass that is not positive.
        """
        require_positive("mass", mass, "kg")
        return cls(
            mass=np.array([[mass]]),
            stiffness=np.zeros((1, 1)),
            damping=np.zeros((1, 1)),
            contact=np.ones(1),
            sensor=np.ones(1),
        )


def _matrix(name: str, value: ArrayLike) -> Field:
    """Return a symmetric matrix."""
    matrix = np.asarray(value, dtype=float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise BadInput(f"{name} must be a square matrix, got shape {matrix.shape}")
    if not np.all(np.isfinite(matrix)):
        raise BadInput(f"{name} has values that are not finite; correct them")
    if np.abs(matrix - matrix.T).max() > ASYMMETRY * np.abs(matrix).max():
        raise BadInput(f"{name} must be symmetric; correct the elements that differ")
    return np.asarray(0.5 * (matrix + matrix.T))
