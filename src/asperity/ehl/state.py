"""What a tribologist reads off a solved contact: load and area shares, film, and how well the equations are met."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactState:
    """Scalars of a solved contact, SI.

    `car` contact cells in |x| <= a over all cells there; `car_domain` contact area of the whole domain over the Hertz
    area; `clr` asperity load over load; `sq` composite roughness [m]; films over the Hertz zone [m]: `h_min`,
    `h_central` (mean over |x| <= a/10 .. the smooth contact's plateau), `h_mean`; `lambda_ratio` = smooth-contact
    film over Sq (None for a flat surface or a dry contact); `p_max` [Pa]; `reynolds_residual`, `load_error` relative;
    `mass_flux_imbalance` oil lost or re-created anywhere, summed, over the oil that enters (0 when dry).
    """

    car: float
    car_domain: float
    clr: float
    sq: float
    h_min: float
    h_central: float
    h_mean: float
    lambda_ratio: float | None
    p_max: float
    reynolds_residual: float
    load_error: float
    mass_flux_imbalance: float
