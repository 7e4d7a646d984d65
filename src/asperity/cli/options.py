"""The options that commands share, each declared once; and what is made of them before the work begins."""

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from asperity import case, results, trend
from asperity.core import files
from asperity.core.errors import BadInput, require_choice

if TYPE_CHECKING:
    from asperity.case import Case, MachineCase


def _hertz(text: str) -> float:
    """A frequency as a bare number of hertz, or with its unit."""
    try:
        return float(text)
    except ValueError:
        return case.read_amount("a frequency", "Hz", text)


def _stage_source(text: str) -> str:
    """What stages are read from, refused before a file is."""
    require_choice("--stages-from", text, get_args(trend.StageSource))
    return text


def _rate_of_alarms(text: str) -> float:
    """Alarms a recording: a share such as 0.001 or 1/1000, or recordings for one alarm."""
    try:
        rate = float(Fraction(str(text)))
    except (ValueError, ZeroDivisionError):
        raise BadInput(
            f"--false-alarms must be a rate such as 0.001 or 1/1000, got {text!r}"
        ) from None
    return 1.0 / rate if rate >= 1.0 else rate


CaseOrRun = Annotated[
    Path, typer.Argument(metavar="CASE.toml|RUN.nc", help="A case file, or a kept run.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the case, contact.load='400 N'; repeat.",
    ),
]
Accuracy = Annotated[
    float | None,
    typer.Option(
        metavar="SHARE",
        help="Choose the cells for films this accurate, such as 0.01, whatever the case has.",
    ),
]
SurfaceFile = Annotated[
    Path | None,
    typer.Option(
        "--surface", metavar="FILE", help="A measured surface in place of the case's own."
    ),
]
Preset = Annotated[
    str | None,
    typer.Option(help="sound or paper, in place of the case's; --table1 takes paper by default."),
]

OutFolder = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", help="Folder to keep everything in; goes on from what it holds."
    ),
]
OutPicture = Annotated[Path | None, typer.Option("--out", metavar="PNG", help="Draw the result.")]
Page = Annotated[
    Path | None,
    typer.Option("--report", metavar="OUT.html", help="Make one self-contained HTML page too."),
]
StudyFigures = Annotated[
    Path | None,
    typer.Option(
        "--figures",
        metavar="DIR",
        help="Of a study: its figures as PDF and PNG, its tables as csv.",
    ),
]

Workers = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Processes that work at once; default: all processors."),
]
Roughness = Annotated[
    list[str] | None,
    typer.Option("--sq", metavar="LENGTH", help="At this roughness; may be repeated."),
]
Cells = Annotated[
    int, typer.Option(metavar="N", min=8, help="Cells along each axis of the widest domain.")
]
Seeds = Annotated[
    int, typer.Option(metavar="N", min=1, help="Surfaces that each point is the mean of.")
]
SampleSeed = Annotated[int, typer.Option(metavar="SEED", min=0, help="Of all that is drawn.")]

