"""Who carries the load at which film: shares that name their threshold, of any model.

A share of load on "contact" means little without the film below which a cell counts: where the oil
stands at the cap it may lie tens of nanometres thick between bodies that touch.
"""

from dataclasses import dataclass

import numpy as np

from asperity.core.errors import require_positive
from asperity.ehl import ContactSolution, hertz_zone
from asperity.ehl.load_shares import area_share, carried_share
from asperity.ehl.models.single_pressure import CLOSED_WITHIN

FILMS = (20e-9, 50e-9, 100e-9, 200e-9)  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadSharing:
    """Shares of load and area by side and by film.

    `clr_solid` and `car_solid` count cells whose elastic bodies touch, over the load and over the
    Hertz zone; `clr_floor` those of them, and others, whose film is no thicker than the contact
    film (`films[0]`); `below` is the share of the load on films up to each of `films` [m].
    `cavitated` is the share of the Hertz zone that is not full of oil, `oil` the oil in it as a
    mean film [m]: the unified model takes its cavities for full.
    """

    clr_solid: float
    car_solid: float
    films: tuple[float, ...]
    below: tuple[float, ...]
    cavitated: float
    oil: float

    @property
    def clr_floor(self) -> float:
        """Share of the load on films no thicker than the contact film."""
        return self.below[0]


def clr_below(solution: ContactSolution, film: float) -> float:
    """Share of the load, 0 to 1, on cells whose film is no thicker than `film` [m]; 1 % above it counts as it.

    Raises
    ------
    BadInput
        for a film that is not positive.
    """
    require_positive("film", film, "m")
    thin = solution.gap <= (1.0 + CLOSED_WITHIN) * film
    return carried_share(solution.pressure, thin)


def sharing_by_film(solution: ContactSolution) -> LoadSharing:
    """Read the shares off a solution of any model."""
    zone = hertz_zone(solution.conditions, solution.grid)
    films = (
        solution.options.contact_film,
        *(film for film in FILMS if film > solution.options.contact_film),
    )
    content = np.ones_like(solution.gap) if solution.oil is None else solution.oil.content
    return LoadSharing(
        clr_solid=carried_share(solution.pressure, solution.in_contact),
        car_solid=area_share(solution.in_contact, zone),
        films=films,
        below=tuple(clr_below(solution, film) for film in films),
        cavitated=area_share(solution.cavitated, zone),
        oil=float((content * solution.gap)[zone].mean()),
    )
