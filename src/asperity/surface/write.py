"""Export of surfaces as x3p (ISO 5436-1) in double precision."""

from io import BytesIO
from pathlib import Path

from asperity.core.files import write_bytes
from asperity.surface.model import Surface


def write_surface(surface: Surface, path: str | Path) -> Path:
    """Write a surface as x3p, atomically, and return the path.

    `read_surface` and SurfaceTopography can read the file.

    Raises
    ------
    BadInput
        The folder does not exist or is not writable.
    """
    import x3pio  # slow import, rarely used

    path, buffer, (dx, dy) = Path(path), BytesIO(), surface.grid.spacing
    revision = x3pio.Revision.ISO5436_2000  # SurfaceTopography reads no newer one
    file = x3pio.Surface.from_array(surface.heights.T, x_scale=dx, y_scale=dy, revision=revision)
    file.metadata = None  # no instrument, and no date: equal surfaces are equal files
    file.save(buffer)
    write_bytes(path, buffer.getvalue())
    return path
