"""
Waviness pressed flat
=====================

A dry wave is pressed flat by the pressure p* = π E* A/λ (Westergaard, Johnson). Below it only
crests touch, over a share of the wavelength that has a closed form: (2/π) arcsin of the root of
p/p*.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

pair = asp.ElasticPair((210e9, 210e9), (0.3, 0.3))
wavelength = 0.1e-3

# %% A line contact is nearly flat over one wave in its middle; the pressure there is Hertz's.
# Half-width 1 mm, 20 waves.
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
        load=0.5
        * np.pi
        * half_width
        * share
        * full
        * 10e-3,  # then Hertz's largest pressure is that share of p*
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
axis.plot(shares, found, "o", label="solved, two waves amid the contact")
axis.set(xlabel="mean pressure / p*", ylabel="share that touches", xlim=(0, 1), ylim=(0, 1))
axis.legend()
