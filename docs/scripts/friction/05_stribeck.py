"""
Friction over speed: a Stribeck curve
=====================================

At low speed asperities rub, at high speed only oil is sheared. The stacked areas are the
contributions of asperities and oil to the friction coefficient; the dashed line is the load on
asperities.
"""

import matplotlib.pyplot as plt
import numpy as np

from asperity.paper import papers_case
from asperity.results import stribeck_curve

case = papers_case().with_overrides({"grid.cells": [96, 64], "surface.sq": "0.5 um"})
curve = stribeck_curve(case, speeds=np.geomspace(0.05, 12.0, 8).tolist())

# %%
speeds = [point.entrainment_speed_m_s for point in curve.points]
figure, axis = plt.subplots(figsize=(7, 4))
axis.stackplot(
    speeds,
    [point.asperity_part for point in curve.points],
    [point.oil_part for point in curve.points],
    labels=("asperities", "oil"),
    colors=("#b5651d", "#4c78a8"),
    alpha=0.8,
)
axis.set(xscale="log", xlabel="entrainment speed [m/s]", ylabel="friction coefficient")
axis.margins(x=0)
axis.legend()
film = axis.twinx()
film.plot(speeds, [100 * point.clr for point in curve.points], "k--", label="CLR")
film.set(ylabel="load on asperities [%]", ylim=(0, 100))
