"""Table of a run's conditions, in words and display units."""

import math
import tomllib
from collections.abc import Sequence

from asperity.contact.conditions import ContactConditions
from asperity.core.documents import Table
from asperity.core.quantities import NO_VALUE, parameters, quantity, with_deviation
from asperity.coupling import VibrationModel
from asperity.ehl import ContactSolution
from asperity.lubricant import ZERO_CELSIUS, LawFamily, Lubricant, Solid, law_name
from asperity.report.base import heading
from asperity.results import Run

OMITTED_DEFAULTS = {"direction_deg": 0.0, "turn": False, "outliers": "keep"}  # of a surface


def conditions_table(runs: Sequence[Run]) -> dict[str, list[str]]:
    """Return the conditions of each run by name; a single cell where all runs agree."""
    columns = [_conditions(run) for run in runs]
    names = dict.fromkeys(name for column in columns for name in column)
    rows = {name: [column.get(name, NO_VALUE) for column in columns] for name in names}
    return {name: cells if len(set(cells)) > 1 else cells[:1] for name, cells in rows.items()}


def _conditions(run: Run) -> dict[str, str]:
    solution = run.solution
    return {
        **_contact_rows(solution.conditions),
        **_solid_rows(solution.conditions),
        **{f"{name[0].upper()}{name[1:]}": value for name, value in run.card.rows()[1:]},
        **_lubricant_rows(solution.lubricant),
        **_oil_rows(run),
        **_thermal_rows(run),
        "Roughness": f"{quantity('sq_m').named(solution.surface.sq)}; case: "
        f"{_roughness(run.case.text)}",
        **_numerical_rows(solution),
        **_vibration_rows(run.case.vibration),
    }


def _law(family: LawFamily, law: object) -> str:
    values = ((name, entry, getattr(law, name)) for name, entry in parameters(type(law)).items())
    constants = (
        f"{entry.symbol or name} = {entry.text(value)}"
        for name, entry, value in values
        if value is not None
    )
    return ", ".join([law_name(family, law), *constants])


def _both(texts: Sequence[str]) -> str:
    """Join the values of both bodies, or state once what they share."""
    distinct = dict.fromkeys(texts)
    return " and ".join(distinct) if len(distinct) > 1 else f"{texts[0]} (both)"


def _contact_rows(conditions: ContactConditions) -> dict[str, str]:
    radius = quantity("radius_m")
    radius_along = radius.text(conditions.radius_along_rolling)
    contact = f"{conditions.geometry} contact, effective radius {radius_along}"
    if conditions.geometry == "elliptic":
        contact += f" along rolling, {radius.text(conditions.radius_across_rolling)} across"
    load = quantity("load_n").text(conditions.load)
    if conditions.length is not None:
        contact += f", length {quantity('length_m').text(conditions.length)}"
        load += f" ({quantity('line_load_n_per_m').text(conditions.line_load)})"
    speeds = " and ".join(map(quantity("surface_speed_m_s").text, conditions.surface_speeds))
    mean = quantity("entrainment_speed_m_s")
    slip = quantity("slide_to_roll")
    shape = (
        {"Shape along the roller": _shape(conditions)} if conditions.geometry == "roller" else {}
    )
    return {
        "Contact": contact,
        **shape,
        "Load": load,
        "Speeds": f"{speeds}: {mean.name} {mean.text(conditions.entrainment_speed)}, "
        f"{slip.name} {slip.text(conditions.slide_to_roll)}",
    }


def _solid_rows(conditions: ContactConditions) -> dict[str, str]:
    """Return elastic constants, hardness, and the smooth, dry contact that follows from them."""
    pair = conditions.pair
    hertz = conditions.hertz
    modulus = quantity("reduced_modulus_pa")
    half_widths = [quantity("half_width_m").text(half_width) for half_width in hertz.half_widths]
    across = "" if conditions.long else f", across rolling b = {half_widths[1]}"
    return {
        "Young's moduli": _both(
            [quantity("youngs_modulus_pa").text(modulus_pa) for modulus_pa in pair.youngs_moduli]
        ),
        "Poisson's ratios": _both(
            [quantity("poisson_ratio").text(ratio) for ratio in pair.poisson_ratios]
        ),
        "Reduced modulus": f"E* = {modulus.text(pair.reduced_modulus)} "
        f"(E′ = 2 E* = {modulus.text(pair.effective_modulus)})",
        "Pressure cap (hardness)": "none: purely elastic"
        if conditions.hardness is None
        else quantity("hardness_pa").text(conditions.hardness),
        "Hertz (smooth, dry)": f"half-width a = {half_widths[0]}{across}, maximum pressure "
        f"{quantity('hertz_pressure_pa').text(hertz.p_max)}",
    }


