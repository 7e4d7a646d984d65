"""Tools of the contact page that run in the browser: sound, copy of the link, picture."""

import numpy as np
from bokeh.models import Button, ColumnDataSource, CustomJS, Div

from asperity.app.contact_result import ContactResult
from asperity.app.widgets import LOOK
from asperity.core.arrays import Field

FADE_S = 0.05  # of the end of a loop into its beginning


class Sound:
    """Plays the simulated acceleration of the contact as a loop while it is switched on.

    The loudness is relative to the first contact heard, so that louder contacts sound louder.
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


def picture_button() -> Button:
    """Create the button that saves headline and figures as a picture."""
    return _script_button("PNG", _PICTURE)


def _script_button(label: str, code: str) -> Button:
    made = Button(label=label, stylesheets=[LOOK], margin=(4, 8, 4, 0))
    made.js_on_event("button_click", CustomJS(args={"button": made}, code=code))
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
const heights = rows.map(row => Math.max(...row.map(layer => layer.height)))
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
  top += heights[number] + margin
}
canvas.toBlob(blob => {
  const link = document.createElement("a")
  link.href = URL.createObjectURL(blob)
  link.download = "asperity-contact.png"
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10000)
})
"""
