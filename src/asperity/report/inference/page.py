"""HTML report of an inference: verdict, distributions, predictions, models, next recording."""

from pathlib import Path
from typing import NamedTuple

from asperity.core.coverage import PERCENT
from asperity.core.quantities import quantity
from asperity.inference import KEY_QUANTITIES, Design, Forecast, Inference, PointEstimates
from asperity.report.base import Exhibit, Tile, heading, render, write_page
from asperity.report.forecast import forecast_exhibit
from asperity.report.inference import exhibits


class PosteriorRow(NamedTuple):
    """A row of the table of numbers; `exact` is the interval without the error of the laws."""

    name: str
    median: str
    interval: str
    exact: str
    bits: str
    remark: str


def write_inference_report(
    inference: Inference,
    path: str | Path,
    *,
    forecast: Forecast | None = None,
    design: Design | None = None,
) -> Path:
    """Write a self-contained HTML report of an inference, atomically.

    Parameters
    ----------
    inference : result to report
    path : file to write; its folder must exist
    forecast, design : forecast of crossing a limit, and design changes for a low CLR, if computed

    Raises
    ------
    BadInput
        for a path that is not writable.
    """
    return write_page(path, lambda: render_inference_page(inference, forecast, design))


def render_inference_page(
    inference: Inference, forecast: Forecast | None = None, design: Design | None = None
) -> str:
    """Render the page as HTML text; see `write_inference_report`."""
    posterior = inference.posterior()
    return render(
        "inference/page.html.j2",
        title="Contact state inferred from recordings",
        inference=inference,
        tiles=[
            Tile(
                heading(quantity(key)),
                quantity(key).number(posterior[key].median),
                f"{quantity(key).display} "
                f"({quantity(key).interval(posterior[key].low, posterior[key].high)})",
            )
            for key in KEY_QUANTITIES
            if key in posterior
        ],
        warnings=inference.warnings(),
        meanings=[_meaning(inference, key) for key in posterior],
        marginals=exhibits.marginals(inference).picture(),
        pairs=exhibits.pairs(inference).picture(),
        predicted=exhibits.predicted(inference).picture() if inference.resonant else None,
        next_recording=exhibits.next_recording(inference).picture(),
        rows=_posterior_rows(inference),
        heads=PointEstimates.HEADS,
        points=[point.cells() for point in inference.point_estimates()],
        forecast=forecast,
        design=design,
        forecast_picture=None if forecast is None else _forecast_exhibit(forecast).picture(),
        design_picture=None if design is None else exhibits.design_changes(design).picture(),
        models=[
            (
                model.law,
                "with model error" if model.discrepancy else "exact",
                quantity("log_evidence").number(model.log_evidence, model.log_evidence_std),
                quantity("model_probability").text(model.probability),
            )
            for model in inference.models
        ],
        emulator=inference.emulator.sentence(),
        case_text=inference.setting.case.text,
    )


def inference_exhibits(
    inference: Inference, forecast: Forecast | None = None, design: Design | None = None
) -> list[Exhibit]:
    """Return the figures of the page, distributions first."""
    return [
        exhibits.marginals(inference),
        exhibits.pairs(inference),
        *([exhibits.predicted(inference)] if inference.resonant else []),
        exhibits.next_recording(inference),
        *([] if forecast is None else [_forecast_exhibit(forecast)]),
        *([] if design is None else [exhibits.design_changes(design)]),
    ]


def _forecast_exhibit(forecast: Forecast) -> Exhibit:
    return forecast_exhibit(forecast.bands, forecast.x_name or "x")


def _meaning(inference: Inference, key: str) -> str:
    """Explain the posterior of a quantity in one sentence."""
    estimate = inference.posterior()[key]
    entry = quantity(key)
    if not estimate.learnt:
        return (
            f"{heading(entry)}: the recordings contain no information; the interval "
            f"{entry.interval(estimate.low, estimate.high)} is that assumed before."
        )
    return (
        f"{heading(entry)}: with {PERCENT} probability "
        f"{entry.interval(estimate.low, estimate.high)}, equally likely above and below "
        f"{entry.text(estimate.median)}."
    )


def _posterior_rows(inference: Inference) -> list[PosteriorRow]:
    exact = inference.posterior(discrepancy=False)
    rows = []
    for key, estimate in inference.posterior().items():
        entry = quantity(key)
        without_error = exact[key]
        remark = "" if estimate.learnt else "prior only"
        if estimate.against:
            end = "lower" if estimate.against == "low" else "upper"
            remark = f"at the {end} end of its prior"
        rows.append(
            PosteriorRow(
                heading(entry),
                entry.number(estimate.median),
                entry.interval(estimate.low, estimate.high),
                entry.interval(without_error.low, without_error.high),
                quantity("information_bits").number(estimate.information_bits),
                remark,
            )
        )
    return rows
