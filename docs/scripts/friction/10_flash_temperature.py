"""
Flash temperature
=================

Friction heat flows into both surfaces, which pass the contact in tens of microseconds. Rubbing
asperities are hot only for this time; this flash temperature governs scuffing.
"""

import matplotlib.pyplot as plt

from asperity.paper import papers_case
from asperity.results import solve_case

case = papers_case().with_overrides(
    {"grid.cells": [160, 96], "surface.sq": "1 um", "contact.slip": 0.4}
)
run = solve_case(case)

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(6.5, 6.5), layout="constrained")
grid, a = run.solution.grid, case.conditions.hertz.half_widths[0]
extent = [edge / a for edge in (grid.lower[0], grid.upper[0], grid.lower[1], grid.upper[1])]
fields = (("heat [GW/m²]", run.heat.heat / 1e9), ("rise of body 1 [K]", run.heat.surface_1))
for axis, (label, field) in zip(axes, fields, strict=True):
    image = axis.imshow(field.T, origin="lower", extent=extent, cmap="inferno", aspect="equal")
    figure.colorbar(image, ax=axis, label=label)
    axis.set(ylabel="y / a", xlim=(-2, 1.9))
axes[0].set_title(
    f"friction {run.friction.coefficient:.3f}, {run.friction.power:.0f} W, maximum"
    f" {run.heat.max_k:.0f} K"
)
axes[1].set(xlabel="x / a, rolling to the right")
