"""What is emulated of a contact, and on which scale: one on which it is smooth, and its ends are not walls."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field

SHARE_FLOOR = 0.005  # of load or area: below it, recordings and grids tell nothing
AREA_FLOOR = 0.002
DAMPING_FLOOR = 1e-3


@dataclass(frozen=True, slots=True)
class Output:
    """A quantity of the contact: its key in the catalogue, and the scale that it is emulated on."""

    key: str
    forward: Callable[[Field], Field]
    back: Callable[[Field], Field]
    slope: Callable[[Field], Field]  # of `forward`, by which scatter is taken to the scale


def _share(key: str, floor: float) -> Output:
    """A share, 0 to 1, by its logit, softened by a floor so that 0 is a number too."""
    whole = 1.0 + 2.0 * floor

    def forward(value: Field) -> Field:
        return np.asarray(np.log((value + floor) / (1.0 + floor - value)))

    def back(scaled: Field) -> Field:
        return np.asarray(np.clip(whole / (1.0 + np.exp(-scaled)) - floor, 0.0, 1.0))

    def slope(value: Field) -> Field:
        return np.asarray(whole / ((value + floor) * (1.0 + floor - value)))

    return Output(key, forward, back, slope)


def _positive(key: str) -> Output:
    return Output(key, np.log, np.exp, lambda value: np.asarray(1.0 / value))


def _signed(key: str, floor: float) -> Output:
    """A number of either sign over decades: inverse hyperbolic sine."""
    return Output(
        key,
        lambda value: np.asarray(np.arcsinh(value / floor)),
        lambda scaled: np.asarray(floor * np.sinh(scaled)),
        lambda value: np.asarray(1.0 / np.sqrt(value**2 + floor**2)),
    )


CLR, CAR, FILM, FRICTION, STIFFNESS, DAMPING = (
    "clr",
    "car",
    "h_mean_m",
    "friction_coefficient",
    "contact_stiffness_n_m",
    "contact_damping_ratio",
)
OUTPUTS: Mapping[str, Output] = {
    output.key: output
    for output in (
        _share(CLR, SHARE_FLOOR),
        _share(CAR, AREA_FLOOR),
        _positive(FILM),
        _positive(FRICTION),
        _positive(STIFFNESS),
        _signed(DAMPING, DAMPING_FLOOR),
    )
}
