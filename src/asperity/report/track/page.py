"""One HTML page of a tracked series: the verdict first, then trend, spectra, numbers, quality, method and limits."""

from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.core.quantities import NO_VALUE, in_print, quantity
from asperity.monitoring import FORECAST, Track, TrackedRecording
from asperity.report.base import Exhibit, Picture, Tile, capitalised, render, write_page
from asperity.report.forecast import ahead
from asperity.report.track import exhibits
from asperity.trend import ALERT_RATE_FACTOR, SOURCE_NAMES

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
NEXT = {  # what to do, by the alarm's state; of an alarm by who raised it, its first word
    "CRF": "Look at the contact before it goes on under this load: oil sample (particles, water, viscosity), "
    "temperature, load and speed against what they were; inspect the surfaces at the next stop, and plan that stop.",
    "the": "Look for what grew: bearing and mesh rates in the envelope, imbalance and looseness at the shaft's rate, "
    "a sensor that was moved. Repeat the recording today; if it stays, inspect.",
    "zone": "Take the machine down in a controlled way, or take its load off, and find the cause: balance, alignment, "
    "looseness, bearings.",
    "alert": "Record more often (ten times) until it becomes an alarm or goes away; nothing need be stopped for it.",
    "cannot-tell": "Name what is missing: longer recordings, the case or band of the contact, more recordings for a "
    "baseline, or the cause of a step; then acknowledge it.",
    "blind": "Check that the machine runs, then sensor, cable and supply. Until then nobody hears the machine.",
    "none": "Nothing; record on as planned.",
}
NEXT |= {
    FORECAST: NEXT["CRF"],
    "damping": NEXT["CRF"],
    "kurtosis": NEXT["the"],
    "velocity": NEXT["the"],
}
SUREST = 0.99  # beyond which a probability says more of the model than of the machine
NO_BREAK = (
    "saturating exponential",
    "saturating hyperbola",
    "straight line",
    "smooth curves",
    "no change",
)
MOST_LINES = 20  # of those taken out, listed by name


def write_track_report(track: Track, path: str | Path) -> Path:
    """Write one self-contained HTML page about a series, whole or not at all.

    Raises
    ------
    BadInput
        for a path that cannot be written to.
    """
    return write_page(path, lambda: render_track_page(track))


def render_track_page(track: Track) -> str:
    """The page as HTML text."""
    return render(
        "track/page.html.j2",
        title=_title(track),
        track=track,
        tiles=_tiles(track),
        act=_act(track),
        trend=[exhibits.trend(track).picture_and_narrow()] if track.resonance_count else [],
        ahead=_ahead(track),
        more=_pictures(_details(track)),
        heads=_heads(track),
        rows=[_row(recording, _with_clr(track)) for recording in track.recordings],
        with_clr=_with_clr(track),
        with_damping=_with_damping(track),
        remarks=_remarks(track),
        facts=_facts(track),
        lines=_lines(track),
        evidence=_evidence(track),
        ways=_ways(track),
        x_label=exhibits.x_label(track),
        decides=capitalised(SOURCE_NAMES["crf" if track.stages is None else track.stages.source]),
        method_in_words=METHODS[track.method],
        resolution=_resolution(track),
        false_alarms=f"{1.0 / track.alarm.false_alarm_rate:.0f}",
    )


def _ahead(track: Track) -> Picture | None:
    """What is foretold; None where nothing was asked, or nothing can be told."""
    bands = None if track.forecast is None else track.forecast.bands
    return None if bands is None else ahead(bands, exhibits.x_label(track)).picture()


def _with_clr(track: Track) -> bool:
    """Whether the contact model reads a load share off the CRF."""
    return track.target.full_load_crf_hz is not None


def _with_damping(track: Track) -> bool:
    """Whether the damping of any recording's line is determined."""
    return not all(recording.damping_reason for recording in track.recordings)


def _title(track: Track) -> str:
    folders = {Path(recording.file).parent.name for recording in track.recordings}
    where = f" in {folders.pop()}" if len(folders) == 1 and folders != {""} else ""
    return f"Contact resonance of a series{where}"


def _act(track: Track) -> list[tuple[str, str]]:
    """For who must act: what changed, since when, how sure, what to do next."""
    alarm, last = track.alarm, track.recordings[-1]
    rows = [("What", capitalised(in_print(alarm.reason)) + ".")]
    if alarm.since is not None:
        first = track.recordings[alarm.since]
        when = f", {_when(first)}" if first.reading.started else ""
        rows.append(
            ("Since", f"{Path(first.file).name}{when} ({exhibits.x_label(track)}: {first.x:.4g})")
        )
    rows.append(
        (
            "Last heard",
            f"{Path(last.file).name}{', ' + _when(last) if last.reading.started else ''}",
        )
    )
    rows.append(("Severity", capitalised(in_print(last.severity())) + "."))
    rows.append(("How sure", _how_sure(track)))
    kind = alarm.raised_by.partition(" ")[0] if alarm.state == "alarm" else alarm.state
    return [*rows, ("What next", NEXT[kind])]


