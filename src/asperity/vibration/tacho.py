"""Shaft angle by the pulses of a tacho: missing and doubled pulses are corrected with a remark."""

from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.vibration.orders import Turning

MIN_PULSES = 4
LEVELS = (0.25, 0.75)  # of a tacho's range; a pulse passes both, so that noise makes no pulses
MAX_INTERVAL_RATIO = 4.0  # of pulse intervals to their median, either way
FIRST_INTERVALS = 15  # whose median is the first expected interval
LOCAL_INTERVALS = 5  # whose median is the next one, as the speed varies
TOLERANCE = 0.25  # of the local interval, within which a pulse is in its place
MAX_MISSING = 3  # pulses in a row that are bridged
MAX_GAP = 20  # pulses in a row that a long gap may lack
MAX_LONG_GAPS = 3  # of more than MAX_MISSING pulses
MAX_IRREGULAR = 0.2  # of the intervals that may have a wrong pulse
ALTERNATION = 0.1  # ln ratio of successive intervals above which they belong to pairs of pulses
REMARKED_ALTERNATION = 0.02  # above which it is remarked; half orders of a shaft cause less
ALTERNATING_SHARE = 0.9  # of the intervals that alternate, and by about the same ratio
THIRD_MISSING = (0.31, 0.36)  # of a pair of intervals, of two marks or of a pulse that is missing
SHORT_SHARE = 0.25  # of a pair of intervals: below it a pulse is doubled, not a second mark


class _Pulses(NamedTuple):
    """Positions of pulses [samples], their number from the first one, and remarks."""

    edges: Field
    counts: Field
    remarks: tuple[str, ...]


def turning_by_pulses(pulses: Field, rate_hz: float, per_turn: float = 1.0) -> Turning:
    """Return the shaft angle from the rising edges of a tacho signal.

    Edges are located between samples and interpolated smoothly. Missing pulses are bridged, doubled
    ones left out.

    Raises
    ------
    BadInput
        for fewer than four pulses, irregular pulse intervals, or pulses per turn that are not
        positive.
    """
    require_positive("pulses per turn", per_turn)
    return _turning(_rising(pulses), pulses.size, rate_hz, per_turn)


def turning_by_times(
    times_s: Field, samples: int, rate_hz: float, per_turn: float = 1.0
) -> Turning:
    """Return the shaft angle at each sample from the times of the pulses [s].

    Raises
    ------
    BadInput
        as `turning_by_pulses`, and for times outside the recording.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.vibration import turning_by_times
    >>> turning = turning_by_times(np.arange(0.0, 1.0, 0.04), samples=1000, rate_hz=1000.0)
    >>> f"{turning.speed_hz:.1f} Hz"
    '25.0 Hz'
    """
    require_positive("pulses per turn", per_turn)
    times_s = times_s[np.isfinite(times_s)]
    edges = times_s[(times_s >= 0.0) & (times_s <= samples / rate_hz)] * rate_hz
    if edges.size < MIN_PULSES <= times_s.size:
        raise BadInput(
            f"pulses from {times_s[0]:.4g} to {times_s[-1]:.4g} s are not within the recording of "
            f"{samples / rate_hz:.4g} s; state their times from its start"
        )
    return _turning(edges, samples, rate_hz, per_turn)


def are_times(values: Field) -> bool:
    """Return whether values are times of pulses: they increase, as no signal does."""
    finite = values[np.isfinite(values)]
    return finite.size >= MIN_PULSES and bool(np.all(np.diff(finite) > 0.0))


def _turning(edges: Field, samples: int, rate_hz: float, per_turn: float) -> Turning:
    repeated, edges = edges.size, np.unique(edges)
    repeated -= edges.size
    if edges.size < MIN_PULSES:
        raise BadInput(
            f"the tacho signal has {edges.size} pulses, but {MIN_PULSES} are required; use "
            "another channel"
        )
    pairs = _without_pairs(edges, per_turn)
    counted = _in_place(pairs.edges, per_turn)
    turns = pairs.counts * counted.counts / per_turn
    angle = scipy.interpolate.PchipInterpolator(counted.edges, turns, extrapolate=False)
    duration_s = (counted.edges[-1] - counted.edges[0]) / rate_hz
    remarks = pairs.remarks + counted.remarks
    if repeated:
        remarks = (f"the tacho has {repeated} equal times, which were left out", *remarks)
    return Turning(angle(np.arange(samples)), float(turns[-1] / duration_s), remarks)


