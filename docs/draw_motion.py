"""Draw the moving picture of roughness that runs through the contact: `python docs/draw_motion.py`.

It shows the paper's contact (`examples/paper.toml`) on a coarser grid, simulated as
`asperity run` does. The second pass of the rough surface's track is shown, which repeats.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from PIL import Image

from asperity.case import Case, load_case
from asperity.core.arrays import Field
from asperity.report.style import BLUE, CONTACT_COLOUR, GREY, ON_PAGE
from asperity.simulation import History, MotionFrame, run_history

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "images" / "running-roughness.webp"
CELLS = (132, 72)
TIME_STEP = 2.0  # cells that the oil travels per step
PASS = 60  # steps of a pass: 132 cells at 1.1 times the entrainment speed
WIDTH, HEIGHT, DPI = 640, 460, 100  # pixels
FRAME_MS = 70
QUALITY = 75  # of the lossy compression
VIEW = (-2.4, 1.9)  # shown part of the domain along rolling, in Hertz half-widths
FILMS = (0.05, 5.0)  # ends of the film's scale [um]
LABEL = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 2}
OIL_SHADES = "Blues"  # light: thin film, so that contacts stand out
PRESSURE_SHADES = "Purples"


def simulated() -> History:
    """Simulate two passes of the rough surface's track, with maps of every step."""
    text = (ROOT / "examples" / "paper.toml").read_text("utf-8")
    changes = {"grid.cells": list(CELLS), "motion.time_step": TIME_STEP}
    case = load_case(text).with_written(changes)
    return run_history(case, steps=2 * PASS, every=1)


def second_pass(history: History) -> tuple[list[MotionFrame], Field]:
    """Return maps and load shares [%] of the second pass."""
    frames = [frame for frame in history.frames if frame.number > PASS]
    shares = 100.0 * history.table["clr"].to_numpy()
    assert len(frames) == PASS
    return frames, shares[[frame.number for frame in frames]]


class Picture:
    """Figure of a moment: film with asperity contacts, pressure, and the load share over time."""

    def __init__(self, case: Case, frames: list[MotionFrame], shares: Field) -> None:
        self.case, self.frames, self.shares = case, frames, shares
        self.time = 1e6 * np.array([frame.time - frames[0].time for frame in frames])
        self.figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI)
        FigureCanvasAgg(self.figure)
        film, pressure = (self.figure.add_axes((left, 0.52, 0.39, 0.41)) for left in (0.09, 0.59))
        self.film = self._map(film, "Film and asperity contact", OIL_SHADES, LogNorm(*FILMS))
        self.film.cmap.set_bad(CONTACT_COLOUR)
        self.pressure = self._map(pressure, "Pressure", PRESSURE_SHADES, PowerNorm(0.5, 0.0, 2.0))
        self._bar(self.film, film, "film thickness [µm]", (0.1, 1.0))
        self._bar(self.pressure, pressure, "pressure [GPa]", (0.0, 0.5, 2.0))
        self.mark = self._trace(self.figure.add_axes((0.09, 0.1, 0.89, 0.15)))

    def _map(self, axes: Axes, title: str, colours: str, norm: Normalize) -> AxesImage:
        grid = self.case.grid
        corners = [1e6 * end for axis in (0, 1) for end in (grid.lower[axis], grid.upper[axis])]
        image = axes.imshow(
            np.zeros(grid.cells[::-1]),
            origin="lower",
            extent=corners,
            cmap=colours,
            norm=norm,
            aspect="auto",
            interpolation="none",
        )
        a = 1e6 * self.case.conditions.hertz.half_widths[0]
        axes.set_xlim(VIEW[0] * a, VIEW[1] * a)
        axes.set_title(title)
        axes.tick_params(length=2, labelsize=8)
        axes.set_xlabel("x [µm]", fontsize=8, labelpad=0)
        axes.set_ylabel("y [µm]", fontsize=8, labelpad=0)
        arrow = {"va": "top", "ha": "right", "fontsize": 8, "transform": axes.transAxes}
        axes.text(0.98, 0.97, "oil and roughness →", bbox=LABEL, **arrow)
        return image

    def _bar(self, image: AxesImage, axes: Axes, label: str, ticks: tuple[float, ...]) -> None:
        box = axes.get_position()
        place = self.figure.add_axes((box.x0, 0.385, 0.42 * box.width, 0.02))
        bar = self.figure.colorbar(image, cax=place, orientation="horizontal", ticks=ticks)
        bar.ax.set_xticklabels([f"{tick:g}" for tick in ticks])
        bar.ax.minorticks_off()
        bar.ax.tick_params(length=2, labelsize=8, pad=1)
        self.figure.text(box.x0 + 0.48 * box.width, 0.385, label, fontsize=8)
        if image.cmap.name == OIL_SHADES:
            key = [Patch(color=CONTACT_COLOUR, label="contact")]
            style = {"loc": "lower left", "frameon": True, "fontsize": 8, "framealpha": 0.9}
            axes.legend(handles=key, handlelength=1.0, borderaxespad=0.3, **style)

    def _trace(self, axes: Axes) -> "Axes":
        axes.plot(self.time, self.shares, color=BLUE)
        axes.axhline(self.shares.mean(), color=GREY, linewidth=0.8, linestyle=":")
        axes.set_xlim(0.0, self.time[-1])
        axes.set_ylim(0.0, 100.0)
        axes.set_xlabel("time [µs]", fontsize=8, labelpad=1)
        axes.set_title("Load carried by asperities [%]", fontsize=9)
        axes.tick_params(length=2, labelsize=8)
        return axes.plot([], [], "o", color=BLUE, markersize=6, clip_on=False)[0]

    def images(self) -> Iterator[Image.Image]:
        """Draw every frame."""
        for number, frame in enumerate(self.frames):
            film = np.where(frame.in_contact, np.nan, 1e6 * frame.gap)
            self.film.set_data(np.clip(film, *FILMS).T)
            self.pressure.set_data(1e-9 * frame.pressure.T)
            self.mark.set_data([self.time[number]], [self.shares[number]])
            self.figure.canvas.draw()
            yield Image.fromarray(np.asarray(self.figure.canvas.buffer_rgba())[..., :3].copy())


def write(images: list[Image.Image], path: Path = PICTURE) -> None:
    """Write the frames as an animated WebP file."""
    frames = {"save_all": True, "append_images": images[1:], "duration": FRAME_MS, "loop": 0}
    images[0].save(path, quality=QUALITY, method=4, **frames)


def main() -> None:
    """Simulate the motion and write the picture."""
    history = simulated()
    with ON_PAGE.drawing():
        write(list(Picture(history.case, *second_pass(history)).images()))


if __name__ == "__main__":
    main()
