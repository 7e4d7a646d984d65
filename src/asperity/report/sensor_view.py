"""Drawing of what a sensor on a structure sees of a contact."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from asperity.core.arrays import Field
from asperity.report.drawing import legend_below, plain_log_labels
from asperity.report.style import BLUE, GREY, VERMILION, Medium
from asperity.results import SensorView

POINTS = 1500
MIN_SHARE = 0.001  # of the contact, for a label
MARGIN = 1.6  # of the frequency axis beyond the outermost modes
COLOURS = (VERMILION, GREY, BLUE)  # from rough to worn


def response_figure(view: SensorView, medium: Medium) -> Figure:
    """Draw the response of the sensor to roughness over frequency, with the contact's shares."""
    figure, axes = medium.panel(3.8)
    modes = [observed.mode for observed in view.modes]
    places = [mode.frequency_hz for mode in modes] or [1000.0]
    low, high = min(places) / MARGIN, max(places) * MARGIN
    if (measured := view.measured_band_hz) is not None:
        low, high = max(low, measured[0]), min(high, measured[1])
    frequencies_hz = np.geomspace(low, high, POINTS)
    responses = view.response(frequencies_hz)
    for response, sq, clr, colour in zip(responses, view.sq, view.clr, COLOURS, strict=False):
        label = f"Sq {1e6 * sq:.3g} µm, CLR {100.0 * clr:.0f} %"
        axes.loglog(frequencies_hz, response, color=colour, linewidth=1.0, label=label)
    _label_shares(axes, view, frequencies_hz, responses[view.course.own])
    axes.set(
        xlabel="frequency [Hz]",
        ylabel="sensor over roughness [m/m]",
        title=f"Share of the contact in the modes\nof {view.named.name}",
        ylim=(None, 3.0 * float(responses.max())),
    )
    plain_log_labels(axes)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    legend_below(figure, columns=1)
    return figure


def _label_shares(axes: Axes, view: SensorView, frequencies_hz: Field, response: Field) -> None:
    """Write the contact's share at the peak of each mode."""
    for observed in view.modes:
        share, frequency_hz = observed.mode.contact_share, observed.mode.frequency_hz
        if share >= MIN_SHARE:
            axes.annotate(
                f"{100.0 * share:.2g} %",
                (frequency_hz, float(np.interp(frequency_hz, frequencies_hz, response))),
                xytext=(0, 4),
                textcoords="offset points",
                ha="center",
                fontsize="small",
            )