def _without_pairs(edges: Field, per_turn: float) -> _Pulses:
    """Return one pulse of each pair, where short and long intervals alternate.

    `counts` is the number of stated pulses for each of them: 1 where every pulse is doubled, 2
    where an even number of marks is unevenly spaced.

    Raises
    ------
    BadInput
        for intervals of 1 to 2 without two stated marks, which a missing pulse produces too.
    """
    single = np.ones(1)
    intervals = np.log(np.diff(edges))
    if intervals.size < 2 * MIN_PULSES:
        return _Pulses(edges, single, ())
    excess = intervals - scipy.ndimage.convolve1d(intervals, [0.5, 0.0, 0.5], mode="mirror")
    alternation = float(np.median(np.abs(excess)))
    alternates = np.mean(excess[1:] * excess[:-1] < 0.0) >= ALTERNATING_SHARE
    constant = np.mean(np.abs(excess) > 0.5 * alternation) >= ALTERNATING_SHARE
    if not (alternates and constant) or alternation < REMARKED_ALTERNATION:
        return _Pulses(edges, single, ())
    short = 1.0 / (1.0 + np.exp(alternation))
    even = per_turn % 2.0 == 0.0
    if alternation < ALTERNATION:
        return _Pulses(edges, single, () if even else (_alternation_remark(alternation, per_turn),))
    first = np.concatenate([[True], excess > -0.5 * alternation])  # after a long interval
    if even and short >= SHORT_SHARE:
        return _Pulses(edges[first], 2.0 * single, ())
    _require_pairs(short, per_turn)
    remark = (
        f"the tacho has two pulses in place of one, at {short:.2g} and {1.0 - short:.2g} of its "
        "interval; every second one is used"
    )
    return _Pulses(edges[first], single, (remark,))


def _alternation_remark(alternation: float, per_turn: float) -> str:
    return (
        f"the tacho's intervals alternate by {100.0 * alternation:.2g} %; state "
        f"pulses_per_turn = {2.0 * per_turn:g} if it has twice as many marks"
    )


def _require_pairs(short: float, per_turn: float) -> None:
    """Raise BadInput for a short interval that a missing pulse causes as well as a second mark."""
    if THIRD_MISSING[0] < short < THIRD_MISSING[1]:
        raise BadInput(
            f"the tacho's intervals alternate as {short:.2g} to {1.0 - short:.2g}, because every "
            f"third pulse is missing or of two marks; state pulses_per_turn = {2.0 * per_turn:g} "
            "for two marks, or use another channel"
        )


def _in_place(edges: Field, per_turn: float) -> _Pulses:
    """Return the pulses that are in their place, with the number of each."""
    if edges.size < MIN_PULSES:
        raise BadInput(f"the tacho signal has too few pulses, {edges.size}; use another channel")
    scan = _scan(edges)
    if _once_per_turn(scan.doubled, per_turn) or _once_per_turn(scan.missing, per_turn):
        return _Pulses(edges, np.arange(float(edges.size)), ())  # a mark of the wheel itself
    positions, counts = edges[scan.kept], np.array(scan.counts)
    wrong = scan.irregular + len(scan.doubled) + len(scan.missing)
    _require_regular(edges, np.diff(positions) / np.diff(counts), wrong)
    remarks = []
    if scan.missing:
        share = 100.0 * (counts[-1] + 1 - counts.size) / counts[-1]
        remarks.append(f"{share:.2g} % of the tacho's pulses are missing and were bridged")
    if scan.doubled:
        doubled = f"{len(scan.doubled)} doubled pulses of {edges.size}"
        remarks.append(f"the tacho has {doubled}, which were left out")
    return _Pulses(positions, counts, tuple(remarks))


