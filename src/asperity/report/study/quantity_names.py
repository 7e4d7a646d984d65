"""Readable names, units and values of swept quantities."""

from asperity.study import SEED_FACTOR, SweptAxis

NAMES = {  # by key, or by its last part
    "sq": "Sq",
    "alpha": "pressure-viscosity α",
    "lubricant.viscosity.alpha": "pressure-viscosity α",
    "surface.correlation_length": "correlation length",
    "eta0": "viscosity η0",
    "slip": "slide-to-roll ratio",
    "x": "domain along rolling (half-widths)",
    "material.hardness": "hardness",
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
    """Return the name of a swept quantity with the unit in which it was given."""
    last = axis.key.rpartition(".")[2]
    name = NAMES.get(axis.key, NAMES.get(last, last.replace("_", " ")))
    return f"{name} [{UNITS.get(axis.unit, axis.unit)}]" if axis.unit else name


def value_label(axis: SweptAxis, value: float) -> str:
    """Return the label of a value of an axis."""
    return axis.names[int(value)] if axis.names else f"{value:.4g}".replace("-", "−")
