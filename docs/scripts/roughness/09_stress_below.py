"""
Stress below the surface
========================

Under a smooth line contact the largest shear stress, 0.300 of Hertz's pressure, lies at a depth of
0.786 half-widths. Roughness adds a second, often larger maximum at shallow depth under single
asperities.
"""

import matplotlib.pyplot as plt
import numpy as np

from asperity.paper import papers_case
from asperity.results import solve_case

case = papers_case().with_overrides({"grid.cells": [128, 64], "surface.sq": "0.6 um"})
runs = {
    "smooth": solve_case(case.with_overrides({"surface": "flat"})),
    "Sq 0.6 µm": solve_case(case),
}
hertz = case.conditions.hertz

# %%
# The maps show the von Mises stress in the rolling plane through its maximum; the curves show the
# largest value at each depth.
figure, axes = plt.subplots(1, 3, figsize=(9, 3.6), width_ratios=(1, 1, 0.8))
a, p0 = hertz.half_widths[0], hertz.p_max
for axis, (name, run) in zip(axes, runs.items(), strict=False):
    stress = run.stress
    section = stress.section.von_mises.T / p0
    image = axis.contourf(
        stress.grid.x / a,
        stress.depths / a,
        section,
        levels=np.linspace(0, 1.2, 13),
        cmap="magma_r",
    )
    axis.set(title=name, xlabel="x / a", xlim=(-2, 2), ylim=(2, 0), ylabel="depth / a")
    axes[2].plot(stress.von_mises.max(axis=(0, 1)) / p0, stress.depths / a, label=name)
figure.colorbar(image, ax=axes[1], label="von Mises / $p_0$")
axes[2].set(xlabel="largest von Mises / $p_0$", ylim=(2, 0), xlim=(0, None))
axes[2].legend(fontsize="small")
figure.tight_layout()
