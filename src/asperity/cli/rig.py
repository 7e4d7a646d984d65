"""`asperity rig`: recordings of a simulated wear test, with the true values."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, paper, simulation
from asperity.cli.app import app
from asperity.cli.options import AsJson, Quiet, Seed, case_at
from asperity.cli.output import Row, known_rows, progress, show, span, table
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.simulation import WearHistory


OutOption = Annotated[
    Path,
    typer.Option(
        metavar="DIR", help="Folder for recordings, table, true values and case; new or empty."
    ),
]
CaseFileOption = Annotated[
    Path | None,
    typer.Option(
        "--case",
        metavar="CASE.toml",
        help="Contact to solve at each roughness (default: the paper's trend).",
    ),
]
WornOption = Annotated[
    Path | None,
    typer.Option(
        "--wear",
        metavar="DIR",
        help="Wear simulation (folder of asperity wear --out) to record.",
    ),
]
HoursOption = Annotated[
    list[float] | None,
    typer.Option(
        metavar="H",
        help="Time of a recording of --wear (repeatable; default: --samples spread evenly).",
    ),
]
SamplesOption = Annotated[int, typer.Option(help="Number of worn rings, from Sq 0.54 to 3.49 um.")]
RepeatsOption = Annotated[int, typer.Option(help="Tests per ring.")]
DurationOption = Annotated[
    str, typer.Option(metavar="TIME", help="Duration of each recording (the paper's: 300 s).")
]
RateOption = Annotated[str, typer.Option(metavar="FREQUENCY", help="Sampling rate.")]
SnrOption = Annotated[
    float,
    typer.Option(
        metavar="DB", help="Signal-to-noise ratio of the contact's line in its band, in dB."
    ),
]
ModesOption = Annotated[int, typer.Option(help="Number of structural modes in the contact's band.")]
TrendOption = Annotated[
    str, typer.Option(help="Trend of CRF over roughness: knee, smooth or constant.")
]
FileFormatOption = Annotated[
    str, typer.Option("--format", help="File format: h5 (with rate and unit) or wav.")
]


@app.command()
def rig(
    out: OutOption,
    case_file: CaseFileOption = None,
    worn: WornOption = None,
    hours: HoursOption = None,
    samples: SamplesOption = 12,
    repeats: RepeatsOption = 5,
    duration: DurationOption = "10 s",
    rate: RateOption = "20 kHz",
    snr: SnrOption = 10.0,
    modes: ModesOption = 4,
    trend: TrendOption = "knee",
    file_format: FileFormatOption = "h5",
    seed: Seed = 7,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the recordings of a wear test, with true values."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise BadInput(f"--out {out} exists and is not an empty folder; name a new one")
    history = _wear(worn, hours, case_file)
    with progress("rig", "simulating ...", quiet=quiet) as display:
        simulated = paper.simulate_rig(
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
            simulated,
            out,
            file_format=file_format,  # type: ignore[arg-type]
            progress=lambda done, total: display(
                f"{done} of {total} recordings written", done, total
            ),
        )
    _show(simulated, out, paths, as_json=as_json, quiet=quiet)


def _show(
    simulated: "paper.Rig", out: Path, paths: Sequence[Path], *, as_json: bool, quiet: bool
) -> None:
    files = {"table": out / "table.csv", "truth": out / "truth.csv", "case": out / "rig.toml"}
    show(
        paper.rig_verdict(simulated),
        lambda: {
            **paper.rig_scalars(simulated),
            "folder": str(out),
            "recordings": [str(path) for path in paths],
            **{name: str(path) for name, path in files.items()},
        },
        table(_rows(simulated, out)),
        [f"Try next: asperity track {out} --table {files['table']} --case {files['case']}"],
        as_json=as_json,
        quiet=quiet,
    )


def _rows(simulated: "paper.Rig", out: Path) -> list[Row]:
    shafts = " and ".join(f"{speed:g}" for speed in simulated.shaft_hz)
    noise = (
        f"{simulated.disturbance.snr_db:g} dB, {simulated.disturbance.modes} structural modes, "
        f"shafts at {shafts} Hz, mains"
    )
    return [
        (quantity("band_hz").title, span("band_hz", simulated.band_hz)),
        *known_rows({"full_load_crf_hz": simulated.full_load_crf_hz}),
        ("SNR in that band", noise),
        ("truth", str(out / "truth.csv")),
    ]


def _wear(
    worn: Path | None, hours: list[float] | None, case_file: Path | None
) -> "WearHistory | None":
    """Load the wear history to record, if any."""
    if worn is None and hours:
        raise BadInput(f"--hours {hours[0]:g} applies to a wear history; name one with --wear")
    if worn is not None and case_file is not None:
        raise BadInput(f"--wear {worn} has a case of its own; leave --case {case_file} out")
    return None if worn is None else simulation.load_wear(worn)
