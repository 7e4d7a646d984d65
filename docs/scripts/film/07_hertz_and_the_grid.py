"""
Convergence to Hertz's solution
===============================

A dry, smooth ball has a closed form. The error of the solver's pressures decreases with each finer
grid, which gives the order of convergence.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

contact = asp.ContactConditions(
    pair=asp.ElasticPair((210e9, 210e9), (0.3, 0.3)),
    geometry="point",
    radius=10e-3,
    load=50.0,
    surface_speeds=(1.0, 1.0),
)
a = contact.hertz.half_widths[0]


def error_on(cells: int) -> tuple[float, float]:
    """Return the relative error of the largest pressure and the mean error over the contact."""
    grid = asp.Grid(
        (cells, cells), (-1.5 * a, -1.5 * a), (1.5 * a, 1.5 * a), periodic=(False, False)
    )
    pressure = asp.solve_contact(contact, None, asp.flat_surface(grid)).pressure
    radius = np.hypot(grid.x[:, None], grid.y[None, :]) / a
    exact = contact.hertz.p_max * np.sqrt(np.clip(1.0 - radius**2, 0.0, None))
    peak = contact.hertz.p_max * np.sqrt(1.0 - radius.min() ** 2)
    return abs(pressure.max() - peak) / peak, np.abs(pressure - exact).sum() / exact.sum()


cells = np.array([16, 24, 32, 48, 64, 96, 128])
largest, mean = np.array([error_on(n) for n in cells]).T

# %%
figure, axis = plt.subplots(figsize=(7, 4))
axis.loglog(cells, 100 * largest, "o-", label="largest pressure")
axis.loglog(cells, 100 * mean, "s-", label="pressure, mean over the contact")
axis.loglog(cells, 100 * mean[0] * (cells[0] / cells) ** 1.5, ":", color="0.4", label="order 1.5")
axis.set(xlabel="cells per direction", ylabel="error [%]")
axis.legend()
