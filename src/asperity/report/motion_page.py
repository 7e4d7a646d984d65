"""One HTML page of a history: what moving did to the contact, maps that move, curves over time, numbers, limits.

Self-contained: the maps are small pictures in the page, shown one after the other by a few lines of script. Nothing is
solved here.
"""

import json
from base64 import b64encode
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from asperity.errors import BadInput
from asperity.files import require_writable, whole_file
from asperity.history import History, HistoryVibration
from asperity.paper import CITATION
from asperity.report import motion_figures as figures
from asperity.report.page import NOT_FOUND, Picture, Tile, in_print, page_template, picture

_NUMBERS = (  # column, its name, unit, scale, format
    ("clr", "Load share of asperities, CLR", "%", 100.0, ".2f"),
    ("car", "Contact area share in the Hertz zone, CAR", "%", 100.0, ".2f"),
    ("car_domain", "Contact area of the whole domain, over the Hertz area", "%", 100.0, ".2f"),
    ("contact_force_n", "Load that asperities carry", "N", 1.0, ".1f"),
    ("h_min_m", "Least film", "µm", 1e6, ".3f"),
    ("h_central_m", "Central film", "µm", 1e6, ".3f"),
    ("h_mean_m", "Mean film in the Hertz zone", "µm", 1e6, ".3f"),
    ("p_max_pa", "Largest pressure", "GPa", 1e-9, ".3f"),
    ("friction_coefficient", "Friction coefficient", "", 1.0, ".4f"),
    ("friction_power_w", "Heat of friction", "W", 1.0, ".4g"),
    ("flow_power_w", "Heat of pressure-driven flow, where a film parts the bodies", "W", 1.0, ".4g"),
    ("resonance_hz", "Contact resonance by load share", "Hz", 1.0, ".1f"),
    ("mass_flux_imbalance", "Oil lost or re-created, over oil carried", "%", 100.0, ".1f"),
)


class Film(NamedTuple):
    """A map of the page: its axes, and where the pictures are laid over them, in per cent."""

    kind: str
    axes: Picture
    left: float
    top: float
    width: float
    height: float
    zone: tuple[float, ...]  # where lines mark the Hertz zone of a line contact, in per cent of the field


def write_motion_report(history: History, path: str | Path, *, heard: HistoryVibration | None = None) -> Path:
    """Write one self-contained HTML page about a history, whole or not at all; with what a mass `heard` of it.

    Raises
    ------
    BadInput
        for a history without a kept map, or a path that cannot be written to.
    """
    path = Path(path)
    require_writable(path)
    if not history.frames:
        raise BadInput("a report needs at least one map of the history, got none; run the case into a new folder")
    with whole_file(path) as part:
        part.write_text(render_motion_page(history, heard), encoding="utf-8", newline="\n")
    return path


def render_motion_page(history: History, heard: HistoryVibration | None = None) -> str:
    """The page as HTML text."""
    reach = figures.ranges(history)
    pictures = [figures.frame_picture(frame, reach) for frame in history.frames]
    over_time = figures.curves(history)
    last = float(history.table["time_s"].iloc[-1])
    motion, rows = history.case.motion, history.settled
    return page_template("motion.html.j2").render(
        title="A contact in motion",
        version=version("asperity"),
        heard=None if heard is None else in_print(heard.verdict()),
        verdict=in_print(history.verdict().replace(" us", " µs")),
        failed=history.failed,
        steps=history.steps,
        tiles=_tiles(history),
        films=[_film(history, kind, reach) for kind in figures.KINDS],
        curves=picture(
            over_time.figure,
            "Over time; the means and deviations above and below are of the shaded steps. The vertical line is the "
            "step that the maps show.",
            "Shares, film, friction, heat and resonance over time",
        ),
        begins=100.0 * over_time.begins,
        ends=100.0 * over_time.ends,
        running_in=_running_in(history),
        flattening=motion.flattening,
        numbers=_numbers(history),
        settled_from=int(rows["step"].iloc[0]),
        start=motion.start,
        characteristic=motion.time_step == 1.0,
        time_step=motion.time_step,
        model=history.case.contents.model,
        imbalance=f"{100.0 * rows['mass_flux_imbalance'].mean():.2g} %",
        notes=[in_print(note) for note in history.notes],
        case_text=history.case.text,
        script_data=json.dumps(
            {
                "frames": ["data:image/png;base64," + b64encode(packed).decode() for packed, _ in pictures],
                "size": pictures[0][1],
                "said": [_said(history, frame.number) for frame in history.frames],
                "place": [frame.time / last if last else 0.0 for frame in history.frames],
            }
        ),
        paper=CITATION,
    )


def _film(history: History, kind: str, reach: figures.Ranges) -> Film:
    empty = figures.empty_map(history, kind, reach)
    texts = {
        figures.FILM: "Gap between the deformed surfaces; colours end where 99 % of the Hertz zone's gaps do.",
        figures.PRESSURE: "Pressure of oil and asperities together.",
        figures.CONTACT: "Where asperities touch, where oil fills the gap, where it has ruptured.",
    }
    axes = picture(empty.figure, texts[kind], f"Moving map: {texts[kind]}")
    grid, line = history.case.grid, history.case.conditions.geometry == "line"
    a = history.case.conditions.hertz.half_widths[0]
    zone = tuple(100.0 * (side * a - grid.lower[0]) / grid.extent[0] for side in (-1.0, 1.0)) if line else ()
    shares = (100.0 * share for share in (empty.left, empty.top, empty.width, empty.height))
    left, top, width, height = shares
    return Film(kind, axes, left, top, width, height, zone)


def _running_in(history: History) -> Picture | None:
    if not history.case.motion.flattening or len(history.by_pass()) < 2:
        return None
    return picture(
        figures.running_in(history),
        "Running-in, a point a pass of the rough surface: shares and resonance are means over the pass, Sq and how far "
        "the tracks are pressed down stand as at its end. What is pressed down is taken to come up everywhere alike: "
        "the mean plane rises, which under a held load parts the bodies by as much and changes nothing else.",
        "Shares, Sq, flattening and resonance over passes",
    )


def _said(history: History, number: int) -> str:
    row = history.table[history.table["step"] == number].iloc[0]
    return in_print(
        f"step {number} of {history.steps}, {1e6 * row['time_s']:.1f} µs: CLR {100 * row['clr']:.1f} %, "
        f"CAR {100 * row['car']:.1f} %, friction {row['friction_coefficient']:.4f}"
    )


def _tiles(history: History) -> list[Tile]:
    said = history.scalars()
    tiles = []
    for name, title, unit, scale, form in _NUMBERS:
        if name in ("clr", "car", "h_mean_m", "friction_coefficient", "resonance_hz") and said[name] is not None:
            rest = in_print(f"± {scale * said[f'{name}_std']:{form}} {unit}".rstrip())
            tiles.append(Tile(title, f"{scale * said[name]:{form}}", rest))
    return tiles


def _numbers(history: History) -> list[dict[str, Any]]:
    said = history.scalars()

    def shown(value: float | None, scale: float, form: str) -> str:
        return NOT_FOUND if value is None else format(scale * value, form)

    return [
        {
            "name": title,
            "unit": unit,
            "start": shown(said[f"{name}_start"], scale, form),
            "mean": shown(said[name], scale, form),
            "std": shown(said[f"{name}_std"], scale, form),
        }
        for name, title, unit, scale, form in _NUMBERS
    ]
