"""The pages of recordings, studies and histories in a browser, and the password of --listen."""

import json
import re
import shutil
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from asperity.cli import main
from asperity.paper import papers_case
from asperity.simulation import run_history
from asperity.study import plan_study, run_study
from support.browser import (
    NOT_WARMED_UP,
    Visit,
    chromium,
    click_mark,
    expect,
    require_operable,
    serving,
)

pytest.importorskip("panel", reason="the extra page is not installed")

SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um", "vibration": "none"}


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


def serve(folder, path):
    """Serve a folder; only one test solves a contact."""
    return serving(folder, path, program=("-c", NOT_WARMED_UP))


@pytest.fixture(scope="module")
def server(browser, tmp_path_factory):  # noqa: ARG001 - no server is started without a browser
    """Serve a study; its page of recordings has no folder."""
    folder = tmp_path_factory.mktemp("server")
    study = {"sq": ["0.5 um", "1.5 um"], "seeds": 2, "kind": "solve"}
    case = papers_case().with_overrides({**SMALL, "study": study})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("asperity.study.execute._pool", lambda _: ThreadPoolExecutor(1))
        run_study(plan_study(case), out=folder / "wear", workers=1)
    with serve(folder, "wear") as started:
        yield started


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """Write five short recordings of the simulated rig."""
    folder = tmp_path_factory.mktemp("rig") / "rig"
    few = ["--samples", "5", "--repeats", "1", "--duration", "1 s"]
    with pytest.raises(SystemExit):
        main(["rig", "--out", str(folder), *few, "--quiet"])
    return folder


def test_dropped_recordings_show_their_resonance_or_a_reason(browser, server, tmp_path, rig):
    visit = Visit(browser, server)
    page = visit.go("recordings")
    np.save(tmp_path / "silent.npy", np.random.default_rng(0).standard_normal(20_000))
    page.locator("input[type=file]").set_input_files(tmp_path / "silent.npy")
    page.get_by_text("give the sampling rate").wait_for()
    box = page.get_by_role("textbox", name=re.compile("^Sampling rate"))
    box.fill("20")
    box.press("Enter")
    page.get_by_role("button", name="Read again").click()
    page.get_by_text('the sampling rate must be a frequency such as "50 kHz"').wait_for()
    box.fill("20 kHz")
    box.press("Enter")
    page.get_by_role("button", name="Read again").click()
    page.get_by_text("1 recordings read").wait_for()
    page.get_by_text("No contact resonance found").wait_for()
    page.locator("input[type=file]").set_input_files(sorted(rig.glob("*.h5")))
    page.get_by_text("6 recordings read").wait_for()
    page.get_by_text(re.compile("line of unknown origin .* in 5 of 6 recordings")).wait_for()
    require_operable(page)
    page.get_by_label("Recording", exact=True).select_option(index=1)
    expect(page.locator("table tbody tr")).to_have_count(6)
    (tmp_path / "cut.h5").write_bytes(next(rig.glob("*.h5")).read_bytes()[:5000])
    page.locator("input[type=file]").set_input_files(tmp_path / "cut.h5")
    page.get_by_text("7 recordings read").wait_for()
    expect(page.locator("table tbody tr").last).to_contain_text("cut.h5")
    visit.close()


def test_a_point_of_a_study_opens_as_an_adjustable_contact(browser, server):
    visit = Visit(browser, server)
    page = visit.go("study")
    page.get_by_text("Click a point to see its contact.").wait_for()
    page.get_by_label("Contact of the study").select_option(index=4)
    page.get_by_text(re.compile(r"^surface.sq 1.5\sµm.*asperities carry")).wait_for()
    require_operable(page)
    click_mark(page, "Outputs of the study over a swept quantity", 1)
    page.get_by_text(re.compile(r"^surface.sq 0.5\sµm, surface.seed .*asperities carry")).wait_for()
    click_mark(page, "Outputs of the study over a swept quantity", 3)
    page.get_by_text(re.compile(r"^surface.sq 1.5\sµm.*asperities carry")).wait_for()
    clr = page.locator("dl div", has_text="CLR").locator("dd").first.inner_text()
    page.get_by_role("link", name="Open with its inputs").click()
    page.wait_for_url(re.compile("/contact[?]"))
    page.get_by_text("Solved on 32 × 24 cells").wait_for()
    expect(page.get_by_role("textbox", name="Composite roughness, Sq")).to_have_value("1.5 µm")
    expect(page.locator("#headline dl div", has_text="CLR").locator("dd").first).to_have_text(
        clr, use_inner_text=True
    )
    visit.close()


def test_a_history_is_animated(browser, tmp_path):
    run_history(papers_case().with_overrides(SMALL), out=tmp_path / "moving", steps=4)
    with serve(tmp_path, "moving") as server:
        visit = Visit(browser, server)
        page = visit.go("history")
        page.get_by_text("Step 0, 0 µs, map 1 of 5").wait_for()
        page.get_by_text(re.compile(r"in motion, .* 4 steps, .* µs\.$")).wait_for()
        require_operable(page)
        page.get_by_role("slider", name="Step").focus()
        page.keyboard.press("ArrowRight")
        page.get_by_text(re.compile("^Step 1, .* map 2 of 5")).wait_for()
        page.get_by_role("button", name="Play").click()
        page.get_by_text(re.compile("^Step 3, ")).wait_for()
        page.get_by_role("button", name="Stop").click()
        visit.close()


def test_a_watched_folder_of_a_rig_gives_the_verdict_of_track(browser, tmp_path, rig, capsys):
    folder, files = tmp_path / "arriving", sorted(rig.glob("*.h5"))
    shutil.copytree(rig, folder, ignore=shutil.ignore_patterns(files[-1].name))
    with serve(tmp_path, str(folder)) as server:
        visit = Visit(browser, server)
        page = visit.go("recordings")
        page.get_by_text("4 recordings read; the folder is being watched.").wait_for()
        shutil.copy2(files[-1], folder)
        page.get_by_text("5 recordings read; the folder is being watched.").wait_for()
        shown = page.locator(".block.verdict p").first.inner_text()
        visit.close()
    given = ["--table", str(folder / "table.csv"), "--case", str(folder / "rig.toml")]
    with pytest.raises(SystemExit):
        main(["track", str(folder), *given, "--json", "--quiet"])
    assert plain(shown) == plain(json.loads(capsys.readouterr().out)["verdict"])


def plain(text):
    """Return prose without differences of print."""
    return " ".join(text.replace("µm", "um").split())


def test_an_empty_page_of_recordings_offers_an_example(browser, server):
    visit = Visit(browser, server)
    page = visit.go("recordings")
    page.get_by_text(re.compile("^Drop recordings .* or try an example")).wait_for()
    expect(page.locator("footer")).to_have_text(re.compile(r"^asperity \S+$"))
    assert page.get_by_role("img").count() == 0  # no empty frames
    page.get_by_role("button", name="Try an example").click()
    page.get_by_text("12 recordings read").wait_for()
    page.get_by_text(re.compile("Severe wear from")).wait_for()
    expect(page.get_by_role("img", name="Contact resonance over the series")).to_be_visible()
    axes = "[...Bokeh.index.query(view => view.model.type === 'LinearAxis')]"
    assert "Sq [µm]" in page.evaluate(f"() => {axes}.map(view => view.model.axis_label)")
    visit.close()