class _Scan(NamedTuple):
    """Numbers of the pulses in place, with their counts, and of those that are not."""

    kept: list[int]
    counts: list[float]
    doubled: list[int]
    missing: list[int]
    irregular: int


def _scan(edges: Field) -> _Scan:
    """Compare each interval with those before it: one pulse, several, or one too many."""
    kept, counts = [0], [0.0]
    doubled: list[int] = []
    missing: list[int] = []
    regular = [float(np.median(np.diff(edges)[:FIRST_INTERVALS]))]
    irregular = long_gaps = 0
    for edge in range(1, edges.size):
        usual = float(np.median(regular[-LOCAL_INTERVALS:]))
        interval = float(edges[edge] - edges[kept[-1]])
        ratio = interval / usual
        if _is_doubled(edges, edge, kept[-1], usual):
            doubled.append(edge)
            continue
        most = MAX_MISSING
        if round(ratio) > 1 + MAX_MISSING and long_gaps < MAX_LONG_GAPS:
            ratio, most = interval / _interval_in_gap(edges, edge, usual), MAX_GAP
            long_gaps += 1
        number = max(round(ratio), 1)
        if number > 1 + most or abs(ratio - number) > TOLERANCE:
            irregular, number = irregular + 1, 1
        if number > 1:
            missing.append(edge)
        regular.append(interval / number)
        kept.append(edge)
        counts.append(counts[-1] + number)
    return _Scan(kept, counts, doubled, missing, irregular)


def _interval_in_gap(edges: Field, edge: int, before: float) -> float:
    """Return the pulse interval at the mean of the speeds before and after a long gap."""
    later = np.diff(edges[edge : edge + LOCAL_INTERVALS + 1])
    after = float(np.median(later)) if later.size else before
    return 2.0 / (1.0 / before + 1.0 / after)


def _is_doubled(edges: Field, edge: int, last: int, usual: float) -> bool:
    """Return whether a pulse is early, and the following one in its place and closer to it."""
    ratio = float(edges[edge] - edges[last]) / usual
    following = float(edges[min(edge + 1, edges.size - 1)] - edges[last]) / usual
    early = ratio < 1.0 - TOLERANCE / 2.0
    return early and abs(following - 1.0) < min(1.0 - ratio, TOLERANCE)


def _once_per_turn(places: list[int], per_turn: float) -> bool:
    """Return whether irregular pulses recur with every turn of a wheel with several marks."""
    return per_turn > 1.0 and len(places) > 2 and bool(np.all(np.diff(places) == per_turn))


def _require_regular(edges: Field, corrected: Field, irregular: int) -> None:
    """Raise BadInput for too many irregular intervals, or intervals no shaft produces."""
    ratios = corrected / np.median(corrected)
    extreme = ratios.min() < 1.0 / MAX_INTERVAL_RATIO or ratios.max() > MAX_INTERVAL_RATIO
    if extreme or irregular > MAX_IRREGULAR * (edges.size - 1):
        stated = np.diff(edges) / np.median(np.diff(edges))
        raise BadInput(
            f"the tacho's pulse intervals are {stated.min():.2g} to {stated.max():.2g} "
            "times their median, which no shaft produces; use another channel"
        )


def _rising(pulses: Field) -> Field:
    """Return the positions of rising edges [samples] between which the signal returns to low."""
    # the full range, since a pulse may last two samples of ten thousand
    low = float(np.nanmin(pulses))
    high = float(np.nanmax(pulses))
    middle = 0.5 * (low + high)
    (low_level, high_level) = (low + level * (high - low) for level in LEVELS)
    state = np.where(pulses > high_level, 1, np.where(pulses < low_level, -1, 0))
    decided = np.flatnonzero(state)
    edges = decided[1:][(state[decided[1:]] == 1) & (state[decided[:-1]] == -1)]
    crossings = []
    for edge in edges:
        first = edge
        while pulses[first - 1] > middle:
            first -= 1
        rise = pulses[first] - pulses[first - 1]
        crossings.append(first - (pulses[first] - middle) / rise if rise > 0.0 else float(first))
    return np.array(crossings)
