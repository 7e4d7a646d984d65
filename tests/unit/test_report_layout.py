"""Layout of reports in a browser: pictures first, numbers folded; figures for a paper."""

import re
import warnings

import pytest
from matplotlib.text import Text
from test_report import run_like

from asperity.report import base, write_report
from asperity.report.run import page
from asperity.report.style import (
    ACROSS_PAGE,
    CONTACT_COLOUR,
    FILM_COLOURS,
    IN_COLUMN,
    OIL_COLOUR,
    svg,
)
from support.browser import chromium

SCREENS = {1280: (800, 1), 390: (844, 2)}  # width: height of a screen, screens to the first picture
MAX_HEIGHT = 5000  # of a report of one run at 1280 px
MIN_TEXT = 6.0  # points, of figures for a paper


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Reports of one and of three runs. Each kind of figure is encoded once, in each size."""
    encoded = {}

    def encoded_once(figure):
        labels = tuple((axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes)
        kind = (labels, tuple(figure.get_size_inches()))
        if kind not in encoded:
            encoded[kind] = svg(figure)
        return encoded[kind]

    folder = tmp_path_factory.mktemp("reports")
    runs = [run_like(sq=1e-6 * sq) for sq in (0.5, 1.0, 2.0)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(base, "svg", encoded_once)
        return {
            1: write_report(runs[:1], folder / "one.html"),
            3: write_report(runs, folder / "three.html"),
        }


@pytest.fixture(scope="module")
def browser():
    with chromium() as running:
        yield running


@pytest.mark.parametrize("width", SCREENS)
@pytest.mark.parametrize("count", [1, 3])
def test_the_first_picture_is_on_the_first_screens(browser, reports, count, width):
    screen, screens = SCREENS[width]
    view = browser.new_page(viewport={"width": width, "height": screen})
    view.goto(reports[count].as_uri())
    tops = view.evaluate(
        "[...document.images].filter(i => i.checkVisibility())"
        ".map(i => i.getBoundingClientRect().top)"
    )
    height, overflow = view.evaluate(
        "[document.documentElement.scrollHeight, document.documentElement.scrollWidth - innerWidth]"
    )
    view.close()
    assert min(tops) < screens * screen
    assert overflow <= 0
    if width == 1280 and count == 1:
        assert height <= MAX_HEIGHT


def test_a_link_to_folded_numbers_opens_them(browser, reports):
    view = browser.new_page(viewport={"width": 1280, "height": 800})
    view.goto(reports[3].as_uri())
    table = view.locator("#numbers table")
    assert not table.is_visible()
    view.click("nav a[href='#numbers']")
    table.wait_for(state="visible")
    view.close()


def test_folded_numbers_are_printed(browser, reports):
    view = browser.new_page(viewport={"width": 1280, "height": 800})
    view.goto(reports[1].as_uri())
    view.emulate_media(media="print")
    height = view.evaluate(
        "document.querySelector('#numbers table').getBoundingClientRect().height"
    )
    view.close()
    assert height > 300.0


def test_contact_alone_is_yellow_and_no_state_is_red():
    red, green, blue = (int(OIL_COLOUR[k : k + 2], 16) for k in (1, 3, 5))
    assert blue > green > red
    contact = [int(CONTACT_COLOUR[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    assert contact[0] > 0.9 > 0.5 > contact[2]  # yellow
    film = FILM_COLOURS([0.0, 0.25, 0.5, 0.75, 1.0])[:, :3]
    assert film[:, 0].max() < 0.6  # neither red nor yellow
    lightness = film @ [0.2126, 0.7152, 0.0722]
    assert (lightness[1:] > lightness[:-1]).all()


@pytest.mark.parametrize("medium", [IN_COLUMN, ACROSS_PAGE], ids=["85 mm", "175 mm"])
def test_figures_for_a_paper_have_legible_text_within_their_width(medium):
    for exhibit in page.run_exhibits(run_like()):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            figure = exhibit.paper_figure(medium)
        texts = [text for text in figure.findobj(Text) if text.get_text().strip()]
        assert min(text.get_fontsize() for text in texts) >= MIN_TEXT, exhibit.name
        assert not any(axes.get_title(loc="left") for axes in figure.axes), exhibit.name
        for legend in figure.legends:
            assert legend.get_window_extent().x0 >= 0.0, exhibit.name


def test_every_picture_of_a_run_is_written_for_one_and_two_columns(tmp_path):
    run = run_like()
    exhibits = list(page.run_exhibits(run))[:3]
    base.write_exhibits(exhibits, tmp_path / "figures")
    names = {file.name for file in (tmp_path / "figures").iterdir()}
    expected = {f"{exhibit.name}-{width}mm.pdf" for exhibit in exhibits for width in (85, 175)}
    assert names == expected | {"captions.md"}
    for exhibit in exhibits:
        for width in (85, 175):
            document = (tmp_path / "figures" / f"{exhibit.name}-{width}mm.pdf").read_bytes()
            points = float(re.search(rb"/MediaBox \[ ?0 0 ([\d.]+)", document)[1])
            assert points / 72.0 * 25.4 == pytest.approx(width, abs=0.1), exhibit.name