def _shape(conditions: ContactConditions) -> str:
    """Describe the profile of a roller along its length."""
    shape = conditions.roller
    drop = quantity("height_m")
    length = quantity("length_m")
    parts = []
    if shape.amplitude > 0.0:
        end_text = (
            "unbounded at the ends"
            if shape.end_drop is None
            else f"{drop.text(shape.end_drop)} at the ends"
        )
        parts.append(f"logarithmic drop of amplitude {drop.text(shape.amplitude)}, {end_text}")
    if shape.crown_radius is not None:
        parts.append(f"circular crown of radius {length.text(shape.crown_radius)}")
    if shape.flat > 0.0:
        parts.append(f"straight middle of {length.text(shape.flat)}")
    if shape.chamfer > 0.0:
        parts.append(
            f"chamfers of {length.text(shape.chamfer)} at {math.degrees(shape.chamfer_angle):.3g} "
            "degrees"
        )
    if shape.tilt != 0.0:
        parts.append(f"tilted by {1e3 * shape.tilt:.3g} mrad")
    return ", ".join(parts) or "straight"


def _lubricant_rows(lubricant: Lubricant | None) -> dict[str, str]:
    if lubricant is None:
        return {"Lubricant": "none: dry contact"}
    return {
        "Viscosity law": _law("viscosity", lubricant.viscosity),
        "Density law": _law("density", lubricant.density),
        "Rheology": _law("rheology", lubricant.rheology),
        "Friction of the film": _law("friction", lubricant.friction),
    }


def _oil_rows(run: Run) -> dict[str, str]:
    """Return the properties of an oil given by its data sheet, grouped by their origin."""
    rows: dict[str, list[str]] = {}
    for fact in run.case.oil_facts:
        rows.setdefault(f"Oil, {fact.origin}", []).append(str(fact))
    return {name: "; ".join(texts) for name, texts in rows.items()}


def _thermal_rows(run: Run) -> dict[str, str]:
    thermal = run.case.thermal
    solids = [
        f"{name.replace('_', ' ')} "
        f"{_both([entry.text(getattr(solid, name)) for solid in thermal.solids])}"
        for name, entry in parameters(Solid).items()
    ]
    boundary = quantity("boundary_friction")
    rows = {
        heading(boundary): boundary.text(run.case.boundary_friction),
        "Bodies": ", ".join(solids),
    }
    if run.solution.lubricant is None:
        return rows
    bulk = (
        ""
        if thermal.bulk is None
        else f", bodies at {_both([_temperature(kelvin) for kelvin in thermal.bulk])}"
    )
    feedback = (
        "frictional heat reduces the viscosity"
        if thermal.feedback
        else "viscosity independent of frictional heat"
    )
    return {
        **rows,
        "Temperature": f"{_temperature(thermal.ambient)} ambient{bulk}; {feedback}",
        "Oil, thermal": "conductivity "
        f"{quantity('oil_conductivity_w_m_k').text(thermal.oil_conductivity)}, "
        f"viscosity over temperature: {_law('warmth', thermal.warmth)}",
    }


def _temperature(kelvin: float) -> str:
    """Return a temperature in degrees Celsius and kelvin."""
    celsius = with_deviation(kelvin - ZERO_CELSIUS, None)
    return f"{celsius} °C ({quantity('oil_temperature_k').text(kelvin)})"


def _numerical_rows(solution: ContactSolution) -> dict[str, str]:
    grid = solution.grid
    a = solution.conditions.hertz.half_widths[0]
    cell = quantity("cell_m")
    (nx, ny), (dx, dy) = grid.cells, grid.spacing
    limits = [
        [with_deviation(end / a, None, ".2f") for end in corner]
        for corner in (grid.lower, grid.upper)
    ]
    sides = (
        f"{axis} from {lower} a to {upper} a"
        for axis, lower, upper in zip("xy", *limits, strict=True)
    )
    return {
        "Grid": f"{nx} × {ny} cells of {cell.number(dx)} × {cell.text(dy)}",
        "Domain": ", ".join(sides) + (", repeating in y" if grid.periodic[1] else ""),
        "Contact threshold": "gap of at most "
        f"{quantity('contact_film_m').text(solution.options.contact_film)}",
        "Tolerance": with_deviation(solution.options.tolerance, None, ".1e"),
    }


def _vibration_rows(model: VibrationModel | None) -> dict[str, str]:
    if model is None:
        return {"Vibration": "not requested"}
    damping = model.damping_law.summary(model.damping_ratio)
    duration = quantity("duration_s").text(model.duration_s)
    rate = quantity("record_rate_hz").text(model.rate_hz)
    return {
        "Oscillator": f"{quantity('mass_kg').name} {quantity('mass_kg').text(model.mass)}, "
        f"{damping}, stiffness law {model.stiffness_law.name}",
        "Excitation": f"{model.excitation.summary}{model.patch.summary}, seed {model.seed}",
        "Record": f"{duration} at {rate}; resonance by {model.method}"
        + ("" if model.response == "exact" else f"; response {model.response}"),
    }


def _roughness(case_text: str) -> str:
    """Describe the case's [surface] in one line: CAR depends on it."""
    surface = tomllib.loads(case_text)["surface"]
    second = surface.pop("second", None)
    other = f"; on the other body: {_table_in_words(second)}" if second is not None else ""
    return f"{_table_in_words(surface)}{other}"


def _table_in_words(table: Table) -> str:
    entries = {key: value for key, value in table.items() if OMITTED_DEFAULTS.get(key) != value}
    texts = {
        key: " and ".join(map(str, value)) if isinstance(value, list) else value
        for key, value in entries.items()
    }
    return ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in texts.items())
