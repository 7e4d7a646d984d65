"""Fields of a run as a table (csv) or an image for ParaView (vti)."""

from pathlib import Path

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.files import atomic_write, write_csv
from asperity.results.run import Run

FIELD_SUFFIXES = ".csv", ".vti"


def write_fields(run: Run, path: str | Path) -> Path:
    """Write all fields over x and y of a run: film, pressure, contact, stress, temperatures.

    A csv has a row per cell and SI units in its heading. A vti file (VTK image, cells in metres)
    has a name per field.

    Raises
    ------
    BadInput
        for another suffix than .csv and .vti.
    """
    path = Path(path)
    if path.suffix.lower() not in FIELD_SUFFIXES:
        raise BadInput(f"fields are written as {' or '.join(FIELD_SUFFIXES)}, got {path}")
    variables = run.contents().variables
    fields = {
        name: (np.asarray(values), attributes.get("units", "1"))
        for name, (dimensions, values, attributes) in variables.items()
        if dimensions == ("x", "y")
    }
    if path.suffix.lower() == ".csv":
        _write_table(run, fields, path)
    else:
        _write_image(run, fields, path)
    return path


def _write_table(run: Run, fields: dict[str, tuple[Field, str]], path: Path) -> None:
    import pandas

    grid = run.solution.grid
    x, y = np.meshgrid(grid.x, grid.y, indexing="ij")
    columns = {"x": (x, "m"), "y": (y, "m"), **fields}
    table = {f"{name} [{unit}]": values.ravel() for name, (values, unit) in columns.items()}
    write_csv(path, pandas.DataFrame(table))


def _write_image(run: Run, fields: dict[str, tuple[Field, str]], path: Path) -> None:
    from pyevtk.hl import imageToVTK

    grid = run.solution.grid
    cells = {
        name: np.asfortranarray(values[:, :, np.newaxis]) for name, (values, _) in fields.items()
    }
    thickness = min(grid.spacing)
    with atomic_write(path) as partial:
        written = imageToVTK(
            str(partial.with_suffix("")),
            origin=(*grid.lower, 0.0),
            spacing=(*grid.spacing, thickness),
            cellData=cells,
        )
        if Path(written) != partial:
            Path(written).replace(partial)
