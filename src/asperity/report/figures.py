"""The figures of a report: each function takes solved or measured things in SI and returns a matplotlib Figure.

Display units (um, GPa, Hz) begin here and end here. Figures are narrow on purpose: two stand side by side on a page,
and one alone is still readable on a telephone. What a figure says is left to the page, where it goes to `svg`.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from asperity.arrays import Field, Mask
from asperity.coupling import Vibration
from asperity.ehl import ContactSolution, Convergence, hertz_zone
from asperity.errors import BadInput
from asperity.files import whole_file
from asperity.hertz import line_pressure
from asperity.surface import MeasuredSurface, SurfaceDescription, SurfaceSpectrum, bearing_curve, surface_spectrum

WIDTH = 4.8  # inches
MICRO = 1e6  # m -> um
GIGA = 1e-9  # Pa -> GPa

# Okabe and Ito's colours, told apart with any colour vision; every line also has its own stroke or marker.
BLUE, VERMILION, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#6b7280"
# The paper's Fig 6 has oil in red and asperities in yellow. These differ in lightness too, for grey printers.
CONTACT_COLOUR, OIL_COLOUR, CAVITY_COLOUR, CAVITY_STRIPE = "#f7dc4a", "#c8452f", "#33415c", "#8b9cb8"
GAP_COLOUR = "#e5e7eb"  # of a dry contact

STYLE: Any = {
    "svg.hashsalt": "asperity",  # the same run gives the same bytes
    "svg.fonttype": "none",  # text stays text: smaller, and legible at any zoom
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.4,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "hatch.linewidth": 0.5,
}


@contextmanager
def styled() -> Iterator[None]:
    """The look of every figure on a page."""
    with matplotlib.rc_context(STYLE):
        yield


@styled()
def svg(figure: Figure) -> str:
    """The figure as SVG text, the same bytes for the same figure."""
    text = StringIO()
    figure.savefig(text, format="svg", dpi=220, metadata={"Date": None, "Creator": None})
    return text.getvalue()


# Shares of the Hertz zone --------------------------------------------------------------------------------------------


class ZoneShares(NamedTuple):
    """Shares of the cells in the Hertz zone that are asperity contact, ruptured oil, and neither."""

    contact: float
    cavitated: float
    film: float


def zone_shares(solution: ContactSolution) -> ZoneShares:
    """What the Hertz zone is made of; `contact` is the state's CAR."""
    zone = hertz_zone(solution.conditions, solution.grid)
    contact = float(solution.in_contact[zone].mean())
    cavitated = float(solution.cavitated[zone].mean())
    return ZoneShares(contact, cavitated, 1.0 - contact - cavitated)


# Maps ----------------------------------------------------------------------------------------------------------------


def map_figure(extent: tuple[float, float]) -> tuple[Figure, Axes]:
    """A figure with a map of that extent, all maps of a contact in the same place, and room for a key below."""
    width, below, above = 3.95, 1.0, 0.32
    height = width * min(max(extent[1] / extent[0], 0.15), 1.4)
    figure = Figure(figsize=(WIDTH, below + height + above))
    total = below + height + above
    return figure, figure.add_axes((0.64 / WIDTH, below / total, width / WIDTH, height / total))


def show_map(axes: Axes, values: Field, solution: ContactSolution, **style: Any) -> AxesImage:
    """Draw values of shape (nx, ny) or colours of shape (nx, ny, 3) over the contact, oil coming from the left."""
    (x0, y0), (x1, y1) = solution.grid.lower, solution.grid.upper
    corners = (x0 * MICRO, x1 * MICRO, y0 * MICRO, y1 * MICRO)
    image = axes.imshow(
        np.swapaxes(values, 0, 1), origin="lower", extent=corners, interpolation="none", aspect="equal", **style
    )
    axes.set(xlabel="x along rolling [µm]", ylabel="y [µm]")
    axes.spines[:].set_visible(False)
    return image


def mark_hertz_zone(axes: Axes, solution: ContactSolution, colour: str) -> None:
    """The outline of the smooth, dry contact, dashed."""
    a, b = (half_width * MICRO for half_width in solution.conditions.hertz.half_widths)
    style: dict[str, Any] = {"color": colour, "linestyle": (0, (4, 3)), "linewidth": 1.0}
    if solution.conditions.geometry == "line":
        for side in (-a, a):
            axes.axvline(side, **style)
    else:
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        axes.plot(a * np.cos(turn), b * np.sin(turn), **style)


