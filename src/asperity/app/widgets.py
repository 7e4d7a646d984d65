"""Widgets of the page: inputs, text and tiles as escaped HTML, downloads."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias, TypedDict

from bokeh.models import (
    Button,
    Column,
    ColumnDataSource,
    CustomJS,
    Div,
    Model,
    Row,
    Select,
    Slider,
    TextInput,
    Tooltip,
    UIElement,
)
from markupsafe import Markup

from asperity.app.contact_result import ContactResult, ResultTile, difference
from asperity.app.inputs import CaseInput, shown, written
from asperity.core.quantities import in_print, quantity

HEADLINE = ("clr", "crf_hz")  # numbers of the strip, beside the regime
Look: TypeAlias = dict[str, Any]  # properties of a widget


class PageBlock(TypedDict, total=False):
    """Parts of a page beside one another, by name; `live` announces changes to screen readers."""

    names: list[str]
    heading: str
    live: bool
    first: bool
    key: Sequence[tuple[str, str]]


class PageSection(TypedDict):
    """Section of a page."""

    kind: str
    label: str
    blocks: list[PageBlock]


Layout: TypeAlias = tuple[dict[str, object], list[PageSection]]
"""Parts of a page by name, and the sections that contain them."""

LOOK = """
:host { color: var(--ink); font: inherit; }
.bk-clearfix { display: block; width: 100%; }
.bk-clearfix:empty { display: none !important; }
.bk-input { color: var(--ink); background: var(--paper); border: 1px solid var(--line);
  border-radius: 4px; }
.bk-input, .bk-btn { font: inherit; }
.bk-input:focus { border-color: var(--accent); box-shadow: none; outline: 2px solid var(--accent); }
.bk-input-group label, label { color: var(--ink); font-size: .88rem; }
.bk-btn { color: var(--ink); background: var(--wash); border: 1px solid var(--line);
  border-radius: 4px; }
.bk-btn:hover:enabled, .bk-btn:active { color: var(--ink); background: var(--line); border-color:
  var(--soft); }
.bk-description > .bk-icon { background-color: var(--soft); }
select:not([multiple]).bk-input { background: var(--paper) var(--arrow) right .5em center / 8px
  6px no-repeat; }
.bk-btn:focus-visible, .noUi-handle:focus-visible { outline: 2px solid var(--accent); }
.noUi-target { background: var(--wash); border-color: var(--line); } .noUi-connect { background:
  var(--accent); }
