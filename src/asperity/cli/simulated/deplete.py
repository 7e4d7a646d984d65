"""`asperity deplete`: film of a contact that passes its track again and again."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, results
from asperity.cli.app import app
from asperity.cli.options import AsJson, Overrides, Quiet, chosen_case, read_overrides
from asperity.cli.output import Block, columns, progress, show
from asperity.core.errors import BadInput

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.results import TrackDepletion

PathArgument = Annotated[
    Path, typer.Argument(metavar="CASE.toml", help="Case of a contact or a machine, with [inlet].")
]
PassesOption = Annotated[
    int | None, typer.Option(metavar="N", help="Number of passes (default: the case's, 20).")
]


@app.command()
def deplete(
    path: PathArgument,
    passes: PassesOption = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute the film of repeated passes with little oil.

    For grease, state its base oil, the layer left on the track and the oil that it bleeds.
    """
    chosen, interval = _chosen(path, overrides)
    with progress(path.name, "the flooded contact ...", quiet=quiet) as display:
        result = results.deplete_case(
            chosen,
            passes=passes,
            interval=interval,
            progress=lambda done, total: display(f"pass {done} of {total}", done, total),
        )
    show(result.verdict(), result.scalars, _rows(result), as_json=as_json, quiet=quiet)


def _chosen(path: Path, overrides: list[str] | None) -> "tuple[Case, float | None]":
    """Return the case, of a machine that of its most heavily loaded contact, and its interval.

    The interval of a machine is the time between two passages of a point of the first body.
    """
    if not case.has_machine(path):
        return chosen_case(path, overrides), None
    machine = case.load_machine(path, read_overrides(overrides))
    if not machine.complete or "inlet" not in machine.tables:
        raise BadInput(f"{path}: depletion needs [lubricant], [surface] and [inlet]; add them")
    moving = [contact for contact in machine.contacts if not contact.stands_still]
    worst = max(moving, key=lambda contact: contact.load)
    chosen = machine.case(worst)
    inlet = chosen.contents.inlet
    stated = None if inlet is None else inlet.interval
    return chosen, 1.0 / worst.overrolling_hz[0] if stated is None else None


def _rows(result: "TrackDepletion") -> Block:
    """Return a row per pass, with films over those of the flooded contact."""
    central, least = result.flooded
    yield from columns(
        ["pass", "layer [µm]", "h central [µm]", "of flooded [%]", "h min [µm]", "of flooded [%]"],
        [
            [
                str(row.number),
                f"{1e6 * row.layer:.3f}",
                f"{1e6 * row.h_central:.3f}",
                f"{100.0 * row.h_central / central:.0f}",
                f"{1e6 * row.h_min:.3f}",
                f"{100.0 * row.h_min / least:.0f}",
            ]
            for row in result.passes
        ],
    )