def colour_bar(figure: Figure, axes: Axes, image: AxesImage, label: str, extend: str = "neither") -> Colorbar:
    """A key to the colours, below the map."""
    box, total = axes.get_position(), figure.get_size_inches()[1]
    place = figure.add_axes((box.x0, 0.42 / total, box.width, 0.11 / total))
    return figure.colorbar(image, cax=place, orientation="horizontal", label=label, extend=extend)


@styled()
def contact_map(solution: ContactSolution) -> Figure:
    """Where asperities touch, where oil fills the gap and where it has ruptured: the paper's Fig 6."""
    figure, axes = map_figure(solution.grid.extent)
    shares = zone_shares(solution)
    dry = solution.lubricant is None

    show_map(axes, contact_colours(solution), solution)
    mark_hertz_zone(axes, solution, "black")

    axes.set_title(f"Asperity contact on {shares.contact:.1%} of the Hertz zone".replace("%", " %"))
    keys: list[Patch | Line2D] = [Patch(color=CONTACT_COLOUR, label=f"asperity contact {100 * shares.contact:.1f} %")]
    if dry:
        keys.append(Patch(facecolor=GAP_COLOUR, label=f"open gap {100 * shares.film:.1f} %"))
    else:
        keys.append(Patch(color=OIL_COLOUR, label=f"oil film {100 * shares.film:.1f} %"))
        keys.append(
            Patch(
                facecolor=CAVITY_COLOUR,
                edgecolor=CAVITY_STRIPE,
                hatch="////",
                label=f"cavitated {100 * shares.cavitated:.1f} %",
            )
        )
    keys.append(Line2D([], [], color="black", linestyle=(0, (4, 3)), linewidth=1.0, label="Hertz zone"))
    figure.legend(handles=keys, loc="lower center", ncols=2, borderaxespad=0.2)
    return figure


def contact_colours(solution: ContactSolution) -> Field:
    """Red, green and blue of every cell, shape (nx, ny, 3): asperity contact, oil, ruptured oil; an open gap if dry."""
    colours = np.empty((*solution.grid.cells, 3))
    colours[:] = to_rgb(GAP_COLOUR if solution.lubricant is None else OIL_COLOUR)
    colours[solution.cavitated] = to_rgb(CAVITY_COLOUR)
    colours[solution.cavitated & _stripes(solution.grid.cells)] = to_rgb(CAVITY_STRIPE)
    colours[solution.in_contact] = to_rgb(CONTACT_COLOUR)
    return colours


