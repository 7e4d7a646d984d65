"""`asperity observe`: modes of a machine structure with the contact, as a sensor sees them."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import report, results, structure
from asperity.cli.app import app
from asperity.cli.options import AsJson, Overrides, Quiet, chosen_case
from asperity.cli.output import Block, columns, show, solver_progress
from asperity.core import files

if TYPE_CHECKING:
    from asperity.results import SensorView


@app.command()
def observe(
    path: Annotated[Path, typer.Argument(metavar="CASE.toml", help="Case file, or saved run.")],
    structure_file: Annotated[
        Path | None,
        typer.Option(
            "--structure",
            metavar="FILE|NAME",
            help="Structure without its contact: bodies, matrices, modes or measured receptances, "
            "or a built-in one: fzg-gears, paper-rig, roller-bearing, twin-disc (default: "
            "the mass of [vibration] alone).",
        ),
    ] = None,
    resolution: Annotated[
        float, typer.Option(help="Relative resolution of a frequency; 0.001 is 0.1 %.")
    ] = 0.001,
    figures: Annotated[
        Path | None,
        typer.Option(
            "--figures", metavar="DIR", help="Folder for response.png: sensor over roughness."
        ),
    ] = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute whether a sensor on a machine can see the contact.

    Modes with the contact, its share of their strain energy, and their shift as the roughness
    wears.
    """
    named = None if structure_file is None else structure.load_structure(structure_file)
    case = chosen_case(path, overrides)
    with solver_progress("observe", quiet=quiet) as progress:
        view = results.observe_contact(case, named, resolution=resolution, progress=progress)
    drawn = [] if figures is None else [_draw(view, figures)]
    show(
        view.verdict(),
        lambda: view.scalars() | {"figures": drawn},
        _rows(view),
        as_json=as_json,
        quiet=quiet,
    )


def _draw(view: "SensorView", folder: Path) -> str:
    """Draw the response of the sensor; return the path of the figure."""
    files.make_folder(folder)
    return str(report.write_figure(report.draw_result(view), folder / "response.png"))


def _rows(view: "SensorView") -> Block:
    """Return a row per mode."""
    rows = [
        [
            f"{observed.mode.frequency_hz:.1f}",
            f"{observed.mode.damping_ratio:.4f}",
            f"{100.0 * observed.mode.contact_share:.1f}",
            f"{100.0 * observed.movement:.3f}",
            "" if (shift := observed.shift_per_clr) is None else f"{shift:+.3f}",
            "" if (level := observed.amplitude_at_sensor) is None else f"{level:.3g}",
            "" if (noise := view.noise_at(observed)) is None else f"{noise:.3g}",
        ]
        for observed in view.modes
    ]
    heads = [
        "mode [Hz]",
        "damping ratio",
        "contact share [%]",
        "movement [%]",
        "shift per CLR",
        "at sensor [m/s²/√Hz]",
        "noise",
    ]
    if rows:
        yield from columns(heads, rows)
