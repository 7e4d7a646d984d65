"""
The contact's resonance in a spectrum
=====================================

A contact under noise rings at its natural frequency. The likelihood of the whole line, background
and all, gives the frequency with a standard deviation, and says "not found" where there is none.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity.paper import papers_case
from asperity.results import solve_case

run = solve_case(papers_case().with_overrides({"grid.cells": [96, 64], "surface.sq": "1.5 um"}))
vibration = run.vibration

# %%
# What a sensor hears besides: tones of a shaft, and noise of its own.
ringing = vibration.response
time = np.arange(ringing.values.size) / ringing.rate_hz
loud = ringing.values.std()
tones = sum(0.5 * loud * np.sin(2 * np.pi * 600.0 * k * time) for k in (1, 2, 3))
hiss = loud * np.random.default_rng(2).standard_normal(time.size)
spectrum = asp.power_spectrum(
    asp.Signal(ringing.values + tones + hiss, ringing.rate_hz, ringing.unit), segment=16_384
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
axis.set_title(f"found {found.crf_hz:.0f} ± {found.crf_std_hz:.0f} Hz")
axis.legend()
