"""Maps in the text format of Wyko interferometers.

A header of tab-separated names, types, lengths and values; then a line per column of pixels.
Heights are in waves over `Mult`.
"""

from pathlib import Path

import numpy as np

from asperity.core.errors import UnreadableFile
from asperity.surface.raw_map import RawMap

START = b"Wyko ASCII Data File"


def read_wyko(path: Path) -> RawMap:
    """Read a map from Wyko's text format.

    Raises
    ------
    UnreadableFile
        The header lacks an entry, or the size differs from that of the data.
    """
    lines = path.read_text("utf-8", errors="replace").splitlines()
    start = next((i for i, line in enumerate(lines) if line.startswith("RAW_DATA")), len(lines))
    header = {fields[0]: fields[-1] for line in lines[:start] if (fields := line.split("\t"))}
    try:
        cells = int(header["X Size"]), int(header["Y Size"])
        millimetres, aspect = float(header["Pixel_size"]), float(header.get("Aspect", 1.0))
        nanometres = float(header["Wavelength"]) / float(header.get("Mult", 1.0))
        rows = [line.split("\t")[: cells[1]] for line in lines[start + 1 :][: cells[0]]]
        heights = np.array([[_number(text) for text in row] for row in rows]).reshape(cells)
    except (KeyError, ValueError, ZeroDivisionError) as error:
        raise UnreadableFile(
            f"{path.name} is a damaged Wyko text file ({error}); export it again"
        ) from error
    return RawMap(
        heights=1e-6 * nanometres * heights,
        pixel=(millimetres, millimetres * aspect),
        format="Wyko ASCII",
        unit="mm",
        lateral_unit="mm",
    )


def _number(text: str) -> float:
    return float("nan") if text.strip() in ("", "Bad") else float(text)
