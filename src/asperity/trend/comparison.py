"""A series of recordings as one: whether it is one at all, and what load share its CRF stands for.

Knows neither files nor machines: what is known of each recording comes in as `RecordingFacts`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

SAME = 0.01  # relative difference of rate, speed or load up to which recordings count as alike
INTERVAL = 1.6449  # standard deviations to either side: 90 %


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadShare:
    """CLR read off CRFs: the model's reading, not a measurement; above 1 where the CRF lies above that of full load.

    `interval` is that of 90 %, lower and upper ends.
    """

    clr: Field
    interval: tuple[Field, Field]


def asperity_load_share(
    crf_hz: Field | float,
    crf_std_hz: Field | float,
    full_load_crf_hz: float,
    *,
    full_load_std_hz: float = 0.0,
) -> LoadShare:
    """CLR = (CRF / CRF_full)^6 of a Hertz point spring, with the interval that both frequencies' errors leave.

    Parameters
    ----------
    crf_hz, crf_std_hz : shape (recordings,) or one; nan stays nan
    full_load_crf_hz, full_load_std_hz : resonance with all load on asperities, and how well it is known [Hz]

    Raises
    ------
    BadInput
        for a full-load resonance that is not positive, or a negative deviation.
    """
    require_positive("full-load resonance", full_load_crf_hz, "Hz")
    std = np.asarray(crf_std_hz, dtype=float)
    if full_load_std_hz < 0.0 or np.any(std < 0.0):
        raise BadInput(
            "deviations of CRF and of the full-load resonance must be 0 or more; give standard deviations"
        )
    ratio = np.asarray(crf_hz, dtype=float) / full_load_crf_hz
    spread = INTERVAL * np.hypot(
        std / full_load_crf_hz, ratio * full_load_std_hz / full_load_crf_hz
    )
    return LoadShare(
        clr=np.asarray(ratio**6),
        interval=(
            np.asarray(np.maximum(ratio - spread, 0.0) ** 6),
            np.asarray((ratio + spread) ** 6),
        ),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingFacts:
    """What is known of a recording and its spectrum; None for what is not known.

    `name` to speak of it, `rate_hz`, `segment` [samples], `window`, `unit`, `duration_s`;
    `speed_hz` of the shaft and `load_n` of the contact.
    """

    name: str
    rate_hz: float
    segment: int
    window: str
    unit: str | None
    duration_s: float
    speed_hz: float | None = None
    load_n: float | None = None


def comparability(series: Sequence[RecordingFacts]) -> tuple[str, ...]:
    """What keeps recordings from being compared with one another, a sentence each; none when nothing does.

    Rate, window, resolution and unit change CRFA, load and speed change CRF and CRFA themselves. A
    record length that differs changes standard deviations only, and they say so.
    """
    problems = []
    resolutions = [facts.rate_hz / facts.segment for facts in series]
    numbers = (
        (
            "sampling rate",
            "Hz",
            [facts.rate_hz for facts in series],
            "resample them, or track them apart",
        ),
        ("resolution", "Hz", resolutions, "take one segment length for all"),
        (
            "load",
            "N",
            [facts.load_n for facts in series],
            "CRF follows the load: track each load by itself",
        ),
        (
            "speed",
            "Hz",
            [facts.speed_hz for facts in series],
            "CRFA follows the speed: track each speed by itself",
        ),
    )
    for thing, unit, values, remedy in numbers:
        known = [
            (value, facts.name)
            for value, facts in zip(values, series, strict=True)
            if value is not None
        ]
        if not known:
            continue
        low, high = min(known), max(known)
        if high[0] - low[0] > SAME * abs(high[0]):
            problems.append(
                f"The {thing} differs between recordings, from {low[0]:g} {unit} ({low[1]}) to {high[0]:g} {unit} "
                f"({high[1]}); {remedy}."
            )
        if len(known) < len(series):
            silent = next(
                facts.name for value, facts in zip(values, series, strict=True) if value is None
            )
            problems.append(
                f"The {thing} is known of {len(known)} of {len(series)} recordings, not of {silent}."
            )
    for thing, words, remedy in (
        (
            "unit",
            [facts.unit for facts in series],
            "convert them; until then CRFA is not comparable, CRF is",
        ),
        ("window", [facts.window for facts in series], "take one window for all"),
    ):
        seen = {
            word: facts.name for word, facts in zip(reversed(words), reversed(series), strict=True)
        }
        if len(seen) > 1:
            listed = ", ".join(
                f"{word or 'none'} ({name})" for word, name in reversed(seen.items())
            )
            problems.append(f"The {thing} differs between recordings: {listed}; {remedy}.")
    return tuple(problems)
