"""Maps and section of a contact, with placeholders until they are created.

The figures are created after the page has loaded, because they take most of the time.
"""

from collections.abc import Callable, Iterator

from bokeh.models import Column

from asperity.app.contact_result import ContactMaps
from asperity.app.figures import HEIGHT, SECTION_HEIGHT, MapFigures, SectionFigures
from asperity.app.widgets import INHERIT, sentences, text_block
from asperity.core.quantities import quantity

DIFFERS = "No map of the change in film thickness: the domain or grid differs from the pinned one."


def placeholder(height: int) -> Column:
    """Reserve the space of a figure, so that the page does not shift when it arrives."""
    return Column(sizing_mode="stretch_width", min_height=height, stylesheets=[INHERIT])


class MapImages:
    """Maps and section of a contact; a click on a map moves the section."""

    def __init__(self) -> None:
        self.film, self.pressure = placeholder(HEIGHT), placeholder(HEIGHT)
        self.change = Column(sizing_mode="stretch_width", visible=False, stylesheets=[INHERIT])
        self.cut_pressure, self.cut_film = (
            placeholder(SECTION_HEIGHT),
            placeholder(SECTION_HEIGHT),
        )
        self._differs = text_block()
        self._differs.text = sentences([DIFFERS], "soft")
        self._maps: MapFigures | None = None
        self._cut: SectionFigures | None = None
        self._shown: tuple[ContactMaps, ContactMaps | None] | None = None
        self._y = 0.0

    def steps(self) -> Iterator[Callable[[], None]]:
        """Yield the functions that create the figures, in order."""
        yield self._make_maps
        yield self._make_cut

    def make(self) -> None:
        """Create the figures if they do not exist yet."""
        if self._cut is None:
            for step in self.steps():
                step()

    def show(self, contact_maps: ContactMaps, pinned: ContactMaps | None = None) -> None:
        """Draw a contact, and its difference to a pinned one."""
        self._shown = contact_maps, pinned
        self._draw_maps()
        self._draw_cut()

    def _make_maps(self) -> None:
        self._maps = MapFigures(self._cut_at)
        self.film.children, self.pressure.children = [self._maps.film], [self._maps.pressure]
        self._draw_maps()

    def _make_cut(self) -> None:
        assert self._maps is not None
        self._cut = SectionFigures(self._maps)
        self.cut_pressure.children, self.cut_film.children = [self._cut.pressure], [self._cut.film]
        self._draw_cut()

    def _draw_maps(self) -> None:
        if self._maps is None or self._shown is None:
            return
        self._maps.show(*self._shown)
        pinned = self._shown[1]
        self.change.visible = pinned is not None
        self.change.children = [self._maps.change] if self._maps.compares else [self._differs]

    def _draw_cut(self) -> None:
        if self._maps is None or self._cut is None or self._shown is None:
            return
        contact_maps, pinned = self._shown
        self._y = float(contact_maps.y[contact_maps.nearest_row(self._y)])
        self._maps.cut(self._y)
        self._cut.show(contact_maps, pinned, self._y)

    def _cut_at(self, y: float) -> None:
        self._y = y / quantity("y_m").factor
        self._draw_cut()
