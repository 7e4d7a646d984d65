"""Small parts of the page: knobs as slider and text, sentences and tiles as safe HTML, files handed to the browser."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from bokeh.models import (
    Button,
    Column,
    ColumnDataSource,
    CustomJS,
    Div,
    Row,
    Select,
    Slider,
    TextInput,
)
from markupsafe import Markup

from asperity.app.contact_result import Answer, Tile, difference
from asperity.app.inputs import Knob
from asperity.core.quantities import in_print

LOOK = """
:host { color: var(--ink); font: inherit; }
.bk-clearfix { display: block; width: 100%; }
.bk-input { color: var(--ink); background: var(--paper); border: 1px solid var(--line); border-radius: 4px; }
.bk-input, .bk-btn { font: inherit; }
.bk-input:focus { border-color: var(--accent); box-shadow: none; outline: 2px solid var(--accent); }
.bk-input-group label, label { color: var(--ink); font-size: .88rem; }
.bk-btn { color: var(--ink); background: var(--wash); border: 1px solid var(--line); border-radius: 4px; }
.bk-btn:hover:enabled, .bk-btn:active { color: var(--ink); background: var(--line); border-color: var(--soft); }
.bk-description > .bk-icon { background-color: var(--soft); }
select:not([multiple]).bk-input { background: var(--paper) var(--arrow) right .5em center / 8px 6px no-repeat; }
.bk-btn:focus-visible, .noUi-handle:focus-visible { outline: 2px solid var(--accent); }
.noUi-target { background: var(--wash); border-color: var(--line); } .noUi-connect { background: var(--accent); }
.noUi-handle { background: var(--paper); border: 2px solid var(--accent); box-shadow: none; }
"""
INHERIT = ":host { font: inherit; }"  # of what only holds others
BAR = "#5b9fd4"
MAP_KEY = (("touching", "asperity contact"), ("ruptured", "cavitated"), ("hertz", "Hertz zone"))
DROP = """
:host { color: var(--ink); }
.filepond--root.bk-input.bk-input { color: var(--ink); background: none; border: 0; }
.filepond--root .filepond--drop-label.filepond--drop-label { color: var(--ink); background: none; }
.filepond--panel-root { background: var(--wash); border: 1px dashed var(--soft); }
.filepond--drop-label, .filepond--drop-label label { color: var(--ink); font-size: .88rem; }
"""
WRONG = ".bk-input { border-color: var(--alarm); border-width: 2px; }"
SENTENCE = """
p { margin: 2px 0 4px; }
h2 { font-size: 1rem; margin: 18px 0 6px; }
a { color: var(--accent); }
.alarm { color: var(--alarm); font-weight: 600; }
.soft { color: var(--soft); }
"""
TILE_STYLES = """
dl { display: grid; grid-template-columns: repeat(4, minmax(0, 1fr)); gap: 8px; margin: 0; }
dl div { background: var(--wash); border-radius: 4px; padding: 6px 10px; }
dt { font-size: .78rem; line-height: 1.25; color: var(--soft); }
dd { margin: 1px 0 0; font-size: 1.22rem; font-weight: 650; font-variant-numeric: tabular-nums; line-height: 1.25; }
dd small { display: block; font-size: .78rem; font-weight: 400; color: var(--soft); min-height: 1.25em; }
dd small.than { color: var(--accent); }
dd span { font-size: .95rem; font-weight: 500; white-space: nowrap; }
dl.old dd { opacity: .45; } dl.wrong { outline: 3px solid var(--alarm); }
@media (min-width: 1800px) { dl { grid-template-columns: repeat(8, minmax(0, 1fr)); } }
@media (max-width: 1100px) { dl { grid-template-columns: 1fr 1fr; } }
@media (max-width: 480px) {
  dl div { padding: 6px 8px; } dd { font-size: 1.1rem; } dd span { font-size: .78rem; }
}
"""


TABLE = """
div { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .86rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: 4px 12px 4px 0; border-bottom: 1px solid var(--line); }
tbody th { font-weight: 600; overflow-wrap: anywhere; }
"""


def text_block(styles: str = SENTENCE) -> Div:
    """An empty block of text."""
    return Div(text="", sizing_mode="stretch_width", stylesheets=[LOOK, styles], margin=0)


def sentences(lines: Iterable[str], kind: str = "") -> Markup:
    """Sentences as paragraphs, their units as in print, whatever stands in them escaped."""
    return Markup("").join(
        Markup('<p class="{}">{}</p>').format(kind, in_print(line)) for line in lines
    )


def notes(lines: Sequence[str]) -> Markup:
    """What is to be read with the numbers, under its heading; nothing where there is nothing."""
    return (
        Markup("<h2>To read with the numbers</h2>") + sentences(lines, "soft")
        if lines
        else Markup("")
    )


def tiles(shown: Sequence[Tile], answer: Answer, pinned: Answer | None, *, old: bool) -> Markup:
    """Numbers that stand out, with their doubt, and how far they lie from those of a pinned contact."""
    parts = []
    for tile in shown:
        than = ""
        if pinned is not None:
            text = difference(tile.key, answer.row.get(tile.key), pinned.row.get(tile.key))
            than = Markup('<small class="than">{} against pinned</small>').format(text)
        number, _, unit = tile.value.partition(" ")
        inside = Markup("<div><dt>{}</dt><dd>{} <span>{}</span><small>{}</small>{}</dd></div>")
        parts.append(inside.format(tile.name, number, unit, tile.doubt, than))
    kind = "old" if old else "" if answer.converged else "wrong"
    return Markup('<dl class="{}">{}</dl>').format(kind, Markup("").join(parts))


class KnobWidget:
    """A knob: its name, a text with the unit, a slider, and room for the sentence that refuses a value."""

    def __init__(self, knob: Knob, turned: Callable[[str, str], None]) -> None:
        self.knob, self._turned, self._quiet = knob, turned, False
        title = knob.title
        self.slider: Slider | None = None
        self.wrong = text_block()
        self.wrong.html_attributes = {"role": "alert"}
        self.wrong.visible = False
        self.text: Any
        if knob.choices:
            self.text = Select(
                title=title, value=knob.text, options=list(knob.choices), **self._look()
            )
            self.text.on_change("value", self._typed)
            parts = [self.text]
        else:
            self.text = TextInput(
                title=title, value=knob.text, description=knob.meaning or None, **self._look()
            )
            self.text.on_change("value", self._typed)
            first, last = knob.positions
            self.slider = Slider(
                title="",
                show_value=False,
                bar_color=BAR,
                start=first,
                end=last,
                step=1,
                value=self._place(knob.text),
                sizing_mode="stretch_width",
                stylesheets=[LOOK],
                margin=(0, 12, 6, 12),
                tags=[title, knob.text],
            )
            self.slider.on_change("value", self._slid)
            parts = [self.text, self.slider]
        self.model = Column(
            *parts,
            self.wrong,
            sizing_mode="stretch_width",
            margin=(0, 0, 4, 0),
            spacing=2,
            stylesheets=[INHERIT],
        )

    @staticmethod
    def _look() -> dict[str, Any]:
        return {"sizing_mode": "stretch_width", "stylesheets": [LOOK], "margin": 0}

    def _place(self, text: str) -> int:
        place = self.knob.position(text)
        return self.knob.positions[0] if place is None else place

    def show(self, text: str, refusal: str = "") -> None:
        """Show a value, and the sentence that refuses it."""
        self._quiet = True
        if self.text.value != text:
            if isinstance(self.text, Select) and text not in self.text.options:
                self.text.options = [*self.text.options, text]
            self.text.value = text
        place = self.knob.position(text) if self.slider is not None else None
        if self.slider is not None and place is not None:
            if self.slider.value != place:
                self.slider.value = place
            told = [self.slider.tags[0], text]
            if self.slider.tags != told:
                self.slider.tags = told
        self._quiet = False
        self.wrong.visible = bool(refusal)
        self.wrong.text = sentences([f"{refusal.rstrip('.')}."] if refusal else [], "alarm")
        self.text.stylesheets = [LOOK, WRONG] if refusal else [LOOK]

    def _typed(self, _name: str, _old: Any, new: Any) -> None:
        if not self._quiet:
            self._turned(self.knob.key, str(new))

    def _slid(self, _name: str, _old: Any, new: Any) -> None:
        if not self._quiet:
            self._turned(self.knob.key, self.knob.at(int(new)))


def button(words: str, pressed: Callable[[], None]) -> Button:
    """A button."""
    made = Button(label=words, stylesheets=[LOOK], margin=(4, 8, 4, 0))
    made.on_click(pressed)
    return made


def button_row(*buttons: Any) -> Row:
    """Buttons beside one another, in as many lines as they need."""
    return Row(
        *buttons, sizing_mode="stretch_width", styles={"flex-wrap": "wrap"}, stylesheets=[INHERIT]
    )


class OldMark:
    """Says to the page's style sheet whether a picture is of another setting, so that no figure is laid out anew.

    Parameters
    ----------
    carrier : a model of the page, whose tags hold what the browser is told by
    """

    def __init__(self, carrier: Any) -> None:
        self._source = ColumnDataSource({"old": [False]})
        self.tell = CustomJS(args={"source": self._source}, code=_MARK)
        self._source.js_on_change("data", self.tell)
        carrier.tags = [self._source]

    def show(self, old: bool) -> None:
        """Mark the picture, or mark it no more."""
        if self._source.data["old"] != [old]:
            self._source.data = {"old": [old]}


_MARK = 'document.documentElement.toggleAttribute("data-old", source.data.old[0])'


class Handout:
    """Hands files to the browser: text that the server makes, saved under a name of ours."""

    def __init__(self) -> None:
        self._source = ColumnDataSource({"name": [], "kind": [], "text": []})
        self._source.js_on_change("data", CustomJS(args={"source": self._source}, code=_SAVE))
        self.model = Div(text="", visible=False, tags=[self._source])

    def give(self, name: str, kind: str, text: str) -> None:
        """Let the browser save a text."""
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
