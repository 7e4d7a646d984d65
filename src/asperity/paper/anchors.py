"""Anchors of a wear curve: known values, chiefly the paper's, and the comparison with a curve."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Protocol

import numpy as np
import pandas
from pydantic import Field as Entry

from asperity.case import Length, Section, parse_section
from asperity.core.errors import BadInput, UnreadableFile
from asperity.paper.numbers import CRF_ENDS_HZ, SAMPLES_SQ_UM, SAMPLES_STD_UM
from asperity.paper.rig import TRENDS
from asperity.trend import Stages

AnchorSense = Literal["about", "at least", "at most"]
COMPARED = (  # columns of the table of anchors
    "anchor",
    "quantity",
    "sq_um",
    "sense",
    "printed",
    "tolerance",
    "ours",
    "low",
    "high",
    "miss",
    "met",
    "possible",
    "source",
)
SPLIT_ANCHOR = "split"  # the quantity of an anchor that is a break between stages


class CurveOverSq(Protocol):
    """Wear curve of a study, as compared with anchors."""

    @property
    def stages(self) -> Mapping[str, Stages]:
        """Stages along Sq [um], by vibration preset."""

    def interpolate(self, sq: float, quantity: str) -> tuple[float, float, float]:
        """Return the mean at a roughness [m] and its interval; nan outside the curve."""


@dataclass(frozen=True, kw_only=True)
class Anchor:
    """Known value that a wear curve should match.

    Parameters
    ----------
    name : name in tables
    quantity : a column of the study, or "split", the break between stages [um of Sq]
    value, tolerance : in the column's unit
    sq : roughness [m] at which it applies; None for "split"
    since : if given, the anchor is the change of the quantity from there to `sq` [m]
    sense : the curve should be about `value`, at least or at most `value`
    source : publication
    fitted : True if a calibration should match it
    """

    name: str
    quantity: str
    value: float
    tolerance: float
    sq: float | None = None
    since: float | None = None
    sense: AnchorSense = "about"
    source: str = ""
    fitted: bool = True

    def evaluate(self, curve: CurveOverSq) -> tuple[float, float, float]:
        """Return the curve's value for this anchor and its interval over seeds; nan outside."""
        if self.quantity == SPLIT_ANCHOR:
            stages = curve.stages.get("sound")
            return (
                (np.nan,) * 3
                if stages is None or not stages.found
                else (stages.split, *stages.interval)
            )
        assert self.sq is not None
        value = curve.interpolate(self.sq, self.quantity)
        if self.since is None:
            return value
        reference = curve.interpolate(self.since, self.quantity)
        # method of variance estimates recovery (Zou and Donner 2008): each end of the difference
        # from the two ends that lead to it, which may lie at different distances
        change = value[0] - reference[0]
        below = float(np.hypot(value[0] - value[1], reference[2] - reference[0]))
        above = float(np.hypot(value[2] - value[0], reference[0] - reference[1]))
        return change, change - below, change + above

    def miss(self, our_value: float) -> float:
        """Return the deviation in the quantity's unit; 0 for a bound that is satisfied."""
        deviation = our_value - self.value
        if self.sense == "at least":
            return min(deviation, 0.0)
        return max(deviation, 0.0) if self.sense == "at most" else deviation


def compare_with_anchors(
    curve: CurveOverSq, anchors: Sequence[Anchor] | None = None
) -> pandas.DataFrame:
    """Return a table with a row per anchor: published value, ours with interval, deviation.

    `met` is True if the deviation is within the tolerance, and `possible` if it would be for some
    value of the interval. Both are False if the curve has no value (Sq not computed, no stages).
    """
    rows = []
    for anchor in PAPER_ANCHORS if anchors is None else anchors:
        our_value, low, high = anchor.evaluate(curve)
        deviations = [abs(anchor.miss(limit)) for limit in (low, high) if np.isfinite(limit)]
        contained = bool(np.isfinite(low) and low <= anchor.value <= high)
        miss = anchor.miss(our_value) if np.isfinite(our_value) else np.nan
        fulfilled = bool(np.isfinite(miss) and abs(miss) <= anchor.tolerance)
        sq_um = np.nan if anchor.sq is None else 1e6 * anchor.sq
        possible = fulfilled or contained or any(limit <= anchor.tolerance for limit in deviations)
        description = (
            anchor.name,
            anchor.quantity,
            sq_um,
            anchor.sense,
            anchor.value,
            anchor.tolerance,
        )
        rows.append((*description, our_value, low, high, miss, fulfilled, possible, anchor.source))
    return pandas.DataFrame(rows, columns=list(COMPARED))


def rig_prediction(curve: CurveOverSq, quantity: str = "crf_sound_hz") -> pandas.DataFrame:
    """Return our CRF at the rig's twelve Sq, its spread over seeds and the published values."""
    table = pandas.DataFrame({"sq_um": SAMPLES_SQ_UM, "sq_std_um": SAMPLES_STD_UM})
    table[["crf_hz", "low", "high"]] = [
        curve.interpolate(1e-6 * sq, quantity) for sq in SAMPLES_SQ_UM
    ]
    table["printed_hz"] = [CRF_ENDS_HZ[0], *[np.nan] * (len(table) - 2), CRF_ENDS_HZ[1]]
    return table


def rig_deviation(curve: CurveOverSq, quantity: str = "crf_sound_hz") -> dict[str, float]:
    """Return the root mean square deviation of our CRF from the rig's [Hz]; nan outside the curve.

    "ends": over the two published values. "knee", "smooth": over all twelve Sq, with a bent or a
    saturating line between those ends; the paper's Fig 13 has no numbers, so that the shape is
    ours.
    """
    predicted = rig_prediction(curve, quantity)
    our_value = predicted["crf_hz"].to_numpy(dtype=float)
    sq = 1e-6 * np.array(SAMPLES_SQ_UM)
    end_deviations = our_value[[0, -1]] - np.array(CRF_ENDS_HZ)
    shapes = {name: our_value - TRENDS[name](sq) for name in ("knee", "smooth")}
    return {
        name: float(np.sqrt(np.mean(deviation**2)))
        for name, deviation in {"ends": end_deviations, **shapes}.items()
    }


class _AnchorSection(Section):
    name: str
    quantity: str
    value: float
    tolerance: Annotated[float, Entry(gt=0.0)]
    sq: Length | None = None
    since: Length | None = None
    sense: AnchorSense = "about"
    source: str = ""
    fitted: bool = True


class _AnchorFile(Section):
    anchor: Annotated[tuple[_AnchorSection, ...], Entry(min_length=1)]


def load_anchors(path: str | Path) -> tuple[Anchor, ...]:
    """Load user-defined anchors: a TOML file of [[anchor]] tables with the fields of `Anchor`.

    `sq` and `since` are stated with their unit.

    Raises
    ------
    UnreadableFile
        if the file is missing or not TOML.
    BadInput
        for a table with missing or unknown entries.
    """
    path = Path(path)
    try:
        tables = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise UnreadableFile(f"{path} cannot be read as TOML: {error}") from None
    sections = parse_section(_AnchorFile, tables, str(path)).anchor
    for section in sections:
        if (section.sq is None) != (section.quantity == SPLIT_ANCHOR):
            raise BadInput(
                f"{path}: anchor {section.name!r} needs sq, a length (only a split has none)"
            )
    return tuple(Anchor(**dict(section)) for section in sections)


PAPER_ANCHORS = load_anchors(Path(__file__).with_name("anchors.toml"))
