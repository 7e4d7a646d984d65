"""Certified values: a quantity by two methods, and the uncertainty of their grids."""

UNITS = {"_pa": "Pa", "_m2_s": "m^2/s", "_n_m": "N/m", "_m2": "m^2", "_m": "m", "_n": "N"}

Found = dict[str, float]
# quantity, unit, two methods, smallest relative uncertainty
Value = tuple[str, str, tuple[str, float], tuple[str, float], float]


def unit_of(key: str) -> str:
    return next((unit for suffix, unit in UNITS.items() if key.endswith(suffix)), "1")


def only(found: Found, *keys: str) -> Found:
    return {key: found[key] for key in keys}


def paired(
    first_by: str, first: Found, second_by: str, second: Found, least: float = 1e-9
) -> list[Value]:
    """Pair the two methods for every quantity that both compute."""
    return [
        (key, unit_of(key), (first_by, float(first[key])), (second_by, float(second[key])), least)
        for key in first
        if key in second
    ]


def stepped(
    first_by: str,
    first: tuple[Found, Found],
    second_by: str,
    second: tuple[Found, Found],
    *keys: str,
) -> list[Value]:
    """Pair two methods on refined grids.

    The smallest uncertainty is the first method's estimate or a third of the second's last step.
    """
    (value, doubt), (other, step) = first, second
    return [
        (
            key,
            unit_of(key),
            (first_by, float(value[key])),
            (second_by, float(other[key])),
            max(doubt[key], step[key] / 3.0) / abs(value[key]),
        )
        for key in keys
    ]
