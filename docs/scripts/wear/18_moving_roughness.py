"""
Moving roughness
================

A snapshot assumes stationary roughness. Here the roughness moves through the contact and squeezes
the oil: load share and film change from step to step as new summits enter.
"""

import matplotlib.pyplot as plt

from asperity import run_history
from asperity.paper import papers_case

case = papers_case().with_overrides(
    {"grid.cells": [64, 32], "surface.sq": "1 um", "surface.correlation_length": "40 um"}
)
history = run_history(case, steps=60)

# %%
table = history.table
figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 6))
time = 1e6 * table["time_s"]
rows = (("load on asperities [%]", 100 * table["clr"]), ("mean film [µm]", 1e6 * table["h_mean_m"]))
for axis, (label, values) in zip(axes, rows, strict=False):
    axis.plot(time, values)
    axis.set(ylabel=label)
axes[2].plot(time, table["friction_coefficient"])
axes[2].set(ylabel="friction coefficient", xlabel="time [µs]")
figure.align_ylabels()
