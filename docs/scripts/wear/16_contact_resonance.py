"""
The contact's resonance in a spectrum
=====================================

A contact excited by noise vibrates at its natural frequency. A maximum-likelihood fit of the whole
line and its background gives the frequency with a standard deviation, or reports that there is no
resonance.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity.paper import papers_case
from asperity.results import solve_case

run = solve_case(papers_case().with_overrides({"grid.cells": [96, 64], "surface.sq": "1.5 um"}))
vibration = run.vibration

# %%
# Add disturbances: tones of a shaft and sensor noise.
response = vibration.response
time = np.arange(response.values.size) / response.rate_hz
rms = response.values.std()
tones = sum(0.5 * rms * np.sin(2 * np.pi * 600.0 * k * time) for k in (1, 2, 3))
noise = rms * np.random.default_rng(2).standard_normal(time.size)
spectrum = asp.power_spectrum(
    asp.Signal(response.values + tones + noise, response.rate_hz, response.unit), segment=16_384
)
found = asp.contact_resonance(spectrum, band_hz=vibration.band_hz)

# %%
figure, axis = plt.subplots(figsize=(7, 4))
axis.semilogy(spectrum.frequency_hz, spectrum.density, color="0.7", lw=0.6, label="spectrum")
frequency = np.linspace(*vibration.band_hz, 500)
axis.semilogy(frequency, found.curve(frequency), label="fitted line and background")
axis.axvline(
    vibration.oscillator.natural_frequency_hz,
    ls=":",
    color="k",
    label="natural frequency of the contact",
)
axis.set(xlabel="frequency [Hz]", ylabel="density of acceleration [m²/s⁴/Hz]", xlim=(0, 6000))
axis.set_title(f"resonance {found.crf_hz:.0f} ± {found.crf_std_hz:.0f} Hz")
axis.legend()
