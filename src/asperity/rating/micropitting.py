"""Micropitting rating of gears by ISO/TR 15144-1:2014 (predecessor of ISO/TS 6336-22).

Roughness enters only as Ra, in the specific film thickness and the friction; results of solved
contacts are not used.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from asperity.core.errors import BadInput
from asperity.rating.flash import UNIFORM_HEAT, flash_rise

OIL_FACTORS = {"mineral": 1.0, "pao": 0.8}  # X_L of base oils with a factor independent of speed


@dataclass(frozen=True)
class GearOil:
    """Oil of the rating: `viscosity` [Pa s] and `alpha` [1/Pa] as functions of temperature [K].

    The standard derives alpha from the viscosity at 38 °C (`OilSheet` with the estimate "iso").
    `base` is mineral or pao.

    Raises
    ------
    BadInput
        The base oil is another one.
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
        """Lubricant factor X_L of the friction."""
        return OIL_FACTORS[self.base]


class Mesh(NamedTuple):
    """Constants along the path of contact.

    `ra` mean arithmetic roughness of both flanks [m]; `modulus` E' [Pa]; `effusivities` of pinion
    and wheel.
    """

    ra: float
    modulus: float
    effusivities: tuple[float, float]


class MeshPoint(NamedTuple):
    """Point of the path of contact.

    `radius` [m], Hertz `pressure` [Pa] and `half_width` [m], `line_load` [N/m], `speeds` [m/s].
    """

    radius: float
    pressure: float
    line_load: float
    half_width: float
    speeds: tuple[float, float]


def mesh_friction(
    line_load: float, radius: float, sum_speed: float, ra: float, viscosity: float, oil: float
) -> float:
    """Return the mean coefficient of friction, evaluated at the pitch point.

    0.045 (w'/(v ρ))^0.2 η^-0.05 X_R X_L, X_R = 2.2 (Ra/ρ)^0.25, in N/mm, m/s, mm, mPa s and um
    (ISO/TR 15144-1:2014).

    Parameters
    ----------
    line_load : tangential force at the base circle per width [N/m]
    radius : effective radius at the pitch point [m]
    sum_speed : sum of both surface speeds there [m/s]
    ra : mean Ra of both flanks [m]
    viscosity : viscosity at the oil temperature [Pa s]
    oil : X_L
    """
    rho = 1e3 * radius
    roughness = 2.2 * (1e6 * ra / rho) ** 0.25
    loading: float = (1e-3 * line_load / (sum_speed * rho)) ** 0.2
    return float(0.045 * loading * (1e3 * viscosity) ** -0.05 * roughness * oil)


def helical_load_factor(ratio: float) -> float:
    """Return K_Bγ of the friction for a total contact ratio; 1 up to 2, rising to 1.3 at 3.5."""
    within = min(max(ratio, 2.0), 3.5)
    return 1.0 + 0.2 * math.sqrt((within - 2.0) * (5.0 - within))


def loss_factor(
    path: tuple[float, float], ratio: float, teeth: tuple[int, int], helix: float = 0.0
) -> float:
    """Return the gear loss factor H_v = π (ε1² + ε2² + 1 - ε)(1/z1 + 1/z2)/cos βb.

    `path` = (ε1, ε2) are the parts of the contact ratio ε after and before the pitch point, `helix`
    is the base helix angle βb [rad].
    """
    after, before = path
    lost = math.pi * (after**2 + before**2 + 1.0 - ratio) * (1.0 / teeth[0] + 1.0 / teeth[1])
    return lost / math.cos(helix)


def bulk_temperature(
    oil: float, loss: float, centres: float, face_width: float, *, spray: bool = False
) -> float:
    """Return the bulk temperature θ_M of teeth without tip relief [K].

    θ_M = θ_oil + 7400 (P μ H_v/(a b))^0.72 X_S/1.2, P in kW, a and b in mm.

    Parameters
    ----------
    oil : oil temperature [K]
    loss : P μ H_v [W]
    centres, face_width : centre distance a and face width b [m]
    spray : spray lubrication (X_S = 1.2) instead of dip lubrication (1.0)
    """
    supply = 1.2 if spray else 1.0
    return float(oil + 7400.0 * (1e-3 * loss / (1e6 * centres * face_width)) ** 0.72 * supply / 1.2)


def specific_film(
    point: MeshPoint, mesh: Mesh, oil: GearOil, friction: float, bulk: float
) -> tuple[float | None, float]:
    """Return the specific film thickness λ and the flash temperature rise [K].

    λ = h/Ra with h = 1600 ρ G^0.6 U^0.7 W^-0.13 S^0.22 [um, mm], G = α_M E', U = η_M (v1 + v2)/(2
    E' ρ), W = 2 π p²/E'², and S the ratio of α η at the contact temperature to that at the bulk
    temperature `bulk` [K]. λ is None if alpha is not positive at the contact temperature. h is
    Dowson's minimum film thickness of 1968. Source: ISO/TR 15144-1:2014.
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
    viscosity = oil.viscosity(bulk)
    alpha = oil.alpha(bulk)
    if oil.alpha(contact) <= 0.0:
        return None, rise
    material = alpha * mesh.modulus
    speed = viscosity * sum(point.speeds) / (2.0 * mesh.modulus * point.radius)
    load = math.tau * (point.pressure / mesh.modulus) ** 2
    sliding = oil.alpha(contact) * oil.viscosity(contact) / (alpha * viscosity)
    film = 1.6 * point.radius * material**0.6 * speed**0.7 * load**-0.13 * sliding**0.22
    return film / mesh.ra, rise
