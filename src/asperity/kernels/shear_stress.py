"""Shear stress of oil that is elastic, viscous and plastic at once, carried along x: Bair and Winer's equation marched.

Knows no oil and no contact; arrays in, array filled.
"""

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit

SUBSTEPS = 8
STIFF = 30.0  # relaxation times a step beyond which one implicit step is as good as many
MOST_ITERATIONS = 100


@njit(cache=True)
def yielded(known: float, stiffness: float) -> float:
    """The s >= 0 with 1 - exp(-s) + stiffness s = known: Newton's method, from where it cannot overshoot."""
    s = max(0.0, (known - 1.0) / stiffness)
    for _ in range(MOST_ITERATIONS):
        left = np.exp(-s)
        change = (known - 1.0 + left - stiffness * s) / (left + stiffness)
        s += change
        if change <= 1e-12 * (1.0 + s):
            break
    return s


@njit(cache=True)
def carried_stress(
    rate: Field, viscosity: Field, limit: Field, modulus: Field, transit: float, out: Field
) -> None:
    """Fill the shear stress of oil on its way along x: dτ/dt = G (γ' + (τ_L/η) ln(1 - τ/τ_L)), implicit.

    `transit` is the time from cell to cell; the first cells are at rest with themselves. Between
    two cells ln η, τ_L, G and γ' change evenly. All fields (nx, ny), rates not negative.
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
                s = yielded((stress + g * time * gamma) / tau, g * time / eta)
                stress = -tau * np.expm1(-s)
            out[i, j] = stress
