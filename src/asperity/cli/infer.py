"""`asperity infer`: what recordings say of a contact, and what to run next."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from asperity import inference, processes, report
from asperity.cli import options
from asperity.cli.app import app
from asperity.cli.options import AsJson, Overrides, Page, Quiet, chosen_case, require_output
from asperity.cli.show import Block, columns, progress, show, table, written
from asperity.errors import BadInput, require_choice
from asperity.quantities import quantity

if TYPE_CHECKING:
    from asperity.inference import Emulator, Inference, Sampler, Setting
    from asperity.study import StudyProgress
    from asperity.wear import SeriesMethod

EMULATING = "the emulator's contacts; once for a case, and kept ..."


@app.command()
def infer(
    paths: Annotated[
        list[Path] | None, typer.Argument(metavar="[FILE...]", help="Recordings, or folders of them.")
    ] = None,
    case_file: Annotated[
        Path | None,
        typer.Option("--case", metavar="CASE.toml", help="The contact; its [infer] says what is not known."),
    ] = None,
    overrides: Overrides = None,
    table_file: Annotated[
        Path | None,
        typer.Option("--table", metavar="CSV", help="Columns file, load_n, entrainment_m_s, temperature_degc."),
    ] = None,
    emulator: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the emulator; else one in the user's cache.")
    ] = None,
    sampler: Annotated[str, typer.Option(help="importance, or nested (dynesty), which takes minutes.")] = "importance",
    seed: Annotated[int, typer.Option(metavar="SEED", min=0, help="Of all that is drawn.")] = 0,
    rate: options.Rate = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    scale: options.Scale = None,
    band: options.Band = None,
    shaft: options.Shaft = None,
    method: options.Method = None,
    workers: options.Workers = None,
    page: Page = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what recordings tell of a contact, with intervals, what they cannot tell, and what to run next."""
    if case_file is None or not paths:
        lacks = "the contact; give --case CASE.toml" if case_file is None else "recordings; name files, or their folder"
        raise BadInput(f"asperity infer needs {lacks}")
    require_choice("--sampler", sampler, inference.SAMPLERS)
    chosen = chosen_case(case_file, overrides)
    setting = inference.setting_of(chosen)
    require_output(page, ".html", option="--report")
    count = workers or processes.cores()
    with progress("recordings", "reading recordings ...", quiet=quiet):
        heard = inference.listen(
            paths,
            setting,
            table=table_file,
            band_hz=band,
            rate_hz=rate,
            unit=unit,
            channel=channel,
            scale=scale,
            shaft_hz=shaft or None,
            method=cast("SeriesMethod | None", method),
            workers=count,
        )
    emulated = _emulated(setting, emulator, count, quiet=quiet)
    found = inference.infer_observations(
        setting,
        emulated,
        heard.observations,
        sampler=cast("Sampler", sampler),
        seed=seed,
        silent=heard.silent,
        notes=heard.notes,
    )
    blocks = (_told(found), _points(found), _models(found), _notes(found))
    if page is not None:
        report.write_inference_report(found, page)
    told = {"report": None if page is None else str(page)}
    show(
        found.verdict(), lambda: found.scalars() | told, *blocks, written("report", page), as_json=as_json, quiet=quiet
    )


def _emulated(setting: "Setting", folder: Path | None, workers: int, *, quiet: bool) -> "Emulator":
    """The emulator, and on a terminal how far it is."""
    with progress("emulator", EMULATING, quiet=quiet) as display:

        def step(state: "StudyProgress") -> None:
            left = state.seconds_left
            rest = "" if left is None else f", {left:.0f} s left"
            display(f"{state.kept + state.done} of {state.total} contacts{rest}", state.kept + state.done, state.total)

        return inference.build_emulator(setting, folder=folder, workers=workers, progress=step)


def _told(found: "Inference") -> Block:
    """A row a quantity: median, interval with and without the law's error, bits learned."""
    exact, rows = found.posterior(discrepancy=False), []
    for key, one in found.posterior().items():
        entry = quantity(key)
        rows.append(
            [
                entry.title,
                entry.number(one.median),
                entry.interval(one.low, one.high),
                entry.interval(exact[key].low, exact[key].high),
                quantity("information_bits").number(one.information_bits),
                "" if one.learnt else "as assumed",
            ]
        )
    point = found.forward.points[0]
    place = (
        f"at {quantity('load_n').text(point.load_n)}, {quantity('entrainment_speed_m_s').text(point.entrainment_m_s)}"
    )
    yield from columns([place, "median", "90 %", "90 %, laws exact", "bits", ""], rows, left=1)


def _points(found: "Inference") -> Block:
    """A row an operating point that was recorded."""
    rows = []
    for one in found.at_points():
        clr, film = one.state["clr"], one.state["h_mean_m"]
        stage, probability = max(one.stages.items(), key=lambda entry: entry[1])
        rows.append(
            [
                quantity("load_n").number(one.point.load_n),
                quantity("entrainment_speed_m_s").number(one.point.entrainment_m_s),
                str(len(one.point.names)),
                quantity("clr").interval(clr.low, clr.high),
                quantity("h_mean_m").interval(film.low, film.high),
                f"{stage} ({probability:.2f})",
            ]
        )
    if rows:
        yield from columns(["F [N]", "u [m/s]", "recordings", "CLR, 90 %", "film, 90 %", "stage"], rows, left=0)


def _notes(found: "Inference") -> Block:
    """What makes intervals doubtful, what was taken for granted, how good the emulator is."""
    return table([], (*found.warnings(), *found.notes, found.emulator.sentence()))


def _models(found: "Inference") -> Block:
    """A row a model: law, with or without its error, evidence and probability."""
    rows = [
        [
            model.law,
            "with its error" if model.discrepancy else "exact",
            quantity("log_evidence").number(model.log_evidence, model.log_evidence_std),
            quantity("model_probability").text(model.probability),
        ]
        for model in found.models
    ]
    yield from columns(["law of the spring", "", "ln evidence", "probability"], rows, left=2)
