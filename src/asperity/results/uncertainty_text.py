"""How far the numbers of a contact may be off, in words: in a sentence, and part by part for tables."""

from asperity.core.quantities import NO_VALUE, Quantity, quantity
from asperity.ehl import ContactError, Sides, Uncertainty

PARTS = {  # part of an uncertainty: what tables call it
    "iteration": "iteration",
    "grid": "size of the cells",
    "surfaces": "surface to surface",
    "record": "length of the record",
}
UNDETERMINED = "not determined"
REASONS = {  # why a part is not determined
    "iteration": "nothing to compare with",
    "grid": "nothing to compare with",
    "record": "the method states none",
}


def in_words(key: str, error: Uncertainty) -> str:
    """The interval of a quantity in brackets, or what of it is not known."""
    if error.low is None or error.high is None:
        missing = [PARTS[part] for part in REASONS if getattr(error, part) is None]
        return f"(± {UNDETERMINED}: {' and '.join(missing)})"
    return f"({quantity(key).interval(error.low, error.high)})"


def basis(error: ContactError) -> str:
    """What the intervals are about."""
    if error.surfaces == 1:
        return "90 % intervals, of this one surface"
    return f"mean of {error.surfaces} surfaces, 90 % intervals for one of their kind"


def doubt_rows(error: ContactError) -> list[tuple[str, str]]:
    """Names and texts: the intervals of CLR and CRF, what each is made of, and what is in neither."""
    rows = []
    for key, part in (("clr", error.clr), ("crf_hz", error.crf_hz)):
        if part is not None:
            rows += _rows(quantity(key), part, error.surfaces)
    return [*rows, ("chosen, in no interval", ", ".join(error.choices))]


def _rows(entry: Quantity, error: Uncertainty, surfaces: int) -> list[tuple[str, str]]:
    unknown = error.low is None or error.high is None
    whole = UNDETERMINED if unknown else entry.interval(error.low or 0.0, error.high or 0.0)
    rows = [(f"{entry.short}, 90 % interval", whole)]
    for part, name in PARTS.items():
        sides: Sides | None = getattr(error, part)
        if part == "surfaces" and sides is None:
            text = "not known: one was solved" if surfaces == 1 else UNDETERMINED
        elif sides is None:
            text = f"{UNDETERMINED} ({REASONS[part]})"
        elif sides == (0.0, 0.0) and part == "record":
            continue
        else:
            text = _sides(entry, sides)
        rows.append((f"{entry.short}, {name}", text))
    return rows


def _sides(entry: Quantity, sides: Sides) -> str:
    below, above = (entry.number(side) for side in sides)
    number = f"± {above}" if below == above else f"− {below} + {above}"
    return f"{number} {entry.display}".rstrip() if NO_VALUE not in number else UNDETERMINED
