"""A measured surface as the prior of Sq."""

import math
from dataclasses import replace

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.inference.priors import REACH, Unknown
from asperity.inference.settings import Setting
from asperity.surface import MeasuredSurface, condition_surface

INSTRUMENT_STD = 0.03  # of Sq, relative: difference between instruments on the same surface
PARTS = 2  # parts of a map along each axis, to estimate the scatter of Sq over the surface


def with_measured_surface(setting: Setting, measured: MeasuredSurface) -> tuple[Setting, str]:
    """Return the setting with the Sq of a measured surface as prior, and a note.

    Form (a paraboloid) is removed. The standard deviation combines the scatter over parts of the
    map, divided by the root of their number, and that of the instrument.

    Raises
    ------
    BadInput
        if Sq is not unknown in the case, or the measured Sq is outside its range.
    """
    index = next(
        (number for number, entry in enumerate(setting.contact) if entry.key == "sq_m"), None
    )
    if index is None:
        raise BadInput(
            "Sq is known in the case; leave --surface out, or remove infer.sq from the case"
        )
    rough, _ = condition_surface(measured)
    sq = float(np.nanstd(rough.heights))
    std = math.hypot(_between_parts(rough.heights), INSTRUMENT_STD * sq)
    unknown = setting.contact[index]
    zero, mean = (float(unknown.from_si(value)) for value in (0.0, sq))
    prior_std = float(unknown.from_si(std)) - zero
    entry = quantity("sq_m")
    low = unknown.range.low
    high = unknown.range.high
    if not low < mean < high:
        raise BadInput(
            f"Sq of {measured.name} is {entry.text(sq)}, outside the emulator's range of {low:g} "
            f"to {high:g} {unknown.range.unit}; widen infer.sq in the case"
        )
    prior_std = min(prior_std, 0.999 * mean / REACH)
    updated = Unknown(unknown.key, unknown.range, mean, prior_std)
    contact = (*setting.contact[:index], updated, *setting.contact[index + 1 :])
    note = (
        f"The prior of Sq is that of {measured.name}, {entry.text(sq, std)}, "
        "taken as the composite roughness (smooth counterbody)."
    )
    return replace(setting, contact=contact), note


def _between_parts(heights: Field) -> float:
    """Return the standard deviation of Sq from the parts of a map; 0 if there are too few."""
    parts = [
        part
        for row in np.array_split(heights, PARTS)
        for part in np.array_split(row, PARTS, axis=1)
    ]
    stds = [float(np.nanstd(part)) for part in parts if np.count_nonzero(np.isfinite(part)) > 1]
    return float(np.std(stds, ddof=1)) / math.sqrt(len(stds)) if len(stds) > 1 else 0.0
