"""Maps in x3p (ISO 5436-2) and SDF files that SurfaceTopography cannot read."""

import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from asperity.core.errors import UnreadableFile
from asperity.surface.raw_map import RawMap, x_first


def read_x3p(path: Path) -> RawMap:
    """Read an x3p map."""
    import x3pio

    try:
        content = x3pio.read(path)
    except Exception:
        tolerant = _tolerant_x3p(path)
        if tolerant is None:
            raise
        return tolerant
    if not isinstance(content, x3pio.Surface):
        kind = type(content).__name__.lower()
        raise UnreadableFile(
            f"{path.name} holds a {kind}, not a map on a regular grid; give an areal map"
        )
    pixel = (float(content.header.x.increment), float(content.header.y.increment))
    return _metric_map(content.layers[0].z, pixel, "x3p")


def _tolerant_x3p(path: Path) -> RawMap | None:
    """Read an x3p map whose archive violates the standard (subfolder or unknown elements).

    The checksums of the archive detect damage. Returns None unless it holds a map on a regular
    grid.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            mains = [name for name in archive.namelist() if name.split("/")[-1] == "main.xml"]
            root = ElementTree.fromstring(archive.read(mains[0]))
            elements = {
                element.tag.split("}")[-1]: (element.text or "").strip() for element in root.iter()
            }
            steps = [
                float(root.findtext(f".//{{*}}{axis}/{{*}}Increment") or "nan")
                for axis in ("CX", "CY", "CZ")
            ]
            data = archive.read(mains[0].removesuffix("main.xml") + elements["PointDataLink"])
        kind = {"D": "<f8", "F": "<f4"}[root.findtext(".//{*}CZ/{*}DataType") or ""]
        cells = int(elements["SizeX"]), int(elements["SizeY"])
        rows = np.frombuffer(data, dtype=kind).reshape(cells[1], cells[0]) * steps[2]
    except Exception:  # noqa: BLE001 - any error of a damaged archive or its XML
        return None
    notes = ("the x3p archive violates the standard, but holds a map",)
    return _metric_map(rows, (steps[0], steps[1]), "x3p", notes)


def read_sdf(path: Path) -> RawMap:
    """Read an SDF map."""
    import sdfio

    content = sdfio.read(path)
    pixel = (float(content.header.x_scale), float(content.header.y_scale))
    return _metric_map(content.data, pixel, "sdf")


def _metric_map(
    rows: npt.ArrayLike, pixel: tuple[float, float], form: str, notes: tuple[str, ...] = ()
) -> RawMap:
    """Return the map of a file in metres, with rows of constant y."""
    return RawMap(
        heights=x_first(rows), pixel=pixel, format=form, unit="m", lateral_unit="m", notes=notes
    )
