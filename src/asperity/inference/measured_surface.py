"""A measured surface as what is known of Sq before any recording."""

import math
from dataclasses import replace

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.inference.priors import REACH, Unknown
from asperity.inference.settings import Setting
from asperity.surface import MeasuredSurface, condition_surface

INSTRUMENT_STD = 0.03  # of Sq, relative: instruments differ by that on the same surface
PARTS = 2  # of a map along each axis: how much Sq differs from place to place


def with_measured_surface(setting: Setting, measured: MeasuredSurface) -> tuple[Setting, str]:
    """A setting whose Sq is known as a surface was measured, within the range of the emulator; and a sentence of it.

    Form is removed (a paraboloid). The deviation is that of the parts of the map, over the root of
    their number, and the instrument's.

    Raises
    ------
    BadInput
        where the case's Sq is known already, or the measured one lies outside its range.
    """
    place = next((number for number, one in enumerate(setting.contact) if one.key == "sq_m"), None)
    if place is None:
        raise BadInput("the case knows its Sq; leave --surface out, or take infer.sq from the case")
    rough, _ = condition_surface(measured)
    sq = float(np.nanstd(rough.heights))
    std = math.hypot(_between_parts(rough.heights), INSTRUMENT_STD * sq)
    unknown = setting.contact[place]
    zero, mean = (float(unknown.from_si(value)) for value in (0.0, sq))
    spread = float(unknown.from_si(std)) - zero
    entry, low, high = quantity("sq_m"), unknown.range.low, unknown.range.high
    if not low < mean < high:
        raise BadInput(
            f"Sq of {measured.name} is {entry.text(sq)}, and the emulator goes from {low:g} to {high:g} "
            f"{unknown.range.unit}; widen infer.sq in the case"
        )
    spread = min(spread, 0.999 * mean / REACH)
    known = Unknown(unknown.key, unknown.range, mean, spread)
    contact = (*setting.contact[:place], known, *setting.contact[place + 1 :])
    said = f"Sq is taken as {measured.name} shows it, {entry.text(sq, std)}, of both bodies together: the other is smooth."
    return replace(setting, contact=contact), said


def _between_parts(heights: Field) -> float:
    """Standard deviation of Sq over a map that its parts let expect; 0 where there are too few heights."""
    parts = [
        part
        for row in np.array_split(heights, PARTS)
        for part in np.array_split(row, PARTS, axis=1)
    ]
    known = [float(np.nanstd(part)) for part in parts if np.count_nonzero(np.isfinite(part)) > 1]
    return float(np.std(known, ddof=1)) / math.sqrt(len(known)) if len(known) > 1 else 0.0
