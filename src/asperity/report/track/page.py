"""HTML report of a tracked series: verdict, trend, spectra, numbers, quality, method, limits."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.core.coverage import PERCENT
from asperity.core.quantities import NO_VALUE, in_print, quantity
from asperity.monitoring import FORECAST, Reading, Track, TrackedRecording
from asperity.report.base import Exhibit, Picture, Tile, capitalised, render, write_page
from asperity.report.forecast import forecast_exhibit
from asperity.report.track import exhibits, spectra
from asperity.trend import ALERT_RATE_FACTOR, SOURCE_NAMES

METHODS = {
    "joint": "All spectra are fitted jointly: a common background of any shape, a gain for each "
    "recording, and one "
    "resonance per recording that may change its frequency and height. The constant part is "
    "attributed to the "
    "machine, the changing part to the contact.",
    "modes": "Each spectrum is fitted separately: several resonances above a noise floor, one of "
    "which may be the "
    "contact's.",
    "likelihood": "Each spectrum is fitted separately: a single resonance above a sloping noise "
    "floor (maximum Whittle likelihood), compared with the floor alone by BIC.",
    "peak": "The method of the paper: each spectrum is smoothed three times by a five-point cubic, "
    "and the highest "
    "point in the band is used. It has no significance test and may select a structural mode or a "
    "shaft line.",
}
_CHECK_CONTACT = (
    "Check the contact before continuing at this load: oil sample (particles, water, viscosity), "
    "temperature, load "
    "and speed. Plan a stop and inspect the surfaces."
)
_CHECK_LEVEL = (
    "Find the source of the increase: bearing and mesh frequencies in the envelope, imbalance and "
    "looseness at the "
    "shaft frequency, a displaced sensor. Repeat the recording today; inspect if the increase "
    "persists."
)
ACTIONS = {  # by state; for an alarm, by the first word of the indicator that raised it
    "CRF": _CHECK_CONTACT,
    "damping": _CHECK_CONTACT,
    FORECAST: _CHECK_CONTACT,
    "zone": "Shut the machine down in a controlled way, or reduce its load, and find the cause: "
    "balance, alignment, "
    "looseness, bearings.",
    "alert": "Record ten times as often until the alert becomes an alarm or ends, and find the "
    "cause of a step. No stop is needed.",
    "cannot-tell": "Record more: the baseline needs eight recordings.",
    "blind": "Check that the machine runs, then sensor, cable and supply. The machine is not "
    "monitored until then.",
    "none": "None; continue recording as planned.",
}
MAX_PROBABILITY = 0.99  # stated at most, because model errors are not included
NO_BREAK = (
    "saturating exponential",
    "saturating hyperbola",
    "straight line",
    "smooth curves",
    "no change",
)
FACTS = ("rate", "unit", "channel", "scale", "format")
MAX_LINES = 20  # removed lines that are listed by name


def write_track_report(track: Track, path: str | Path) -> Path:
    """Write a self-contained HTML report of a tracked series, atomically.

    Raises
    ------
    BadInput
        for a path that is not writable.
    """
    return write_page(path, lambda: render_track_page(track))


def render_track_page(track: Track) -> str:
    """Render the page as HTML text."""
    return render(
        "track/page.html.j2",
        title=_title(track),
        track=track,
        tiles=_tiles(track),
        actions=_actions(track),
        trend=[exhibits.trend(track).responsive_picture()] if track.resonance_count else [],
        forecast=_forecast_picture(track),
        details=[exhibit.picture() for exhibit in _details(track)],
        heads=_heads(track),
        rows=[_row(recording, _with_clr(track)) for recording in track.recordings],
        with_clr=_with_clr(track),
        with_damping=_with_damping(track),
        remarks=_remarks(track),
        facts=_facts(track),
        lines=_lines(track),
        evidence=_evidence(track),
        stage_rows=_stage_rows(track),
        x_label=exhibits.x_label(track),
        decides=capitalised(SOURCE_NAMES["crf" if track.stages is None else track.stages.source]),
        method=METHODS[track.method],
        resolution=_resolution(track),
        false_alarms=f"{1.0 / track.alarm.false_alarm_rate:.0f}",
    )


def track_exhibits(track: Track) -> list[Exhibit]:
    """Return the figures of the page, the trend first."""
    ahead = _forecast_exhibit(track)
    return [
        *([exhibits.trend(track)] if track.resonance_count else []),
        *([] if ahead is None else [ahead]),
        *_details(track),
    ]


def _forecast_exhibit(track: Track) -> Exhibit | None:
    """Draw the forecast; None if none was requested or possible."""
    bands = None if track.forecast is None else track.forecast.bands
    return None if bands is None else forecast_exhibit(bands, exhibits.x_label(track))


def _forecast_picture(track: Track) -> Picture | None:
    ahead = _forecast_exhibit(track)
    return None if ahead is None else ahead.picture()


def _with_clr(track: Track) -> bool:
    """Return True if the contact model gives a load share for the CRF."""
    return track.target.full_load_crf_hz is not None


def _with_damping(track: Track) -> bool:
    """Return True if any recording has a damping ratio."""
    return not all(recording.damping_reason for recording in track.recordings)


def _title(track: Track) -> str:
    folders = {Path(recording.file).parent.name for recording in track.recordings}
    location = f" in {folders.pop()}" if len(folders) == 1 and folders != {""} else ""
    return f"Contact resonance of a series{location}"


def _actions(track: Track) -> list[tuple[str, str]]:
    """Return finding, start, severity, confidence and recommended action."""
    alarm = track.alarm
    last = track.recordings[-1]
    rows = [("Finding", capitalised(in_print(alarm.reason)) + ".")]
    if fault := track.fault_sentence():
        rows.append(("Fault", fault))
    if alarm.since is not None:
        first = track.recordings[alarm.since]
        when = f", {_when(first)}" if first.reading.started else ""
        rows.append(
            ("Since", f"{Path(first.file).name}{when} ({exhibits.x_label(track)}: {first.x:.4g})")
        )
    rows.append(
        (
            "Last recording",
            f"{Path(last.file).name}{', ' + _when(last) if last.reading.started else ''}",
        )
    )
    rows.append(("Severity", capitalised(in_print(last.severity())) + "."))
    rows.append(("Confidence", _confidence(track)))
    kind = alarm.raised_by.partition(" ")[0] if alarm.state == "alarm" else alarm.state
    return [*rows, ("Action", ACTIONS.get(kind, _CHECK_LEVEL))]


def _when(recording: TrackedRecording) -> str:
    return recording.reading.started.replace("T", " ")


def _confidence(track: Track) -> str:
    """State the false-alarm rate and the probability of the severe stage."""
    alarm = track.alarm
    last = track.recordings[-1]
    if alarm.raised_by == "zone":
        return (
            "Limits of the standard for machines of this class, not the baseline of this machine."
        )
    if alarm.raised_by == FORECAST:
        return "Probability under the forecast model; changes are reported at odds of 100 to 1."
    if alarm.state not in ("alarm", "alert"):
        return (
            "No statement: see what is missing."
            if alarm.state != "none"
            else "Small changes are not detectable yet."
        )
    recordings = 1.0 / alarm.false_alarm_rate
    text = (
        f"False-alarm rate: one in {recordings:.0f} recordings"
        if alarm.state == "alarm"
        else "Not significant: by chance, alerts are "
        f"{ALERT_RATE_FACTOR:.0f} times as frequent as alarms"
    )
    if np.isfinite(last.severe_probability) and alarm.raised_by in ("CRF", "damping"):
        severe = _probability_text(last.severe_probability)
        text += f"; probability of the severe stage {severe}, if the resonance is the contact's"
    return f"{text}."


def _probability_text(probability: float) -> str:
    """Return a probability as text, limited to the range that the model supports."""
    lowest = 1.0 - MAX_PROBABILITY
    if probability > MAX_PROBABILITY:
        return f"above {MAX_PROBABILITY:g}"
    return f"below {lowest:.2g}" if probability < lowest else f"{probability:.2f}"


def _tiles(track: Track) -> list[Tile]:
    total = len(track.recordings)
    stages = track.stages
    level = track.alarm.level
    tiles = [
        Tile("Line found", f"{track.resonance_count}", f"of {total}"),
        Tile("Contact", "seen" if track.evidence and track.resonance_count else "not seen", ""),
    ]
    if np.isfinite(level.factor):
        tiles.append(Tile("Highest level, last", f"{level.factor:.3g}", "times its baseline"))
    if stages is not None and stages.found:
        low, high = stages.interval
        label = f"Break at, {exhibits.x_label(track)}"
        tiles.append(Tile(label, f"{stages.split:.3g}", f"{PERCENT}: {low:.3g} to {high:.3g}"))
    last = next(
        (recording for recording in reversed(track.recordings) if recording.resonance.found), None
    )
    if last is not None:
        tiles.extend(_resonance_tiles(last))
    zone = track.recordings[-1].zone
    if zone is not None:
        velocity = quantity("velocity_rms").text(track.recordings[-1].reading.velocity)
        tiles.append(Tile("ISO 20816-3, last", f"Zone {zone}", f"{velocity} rms"))
    unusable = sum(not recording.reading.usable for recording in track.recordings)
    tiles.append(Tile("Not usable for the contact", f"{unusable}", f"of {total}"))
    return tiles


def _resonance_tiles(recording: TrackedRecording) -> Iterator[Tile]:
    """Yield CRF, probability of the severe stage and load share of a recording."""
    crf = quantity("crf_hz")
    clr = quantity("clr")
    resonance = recording.resonance
    value, _, deviation = crf.text(resonance.crf_hz, resonance.crf_std).partition(" ")
    yield Tile(f"Last {crf.short}", value, deviation)
    if np.isfinite(recording.severe_probability):
        probability = _probability_text(recording.severe_probability)
        yield Tile("Severe, last recording", probability, "probability")
    if np.isfinite(recording.clr):
        low, high = recording.clr_interval
        interval = f"{PERCENT}: {clr.number(low)} to {clr.number(high)}"
        yield Tile("Asperity load share, last", clr.text(recording.clr), interval)


def _details(track: Track) -> list[Exhibit]:
    """Return the exhibits below the trend."""
    levels = exhibits.levels(track)
    details = [
        *([] if levels is None else [levels]),
        *([exhibits.amplitude(track)] if track.resonance_count else []),
    ]
    if _with_damping(track):
        details.append(exhibits.damping(track))
    if track.resonance_count and _with_clr(track):
        details.append(exhibits.asperity_load_share(track))
    if any(recording.clean is not None for recording in track.recordings):
        details.append(spectra.waterfall(track))
        details.append(spectra.spectrum_with_fit(track, spectra.typical_recording(track)))
    return details


class _Row(NamedTuple):
    """A row of the table of recordings."""

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
    resonance = recording.resonance
    row = recording.row()
    position = f"{recording.x:.4g}" + (f" ± {recording.x_std:.2g}" if recording.x_std else "")
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
        _probability_text(recording.severe_probability)
        if np.isfinite(recording.severe_probability)
        else NO_VALUE
    )
    shares = [quantity("clr").number(row["clr"])] if with_clr else []
    cells = [position, *resonant, *shares, severe]
    return _Row(
        Path(recording.file).name,
        cells,
        recording.label,
        in_print("" if resonance.found else resonance.reason),
    )


def _remarks(track: Track) -> list[tuple[str, str]]:
    """Return the remarks of the quality checks with the recordings that they concern."""
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

    def recordings_text(names: list[str]) -> str:
        if len(names) == total and total > 1:
            return "all"
        return ", ".join(names) if len(names) <= 3 else f"{len(names)} recordings, first {names[0]}"

    return [
        (in_print(capitalised(sentence)), recordings_text(names))
        for sentence, names in remarks.items()
    ]


def _facts(track: Track) -> list[tuple[str, str, str]]:
    """Return name, most common value and source of each fact about the recordings."""
    readings = [recording.reading for recording in track.recordings]
    rows = [row for name in FACTS if (row := _fact(readings, name)) is not None]
    lengths = [reading.quality.duration_s for reading in readings if reading.quality is not None]
    if lengths:
        limits = (quantity("duration_s").text(length) for length in (min(lengths), max(lengths)))
        rows.append(("Length", _span(*limits), "number of samples"))
    started = sorted(reading.started for reading in readings if reading.started)
    if started:
        limits = (time.replace("T", " ") for time in (started[0], started[-1]))
        source = next(reading.facts["started"][1] for reading in readings if reading.started)
        rows.append(("Started", _span(*limits), source))
    return rows


def _fact(readings: Sequence[Reading], name: str) -> tuple[str, str, str] | None:
    """Return name, most common value and source of a fact; None if no recording has it."""
    counts = Counter(reading.facts[name] for reading in readings if name in reading.facts)
    if not counts:
        return None
    ((value, source), count), *others = counts.most_common()
    exceptions = f"; others in {counts.total() - count} recordings" if others else ""
    return name.capitalize(), f"{value}{' Hz' if name == 'rate' else ''}{exceptions}", source


def _span(first: str, last: str) -> str:
    return first if first == last else f"{first} to {last}"


def _lines(track: Track) -> list[str]:
    """Describe the strongest lines removed from the spectrum shown."""
    if not any(recording.clean is not None for recording in track.recordings):
        return []
    clean = spectra.typical_recording(track).clean
    assert clean is not None
    strongest = sorted(clean.removed, key=lambda line: -line.mean_square)[:MAX_LINES]
    strongest.sort(key=lambda line: line.frequency_hz)
    return [f"{quantity('line_hz').text(line.frequency_hz)}: {line.source}" for line in strongest]


class _StageRow(NamedTuple):
    """Stage of wear from one indicator, or from both."""

    name: str
    kind: str
    split: str
    margin: str
    verdict: str


def _stage_rows(track: Track) -> list[_StageRow]:
    """Return the stages from CRF, damping and both; the deciding one is marked."""
    rows = []
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
        rows.append(_StageRow(name, kind, split, margin, in_print(stages.verdict)))
    return rows


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
        f"{spectrum.window} window, segments of {spectrum.segment} samples, line spacing "
        f"{spacing}, noise bandwidth {resolution}"
    )
