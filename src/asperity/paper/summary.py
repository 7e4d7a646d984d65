"""Summaries of a simulated rig and of the reproduction of the paper's Table 1."""

from collections.abc import Sequence

from asperity.paper.rig import Rig
from asperity.paper.table1 import Table1Row


def rig_verdict(rig: Rig) -> str:
    """Return one sentence: number of recordings and range of the true CRF."""
    first = rig.recordings[0]
    last = rig.recordings[-1]
    knee = "" if rig.split_sq_m is None else f", with a knee at Sq {rig.split_sq_m * 1e6:g} um"
    crf_range = " to ".join(
        f"{test.crf_hz:.0f} Hz at Sq {test.sq_m * 1e6:.2f} um" for test in (first, last)
    )
    length = f"{first.duration_s:g} s at {first.rate_hz:g} Hz"
    return f"{len(rig.recordings)} recordings of {length}: true CRF from {crf_range}{knee}."


def rig_scalars(rig: Rig) -> dict[str, object]:
    """Return the content of `asperity rig --json`."""
    return {
        "verdict": rig_verdict(rig),
        "band_hz": list(rig.band_hz),
        "full_load_crf_hz": rig.full_load_crf_hz,
        "split_sq_m": rig.split_sq_m,
        "snr_db": rig.disturbance.snr_db,
    }


def table1_verdict(rows: Sequence[Table1Row], preset: str) -> str:
    """Return one sentence: deviation from published CRFs, and published CRFAs within our range."""
    inside = sum(row.within for row in rows)
    largest = max(abs(row.crf_deviation) for row in rows)
    return (
        f"Table 1, preset {preset}: CRF within {100 * largest:.2f} % of the published values, "
        f"{inside} of {len(rows)} published CRFAs inside our 5 to 95 % range."
    )
