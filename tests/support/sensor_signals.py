"""Signals of several sensors on one contact."""

import numpy as np

from asperity.resonance import line_shape

RATE, SECONDS, BAND = 10_000.0, 4.0, (1800.0, 4000.0)
TRUTH = np.linspace(2900.0, 3750.0, 8)


def sensor_signals(rng, f0, heights):
    """Return acceleration [m/s^2]: the contact's resonance from one common source, and independent
    noise.
    """
    samples = round(RATE * SECONDS)
    frequency = np.fft.rfftfreq(samples, 1.0 / RATE)

    def waves():
        return (
            rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)
        ) / np.sqrt(2.0)

    line = np.sqrt(line_shape(frequency, f0, 0.02)) * waves()
    return [
        np.fft.irfft(
            (np.sqrt(height) * line + 0.3 * waves()) * np.sqrt(RATE * samples / 2.0), samples
        )
        for height in heights
    ]
