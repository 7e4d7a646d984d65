"""`asperity rig`: recordings of a simulated wear test, with the truth beside them."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, paper, simulation
from asperity.cli.app import app
from asperity.cli.options import AsJson, Quiet, case_at
from asperity.cli.output import Row, known, progress, show, span, table
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.simulation import WearHistory


@app.command()
def rig(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="New folder for recordings, table, truth and case.")
    ],
    case_file: Annotated[
        Path | None,
        typer.Option(
            "--case",
            metavar="CASE.toml",
            help="Solve this contact at each roughness, in place of the paper's trend.",
        ),
    ] = None,
    worn: Annotated[
        Path | None,
        typer.Option(
            "--wear",
            metavar="DIR",
            help="Record the contact that asperity wear --out kept, as it wears.",
        ),
    ] = None,
    hours: Annotated[
        list[float] | None,
        typer.Option(
            metavar="H",
            help="With --wear: record it after so long; repeat. Else --samples over all of it.",
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Worn rings, from Sq 0.54 to 3.49 um.")] = 12,
    repeats: Annotated[int, typer.Option(help="Tests of each ring.")] = 5,
    duration: Annotated[
        str, typer.Option(metavar="TIME", help="Of each recording; the paper's are 300 s.")
    ] = "10 s",
    rate: Annotated[str, typer.Option(metavar="FREQUENCY", help="Sampling rate.")] = "20 kHz",
    snr: Annotated[
        float,
        typer.Option(
            metavar="DB", help="Power of the contact's line over all else in its band, in dB."
        ),
    ] = 10.0,
    modes: Annotated[int, typer.Option(help="Structural modes in the contact's band.")] = 4,
    trend: Annotated[
        str, typer.Option(help="CRF over roughness: knee, smooth or constant.")
    ] = "knee",
    file_format: Annotated[
        str, typer.Option("--format", help="h5 (rate and unit in the file) or wav.")
    ] = "h5",
    seed: Annotated[int, typer.Option(help="Of everything drawn.")] = 7,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the paper's wear test: recordings to try asperity track on, and the truth to judge it by."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise BadInput(f"--out {out} is there already and not an empty folder; name a new one")
    history = _wear(worn, hours, case_file)
    with progress("rig", "simulating ...", quiet=quiet) as display:
        made = paper.simulate_rig(
            paper.RigSettings(
                samples=samples,
                repeats=repeats,
                duration_s=case.read_amount("--duration", "s", duration),
                rate_hz=case.read_amount("--rate", "Hz", rate),
                trend=trend,  # type: ignore[arg-type]
                seed=seed,
            ),
            disturbance=paper.Disturbance(snr_db=snr, modes=modes),
            case=case_at(case_file) if history is None else history.case,
            moments=None if history is None else history.moments(hours, samples),
        )
        paths = paper.write_rig(
            made,
            out,
            file_format=file_format,  # type: ignore[arg-type]
            progress=lambda done, total: display(
                f"{done} of {total} recordings written", done, total
            ),
        )
    show(
        paper.rig_verdict(made),
        lambda: {
            **paper.rig_scalars(made),
            "folder": str(out),
            "recordings": [str(path) for path in paths],
            "table": str(out / "table.csv"),
            "truth": str(out / "truth.csv"),
            "case": str(out / "rig.toml"),
        },
        table(_rows(made, out)),
        [f"Try next: asperity track {out} --table {out / 'table.csv'} --case {out / 'rig.toml'}"],
        as_json=as_json,
        quiet=quiet,
    )


def _rows(made: "paper.Rig", out: Path) -> list[Row]:
    shafts = " and ".join(f"{speed:g}" for speed in made.shaft_hz)
    beside = f"{made.disturbance.snr_db:g} dB, {made.disturbance.modes} structural modes, shafts at {shafts} Hz, mains"
    return [
        (quantity("band_hz").title, span("band_hz", made.band_hz)),
        *known({"full_load_crf_hz": made.full_load_crf_hz}),
        ("SNR in that band", beside),
        ("truth", str(out / "truth.csv")),
    ]


def _wear(
    worn: Path | None, hours: list[float] | None, case_file: Path | None
) -> "WearHistory | None":
    """The wear history that is to be recorded, if any."""
    if worn is None and hours:
        raise BadInput(f"--hours {hours[0]:g} is a moment of a wear history; name one with --wear")
    if worn is not None and case_file is not None:
        raise BadInput(f"--wear {worn} brings its own case along; leave --case {case_file} out")
    return None if worn is None else simulation.load_wear(worn)
