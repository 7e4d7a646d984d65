"""What several surfaces of one kind make of a contact's numbers: means, and how far one such surface may be off them.

The interval is one surface's, not the mean's: of surfaces made alike, nine in ten have their load
share within it. Does not solve anything.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import expit, logit, stdtrit

from asperity.contact.conditions import ContactConditions
from asperity.core.quantities import lines
from asperity.coupling import Vibration, VibrationModel, resonance_at
from asperity.ehl import ContactError, ContactState, Sides, Uncertainty

Scalar = float | int | bool | None
Row = Mapping[str, Scalar]

LEVEL = 0.95  # of the t distribution on either side: 90 % between them
NORMAL = 1.6448536269514722  # standard deviations on either side of 90 % of a normal distribution
# load share below which the film is full: the logarithm of the odds tells no smaller ones apart
FLOOR = 0.01
# groups of the catalogue
AVERAGED = (
    "load",
    "sharing",
    "film",
    "pressure",
    "friction",
    "heat",
    "stress",
    "resonance",
    "own",
    "virgin",
)


def mean_row(rows: Sequence[Row]) -> dict[str, Any]:
    """The mean over surfaces of every number that one surface has; over those that have it, as not all resonate.

    None for what was not worked out on every surface.
    """
    first, *others = rows
    means: dict[str, Any] = dict(first)
    for key in (entry.key for entry in lines(*AVERAGED)):
        if key not in first:
            continue
        values = [float(value) for row in rows if (value := row.get(key)) is not None]
        if any(key not in row for row in others):
            means[key] = None
        elif others and values:
            means[key] = float(np.mean(values))
    return means


def one_surface(values: Sequence[float], *, share: bool) -> tuple[float, Sides]:
    """The mean, and how far below and above it a further surface lies with 90 %: Student's prediction interval.

    A share is taken by the logarithm of its odds, so that what comes out is one too.
    """
    mean, count = float(np.mean(values)), len(values)
    if count < 2:
        raise ValueError("one value does not scatter")
    scale = np.array([_odds(value) for value in values]) if share else np.array(values)
    reach = float(stdtrit(count - 1, LEVEL) * math.sqrt(1.0 + 1.0 / count) * np.std(scale, ddof=1))
    ends = float(np.mean(scale)) - reach, float(np.mean(scale)) + reach
    low, high = (_share(end) for end in ends) if share else ends
    return mean, (max(0.0, mean - low), max(0.0, high - mean))


def half_interval(values: Sequence[float]) -> float:
    """Half of the 90 % interval of one further surface's number, which may be any."""
    below, above = one_surface(values, share=False)[1]
    return 0.5 * (below + above)


def _odds(share: float) -> float:
    """Logarithm of the odds of a share, 0 and 1 moved in by `FLOOR`."""
    return float(logit((share + FLOOR) / (1.0 + 2.0 * FLOOR)))


def _share(odds: float) -> float:
    return float(np.clip((1.0 + 2.0 * FLOOR) * expit(odds) - FLOOR, 0.0, 1.0))


def whole_error(
    state: ContactState,
    rows: Sequence[Row],
    conditions: ContactConditions,
    model: VibrationModel | None,
    vibration: Vibration | None,
) -> ContactError | None:
    """All that is known of how far load share and resonance are off, from the numbers of every surface.

    Parameters
    ----------
    state, vibration : of the first surface
    rows : numbers of every surface by their keys in the catalogue, the first one's at the beginning
    """
    if state.error is None:
        return None
    clr = _clr_error(state.error.clr, rows)
    crf = None
    if (
        model is not None
        and vibration is not None
        and any(row["crf_hz"] is not None for row in rows)
    ):
        crf = _crf_error(clr, state, rows, conditions, model, vibration)
    return replace(state.error, clr=clr, crf_hz=crf, surfaces=len(rows))


def _clr_error(own: Uncertainty, rows: Sequence[Row]) -> Uncertainty:
    if len(rows) == 1:
        return own
    mean, surfaces = one_surface([float(row["clr"] or 0.0) for row in rows], share=True)
    numerical = [row["clr_error"] for row in rows]
    grid = own.grid
    if own.iteration is not None and grid is not None and None not in numerical:
        half = max(
            0.0,
            float(np.mean([error for error in numerical if error is not None])) - own.iteration[0],
        )
        mean_half = 0.5 * (
            grid[0] + grid[1]
        )  # of the first surface, whose leaning the others share
        grid = (
            (grid[0] * half / mean_half, grid[1] * half / mean_half)
            if mean_half > 0.0
            else (half, half)
        )
    return replace(own, value=mean, grid=grid, surfaces=surfaces)


def _crf_error(
    clr: Uncertainty,
    state: ContactState,
    rows: Sequence[Row],
    conditions: ContactConditions,
    model: VibrationModel,
    vibration: Vibration,
) -> Uncertainty:
    """Of the load share by the coupling's law, of the surfaces by it or by their own resonances; and of the record."""
    found = [float(row["crf_hz"] or 0.0) for row in rows if row["crf_hz"] is not None]
    deviations = [float(row["crf_std_hz"]) for row in rows if row["crf_std_hz"] is not None]
    record = NORMAL * float(np.mean(deviations)) if len(deviations) == len(found) else None

    def carried_over(sides: Sides | None) -> Sides | None:
        if sides is None:
            return None
        ends = (max(0.0, clr.value - sides[0]), clr.value, min(1.0, clr.value + sides[1]))
        low, middle, high = (resonance_at(end, state, conditions, model) for end in ends)
        if low is None or middle is None or high is None:
            return None
        return abs(middle - low), abs(high - middle)

    surfaces = carried_over(clr.surfaces)
    if clr.surfaces is not None and surfaces is None and len(found) > 1:
        surfaces = one_surface(found, share=False)[1]
    return Uncertainty(
        value=float(np.mean(found)),
        iteration=carried_over(clr.iteration),
        grid=carried_over(clr.grid),
        surfaces=surfaces,
        record=None if record is None else (record, record),
        range=vibration.band_hz,
    )
