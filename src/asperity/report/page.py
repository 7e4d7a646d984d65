"""One HTML page from solved runs: what was found, how, how well, and what the model leaves out.

The page is self-contained and loads nothing. Numbers are those of `Run.scalars`, in display units; figures come from
`asperity.report.figures`. Nothing is solved or fitted here.
"""

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from matplotlib.figure import Figure

from asperity.conditions import ContactConditions
from asperity.coupling import VibrationModel
from asperity.ehl import ContactSolution
from asperity.errors import BadInput
from asperity.files import require_writable, whole_file
from asperity.lubricant import LawFamily, Lubricant, Newtonian, Solid, law_name
from asperity.paper import CITATION
from asperity.quantities import parameters
from asperity.report import figures, rubbing_figures

if TYPE_CHECKING:
    from asperity.results import Run

NOT_FOUND = "–"


def write_report(runs: Sequence["Run"], path: str | Path, *, title: str | None = None) -> Path:
    """Write one self-contained HTML page about one or several runs, whole or not at all.

    Parameters
    ----------
    runs : at least one; several are put side by side and drawn against their roughness
    path : the file to write; its folder must exist
    title : heading of the page; without it, the page says what it shows

    Returns
    -------
    Path
        The file written. The same runs and asperity version give the same bytes.

    Raises
    ------
    BadInput
        for no runs, or a path that cannot be written to.
    """
    path = Path(path)
    if not runs:
        raise BadInput("a report needs at least one run, got none; name the run files to show")
    require_writable(path)  # before the figures are drawn
    with whole_file(path) as part:
        part.write_text(render_page(runs, title=title), encoding="utf-8", newline="\n")
    return path


def render_page(runs: Sequence["Run"], *, title: str | None = None) -> str:
    """The page as HTML text."""
    scalars = [run.scalars() for run in runs]
    labels = _labels(scalars)
    return page_template("page.html.j2").render(
        title=title or _title(scalars),
        version=version("asperity"),
        runs=[_RunView(run, label, f"run-{n}") for n, (run, label) in enumerate(zip(runs, labels, strict=True), 1)],
        overview=_overview(runs, scalars) if len({run.state.sq for run in runs}) > 1 else [],
        numbers=[quantity.row(scalars) for quantity in QUANTITIES],
        conditions=_side_by_side([_conditions(run) for run in runs]),
        lubricated=any(run.solution.lubricant is not None for run in runs),
        newtonian=any(
            run.solution.lubricant and isinstance(run.solution.lubricant.rheology, Newtonian) for run in runs
        ),
        isothermal=any(run.solution.lubricant and not run.case.thermal.feedback for run in runs),
        sphere=any(run.case.vibration and run.case.vibration.stiffness_law.point_spring for run in runs),
        line=any(run.solution.conditions.geometry == "line" for run in runs),
        imbalance=_span([one["mass_flux_imbalance"] for one in scalars]),
        paper=CITATION,
    )


