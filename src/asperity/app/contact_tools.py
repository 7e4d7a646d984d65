"""Tools of the contact page that run in the browser: sound, copy of the link, picture."""

from importlib.metadata import version
from pathlib import Path

import numpy as np
from bokeh.models import Button, ColumnDataSource, CustomJS, Div, Model

from asperity.app.contact_result import ContactResult
from asperity.app.inputs import shown
from asperity.app.presets import TITLES
from asperity.app.settings import Settings
from asperity.app.widgets import LOOK
from asperity.core.arrays import Field

FADE_S = 0.05  # of the end of a loop into its beginning


class Sound:
    """Plays the simulated acceleration of the contact as a loop while it is switched on.

    Amplitudes are scaled by that of the first contact played, so that levels can be compared.
    """

    def __init__(self) -> None:
        self.on = False
        self._source = ColumnDataSource({"rate": [], "values": []})
        self._source.js_on_change("data", CustomJS(args={"source": self._source}, code=_PLAY))
        self.model = Div(text="", visible=False, tags=[self._source])
        self.button = Button(label="Listen", stylesheets=[LOOK], margin=(4, 8, 4, 0))
        self.button.js_on_event("button_click", CustomJS(code=_UNLOCK))
        self.button.on_click(self._toggle)
        self._result: ContactResult | None = None

    def show(self, result: ContactResult) -> None:
        """Play a result if the sound is on; silence without contact resonance."""
        self._result = result
        if self.on:
            self._send()

    def _toggle(self) -> None:
        self.on = not self.on
        self.button.label = "Stop sound" if self.on else "Listen"
        self._send()

    def _send(self) -> None:
        result = self._result
        if not self.on or result is None:
            self._source.data = {"rate": [0.0], "values": [np.empty(0, np.float32)]}
            return
        loop = seamless(result.sound, round(FADE_S * result.sound_rate_hz))
        self._source.data = {"rate": [result.sound_rate_hz], "values": [loop]}


def seamless(values: Field, fade: int) -> Field:
    """Fade the end of a signal into its beginning, so that it repeats without a step."""
    if values.size <= 2 * fade:
        return values
    weight = np.linspace(0.0, 1.0, fade, dtype=values.dtype)
    loop = values[: values.size - fade].copy()
    loop[:fade] = np.sqrt(weight) * loop[:fade] + np.sqrt(1.0 - weight) * values[-fade:]
    return loop


def link_button() -> Button:
    """Create the button that copies the address of the page."""
    return _script_button("Copy link", _COPY)


class PictureButton:
    """Button that saves headline, figures and inputs as a picture."""

    def __init__(self) -> None:
        self._source = ColumnDataSource({"head": [], "names": [], "values": []})
        self.button = _script_button("PNG", _PICTURE, source=self._source)

    def show(self, settings: Settings) -> None:
        """Set case and inputs, which are those of the shown result."""
        inputs = settings.inputs.items()
        self._source.data = {
            "head": [[_case_name(settings), f"asperity {version('asperity')}"]],
            "names": [[case_input.title for _, case_input in inputs]],
            "values": [[shown(settings.text(key)) for key, _ in inputs]],
        }


def _case_name(settings: Settings) -> str:
    """Return the preset or file of a case, and that it was changed."""
    name = TITLES.get(settings.preset) or Path(settings.opened.source).name
    surface = f", surface {settings.dropped}" if settings.dropped else ""
    changed = ", changed" if settings.changes else ""
    return f"{name}{surface}{changed}"


def _script_button(label: str, code: str, **models: Model) -> Button:
    made = Button(label=label, stylesheets=[LOOK], margin=(4, 8, 4, 0))
    made.js_on_event("button_click", CustomJS(args={"button": made, **models}, code=code))
    return made


