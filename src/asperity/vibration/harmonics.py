"""Harmonics shared by several fault frequencies, and the one to which their power belongs.

Fault frequencies of one bearing are often in the ratio of small whole numbers: 3 BPFO equals 2
BPFI where the balls measure a fifth of the pitch diameter. A line there does not show which of the
two is present.
"""

from collections.abc import Mapping, Sequence

HARMONICS = 3  # of each frequency: the fundamental and the next two
SLIP = 0.015  # relative tolerance of a frequency: rolling elements slip by 1 to 2 %
COMPARED = (
    2  # numbers of another frequency's harmonics, over the harmonic's own; higher ones are weak
)


def separable_harmonics(
    rates_hz: Mapping[str, float], resolution_hz: float = 0.0
) -> dict[str, tuple[int, ...]]:
    """Return the numbers of the harmonics of each fault frequency that no other shares.

    A harmonic is shared if its frequencies and those of another fault's harmonic overlap, each
    within slip or resolution. The fundamental is never shared. Fault frequencies that coincide
    cannot be separated; they keep their harmonics.

    Parameters
    ----------
    rates_hz : fault frequencies by name [Hz]
    resolution_hz : spacing of spectral lines [Hz]

    Examples
    --------
    >>> from asperity.vibration import separable_harmonics
    >>> separable_harmonics({"BPFO": 87.3, "BPFI": 131.9, "mesh": 412.5})
    {'BPFO': (1, 2), 'BPFI': (1, 3), 'mesh': (1, 2, 3)}
    """
    return {
        name: tuple(
            number
            for number in range(1, HARMONICS + 1)
            if number == 1
            or not any(
                _is_shared(number, rate, other, resolution_hz)
                for other_name, other in rates_hz.items()
                if other_name != name
            )
        )
        for name, rate in rates_hz.items()
    }


def attributed_power(powers: Sequence[float], separable: Sequence[int]) -> float:
    """Return the power at a fault frequency, from the power of its harmonics.

    A shared harmonic counts up to the strongest one that is not shared. So its power belongs
    to the fault whose own lines are present, and its scatter to both as long as none is.

    Parameters
    ----------
    powers : power of the first harmonics
    separable : numbers of the harmonics that no other frequency shares, as of `separable_harmonics`
    """
    largest = max(powers[number - 1] for number in separable if number <= len(powers))
    return sum(
        power if number in separable else min(power, largest)
        for number, power in enumerate(powers, 1)
    )


def tolerance_hz(frequency_hz: float, resolution_hz: float) -> float:
    """Return how far a line may lie from its nominal frequency [Hz]."""
    return max(SLIP * frequency_hz, resolution_hz)


def _is_shared(number: int, rate_hz: float, other_hz: float, resolution_hz: float) -> bool:
    """Return whether a harmonic overlaps with a harmonic of another frequency and number."""
    if _overlap(rate_hz, other_hz, resolution_hz):
        return False
    return any(
        _overlap(number * rate_hz, compared * other_hz, resolution_hz)
        for compared in range(1, COMPARED * number + 1)
    )


def _overlap(first_hz: float, second_hz: float, resolution_hz: float) -> bool:
    return abs(first_hz - second_hz) <= sum(
        tolerance_hz(frequency, resolution_hz) for frequency in (first_hz, second_hz)
    )