.noUi-handle { background: var(--paper); border: 2px solid var(--accent); box-shadow: none; }
"""
INHERIT = ":host { font: inherit; }"  # for containers
BAR = "#5b9fd4"
MAP_KEY = (("touching", "asperity contact"), ("cavitated", "cavitated"), ("hertz", "Hertz zone"))
DROP = """
:host { color: var(--ink); }
.filepond--root.bk-input.bk-input { color: var(--ink); background: none; border: 0; }
.filepond--root .filepond--drop-label.filepond--drop-label { color: var(--ink); background: none; }
.filepond--panel-root { background: var(--wash); border: 1px dashed var(--soft); }
.filepond--drop-label, .filepond--drop-label label { color: var(--ink); font-size: .88rem; }
"""
DRAWING = """
img { display: block; width: 100%; height: auto; background: #fff; border-radius: 4px; }
p { margin: 4px 0 0; font-size: .8rem; color: var(--soft); }
"""
CHIP = ".bk-btn { border-radius: 99px; padding: 3px 12px; white-space: nowrap; font-size: .9rem; }"
# on narrow screens: fades the right end of a row, as a hint that it scrolls
FADE = """
@media (max-width: 760px) { :host { padding-right: 36px;
  mask-image: linear-gradient(90deg, #000 calc(100% - 48px), transparent); } }
"""
CHOSEN = ".bk-btn { border-color: var(--accent); box-shadow: inset 0 0 0 1px var(--accent); }"
WRONG = ".bk-input { border-color: var(--alarm); border-width: 2px; }"
SENTENCE = """
p { margin: 2px 0 4px; }
h2 { font-size: 1rem; margin: 18px 0 6px; }
a { color: var(--accent); }
.alarm { color: var(--alarm); font-weight: 600; }
.soft { color: var(--soft); }
.warn { color: var(--warn); font-weight: 600; }
"""
TICKS = """
:host { position: relative; height: 1.5em; font-size: .72rem; color: var(--soft); }
span { position: absolute; top: 0; white-space: nowrap; padding-top: 6px; line-height: 1.1; }
span::before { content: ""; position: absolute; top: 0; left: 0; height: 5px; border-left: 1px solid
  var(--soft); }
.right { transform: translateX(-100%); } .right::before { left: 100%; }
.middle { transform: translateX(-50%); } .middle::before { left: 50%; }
"""
TOOLTIP = ":host { max-width: min(300px, 88vw); font: 13px/1.4 system-ui, sans-serif; }"
TILE_STYLES = """
dl { display: grid; grid-template-columns: repeat(3, minmax(0, 1fr)); gap: 8px; margin: 0; }
dl div { background: var(--wash); border-radius: 4px; padding: 6px 10px; }
dt { font-size: .78rem; line-height: 1.25; color: var(--soft); }
dd { margin: 1px 0 0; font-size: 1.08rem; font-weight: 600; font-variant-numeric: tabular-nums;
  line-height: 1.25; }
dd small { display: block; font-size: .78rem; font-weight: 400; color: var(--soft); min-height:
  1.25em; }
dd small.difference { color: var(--accent); }
dd span { font-size: .88rem; font-weight: 500; white-space: nowrap; }
dl.stale dd { opacity: .45; } dl.wrong { outline: 3px solid var(--alarm); }
@media (min-width: 1800px) { dl { grid-template-columns: repeat(6, minmax(0, 1fr)); } }
@media (max-width: 760px) { dl { grid-template-columns: 1fr 1fr; } }
@media (max-width: 480px) {
  dl div { padding: 6px 8px; } dd { font-size: 1.1rem; } dd span { font-size: .78rem; }
}
"""


TABLE = """
h2 { font-size: 1rem; margin: 18px 0 6px; }
div { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .86rem; font-variant-numeric:
  tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: 4px 12px 4px 0; border-bottom: 1px solid
  var(--line); }
tbody th { font-weight: 600; overflow-wrap: anywhere; }
"""


def text_block(styles: str = SENTENCE) -> Div:
    """Create an empty block of text."""
    return Div(text="", sizing_mode="stretch_width", stylesheets=[LOOK, styles], margin=0)


def sentences(lines: Iterable[str], kind: str = "") -> Markup:
    """Return sentences as HTML paragraphs, escaped, with units as in print."""
    return Markup("").join(
        Markup('<p class="{}">{}</p>').format(kind, in_print(line)) for line in lines
    )


def notes(lines: Sequence[str]) -> Markup:
    """Return notes under a heading, or nothing."""
    return Markup("<h2>Notes</h2>") + sentences(lines, "soft") if lines else Markup("")


def headline(
    result: ContactResult, pinned: ContactResult | None, *, state: str, stale: bool
) -> Markup:
    """Return regime, load share and resonance for the strip that stays visible."""
    shown_tiles = [tile for tile in result.tiles if tile.key in HEADLINE]
    parts = [_tile(tile, result, pinned, quantity(tile.key).short) for tile in shown_tiles]
    regime = Markup("<div><dt>Regime</dt><dd>{}<small>{}</small></dd></div>").format(
        result.regime, state
    )
    kind = "stale" if stale else "" if result.converged else "wrong"
    return Markup('<dl class="{}">{}</dl>').format(kind, regime + Markup("").join(parts))


def tiles(
    result_tiles: Sequence[ResultTile],
    result: ContactResult,
    pinned: ContactResult | None,
    *,
    stale: bool,
) -> Markup:
    """Return highlighted numbers with uncertainty and difference to a pinned contact."""
    parts = [_tile(tile, result, pinned, tile.name) for tile in result_tiles]
    kind = "stale" if stale else "" if result.converged else "wrong"
    return Markup('<dl class="{}">{}</dl>').format(kind, Markup("").join(parts))


def _tile(
    tile: ResultTile, result: ContactResult, pinned: ContactResult | None, name: str
) -> Markup:
    """Return a number with its name, uncertainty and difference to a pinned contact."""
    comparison = ""
    if pinned is not None:
        text = difference(tile.key, result.row.get(tile.key), pinned.row.get(tile.key))
        comparison = Markup('<small class="difference">{} vs. pinned</small>').format(text)
    number, _, unit = tile.value.partition(" ")
    html = Markup("<div><dt>{}</dt><dd>{} <span>{}</span><small>{}</small>{}</dd></div>")
    return html.format(name, number, unit, tile.uncertainty, comparison)


class InputWidget:
    """Widget of an input: text with unit, slider, and space for an error message."""

    def __init__(self, case_input: CaseInput, on_change: Callable[[str, str], None]) -> None:
        self.case_input, self._on_change, self._updating = case_input, on_change, False
        title = case_input.title
        self.slider: Slider | None = None
        self.error = text_block()
        self.error.html_attributes = {"role": "alert"}
        self.error.visible = False
        self.text: Any
        if case_input.choices:
            self.text = Select(
                title=title,
                value=case_input.text,
                options=list(case_input.choices),
                description=self._tooltip() if case_input.meaning else None,
                **self._style(),
            )
            self.text.on_change("value", self._typed)
            parts = [self.text]
        else:
            self.text = TextInput(
                title=title,
                value=shown(case_input.text),
                description=self._tooltip(),
                **self._style(),
            )
            self.text.on_change("value", self._typed)
            first, last = case_input.positions
            self.slider = Slider(
                title="",
                show_value=False,
                bar_color=BAR,
                tooltips=False,
                start=first,
                end=last,
                step=1,
                value=self._slider_position(case_input.text),
                sizing_mode="stretch_width",
                stylesheets=[LOOK],
                margin=(0, 12, 0, 12),
                tags=[title, shown(case_input.text)],
            )
            self.slider.on_change("value", self._slid)
            parts = [self.text, self.slider, _ticks(case_input)]
        self.model = Column(
            *parts,
            self.error,
            sizing_mode="stretch_width",
            margin=(0, 0, 4, 0),
            spacing=2,
            stylesheets=[INHERIT],
        )

    def _tooltip(self) -> Tooltip:
        return Tooltip(
            content=self.case_input.hint, position="bottom_center", stylesheets=[TOOLTIP]
        )

    @staticmethod
    def _style() -> Look:
        return {"sizing_mode": "stretch_width", "stylesheets": [LOOK], "margin": 0}

    def _slider_position(self, text: str) -> int:
        position = self.case_input.position(text)
        return self.case_input.positions[0] if position is None else position

    def show(self, text: str, message: str = "", remark: str = "") -> None:
        """Show a value, and the error message of an invalid one or a remark on a doubtful one."""
        self._updating = True
        position = self.case_input.position(text) if self.slider is not None else None
        text = shown(text)
        if self.text.value != text:
            if isinstance(self.text, Select) and text not in self.text.options:
                self.text.options = [*self.text.options, text]
            self.text.value = text
        if self.slider is not None and position is not None:
            if self.slider.value != position:
                self.slider.value = position
            tags = [self.slider.tags[0], text]
            if self.slider.tags != tags:
                self.slider.tags = tags
        self._updating = False
        self.error.visible = bool(message or remark)
        line = message or remark
        kind = "alarm" if message else "warn"
        self.error.text = sentences([f"{line.rstrip('.')}."] if line else [], kind)
        self.text.stylesheets = [LOOK, WRONG] if message else [LOOK]

    def _typed(self, _name: str, _old: object, new: object) -> None:
        if not self._updating:
            self._on_change(self.case_input.key, written(str(new)))

    def _slid(self, _name: str, _old: object, new: object) -> None:
        if not self._updating:
            self._on_change(self.case_input.key, self.case_input.value_text(int(str(new))))


def _ticks(case_input: CaseInput) -> Div:
    """Return the ends of a slider and the value of the case, at their places below it."""
    first, last = case_input.positions
    own = case_input.position(case_input.text)
    marks = {first: "left", last: "right"}
    if own is not None and 0.2 < (own - first) / (last - first) < 0.8:
        marks[own] = "middle"
    html = Markup("").join(
        Markup('<span class="{}" style="left: {:.4g}%">{}</span>').format(
            kind,
            100.0 * (position - first) / (last - first),
            shown(case_input.value_text(position)),
        )
        for position, kind in marks.items()
    )
    return Div(
        text=html,
        sizing_mode="stretch_width",
        stylesheets=[LOOK, TICKS],
        margin=(0, 12, 6, 12),
        html_attributes={"aria-hidden": "true"},
    )


def button(label: str, on_click: Callable[[], None]) -> Button:
    """Create a button."""
    widget = Button(label=label, stylesheets=[LOOK], margin=(4, 8, 4, 0))
    widget.on_click(on_click)
    return widget


def button_row(*buttons: UIElement) -> Row:
    """Arrange buttons in a row that wraps."""
    return Row(
        *buttons, sizing_mode="stretch_width", styles={"flex-wrap": "wrap"}, stylesheets=[INHERIT]
    )


class StaleMark:
    """Marks the figures as stale through a style attribute, without a new layout.

    Parameters
    ----------
    carrier : a model of the page whose tags hold the data source
    """

    def __init__(self, carrier: Model) -> None:
        self._source = ColumnDataSource({"stale": [False]})
        self.update_page = CustomJS(args={"source": self._source}, code=_MARK)
        self._source.js_on_change("data", self.update_page)
        carrier.tags = [self._source]

    def show(self, stale: bool) -> None:
        """Set or remove the mark."""
        if self._source.data["stale"] != [stale]:
            self._source.data = {"stale": [stale]}


_MARK = 'document.documentElement.toggleAttribute("data-stale", source.data.stale[0])'


class HeadlineStrip:
    """Strip of the page that stays visible: its content, and a bar while the solver is compiled.

    The strip is an element of the page, outside the figures: it is there before they are.
    """

    def __init__(self) -> None:
        self.html = Markup("")
        self._source = ColumnDataSource({"html": [""], "busy": [False]})
        self._source.js_on_change("data", CustomJS(args={"source": self._source}, code=_STRIP))
        self.model = Div(text="", visible=False, tags=[self._source])

    def show(self, html: Markup, *, busy: bool) -> None:
        """Show numbers; `busy`: the solver is being compiled."""
        self.html = html
        data = {"html": [str(html)], "busy": [busy]}
        if self._source.data != data:
            self._source.data = data


_STRIP = """
document.getElementById("headline").innerHTML = source.data.html[0]
document.getElementById("compiling").hidden = !source.data.busy[0]
"""


class Download:
    """Offers text files of the server as downloads."""

    def __init__(self) -> None:
        self._source = ColumnDataSource({"name": [], "kind": [], "text": []})
        self._source.js_on_change("data", CustomJS(args={"source": self._source}, code=_SAVE))
        self.model = Div(text="", visible=False, tags=[self._source])

    def offer(self, name: str, kind: str, text: str) -> None:
        """Let the browser download a text file."""
        self._source.data = {"name": [name], "kind": [kind], "text": [text]}


_SAVE = """
const [name] = source.data.name
if (name == null) return
const link = document.createElement("a")
link.href = URL.createObjectURL(new Blob([source.data.text[0]], {type: source.data.kind[0]}))
link.download = name
link.click()
setTimeout(() => URL.revokeObjectURL(link.href), 10000)
"""
