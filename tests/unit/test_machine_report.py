"""Report of a machine: its content, and drawings that match the geometry."""

import math
import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from asperity.case import load_machine
from asperity.machine import RollerCam, SpurGear
from asperity.machines import MachineResult, machine_conditions
from asperity.report import write_machine_report
from asperity.report.machine import sketch
from asperity.report.machine.contact_path import along_path
from asperity.results import solve_case

EXAMPLES = Path(__file__).parents[2] / "examples"
CAM = """
[machine]
kind = "cam-roller"
base_radius = "18 mm"
lift = "9 mm"
half_angle = "70 deg"
width = "10 mm"
speed = "1500 r/min"
spring_load = "600 N"
roller_radius = "9 mm"
"""
SOLVED = {
    "h_central_m": 2e-7,
    "h_min_m": 1e-7,
    "lambda_ratio": 0.4,
    "clr": 0.08,
    "clr_low": 0.05,
    "clr_high": 0.13,
    "car": 0.03,
    "determined": True,
    "friction_coefficient": 0.05,
    "friction_power_w": 400.0,
    "flash_temperature_max_k": 150.0,
    "von_mises_core_pa": 1e9,
    "reason": "",
}


def solved(case, failed=(), run=None):
    rows = [{**row, **SOLVED} for row in machine_conditions(case).rows]
    for row in rows:
        if row["name"] in failed:
            row.update(dict.fromkeys(SOLVED) | {"reason": "did not converge"})
    return MachineResult(case, tuple(rows), True, 1.0, run=run)


def page(result, tmp_path, **about):
    return unescape(
        write_machine_report(result, tmp_path / "page.html", **about).read_text("utf-8")
    )


def test_the_report_opens_with_the_verdict(tmp_path):
    gears = load_machine(EXAMPLES / "fzg-c.toml")
    few = {"grid.cells": [96, 48], "solver.running_cells": 600, "solver.surfaces": 1}
    run = solve_case(gears.case(gears.contacts[4]).with_overrides(few), strict=False)
    text = page(solved(gears, run=run), tmp_path, opened="worst.html")
    body = text.split("<main>")[1]
    assert body.index("mixed lubrication; worst is") < body.index("<h2 id=")
    assert (
        "asperities carry 8.0 % (5.0 to 13.0 %) of the load".replace(" %", "\N{NO-BREAK SPACE}%")
        in body
    )
    assert 'href="worst.html"' in body
    assert (
        body.count("<img ") == 8
    )  # the machine, its path, and six of the worst contact, which is sliding
    for text_part in (
        "ISO/TR 15144-1:2014",
        "not rated: [rating] has no scuffing_stage",
        'kind = "spur-gear"',
        "mesh",
    ):
        assert text_part in text
    assert len(re.findall(r'<tr class="worst">', text)) == 1
    assert "8.0 <small>(5.0 to 13.0)</small>" in text.replace("\N{NO-BREAK SPACE}", " ")


def test_contacts_in_pure_rolling_have_no_friction_and_equal_ones_are_listed_once(tmp_path):
    result = solved(load_machine(EXAMPLES / "nu206.toml"))
    rolling = {"friction_coefficient": 0.0, "friction_power_w": 0.0, "flash_temperature_max_k": 0.0}
    result = replace(result, rows=tuple({**row, **rolling} for row in result.rows))
    text = page(result, tmp_path)
    tiles = text.split('class="tiles"')[1].split("</dl>")[0]
    table = text.split('<table class="contacts"')[1].split("</table>")[0]
    assert tiles.count("none: pure rolling") == 2
    assert ("10 of 10 contacts roll without sliding" in text, "flash" in table) == (True, False)
    names = re.findall(r'<th scope="row">(.*?)</th>', table)
    assert names[2:4] == ["roller 1, 12, inner ring", "roller 1, 12, outer ring"]
    assert len(names) == 6
    result.rows[-1]["h_central_m"] = 3e-7  # roller 12, outer ring
    assert len(re.findall('<th scope="row">r', page(result, tmp_path))) == 7


def test_the_report_loads_no_resources_and_runs_no_scripts(tmp_path):
    text = page(machine_conditions(load_machine(EXAMPLES / "nu206.toml")), tmp_path)
    assert "default-src 'none'; img-src data:;" in text
    assert "script-src 'none'" in text
    assert "<script" not in text
    assert not re.search(r'(src|href)="(?!data:|#|https://doi)', text)
    for alternative in re.findall(r'<img [^>]*alt="([^"]*)"', text):
        assert len(alternative) > 20