def _when(recording: TrackedRecording) -> str:
    return recording.reading.started.replace("T", " ")


def _how_sure(track: Track) -> str:
    """What the alarm's rate and the stage's probability say, and what they do not."""
    alarm, last = track.alarm, track.recordings[-1]
    if alarm.raised_by == "zone":
        return "The standard's limits for machines of this class, not what this machine is used to."
    if alarm.raised_by == FORECAST:
        return "The probability is that of the model's courses; a change is told where it is a hundred to one."
    if alarm.state not in ("alarm", "alert"):
        return (
            "No statement: see what is missing."
            if alarm.state != "none"
            else "Small changes would not be seen yet."
        )
    said = f"Set to be said without wear once in {1.0 / alarm.false_alarm_rate:.0f} recordings"
    said = (
        said
        if alarm.state == "alarm"
        else f"Not sure: chance does it {ALERT_RATE_FACTOR:.0f} times as often as it alarms"
    )
    if np.isfinite(last.severe_probability) and alarm.raised_by in ("CRF", "damping"):
        said += f"; probability of the severe stage {_likely(last.severe_probability)}, if the line is the contact's"
    return f"{said}."


def _likely(probability: float) -> str:
    """A probability, never certain: the model it is of is not."""
    if probability > SUREST:
        return f"above {SUREST:g}"
    return f"below {1.0 - SUREST:.2g}" if probability < 1.0 - SUREST else f"{probability:.2f}"


def _tiles(track: Track) -> list[Tile]:
    total, stages = len(track.recordings), track.stages
    tiles = [Tile("Resonance found", f"{track.resonance_count}", f"of {total}")]
    if stages is not None and stages.found:
        low, high = stages.interval
        label = f"Break at, {exhibits.x_label(track)}"
        tiles.append(Tile(label, f"{stages.split:.3g}", f"90 %: {low:.3g} to {high:.3g}"))
    last = next(
        (recording for recording in reversed(track.recordings) if recording.resonance.found), None
    )
    if last is not None:
        crf, clr = quantity("crf_hz"), quantity("clr")
        value, _, deviation = crf.text(last.resonance.crf_hz, last.resonance.crf_std).partition(" ")
        tiles.append(Tile(f"Last {crf.short}", value, deviation))
        if np.isfinite(last.severe_probability):
            tiles.append(
                Tile("Severe, last recording", _likely(last.severe_probability), "probability")
            )
        if np.isfinite(last.clr):
            low, high = last.clr_interval
            interval = f"90 %: {clr.number(low)} to {clr.number(high)}"
            tiles.append(Tile("Load share, last", clr.text(last.clr), interval))
    zone = track.recordings[-1].zone
    if zone is not None:
        velocity = quantity("velocity_rms").text(track.recordings[-1].reading.velocity)
        tiles.append(Tile("ISO 20816-3, last", f"Zone {zone}", f"{velocity} rms"))
    unusable = sum(not recording.reading.usable for recording in track.recordings)
    tiles.append(Tile("Not usable", f"{unusable}", f"of {total}"))
    return tiles


def _pictures(chosen: list[Exhibit]) -> list[Picture]:
    return [exhibit.picture() for exhibit in chosen]


def _details(track: Track) -> list[Exhibit]:
    """What is shown below the trend."""
    heard = exhibits.levels(track)
    details = [
        *([] if heard is None else [heard]),
        *([exhibits.amplitude(track)] if track.resonance_count else []),
    ]
    if _with_damping(track):
        details.append(exhibits.damping(track))
    if track.resonance_count and _with_clr(track):
        details.append(exhibits.asperity_load_share(track))
    if any(recording.clean is not None for recording in track.recordings):
        details.append(exhibits.waterfall(track))
        details.append(exhibits.spectrum_with_fit(track, exhibits.typical_recording(track)))
    return details


class _Row(NamedTuple):
    """A line of the table of recordings."""

    name: str
    cells: list[str]
    label: str
    reason: str


def _heads(track: Track) -> list[str]:
    keys = [
        "crf_hz",
        "crfa",
        "damping_ratio",
        *(["clr"] if _with_clr(track) else []),
        "severe_probability",
    ]
    heads = {key: quantity(key).label for key in keys}
    if not track.comparable:
        heads["crfa"] = quantity("crfa").short
    return [exhibits.x_label(track), *heads.values()]


def _row(recording: TrackedRecording, with_clr: bool) -> _Row:
    resonance, row = recording.resonance, recording.row()
    place = f"{recording.x:.4g}" + (f" ± {recording.x_std:.2g}" if recording.x_std else "")
    resonant = [
        quantity(key).number_in(row) if resonance.found else NO_VALUE for key in ("crf_hz", "crfa")
    ]
    width = (
        "not determined"
        if resonance.found and recording.damping_reason
        else quantity("damping_ratio").number_in(row)
    )
    resonant.append(width)
    severe = (
        _likely(recording.severe_probability)
        if np.isfinite(recording.severe_probability)
        else NO_VALUE
    )
    shares = [quantity("clr").number(row["clr"])] if with_clr else []
    cells = [place, *resonant, *shares, severe]
    return _Row(
        Path(recording.file).name,
        cells,
        recording.label,
        in_print("" if resonance.found else resonance.reason),
    )


