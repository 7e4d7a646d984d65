"""`asperity surface`: what a measured surface holds."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import print_json, print_rows, read_option_length, require_output
from asperity.errors import BadInput

if TYPE_CHECKING:
    from asperity.surface import SurfaceDescription


@app.command()
def surface(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Measured surfaces.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Draw one surface: map, profile, bearing curve, spectra, lay."),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the heights, for a file that names none.")] = None,
    lateral_unit: Annotated[str | None, typer.Option(help="Unit of x and y, for a file that names none.")] = None,
    pixel: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Distance of the heights of a bare matrix: '1.6 um'.")
    ] = None,
    form: Annotated[
        str, typer.Option(help="Remove none, a plane, quadratic, cubic, quartic or cylinder form.")
    ] = "quadratic",
    turn: Annotated[bool, typer.Option("--turn", help="Turn by 90 degrees: x of the file becomes y.")] = False,
    outliers: Annotated[str, typer.Option(help="Keep or remove heights far off their neighbours.")] = "keep",
    s_filter: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Remove shorter waves (ISO 16610 Gaussian): '5 um'.")
    ] = None,
    l_filter: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Remove longer waves (ISO 16610 Gaussian): '0.25 mm'.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what a surface file holds: size, pixel, missing data, what was done to it, parameters."""
    if out is not None:
        require_output(out, ".png")
        if len(files) > 1:
            raise BadInput(f"--out {out} holds one map, got {len(files)} surfaces; draw them one by one")
    from asperity.surface import describe_surface

    lengths = {"pixel": pixel, "s_filter": s_filter, "l_filter": l_filter}
    options: dict[str, Any] = {
        name: read_option_length(name, text) for name, text in lengths.items() if text is not None
    }
    options |= {"unit": unit, "lateral_unit": lateral_unit, "form": form, "turn": turn, "outliers": outliers}
    described: list[SurfaceDescription] = []
    refused: list[tuple[Path, BadInput]] = []
    for file in files:
        try:
            described.append(describe_surface(file, **options))
        except BadInput as error:
            refused.append((file, error))
    if out is not None and described:
        from asperity.report import surface_map

        surface_map(described[0], out)
    if described:
        _show(described, refused, out, as_json=as_json, quiet=quiet)
    if refused:
        raise BadInput("; ".join(dict.fromkeys(str(error) for _, error in refused)))


def _show(
    described: "Sequence[SurfaceDescription]",
    refused: "Sequence[tuple[Path, BadInput]]",
    out: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    if as_json:
        files = [description.scalars() for description in described]
        print_json({"files": files, "refused": [{"file": str(file), "reason": str(error)} for file, error in refused]})
        return
    for number, description in enumerate(described):
        if number and not quiet:
            print()
        print(_surface_verdict(description))
        if not quiet:
            _print_surface(description)
    if out is not None and not quiet:
        print(f"\nMap: {out}")


def _surface_verdict(description: "SurfaceDescription") -> str:
    measured, parameters = description.measured, description.parameters
    (nx, ny), (dx, dy) = measured.grid.cells, measured.grid.spacing
    what = f"Sq {1e6 * parameters.sq:.3g} um, {nx} x {ny} cells of {1e6 * dx:.4g} x {1e6 * dy:.4g} um"
    if measured.uniform is not None:
        what = f"profile, Rq {1e6 * parameters.sq:.3g} um, {nx} points every {1e6 * dx:.4g} um"
    return f"{description.path}: {what}, {100 * measured.missing:.2g} % missing."


def _print_surface(description: "SurfaceDescription") -> None:
    measured = description.measured
    width, height = measured.grid.extent
    size = f"{1e6 * width:.4g} um" if measured.uniform is not None else f"{1e6 * width:.4g} x {1e6 * height:.4g} um"
    rows = [("format", measured.format), ("size", size)]
    rows += _areal_rows(description) if description.profile is None else _profile_rows(description)
    print()
    print_rows(rows)
    for step in (*description.steps, *measured.notes):
        print(f"  note: {step}")


def _areal_rows(description: "SurfaceDescription") -> list[tuple[str, str]]:
    found = description.parameters
    bound = " (at most: the lay outlasts half the map)" if found.str_bounded else ""
    return [
        ("Sa, Sq", f"{1e6 * found.sa:.4g}, {1e6 * found.sq:.4g} um"),
        ("Ssk, Sku", f"{found.ssk:.3g}, {found.sku:.3g}"),
        ("Sp, Sv, Sz", f"{1e6 * found.sp:.4g}, {1e6 * found.sv:.4g}, {1e6 * found.sz:.4g} um"),
        ("Sdq, Sdr", f"{found.sdq:.3g}, {100 * found.sdr:.3g} %"),
        ("Sal, Str", f"{1e6 * found.sal:.3g} um, {found.str_:.3g}{bound}"),
        ("Sk, Spk, Svk", f"{1e6 * found.sk:.4g}, {1e6 * found.spk:.4g}, {1e6 * found.svk:.4g} um"),
        ("Smr1, Smr2", f"{100 * found.smr1:.3g}, {100 * found.smr2:.3g} %"),
    ]


def _profile_rows(description: "SurfaceDescription") -> list[tuple[str, str]]:
    found = description.profile
    assert found is not None
    return [
        ("Ra, Rq", f"{1e6 * found.ra:.4g}, {1e6 * found.rq:.4g} um"),
        ("Rsk, Rku", f"{found.rsk:.3g}, {found.rku:.3g}"),
        (
            "Rp, Rv, Rz, Rt",
            f"{1e6 * found.rp:.4g}, {1e6 * found.rv:.4g}, {1e6 * found.rz:.4g}, {1e6 * found.rt:.4g} um",
        ),
        ("Rsm, Rdq", f"{'-' if found.rsm != found.rsm else f'{1e6 * found.rsm:.4g} um'}, {found.rdq:.3g}"),
        ("Rk, Rpk, Rvk", f"{1e6 * found.rk:.4g}, {1e6 * found.rpk:.4g}, {1e6 * found.rvk:.4g} um"),
        ("Rmr1, Rmr2", f"{100 * found.rmr1:.3g}, {100 * found.rmr2:.3g} %"),
    ]
