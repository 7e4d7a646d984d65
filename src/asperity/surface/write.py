"""A surface as a file that other programs open: x3p (ISO 5436-1), heights in full."""

from io import BytesIO
from pathlib import Path

from asperity.core.files import write_bytes
from asperity.surface.model import Surface


def write_surface(surface: Surface, path: str | Path) -> Path:
    """Write a surface as x3p, whole or not at all, and return the path; `read_surface` and SurfaceTopography open it.

    Raises
    ------
    BadInput
        if the folder does not exist or cannot be written to.
    """
    import x3pio  # here: few need it

    path, made, (dx, dy) = Path(path), BytesIO(), surface.grid.spacing
    older = x3pio.Revision.ISO5436_2000  # the one that SurfaceTopography knows
    x3pio.write(made, surface.heights.T, x_scale=dx, y_scale=dy, revision=older)
    write_bytes(path, made.getvalue())
    return path
