"""Gears rated as ISO/TR 15144-1:2014 (predecessor of ISO/TS 6336-22) has it: friction, temperatures, specific film.

Roughness enters once here, as Ra: below the smooth film, and in the friction. Nothing of a solved
rough contact does.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from asperity.core.errors import BadInput
from asperity.rating.flash import UNIFORM_HEAT, flash_rise

OIL_FACTORS = {"mineral": 1.0, "pao": 0.8}  # X_L of the bases whose factor needs no speed


@dataclass(frozen=True)
class GearOil:
    """An oil as the rating asks for it: `viscosity` [Pa s] and `alpha` [1/Pa] of a temperature [K].

    The standard takes alpha from the viscosity at 38 °C (`OilSheet` with the estimate "iso").
    `base` is mineral or pao.

    Raises
    ------
    BadInput
        for another base.
    """

    viscosity: Callable[[float], float]
    alpha: Callable[[float], float]
    base: str

    def __post_init__(self) -> None:
        if self.base not in OIL_FACTORS:
            raise BadInput(
                f"gears are rated with oils of base {' or '.join(OIL_FACTORS)}, got {self.base}"
            )

    @property
    def factor(self) -> float:
        """X_L in the friction."""
        return OIL_FACTORS[self.base]


class Mesh(NamedTuple):
    """What does not change along the path of contact.

    `ra` : mean arithmetic roughness of both flanks [m]; `modulus` : E' [Pa]; `effusivities` : of
    pinion and wheel.
    """

    ra: float
    modulus: float
    effusivities: tuple[float, float]


class MeshPoint(NamedTuple):
    """A point of the path: `radius` [m], Hertz' `pressure` [Pa] and `half_width` [m], `line_load` [N/m], `speeds`."""

    radius: float
    pressure: float
    line_load: float
    half_width: float
    speeds: tuple[float, float]


def mesh_friction(
    line_load: float, radius: float, sum_speed: float, ra: float, viscosity: float, oil: float
) -> float:
    """Mean coefficient of friction, of the pitch point: 0.045 (w'/(v ρ))^0.2 η^-0.05 X_R X_L, X_R = 2.2 (Ra/ρ)^0.25.

    In N/mm, m/s, mm, mPa s and um, as ISO/TR 15144-1:2014 prints it.

    Parameters
    ----------
    line_load : of the tangential force at the base circle [N/m]
    radius : at the pitch point [m]
    sum_speed : of both surfaces there [m/s]
    ra : mean of both flanks [m]
    viscosity : of the oil at its own temperature [Pa s]
    oil : X_L
    """
    rho = 1e3 * radius
    rough = 2.2 * (1e6 * ra / rho) ** 0.25
    pressed: float = (1e-3 * line_load / (sum_speed * rho)) ** 0.2
    return float(0.045 * pressed * (1e3 * viscosity) ** -0.05 * rough * oil)


def loss_factor(path: tuple[float, float], ratio: float, teeth: tuple[int, int]) -> float:
    """H_v = π (ε1² + ε2² + 1 - ε)(1/z1 + 1/z2); ε1, ε2: the path after and before the pitch point over the pitch."""
    after, before = path
    return math.pi * (after**2 + before**2 + 1.0 - ratio) * (1.0 / teeth[0] + 1.0 / teeth[1])


def bulk_temperature(
    oil: float, loss: float, centres: float, face_width: float, *, spray: bool = False
) -> float:
    """θ_M of the teeth [K] = θ_oil + 7400 (P μ H_v/(a b))^0.72 X_S/1.2, P in kW, a and b in mm; without tip relief.

    Parameters
    ----------
    oil : temperature of the oil [K]
    loss : P μ H_v [W]
    centres, face_width : [m]
    spray : oil is sprayed (X_S = 1.2), not dipped into (1.0)
    """
    supplied = 1.2 if spray else 1.0
    return float(
        oil + 7400.0 * (1e-3 * loss / (1e6 * centres * face_width)) ** 0.72 * supplied / 1.2
    )


def specific_film(
    point: MeshPoint, mesh: Mesh, oil: GearOil, friction: float, bulk: float
) -> tuple[float | None, float]:
    """λ = h/Ra with h = 1600 ρ G^0.6 U^0.7 W^-0.13 S^0.22 [um, mm], and the flash temperature in it [K].

    None for a flash so hot that the oil has no alpha left.

    `bulk` is the teeth's temperature [K]. G = α_M E', U = η_M (v1 + v2)/(2 E' ρ), W = 2 π p²/E'²,
    and S is the same α η at the contact's temperature over that at the bulk's. Source: ISO/TR
    15144-1:2014; the film is Dowson's of 1968, a least one.
    """
    rise = flash_rise(
        friction,
        point.line_load,
        point.half_width,
        point.speeds,
        mesh.effusivities,
        shape=UNIFORM_HEAT,
    )
    contact = bulk + rise
    viscosity, alpha = oil.viscosity(bulk), oil.alpha(bulk)
    if oil.alpha(contact) <= 0.0:
        return None, rise
    material = alpha * mesh.modulus
    speed = viscosity * sum(point.speeds) / (2.0 * mesh.modulus * point.radius)
    load = math.tau * (point.pressure / mesh.modulus) ** 2
    thinned = oil.alpha(contact) * oil.viscosity(contact) / (alpha * viscosity)
    film = 1.6 * point.radius * material**0.6 * speed**0.7 * load**-0.13 * thinned**0.22
    return film / mesh.ra, rise
