"""Uncertainty of the film thicknesses of a solved case, by part."""

import math
from collections.abc import Sequence

from asperity.case import Case
from asperity.ehl import Sides, Uncertainty
from asperity.results.oil_effect import AlphaEffect, estimates_alpha
from asperity.results.surface_spread import Row, mean_row, prediction_interval


def film_errors(
    case: Case, rows: Sequence[Row], effect: AlphaEffect | None
) -> dict[str, Uncertainty | None]:
    """Return the uncertainty of every film by name [m]; None for one not known of all surfaces.

    `grid` contains the error of iteration and, of a running contact, of the finite time. The part
    of an estimated pressure-viscosity coefficient is undetermined without its `effect`.
    """
    means = mean_row(rows)
    return {name: _film_error(case, means, rows, effect, name) for name in ("h_min", "h_central")}


def _film_error(
    case: Case, means: Row, rows: Sequence[Row], effect: AlphaEffect | None, name: str
) -> Uncertainty | None:
    key = f"{name}_m"
    value, numerical = means[key], means[f"{name}_error_m"]
    if value is None:
        return None
    surfaces: Sides | None = None
    if len(rows) > 1:
        values = [float(row[key] or 0.0) for row in rows]
        surfaces = prediction_interval(values, share=False)[1]
    oil: Sides | None = (0.0, 0.0)
    if estimates_alpha(case):
        sides = None if effect is None else effect.film_sides(key)
        oil = sides and (value * sides[0], value * sides[1])
    return Uncertainty(
        value=float(value),
        iteration=(0.0, 0.0),
        grid=None if numerical is None else (float(numerical), float(numerical)),
        surfaces=surfaces,
        oil=oil,
        range=(0.0, math.inf),
    )
