"""One HTML page of a wear history: curves over hours, surfaces before and after, CRF beside the paper's, limits."""

from pathlib import Path
from typing import NamedTuple

from asperity.core.quantities import in_print, quantity
from asperity.paper import is_papers_contact
from asperity.report import animated_maps as moving
from asperity.report.base import heading, render, tile, write_page
from asperity.report.wear import exhibits
from asperity.simulation import WearFrame, WearHistory, body_column

TILES = ("sq_m", "clr", "friction_coefficient", "flash_temperature_max_k", "crf_hz")
CONTACT = (
    "sq_m",
    "sa_m",
    "ssk",
    "sku",
    "sk_m",
    "spk_m",
    "svk_m",
    "clr",
    "car",
    "h_mean_m",
    "h_min_m",
    "friction_coefficient",
    "flash_temperature_max_k",
    "crf_hz",
    "crfa",
)
OF_BODIES = (
    "overrollings",
    "worn_depth_m",
    "worn_depth_max_m",
    "worn_volume_m3",
    "flattened_m",
    "sq_m",
    "ssk",
    "spk_m",
    "svk_m",
)


class Line(NamedTuple):
    """A row of a table: what it is, two numbers, unit."""

    name: str
    first: str
    second: str
    unit: str


def write_wear_report(history: WearHistory, path: str | Path) -> Path:
    """Write one self-contained HTML page about a wear history, whole or not at all.

    Raises
    ------
    BadInput
        for a path that cannot be written to.
    """
    return write_page(path, lambda: render_wear_page(history))


def render_wear_page(history: WearHistory) -> str:
    """The page as HTML text."""
    first, last = history.table.iloc[0], history.table.iloc[-1]
    at_end = history.final_values
    bodies = exhibits.worn_bodies(history)
    sounds = bool(history.table["crf_hz"].notna().any())
    papers = is_papers_contact(history.case)
    reach = moving.ranges(history.case, history.frames)
    return render(
        "wear/page.html.j2",
        title="A contact that wears",
        history=history,
        tiles=[tile(quantity(key), at_end) for key in TILES if last[key] == last[key]],
        resonance=exhibits.resonance(history, papers=papers).picture() if sounds else None,
        maps=[moving.moving_map(history.case, kind, reach) for kind in moving.KINDS],
        curves=exhibits.curves(history).picture(),
        surfaces=[exhibits.surfaces(body).picture() for body in bodies],
        profiles=exhibits.profiles(bodies).picture() if bodies else None,
        contact=[_line(key, first[key], last[key]) for key in CONTACT],
        bodies=[
            _line(key, last[body_column(key, 0)], last[body_column(key, 1)]) for key in OF_BODIES
        ],
        volumes=_volumes(history),
        law=(type(history.contact.model.law).__doc__ or "").split("\n")[0],
        coefficients=[f"{one.k:.3g}" for one in history.contact.model.coefficients],
        stages=None if history.stages is None else in_print(history.stages.verdict),
        jump_error=quantity("jump_error").text(history.worn.error),
        script=moving.SCRIPT,
        script_data=moving.script_data(
            history.frames, [_in_words(history, frame) for frame in history.frames], reach
        ),
    )


def _in_words(history: WearHistory, frame: WearFrame) -> str:
    """When a frame is, where on the tracks, and what the contact is like then on average."""
    row, spacing = history.table.iloc[frame.number], history.case.grid.spacing[0]
    moves = [body for body in (0, 1) if history.contact.bodies[body].speed != 0.0]
    places = " and ".join(
        f"{1e3 * frame.position[body] * spacing:.3f} mm on body {body + 1}" for body in moves
    )
    means = ", ".join(quantity(key).named(row[key]) for key in ("sq_m", "clr"))
    return in_print(f"after {frame.hours:.4g} h, at {places}; all positions: {means}")


def _line(key: str, first: float, second: float) -> Line:
    entry = quantity(key)
    return Line(
        heading(entry), entry.number(float(first)), entry.number(float(second)), entry.display
    )


def _volumes(history: WearHistory) -> list[str]:
    """What each body has lost, in words, with the interval of k."""
    entry, sentences = quantity("worn_volume_m3"), []
    for body, volume in enumerate(history.worn_volume):
        ends = history.volume_interval(body)
        interval = (
            ""
            if ends is None
            else f", {entry.number(ends[0])} to {entry.text(ends[1])} by the interval of k"
        )
        sentences.append(f"Body {body + 1} has lost {entry.text(volume)}{interval}.")
    return sentences
