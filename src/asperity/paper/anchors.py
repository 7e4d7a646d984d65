"""What is known from elsewhere about a wear curve, the paper's printed numbers above all, and how a curve meets it."""

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
    """What anchors are compared with: a study's wear curve."""

    @property
    def stages(self) -> Mapping[str, Stages]:
        """Along Sq in micrometres, by vibration preset."""

    def interpolate(self, sq: float, quantity: str) -> tuple[float, float, float]:
        """Mean at a roughness [m] and its interval; nan where the curve does not reach."""


@dataclass(frozen=True, kw_only=True)
class Anchor:
    """A number that a wear curve should meet.

    Parameters
    ----------
    name : what a table calls it
    quantity : a column of the study, or "split", the break between stages [um of Sq]
    value, tolerance : in the column's unit; `tolerance` is what a deviation is measured by
    sq : roughness it holds at [m]; None for "split"
    since : where given, the anchor is the change of the quantity from there to `sq` [m]
    sense : whether the curve should be about `value`, at least or at most that
    source : where it is printed
    fitted : whether a calibration aims at it
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

    def of(self, curve: CurveOverSq) -> tuple[float, float, float]:
        """What the curve has in its place, and the interval over seeds; nan where the curve does not reach."""
        if self.quantity == SPLIT_ANCHOR:
            stages = curve.stages.get("sound")
            return (
                (np.nan,) * 3
                if stages is None or not stages.found
                else (stages.split, *stages.interval)
            )
        assert self.sq is not None
        here = curve.interpolate(self.sq, self.quantity)
        if self.since is None:
            return here
        there = curve.interpolate(self.since, self.quantity)
        off = float(np.hypot(here[2] - here[0], there[2] - there[0]))
        change = here[0] - there[0]
        return change, change - off, change + off

    def miss(self, ours: float) -> float:
        """How far off `ours` is, in the quantity's unit; 0 where the anchor only bounds it and is kept."""
        off = ours - self.value
        if self.sense == "at least":
            return min(off, 0.0)
        return max(off, 0.0) if self.sense == "at most" else off


def compare_with_anchors(
    curve: CurveOverSq, anchors: Sequence[Anchor] | None = None
) -> pandas.DataFrame:
    """A row an anchor, the paper's unless given: what is printed, ours with its 90 % interval, the miss, whether met.

    `met` is True where the miss is within the tolerance, and `possible` where some value of the
    interval would be. Both are False where the curve has no value (a Sq that was not computed,
    stages that are not there).
    """
    rows = []
    for anchor in PAPER_ANCHORS if anchors is None else anchors:
        ours, low, high = anchor.of(curve)
        ends = [abs(anchor.miss(end)) for end in (low, high) if np.isfinite(end)]
        crossed = bool(np.isfinite(low) and low <= anchor.value <= high)
        miss = anchor.miss(ours) if np.isfinite(ours) else np.nan
        met = bool(np.isfinite(miss) and abs(miss) <= anchor.tolerance)
        sq_um = np.nan if anchor.sq is None else 1e6 * anchor.sq
        possible = met or crossed or any(end <= anchor.tolerance for end in ends)
        about = (anchor.name, anchor.quantity, sq_um, anchor.sense, anchor.value, anchor.tolerance)
        rows.append((*about, ours, low, high, miss, met, possible, anchor.source))
    return pandas.DataFrame(rows, columns=list(COMPARED))


def rig_prediction(curve: CurveOverSq, quantity: str = "crf_sound_hz") -> pandas.DataFrame:
    """Our CRF at the rig's twelve Sq values with the spread over seeds, beside what is printed: the two ends."""
    table = pandas.DataFrame({"sq_um": SAMPLES_SQ_UM, "sq_std_um": SAMPLES_STD_UM})
    table[["crf_hz", "low", "high"]] = [
        curve.interpolate(1e-6 * sq, quantity) for sq in SAMPLES_SQ_UM
    ]
    table["printed_hz"] = [CRF_ENDS_HZ[0], *[np.nan] * (len(table) - 2), CRF_ENDS_HZ[1]]
    return table


def rig_deviation(curve: CurveOverSq, quantity: str = "crf_sound_hz") -> dict[str, float]:
    """Root mean square of our CRF less the rig's [Hz]; nan where the curve does not reach over all of its Sq.

    "ends": over the two values that are printed. "knee", "smooth": over all twelve Sq, between
    those ends along a bent or a saturating line; its Fig 13 has no numbers, so that the shape
    between the ends is ours.
    """
    predicted = rig_prediction(curve, quantity)
    ours, sq = predicted["crf_hz"].to_numpy(dtype=float), 1e-6 * np.array(SAMPLES_SQ_UM)
    ends = ours[[0, -1]] - np.array(CRF_ENDS_HZ)
    shapes = {name: ours - TRENDS[name](sq) for name in ("knee", "smooth")}
    return {name: float(np.sqrt(np.mean(off**2))) for name, off in {"ends": ends, **shapes}.items()}


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
    """Read anchors of one's own: a TOML file of [[anchor]] tables with the fields of `Anchor`, Sq with its unit.

    Raises
    ------
    UnreadableFile
        if the file is missing or no TOML.
    BadInput
        for a table that lacks something or has what an anchor has not.
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
                f"{path}: anchor {section.name!r} needs sq, a length; only a split has none"
            )
    return tuple(Anchor(**dict(section)) for section in sections)


PAPER_ANCHORS = load_anchors(Path(__file__).with_name("anchors.toml"))
