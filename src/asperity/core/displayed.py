"""Results in Python: a short `repr`, a table with a picture in notebooks, and `.plot()`."""

from base64 import b64encode
from collections.abc import Iterator, Mapping
from dataclasses import fields
from html import escape
from importlib import import_module
from io import BytesIO
from typing import Any

import numpy as np

from asperity.core.errors import AsperityError
from asperity.core.quantities import quantity

MAX_REPR = 300  # characters
SHOWN = (  # in the table of a notebook, where the result has them
    *("clr", "car", "sq_m", "h_mean_m", "h_min_m", "friction_coefficient"),
    *("flash_temperature_max_k", "crf_hz", "crfa"),
)


class Brief:
    """Result with a short `repr`: its verdict, or its fields without one."""

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

    def plot(self, what: str = "") -> Any:
        """Draw the result and return matplotlib axes; `axes.figure` is the figure.

        Parameters
        ----------
        what : name of a drawing; default: the first one. A wrong name lists them.

        Raises
        ------
        BadInput
            for an unknown drawing.
        """
        # loaded by name: drawing is above all results, and most of them are never drawn
        return import_module("asperity.report").draw_result(self, what).axes[0]

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


def _fields(value: Any) -> Iterator[str]:
    """Yield the fields of a dataclass as short texts."""
    for field in fields(value):
        if field.repr:
            yield f"{field.name}={_short(getattr(value, field.name))}"


def _short(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, float):
        return f"{value:.4g}"
    text = repr(value)
    return text if len(text) <= MAX_REPR // 6 else f"{type(value).__name__}(...)"


def _rows(scalars: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the numbers shown, with their intervals; first and last value of a history."""
    rows = []
    for key in SHOWN:
        value, entry = scalars.get(key), quantity(key)
        if isinstance(value, list):
            rows.append((entry.title, f"{entry.number(value[0])} to {entry.text(value[-1])}"))
        elif value is not None:
            rows.append((entry.title, entry.text_in(scalars)))
    return rows


def _picture(value: Displayed) -> str:
    image = BytesIO()
    value.plot().figure.savefig(image, format="png", dpi=110)
    data = b64encode(image.getvalue()).decode("ascii")
    return f'<img alt="{escape(type(value).__name__)}" src="data:image/png;base64,{data}">'
