"""
Oil from its data sheet
=======================

A grade gives the viscosity over temperature. Data sheets seldom state the pressure-viscosity
coefficient alpha, so it has to be estimated. The curves show how much published estimates differ
for the same oil.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity.lubricant import ESTIMATORS

celsius = np.linspace(20, 110, 46)
figure, (left, right) = plt.subplots(1, 2, figsize=(8.5, 3.8))
for grade in ("VG 32", "VG 100", "VG 320"):
    oil = asp.OilSheet(grade=grade)
    left.semilogy(celsius, [1e3 * oil.viscosity(t + 273.15) for t in celsius], label=grade)
left.set(xlabel="temperature [°C]", ylabel="viscosity [mPa s]")
left.legend()

# %%
for name in ESTIMATORS:
    oil = asp.OilSheet(grade="VG 100", alpha_estimate=name)
    right.plot(celsius, [1e9 * oil.pressure_viscosity(t + 273.15) for t in celsius], label=name)
right.set(xlabel="temperature [°C]", ylabel="alpha of VG 100 [1/GPa]", ylim=(0, None))
right.legend(fontsize="small")
figure.tight_layout()
# sphinx_gallery_thumbnail_number = -1
