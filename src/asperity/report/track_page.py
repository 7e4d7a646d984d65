"""One HTML page of a tracked series: the verdict first, then trend, spectra, numbers, quality, method and its limits.

Self-contained, in the style of `asperity.report.page`. Nothing is read or fitted here.
"""

import re
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from asperity.files import require_writable, whole_file
from asperity.paper import CITATION
from asperity.report import track_figures as figures
from asperity.report.page import NOT_FOUND, Picture, Tile, in_print, page_template, picture, with_deviation
from asperity.tracking import ALERT, DANGER, IN_A_ROW

if TYPE_CHECKING:
    from asperity.tracking import Track, TrackedRecording

METHODS = {
    "joint": "All spectra are fitted together: a background common to the series, of any shape, each recording with "
    "a gain of its own, and one oscillator line a recording, which moves or changes its height from one recording to "
    "the next. What stays is taken for the machine, what moves for the contact.",
    "modes": "Each spectrum by itself: several oscillator lines over a floor, of which one may be the contact's.",
    "likelihood": "Each spectrum by itself: the likeliest single oscillator line over a sloping floor (Whittle "
    "likelihood), against the floor alone by BIC.",
    "peak": "The paper's: each spectrum smoothed three times by a five-point cubic, the highest point of the band "
    "taken. It is not tested against chance, and structural modes or shaft lines can be that point.",
}
MOST_LINES = 20  # of those taken out, listed by name


def write_track_report(track: "Track", path: str | Path) -> Path:
    """Write one self-contained HTML page about a series, whole or not at all.

    Raises
    ------
    BadInput
        for a path that cannot be written to.
    """
    path = Path(path)
    require_writable(path)
    with whole_file(path) as part:
        part.write_text(render_track_page(track), encoding="utf-8", newline="\n")
    return path


def render_track_page(track: "Track") -> str:
    """The page as HTML text."""
    total = len(track.recordings)
    low, high = track.target.band_hz
    return page_template("track.html.j2").render(
        title=_title(track),
        version=version("asperity"),
        total=f"{total} {'recording' if total == 1 else 'recordings'}",
        level=track.alarm.level,
        verdict=re.sub(r"\bum\b", "µm", in_print(track.verdict())),
        alarm=in_print(track.alarm.verdict),
        tiles=_tiles(track),
        pictures=_pictures(track),
        x_label=figures.x_label(track),
        rows=[_row(one) for one in track.recordings],
        with_clr=track.target.full_load_crf_hz is not None,
        problems=[in_print(sentence) for sentence in track.problems],
        notes=[in_print(sentence) for sentence in track.notes],
        remarks=_remarks(track),
        facts=_facts(track),
        lines=_lines(track),
        evidence=_evidence(track),
        method=track.method,
        method_in_words=METHODS[track.method],
        band=in_print(track.target.source),
        band_short=f"{low:.0f} to {high:.0f} Hz",
        joint=track.method == "joint",
        comparable=track.comparable,
        resolution=_resolution(track),
        alert=ALERT,
        danger=DANGER,
        in_a_row=IN_A_ROW,
        paper=CITATION,
    )


def _title(track: "Track") -> str:
    folders = {Path(one.file).parent.name for one in track.recordings}
    where = f" in {folders.pop()}" if len(folders) == 1 and folders != {""} else ""
    return f"Contact resonance of a series{where}"


def _tiles(track: "Track") -> list[Tile]:
    total, stages = len(track.recordings), track.stages
    tiles = [Tile("Resonance found", f"{track.resonance_count}", f"of {total}")]
    if stages is not None and stages.found:
        low, high = stages.interval
        tiles.append(
            Tile(f"Break at, {figures.x_label(track)}", f"{stages.split:.3g}", f"90 %: {low:.3g} to {high:.3g}")
        )
    last = next((one for one in reversed(track.recordings) if one.resonance.found), None)
    if last is not None:
        value, deviation = with_deviation(last.resonance.crf_hz, last.resonance.crf_std)
        tiles.append(Tile("Last CRF", value, f"{deviation} Hz".strip()))
        if np.isfinite(last.severe_probability):
            tiles.append(Tile("Severe, last recording", f"{100.0 * last.severe_probability:.0f} %", "probability"))
        if np.isfinite(last.clr):
            ends = [100.0 * end for end in last.clr_interval]
            tiles.append(Tile("Load share, last", f"{100.0 * last.clr:.0f} %", f"90 %: {ends[0]:.0f} to {ends[1]:.0f}"))
    unusable = sum(not one.reading.usable for one in track.recordings)
    tiles.append(Tile("Not usable", f"{unusable}", f"of {total}"))
    return tiles


