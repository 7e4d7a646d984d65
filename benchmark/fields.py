"""Fields of the cases as netCDF: `python -m benchmark.fields` writes `benchmark/fields/NAME.nc`.

Pressure and film along x (and y) in SI for the steady cases by their first method: closed forms for
smooth dry contacts and waves, the nodes of the reference solvers for lubricated ones.
"""

import sys
from collections.abc import Collection
from pathlib import Path

import numpy as np
import xarray as xr

from asperity.benchmark import load_benchmark
from asperity.contact import hertz
from benchmark import oiled, ways

HERE = Path(__file__).parent / "fields"
GRIDS = {
    "point": [(46, 21), (64, 29)],
    "strip": [(101, 12), (151, 18)],
    "line": [(301, 1), (601, 1)],
}


def field_of(given: oiled.Given) -> xr.Dataset | None:
    """Return the fields of a case, or None if its first method has none."""
    if given["kind"] in ("ehl", "mixed", "conserving"):
        return _twin(given)
    if given["kind"] == "wave":
        return _wave(given)
    if given["kind"] == "dry" and not {"waves", "rings"} & set(given):
        return _hertz(given)
    return None


def _twin(given: oiled.Given) -> xr.Dataset:
    kind = "strip" if "width_m" in given else given["geometry"]
    *_, (solver, state) = oiled.solved(given, GRIDS[kind])
    stated, mesh = oiled.Stated(given), solver.problem.mesh
    film = np.maximum(solver.gap(state), solver.problem.touch) * stated.height
    fields = {"pressure": state.pressure * stated.p_h, "film": film}
    if solver.problem.touch > 0.0 and not solver.problem.keeps_oil:
        fields["oil_pressure"] = state.oil * stated.p_h
    if solver.problem.keeps_oil:
        fields["fill"] = 1.0 + np.minimum(state.oil, 0.0)
    shaped = {name: field.reshape(mesh.shape) for name, field in fields.items()}
    if kind == "line":
        return _dataset(
            {"x": mesh.x * stated.a}, {name: field[:, 0] for name, field in shaped.items()}
        )
    return _dataset({"x": mesh.x * stated.a, "y": mesh.y * stated.a}, shaped)


def _hertz(given: oiled.Given) -> xr.Dataset:
    modulus, share = ways.modulus(given), np.linspace(-1.2, 1.2, 121)
    if given["geometry"] == "line":
        hertzian = hertz.line_contact(given["line_load_n_m"], 1.0, given["radius_m"], modulus)
        x = share * hertzian.half_widths[0]
        return _dataset(
            {"x": x}, {"pressure": hertzian.p_max * np.sqrt(np.maximum(1.0 - share**2, 0.0))}
        )
    if given["geometry"] == "point":
        hertzian = hertz.point_contact(given["load_n"], given["radius_m"], modulus)
    else:
        hertzian = hertz.elliptic_contact(given["load_n"], tuple(given["radius_m"]), modulus)
    a, b = hertzian.half_widths
    inside = np.maximum(1.0 - share[:, None] ** 2 - share[None, :] ** 2, 0.0)
    return _dataset(
        {"x": share * a, "y": share * b}, {"pressure": hertzian.p_max * np.sqrt(inside)}
    )


def _wave(given: oiled.Given) -> xr.Dataset:
    """Evaluate Westergaard (1939), Johnson (1985) eq. 13.8.

    Pressure is zero outside |x| < b, with sin(pi b/wavelength)^2 = s.
    """
    length, s = given["wavelength_m"], given["pressure_over_full"]
    mean = s * np.pi * ways.modulus(given) * given["amplitude_m"] / length
    x = (np.arange(400) + 0.5) / 400 * length - length / 2.0
    under = np.maximum(s - np.sin(np.pi * x / length) ** 2, 0.0)
    return _dataset(
        {"x": x}, {"pressure": 2.0 * mean / s * np.cos(np.pi * x / length) * np.sqrt(under)}
    )


UNITS = {"pressure": "Pa", "oil_pressure": "Pa", "film": "m", "fill": "1"}


def _dataset(axes: dict[str, np.ndarray], fields: dict[str, np.ndarray]) -> xr.Dataset:
    variables = {
        name: (tuple(axes), field, {"units": UNITS[name]}) for name, field in fields.items()
    }
    return xr.Dataset(
        variables, {name: (name, axis, {"units": "m"}) for name, axis in axes.items()}
    )


def main(prefixes: Collection[str]) -> None:
    HERE.mkdir(exist_ok=True)
    for case in load_benchmark(HERE.parent / "cases"):
        if prefixes and not case.name.startswith(tuple(prefixes)):
            continue
        dataset = field_of(dict(case.given))
        if dataset is not None:
            dataset.attrs = {
                "title": case.name,
                "source": f"benchmark/cases/{case.name}.toml",
                "Conventions": "CF-1.11",
            }
            packed = {
                name: {"dtype": "float32", "zlib": True, "complevel": 9}
                for name in dataset.data_vars
            }
            dataset.to_netcdf(HERE / f"{case.name}.nc", engine="h5netcdf", encoding=packed)
            print(case.name, *dataset.sizes.items())


if __name__ == "__main__":
    main(sys.argv[1:])
