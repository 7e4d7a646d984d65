"""`asperity rig`: recordings of a simulated wear test, with the truth beside them."""

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import print_json, print_rows
from asperity.errors import BadInput


@app.command()
def rig(
    out: Annotated[Path, typer.Option(metavar="DIR", help="New folder for recordings, table, truth and case.")],
    case: Annotated[
        Path | None,
        typer.Option(metavar="CASE.toml", help="Solve this contact at each roughness, in place of the paper's trend."),
    ] = None,
    samples: Annotated[int, typer.Option(help="Worn rings, from Sq 0.54 to 3.49 um.")] = 12,
    repeats: Annotated[int, typer.Option(help="Tests of each ring.")] = 5,
    duration: Annotated[str, typer.Option(metavar="TIME", help="Of each recording; the paper's are 300 s.")] = "10 s",
    rate: Annotated[str, typer.Option(metavar="FREQUENCY", help="Sampling rate.")] = "20 kHz",
    snr: Annotated[
        float, typer.Option(metavar="DB", help="Power of the contact's line over all else in its band, in dB.")
    ] = 10.0,
    modes: Annotated[int, typer.Option(help="Structural modes in the contact's band.")] = 4,
    trend: Annotated[str, typer.Option(help="CRF over roughness: knee, smooth or constant.")] = "knee",
    file_format: Annotated[str, typer.Option("--format", help="h5 (rate and unit in the file) or wav.")] = "h5",
    seed: Annotated[int, typer.Option(help="Of everything drawn.")] = 7,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the paper's wear test: recordings to try asperity track on, and the truth to judge it by."""
    from rich.console import Console

    from asperity.case import load_case, read_amount
    from asperity.paper import Disturbance, simulate_rig, write_rig

    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise BadInput(f"--out {out} is there already and not an empty folder; name a new one")
    console = Console(stderr=True)
    shown = console.is_terminal and not quiet
    with console.status("simulating the rig ...") if shown else nullcontext() as status:
        made = simulate_rig(
            samples=samples,
            repeats=repeats,
            duration_s=read_amount("--duration", "s", duration),
            rate_hz=read_amount("--rate", "Hz", rate),
            disturbance=Disturbance(snr_db=snr, modes=modes),
            trend=trend,  # type: ignore[arg-type]
            seed=seed,
            case=None if case is None else load_case(case),
        )

        def tell(written: int, of: int) -> None:
            if status is not None:
                status.update(f"{written} of {of} recordings written")

        paths = write_rig(made, out, file_format=file_format, progress=tell)  # type: ignore[arg-type]
    first, last = made.recordings[0], made.recordings[-1]
    knee = "" if made.split_sq_m is None else f", with a knee at Sq {made.split_sq_m * 1e6:g} um"
    ends = " to ".join(f"{one.crf_hz:.0f} Hz at Sq {one.sq_m * 1e6:.2f} um" for one in (first, last))
    length = f"{first.duration_s:g} s at {first.rate_hz:g} Hz"
    verdict = f"{len(paths)} recordings of {length}: true CRF from {ends}{knee}."
    if as_json:
        print_json(
            {
                "verdict": verdict,
                "folder": str(out),
                "recordings": [str(path) for path in paths],
                "table": str(out / "table.csv"),
                "truth": str(out / "truth.csv"),
                "case": str(out / "rig.toml"),
                "band_hz": list(made.band_hz),
                "full_load_crf_hz": made.full_load_crf_hz,
                "split_sq_m": made.split_sq_m,
                "snr_db": snr,
            }
        )
        return
    print(verdict)
    if quiet:
        return
    low, high = made.band_hz
    shafts = " and ".join(f"{speed:g}" for speed in made.shaft_hz)
    print()
    print_rows(
        [
            ("contact's band", f"{low:.0f} to {high:.0f} Hz"),
            ("all load on asperities", f"{made.full_load_crf_hz:.1f} Hz"),
            ("SNR in that band", f"{snr:g} dB, {modes} structural modes, shafts at {shafts} Hz, mains"),
            ("truth", str(out / "truth.csv")),
        ]
    )
    print(f"\nTry next: asperity track {out} --table {out / 'table.csv'} --case {out / 'rig.toml'}")