# browsers start sound only within a click
_UNLOCK = """
const sound = window.asperitySound ??= {context: new AudioContext(), count: 0}
sound.context.resume()
"""
_PLAY = """
const sound = window.asperitySound
if (sound === undefined) return
const {context} = sound, now = context.currentTime
if (sound.gain !== undefined) {
  sound.gain.gain.setTargetAtTime(0, now, 0.03)
  sound.player.stop(now + 0.3)
  sound.gain = undefined
}
const values = Float32Array.from(source.data.values[0] ?? [])
sound.length = values.length
if (values.length === 0) return
const rms = Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / values.length)
sound.reference ??= rms
const buffer = context.createBuffer(1, values.length, source.data.rate[0])
buffer.copyToChannel(values.map(value => 0.15 * value / sound.reference), 0)
const player = new AudioBufferSourceNode(context, {buffer, loop: true})
const gain = new GainNode(context, {gain: 0}), limiter = new DynamicsCompressorNode(context)
player.connect(gain).connect(limiter).connect(context.destination)
gain.gain.setTargetAtTime(1, now, 0.03)
player.start()
Object.assign(sound, {player, gain, count: sound.count + 1, level: rms / sound.reference})
"""
_COPY = """
const say = text => { button.label = text; setTimeout(() => { button.label = "Copy link" }, 2000) }
const copied = navigator.clipboard?.writeText(location.href) ?? Promise.reject()
copied.then(() => say("Link copied"), () => prompt("Copy this link", location.href))
"""
_PICTURE = """
const shown = label => [...Bokeh.index.query(view => view.model.type === "Figure"
  && view.model.html_attributes["aria-label"] === label)][0]
const labels = ["Film thickness, contact and cavitation", "Pressure",
  "Spectrum with the fitted resonance"]
const figures = labels.map(shown).filter(view => view !== undefined)
const layers = figures.map(view => view.export("png").canvas)
const scale = devicePixelRatio, margin = 24 * scale, head = 92 * scale
const width = Math.max(...layers.map(layer => layer.width)) * 2 + 3 * margin
const rows = [layers.slice(0, 2), layers.slice(2)].filter(row => row.length > 0)
const [headLines = []] = source.data.head, [names = []] = source.data.names
const [values = []] = source.data.values, step = 18 * scale
const keys = document.querySelectorAll(".key i")
const notes = rows.length > 1 ? ["Spectrum: shaded search band, dashed CRF,",
  "dotted CRF at full load"] : []
const lineCount = headLines.length + names.length + keys.length + notes.length + 3
if (rows.length === 1) rows.push([])
const heights = rows.map((row, number) =>
  Math.max(...row.map(layer => layer.height), number === 1 ? lineCount * step : 0))
const canvas = document.createElement("canvas")
canvas.width = width
canvas.height = head + heights.reduce((sum, height) => sum + height + margin, margin)
const pen = canvas.getContext("2d"), style = getComputedStyle(document.body)
pen.fillStyle = style.backgroundColor
pen.fillRect(0, 0, canvas.width, canvas.height)
pen.fillStyle = style.color
const parts = [...document.querySelectorAll("#headline dl > div")]
for (const [number, part] of parts.entries()) {
  const left = margin + number * (width - 2 * margin) / parts.length
  const lines = [part.querySelector("dt").textContent,
    [...part.querySelector("dd").childNodes].filter(node => node.nodeName !== "SMALL")
      .map(node => node.textContent).join(""),
    part.querySelector("small").textContent]
  for (const [row, text] of lines.entries()) {
    const [weight, size] = row === 1 ? [700, 24] : [400, 13]
    pen.font = `${weight} ${size * scale}px system-ui, sans-serif`
    pen.fillText(text, left, (32 + [0, 28, 48][row]) * scale)
  }
}
let top = head
for (const [number, row] of rows.entries()) {
  let left = margin
  for (const layer of row) { pen.drawImage(layer, left, top); left += layer.width + margin }
  if (number === 1) describe(left, top)
  top += heights[number] + margin
}
function write(text, left, base, width, weight = 400) {
  pen.font = `${weight} ${13 * scale}px system-ui, sans-serif`
  pen.fillText(text, left, base, width)
}
function describe(left, top) {
  const room = width - left - margin
  let base = top + step
  const next = () => { base += step }
  for (const [number, text] of headLines.entries()) {
    write(text, left, base, room, number === 0 ? 700 : 400)
    next()
  }
  next()
  for (const [number, name] of names.entries()) {
    write(name, left, base, 0.6 * room)
    write(values[number], left + 0.64 * room, base, 0.36 * room)
    next()
  }
  next()
  for (const mark of keys) {
    const box = 11 * scale, colours = {touching: "#f7dc4a", cavitated: "#5b6b86"}
    const ink = pen.fillStyle, colour = colours[mark.className]
    pen.fillStyle = colour ?? ink
    pen.strokeStyle = ink
    pen.setLineDash(colour === undefined ? [3 * scale, 2 * scale] : [])
    if (colour !== undefined) pen.fillRect(left, base - box, box, box)
    pen.strokeRect(left, base - box, box, box)
    pen.fillStyle = ink
    write(mark.nextSibling.textContent, left + 1.6 * box, base, room)
    next()
  }
  for (const text of notes) { write(text, left, base, room); next() }
}
canvas.toBlob(blob => {
  const link = document.createElement("a")
  link.href = URL.createObjectURL(blob)
  link.download = "asperity-contact.png"
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10000)
})
"""
