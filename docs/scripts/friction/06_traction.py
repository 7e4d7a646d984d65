"""
Friction over slip: three oils
==============================

A Newtonian oil under high pressure would carry shear stresses beyond those of any real oil.
A friction law limits the stress: Eyring's law, or a limiting stress proportional to pressure (Bair
and Winer).
"""

import matplotlib.pyplot as plt

from asperity.paper import papers_case
from asperity.results import traction_curve

case = papers_case().with_overrides(
    {"grid.cells": [96, 8], "surface": "flat", "contact.load": "200 N"}
)
laws = {
    "Bair and Winer": {"law": "bair-winer"},
    "Bair and Winer, limit 0.05 p": {"law": "bair-winer-linear", "tau_l0": "2 MPa", "slope": 0.05},
    "Eyring, 5 MPa": {"law": "ree-eyring", "tau0": "5 MPa"},
}
slips = [0.0, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4]

# %%
figure, axis = plt.subplots(figsize=(7, 4))
for name, law in laws.items():
    curve = traction_curve(case.with_overrides({"lubricant.friction": law}), slips=slips)
    axis.plot(slips, [point.friction_coefficient for point in curve.points], "o-", label=name)
axis.set(
    xlabel="slide-to-roll ratio", ylabel="friction coefficient", xlim=(0, None), ylim=(0, None)
)
axis.legend()
