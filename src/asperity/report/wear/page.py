"""HTML report of a wear history: verdict, resonance, curves, animated maps, surfaces, limits."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pandas

from asperity.core.quantities import in_print, mark_rolling, quantity
from asperity.paper import is_papers_contact
from asperity.report import animated_maps
from asperity.report.base import (
    Exhibit,
    Picture,
    Tile,
    heading,
    render,
    tile,
    write_exhibits,
    write_page,
)
from asperity.report.wear import exhibits
from asperity.simulation import LiftOffChange, WearFrame, WearHistory, body_column

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


class ComparisonRow(NamedTuple):
    """A row of a table with two values of a quantity."""

    name: str
    first: str
    second: str
    unit: str


def write_wear_report(
    history: WearHistory,
    path: str | Path,
    *,
    figures: str | Path | None = None,
    lift_off: LiftOffChange | None = None,
) -> Path:
    """Write a self-contained HTML report of a wear history, atomically.

    `figures` is a folder for each figure as PDF (85 and 175 mm wide) and `captions.md`; `lift_off`
    the change of the lift-off speed, stated below the verdict.

    Raises
    ------
    BadInput
        for a path that is not writable.
    """
    page = write_page(path, lambda: render_wear_page(history, lift_off))
    if figures is not None:
        write_exhibits(wear_exhibits(history), figures)
    return page


def wear_exhibits(history: WearHistory) -> Iterator[Exhibit]:
    """Yield the exhibits of a report: resonance, curves, surfaces before and after, profiles."""
    yield exhibits.headline(history)
    if history.table["crf_hz"].notna().any():
        yield exhibits.resonance(history, papers=is_papers_contact(history.case))
    yield exhibits.curves(history)
    tracks = exhibits.worn_tracks(history)
    for number, track in enumerate(tracks, 1):
        yield replace(exhibits.surface_maps(track), name=f"surface-{number}")
    if tracks:
        yield exhibits.profiles(tracks)


def render_wear_page(history: WearHistory, lift_off: LiftOffChange | None = None) -> str:
    """Render the page as HTML text."""
    table = history.table
    model = history.contact.model
    last = table.iloc[-1]
    tracks = exhibits.worn_tracks(history)
    scale = animated_maps.ranges(history.case, history.frames)
    captions = [_caption(history, frame) for frame in history.frames]
    return render(
        "wear/page.html.j2",
        title="Wear of a contact",
        history=history,
        lift_off=None if lift_off is None else lift_off.verdict(),
        tiles=_tiles(history),
        headline=exhibits.headline(history).picture(),
        resonance=_resonance(history),
        maps=animated_maps.animated_maps(history.case, scale),
        curves=exhibits.curves(history).picture(),
        surfaces=[exhibits.surface_maps(track).picture() for track in tracks],
        profiles=exhibits.profiles(tracks).picture() if tracks else None,
        contact=[_row(key, table[key].iloc[0], last[key]) for key in CONTACT],
        bodies=_bodies(last),
        volumes=_volumes(history),
        law=(type(model.law).__doc__ or "").split("\n")[0],
        coefficients=[f"{coefficient.k:.3g}" for coefficient in model.coefficients],
        stages=None if history.stages is None else in_print(history.stages.verdict),
        jump_error=quantity("jump_error").text(history.worn.error),
        case_text=history.case.text,
        script=animated_maps.SCRIPT,
        script_data=animated_maps.script_data(history.frames, captions, scale),
    )


def _tiles(history: WearHistory) -> list[Tile]:
    """Return the final values of the main quantities, where they are known."""
    values = history.printed_row(-1)
    row = mark_rolling(values, rolling=history.case.conditions.sliding_speed == 0.0)
    return [tile(quantity(key), row) for key in TILES if values[key] is not None]


def _bodies(last: pandas.Series) -> list[ComparisonRow]:
    return [_row(key, *(last[body_column(key, body)] for body in (0, 1))) for key in OF_BODIES]


def _resonance(history: WearHistory) -> Picture | None:
    """Draw the resonance; None without one."""
    if not history.table["crf_hz"].notna().any():
        return None
    return exhibits.resonance(history, papers=is_papers_contact(history.case)).picture()


def _caption(history: WearHistory, frame: WearFrame) -> str:
    """Describe a frame: time, positions on the tracks and means over all positions."""
    row = history.table.iloc[frame.number]
    spacing = history.case.grid.spacing[0]
    moving_bodies = [body for body in (0, 1) if history.contact.bodies[body].speed != 0.0]
    positions = " and ".join(
        f"{1e3 * frame.position[body] * spacing:.3f} mm on body {body + 1}"
        for body in moving_bodies
    )
    means = ", ".join(quantity(key).named(row[key]) for key in ("sq_m", "clr"))
    return in_print(f"after {frame.hours:.4g} h, at {positions}; mean over positions: {means}")


def _row(key: str, first: float, second: float) -> ComparisonRow:
    entry = quantity(key)
    return ComparisonRow(
        heading(entry), entry.number(float(first)), entry.number(float(second)), entry.display
    )


def _volumes(history: WearHistory) -> list[str]:
    """Return the wear volume of each body as a sentence, with the interval of k."""
    entry = quantity("worn_volume_m3")
    sentences = []
    for body, volume in enumerate(history.worn_volume):
        limits = history.volume_interval(body)
        interval = (
            ""
            if limits is None
            else f" ({entry.number(limits[0])} to {entry.text(limits[1])} for the interval of k)"
        )
        sentences.append(f"Wear volume of body {body + 1}: {entry.text(volume)}{interval}.")
    return sentences
