"""A vibration (or profile) sampled in time, and its spectrum: where measured and simulated data meet.

Knows neither machines nor contacts. Finding a resonance in a spectrum is left to `asperity.wear`.
"""

from dataclasses import dataclass

from asperity.errors import BadInput, require_positive
from asperity.arrays import Field


@dataclass(frozen=True, slots=True)
class Signal:
    """Uniformly sampled values.

    `values` shape (samples,) in `unit` (an SI unit as pint writes it, such as "m/s^2"), `rate_hz` samples a second.
    """

    values: Field
    rate_hz: float
    unit: str

    def __post_init__(self) -> None:
        require_positive("sampling rate", self.rate_hz, "Hz")
        if self.values.ndim != 1 or self.values.size < 2:
            raise BadInput(f"a signal is one row of at least 2 samples, got an array of shape {self.values.shape}")

    @property
    def duration_s(self) -> float:
        """Length of the record [s]."""
        return self.values.size / self.rate_hz
