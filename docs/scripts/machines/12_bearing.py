"""
Load on each roller of a bearing
================================

In a cylindrical roller bearing under a radial load, at most half of the rollers carry load, and
fewer with larger clearance. Each roller is a separate contact; the most loaded one determines
ratings and film thickness.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from asperity import machine, machines
from asperity.case import case_template, load_machine

figure, axis = plt.subplots(figsize=(7, 4))
for clearance in (0.0, 20e-6, 50e-6):
    bearing = machine.CylindricalRollerBearing(
        rollers=13,
        roller_diameter=9e-3,
        roller_length=8.8e-3,
        pitch_diameter=46.5e-3,
        radial_load=4000.0,
        speed=2 * np.pi * 1500 / 60,
        clearance=clearance,
    )
    angle = np.degrees((np.array(bearing.angles) + np.pi) % (2 * np.pi) - np.pi)
    order = np.argsort(angle)
    loads = np.array(bearing.loads)
    axis.plot(
        angle[order],
        loads[order],
        "o-",
        label=f"clearance {clearance * 1e6:.0f} µm: {loads.max():.0f} N",
    )

# %%
# Stribeck's estimate for a bearing without clearance: the most loaded roller carries 4 F/Z.
axis.axhline(4 * 4000 / 13, ls=":", color="0.4", label="4 F / Z")
axis.set(xlabel="angle from the load's direction [deg]", ylabel="load on the roller [N]")
axis.legend()

# %%
# A bearing from a case file, drawn to scale; `asperity machine` solves its contacts.
Path("bearing.toml").write_text(case_template("bearing"), encoding="utf-8")
machines.machine_conditions(load_machine("bearing.toml")).plot()
# sphinx_gallery_thumbnail_number = 2
