"""
Flattening of a wavy surface
============================

The mean pressure p* = π E* A/λ flattens a dry wave completely (Westergaard, Johnson). Below it only
the crests touch, over a share of the wavelength with a closed form: (2/π) arcsin of the root of
p/p*.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

pair = asp.ElasticPair((210e9, 210e9), (0.3, 0.3))
wavelength = 0.1e-3

# %%
# In the middle of a line contact the mean pressure is nearly constant over one wave and equals
# Hertz's. The half-width is 1 mm, which holds 20 waves.
amplitude, half_width = 0.2e-6, 1e-3
full = np.pi * pair.reduced_modulus * amplitude / wavelength
shares = np.array([0.1, 0.2, 0.35, 0.5, 0.7, 0.9])
found = []
for share in shares:
    contact = asp.ContactConditions(
        pair=pair,
        geometry="line",
        radius=half_width * pair.reduced_modulus / (2.0 * share * full),
        length=10e-3,
        # Hertz's largest pressure is then this share of p*
        load=0.5 * np.pi * half_width * share * full * 10e-3,
        surface_speeds=(1.0, 1.0),
    )
    grid = asp.Grid((2048, 8), (-1.5e-3, -4e-6), (1.5e-3, 4e-6))
    wave = np.repeat(amplitude * np.cos(2 * np.pi * grid.x / wavelength)[:, None], 8, axis=1)
    solution = asp.solve_contact(contact, None, asp.Surface(wave, grid))
    middle = np.abs(grid.x) < wavelength
    found.append(solution.in_contact[middle, 0].mean())

# %%
figure, axis = plt.subplots(figsize=(7, 4))
fine = np.linspace(0, 1, 200)
axis.plot(fine, 2 / np.pi * np.arcsin(np.sqrt(fine)), label="closed form")
axis.plot(shares, found, "o", label="solved, two waves in the middle of the contact")
axis.set(xlabel="mean pressure / p*", ylabel="share in contact", xlim=(0, 1), ylim=(0, 1))
axis.legend()
