"""
Asperity contacts in the film
=============================

The paper's contact at a roughness of 1 µm: film, pressure, and the cells in solid contact. Their
share of the load is CLR, their share of the Hertz zone is CAR.
"""

import matplotlib.pyplot as plt
import numpy as np

from asperity.paper import papers_case
from asperity.results import solve_case

case = papers_case().with_overrides({"grid.cells": [160, 96], "surface.sq": "1 um"})
run = solve_case(case)
solution, state = run.solution, run.state

# %%
# Rolling is to the right. The film is cut off at 3 µm to resolve the contact.
figure, axes = plt.subplots(3, 1, sharex=True, figsize=(6.5, 9), layout="constrained")
a = case.conditions.hertz.half_widths[0]
grid = solution.grid
extent = [edge / a for edge in (grid.lower[0], grid.upper[0], grid.lower[1], grid.upper[1])]
maps = (
    ("film [µm]", np.clip(solution.gap * 1e6, 0, 3), "viridis"),
    ("pressure [GPa]", solution.pressure / 1e9, "magma"),
    ("touching", solution.in_contact.astype(float), "Greys"),
)
for axis, (title, field, colours) in zip(axes, maps, strict=True):
    image = axis.imshow(field.T, origin="lower", extent=extent, cmap=colours, aspect="equal")
    axis.set(ylabel="y / a", xlim=(-2.5, 1.9))
    figure.colorbar(image, ax=axis, label=title)
axes[0].set_title(f"CLR {100 * state.clr:.0f} %, CAR {100 * state.car:.1f} %")
axes[-1].set(xlabel="x / a")
