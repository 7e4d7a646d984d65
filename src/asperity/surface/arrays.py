"""Heights from arrays: of NumPy and xarray, in npy, npz and netCDF files.

An array without names of its axes is a table: a row per y, a column per x, as in text files. Axes
named x and y determine the orientation, and coordinates along them give the pixel.
"""

from collections.abc import Hashable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from asperity.core.arrays import real_array
from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line
from asperity.surface.raw_map import RawMap, map_of_rows

if TYPE_CHECKING:
    import xarray


class NotForXarray(Exception):
    """Raised for a netCDF file of SurfaceTopography, which its own reader handles."""


_HEIGHT_NAMES = {"heights", "height", "topography", "z"}
_EVEN = 0.01  # deviation of a coordinate from even steps, over the mean step


def read_numpy(path: Path) -> RawMap:
    """Read heights from .npy, or from .npz, with coordinates if that holds arrays x and y."""
    import xarray

    arrays, form = _loaded(path), path.suffix.lower().removeprefix(".")
    name = _heights_name(path.name, {key: array.ndim for key, array in arrays.items()})
    rows, x, y = arrays[name], arrays.get("x"), arrays.get("y")
    if x is None or y is None:
        return array_map(path.name, rows, form)
    if (y.size, x.size) != rows.shape:
        raise UnreadableFile(
            f"{path.name} holds {name} of shape {rows.shape}, but {x.size} x and {y.size} y; store "
            "it with a row per y and a column per x"
        )
    named = xarray.DataArray(rows, dims=("y", "x"), coords={"x": x, "y": y})
    return array_map(path.name, named, form)


def read_netcdf(path: Path) -> RawMap:
    """Read heights from netCDF as xarray writes it.

    Raises
    ------
    NotForXarray
        SurfaceTopography wrote the file.
    """
    import xarray

    with xarray.open_dataset(path) as dataset:
        if any("length" in dataset[axis].attrs for axis in ("x", "y") if axis in dataset):
            raise NotForXarray
        name = _heights_name(path.name, {str(key): dataset[key].ndim for key in dataset.data_vars})
        return array_map(path.name, dataset[name].load(), "netCDF")


def array_map(name: str, heights: "np.ndarray | xarray.DataArray", form: str) -> RawMap:
    """Return an array of heights as a map, with the unit of an xarray's attributes if it has one.

    Raises
    ------
    UnreadableFile
        It does not have two axes, is not of real numbers, or its coordinates are not evenly spaced.
    """
    if np.ndim(heights) != 2 or np.asarray(heights).dtype.kind not in "fiu":
        raise UnreadableFile(
            f"{name} holds a {np.ndim(heights)}-dimensional array of type "
            f"{np.asarray(heights).dtype}; give real heights along x and y"
        )
    if isinstance(heights, np.ndarray) or not hasattr(heights, "dims"):  # not of xarray
        return map_of_rows(real_array(name, heights).astype(np.float64), form)
    if {str(dim).lower() for dim in heights.dims} == {"x", "y"}:
        ordered = sorted(heights.dims, key=lambda dim: str(dim).lower())
        return _named_map(name, heights.transpose(*ordered), form)
    table = map_of_rows(np.asarray(heights, dtype=np.float64), form)
    return replace(table, unit=_unit(heights.attrs))


def _named_map(name: str, heights: "xarray.DataArray", form: str) -> RawMap:
    """Return the map of heights along the axes x and y, in this order."""
    pixel, units = [], []
    if heights.dims[1] not in heights.coords:  # as in a table, the first row is the largest y
        heights = heights[:, ::-1]
    for dim in heights.dims:
        if dim not in heights.coords:
            continue
        coordinate = heights.coords[dim]
        steps = np.diff(np.asarray(coordinate, dtype=np.float64))
        step = steps.mean() if steps.size else 0.0
        if not step or not np.max(np.abs(steps - step)) < _EVEN * abs(step):
            raise UnreadableFile(
                f"{name} has a coordinate {dim} that is not evenly spaced; interpolate it onto "
                "even steps"
            )
        heights = heights.sortby(dim)
        pixel.append(abs(float(step)))
        units.append(_unit(coordinate.attrs))
    if len(pixel) == 2 and units[0] != units[1]:
        raise UnreadableFile(
            f"{name} states x in {units[0] or 'no unit'} and y in {units[1] or 'no unit'}; give "
            "both one unit"
        )
    return RawMap(
        heights=np.ascontiguousarray(heights, dtype=np.float64),
        pixel=(pixel[0], pixel[1]) if len(pixel) == 2 else None,
        format=form,
        unit=_unit(heights.attrs),
        lateral_unit=units[0] if len(pixel) == 2 else None,
    )


def _unit(attributes: Mapping[Hashable, object]) -> str | None:
    unit = attributes.get("units", attributes.get("unit"))
    return None if unit is None else str(unit)


def _heights_name(file: str, axes: Mapping[str, int]) -> str:
    """Return the name of the only map among arrays, or of the one named like heights."""
    maps = [name for name, count in axes.items() if count == 2]
    named = [name for name in maps if name.lower() in _HEIGHT_NAMES]
    if len(maps) == 1 or len(named) == 1:
        return (named or maps)[0]
    listed = ", ".join(sorted(maps)) or "none"
    raise UnreadableFile(
        f"{file} must hold one map, or one named heights, got maps: {listed}; export one"
    )


def _loaded(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of an npy or npz file by name."""
    try:
        content = np.load(path, allow_pickle=False)
        if isinstance(content, np.ndarray):
            return {"heights": content}
        with content:
            return {name: np.asarray(content[name]) for name in content.files}
    except MemoryError:
        raise
    except Exception as error:
        raise UnreadableFile(
            f"{path.name} is not a readable {path.suffix} file ({first_line(error)}); export "
            "it again with numpy"
        ) from error