def test_unsolved_contacts_are_marked(tmp_path):
    text = page(solved(load_machine(EXAMPLES / "fzg-c.toml"), failed=("B",)), tmp_path)
    assert "⚠" in text
    assert "1 of 7 contacts were NOT SOLVED" in text
    assert "not solved: did not converge" in text


def test_the_report_is_reproducible_byte_for_byte(tmp_path):
    result = machine_conditions(load_machine(EXAMPLES / "6206.toml"))
    first = write_machine_report(result, tmp_path / "one.html").read_bytes()
    assert first == write_machine_report(result, tmp_path / "two.html").read_bytes()


def test_both_sides_of_a_load_zone_are_drawn_in_order():
    bearing = solved(load_machine(EXAMPLES / "nu206.toml"))
    figure = along_path(bearing).figure()
    line = figure.axes[0].get_lines()[0]
    assert line.get_xdata() == pytest.approx(np.arange(-2, 3) * 360.0 / 13.0)
    assert len(figure.axes[0].get_lines()) == 2  # both rings
    shares = next(axes for axes in figure.axes if axes.get_title(loc="left").startswith("CLR"))
    (low, high), *_ = (segment[:, 1] for segment in shares.collections[0].get_segments())
    assert (low, high) == pytest.approx((5.0, 13.0))


def test_a_rating_is_drawn_next_to_the_solved_values():
    figure = along_path(solved(load_machine(EXAMPLES / "fzg-c.toml"))).figure()
    heat = next(
        axes for axes in figure.axes if axes.get_title(loc="left").startswith("maximum flash")
    )
    (_, rating) = heat.get_lines()
    assert rating.get_ydata()[3] == pytest.approx(0.0, abs=1e-9)
    assert rating.get_ydata()[0] > 50.0


def result_and_axes(case):
    figure = Figure()
    axes = figure.add_subplot()
    result = machine_conditions(case)
    return result, axes


def test_the_drawn_teeth_touch_at_the_contact():
    """Both outlines pass through the worst point with a common tangent."""
    gears = load_machine(EXAMPLES / "fzg-c.toml")
    pair = gears.machine
    assert isinstance(pair, SpurGear)
    result, axes = result_and_axes(gears)
    sketch._gears(pair, result, axes)
    pinion, wheel = (patch.get_xy() for patch in axes.patches[:2])
    contact_point = next(
        line
        for line in axes.get_lines()
        if (line.get_marker(), line.get_markersize()) == ("o", 6.0)
    ).get_xydata()[0]
    assert np.hypot(*contact_point) == pytest.approx(
        1e3 * math.hypot(pair.base_radii[0], pair.path["B"]), rel=1e-6
    )
    slopes = []
    for outline in (pinion, wheel):
        start, end = outline[:-1], outline[1:]
        segment = end - start
        share = np.clip(
            ((contact_point - start) * segment).sum(axis=1)
            / np.maximum((segment**2).sum(axis=1), 1e-12),
            0.0,
            1.0,
        )
        off = np.hypot(*(start + share[:, None] * segment - contact_point).T)
        nearest = int(np.argmin(off))
        assert off[nearest] < 0.01  # mm
        slopes.append(math.atan2(*segment[nearest][::-1]) % math.pi)
    assert slopes[0] == pytest.approx(slopes[1], abs=0.1)
    flank_angle = math.atan2(math.sin(pair.working_angle), -math.cos(pair.working_angle))
    assert (slopes[0] - flank_angle) % math.pi == pytest.approx(math.pi / 2.0, abs=0.1)


def test_the_drawn_cam_touches_its_roller(tmp_path):
    path = tmp_path / "cam.toml"
    path.write_text(CAM, "utf-8")
    cam = load_machine(path).machine
    assert isinstance(cam, RollerCam)
    for angle in (0.0, 0.5, 1.0):
        touched = sketch._on_cam(cam, angle)
        reach = cam.base_radius + cam.roller_radius + cam.lift_at(angle)
        centre = reach * np.array([math.sin(angle), math.cos(angle)])
        assert np.hypot(*(touched - centre)) == pytest.approx(cam.roller_radius, rel=1e-9)
        outline = np.array([sketch._on_cam(cam, turn) for turn in np.linspace(-1.2, 1.2, 2401)])
        assert np.hypot(*(outline - centre).T).min() == pytest.approx(cam.roller_radius, rel=1e-5)
    assert "Cam with roller follower" in page(machine_conditions(load_machine(path)), tmp_path)