RecordingFiles = Annotated[
    list[Path], typer.Argument(metavar="FILE...", help="Recordings, or folders of them.")
]
Rate = Annotated[
    float | None,
    typer.Option(
        metavar="HZ", parser=_hertz, help="Sampling rate, for files that do not state it."
    ),
]
Unit = Annotated[
    str | None,
    typer.Option(
        help="Unit of the values, such as g or, of heights, um, for files that do not state it."
    ),
]
LateralUnit = Annotated[
    str | None, typer.Option(help="Unit of x and y, for a file that names none.")
]
Channel = Annotated[
    str | None,
    typer.Option(help="Name or number of the channel, where files have several; a,b: two sensors."),
]
Scale = Annotated[
    float | None,
    typer.Option(
        help="What a stored 1 stands for, in the unit: g at full scale of a wav, g per volt."
    ),
]
Contact = Annotated[
    Path | None,
    typer.Option(
        "--case", metavar="CASE.toml", help="The contact: where to look, and load shares."
    ),
]
Band = Annotated[
    tuple[float, float] | None,
    typer.Option(metavar="LOW HIGH", help="Where to look [Hz], instead of the case's band."),
]
Table = Annotated[
    Path | None,
    typer.Option(
        "--table",
        metavar="CSV",
        help="Columns file, x (such as sq_um), sq_um_std, load_n, speed_hz.",
    ),
]
Shaft = Annotated[
    list[float] | None,
    typer.Option(metavar="HZ", help="Shaft speed whose harmonics to remove; found if not given."),
]
StagesFrom = Annotated[
    str,
    typer.Option(
        metavar="INDICATOR",
        parser=_stage_source,
        help="What decides stage and alarm: crf, damping or both; all are told.",
    ),
]
FalseAlarms = Annotated[
    float,
    typer.Option(
        metavar="RATE",
        parser=_rate_of_alarms,
        help="Alarms a recording without wear, such as 0.001 or 1/1000 (the same: 1000).",
    ),
]
Acknowledge = Annotated[
    str | None,
    typer.Option(
        metavar="RECORDING",
        help="Somebody has looked, up to this recording or 'last': begin anew behind it.",
    ),
]
StoreFile = Annotated[
    Path | None,
    typer.Option(
        "--store",
        metavar="DB",
        help="One SQLite file for recordings and judgements; several may share it.",
    ),
]
Machine = Annotated[
    str | None, typer.Option(metavar="NAME", help="Whose recordings these are, in the store.")
]
Point = Annotated[
    str | None, typer.Option(metavar="NAME", help="Measuring point on it; by default the folder.")
]
SensorName = Annotated[
    str | None,
    typer.Option(
        "--sensor",
        metavar="NAME",
        help="Sensor there; by default as sidecar, table or channel names it.",
    ),
]
OnAlarm = Annotated[
    str | None,
    typer.Option(
        metavar="CMD",
        envvar="ASPERITY_ON_ALARM",
        help="Run this at every change of state, without a shell; it gets JSON on its stdin.",
    ),
]
WebHook = Annotated[
    str | None,
    typer.Option(
        "--webhook",
        metavar="URL",
        envvar="ASPERITY_WEBHOOK",
        help="Post JSON there at every change of state.",
    ),
]
Mqtt = Annotated[
    str | None,
    typer.Option(
        envvar="ASPERITY_MQTT",
        metavar="URL",
        help="Publish JSON at mqtt://HOST/TOPIC at every change of state.",
    ),
]
Tell = Annotated[
    str | None,
    typer.Option(
        metavar="STATES",
        help="Of which changes: such as alarm,blind, and their end; all of them, unless given.",
    ),
]
ForecastLimit = Annotated[
    str | None,
    typer.Option(
        "--forecast", metavar="LIMIT", help="When clr=0.5, or sq='2 um', is crossed; of a series."
    ),
]
Worn = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Folder of asperity wear: its drift of Sq is what is expected."
    ),
]
EmulatorFolder = Annotated[
    Path | None,
    typer.Option(
        "--emulator", metavar="DIR", help="Folder of the emulator; else one in the user's cache."
    ),
]
Method = Annotated[str | None, typer.Option(help="joint, modes, likelihood or peak (the paper's).")]

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print the verdict only, and no progress.")
]


def chosen_case(
    path: Path,
    overrides: list[str] | None,
    surface: Path | None = None,
    accuracy: float | None = None,
) -> "Case":
    """The case of a case file or a run, with a measured surface, `--set KEY=VALUE` values and an accuracy put in."""
    chosen = results.load_run(path).case if path.suffix == ".nc" else case.load_case(path)
    if surface is not None:
        files.require_file(surface)
        chosen = chosen.with_overrides(
            {"surface": {"file": case.relative_path(surface, chosen.folder)}}
        )
    replaced: dict[str, object] = {}
    if accuracy is not None:
        replaced = {"grid.cells": "auto", "grid.accuracy": accuracy}
    replaced |= read_overrides(overrides)
    return chosen.with_overrides(replaced) if replaced else chosen


def read_overrides(overrides: list[str] | None) -> dict[str, object]:
    """Keys and values of `--set KEY=VALUE`."""
    replaced: dict[str, object] = {}
    for override in overrides or []:
        key, equals, value = override.partition("=")
        if not (equals and key.strip() and value.strip()):
            raise BadInput(f"--set takes KEY=VALUE such as contact.load='400 N', got {override!r}")
        replaced[key.strip()] = value.strip()
    return replaced


def case_at(path: Path | None) -> "Case | None":
    """The case of a case file, if one was given."""
    return None if path is None else case.load_case(path)


def contact_at(path: Path | None) -> "Case | MachineCase | None":
    """The case of a contact or a machine, if one was given."""
    if path is None:
        return None
    return case.load_machine(path) if case.has_machine(path) else case.load_case(path)


def lengths(option: str, texts: list[str] | None) -> list[float] | None:
    """Lengths given as an option that may be repeated [m]; None where it was not given."""
    return [case.read_length(option, text) for text in texts] if texts else None


_FLAGS = {  # what a message of the library asks for, and the option that gives it
    "give rate_hz": "give --rate",
    "give scale": "give --scale",
    "give case or band_hz": "give --case or --band",
    "; method modes": "; --method modes",
    "such as um and mm": "such as --unit um --lateral-unit mm",
    "ask for a dry run": "take --dry-run",
    "choose another out": "choose another --out",
}


def with_flags(message: str) -> str:
    """A message of the library with options in place of the arguments that it names."""
    for argument, option in _FLAGS.items():
        message = message.replace(argument, option)
    return message


def require_output(path: Path | None, *suffixes: str, option: str = "--out") -> None:
    """BadInput unless a path that is given has a suffix and can be written to: asked before the work, not after."""
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        *most, last = suffixes
        allowed = f"{', '.join(most)} or {last}" if most else last
        raise BadInput(f"{option} must be a file that ends in {allowed}, got {path}")
    files.require_writable(path)