def page_template(name: str) -> Template:
    """A template of a page, of which all are escaped and complete."""
    environment = Environment(
        loader=PackageLoader("asperity.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


# Numbers -------------------------------------------------------------------------------------------------------------

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def power_of_ten(value: float, digits: int = 1) -> str:
    """1.3e-05 as 1.3×10⁻⁵."""
    mantissa, exponent = _signed(value, f".{digits}e").split("e")
    return "0" if value == 0.0 else f"{mantissa}×10{str(int(exponent.replace('−', '-'))).translate(SUPERSCRIPTS)}"


def with_deviation(value: float, deviation: float | None) -> tuple[str, str]:
    """A value and its standard deviation, both to the deviation's second digit and the same power of ten.

    Without a deviation the value has four digits, and the second text is empty.
    """
    exponent = floor(log10(abs(value))) if value != 0.0 and not 1e-2 <= abs(value) < 1e6 else 0
    power = f"×10{str(exponent).translate(SUPERSCRIPTS)}" if exponent else ""
    scaled = value / 10.0**exponent
    if deviation is None or not 0.0 < deviation < float("inf"):
        return f"{scaled:.4g}{power}", ""
    spread = deviation / 10.0**exponent
    decimals = max(0, 1 - floor(log10(spread)))
    return f"{scaled:.{decimals}f}{power}", f"± {spread:.{decimals}f}{power}"


def in_print(text: str) -> str:
    """Prose with 1.3e-05 as 1.3×10⁻⁵, and numbers that stay on one line with their unit."""
    text = re.sub(
        r"\b\d(\.\d+)?e[+-]\d+", lambda number: power_of_ten(float(number[0]), len(number[1] or ".") - 1), text
    )
    return re.sub(r"(?<=\d) (?=[%±]|Hz|GPa|[µn]m\b)|(?<=±) ", "\N{NO-BREAK SPACE}", text)


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _signed(value: float, form: str) -> str:
    return format(value, form).replace("-", "−")


def _span(shares: Sequence[Any]) -> str:
    lowest, highest = _percent(min(shares)), _percent(max(shares))
    return lowest if lowest == highest else f"{lowest} to {highest}"


@dataclass(frozen=True, slots=True)
class _Row:
    name: str
    meaning: str
    unit: str
    cells: list[str]


@dataclass(frozen=True, slots=True)
class Quantity:
    """One line of the table: the key of `Run.scalars`, how it is shown, and what it means."""

    key: str
    name: str
    unit: str
    meaning: str
    scale: float = 1.0
    form: str | Callable[[float], str] = ".3f"
    deviation: str | None = None
    error: str | None = None

    def show(self, scalars: Mapping[str, Any]) -> str:
        """The value in display units, without its unit."""
        value = scalars[self.key]
        if value is None:
            return NOT_FOUND
        if isinstance(value, bool):
            return "yes" if value else "NO"
        value = value * self.scale
        if self.deviation is not None:
            return " ".join(with_deviation(value, scalars[self.deviation])).rstrip()
        shown = self.form(value) if callable(self.form) else format(value, self.form)
        if self.error is None or scalars[self.error] is None:
            return shown
        assert isinstance(self.form, str)  # what has an error bar has decimals
        error = format(scalars[self.error] * self.scale, self.form)
        return f"{shown} ± {error}" if float(error) > 0.0 else shown

    def row(self, scalars: Sequence[Mapping[str, Any]]) -> _Row:
        """The line of the table for several runs."""
        return _Row(self.name, self.meaning, self.unit, [self.show(one) for one in scalars])


QUANTITIES = (
    Quantity(
        "clr",
        "Load share of asperities, CLR",
        "%",
        "load on contact cells over the whole load",
        100.0,
        ".1f",
        error="clr_error",
    ),
    Quantity(
        "capped_oil_load_ratio",
        "Load on oil at the pressure cap",
        "%",
        "in cells that do not touch; not part of CLR",
        100.0,
        ".1f",
    ),
    Quantity(
        "car",
        "Contact area share in the Hertz zone, CAR",
        "%",
        "contact cells over all cells there",
        100.0,
        ".1f",
        error="car_error",
    ),
    Quantity(
        "car_domain",
        "Contact area of the whole domain",
        "%",
        "over the Hertz area; outside it too",
        100.0,
        ".1f",
    ),
    Quantity("sq_m", "Composite roughness, Sq", "µm", "root-mean-square height before deformation", 1e6),
    Quantity("h_min_m", "Smallest film, h min", "µm", "smallest gap anywhere", 1e6, error="h_min_error_m"),
    Quantity(
        "h_central_m", "Central film", "µm", "mean gap in a tenth of the Hertz zone", 1e6, error="h_central_error_m"
    ),
    Quantity("h_mean_m", "Mean film", "µm", "mean gap in the Hertz zone", 1e6),
    Quantity("lambda_ratio", "Film ratio, Λ", "", "least film of the smooth contact (usual fit) over Sq", 1.0, ".2f"),
    Quantity("p_max_pa", "Largest pressure", "GPa", "oil and asperities together", 1e-9),
    Quantity("friction_coefficient", "Friction coefficient", "", "shear force along rolling over the load", 1.0, ".4f"),
    Quantity("friction_asperity_part", "… from asperities", "", "shear of touching cells", 1.0, ".4f"),
    Quantity("friction_oil_part", "… from the oil", "", "shear of the film", 1.0, ".4f"),
    Quantity("friction_power_w", "Heat of friction", "W", "shear force times sliding speed", 1.0, ".3g"),
    Quantity(
        "flash_temperature_max_k", "Flash temperature", "K", "largest rise of a surface above its body", 1.0, ".1f"
    ),
    Quantity("film_temperature_max_k", "Film temperature", "K", "largest rise of the film above ambient", 1.0, ".1f"),
    Quantity("von_mises_max_pa", "Largest von Mises stress", "GPa", "in body 1, taken as elastic", 1e-9),
    Quantity("von_mises_depth_m", "… at the depth", "µm", "below the surface", 1e6, ".2f"),
    Quantity("von_mises_core_pa", "Von Mises stress of the core", "GPa", "largest from a tenth of a down", 1e-9),
    Quantity("von_mises_core_depth_m", "… at the depth", "µm", "below the surface", 1e6, ".2f"),
    Quantity("crf_hz", "Contact resonance frequency, CRF", "Hz", "of one simulated record", deviation="crf_std_hz"),
    Quantity(
        "crfa", "Resonance amplitude, CRFA", "(m/s²)²/Hz", "acceleration density at the CRF", deviation="crfa_std"
    ),
    Quantity("converged", "Converged", "", "residual, load error and change all below the tolerance"),
    Quantity("iterations", "Newton steps", "", "on all grid levels together", 1.0, ".0f"),
    Quantity(
        "reynolds_residual", "Reynolds residual", "", "root mean square, as a share of Hertz's p max", 1.0, power_of_ten
    ),
    Quantity("load_error", "Load error", "", "carried against applied load", 1.0, power_of_ten),
    Quantity(
        "mass_flux_imbalance",
        "Oil-flow imbalance",
        "%",
        "oil lost or re-created in the Hertz zone, over oil carried through",
        100.0,
        ".1f",
    ),
    Quantity("seconds", "Time to solve", "s", "wall clock", 1.0, ".2f"),
)
TILES = {
    "clr": "Load share, CLR",
    "car": "Area share, CAR",
    "h_mean_m": "Mean film",
    "lambda_ratio": "Film ratio, Λ",
    "friction_coefficient": "Friction coefficient",
    "flash_temperature_max_k": "Flash temperature",
    "crf_hz": "Resonance, CRF",
    "crfa": "Amplitude, CRFA",
}


# One run -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Tile:
    """A number that stands out on a page."""

    name: str
    value: str
    rest: str  # deviation and unit


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure as the page needs it; `width` and `height` in CSS pixels keep its place while it loads."""

    uri: str
    width: int
    height: int
    alt: str
    caption: str


def picture(figure: Figure, caption: str, alt: str) -> Picture:
    """A figure as a page embeds it."""
    text = re.sub(r"^.*?(?=<svg)", "", figures.svg(figure), flags=re.DOTALL)  # an image needs no XML prologue
    width, height = figure.get_size_inches() * 96.0
    uri = "data:image/svg+xml," + quote(re.sub(r"\s*\n\s*", " ", text), safe=" ='/:;,.()+-*!@?&$[]{}|~^`")
    return Picture(uri, round(float(width)), round(float(height)), in_print(alt), in_print(caption))


class _RunView:
    """What the template shows of one run."""

    def __init__(self, run: "Run", label: str, anchor: str) -> None:
        scalars = run.scalars()
        self.label = label
        self.anchor = anchor
        self.verdict = in_print(run.verdict())
        self.converged = bool(scalars["converged"])
        self.ending = in_print(run.solution.convergence.explain()).capitalize()
        self.tiles = [_tile(quantity, scalars) for quantity in QUANTITIES if quantity.key in TILES]
        self.pictures = _run_pictures(run, scalars)
        self.notes = [in_print(note[:1].upper() + note[1:]) for note in (*run.remarks, *_silence(run))]
        self.case_text = run.case.text


def _tile(quantity: Quantity, scalars: Mapping[str, Any]) -> Tile:
    value, _, deviation = quantity.show(scalars).partition(" ")
    unit = "" if value == NOT_FOUND else quantity.unit
    return Tile(TILES[quantity.key], value, f"{deviation} {unit}".strip())


def _run_pictures(run: "Run", scalars: Mapping[str, Any]) -> list[Picture]:
    solution = run.solution
    shares = figures.zone_shares(solution)
    dry = solution.lubricant is None
    zone = "The dashed lines bound the Hertz zone; oil enters from the left."
    return [
        picture(
            figures.contact_map(solution),
            "Contact state, shares of the Hertz zone. A cell counts as contact where the gap is at most "
            f"{solution.options.contact_film * 1e9:g} nm. {zone}",
            f"Map of the contact: asperities touch on {_percent(shares.contact)} of the Hertz zone, "
            + (
                "the rest is open."
                if dry
                else f"oil fills {_percent(shares.film)}, {_percent(shares.cavitated)} has cavitated."
            ),
        ),
        picture(
            figures.film_map(solution),
            "Gap between the deformed surfaces. The colours end at the Hertz zone's 99th percentile.",
            f"Map of the film thickness: mean {scalars['h_mean_m'] * 1e6:.3f} µm in the Hertz zone, "
            f"smallest {scalars['h_min_m'] * 1e6:.3f} µm.",
        ),
        picture(
            figures.pressure_map(solution),
            "Pressure of oil and asperities together." + _capped_oil(run),
            f"Map of the pressure: at most {scalars['p_max_pa'] * 1e-9:.3f} GPa; Hertz's would be "
            f"{solution.conditions.hertz.p_max * 1e-9:.3f} GPa.",
        ),
        picture(
            figures.centre_line(solution),
            "Pressure and gap along rolling through the middle. The gap's axis ends where the Hertz zone's gaps do.",
            "Curves along rolling: pressure with the dashed Hertz ellipse, and below it the gap with contact marked.",
        ),
        picture(
            figures.roughness_map(solution),
            "The composite roughness of both surfaces before they deform, material up.",
            f"Map of the roughness heights, Sq {scalars['sq_m'] * 1e6:.3f} µm.",
        ),
        picture(
            figures.height_distribution(solution.surface.heights),
            "Distribution of the heights in the map, with the Gaussian of the same Sq dashed.",
            f"Histogram of the heights, Sq {scalars['sq_m'] * 1e6:.3f} µm, beside a Gaussian curve.",
        ),
        *_rubbing_pictures(run),
        *_stress_pictures(run),
        *_spectrum_picture(run),
        picture(
            figures.convergence_history(solution.convergence),
            f"How the solver got there: {solution.convergence.explain()}.",
            f"Residual, load error and change against the Newton step: {solution.convergence.explain()}.",
        ),
    ]


def _capped_oil(run: "Run") -> str:
    """What CLR leaves out: load on oil films that stand at the pressure cap."""
    if run.solution.p_cap is None or run.solution.lubricant is None:
        return ""
    share = _percent(run.state.capped_oil_load_ratio)
    return f" Cells that stand at the hardness without touching carry {share} of the load; CLR leaves them out."


def _rubbing_pictures(run: "Run") -> list[Picture]:
    solution, rubbing, heat = run.solution, run.friction, run.heat
    if rubbing is None or heat is None or solution.conditions.sliding_speed == 0.0:
        return []
    sliding = solution.conditions.sliding_speed
    return [
        picture(
            rubbing_figures.traction_map(solution, rubbing),
            f"Shear stress of sliding at {sliding:.3g} m/s on both surfaces: {rubbing.boundary_friction:g} times "
            f"the pressure where they touch (friction {rubbing.asperity_part:.4f}), the oil's own elsewhere "
            f"({rubbing.oil_part:.4f}).",
            f"Map of the shear stress: friction coefficient {rubbing.coefficient:.4f}.",
        ),
        picture(
            rubbing_figures.temperature_map(solution, heat),
            f"Temperature of the hotter surface. Friction makes {rubbing.power:.3g} W; {heat.heat_1_w:.3g} W flow into "
            f"body 1 and {heat.heat_2_w:.3g} W into body 2.",
            f"Map of the flash temperature: at most {heat.max_k:.1f} K above the body.",
        ),
        picture(
            rubbing_figures.temperature_line(solution, heat),
            "Temperatures along rolling through the hottest cell. The slower surface stays longer in the heat; the "
            "film can be hotter than both, as the heat is made within it.",
            f"Curves of both surfaces' temperatures along rolling; the film's largest rise is {heat.film_max_k:.1f} K.",
        ),
    ]


def _stress_pictures(run: "Run") -> list[Picture]:
    solution, stress = run.solution, run.stress
    peak = f"{stress.peak.value * 1e-9:.3f} GPa, {stress.peak.depth * 1e6:.2f} µm deep"
    dx, dy = solution.grid.spacing
    return [
        picture(
            rubbing_figures.stress_map(solution, stress),
            "The largest von Mises stress below each cell, of sixteen depths in body 1. Pressure and "
            "friction load an elastic, smooth half-space: above its yield stress the material would flow.",
            f"Map of the largest von Mises stress below the surface: {peak}.",
        ),
        picture(
            rubbing_figures.stress_section(solution, stress),
            f"Von Mises stress below the surface, in the plane along rolling that holds the largest: {peak} (circle).",
            f"Section of the von Mises stress along rolling and depth: largest {peak}.",
        ),
        picture(
            rubbing_figures.stress_over_depth(solution, stress),
            "The largest von Mises stress at each depth. Asperities raise it near the surface; at their edges it grows "
            f"with a finer grid (here {dx * 1e6:.2g} × {dy * 1e6:.2g} µm), from a tenth of the half-width down it does "
            "not.",
            f"Curve of the largest von Mises stress over depth beside that of Hertz's contact: {peak}.",
        ),
    ]


def _spectrum_picture(run: "Run") -> list[Picture]:
    vibration = run.vibration
    if vibration is None or vibration.spectrum is None:
        return []
    (low, high), words = vibration.band_hz, run.resonance_in_words()
    spectrum = vibration.spectrum
    caption = (
        f"Acceleration spectrum of a simulated record of {spectrum.duration_s:g} s, resolution "
        f"{spectrum.resolution_hz:.3g} Hz: {words}. Searched from {low:.0f} to {high:.0f} Hz, where this contact can "
        f"resonate; asperities that carry the whole load would give {vibration.full_load_crf_hz:.0f} Hz."
    )
    alt = f"Acceleration spectrum around the search band {low:.0f} to {high:.0f} Hz: {words}."
    return [picture(figures.spectrum(vibration), caption, alt)]


def _silence(run: "Run") -> list[str]:
    """Why a figure is not there."""
    reasons = []
    if run.friction_failure is not None:
        reasons.append(f"There is no friction and no temperature to show: {run.friction_failure}.")
    elif run.solution.conditions.sliding_speed == 0.0:
        reasons.append("There is no friction to show: both surfaces move at the same speed.")
    if run.vibration is not None and run.vibration.spectrum is None:
        reasons.append(f"There is no spectrum to show: {run.vibration.resonance.reason}.")
    return reasons


# Several runs --------------------------------------------------------------------------------------------------------


def _labels(scalars: Sequence[Mapping[str, Any]]) -> list[str]:
    rough = [f"Sq {one['sq_m'] * 1e6:.2f} µm" for one in scalars]
    return rough if len(rough) == 1 else [f"{number}. {label}" for number, label in enumerate(rough, 1)]


def _title(scalars: Sequence[Mapping[str, Any]]) -> str:
    rough = [one["sq_m"] * 1e6 for one in scalars]
    low, high = f"{min(rough):.2f}", f"{max(rough):.2f}"
    heights = f"Sq {low} µm" if low == high else f"Sq {low} to {high} µm"
    return f"Rough lubricated contact{f': {len(rough)} runs' if len(rough) > 1 else ''}, {heights}"


def _overview(runs: Sequence["Run"], scalars: Sequence[Mapping[str, Any]]) -> list[Picture]:
    full_load = {run.vibration.full_load_crf_hz for run in runs if run.vibration is not None}
    unfinished = " Hollow markers are runs that did not converge." if not all(s["converged"] for s in scalars) else ""
    return [
        picture(
            figures.shares_against_roughness(scalars),
            "Share of the load (CLR) and of the Hertz zone (CAR) that asperities take, one surface each." + unfinished,
            "CLR and CAR against Sq: "
            + "; ".join(
                f"at {s['sq_m'] * 1e6:.2f} µm CLR {_percent(s['clr'])} and CAR {_percent(s['car'])}" for s in scalars
            ) + ".",
        ),
        picture(
            figures.resonance_against_roughness(scalars, full_load.pop() if len(full_load) == 1 else None),
            "Contact resonance frequency with two standard deviations of its fit." + unfinished,
            "CRF against Sq: "
            + "; ".join(
                f"at {s['sq_m'] * 1e6:.2f} µm " + ("not found" if s["crf_hz"] is None else f"{s['crf_hz']:.0f} Hz")
                for s in scalars
            ) + ".",
        ),
        *_friction_overview(scalars),
    ]  # fmt: skip


def _friction_overview(scalars: Sequence[Mapping[str, Any]]) -> list[Picture]:
    rubbing = [one for one in scalars if one["friction_coefficient"]]
    if not rubbing:
        return []
    return [
        picture(
            rubbing_figures.friction_against_roughness(rubbing),
            "Friction coefficient, and what asperities and oil contribute to it.",
            "Friction coefficient against Sq: "
            + "; ".join(f"at {s['sq_m'] * 1e6:.2f} µm {s['friction_coefficient']:.4f}" for s in rubbing) + ".",
        )
    ]  # fmt: skip


# Conditions ----------------------------------------------------------------------------------------------------------


def _law(family: LawFamily, law: object) -> str:
    values = ((name, mark, getattr(law, name)) for name, mark in parameters(type(law)))
    stated = (f"{mark.symbol or name} = {mark.text(value)}" for name, mark, value in values if value is not None)
    return ", ".join([law_name(family, law), *stated])


def _pair(values: tuple[float, float], unit: str = "", scale: float = 1.0) -> str:
    return _both([f"{value * scale:.4g} {unit}".rstrip() for value in values])


def _both(texts: Sequence[str]) -> str:
    different = list(dict.fromkeys(texts))
    return " and ".join(different) if len(different) > 1 else f"{different[0]} (both)"


def _contact_rows(conditions: ContactConditions) -> dict[str, str]:
    pair, hertz, hardness = conditions.pair, conditions.hertz, conditions.hardness
    contact = f"{conditions.geometry} contact, effective radius {conditions.radius_along_rolling * 1e3:.4g} mm"
    if conditions.geometry == "elliptic":
        contact += f" along rolling, {conditions.radius_across_rolling * 1e3:.4g} mm across"
    load = f"{conditions.load:.4g} N"
    if conditions.length is not None:
        contact += f", length {conditions.length * 1e3:.4g} mm"
        load += f" ({conditions.line_load * 1e-3:.4g} N/mm)"
    first, second = conditions.surface_speeds
    return {
        "Contact": contact,
        "Load": load,
        "Speeds": f"{first:.4g} and {second:.4g} m/s: entrainment {conditions.entrainment_speed:.4g} m/s, "
        f"slide-to-roll {conditions.slide_to_roll:.3g}",
        "Young's moduli": _pair(pair.youngs_moduli, "GPa", 1e-9),
        "Poisson's ratios": _pair(pair.poisson_ratios),
        "Reduced modulus": f"E* = {pair.reduced_modulus * 1e-9:.5g} GPa (E′ = 2 E* = "
        f"{pair.effective_modulus * 1e-9:.5g} GPa)",
        "Pressure cap (hardness)": "none: purely elastic" if hardness is None else f"{hardness * 1e-9:.4g} GPa",
        "Hertz (smooth, dry)": f"half-width a = {hertz.half_widths[0] * 1e6:.2f} µm"
        + ("" if conditions.geometry == "line" else f", across rolling b = {hertz.half_widths[1] * 1e6:.2f} µm")
        + ", largest pressure "
        f"{hertz.p_max * 1e-9:.4f} GPa",
    }


def _lubricant_rows(lubricant: Lubricant | None) -> dict[str, str]:
    if lubricant is None:
        return {"Lubricant": "none: dry contact"}
    return {
        "Viscosity law": _law("viscosity", lubricant.viscosity),
        "Density law": _law("density", lubricant.density),
        "Rheology": _law("rheology", lubricant.rheology),
        "Friction of the film": _law("friction", lubricant.friction),
    }


def _thermal_rows(run: "Run") -> dict[str, str]:
    thermal = run.case.thermal
    bulk = "" if thermal.bulk is None else f", bodies at {_pair(thermal.bulk, 'K')}"
    solids = [
        f"{name.replace('_', ' ')} {_both([mark.text(getattr(solid, name)) for solid in thermal.solids])}"
        for name, mark in parameters(Solid)
    ]
    rows = {"Boundary friction": f"{run.case.boundary_friction:g}", "Bodies": ", ".join(solids)}
    if run.solution.lubricant is None:
        return rows
    feedback = "the film's heat thins the oil" if thermal.feedback else "heat does not act back on the oil"
    return {
        **rows,
        "Temperature": f"{thermal.ambient:.4g} K ambient{bulk}; {feedback}",
        "Oil and heat": f"conductivity {thermal.oil_conductivity:g} W/m/K, viscosity falls by the law "
        f"{_law('warmth', thermal.warmth)}",
    }


def _numerical_rows(solution: ContactSolution) -> dict[str, str]:
    grid, a = solution.grid, solution.conditions.hertz.half_widths[0]
    (nx, ny), (dx, dy) = grid.cells, grid.spacing
    return {
        "Grid": f"{nx} × {ny} cells of {dx * 1e6:.3g} × {dy * 1e6:.3g} µm",
        "Domain": f"x from {_signed(grid.lower[0] / a, '.2f')} a to {_signed(grid.upper[0] / a, '.2f')} a, "
        f"y from {_signed(grid.lower[1] / a, '.2f')} a to {_signed(grid.upper[1] / a, '.2f')} a"
        + (", repeating in y" if grid.periodic[1] else ""),
        "Contact threshold": f"gap of at most {solution.options.contact_film * 1e9:.4g} nm",
        "Tolerance": power_of_ten(solution.options.tolerance),
    }


def _vibration_rows(model: VibrationModel | None) -> dict[str, str]:
    if model is None:
        return {"Vibration": "not asked for"}
    damping = model.damping_law.summary(model.damping_ratio)
    return {
        "Oscillator": f"mass {model.mass:.4g} kg, {damping}, stiffness law {model.stiffness_law.name}",
        "Excitation": f"{model.excitation.summary}{model.patch.summary}, seed {model.seed}",
        "Record": f"{model.duration_s:.4g} s at {model.rate_hz * 1e-3:.4g} kHz; resonance by {model.method}"
        + ("" if model.response == "exact" else f"; response {model.response}"),
    }


_UNSAID = {"direction_deg": 0.0, "turn": False, "outliers": "keep"}  # what goes without saying


def _roughness(case_text: str) -> str:
    """The case's [surface] in one line: which surface it was belongs beside every CAR."""
    surface = tomllib.loads(case_text)["surface"]
    second = surface.pop("second", None)
    said = _table_in_words(surface)
    return said if second is None else f"{said}; on the other body: {_table_in_words(second)}"


def _table_in_words(table: dict[str, Any]) -> str:
    said = {key: value for key, value in table.items() if _UNSAID.get(key) != value}
    texts = {key: " and ".join(map(str, value)) if isinstance(value, list) else value for key, value in said.items()}
    return ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in texts.items())


def _conditions(run: "Run") -> dict[str, str]:
    solution = run.solution
    return {
        **_contact_rows(solution.conditions),
        **_lubricant_rows(solution.lubricant),
        **_thermal_rows(run),
        "Roughness": f"Sq {solution.surface.sq * 1e6:.4g} µm; case: {_roughness(run.case.text)}",
        **_numerical_rows(solution),
        **_vibration_rows(run.case.vibration),
    }


@dataclass(frozen=True, slots=True)
class _Condition:
    name: str
    cells: list[str]

    @property
    def varies(self) -> bool:
        return len(set(self.cells)) > 1


def _side_by_side(columns: Sequence[Mapping[str, str]]) -> list[_Condition]:
    names = dict.fromkeys(name for column in columns for name in column)
    return [_Condition(name, [column.get(name, NOT_FOUND) for column in columns]) for name in names]
