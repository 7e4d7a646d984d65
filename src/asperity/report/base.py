"""Parts shared by all reports: exhibits, tiles, rendering and atomic writing of a page.

A report shows stored results: nothing is solved or fitted for it. It is one self-contained file.
"""

import re
from base64 import b64encode
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from asperity.core.coverage import PERCENT
from asperity.core.files import atomic_write, make_folder, require_writable
from asperity.core.quantities import UNKNOWN, Quantity, in_print, quantity
from asperity.paper import CITATION
from asperity.report.style import (
    ACROSS_PAGE,
    COLUMN_MM,
    IN_COLUMN,
    ON_PAGE,
    ON_PHONE,
    PAGE_MM,
    Medium,
    for_paper,
    svg,
    write_figure,
)

POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; "
    "form-action 'none';"
)


class Picture(NamedTuple):
    """A figure embedded in a page; `width` and `height` in CSS pixels reserve its space.

    `narrow` is an optional version of a wide figure for phones, with its own width and height.
    """

    uri: str
    width: int
    height: int
    alt: str
    caption: str
    narrow: "Picture | None" = None


@dataclass(frozen=True, slots=True)
class Exhibit:
    """A figure with its file name, drawing function, caption and alternative text."""

    name: str
    draw: Callable[[Medium], Figure]
    caption: str
    alt: str

    def figure(self, medium: Medium = ON_PAGE) -> Figure:
        """Draw the figure for a medium."""
        with medium.drawing():
            return self.draw(medium)

    def paper_figure(self, medium: Medium) -> Figure:
        """Draw the figure for a paper, without title."""
        with medium.drawing():
            return for_paper(self.draw(medium))

    def picture(self) -> Picture:
        """Draw the figure and embed it."""
        return self.embed(self.figure())

    def responsive_picture(self) -> Picture:
        """Embed the figure together with a narrow version for phones."""
        return self.picture()._replace(narrow=self.embed(self.figure(ON_PHONE)))

    def embed(self, figure: Figure) -> Picture:
        """Convert a drawn figure to an SVG data URI."""
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
    exhibits: Iterable[Exhibit], folder: str | Path, progress: Callable[[str], None] | None = None
) -> None:
    """Write each exhibit as PDF for one column and for the page, and all captions to captions.md.

    The pictures are 85 and 175 mm wide, as their names say, and have no title.
    """
    folder = Path(folder)
    make_folder(folder)
    require_writable(folder / "captions.md")
    captions = []
    for exhibit in exhibits:
        if progress is not None:
            progress(f"drawing {exhibit.name}")
        for medium, width in ((IN_COLUMN, COLUMN_MM), (ACROSS_PAGE, PAGE_MM)):
            path = folder / f"{exhibit.name}-{width:.0f}mm.pdf"
            write_figure(exhibit.paper_figure(medium), path, medium=medium, dpi=300)
        captions.append(f"**{exhibit.name}**: {exhibit.caption}\n\n")
    with atomic_write(folder / "captions.md") as part:
        part.write_text(
            f"{''.join(captions)}asperity {version('asperity')}; method: doi:{CITATION.doi}\n",
            "utf-8",
        )


Numbers: TypeAlias = Mapping[str, Any]  # values by key


class Tile(NamedTuple):
    """A highlighted number of a page; `detail` holds its uncertainty and unit in small type."""

    name: str
    value: str
    detail: str


def tile(quantity: Quantity, row: Numbers) -> Tile:
    """Return the tile of a quantity of a row, with its uncertainty and unit."""
    low, high = (row.get(end) for end in quantity.ends)
    number = row.get(quantity.key)
    if isinstance(number, str):
        return Tile(heading(quantity), number, "")
    if number is not None and quantity.ends[0] in row:
        interval = UNKNOWN if low is None or high is None else quantity.interval(low, high)
        detail = f"{quantity.display} ({interval})".lstrip()
        return Tile(heading(quantity), quantity.number(number), detail)
    value, _, deviation = quantity.number_in(row).partition(" ± ")
    if value.startswith("("):  # the power of ten of both
        deviation, _, power = deviation.partition(")")
        value, deviation = value[1:] + power, deviation + power
    unit = quantity.display if quantity.text_in(row) != value else ""
    return Tile(heading(quantity), value, f"± {deviation} {unit}".rstrip() if deviation else unit)


def heading(quantity: Quantity) -> str:
    """Return the title of a quantity with a capital first letter."""
    return capitalised(quantity.title)


def range_text(quantity: Quantity, values: Collection[float]) -> str:
    """Return the range of the values as text, such as "20.0 to 69.4 %"."""
    low = quantity.number(min(values))
    high = quantity.text(max(values))
    return high if quantity.text(min(values)) == high else f"{low} to {high}"


def capitalised(text: str) -> str:
    """Return the text with a capital first letter."""
    return text[:1].upper() + text[1:]


def html_sentence(text: str) -> Markup:
    """Return a sentence for a page: escaped, units in print, names between backticks as code."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(in_print(text)))))


def render(template: str, *, script: str = "", **values: object) -> str:
    """Render a template to an HTML page, with escaping.

    The content security policy forbids all loading and every script except `script`.
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
    environment.filters.update(in_print=html_sentence, capitalised=capitalised)
    shared = {
        "version": version("asperity"),
        "paper": CITATION,
        "quantity": quantity,
        "heading": heading,
        "coverage": PERCENT,
    }
    return environment.get_template(template).render(**shared, **values)


def write_page(path: str | Path, page: Callable[[], str]) -> Path:
    """Write a page atomically and return its path; raise BadInput early if not writable."""
    path = Path(path)
    require_writable(path)
    with atomic_write(path) as part:
        part.write_text(page(), encoding="utf-8", newline="\n")
    return path