def _stripes(cells: tuple[int, int]) -> Mask:
    """Diagonal lines, one part in five wide, about twenty across the map."""
    period = max(cells[0] // 20, 5)
    i, j = np.ogrid[: cells[0], : cells[1]]
    return np.asarray((i + j) % period < max(period // 5, 1))


@styled()
def film_map(solution: ContactSolution) -> Figure:
    """Gap between the deformed surfaces; the colours end where the Hertz zone's gaps do (its 99th percentile)."""
    figure, axes = map_figure(solution.grid.extent)
    zone = hertz_zone(solution.conditions, solution.grid)
    top = float(np.percentile(solution.gap[zone], 99.0)) * MICRO or 1.0
    image = show_map(axes, solution.gap * MICRO, solution, cmap="viridis", vmin=0.0, vmax=top)
    mark_hertz_zone(axes, solution, "white")
    axes.set_title("Gap between the surfaces" if solution.lubricant is None else "Film thickness")
    colour_bar(figure, axes, image, "gap [µm]" if solution.lubricant is None else "film thickness [µm]", "max")
    return figure


@styled()
def pressure_map(solution: ContactSolution) -> Figure:
    """Pressure of oil and asperities together."""
    figure, axes = map_figure(solution.grid.extent)
    image = show_map(axes, solution.pressure * GIGA, solution, cmap="inferno", vmin=0.0)
    mark_hertz_zone(axes, solution, "white")
    axes.set_title(f"Pressure, at most {solution.pressure.max() * GIGA:.2f} GPa")
    colour_bar(figure, axes, image, "pressure [GPa]")
    return figure


@styled()
def roughness_map(solution: ContactSolution) -> Figure:
    """The roughness that was pressed into the contact, before it deformed."""
    figure, axes = map_figure(solution.grid.extent)
    heights = solution.surface.heights * MICRO
    reach = float(np.percentile(np.abs(heights), 99.5)) or 1.0
    image = show_map(axes, heights, solution, cmap="cividis", vmin=-reach, vmax=reach)
    mark_hertz_zone(axes, solution, "white")
    axes.set_title(f"Composite roughness, Sq {solution.surface.sq * MICRO:.2f} µm")
    colour_bar(figure, axes, image, "height, material up [µm]", "both")
    return figure


@styled()
def height_distribution(heights: Field) -> Figure:
    """How often each height [m] occurs, beside the Gaussian of the same Sq."""
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    _draw_height_distribution(figure.add_subplot(), heights)
    return figure


def _draw_height_distribution(axes: Axes, heights: Field) -> None:
    values = (heights[np.isfinite(heights)] - np.nanmean(heights)) * MICRO
    sq = float(values.std())
    axes.set(xlabel="height above the mean [µm]", ylabel="density [1/µm]", title="Height distribution")
    if sq == 0.0:
        axes.text(0.5, 0.5, "perfectly smooth", transform=axes.transAxes, ha="center")
        return
    axes.hist(values, bins=80, range=(-4.5 * sq, 4.5 * sq), density=True, color="#9ec5dd", label="surface")
    grid = np.linspace(-4.5 * sq, 4.5 * sq, 181)
    gauss = np.exp(-0.5 * (grid / sq) ** 2) / (sq * np.sqrt(2.0 * np.pi))
    axes.plot(grid, gauss, "--", color="black", label=f"Gaussian, Sq {sq:.3g} µm")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])  # room for the key
    axes.legend(loc="upper right")


# Lines ---------------------------------------------------------------------------------------------------------------


@styled()
def centre_line(solution: ContactSolution) -> Figure:
    """Pressure and gap along rolling at the cell row nearest y = 0, with Hertz's pressure dashed."""
    figure = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.1, 1.0))
    row = int(np.argmin(np.abs(solution.grid.y)))
    x = solution.grid.x
    half_width, p_hertz = solution.conditions.hertz.half_widths[0], solution.conditions.hertz.p_max
    pressure, gap, touching = solution.pressure[:, row], solution.gap[:, row], solution.in_contact[:, row]

    upper.plot(x * MICRO, pressure * GIGA, color=BLUE, linewidth=1.1, label="solved")
    upper.plot(
        x * MICRO, line_pressure(x, half_width, p_hertz) * GIGA, "--", color="black", label="Hertz (smooth, dry)"
    )
    if solution.p_cap is not None and pressure.max() > 0.5 * solution.p_cap:
        upper.axhline(solution.p_cap * GIGA, color=VERMILION, linestyle=":", label="hardness")
    upper.set(ylabel="pressure [GPa]", ylim=(0.0, None))
    upper.set_title(f"Cut along rolling at y = {solution.grid.y[row] * MICRO:.1f} µm".replace("-", "−"))

    inside = np.abs(x) <= 1.2 * half_width
    top = 1.15 * float(gap[inside].max()) * MICRO or 1.0
    lower.plot(x * MICRO, gap * MICRO, color=GREEN, linestyle="-.", linewidth=1.1, label="gap")
    lower.fill_between(
        x * MICRO, 0.0, 0.06 * top, where=touching, color=CONTACT_COLOUR, edgecolor="black", linewidth=0.3, step="mid",
        label="asperity contact",
    )  # fmt: skip
    lower.set(xlabel="x along rolling [µm]", ylabel="gap [µm]", ylim=(0.0, top))
    lower.set_xlim(max(solution.grid.lower[0], -2.5 * half_width) * MICRO, solution.grid.upper[0] * MICRO)
    keys = [key for axes in (upper, lower) for key in axes.get_legend_handles_labels()[0]]
    figure.legend(handles=keys, loc="outside lower center", ncols=3)
    return figure


