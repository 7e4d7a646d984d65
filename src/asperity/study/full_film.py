"""What CRF and CRFA count as where the film is full and nothing resonates, for those who need numbers of all contacts.

CRF goes with the sixth root of the asperities' load, and CRFA to nothing as they lift off. A
resonance that was not found though asperities carry load is another matter, and stays unknown.
"""

import numpy as np
import pandas

SILENT_CLR = 0.01  # load share below which the film is full; the lower end of the search band
CRF_COLUMNS = ("crf_hz", "crf_sound_hz", "crf_paper_hz")
CRFA_COLUMNS = ("crfa", "crfa_sound", "crfa_paper")


def silent(table: pandas.DataFrame) -> "pandas.Series[bool]":
    """Contacts without a resonance: too little load on asperities, or none of them in the Hertz zone."""
    return (table["clr"] < SILENT_CLR) | (table["car"] == 0.0)


def with_silence(table: pandas.DataFrame) -> pandas.DataFrame:
    """The rows with CRF at their load share, 1 % at least, and CRFA at 0, where nothing resonates."""
    if "full_load_crf_hz" not in table:
        return table
    none = silent(table)
    lowest = table["full_load_crf_hz"] * np.maximum(table["clr"], SILENT_CLR) ** (1.0 / 6.0)
    limits = {**dict.fromkeys(CRF_COLUMNS, lowest), **dict.fromkeys(CRFA_COLUMNS, 0.0)}
    known = {name: table[name].astype(float) for name in limits if name in table}
    return table.assign(
        **{
            name: values.where(values.notna() | ~none, limits[name])
            for name, values in known.items()
        }
    )
