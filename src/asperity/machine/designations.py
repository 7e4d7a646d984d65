"""Common rolling bearings by designation: internal geometry and load ratings.

Rolling elements and pitch diameters are those from which makers state defect frequencies; load
ratings are those of general catalogues. Both are recollected. The ratings lie within 4 % of ISO
281's formula for this geometry. Internal geometry is not standardised: makers differ.
"""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from asperity.core.errors import BadInput

LOAD_PER_LIMIT = {"ball-bearing": 22.0, "cylindrical-roller-bearing": 8.2}  # C0/Cu, ISO 281


@dataclass(frozen=True, slots=True)
class CatalogueBearing:
    """Bearing of the table: kind, number and size of elements [m], load ratings [N].

    `length` is the effective length of a roller, None for balls. `fatigue_load_limit` is C0/22 of
    ball and C0/8.2 of roller bearings (ISO 281, pitch diameters up to 100 mm).
    """

    designation: str
    kind: str
    elements: int
    diameter: float
    length: float | None
    pitch_diameter: float
    dynamic_load_rating: float
    static_load_rating: float

    @property
    def fatigue_load_limit(self) -> float:
        """Fatigue load limit Cu [N]."""
        return self.static_load_rating / LOAD_PER_LIMIT[self.kind]


@cache
def catalogue_bearings() -> dict[str, CatalogueBearing]:
    """Return the table of bearings by designation.

    Examples
    --------
    >>> from asperity.machine import catalogue_bearings
    >>> catalogue_bearings()["6205"].elements
    9
    """
    text = files("asperity.machine").joinpath("bearings.csv").read_text("utf-8")
    return {
        row["designation"]: CatalogueBearing(
            row["designation"],
            row["kind"],
            int(row["elements"]),
            1e-3 * float(row["diameter_mm"]),
            1e-3 * float(row["length_mm"]) if row["length_mm"] else None,
            1e-3 * float(row["pitch_mm"]),
            1e3 * float(row["dynamic_kn"]),
            1e3 * float(row["static_kn"]),
        )
        for row in csv.DictReader(text.splitlines())
    }


def catalogue_bearing(designation: str) -> CatalogueBearing:
    """Return a bearing by its designation, with or without space; BadInput for an unknown one."""
    table = catalogue_bearings()
    spelled = {name.replace(" ", "").lower(): bearing for name, bearing in table.items()}
    try:
        return spelled[designation.replace(" ", "").lower()]
    except KeyError:
        raise BadInput(
            f'designation must be one of {", ".join(table)}, got "{designation}"; give the '
            "internal geometry of another bearing"
        ) from None