def _pictures(track: "Track") -> dict[str, list[Picture]]:
    shown: dict[str, list[Picture]] = {"trend": [], "more": []}
    split = track.stages is not None and track.stages.found
    if track.resonance_count:
        shown["trend"].append(
            picture(
                figures.trend(track),
                "CRF of each recording with its 90 % interval; blue normal, orange severe. "
                + ("The shaded strip is where the break lies with 90 %. " if split else "")
                + "Below: the probability of the severe stage.",
                f"Trend of the contact resonance over {figures.x_label(track)}: {track.verdict()}",
            )
        )
        shown["more"].append(
            picture(
                figures.amplitude(track),
                "Height of the fitted line at the CRF, without what lies below it.",
                "Trend of the contact resonance amplitude.",
            )
        )
        if track.target.full_load_crf_hz is not None:
            shown["more"].append(
                picture(
                    figures.asperity_load_share(track),
                    "CLR = (CRF/CRF at full load)⁶: the contact model's reading, not a measurement.",
                    "Trend of the load share of asperities as the model reads it.",
                )
            )
    if any(one.clean is not None for one in track.recordings):
        shown["more"].append(
            picture(
                figures.waterfall(track),
                "Every spectrum is a row; lines of shafts and mains are taken out. Dashed: the band searched. What "
                "stays upright is the machine's structure.",
                "Waterfall of the spectra of all recordings around the band.",
            )
        )
        one = _typical(track)
        shown["more"].append(
            picture(
                figures.spectrum_with_fit(track, one),
                f"{Path(one.file).name}, the recording of the middle interval width." if one.resonance.found
                else f"{Path(one.file).name}: {one.resonance.reason}.",
                f"Spectrum of {Path(one.file).name} with its fit and the lines taken out.",
            )
        )  # fmt: skip
    return shown


def _typical(track: "Track") -> "TrackedRecording":
    """The recording whose CRF is known as well as most; of a series without any, the first that could be used."""
    found = sorted((one for one in track.recordings if one.resonance.found), key=lambda one: one.resonance.crf_std)
    if found:
        return found[len(found) // 2]
    return next(one for one in track.recordings if one.clean is not None)


def _row(one: "TrackedRecording") -> dict[str, str]:
    """A line of the table of recordings."""
    found = one.resonance
    return {
        "name": Path(one.file).name,
        "x": f"{one.x:.4g}" + (f" ± {one.x_std:.2g}" if one.x_std else ""),
        "crf": " ".join(with_deviation(found.crf_hz, found.crf_std)).rstrip() if found.found else NOT_FOUND,
        "crfa": " ".join(with_deviation(found.crfa, found.crfa_std)).rstrip() if found.found else NOT_FOUND,
        "clr": f"{100.0 * one.clr:.0f}" if np.isfinite(one.clr) else NOT_FOUND,
        "severe": f"{one.severe_probability:.2f}" if np.isfinite(one.severe_probability) else NOT_FOUND,
        "label": one.label,
        "reason": in_print("" if found.found else found.reason),
    }


def _remarks(track: "Track") -> list[tuple[str, str]]:
    """What the checks said, with how many recordings it holds for, or which."""
    said: dict[str, list[str]] = {}
    for one in track.recordings:
        name = Path(one.file).name
        for sentence in one.reading.quality.remarks if one.reading.quality is not None else ():
            said.setdefault(sentence, []).append(name)
        if one.reading.reason:
            said.setdefault(f"Not used: {one.reading.reason}", []).append(name)
    total = len(track.recordings)

    def holders(names: list[str]) -> str:
        if len(names) == total and total > 1:
            return "all"
        return ", ".join(names) if len(names) <= 3 else f"{len(names)} recordings, first {names[0]}"

    return [(in_print(sentence[:1].upper() + sentence[1:]), holders(names)) for sentence, names in said.items()]


def _facts(track: "Track") -> list[tuple[str, str, str]]:
    """Name, value and source of each fact; where recordings differ, the commonest and how many there are."""
    rows = []
    for name in ("rate", "unit", "channel", "scale", "format"):
        seen = Counter(one.reading.facts[name] for one in track.recordings if name in one.reading.facts)
        if seen:
            ((value, source), count), *others = seen.most_common()
            more = f"; others in {seen.total() - count} recordings" if others else ""
            rows.append((name.capitalize(), f"{value} Hz{more}" if name == "rate" else value + more, source))
    lengths = [one.reading.quality.duration_s for one in track.recordings if one.reading.quality is not None]
    if lengths:
        same = f"{min(lengths):.4g} s"
        length = same if min(lengths) == max(lengths) else f"{same} to {max(lengths):.4g} s"
        rows.append(("Length", length, "its samples"))
    started = sorted(one.reading.started for one in track.recordings if one.reading.started)
    if started:
        first, last = started[0].replace("T", " "), started[-1].replace("T", " ")
        source = next(one.reading.facts["started"][1] for one in track.recordings if one.reading.started)
        rows.append(("Started", first if first == last else f"{first} to {last}", source))
    return rows


def _lines(track: "Track") -> list[str]:
    """The lines taken out of the recording that is shown, the strongest in words."""
    if not any(one.clean is not None for one in track.recordings):
        return []
    clean = _typical(track).clean
    assert clean is not None
    strongest = sorted(clean.removed, key=lambda line: -line.mean_square)[:MOST_LINES]
    return [
        f"{line.frequency_hz:.2f} Hz: {line.source}" for line in sorted(strongest, key=lambda line: line.frequency_hz)
    ]


def _evidence(track: "Track") -> list[tuple[str, str]]:
    if track.stages is None:
        return []
    ranked = sorted(track.stages.evidence.items(), key=lambda item: item[1])
    return [(name, f"{value:.1f}") for name, value in ranked if np.isfinite(value)]


def _resolution(track: "Track") -> str:
    spectrum = next((one.reading.spectrum for one in track.recordings if one.clean is not None), None)
    if spectrum is None:
        return "no spectrum"
    return (
        f"{spectrum.window} window, {spectrum.segment} samples a piece, lines {spectrum.spacing_hz:.3g} Hz apart "
        f"(noise bandwidth {spectrum.resolution_hz:.3g} Hz)"
    )
