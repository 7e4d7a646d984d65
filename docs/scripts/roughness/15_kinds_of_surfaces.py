"""
Kinds of surfaces
=================

Six surfaces with the same Sq of 1 µm. They behave differently in a contact, which Sq does not show:
plateaus carry load, peaks touch first, grooves conduct oil.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity import surface

grid = asp.Grid((160, 160), (0.0, 0.0), (0.4e-3, 0.4e-3), periodic=(True, True))
common = {"sq": 1e-6, "rng": np.random.default_rng(7)}
kinds = {
    "gaussian": asp.gaussian_surface(grid, correlation_length=20e-6, **common),
    "self-affine": asp.self_affine_surface(grid, hurst=0.8, cutoffs=(10e-6, 200e-6), **common),
    "skewed": surface.non_gaussian_surface(
        grid, skewness=-1.5, kurtosis=6.0, correlation_length=20e-6, **common
    ),
    "run-in": surface.run_in_surface(grid, correlation_length=20e-6, plateau_share=0.6, **common),
    "ground": surface.ground_surface(grid, groove_width=15e-6, groove_length=200e-6, **common),
    "sandblasted": surface.sandblasted_surface(grid, crater_radius=25e-6, **common),
}

# %%
figure, axes = plt.subplots(2, 3, figsize=(9, 6), layout="constrained")
for axis, (name, made) in zip(axes.flat, kinds.items(), strict=True):
    image = axis.imshow(
        made.heights.T * 1e6,
        origin="lower",
        extent=[0, 400, 0, 400],
        vmin=-3,
        vmax=3,
        cmap="RdBu_r",
    )
    found = asp.surface_parameters(made)
    axis.set_title(
        f"{name}\nSsk {found.ssk:.1f}, Sdq {found.sdq:.2f}, Spk {found.spk * 1e6:.1f} µm",
        fontsize="small",
    )
figure.colorbar(image, ax=axes, label="height [µm]", shrink=0.7)
figure.supxlabel("x, y [µm]")
