"""Adapt docstrings for Sphinx and set the style of the gallery's figures.

Characters that reStructuredText would take for markup are escaped; trailing comments describe
fields.
"""

import inspect
import re
from typing import Any

CODE = re.compile(r"(``?[^`]+``?)")
INNER = r"\[(?:[^\[\]]|\[(?:[^\[\]]|\[[^\[\]]*\])*\])*\]"  # brackets, three deep
ARRAY = re.compile(rf"(~?numpy\.ndarray){INNER}")


def plain(_app: Any, kind: str, _name: str, owner: Any, _options: Any, lines: list[str]) -> None:
    """Escape bars, stars and trailing underscores outside code, and describe a class's fields.

    Words before a colon in the first line of a property are no type and are restored.
    """
    if kind == "class":
        lines += _fields(owner)
    taken = [line for line in lines if line.startswith(":type: ")] if kind == "property" else []
    for line in taken:
        lines.remove(line)
        lines[0] = f"{line.removeprefix(':type: ')}: {lines[0]}"
    lines[:] = ["".join(_escaped(part) for part in CODE.split(line)) for line in lines]


def described(
    _app: Any, _kind: str, _name: str, _owner: Any, _options: Any, lines: list[str]
) -> None:
    """Move the description of each parameter to a line of its own."""
    lines[:] = [part for line in lines for part in _entry(line)]


def signed(
    _app: Any,
    _kind: str,
    _name: str,
    _owner: Any,
    _options: Any,
    signature: str | None,
    returns: str | None,
) -> tuple[str | None, str | None]:
    """Shorten array types and factory defaults in a signature so that it parses."""
    return _short(signature), _short(returns)


def _short(text: str | None) -> str | None:
    return text and ARRAY.sub(r"\1", text).replace("<factory>", "...")


def _entry(line: str) -> list[str]:
    found = re.fullmatch(r"([a-z]\w*(?:, \w+)*) : (.+)", line)
    return [found[1], f"    {found[2]}"] if found else [line]


def _escaped(text: str) -> str:
    return text if CODE.fullmatch(text) else re.sub(r"([|*]|(?<=\w)_(?!\w))", r"\\\1", text)


def _fields(owner: type) -> list[str]:
    """Return a list of the fields that have a trailing comment in the source."""
    fields = re.findall(
        r"^    (\w+): .*?  # (?!noqa|type:)(.+)$", inspect.getsource(owner), re.MULTILINE
    )
    return ["", *(f"- ``{name}``: {comment}" for name, comment in fields), ""] if fields else []


def styled(_gallery: dict[str, Any], _script: str) -> None:
    """Set Matplotlib's style for a script of the gallery."""
    import matplotlib as mpl

    mpl.rcdefaults()
    mpl.use("agg")
    settings = {
        "figure.dpi": 100,
        "savefig.dpi": 160,
        "savefig.bbox": "tight",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": "medium",
        "font.size": 13,  # readable in the thumbnails
        "legend.fontsize": "small",
        "legend.frameon": False,
        "lines.markersize": 5,
        "image.interpolation": "nearest",
    }
    mpl.rcParams.update(settings)
