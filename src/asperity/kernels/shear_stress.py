"""Shear stress of a viscoelastic-plastic oil, integrated along x: the Bair-Winer equation.

Works on plain arrays; knows no lubricant and no contact.
"""

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit

SUBSTEPS = 8  # implicit steps between two cells
STIFF = 30.0  # relaxation times per step above which one implicit step is accurate enough
MAX_ITERATIONS = 100  # of the scalar Newton solve


@njit(cache=True)
def dimensionless_strain(known: float, stiffness: float) -> float:
    """Solve 1 - exp(-s) + stiffness s = known for s >= 0 by Newton's method.

    The initial guess lies where the iteration cannot overshoot.
    """
    s = max(0.0, (known - 1.0) / stiffness)
    for _ in range(MAX_ITERATIONS):
        left = np.exp(-s)
        change = (known - 1.0 + left - stiffness * s) / (left + stiffness)
        s += change
        if change <= 1e-12 * (1.0 + s):
            break
    return s


@njit(cache=True)
def march_shear_stress(
    rate: Field, viscosity: Field, limit: Field, modulus: Field, transit: float, out: Field
) -> None:
    """Integrate dτ/dt = G (γ' + (τ_L/η) ln(1 - τ/τ_L)) along x, implicitly.

    `transit` is the travel time from cell to cell; the first cells are in steady state. ln η, τ_L,
    G and γ' vary linearly between two cells. All fields have shape (nx, ny); rates are
    non-negative.
    """
    nx, ny = rate.shape
    for j in range(ny):
        out[0, j] = -limit[0, j] * np.expm1(-viscosity[0, j] * rate[0, j] / limit[0, j])
    for i in range(1, nx):
        for j in range(ny):
            stiff = modulus[i, j] * transit > STIFF * max(viscosity[i, j], viscosity[i - 1, j])
            steps = 1 if stiff else SUBSTEPS
            time = transit / steps
            thicker = (viscosity[i, j] / viscosity[i - 1, j]) ** (1.0 / steps)
            eta = viscosity[i - 1, j]
            stress = out[i - 1, j]
            for step in range(1, steps + 1):
                eta *= thicker
                share = step / steps
                tau = limit[i - 1, j] + share * (limit[i, j] - limit[i - 1, j])
                g = modulus[i - 1, j] + share * (modulus[i, j] - modulus[i - 1, j])
                gamma = rate[i - 1, j] + share * (rate[i, j] - rate[i - 1, j])
                s = dimensionless_strain((stress + g * time * gamma) / tau, g * time / eta)
                stress = -tau * np.expm1(-s)
            out[i, j] = stress
