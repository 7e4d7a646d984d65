"""Frequency responses and noise spectra of a universal file (data set 58), by pyuff.

Runs in the reading process of `asperity.core.sandbox`.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line, suppress_output

FREQUENCY_RESPONSE, POWER_SPECTRUM = 4, 9  # function types of data set 58
DISPLACEMENT, VELOCITY, ACCELERATION, FORCE = 8, 11, 12, 13  # data types of its axes
ORDERS = {DISPLACEMENT: 0, VELOCITY: 1, ACCELERATION: 2}  # derivatives of a displacement
LENGTHS = {  # per label of the response: [m] or its rates
    **dict.fromkeys(("m", "m/s", "m/s^2", "m/s2", "m/s²"), 1.0),
    **dict.fromkeys(("mm", "mm/s", "mm/s^2", "mm/s2", "mm/s²"), 1e-3),
    **dict.fromkeys(("(m/s^2)^2/Hz", "(m/s²)²/Hz"), 1.0),  # of power spectra
    **dict.fromkeys(("g", "g^2/Hz", "g²/Hz"), 9.80665),
}
FORCES = {"N": 1.0, "kN": 1e3}
REMEDY = "export the frequency responses again"
AXES = {1: "X", 2: "Y", 3: "Z"}
Record: TypeAlias = Mapping[str, npt.ArrayLike]  # as pyuff reads a data set
Function: TypeAlias = tuple[int, str, str, npt.NDArray[np.float64], npt.NDArray[np.complex128]]


def read_functions(path: Path) -> list[Function]:
    """Return the functions of a file: type, response and reference, frequencies [Hz] and values.

    Response and reference are node and axis, such as "11Z". Frequency responses become receptances
    [m/N] along the positive axes, whatever was measured; power spectra are those of accelerations
    [(m/s²)²/Hz].

    Raises
    ------
    UnreadableFile
        for a damaged file, one without such functions, or with units that are not known.
    """
    import pyuff

    try:
        with suppress_output():
            file = pyuff.UFF(str(path))
            kinds = [int(kind) for kind in file.get_set_types()]
            units = [file.read_sets(n) for n, kind in enumerate(kinds) if kind == 164]
            records = [file.read_sets(n) for n, kind in enumerate(kinds) if kind == 58]
            return _functions(path, records, _factors(path, units))
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(
            f"{path.name} is not a readable universal file ({first_line(error)}); {REMEDY}"
        ) from error


def _functions(
    path: Path, records: Iterable[Record], stated: tuple[float, float] | None
) -> list[Function]:
    readers = {FREQUENCY_RESPONSE: _receptance, POWER_SPECTRUM: _density}
    found = [
        readers[kind](path, record, stated)
        for record in records
        if (kind := _whole(record, "func_type")) in readers
    ]
    if not any(kind == FREQUENCY_RESPONSE for kind, *_ in found):
        raise UnreadableFile(
            f"{path.name} holds no frequency response (data set 58, function type 4); {REMEDY}"
        )
    return found


def _receptance(path: Path, record: Record, stated: tuple[float, float] | None) -> Function:
    order = ORDERS.get(_whole(record, "ordinate_spec_data_type"))
    response, reference = _freedom(record, "rsp"), _freedom(record, "ref")
    if order is None:
        raise UnreadableFile(
            f"{path.name}: the response at {response} is not stated to be a displacement, velocity "
            f"or acceleration; {REMEDY} with its data type"
        )
    if _whole(record, "orddenom_spec_data_type") != FORCE:
        raise UnreadableFile(
            f"{path.name}: the reference at {reference} is not stated to be a force; {REMEDY} with "
            "its data type"
        )
    frequencies_hz, values = _sampled(record)
    above = frequencies_hz > 0.0
    sign = np.sign(_whole(record, "rsp_dir") * _whole(record, "ref_dir")) or 1
    factor = sign * _factor(path, record, "ordinate", stated)
    factor /= _factor(path, record, "orddenom", stated)
    angular = 2j * np.pi * frequencies_hz[above]
    receptance = factor * values[above] / angular**order
    return FREQUENCY_RESPONSE, response, reference, frequencies_hz[above], receptance


def _density(path: Path, record: Record, stated: tuple[float, float] | None) -> Function:
    response, reference = _freedom(record, "rsp"), _freedom(record, "ref")
    if _whole(record, "ordinate_spec_data_type") != ACCELERATION:
        raise UnreadableFile(
            f"{path.name}: the power spectrum at {response} is not that of an acceleration; "
            f"{REMEDY} with its data type"
        )
    frequencies_hz, values = _sampled(record)
    values = values * _factor(path, record, "ordinate", stated) ** 2
    return POWER_SPECTRUM, response, reference, frequencies_hz, values


def _whole(record: Record, key: str) -> int:
    value = record.get(key, 0)
    return int(value) if isinstance(value, int | float) else 0


def _freedom(record: Record, end: str) -> str:
    """Return node and axis of the response ("rsp") or the reference ("ref"), such as 11Z."""
    return f"{_whole(record, f'{end}_node')}{AXES.get(abs(_whole(record, f'{end}_dir')), '')}"


def _sampled(record: Record) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.complex128]]:
    values = np.asarray(record["data"], dtype=complex)
    frequencies_hz = np.asarray(record["x"], dtype=float)
    count = min(values.size, frequencies_hz.size, _whole(record, "num_pts"))
    return frequencies_hz[:count], values[:count]


def _factors(path: Path, units: list[Record]) -> tuple[float, float] | None:
    """Return length and force of the file's units in SI; None without a statement."""
    if not units:
        return None
    length, force = (float(np.real(units[-1][name])) for name in ("length", "force"))
    if not (length > 0.0 and force > 0.0):
        raise UnreadableFile(f"{path.name}: its units (data set 164) are not positive; {REMEDY}")
    return 1.0 / length, 1.0 / force


def _factor(path: Path, record: Record, axis: str, stated: tuple[float, float] | None) -> float:
    """Return the factor to SI: that of the label, else that of the file's units, else 1."""
    label = str(record.get(f"{axis}_axis_units_lab", "")).strip()
    known, number = (LENGTHS, 0) if axis == "ordinate" else (FORCES, 1)
    if label in ("", "NONE"):
        return 1.0 if stated is None else stated[number]
    if label not in known:
        raise UnreadableFile(f"{path.name}: unit {label!r} is not known; {REMEDY} in SI units")
    return known[label]
