"""What is swept or varied, as people read it: names of a case's keys, units as they were written, values."""

from asperity.study import SEED_FACTOR, SweptAxis

NAMES = {  # of a key, or of its last part where it is swept
    "sq": "Sq",
    "alpha": "pressure-viscosity α",
    "lubricant.viscosity.alpha": "pressure-viscosity α",
    "surface.correlation_length": "correlation length",
    "eta0": "viscosity η0",
    "slip": "slide-to-roll ratio",
    "x": "domain along rolling (half-widths)",
    "material.hardness": "pressure cap",
    "grid.x[0]": "inlet",
    "solver.contact_film": "contact threshold",
    "vibration.cutoff_exponent": "coupling exponent q",
    "vibration.cutoff_reference": "cut-off at CAR 1",
    SEED_FACTOR: "surface (seed)",
}
UNITS = {
    "um": "µm",
    "degC": "°C",
    "Pa s": "Pa·s",
    "N s/m": "N·s/m",
    "g/cm^3": "g/cm³",
    "kg/m^3": "kg/m³",
}


def axis_label(axis: SweptAxis) -> str:
    """What is swept, with the unit it was written in."""
    last = axis.key.rpartition(".")[2]
    name = NAMES.get(axis.key, NAMES.get(last, last.replace("_", " ")))
    return f"{name} [{UNITS.get(axis.unit, axis.unit)}]" if axis.unit else name


def place_in_words(axis: SweptAxis, value: float) -> str:
    """A value of an axis as people read it."""
    return axis.names[int(value)] if axis.names else f"{value:.4g}".replace("-", "−")
