"""Emulated quantities of a contact and their scales, on which they are smooth and unbounded."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field

SHARE_FLOOR = 0.005  # of load; smaller values are not resolved by recordings or grids
AREA_FLOOR = 0.002
DAMPING_FLOOR = 1e-3


@dataclass(frozen=True, slots=True)
class Output:
    """An emulated quantity: its key in the catalogue, and its scale."""

    key: str
    forward: Callable[[Field], Field]
    back: Callable[[Field], Field]
    slope: Callable[[Field], Field]  # derivative of `forward`, to convert scatter to the scale


def _share(key: str, floor: float) -> Output:
    """Return a share (0 to 1) on a logit scale with a floor, finite at 0 and 1."""
    width = 1.0 + 2.0 * floor

    def forward(value: Field) -> Field:
        return np.asarray(np.log((value + floor) / (1.0 + floor - value)))

    def back(scaled: Field) -> Field:
        return np.asarray(np.clip(width / (1.0 + np.exp(-scaled)) - floor, 0.0, 1.0))

    def slope(value: Field) -> Field:
        return np.asarray(width / ((value + floor) * (1.0 + floor - value)))

    return Output(key, forward, back, slope)


def _positive(key: str) -> Output:
    return Output(key, np.log, np.exp, lambda value: np.asarray(1.0 / value))


def _signed(key: str, floor: float) -> Output:
    """Return a signed quantity on an inverse hyperbolic sine scale."""
    return Output(
        key,
        lambda value: np.asarray(np.arcsinh(value / floor)),
        lambda scaled: np.asarray(floor * np.sinh(scaled)),
        lambda value: np.asarray(1.0 / np.sqrt(value**2 + floor**2)),
    )


CLR = "clr"
CAR = "car"
FILM = "h_mean_m"
FRICTION = "friction_coefficient"
STIFFNESS = "contact_stiffness_n_m"
DAMPING = "contact_damping_ratio"
CAPACITANCE = "capacitance_f"
OUTPUTS: Mapping[str, Output] = {
    output.key: output
    for output in (
        _share(CLR, SHARE_FLOOR),
        _share(CAR, AREA_FLOOR),
        _positive(FILM),
        _positive(FRICTION),
        _positive(STIFFNESS),
        _signed(DAMPING, DAMPING_FLOOR),
        _positive(CAPACITANCE),
    )
}
