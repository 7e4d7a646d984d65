"""Options shared by commands such as `track` and `watch`, each declared once, and their checks."""

from collections.abc import Callable
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
    """Parse a frequency as a bare number of hertz, or with its unit."""
    try:
        return float(text)
    except ValueError:
        return case.read_amount("a frequency", "Hz", text)


def duration(option: str) -> Callable[[object], float]:
    """Return the parser of a duration such as 90d, 1h or 30min [s]."""

    def parse(text: object) -> float:
        if isinstance(text, float):  # the default
            return text
        return case.read_amount(option, "s", str(text))

    return parse


def _stage_source(text: str) -> str:
    """Parse the indicators for stages; refuse unknown ones before reading files."""
    require_choice("--stages-from", text, get_args(trend.StageSource))
    return text


def _false_alarm_rate(text: str) -> float:
    """Parse false alarms per recording: 0.001 or 1/1000, or recordings per alarm."""
    try:
        rate = float(Fraction(str(text)))
    except (ValueError, ZeroDivisionError):
        raise BadInput(
            f"--false-alarms must be a rate such as 0.001 or 1/1000, got {text!r}"
        ) from None
    return 1.0 / rate if rate >= 1.0 else rate


CaseOrRun = Annotated[
    Path, typer.Argument(metavar="CASE.toml|RUN.nc", help="Case file, or saved run.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the case, such as contact.load='400 N' (repeatable).",
    ),
]
Accuracy = Annotated[
    float | None,
    typer.Option(
        metavar="SHARE",
        help="Relative accuracy of the film, such as 0.01; chooses the grid cells.",
    ),
]
StandingRoughness = Annotated[
    bool,
    typer.Option("--snapshot", help="Solve for roughness at rest instead of roughness that moves."),
]
SurfaceFile = Annotated[
    Path | None,
    typer.Option("--surface", metavar="FILE", help="Measured surface that replaces the case's."),
]

# --out takes the result of a command; the ending of a file gives its format
OutFolder = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder for the result; the same command resumes an interrupted one.",
    ),
]
OutFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--out",
        metavar="FILE",
        help="File for the result: table (.csv) or figure (.png, .pdf); repeatable.",
    ),
]
Page = Annotated[
    Path | None,
    typer.Option("--report", metavar="OUT.html", help="Write a self-contained HTML report."),
]
Figures = Annotated[
    Path | None,
    typer.Option(
        "--figures",
        metavar="DIR",
        help="Folder for the figures as PDF, 85 and 175 mm wide; of a study, tables too.",
    ),
]

Workers = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Number of parallel processes (default: all cores)."),
]
Roughness = Annotated[
    list[str] | None,
    typer.Option("--sq", metavar="LENGTH", help="Roughness Sq (repeatable)."),
]
Cells = Annotated[
    int, typer.Option(metavar="N", min=8, help="Grid cells along each axis of the widest domain.")
]
Surfaces = Annotated[int, typer.Option(metavar="N", min=1, help="Surfaces to average.")]
Seed = Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the random numbers.")]

RecordingFiles = Annotated[
    list[Path] | None,
    typer.Argument(metavar="FILE", help="Recordings, or folders of recordings."),
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
        help="Unit of the values (such as g) or heights (um), for files that do not state it."
    ),
]
LateralUnit = Annotated[
    str | None, typer.Option(help="Unit of x and y, for files that do not state it.")
]
Channel = Annotated[
    str | None,
    typer.Option(help="Name or number of the channel; a,b selects two sensors."),
]
Scale = Annotated[
    float | None,
    typer.Option(help="Value of a stored 1 in the unit, such as g at full scale or g per volt."),
]
Contact = Annotated[
    Path | None,
    typer.Option(
        "--case", metavar="CASE.toml", help="Case of the contact, for the band and load shares."
    ),
]
Band = Annotated[
    tuple[float, float] | None,
    typer.Option(metavar="LOW HIGH", help="Frequency band [Hz] (default: the case's)."),
]
Table = Annotated[
    Path | None,
    typer.Option(
        "--table",
        metavar="CSV",
        help="Table with columns file, x (such as sq_um), sq_um_std, load_n, speed_hz.",
    ),
]
Shaft = Annotated[
    list[float] | None,
    typer.Option(metavar="HZ", help="Shaft speed whose harmonics are removed (default: detected)."),
]
StagesFrom = Annotated[
    str,
    typer.Option(
        metavar="INDICATOR",
        parser=_stage_source,
        help="Indicator for stage and alarm: crf, damping or both (all are reported).",
    ),
]
FalseAlarms = Annotated[
    float,
    typer.Option(
        metavar="RATE",
        parser=_false_alarm_rate,
        help="False alarms per recording without wear, such as 0.001, 1/1000 or 1000.",
    ),
]
Acknowledge = Annotated[
    str | None,
    typer.Option(
        metavar="RECORDING",
        help="Acknowledge alarms up to this recording ('last': newest); the baseline "
        "restarts after it.",
    ),
]
StoreFile = Annotated[
    Path | None,
    typer.Option(
        "--store",
        metavar="DB",
        help="SQLite file for recordings and assessments; several processes may share it.",
    ),
]
Machine = Annotated[
    str | None, typer.Option(metavar="NAME", help="Machine, as named in the store.")
]
Point = Annotated[
    str | None, typer.Option(metavar="NAME", help="Measuring point (default: folder name).")
]
SensorName = Annotated[
    str | None,
    typer.Option(
        "--sensor",
        metavar="NAME",
        help="Sensor (default: from sidecar, table or channel).",
    ),
]
OnAlarm = Annotated[
    str | None,
    typer.Option(
        metavar="CMD",
        envvar="ASPERITY_ON_ALARM",
        help="Command to run at every change of state, with JSON on stdin (no shell).",
    ),
]
WebHook = Annotated[
    str | None,
    typer.Option(
        "--webhook",
        metavar="URL",
        envvar="ASPERITY_WEBHOOK",
        help="URL to post JSON to at every change of state.",
    ),
]
Mqtt = Annotated[
    str | None,
    typer.Option(
        envvar="ASPERITY_MQTT",
        metavar="URL",
        help="Broker and topic (mqtt://HOST/TOPIC) to publish JSON to at every change of state.",
    ),
]
Tell = Annotated[
    str | None,
    typer.Option(
        metavar="STATES",
        help="Notify only on entering or leaving these states (default: all).",
    ),
]
ForecastLimit = Annotated[
    str | None,
    typer.Option(
        "--forecast",
        metavar="LIMIT",
        help="Forecast when a limit such as clr=0.5 or sq='2 um' is crossed.",
    ),
]
Worn = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Wear simulation used as prior for the drift of Sq."),
]
EmulatorFolder = Annotated[
    Path | None,
    typer.Option(
        "--emulator", metavar="DIR", help="Folder of the emulator (default: in the user's cache)."
    ),
]
Method = Annotated[
    str | None,
    typer.Option(help="Detection method: joint, modes, likelihood or peak (the paper's)."),
]

