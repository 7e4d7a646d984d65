"""Means over several surfaces of one kind, and 90 % intervals for a single such surface.

The interval is that of one surface, not of the mean: 90 % of nominally identical surfaces have
their load share within it. Nothing is solved here.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import expit, logit, stdtrit

from asperity.contact.conditions import ContactConditions
from asperity.core.coverage import NORMAL_FACTOR, UPPER
from asperity.core.quantities import lines
from asperity.coupling import Vibration, VibrationModel, resonance_at
from asperity.ehl import ContactError, ContactState, Sides, Uncertainty

Scalar = float | int | bool | None
Row = Mapping[str, Scalar]

FLOOR = 0.01  # load share of a full film; log odds do not distinguish smaller shares
# groups of the catalogue
AVERAGED = (
    "load",
    "sharing",
    "film",
    "pressure",
    "friction",
    "heat",
    "stress",
    "observables",
    "resonance",
    "own",
    "virgin",
)


def mean_row(rows: Sequence[Row]) -> dict[str, Any]:
    """Return means over surfaces of every number, over those surfaces that have it.

    None for numbers that were not computed on every surface.
    """
    first, *others = rows
    means = dict(first)
    for key in (entry.key for entry in lines(*AVERAGED)):
        if key not in first:
            continue
        values = [float(value) for row in rows if (value := row.get(key)) is not None]
        if any(key not in row for row in others):
            means[key] = None
        elif others and values:
            means[key] = float(np.mean(values))
    return means


def prediction_interval(values: Sequence[float], *, share: bool) -> tuple[float, Sides]:
    """Return the mean and Student's prediction interval for a further surface (below, above).

    A `share` is transformed to log odds, so that the interval stays within 0 to 1.
    """
    mean = float(np.mean(values))
    count = len(values)
    if count < 2:
        raise ValueError("a prediction interval needs at least two values")
    scale = np.array([_odds(value) for value in values]) if share else np.array(values)
    reach = float(stdtrit(count - 1, UPPER) * math.sqrt(1.0 + 1.0 / count) * np.std(scale, ddof=1))
    limits = float(np.mean(scale)) - reach, float(np.mean(scale)) + reach
    low, high = (_share(end) for end in limits) if share else limits
    return mean, (max(0.0, mean - low), max(0.0, high - mean))


def half_interval(values: Sequence[float]) -> float:
    """Return half of the prediction interval of an unbounded number on a further surface."""
    below, above = prediction_interval(values, share=False)[1]
    return 0.5 * (below + above)


def _odds(share: float) -> float:
    """Return the log odds of a share, with 0 and 1 moved inwards by `FLOOR`."""
    return float(logit((share + FLOOR) / (1.0 + 2.0 * FLOOR)))


def _share(odds: float) -> float:
    return float(np.clip((1.0 + 2.0 * FLOOR) * expit(odds) - FLOOR, 0.0, 1.0))


def total_error(
    state: ContactState,
    rows: Sequence[Row],
    conditions: ContactConditions,
    model: VibrationModel | None,
    vibration: Vibration | None,
) -> ContactError | None:
    """Return the uncertainty of load share and resonance from the numbers of all surfaces.

    Parameters
    ----------
    state, vibration : of the first surface
    rows : numbers of every surface by catalogue key, first surface first
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
        crf = crf_error(clr, state, rows, conditions, model, vibration)
    return replace(state.error, clr=clr, crf_hz=crf, surfaces=len(rows))


def _clr_error(first: Uncertainty, rows: Sequence[Row]) -> Uncertainty:
    if len(rows) == 1:
        return first
    mean, surfaces = prediction_interval([float(row["clr"] or 0.0) for row in rows], share=True)
    numerical = [row["clr_error"] for row in rows]
    grid = first.grid
    if first.iteration is not None and grid is not None and None not in numerical:
        half = max(
            0.0,
            float(np.mean([error for error in numerical if error is not None]))
            - first.iteration[0],
        )
        mean_half = 0.5 * (grid[0] + grid[1])  # of the first surface; others share its asymmetry
        grid = (
            (grid[0] * half / mean_half, grid[1] * half / mean_half)
            if mean_half > 0.0
            else (half, half)
        )
    return replace(first, value=mean, grid=grid, surfaces=surfaces)


def crf_error(
    clr: Uncertainty,
    state: ContactState,
    rows: Sequence[Row],
    conditions: ContactConditions,
    model: VibrationModel,
    vibration: Vibration,
) -> Uncertainty:
    """Propagate the errors of CLR to CRF by the coupling's law, and add that of the record.

    The scatter between surfaces comes from the law, or else from the surfaces' own resonances.
    """
    crf_hz = [float(row["crf_hz"] or 0.0) for row in rows if row["crf_hz"] is not None]
    deviations = [float(row["crf_std_hz"]) for row in rows if row["crf_std_hz"] is not None]
    record = NORMAL_FACTOR * float(np.mean(deviations)) if len(deviations) == len(crf_hz) else None

    def propagated(sides: Sides | None) -> Sides | None:
        return None if sides is None else crf_sides(clr.value, sides, state, conditions, model)

    surfaces = propagated(clr.surfaces)
    if clr.surfaces is not None and surfaces is None and len(crf_hz) > 1:
        surfaces = prediction_interval(crf_hz, share=False)[1]
    return Uncertainty(
        value=float(np.mean(crf_hz)),
        iteration=propagated(clr.iteration),
        grid=propagated(clr.grid),
        surfaces=surfaces,
        record=None if record is None else (record, record),
        range=vibration.band_hz,
    )


def crf_sides(
    clr: float,
    sides: Sides,
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
) -> Sides | None:
    """Propagate an error of CLR to CRF by the coupling's law; None without such a law."""
    values = (max(0.0, clr - sides[0]), clr, min(1.0, clr + sides[1]))
    low, middle, high = (resonance_at(end, state, conditions, model) for end in values)
    if low is None or middle is None or high is None:
        return None
    return abs(middle - low), abs(high - middle)
