"""Universal file format, data set 58 (function at nodal degrees of freedom), by pyuff."""

from pathlib import Path
from typing import Any

from asperity.core.errors import UnreadableFile
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import parse_time, reject_as, rounded_rate, sliced_blocks

TIME_RESPONSE = 1
_FUNCTIONS = {
    0: "a general function",
    2: "an auto spectrum",
    3: "a cross spectrum",
    4: "a frequency response",
    5: "a transmissibility",
    6: "a coherence",
    7: "an auto-correlation",
    8: "a cross-correlation",
    9: "a power spectral density",
    10: "an energy spectral density",
    11: "a probability density",
    12: "a spectrum",
    13: "a cumulative frequency distribution",
    14: "a peaks-valley distribution",
    15: "stress cycles",
    16: "strain cycles",
    17: "an orbit",
    18: "a mode indicator function",
    19: "a force pattern",
    20: "a partial power",
    21: "a partial coherence",
    27: "a shock response spectrum",
}
_ROUNDING = 5e-6  # relative to the first digit: the step is printed with six digits


def is_uff(head: bytes) -> bool:
    """Return whether a file starts with a data set: a line with -1, then a line with its number."""
    lines = head[:400].lstrip(b"\r\n").splitlines()
    return len(lines) > 1 and lines[0].strip() == b"-1" and lines[1].strip()[:2].isdigit()


def read(path: Path) -> Contents:
    """Read time records, named by their response; other functions are refused with a reason."""
    import pyuff

    notes: list[str] = []
    with reject_as(path, "not a readable universal file"):
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        sets = [file.read_sets(number) for number, kind in enumerate(kinds) if kind == 58]
    if not sets:
        raise UnreadableFile(
            f"{path.name} holds data sets {sorted(set(kinds))} and no 58; export the time record"
        )
    channels: list[Channel] = []
    others: list[str] = []
    with reject_as(path, "a damaged universal file"):
        for record in sets:
            if int(record["func_type"]) != TIME_RESPONSE:
                others.append(
                    _FUNCTIONS.get(int(record["func_type"]), f"function type {record['func_type']}")
                )
            else:
                channels.append(
                    _channel(path, record, notes, names=[channel.name for channel in channels])
                )
    if not channels:
        raise UnreadableFile(
            f"{path.name} holds {' and '.join(dict.fromkeys(others))}, not a time record; "
            "export the time response itself (data set 58, function type 1)"
        )
    if others:
        notes.append(f"ignored {' and '.join(dict.fromkeys(others))}: not time records")
    return Contents(format="uff 58", channels=channels, notes=notes)


def _name(record: dict[str, Any], names: list[str]) -> str:
    """Return the name of the response or else its node, unique among `names`."""
    label = str(record.get("rsp_ent_name", "")).strip()
    node = f"{record.get('rsp_node', '')}:{record.get('rsp_dir', '')}"
    name = label if label and label != "NONE" else node
    if name in names:
        name = f"{name} {node}" if f"{name} {node}" not in names else f"{name} {len(names) + 1}"
    return name


def _channel(path: Path, record: dict[str, Any], notes: list[str], names: list[str]) -> Channel:
    values = record["data"]
    if values.dtype.kind == "c":
        raise ValueError("its time record is complex")
    if int(record["abscissa_spacing"]) != 1:
        raise UnreadableFile(f"{path.name} is sampled unevenly; export it at an even step")
    step = float(record["abscissa_inc"])
    name = _name(record, names)
    unit = str(record.get("ordinate_axis_units_lab", "")).strip()
    stated = int(record["num_pts"])
    beyond = values[stated:]  # a last line is filled with zeros
    values = values[:stated] if stated > 0 else values
    samples = int(values.size)
    if samples < stated:
        notes.append(f"cut short: {samples} of {stated} samples present")
    elif stated > 0 and beyond.any():
        notes.append(f"{beyond.size} values beyond the stated {stated} samples were left out")
    started = next(
        (time for key in ("id3", "id2", "id4", "id5") if (time := parse_time(record.get(key, "")))),
        None,
    )
    return Channel(
        name=name,
        blocks=sliced_blocks(lambda i, j: values[i:j], samples, notes, name),
        samples=samples,
        rate_hz=rounded_rate(1.0 / step, _ROUNDING / float(f"{step:e}".split("e")[0]))
        if 0.0 < step < 1e9
        else None,
        rate_source=f"file (abscissa step {step:g} s)",
        unit=unit if unit and unit != "NONE" else None,
        started=started,
    )
