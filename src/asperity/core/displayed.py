"""Results in Python: a short text, a table with a picture in notebooks, and drawings."""

import sys
from base64 import b64encode
from collections.abc import Iterator, Mapping
from dataclasses import fields
from html import escape
from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from asperity.core.errors import AsperityError
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_REPR = 300  # characters
SHOWN = (  # in the table of a notebook, where the result has them
    *("clr", "car", "sq_m", "h_mean_m", "h_min_m", "friction_coefficient"),
    *("flash_temperature_max_k", "crf_hz", "crfa"),
)


class Brief:
    """Result with a short text: its verdict, or its fields without one."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the name of the class with the verdict, or its fields; at most 300 characters."""
        verdict = getattr(self, "verdict", None)
        text = ", ".join(_fields(self)) if verdict is None else verdict()
        text = f"{type(self).__name__}({text})"
        return text if len(text) <= MAX_REPR else f"{text[: MAX_REPR - 4]}...)"


class Displayed(Brief):
    """Result with a drawing."""

    __slots__ = ()

    def plot(self, drawing: str = "") -> "Axes":
        """Draw the result and return the first axes of a matplotlib figure.

        Where pyplot is imported, its `show` shows the figure, as notebooks do at the end of a cell.

        Parameters
        ----------
        drawing : its name; default: the first one. A wrong name lists them.

        Raises
        ------
        BadInput
            for an unknown drawing.
        """
        figure = _figure(self, drawing)
        _register(figure)
        return figure.axes[0]

    def _repr_html_(self) -> str:
        """Return the verdict, a small table and the first drawing, for notebooks."""
        scalars = getattr(self, "scalars", None)
        rows = _rows(scalars()) if callable(scalars) else []
        cells = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in rows
        )
        try:
            picture = _picture(self)
        except AsperityError as refusal:
            picture = f"<p>{escape(str(refusal))}</p>"
        return f"<div><p>{escape(repr(self))}</p><table>{cells}</table>{picture}</div>"


def _fields(value: object) -> Iterator[str]:
    """Yield the fields of a dataclass as short texts."""
    for field in fields(value):  # type: ignore[arg-type]
        if field.repr:
            yield f"{field.name}={_short(getattr(value, field.name))}"


def _short(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, float):
        return f"{value:.4g}"
    text = repr(value)
    return text if len(text) <= MAX_REPR // 6 else f"{type(value).__name__}(...)"


def _rows(scalars: Mapping[str, object]) -> list[tuple[str, str]]:
    """Return the numbers shown, with their intervals; first and last value of a history."""
    rows = []
    for key in SHOWN:
        value, entry = scalars.get(key), quantity(key)
        if isinstance(value, list):
            rows.append((entry.title, f"{entry.number(value[0])} to {entry.text(value[-1])}"))
        elif value is not None:
            rows.append((entry.title, entry.text_in(scalars)))
    return rows


def _figure(value: Displayed, drawing: str = "") -> "Figure":
    # loaded by name: drawing is above all results, and most of them are never drawn
    figure: Figure = import_module("asperity.report").draw_result(value, drawing)
    return figure


def _register(figure: "Figure") -> None:
    """Let pyplot manage a figure, if pyplot is imported."""
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        from matplotlib._pylab_helpers import Gcf

        number = max(pyplot.get_fignums(), default=0) + 1
        Gcf._set_new_active_manager(pyplot.new_figure_manager(number, FigureClass=lambda: figure))


def _picture(value: Displayed) -> str:
    image = BytesIO()
    _figure(value).savefig(image, format="png", dpi=110)
    data = b64encode(image.getvalue()).decode("ascii")
    name = escape(type(value).__name__)
    return f'<img alt="{name}" style="max-width: 100%" src="data:image/png;base64,{data}">'
