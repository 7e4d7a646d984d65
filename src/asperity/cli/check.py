"""`asperity check`: whether recordings, or a data set, are complete and usable."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import monitoring
from asperity.cli import options
from asperity.cli.app import app
from asperity.cli.options import AsJson, Quiet, contact_at
from asperity.cli.output import Block, columns, show, table, text
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.monitoring import CheckedRecording, RecordingChecks, Suitability

MAX_DETAILED = 4  # recordings up to which `check` shows every fact


@app.command()
def check(
    paths: Annotated[
        list[Path] | None, typer.Argument(metavar="FILE", help="Recordings, or folders of them.")
    ] = None,
    data_set: Annotated[
        Path | None,
        typer.Option(
            "--set",
            metavar="DIR",
            help="Check whether a folder is a complete data set for publication.",
        ),
    ] = None,
    rate: options.Rate = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    scale: options.Scale = None,
    case_file: options.Contact = None,
    band: options.Band = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Check recordings, and what they are suitable for."""
    if data_set is not None:
        if paths:
            raise BadInput(
                f"--set {data_set} takes no other recordings; its {monitoring.STATED} names them"
            )
        _show_set(data_set, as_json=as_json, quiet=quiet)
        return
    if not paths:
        raise BadInput("check needs recordings, or --set and the folder of a data set")
    checks = monitoring.check_recordings(
        paths,
        case=contact_at(case_file),
        band_hz=band,
        rate_hz=rate,
        unit=unit,
        channel=channel,
        scale=scale,
    )
    if checks.checked or as_json:
        detailed = (
            [_details(checked) for checked in checks.checked]
            if len(checks.checked) <= MAX_DETAILED
            else []
        )
        show(
            checks.verdict(),
            checks.scalars,
            [
                f"  for a resonance {text('width_hz', checks.target.width_hz)} wide "
                f"in {checks.target.source}"
            ],
            *(detailed or [_summary(checks)]),
            as_json=as_json,
            quiet=quiet,
        )
    if checks.refused:
        raise BadInput("; ".join(dict.fromkeys(reason for _, reason in checks.refused)))


def _show_set(folder: Path, *, as_json: bool, quiet: bool) -> None:
    """Show what a data set lacks; exit code 2 unless it is complete."""
    result = monitoring.check_set(folder)
    lines = [f"  missing: {sentence}" for sentence in result.missing]
    show(result.verdict(), lambda: result.scalars(), lines, as_json=as_json, quiet=quiet)
    if not result.whole:
        raise typer.Exit(2)


def _details(checked: "CheckedRecording") -> Block:
    """Yield every fact of a recording with its source."""
    recording, quality, uses = checked
    facts = recording.facts
    values = checked.scalars()
    level = ", ".join(quantity(key).number_in(values) for key in ("rms", "peak", "offset"))
    rows = [
        ("format", str(facts["format"].value)),
        (
            quantity("rate_hz").title,
            f"{text('rate_hz', recording.rate_hz)}, stated by {facts['rate'].source}",
        ),
        *(
            (name, f"{facts[name].value}, stated by {facts[name].source}")
            for name in ("unit", "scale", "sensitivity", "started")
            if name in facts
        ),
        (
            quantity("duration_s").title,
            f"{text('duration_s', quality.duration_s)}, {quality.samples} samples",
        ),
        ("rms, peak, offset", f"{level}; unit: {recording.unit}"),
    ]
    for name, use in uses.items():
        rows.append((monitoring.USES[name], f"{'yes' if use.possible else 'NO'}: {use.reason}"))
    yield f"{recording.path}, channel {recording.channel.name}: {_state(uses)}"
    yield from table(rows, quality.remarks)
    yield from (f"  fault: {fault}" for fault in quality.faults)


def _state(uses: Mapping[str, "Suitability"]) -> str:
    """Return for what a recording is good, in a few words."""
    purposes = monitoring.good_for(uses)
    if uses["contact_resonance"].possible:
        return "usable" if purposes == "all" else f"usable: {purposes}"
    return "NOT USABLE" if purposes == "nothing" else f"no contact resonance; {purposes}"


def _summary(checks: "RecordingChecks") -> Block:
    """Yield one row per recording, and each fault once."""
    selected = [quantity(key) for key in ("rate_hz", "duration_s", "rms")]
    rows: list[list[str]] = []
    holders: dict[str, list[str]] = {}
    for checked in checks.checked:
        values = checked.scalars()
        recording, quality, uses = checked
        name = f"{recording.path.name}, {values['channel']}"
        rows.append(
            [name, *(entry.number_in(values) for entry in selected), recording.unit, _state(uses)]
        )
        lacks = [
            f"{monitoring.USES[key]}: {use.reason}"
            for key, use in uses.items()
            if not use.possible and key != "contact_resonance" and use.reason not in quality.faults
        ]
        for sentence in (*quality.faults, *lacks, *quality.remarks):
            holders.setdefault(sentence, []).append(name)
    yield from columns(
        ["recording", *(entry.label for entry in selected), "unit", ""], rows, left=1
    )
    for sentence, names in holders.items():
        universal = len(names) == len(checks.checked)
        others = f" and {len(names) - 3} more" if len(names) > 3 else ""
        yield f"  note: {sentence} ({'all' if universal else '; '.join(names[:3]) + others})"
