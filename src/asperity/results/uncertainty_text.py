"""Uncertainty of a contact's numbers as text: in a sentence, and by part for tables."""

from asperity.core.coverage import PERCENT
from asperity.core.quantities import NO_VALUE, Quantity, quantity
from asperity.ehl import ContactError, ContactSolution, Sides, Uncertainty
from asperity.results.friction_interval import FrictionInterval
from asperity.results.surface_spread import Row
from asperity.solution import AxialDistribution, sharing_by_film

PARTS = {  # part of an uncertainty: name in tables
    "iteration": "iteration",
    "grid": "cell size",
    "surfaces": "surface to surface",
    "record": "record length",
    "oil": "pressure-viscosity coefficient",
}
UNDETERMINED = "not determined"
REASONS = {  # reason why a part is not determined
    "iteration": "no solution to compare with",
    "grid": "no coarser grid to compare with",
    "record": "not given by the method",
    "oil": "no solution at the ends of its interval",
}


def interval_text(key: str, error: Uncertainty) -> str:
    """Return the interval of a quantity in brackets, or the parts that are not determined."""
    if error.low is None or error.high is None:
        missing = [PARTS[part] for part in REASONS if getattr(error, part) is None]
        return f"(± {UNDETERMINED}: {' and '.join(missing)})"
    return f"({quantity(key).interval(error.low, error.high)})"


def basis(error: ContactError, *, snapshot: bool) -> str:
    """Return the reference of the intervals as text; `snapshot`: moving roughness stood still."""
    if error.running:
        tracks = "track" if error.surfaces == 1 else "tracks"
        return (
            f"mean over time of {error.surfaces} {tracks} of running roughness, {PERCENT} "
            "intervals of this mean"
        )
    standing = "snapshot of standing roughness, " if snapshot else ""
    if error.surfaces == 1:
        return f"{standing}{PERCENT} intervals for this surface"
    return (
        f"{standing}mean of {error.surfaces} surfaces, {PERCENT} prediction intervals for another "
        "surface of this kind"
    )


def uncertainty_rows(
    error: ContactError, friction: FrictionInterval | None = None
) -> list[tuple[str, str]]:
    """Return table rows: intervals of CLR, CRF and friction by part, and assumptions."""
    rows = []
    for key, part in (("clr", error.clr), ("crf_hz", error.crf_hz)):
        if part is not None:
            rows += _rows(quantity(key), part, error)
    if friction is not None and friction.value > 0.0:
        rows += _friction_rows(friction)
    return [*rows, ("assumptions not covered by the intervals", ", ".join(error.choices))]


def _friction_rows(friction: FrictionInterval) -> list[tuple[str, str]]:
    entry = quantity("friction_coefficient")
    low, high = friction.low, friction.high
    interval = UNDETERMINED if low is None or high is None else entry.interval(low, high)
    cells = friction.numerical
    rows = [
        (f"{PERCENT} interval", interval),
        ("oil under pressure and shear", _sides(entry, friction.oil)),
        ("viscosity of the cold oil", _sides(entry, (friction.heat, 0.0))),
        ("cell size and iteration", UNDETERMINED if cells is None else _sides(entry, (cells,) * 2)),
    ]
    if friction.surfaces != (0.0, 0.0):
        rows.append(("surface to surface", _sides(entry, friction.surfaces)))
    return [(f"{entry.short}, {name}", text) for name, text in rows]


def _rows(entry: Quantity, error: Uncertainty, whole: ContactError) -> list[tuple[str, str]]:
    unknown = error.low is None or error.high is None
    interval = UNDETERMINED if unknown else entry.interval(error.low or 0.0, error.high or 0.0)
    rows = [(f"{entry.short}, {PERCENT} interval", interval)]
    for part, name in PARTS.items():
        sides: Sides | None = getattr(error, part)
        if part == "surfaces" and sides is None:
            text = "unknown (one surface solved)" if whole.surfaces == 1 else UNDETERMINED
        elif sides is None:
            text = f"{UNDETERMINED} ({REASONS[part]})"
        elif sides == (0.0, 0.0) and part in ("record", "oil"):
            continue
        else:
            text = _sides(entry, sides)
        if part == "surfaces" and whole.running:
            name = "time and tracks"
        rows.append((f"{entry.short}, {name}", text))
    return rows


def _sides(entry: Quantity, sides: Sides) -> str:
    below, above = (entry.number(side) for side in sides)
    number = f"± {above}" if below == above else f"− {below} + {above}"
    return f"{number} {entry.display}".rstrip() if NO_VALUE not in number else UNDETERMINED


def threshold_note(solution: ContactSolution) -> str:
    """Return a note on what CLR counts in the conserving model, with shares by film thickness."""
    sharing = sharing_by_film(solution)
    shares = ", ".join(
        f"{100 * share:.0f} % on at most {film * 1e9:.0f} nm"
        for film, share in zip(sharing.films, sharing.below, strict=True)
    )
    return (
        "Model conserving: CLR and CAR count cells whose elastic bodies touch, even if oil at "
        f"the cap separates them again. Load by film thickness: {shares}. The share at the "
        "contact film depends on the grid."
    )


def ends_text(axial: AxialDistribution, numbers: Row, solution: ContactSolution) -> str:
    """Return edge pressure and loaded length of a roller, as the start of a sentence."""
    edge = quantity("edge_pressure_pa")
    pressure = axial.edge_pressure
    middle = quantity("middle_pressure_pa").named(numbers["middle_pressure_pa"])
    if pressure is None:
        text = f"no {edge.name} (outside the grid)"
    elif pressure.value is None:
        text = f"{edge.name} not determined, {middle}"
    else:
        hertz = pressure.value / solution.conditions.hertz.p_max
        text = f"{edge.short} {edge.text_in(numbers)}, {hertz:.2f} times that of a uniform load"
    return f"{text}, {quantity('loaded_share').named(numbers['loaded_share'])}; "