def _remarks(track: Track) -> list[tuple[str, str]]:
    """What the checks remarked, with how many recordings it holds for, or which."""
    remarks: dict[str, list[str]] = {}
    for recording in track.recordings:
        name = Path(recording.file).name
        for sentence in (
            recording.reading.quality.remarks if recording.reading.quality is not None else ()
        ):
            remarks.setdefault(sentence, []).append(name)
        if recording.reading.reason:
            remarks.setdefault(f"Not used: {recording.reading.reason}", []).append(name)
    total = len(track.recordings)

    def holders(names: list[str]) -> str:
        if len(names) == total and total > 1:
            return "all"
        return ", ".join(names) if len(names) <= 3 else f"{len(names)} recordings, first {names[0]}"

    return [
        (in_print(capitalised(sentence)), holders(names)) for sentence, names in remarks.items()
    ]


def _facts(track: Track) -> list[tuple[str, str, str]]:
    """Name, value and source of each fact; where recordings differ, the commonest and how many there are."""
    readings, rows = [recording.reading for recording in track.recordings], []
    for name in ("rate", "unit", "channel", "scale", "format"):
        seen = Counter(reading.facts[name] for reading in readings if name in reading.facts)
        if seen:
            ((value, source), count), *others = seen.most_common()
            more = f"; others in {seen.total() - count} recordings" if others else ""
            rows.append(
                (name.capitalize(), f"{value} Hz{more}" if name == "rate" else value + more, source)
            )
    lengths = [reading.quality.duration_s for reading in readings if reading.quality is not None]
    if lengths:
        shortest, longest = (
            quantity("duration_s").text(length) for length in (min(lengths), max(lengths))
        )
        rows.append(
            (
                "Length",
                shortest if shortest == longest else f"{shortest} to {longest}",
                "its samples",
            )
        )
    started = sorted(reading.started for reading in readings if reading.started)
    if started:
        first, last = started[0].replace("T", " "), started[-1].replace("T", " ")
        source = next(reading.facts["started"][1] for reading in readings if reading.started)
        rows.append(("Started", first if first == last else f"{first} to {last}", source))
    return rows


def _lines(track: Track) -> list[str]:
    """The lines taken out of the recording that is shown, the strongest in words."""
    if not any(recording.clean is not None for recording in track.recordings):
        return []
    clean = exhibits.typical_recording(track).clean
    assert clean is not None
    strongest = sorted(clean.removed, key=lambda line: -line.mean_square)[:MOST_LINES]
    strongest.sort(key=lambda line: line.frequency_hz)
    return [f"{quantity('line_hz').text(line.frequency_hz)}: {line.source}" for line in strongest]


class _Way(NamedTuple):
    """What one indicator, or both, say of the stage."""

    name: str
    kind: str
    split: str
    margin: str
    verdict: str


def _ways(track: Track) -> list[_Way]:
    """A line each for CRF, damping and both, the one that decides marked."""
    ways = []
    for source, stages in track.stages_by.items():
        low, high = stages.interval
        breaks = [
            value
            for name, value in stages.evidence.items()
            if "break in" in name or name == "broken stick"
        ]
        others = [value for name, value in stages.evidence.items() if name in NO_BREAK]
        margin = f"{min(others) - min(breaks):+.1f}" if breaks and others else NO_VALUE
        name = capitalised(SOURCE_NAMES[source]) + (" (decides)" if stages is track.stages else "")
        split = f"{stages.split:.3g} ({low:.3g} to {high:.3g})" if stages.found else NO_VALUE
        kind = "not determined" if stages.kind == "too few" else stages.kind
        ways.append(_Way(name, kind, split, margin, in_print(stages.verdict)))
    return ways


def _evidence(track: Track) -> list[tuple[str, str]]:
    if track.stages is None:
        return []
    ranked = sorted(track.stages.evidence.items(), key=lambda item: item[1])
    return [(name, f"{value:.1f}") for name, value in ranked if np.isfinite(value)]


def _resolution(track: Track) -> str:
    spectrum = next(
        (
            recording.reading.spectrum
            for recording in track.recordings
            if recording.clean is not None
        ),
        None,
    )
    if spectrum is None:
        return "no spectrum"
    spacing, resolution = (
        quantity(key).text(getattr(spectrum, key)) for key in ("spacing_hz", "resolution_hz")
    )
    return (
        f"{spectrum.window} window, {spectrum.segment} samples a piece, lines {spacing} apart "
        f"(noise bandwidth {resolution})"
    )
