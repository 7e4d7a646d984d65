"""Load shares by film thickness, for any model.

A load share of "contact" means little without the film threshold below which a cell counts: at the
pressure cap, oil films of tens of nanometres can lie between touching bodies.
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
    """Load and area shares by kind of contact and by film thickness.

    `clr_solid` and `car_solid` count cells whose elastic bodies touch, over the load and over the
    Hertz zone; `clr_floor` counts all cells whose film is at most the contact film (`films[0]`);
    `below` is the share of the load on films up to each of `films` [m]. `cavitated` is the share of
    the Hertz zone that is not filled with oil, `oil` the oil in the zone as a mean film thickness
    [m]; the unified model counts cavities as filled.
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
    """Return the load share, 0 to 1, of cells with a film of at most `film` [m] (1 % tolerance).

    Raises
    ------
    BadInput
        for a film that is not positive.
    """
    require_positive("film", film, "m")
    thin = solution.gap <= (1.0 + CLOSED_WITHIN) * film
    return carried_share(solution.pressure, thin)


def sharing_by_film(solution: ContactSolution) -> LoadSharing:
    """Compute the load shares of a solution of any model."""
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
