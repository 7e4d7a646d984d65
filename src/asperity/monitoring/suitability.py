"""Uses of a recording: contact resonance, envelope, velocity zone and level trend.

Each is judged by the requirements of its own method; `reading` computes the numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from asperity.monitoring.reading import line_spacing
from asperity.monitoring.target import Target
from asperity.rating import HIGHEST_HZ, LOWEST_HZ, MAX_SPACING_HZ
from asperity.recording import OpenRecording, Quality, SampleStatistics
from asperity.vibration import Envelope

USES = {  # key: label
    "contact_resonance": "contact resonance",
    "envelope": "envelope at fault frequencies",
    "zone": "velocity zone",
    "level": "level trend",
}


@dataclass(frozen=True, slots=True)
class Suitability:
    """Judgement of a recording for one use; `reason` states why not, or what it provides."""

    possible: bool
    reason: str


def suitabilities(
    opened: OpenRecording,
    statistics: SampleStatistics,
    target: Target,
    rates_hz: Mapping[str, float],
) -> dict[str, Suitability]:
    """Return for each of `USES` whether a recording is good for it, by its sample statistics.

    `rates_hz` are the fault frequencies, where they are known.
    """
    quality = statistics.quality(opened, width_hz=target.width_hz, band_hz=target.band_hz)
    low, high = target.band_hz
    resonance = Suitability(
        quality.usable, "; ".join(quality.faults) or f"searched from {low:.0f} to {high:.0f} Hz"
    )
    faults = statistics.quality(opened, width_hz=None, band_hz=None).faults
    if faults:  # of machine or sensor: nothing can be used
        others = dict.fromkeys(("envelope", "zone", "level"), Suitability(False, "; ".join(faults)))
    else:
        others = {
            "envelope": _envelope(opened, quality, rates_hz),
            "zone": _zone(opened, quality, target),
            "level": Suitability(True, _level(opened)),
        }
    return {"contact_resonance": resonance} | others


def _level(opened: OpenRecording) -> str:
    if opened.comparable or opened.velocity_factor is not None:
        return f"rms in {opened.unit}, kurtosis and bands"
    return f"relative to recordings of equal gain only (unit: {opened.unit})"


def _envelope(
    opened: OpenRecording, quality: Quality, rates_hz: Mapping[str, float]
) -> Suitability:
    """Judge by the frequencies that the envelope resolves, and the stated fault frequencies."""
    envelope = Envelope(opened.rate_hz)
    lowest, highest = envelope.range_hz(quality.samples)
    if not lowest < highest:
        return Suitability(
            False, f"too short: {quality.duration_s:.3g} s resolve no fault frequency"
        )
    if (quality.gaps or quality.stuck) and not _has_whole_chunk(opened, envelope):
        return Suitability(False, "no stretch without lost samples is as long as a transform")
    resolved = f"resolves {lowest:.3g} to {highest:.4g} Hz"
    if not rates_hz:
        return Suitability(
            True, f"{resolved}; state fault frequencies as faults_hz or faults_per_turn"
        )
    within = [name for name, rate in rates_hz.items() if lowest <= rate <= highest]
    beyond = [f"{name} ({rates_hz[name]:.4g} Hz)" for name in rates_hz if name not in within]
    if not within:
        return Suitability(False, f"{resolved}, not {', '.join(beyond)}")
    without = f", not {', '.join(beyond)}" if beyond else ""
    return Suitability(True, f"{resolved}: {', '.join(within)}{without}")


def _has_whole_chunk(opened: OpenRecording, envelope: Envelope) -> bool:
    """Return whether a stretch without gaps is as long as a chunk of the envelope."""
    blocks = SampleStatistics().without_stuck(opened.blocks())
    for _ in envelope.watch(blocks):
        if envelope.chunks:
            return True
    return envelope.chunks > 0


def _zone(opened: OpenRecording, quality: Quality, target: Target) -> Suitability:
    """Judge by unit, rate and length."""
    if not opened.comparable and opened.velocity_factor is None:
        return Suitability(
            False, f"its unit must be an acceleration or velocity, and is {opened.unit}"
        )
    if opened.rate_hz < 2.0 * HIGHEST_HZ:
        return Suitability(
            False,
            f"sampled too slowly: {opened.rate_hz:g} Hz; velocities up to {HIGHEST_HZ:g} Hz need "
            f"{2.0 * HIGHEST_HZ:g} Hz",
        )
    spacing = line_spacing(quality.duration_s, target)
    if spacing > MAX_SPACING_HZ or quality.duration_s * spacing < 1.0:  # a segment
        return Suitability(
            False,
            f"too short: {quality.duration_s:.3g} s; velocities from {LOWEST_HZ:g} Hz need 3.2 s",
        )
    if "machine_class" not in opened.facts:
        return Suitability(True, "velocity can be determined; state machine_class for its zone")
    return Suitability(True, f"machine class {opened.facts['machine_class'].value}")


def good_for(uses: Mapping[str, Suitability]) -> str:
    """Return the uses that are possible as text: "all", "nothing" or their names."""
    names = [USES[key] for key, use in uses.items() if use.possible]
    if len(names) == len(uses):
        return "all"
    return ", ".join(names) or "nothing"
