"""One HTML page of an inference: verdict, marginals, pairs, prediction against data, models, what to run next."""

from pathlib import Path
from typing import NamedTuple

from asperity.core.quantities import quantity
from asperity.inference import KEY_QUANTITIES, Design, Forecast, Inference, PointEstimates
from asperity.report.base import Tile, heading, render, write_page
from asperity.report.forecast import ahead
from asperity.report.inference import exhibits


class Line(NamedTuple):
    """A row of the table: what it is, median, interval with and without the laws' error, bits, what to think of it."""

    name: str
    median: str
    interval: str
    exact: str
    bits: str
    remark: str


def write_inference_report(
    found: Inference,
    path: str | Path,
    *,
    forecast: Forecast | None = None,
    design: Design | None = None,
) -> Path:
    """Write one self-contained HTML page about what recordings say, whole or not at all.

    Parameters
    ----------
    found : what they say
    path : of the page
    forecast, design : when a limit is crossed, and what keeps the load share below a value, where they were asked

    Raises
    ------
    BadInput
        for a path that cannot be written to.
    """
    return write_page(path, lambda: render_inference_page(found, forecast, design))


def render_inference_page(
    found: Inference, forecast: Forecast | None = None, design: Design | None = None
) -> str:
    """The page as HTML text; see `write_inference_report`."""
    known = found.posterior()
    return render(
        "inference/page.html.j2",
        title="What recordings say of a contact",
        found=found,
        tiles=[
            Tile(
                heading(quantity(key)),
                quantity(key).number(known[key].median),
                f"({quantity(key).interval(known[key].low, known[key].high)})",
            )
            for key in KEY_QUANTITIES
            if key in known
        ],
        warnings=found.warnings(),
        marginals=exhibits.marginals(found).picture(),
        pairs=exhibits.pairs(found).picture(),
        predicted=exhibits.predicted(found).picture() if found.observations else None,
        following=exhibits.following(found).picture(),
        lines=_lines(found),
        heads=PointEstimates.HEADS,
        points=[one.cells() for one in found.point_estimates()],
        forecast=forecast,
        design=design,
        ahead=None if forecast is None else ahead(forecast.bands, forecast.x_name or "x").picture(),
        levers=None if design is None else exhibits.levers(design).picture(),
        models=[
            (
                model.law,
                "with its error" if model.discrepancy else "exact",
                quantity("log_evidence").number(model.log_evidence, model.log_evidence_std),
                quantity("model_probability").text(model.probability),
            )
            for model in found.models
        ],
        emulator=found.emulator.sentence(),
    )


def _lines(found: Inference) -> list[Line]:
    exact, lines = found.posterior(discrepancy=False), []
    for key, one in found.posterior().items():
        entry, other = quantity(key), exact[key]
        remark = "" if one.learnt else "as assumed"
        if one.against:
            remark = f"against the {'lower' if one.against == 'low' else 'upper'} end of its prior"
        lines.append(
            Line(
                heading(entry),
                entry.number(one.median),
                entry.interval(one.low, one.high),
                entry.interval(other.low, other.high),
                quantity("information_bits").number(one.information_bits),
                remark,
            )
        )
    return lines
