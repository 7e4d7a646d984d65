"""Pictures: maps of a contact and a cut through them, in places that are kept until they are made.

Figures are most of a page's models. They are made when the page is there already, so that nobody
waits for them.
"""

from collections.abc import Callable, Iterator

from bokeh.models import Column

from asperity.app.contact_result import Picture
from asperity.app.figures import CUT_HEIGHT, HEIGHT, Cut, Maps
from asperity.core.quantities import quantity


def place(height: int) -> Column:
    """Where a figure will stand, so that nothing moves when it comes."""
    return Column(sizing_mode="stretch_width", min_height=height)


class Pictures:
    """Maps and a cut, drawn as far as they are made; a click on a map moves the cut."""

    def __init__(self) -> None:
        self.film, self.pressure = place(HEIGHT), place(HEIGHT)
        self.change = Column(sizing_mode="stretch_width", visible=False)
        self.cut_pressure, self.cut_film = place(CUT_HEIGHT), place(CUT_HEIGHT)
        self._maps: Maps | None = None
        self._cut: Cut | None = None
        self._shown: tuple[Picture, Picture | None] | None = None
        self._y = 0.0

    def steps(self) -> Iterator[Callable[[], None]]:
        """What is to be done to make them, one after another."""
        yield self._make_maps
        yield self._make_cut

    def make(self) -> None:
        """Make them, where they are not yet."""
        if self._cut is None:
            for step in self.steps():
                step()

    def show(self, picture: Picture, pinned: Picture | None = None) -> None:
        """Draw a contact, and how it differs from a pinned one."""
        self._shown = picture, pinned
        self._draw_maps()
        self._draw_cut()

    def _make_maps(self) -> None:
        self._maps = Maps(self._cut_at)
        self.film.children, self.pressure.children = [self._maps.film], [self._maps.pressure]
        self._draw_maps()

    def _make_cut(self) -> None:
        assert self._maps is not None
        self._cut = Cut(self._maps)
        self.cut_pressure.children, self.cut_film.children = [self._cut.pressure], [self._cut.film]
        self._draw_cut()

    def _draw_maps(self) -> None:
        if self._maps is None or self._shown is None:
            return
        self._maps.show(*self._shown)
        change = self._maps.change
        if change is not None and not self.change.children:
            self.change.children = [change]
        self.change.visible = self._maps.compares

    def _draw_cut(self) -> None:
        if self._maps is None or self._cut is None or self._shown is None:
            return
        picture, pinned = self._shown
        self._y = float(picture.y[picture.line(self._y)])
        self._maps.cut(self._y)
        self._cut.show(picture, pinned, self._y)

    def _cut_at(self, y: float) -> None:
        self._y = y / quantity("y_m").factor
        self._draw_cut()
