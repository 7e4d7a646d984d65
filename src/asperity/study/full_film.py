"""Limits of CRF and CRFA in full film, for analyses that need a number for every contact.

CRF scales with the sixth root of the asperities' load; CRFA vanishes as they lift off. A resonance
that was not found although asperities carry load stays unknown.
"""

import numpy as np
import pandas

from asperity.results import FULL_FILM_BELOW

CRF_COLUMNS = ("crf_hz", "crf_sound_hz", "crf_paper_hz")
CRFA_COLUMNS = ("crfa", "crfa_sound", "crfa_paper")


def is_full_film(table: pandas.DataFrame) -> "pandas.Series[bool]":
    """Return True for contacts in full film: CLR too low, or no contact in the Hertz zone."""
    return (table["clr"] < FULL_FILM_BELOW) | (table["car"] == 0.0)


def with_full_film_limits(table: pandas.DataFrame) -> pandas.DataFrame:
    """Fill missing resonances in full film: CRF for a CLR of at least 1 %, CRFA of 0."""
    if "full_load_crf_hz" not in table:
        return table
    full = is_full_film(table)
    lowest = table["full_load_crf_hz"] * np.maximum(table["clr"], FULL_FILM_BELOW) ** (1.0 / 6.0)
    limits = {**dict.fromkeys(CRF_COLUMNS, lowest), **dict.fromkeys(CRFA_COLUMNS, 0.0)}
    present = {name: table[name].astype(float) for name in limits if name in table}
    return table.assign(
        **{
            name: values.where(values.notna() | ~full, limits[name])
            for name, values in present.items()
        }
    )
