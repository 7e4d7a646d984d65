"""
Wear over minutes
=================

Rubbing asperities wear by Archard's law: peaks are removed, Sq falls, and the oil carries more of
the load. The coarse grid keeps the example fast.
"""

import matplotlib.pyplot as plt

from asperity import run_wear
from asperity.case import case_template, load_case

case = load_case(case_template("wear")).with_overrides(
    {
        "grid.cells": [64, 32],
        "surface.sq": "1 um",
        "surface.correlation_length": "40 um",
        "contact.entrainment_speed": "0.5 m/s",
        "wear.k": ["1e-15 1/Pa", "1e-15 1/Pa"],
    }
)
history = run_wear(case, hours=0.015)

# %%
table = history.table
figure, axes = plt.subplots(1, 2, figsize=(8.5, 3.6))
axes[0].plot(table["hours"] * 60, 1e6 * table["sq_m"], "o-")
axes[0].set(xlabel="minutes", ylabel="Sq of both bodies [µm]")
axes[1].plot(table["hours"] * 60, 100 * table["clr"], "o-")
axes[1].set(xlabel="minutes", ylabel="load on asperities [%]")
figure.tight_layout()
