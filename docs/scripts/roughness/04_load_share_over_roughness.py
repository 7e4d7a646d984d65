"""
Load share over roughness
=========================

With increasing roughness, asperities carry more of the load. Each level has three surfaces; the
bars show their range, the scatter between nominally identical surfaces.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity.paper import papers_case

case = papers_case().with_overrides({"grid.cells": [96, 64]})
levels = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
clr, car = np.empty((levels.size, 3)), np.empty((levels.size, 3))
for i, sq in enumerate(levels):
    for seed in range(3):
        rough = case.with_overrides({"surface.sq": f"{sq} um", "surface.seed": seed})
        solution = asp.solve_contact(
            rough.conditions, rough.lubricant, rough.surface(), options=rough.options
        )
        state = asp.contact_state(solution)
        clr[i, seed], car[i, seed] = state.clr, state.car

# %%
figure, axis = plt.subplots(figsize=(7, 4))
for name, values in (("CLR, load on asperities", clr), ("CAR, area in the Hertz zone", car)):
    mean = values.mean(axis=1)
    spread = np.abs(np.array([values.min(axis=1), values.max(axis=1)]) - mean)
    axis.errorbar(levels, 100 * mean, yerr=100 * spread, marker="o", capsize=3, label=name)
axis.set(xlabel="Sq of both bodies [µm]", ylabel="share [%]", ylim=(0, 100))
axis.legend()
