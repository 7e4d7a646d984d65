"""`asperity surface`: contents and parameters of measured surfaces."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from asperity import case, report, surface
from asperity.cli.app import app
from asperity.cli.options import AsJson, LateralUnit, Quiet, Unit, require_output
from asperity.cli.output import Block, Row, known_rows, show, table, written
from asperity.core.errors import BadInput
from asperity.core.quantities import select

if TYPE_CHECKING:
    from asperity.surface import SurfaceDescription


FilesArgument = Annotated[list[Path], typer.Argument(metavar="FILE", help="Measured surfaces.")]
OutMap = Annotated[
    Path | None, typer.Option("--out", metavar="PNG", help="File for the map of the heights.")
]
PixelOption = Annotated[
    str | None,
    typer.Option(metavar="LENGTH", help="Sample spacing of a bare matrix, such as '1.6 um'."),
]
FormOption = Annotated[
    str,
    typer.Option(help="Form to remove: none, plane, quadratic, cubic, quartic or cylinder."),
]
TurnOption = Annotated[
    bool, typer.Option("--turn", help="Rotate by 90 degrees: x of the file becomes y.")
]
OutliersOption = Annotated[
    str, typer.Option(help="Heights far from their neighbours: keep or remove.")
]
SFilterOption = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH", help="Remove shorter waves (ISO 16610 Gaussian), such as '5 um'."
    ),
]
LFilterOption = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH", help="Remove longer waves (ISO 16610 Gaussian), such as '0.25 mm'."
    ),
]


@app.command("surface")
def surface_command(
    files: FilesArgument,
    out: OutMap = None,
    unit: Unit = None,
    lateral_unit: LateralUnit = None,
    pixel: PixelOption = None,
    form: FormOption = "quadratic",
    turn: TurnOption = False,
    outliers: OutliersOption = "keep",
    s_filter: SFilterOption = None,
    l_filter: LFilterOption = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Describe surface files: size, missing data, parameters."""
    require_output(out, ".png")
    if out is not None and len(files) > 1:
        raise BadInput(
            f"--out {out} holds one map, got {len(files)} surfaces; plot them one at a time"
        )
    described, refused = _describe(
        files,
        unit=unit,
        lateral_unit=lateral_unit,
        pixel=_length("--pixel", pixel),
        conditioning=surface.SurfaceConditioning(
            form=cast("surface.Form", form),
            turn=turn,
            outliers=cast("surface.Outliers", outliers),
            s_filter=_length("--s-filter", s_filter),
            l_filter=_length("--l-filter", l_filter),
        ),
    )
    if out is not None and described:
        report.surface_map(described[0], out)
    if described:
        show(
            [description.verdict() for description in described],
            lambda: {
                "files": [description.scalars() for description in described],
                "refused": [{"file": str(file), "reason": str(error)} for file, error in refused],
            },
            *(_parameters(description, named=len(described) > 1) for description in described),
            written("Map", out),
            as_json=as_json,
            quiet=quiet,
        )
    if refused:
        raise BadInput("; ".join(dict.fromkeys(str(error) for _, error in refused)))


def _length(option: str, text: str | None) -> float | None:
    return None if text is None else case.read_length(option, text)


def _describe(
    files: list[Path],
    *,
    unit: str | None,
    lateral_unit: str | None,
    pixel: float | None,
    conditioning: "surface.SurfaceConditioning",
) -> "tuple[list[SurfaceDescription], list[tuple[Path, BadInput]]]":
    """Describe every file; return those that were refused with the reason."""
    described: list[SurfaceDescription] = []
    refused: list[tuple[Path, BadInput]] = []
    for file in files:
        try:
            described.append(
                surface.describe_surface(
                    file,
                    unit=unit,
                    lateral_unit=lateral_unit,
                    pixel=pixel,
                    conditioning=conditioning,
                )
            )
        except BadInput as error:
            refused.append((file, error))
    return described, refused


def _parameters(description: "SurfaceDescription", *, named: bool) -> Block:
    """Return the parameters of a map or profile, and its processing steps."""
    if named:
        yield str(description.path)
    values = description.scalars()
    measured = description.measured
    of_map = description.profile is None
    size = (
        surface.area_text(measured.grid.extent)
        if of_map
        else surface.length_text(measured.grid.extent[0])
    )
    rows: list[Row] = [("format", measured.format), ("size", size)]
    if of_map:
        rows.append(("orientation", f"rolling along {description.levelled.rolling_along}"))
    profile = () if of_map else map(description.symbol, select("profile"))
    rows += (
        known_rows(values, "film", "surface")
        if of_map
        else [(entry.title, entry.text_in(values["profile"])) for entry in profile]
    )
    bound = "Str is an upper bound: the lay extends over half the map"
    bounded = [bound] if of_map and description.parameters.str_bounded else []
    steps = map(surface.step_sentence, (*bounded, *description.steps, *measured.notes))
    yield from table(rows, steps)