OpenPage = Annotated[
    bool, typer.Option("--open", help="Open the report in the browser when it is written.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print the verdict only, without progress.")
]


def chosen_case(
    path: Path,
    overrides: list[str] | None,
    surface: Path | None = None,
    accuracy: float | None = None,
    *,
    snapshot: bool = False,
) -> "Case":
    """Return the case of a file or run, with its options and `--set` values applied."""
    chosen = results.load_run(path).case if path.suffix == ".nc" else case.load_case(path)
    if surface is not None:
        files.require_file(surface)
        chosen = chosen.with_written(
            {"surface": {"file": case.relative_path(surface, chosen.folder)}}
        )
    replaced: dict[str, object] = {}
    if accuracy is not None:
        replaced = {"grid.cells": "auto", "grid.accuracy": accuracy}
    replaced |= read_overrides(overrides, snapshot=snapshot)
    return chosen.with_written(replaced) if replaced else chosen


def read_overrides(overrides: list[str] | None, *, snapshot: bool = False) -> dict[str, object]:
    """Return keys and values of `--set KEY=VALUE` and `--snapshot`."""
    replaced: dict[str, object] = {"contact.roughness": "standing"} if snapshot else {}
    for override in overrides or []:
        key, equals, value = override.partition("=")
        if equals and key.strip() and not value.strip():
            raise BadInput(
                f"--set {override} lacks a value after the equals sign; give one, such as "
                "contact.load='400 N'"
            )
        if not (equals and key.strip() and value.strip()):
            raise BadInput(
                f"--set must be KEY=VALUE such as contact.load='400 N', got {override!r}"
            )
        replaced[key.strip()] = value.strip()
    return replaced


def case_at(path: Path | None) -> "Case | None":
    """Load a case file; None without one."""
    return None if path is None else case.load_case(path)


def contact_at(path: Path | None) -> "Case | MachineCase | None":
    """Load the case of a contact or a machine; None without one."""
    if path is None:
        return None
    return case.load_machine(path) if case.has_machine(path) else case.load_case(path)


def lengths(option: str, texts: list[str] | None) -> list[float] | None:
    """Return lengths of a repeatable option [m]; None without any."""
    return [case.read_length(option, text) for text in texts] if texts else None


# options by the name of an argument or function, which messages of the library give in backticks
_OPTIONS = {
    "band_hz": "--band",
    "case": "--case",
    "clr": "--design",
    "lateral_unit": "--lateral-unit",
    "keep_s": "--keep",
    "limit": "--forecast",
    "machine_conditions": "--dry-run",
    "method": "--method",
    "out": "--out",
    "overdue_after_s": "--expect",
    "pixel": "--pixel",
    "rate_hz": "--rate",
    "scale": "--scale",
    "table": "--table",
    "unit": "--unit",
    "worn": "--worn",
}


def with_options(message: str) -> str:
    """Return a message of the library with options in place of the arguments that it names."""
    for name, option in _OPTIONS.items():
        message = message.replace(f"`{name}`", option)
    return message


def require_output(path: Path | None, *suffixes: str, option: str = "--out") -> None:
    """Raise BadInput unless a path, if given, has a suffix and can be written to."""
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        *first, last = suffixes
        allowed = f"{', '.join(first)} or {last}" if first else last
        raise BadInput(f"{option} must be a file that ends in {allowed}, got {path}")
    files.require_writable(path)
