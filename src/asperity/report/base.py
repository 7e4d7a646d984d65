"""What all pages share: exhibits, tiles, the template, numbers as they are set in print, and pages written whole.

Nothing is solved or fitted for a page; it is self-contained and loads nothing.
"""

import re
from base64 import b64encode
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from asperity.core.files import atomic_write, require_writable
from asperity.core.quantities import Quantity, in_print, quantity
from asperity.paper import CITATION
from asperity.report.style import ON_PAGE, ON_PAPER, ON_TELEPHONE, Medium, svg, write_figure

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none';"


class Picture(NamedTuple):
    """A figure as the page embeds it; `width` and `height` in CSS pixels keep its place while it loads.

    `narrow` is the same figure drawn for a telephone, with its own width and height; a wide one
    may have it.
    """

    uri: str
    width: int
    height: int
    alt: str
    caption: str
    narrow: "Picture | None" = None


@dataclass(frozen=True, slots=True)
class Exhibit:
    """A figure: its file's name, how it is drawn for a medium, and what is said of it wherever it is shown."""

    name: str
    draw: Callable[[Medium], Figure]
    caption: str
    alt: str

    def figure(self, medium: Medium = ON_PAGE) -> Figure:
        """Drawn for that medium."""
        with medium.drawing():
            return self.draw(medium)

    def picture(self) -> Picture:
        """As a page embeds it."""
        return self.picture_of(self.figure())

    def picture_and_narrow(self) -> Picture:
        """As a page embeds it, with a drawing of its own for telephones."""
        return self.picture()._replace(narrow=self.picture_of(self.figure(ON_TELEPHONE)))

    def picture_of(self, figure: Figure) -> Picture:
        """As a page embeds it, once it is drawn."""
        text = re.sub(
            r"^.*?(?=<svg)", "", svg(figure), flags=re.DOTALL
        )  # an image needs no XML prologue
        width, height = figure.get_size_inches() * 96.0
        uri = "data:image/svg+xml," + quote(
            re.sub(r"\s*\n\s*", " ", text), safe=" ='/:;,.()+-*!@?&$[]{}|~^`"
        )
        return Picture(
            uri,
            round(float(width)),
            round(float(height)),
            in_print(self.alt),
            in_print(self.caption),
        )


def write_exhibits(
    exhibits: Iterable[Exhibit], folder: Path, progress: Callable[[str], None]
) -> None:
    """Each exhibit for a paper, as PDF and PNG, and what to print below them in captions.md."""
    captions = []
    for exhibit in exhibits:
        progress(f"drawing {exhibit.name}")
        figure = exhibit.figure(ON_PAPER)
        for suffix in (".pdf", ".png"):
            write_figure(figure, folder / f"{exhibit.name}{suffix}", medium=ON_PAPER, dpi=300)
        captions.append(f"**{exhibit.name}**: {exhibit.caption}\n\n")
    with atomic_write(folder / "captions.md") as part:
        part.write_text(
            f"{''.join(captions)}asperity {version('asperity')}; method: doi:{CITATION.doi}\n",
            "utf-8",
        )


class Tile(NamedTuple):
    """A number that stands out on a page, and what stands small beside it: deviation and unit."""

    name: str
    value: str
    rest: str


def tile(quantity: Quantity, row: Mapping[str, Any]) -> Tile:
    """A quantity of a row, its deviation and unit apart."""
    low, high = (row.get(end) for end in quantity.ends)
    if low is not None and high is not None:
        return Tile(
            heading(quantity),
            quantity.number(row[quantity.key]),
            f"({quantity.interval(low, high)})",
        )
    value, _, deviation = quantity.number_in(row).partition(" ± ")
    if value.startswith("("):  # the power of ten of both
        deviation, _, power = deviation.partition(")")
        value, deviation = value[1:] + power, deviation + power
    unit = quantity.display if quantity.text_in(row) != value else ""
    return Tile(heading(quantity), value, f"± {deviation} {unit}".rstrip() if deviation else unit)


def heading(quantity: Quantity) -> str:
    """What a quantity is called at the beginning of a row."""
    return capitalised(quantity.title)


def span(quantity: Quantity, values: Collection[float]) -> str:
    """From the least to the largest of the values: "20.0 to 69.4 %"."""
    low, high = quantity.number(min(values)), quantity.text(max(values))
    return high if quantity.text(min(values)) == high else f"{low} to {high}"


def capitalised(text: str) -> str:
    """The text with a capital first letter."""
    return text[:1].upper() + text[1:]


def render(template: str, *, script: str = "", **values: Any) -> str:
    """A page as HTML text, escaped and complete; quantities are asked for their names and numbers where they stand.

    The page may load nothing and run nothing but `script`, whatever stands in the names that it
    shows.
    """
    runs = (
        f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'" if script else "'none'"
    )
    values |= {"script": script, "policy": f"{POLICY} script-src {runs}"}
    environment = Environment(
        loader=PackageLoader("asperity.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(in_print=in_print, capitalised=capitalised)
    shared = {
        "version": version("asperity"),
        "paper": CITATION,
        "quantity": quantity,
        "heading": heading,
    }
    return environment.get_template(template).render(**shared, **values)


def write_page(path: str | Path, page: Callable[[], str]) -> Path:
    """Write a page whole or not at all, and return its path; BadInput, before anything is drawn, where it cannot be."""
    path = Path(path)
    require_writable(path)
    with atomic_write(path) as part:
        part.write_text(page(), encoding="utf-8", newline="\n")
    return path
