"""Comparability of the recordings of a series, and the asperity load share implied by CRF.

This module knows neither files nor machines: callers describe recordings as `RecordingFacts`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR
from asperity.core.errors import BadInput, require_positive

SAME_WITHIN = (
    0.01  # relative difference of rate, speed or load up to which recordings are comparable
)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadShare:
    """Asperity load share derived from CRF by a model; above 1 where CRF exceeds that at full load.

    `interval` holds its lower and upper ends.
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
    """Return CLR = (CRF / CRF_full)^6 of a Hertz point contact, with its interval.

    The interval propagates the standard deviations of both frequencies.

    Parameters
    ----------
    crf_hz, crf_std_hz : shape (recordings,) or scalars; nan stays nan
    full_load_crf_hz, full_load_std_hz : resonance with all load on asperities, and its standard
        deviation [Hz]

    Raises
    ------
    BadInput
        for a full-load resonance that is not positive, or a negative standard deviation.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.trend import asperity_load_share
    >>> share = asperity_load_share(
    ...     np.array([300.0, 400.0]), crf_std_hz=np.array([3.0, 3.0]), full_load_crf_hz=500.0
    ... )
    >>> share.clr.round(2)
    array([0.05, 0.26])
    """
    require_positive("full-load resonance", full_load_crf_hz, "Hz")
    std = np.asarray(crf_std_hz, dtype=float)
    if full_load_std_hz < 0.0 or np.any(std < 0.0):
        raise BadInput(
            "standard deviations of CRF and of the full-load resonance must be 0 or more"
        )
    ratio = np.asarray(crf_hz, dtype=float) / full_load_crf_hz
    half_width = NORMAL_FACTOR * np.hypot(
        std / full_load_crf_hz, ratio * full_load_std_hz / full_load_crf_hz
    )
    return LoadShare(
        clr=np.asarray(ratio**6),
        interval=(
            np.asarray(np.maximum(ratio - half_width, 0.0) ** 6),
            np.asarray((ratio + half_width) ** 6),
        ),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingFacts:
    """Known facts of a recording and its spectrum; None where not known.

    `name` for messages, `rate_hz`, `segment` [samples], `window`, `unit`, `duration_s`; `speed_hz`
    of the shaft and `load_n` of the contact.
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
    """Return the reasons why recordings cannot be compared, one sentence each; empty for none.

    Rate, window, resolution and unit change CRFA; load and speed change both CRF and CRFA. The
    record length changes standard deviations only.
    """
    return (*_differing_numbers(series), *_differing_words(series))


def _differing_numbers(series: Sequence[RecordingFacts]) -> Iterator[str]:
    """Yield a sentence for each number that differs between recordings, or is partly unknown."""
    numbers = (
        (
            "sampling rate",
            "Hz",
            [facts.rate_hz for facts in series],
            "resample the recordings, or track them separately",
        ),
        (
            "resolution",
            "Hz",
            [facts.rate_hz / facts.segment for facts in series],
            "use one segment length for all",
        ),
        (
            "load",
            "N",
            [facts.load_n for facts in series],
            "CRF depends on the load: track each load separately",
        ),
        (
            "speed",
            "Hz",
            [facts.speed_hz for facts in series],
            "CRFA depends on the speed: track each speed separately",
        ),
    )
    for quantity, unit, values, remedy in numbers:
        stated = [
            (value, facts.name)
            for value, facts in zip(values, series, strict=True)
            if value is not None
        ]
        if not stated:
            continue
        low, high = min(stated), max(stated)
        if high[0] - low[0] > SAME_WITHIN * abs(high[0]):
            yield (
                f"The {quantity} differs between recordings, from {low[0]:g} {unit} ({low[1]}) to "
                f"{high[0]:g} {unit} ({high[1]}); {remedy}."
            )
        if len(stated) < len(series):
            unknown = next(
                facts.name for value, facts in zip(values, series, strict=True) if value is None
            )
            yield (
                f"The {quantity} is stated for {len(stated)} of {len(series)} recordings, not for "
                f"{unknown}."
            )


def _differing_words(series: Sequence[RecordingFacts]) -> Iterator[str]:
    """Yield a sentence where units or windows differ between recordings."""
    for quantity, words, remedy in (
        (
            "unit",
            [facts.unit for facts in series],
            "convert them (until then CRF is comparable, CRFA is not)",
        ),
        ("window", [facts.window for facts in series], "use one window for all"),
    ):
        examples = {
            word: facts.name for word, facts in zip(reversed(words), reversed(series), strict=True)
        }
        if len(examples) > 1:
            listed = ", ".join(
                f"{word or 'none'} ({name})" for word, name in reversed(examples.items())
            )
            yield f"The {quantity} differs between recordings: {listed}; {remedy}."
