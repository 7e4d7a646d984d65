"""Assemble the static explorer from the stored contacts: `python docs/make_explorer.py`.

The page is one file that opens without a network or a server. `solve_explorer.py` computes the
contacts. `make docs` assembles the page anew.
"""

import html
import json
import re
from base64 import b64encode
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb

from asperity.report.style import CAVITY_STRIPE, CONTACT_COLOUR
from asperity.results import BOUNDARY_FROM, FULL_FILM_BELOW

DOCS = Path(__file__).parent
FOLDER = DOCS / "explorer"
PAGE = DOCS / "explorer.html"
START = {"speed": 2.0, "sq": 1.0, "load": 500.0}
FULL_FILM, MIXED, BOUNDARY = "Full film", "Mixed lubrication", "Boundary lubrication"
REGIMES = {
    FULL_FILM: "oil separates the surfaces; asperities carry less than 1 % of the load",
    MIXED: "oil and asperities share the load",
    BOUNDARY: "asperities carry 90 % of the load or more",
}
FILM_SHADES, PRESSURE_SHADES = "Blues", "Purples"


def regime(contact: dict[str, Any]) -> str:
    """Return the lubrication regime in words; both regimes where the interval of CLR spans two."""
    low, high = (_regime(contact[key]) for key in ("clr_low", "clr_high"))
    value = _regime(contact["clr"])
    if contact["determined"] or low == high:
        return value
    return f"{low} to {high[0].lower()}{high[1:]}"


def _regime(clr: float) -> str:
    if clr < FULL_FILM_BELOW:
        return FULL_FILM
    return BOUNDARY if clr >= BOUNDARY_FROM else MIXED


def palettes(levels: int) -> dict[str, list[list[int]]]:
    """Return the colour of each level of both maps; level 0 is contact or cavitated film."""
    shares = np.linspace(0.0, 1.0, levels - 1)
    film = matplotlib.colormaps[FILM_SHADES](shares)[:, :3]
    pressure = matplotlib.colormaps[PRESSURE_SHADES](np.sqrt(shares))[:, :3]
    return {
        "film": _bytes([to_rgb(CONTACT_COLOUR), *film]),
        "pressure": _bytes([to_rgb(CAVITY_STRIPE), *pressure]),
    }


def _bytes(colours: list[Any]) -> list[list[int]]:
    rounded: list[list[int]] = np.rint(255.0 * np.array(colours)).astype(int).tolist()
    return rounded


def basis(stored: dict[str, Any]) -> str:
    """Return the page's statement on the origin of its numbers."""
    cell, length = 1e6 * stored["cell_m"], 1e6 * stored["correlation_length_m"]
    return (
        f"asperity {stored['version']} solved {len(stored['contacts'])} contacts: a steel line "
        "contact of 5.4 mm effective radius and 10 mm length with mineral oil, slip 0.2, a "
        "flooded inlet, inlet shear heating and a hardness of 2 GPa. Each is a snapshot: the "
        "roughness is held still. "
        "Roughness that moves with its body usually carries more of the load; asperity solve "
        "reports that mean over time. All contacts have the same isotropic Gaussian surface, with "
        f"a correlation length of {length:g} µm, scaled to Sq, on square cells of {cell:g} µm. "
        "The intervals cover the solver and the cells for this one surface; another surface of "
        "the same kind can differ by more. CLR is not determined where its error bar is above "
        "15 %. Friction, temperature and stress are not shown here."
    )


def page() -> str:
    """Return the page as HTML text."""
    stored = json.loads((FOLDER / "contacts.json").read_text("utf-8"))
    x1, x2, y1, y2 = stored["window_m"]
    axes = stored["axes"]
    data = {key: stored[key] for key in ("axes", "contacts", "window_m", "half_widths_m")}
    for contact in data["contacts"]:
        contact["regime"] = regime(contact)
    png = (FOLDER / "contacts.png").read_bytes()
    data |= {
        "start": {key: axes[key].index(value) for key, value in START.items()},
        "size": [round((end - start) / stored["cell_m"]) for start, end in ((x1, x2), (y1, y2))],
        "per_row": len(axes["sq"]) * len(axes["load"]),
        "regimes": REGIMES,
        "palettes": palettes(stored["levels"]),
        "maps": "data:image/png;base64," + b64encode(png).decode(),
    }
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"))
    contents = {
        "BASIS": html.escape(basis(stored)),
        "CASE": html.escape(stored["case"]),
        "DATA": text.replace("<", "\\u003c"),  # must not close the script element
    }
    template = (FOLDER / "page.html").read_text("utf-8")
    return re.sub(r"__(BASIS|CASE|DATA)__", lambda name: contents[name[1]], template)


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