@styled()
def convergence_history(convergence: Convergence) -> Figure:
    """Residual, load error and change of every step, grid level after grid level, against the tolerance."""
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    history = convergence.history
    steps = np.arange(1, len(history) + 1)
    rows = (
        ("residual", [step.residual for step in history], "-o", BLUE),
        ("load error", [step.load_error for step in history], "--s", VERMILION),
        ("change", [step.change for step in history], ":^", GREEN),
    )
    sparse = max(len(history) // 60, 1)
    for label, values, stroke, colour in rows:
        shown = np.where(np.asarray(values) > 0.0, values, np.nan)  # a logarithmic axis has no place for exact zeros
        axes.semilogy(steps, shown, stroke, color=colour, markersize=3, markevery=sparse, linewidth=1.0, label=label)
    axes.axhline(convergence.tolerance, color="black", linewidth=0.8, linestyle=(0, (6, 2)), label="tolerance")

    starts = [i for i, step in enumerate(history) if i == 0 or step.cells != history[i - 1].cells]
    crowded = min(np.diff([*starts, len(history)])) < 0.16 * len(history)
    for start in starts:
        nx, ny = history[start].cells
        axes.axvline(start + 0.5, color=GREY, linewidth=0.6)
        axes.annotate(
            f"{nx} × {ny}", (start + 0.5, 0.0), (3, 3), xycoords=("data", "axes fraction"), textcoords="offset points",
            fontsize=8, color="#374151", rotation=90 if crowded else 0,
        )  # fmt: skip
    outcome = "converged" if convergence.converged else f"NOT CONVERGED ({convergence.status})"
    axes.set(xlabel="Newton step", ylabel="relative size [-]", title=f"Convergence: {outcome}")
    axes.set_xlim(0.5, len(history) + 0.5)
    figure.legend(loc="outside lower center", ncols=4)
    return figure


@styled()
def spectrum(vibration: Vibration) -> Figure:
    """Acceleration spectrum around the search band, with the fitted resonance and its two-standard-deviation interval.

    Raises
    ------
    BadInput
        for a contact without a spectrum, which has no touching asperities.
    """
    density, resonance = vibration.spectrum, vibration.resonance
    if density is None:
        raise BadInput(f"there is no spectrum to draw: {resonance.reason}")
    low, high = vibration.band_hz
    figure = Figure(figsize=(WIDTH, 3.5), layout="constrained")
    axes = figure.add_subplot()

    margin = 0.35 * (high - low)
    near = (density.frequency_hz >= low - margin) & (density.frequency_hz <= high + margin)
    together = max(int(np.count_nonzero(near)) // 400, 1)
    frequency, level = (
        mean_of_neighbours(values[near], together) for values in (density.frequency_hz, density.density)
    )
    axes.axvspan(low, high, facecolor="#e8eef4", edgecolor=GREY, linewidth=0.7, label="search band")
    name = "spectrum" if together == 1 else f"spectrum, mean of {together} lines"
    axes.semilogy(frequency, level, color=GREY, linewidth=0.7, label=name)
    axes.set(xlabel="frequency [Hz]", ylabel="acceleration density [(m/s²)²/Hz]", title="No resonance found")

    if resonance.found:
        if np.isfinite(resonance.damping_ratio):  # a highest point has no curve
            fine = np.linspace(low, high, 600)
            axes.semilogy(fine, resonance.curve(fine), color=VERMILION, label="fitted resonance")
        reach = 2.0 * resonance.crf_std_hz
        interval = " ± 2 std" if np.isfinite(reach) else ""
        if interval:
            axes.axvspan(resonance.crf_hz - reach, resonance.crf_hz + reach, color=BLUE, alpha=0.35, linewidth=0)
        axes.axvline(resonance.crf_hz, color=BLUE, linestyle="--", linewidth=1.0, label=f"CRF{interval}")
        axes.set_title(f"Contact resonance at {resonance.crf_hz:.1f} Hz")
    axes.axvline(vibration.full_load_crf_hz, color="black", linestyle=":", linewidth=1.0, label="CRF at full load")
    axes.set_xlim(low - margin, high + margin)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def mean_of_neighbours(values: Field, together: int) -> Field:
    """Means of so many values at a time; a rest is left out."""
    whole = values.size // together * together
    return np.asarray(values[:whole].reshape(-1, together).mean(axis=1))


# Several runs --------------------------------------------------------------------------------------------------------


def draw_against_roughness(
    axes: Axes, points: Sequence[Mapping[str, Any]], key: str, label: str, scale: float, stroke: str, colour: str
) -> None:
    """One curve of a scalar against Sq; hollow markers where the solve did not converge."""
    shown = sorted((point for point in points if point[key] is not None), key=lambda point: float(point["sq_m"]))
    sq = [point["sq_m"] * MICRO for point in shown]
    values = [point[key] * scale for point in shown]
    axes.plot(sq, values, stroke, color=colour, markersize=6, label=label)
    doubtful = [i for i, point in enumerate(shown) if not point["converged"]]
    axes.plot(
        [sq[i] for i in doubtful], [values[i] for i in doubtful], stroke[-1], color=colour, markerfacecolor="white",
        markersize=6,
    )  # fmt: skip
    every = [point["sq_m"] * MICRO for point in points]
    margin = max(0.06 * (max(every) - min(every)), 0.1 * max(every)) or 0.5
    axes.set(xlabel="composite roughness Sq [µm]", xlim=(min(every) - margin, max(every) + margin))


@styled()
def shares_against_roughness(points: Sequence[Mapping[str, Any]]) -> Figure:
    """CLR and CAR of several runs, given as their scalars, against Sq."""
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    draw_against_roughness(axes, points, "clr", "CLR: share of the load", 100.0, "-o", VERMILION)
    draw_against_roughness(axes, points, "car", "CAR: share of the Hertz zone", 100.0, "--s", BLUE)
    axes.set(ylabel="taken by asperities [%]", title="Load and area share of asperities", ylim=(0.0, 100.0))
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled()
def resonance_against_roughness(points: Sequence[Mapping[str, Any]], full_load_crf_hz: float | None) -> Figure:
    """CRF of several runs, given as their scalars, against Sq, with two standard deviations."""
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    draw_against_roughness(axes, points, "crf_hz", "CRF ± 2 std of its fit", 1.0, "-o", VERMILION)
    for point in points:
        if point["crf_hz"] is not None and point["crf_std_hz"] is not None:
            reach = 2.0 * point["crf_std_hz"]
            axes.errorbar(
                point["sq_m"] * MICRO, point["crf_hz"], reach, color=VERMILION, capsize=5, linewidth=1.0, zorder=1
            )
    if full_load_crf_hz is not None:
        axes.axhline(
            full_load_crf_hz, color="black", linestyle=":", linewidth=1.0, label="asperities carry all the load"
        )
    axes.set(ylabel="contact resonance [Hz]", title="Contact resonance frequency")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


# Measured surfaces ---------------------------------------------------------------------------------------------------


@styled()
def surface_map(described: SurfaceDescription, path: Path) -> Path:
    """Write a PNG of a measured surface, levelled: map, profile, bearing curve, radial and directional spectrum.

    Raises
    ------
    BadInput
        for a path that is not a .png, or cannot be written to.
    """
    if path.suffix.lower() != ".png":
        raise BadInput(f"the map is written as PNG, got {path.name}; name a file that ends in .png")
    levelled = described.levelled
    spectrum = surface_spectrum(levelled)
    figure = Figure(figsize=(11.0, 7.4), layout="constrained")
    places = figure.add_gridspec(2, 3, height_ratios=(1.25, 1.0))
    if levelled.uniform is None:
        _draw_levelled_map(figure, figure.add_subplot(places[0, :2]), levelled)
        _draw_lay(figure.add_subplot(places[0, 2], projection="polar"), spectrum)
        _draw_profile(figure.add_subplot(places[1, 0]), levelled, "Profile through the middle, along x")
    else:
        _draw_profile(figure.add_subplot(places[0, :]), levelled, "Levelled profile")
        _draw_height_distribution(figure.add_subplot(places[1, 0]), levelled.profile)
    _draw_bearing_curve(figure.add_subplot(places[1, 1]), described)
    _draw_radial_spectrum(figure.add_subplot(places[1, 2]), spectrum, levelled.uniform is not None)
    dx, dy = (pixel * MICRO for pixel in levelled.grid.spacing)
    nx, ny = levelled.grid.cells
    if levelled.uniform is None:
        size = f"Sq {described.parameters.sq * MICRO:.3g} µm, {nx} × {ny} pixels of {dx:.3g} × {dy:.3g} µm"
    else:
        size = f"profile, Rq {described.parameters.sq * MICRO:.3g} µm, {levelled.profile.size} points"
        size += f" every {min(dx, dy):.3g} µm"
    figure.suptitle(f"{described.path.name}: {size}", x=0.01, ha="left", parse_math=False)
    with whole_file(path) as part:
        figure.savefig(part, format="png", dpi=130, metadata={"Software": None})
    return path


def _draw_levelled_map(figure: Figure, axes: Axes, levelled: MeasuredSurface) -> None:
    heights = levelled.heights * MICRO
    width, height = (side * MICRO for side in levelled.grid.extent)
    reach = float(np.nanpercentile(np.abs(heights), 99.5)) or 1.0
    axes.set_facecolor("#d946ef")  # what was not measured; no height has this colour
    image = axes.imshow(
        heights.T, origin="lower", extent=(0.0, width, 0.0, height), cmap="cividis", vmin=-reach, vmax=reach,
        interpolation="none" if max(heights.shape) < 600 else "antialiased",
    )  # fmt: skip
    missing = f", {levelled.missing:.1%} not measured (pink)".replace("%", " %") if levelled.missing else ""
    axes.set(xlabel="x [µm]", ylabel="y [µm]", title=f"Levelled heights{missing}")
    figure.colorbar(image, ax=axes, label="height, material up [µm]", extend="both", shrink=0.9)


def _draw_profile(axes: Axes, levelled: MeasuredSurface, title: str) -> None:
    profile = levelled.profile * MICRO
    spacing = levelled.grid.spacing[1 if levelled.uniform == 0 else 0] * MICRO
    axes.plot((np.arange(profile.size) + 0.5) * spacing, profile, color=BLUE, linewidth=0.8)
    axes.axhline(0.0, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set(xlabel="x [µm]", ylabel="height [µm]", title=title)
    axes.set_xlim(0.0, profile.size * spacing)


def _draw_bearing_curve(axes: Axes, described: SurfaceDescription) -> None:
    curve, parameters = bearing_curve(described.levelled.heights), described.parameters
    prefix = "S" if described.profile is None else "R"
    axes.plot(100.0 * curve.share, curve.height * MICRO, color=BLUE)
    top, bottom = curve.height_at(parameters.smr1) * MICRO, curve.height_at(parameters.smr2) * MICRO
    axes.axhspan(bottom, top, color="#e5e7eb", linewidth=0)
    core, peaks, pits = (f"{height * MICRO:.3g}" for height in (parameters.sk, parameters.spk, parameters.svk))
    axes.text(
        0.97, 0.96, f"{prefix}k {core} µm (shaded)\n{prefix}pk {peaks} µm, {prefix}vk {pits} µm",
        transform=axes.transAxes, ha="right", va="top", fontsize=8.5,
    )  # fmt: skip
    inner = [curve.height_at(share) * MICRO for share in (0.999, 0.001)]
    if inner[0] < inner[1]:  # the rarest heights would flatten the rest
        axes.set_ylim(inner[0] - 0.1 * (inner[1] - inner[0]), inner[1] + 0.4 * (inner[1] - inner[0]))
    axes.set(xlabel="material above [%]", ylabel="height [µm]", title="Bearing curve")
    axes.set_xlim(0.0, 100.0)


def _draw_radial_spectrum(axes: Axes, spectrum: SurfaceSpectrum, profile: bool) -> None:
    some = spectrum.density > 0.0
    wavelength = 2.0 * np.pi / spectrum.wavenumber[some] * MICRO
    if not some.any():
        axes.text(0.5, 0.5, "perfectly smooth", transform=axes.transAxes, ha="center")
    else:
        axes.loglog(wavelength, spectrum.density[some], color=VERMILION, marker=".", markersize=4)
        axes.invert_xaxis()
    unit = "m³" if profile else "m⁴"
    title = "Spectrum of the profile" if profile else "Spectrum, all directions"
    axes.set(xlabel="wavelength [µm]", ylabel=f"power density C [{unit}]", title=title)


def _draw_lay(axes: Axes, spectrum: SurfaceSpectrum) -> None:
    polar: Any = axes
    both = np.concatenate([spectrum.lay, spectrum.lay + np.pi, spectrum.lay[:1]])
    share = 100.0 * np.concatenate([spectrum.share, spectrum.share, spectrum.share[:1]])
    polar.plot(both, share, color=GREEN)
    polar.fill(both, share, color=GREEN, alpha=0.2)
    polar.set_title("Lay: share of Sq² in ridges\nalong this direction [% per 5°]")
    polar.tick_params(labelsize=8)
