"""Wear of solved contacts against closed forms: volume, depth per passage, Hertz's profile and the
decay of a wave.

Equations of Archard's wear: J. F. Archard, J. Appl. Phys. 24 (1953) 981; pressures: K. L. Johnson,
Contact Mechanics (1985).
"""

import math
from pathlib import Path

import numpy as np
import pytest

from asperity import run_wear
from asperity.core.third_party import surface_topography
from asperity.simulation import WearHistory
from asperity.surface import MovingSurfaces, Surface
from support.wearing import DRY, POINT, worn_case

MEASURED = Path(__file__).parents[2].parent / "shared" / "data" / "surfaces" / "milled_1.opd"

LINE = {
    "surface.correlation_length": ["25 um", "25 um"],
    "grid.cells": [48, 32],
    "grid.y": [-1.6, 1.6],
    "vibration": "none",
    "wear.k": ["1e-17 1/Pa", "3e-17 1/Pa"],
    "wear.overrolling": ["56.25 Hz", "5 Hz"],
    "wear.patches": 4,
}


def worn(hours: float, overrides: dict[str, object] | None = None) -> WearHistory:
    return run_wear(worn_case(LINE | (overrides or {})), hours=hours)


def volume_from_table(history: WearHistory, body: int) -> float:
    """Return the sum of k times the load of touching cells times the sliding distance, from the
    table's columns.
    """
    case, table = history.case, history.table
    load, sliding = case.conditions.load, case.conditions.sliding_speed
    k, clr = history.contact.model.coefficients[body].k, table["clr"].to_numpy()[:-1]
    return float(np.sum(k * clr * load * sliding * 3600.0 * np.diff(table["hours"])))


@pytest.mark.parametrize("rough", ["first", "both"])
def test_worn_volume_is_k_times_load_times_sliding_distance(rough):
    history = worn(1.0, {"motion.rough": rough})
    assert len(history.table) > 3
    assert history.balance_error < 1e-9
    for body in (0, 1):
        lost = np.mean(
            (
                history.initial_surfaces.first if body == 0 else history.initial_surfaces.second
            ).heights
        )
        lost -= np.mean(
            (history.final_surfaces.first if body == 0 else history.final_surfaces.second).heights
        )
        speed, rate = history.case.conditions.surface_speeds[body], (56.25, 5.0)[body]
        assert lost * speed / rate * 10e-3 == pytest.approx(
            history.worn_volume[body], rel=1e-9, abs=0.0
        )
        # the load is met within 1e-4
        assert history.worn_volume[body] == pytest.approx(
            volume_from_table(history, body), rel=3e-4, abs=0.0
        )


@pytest.mark.parametrize("roughness", ["standing", "running"])
def test_depth_per_passage_is_k_times_line_load_times_sliding_over_surface_speed(roughness):
    history = worn(0.01, {"contact.roughness": roughness})
    assert len(history.table) == 2  # a single jump, at the pressure of the initial surfaces
    conditions, clr = history.case.conditions, float(history.table["clr"].iloc[0])
    assert 0.1 < clr < 0.99  # the oil carries part of the load
    for body, k in ((0, 1e-17), (1, 3e-17)):
        expected = k * 5e4 * clr * conditions.sliding_speed / conditions.surface_speeds[body]
        depth = (
            float(history.table[f"worn_depth_{body + 1}_m"].iloc[-1]) / history.overrollings[body]
        )
        assert depth == pytest.approx(expected, rel=3e-4, abs=0.0)


def test_depth_per_passage_does_not_depend_on_the_pressure_profile():
    # machines.md 5.2: w' = 2e5 N/m, 2 and 1.5 m/s, k = 1e-17: 5.0e-13 and 6.667e-13 m
    smooth = {"surface": "flat", "contact.load": "2000 N", "contact.entrainment_speed": "1.75 m/s"}
    history = worn(0.001, {**DRY, **smooth, "contact.slip": 0.5 / 1.75, "wear.k": "1e-17 1/Pa"})
    for body, expected in ((0, 5.0e-13), (1, 6.667e-13)):
        depth = (
            float(history.table[f"worn_depth_{body + 1}_m"].iloc[-1]) / history.overrollings[body]
        )
        assert depth == pytest.approx(expected, rel=2e-4, abs=0.0)


@pytest.mark.parametrize("cells", [[64, 64], [128, 128]])
def test_a_ball_wears_a_parabola_across_its_track(cells):
    """A dry, smooth Hertz contact wears k (pi/2) p0 a (1 - y^2/a^2) |u_s|/u_i on the track, within
    1 %.
    """
    ball = {"contact.load": "20 N", "surface": "flat", "grid.cells": cells}
    ends = {"grid.x": [-1.6, 1.6], "grid.y": [-1.6, 1.6]}
    case = worn_case({**LINE, **DRY, **ball, **ends}, POINT)
    history = run_wear(case, hours=1e-4)
    conditions, hertz = case.conditions, case.conditions.hertz
    a, p0 = hertz.half_widths[0], hertz.p_max
    y = history.initial_surfaces.grid.y
    for body, k in ((0, 1e-17), (1, 3e-17)):
        largest_depth = (
            k * 0.5 * math.pi * p0 * a * conditions.sliding_speed / conditions.surface_speeds[body]
        )
        profile = history.worn.worn[body].mean(axis=0) / history.overrollings[body]
        expected = largest_depth * np.maximum(1.0 - (y / a) ** 2, 0.0)
        inner = np.abs(y) < 0.8 * a
        np.testing.assert_allclose(profile[inner], expected[inner], rtol=0.01)
        assert np.max(np.abs(profile - expected)) < 0.01 * largest_depth * (64 / cells[0] + 1.0)
        area = profile.sum() * history.initial_surfaces.grid.spacing[1]
        assert area == pytest.approx(
            k * 20.0 * conditions.sliding_speed / conditions.surface_speeds[body], rel=3e-4, abs=0.0
        )


def decay_of_ridges(half_width: float, hours: float) -> tuple[float, float]:
    """Return the decay of ridges along rolling, ln(A0/A), from the solver and in closed form."""
    grid = {"grid.cells": [96, 32], "grid.x": [-1.2, 1.2], "grid.y": [-half_width, half_width]}
    overrides = {**DRY, **grid, "surface": "flat", "wear.k": ["1e-15 1/Pa", "0 1/Pa"]}
    case = worn_case(LINE | overrides)
    flat, b, across = case.moving_surfaces(), case.conditions.hertz.half_widths[0], case.grid
    wave = 2.0 * np.pi / across.extent[1]
    ridges = 2e-10 * np.cos(wave * (across.y - across.lower[1]))
    track = Surface(np.tile(ridges, (across.cells[0], 1)), flat.first.grid)
    history = run_wear(
        case, hours=hours, surfaces=MovingSurfaces(track, flat.second, flat.speeds, flat.grid)
    )
    left = history.final_surfaces.first.heights[0]
    swing = 2.0 * np.abs(np.fft.rfft(left))[1] / across.cells[1]
    speeds, sliding = case.conditions.surface_speeds, case.conditions.sliding_speed
    passages = history.overrollings[0]
    return math.log(
        2e-10 / swing
    ), passages * 1e-15 * case.conditions.pair.reduced_modulus * wave * b * sliding / speeds[0]


def test_ridges_in_full_contact_decay_with_the_sliding_distance():
    """A factor exp(-k E* q b |u_s|/u_1) per passage, where the pressure exceeds E* q A/2
    everywhere; within 2 %.

    The closed form holds for waves much shorter than the contact width, and the agreement improves
    with shorter waves.
    """
    (wide, of_wide), (narrow, of_narrow) = decay_of_ridges(0.1, 0.006), decay_of_ridges(0.05, 0.003)
    assert of_wide == pytest.approx(of_narrow)
    assert 0.5 < of_wide < 1.0  # a considerable decay that leaves measurable ridges
    assert wide == pytest.approx(of_wide, rel=0.02, abs=0.0)
    assert narrow == pytest.approx(of_narrow, rel=0.01, abs=0.0)


def test_without_sliding_there_is_no_wear():
    history = worn(100.0, {"contact.slip": 0.0, "wear.k": "1e-12 1/Pa"})
    assert history.worn_volume == (0.0, 0.0)
    np.testing.assert_array_equal(
        history.final_surfaces.first.heights, history.initial_surfaces.first.heights
    )
    assert len(history.table) == 2
    assert "There is no sliding, so no wear occurs." in history.notes


def test_the_energy_law_equals_archard_with_k_over_the_boundary_friction():
    by_pressure = worn(0.2)
    by_energy = worn(
        0.2, {"wear.law": "energy", "wear.k": [f"{1e-17 / 0.15!r} 1/Pa", f"{3e-17 / 0.15!r} 1/Pa"]}
    )
    np.testing.assert_allclose(
        by_energy.final_surfaces.first.heights,
        by_pressure.final_surfaces.first.heights,
        rtol=0,
        atol=1e-16,
    )


def test_wear_lowers_summits_and_leaves_pits():
    history = worn(1.0, {"wear.k": ["6e-17 1/Pa", "0 1/Pa"], "wear.step": 0.1})
    first, last = history.table.iloc[0], history.table.iloc[-1]
    assert last["sq_m"] < 0.98 * first["sq_m"]
    assert last["ssk"] < first["ssk"]
    assert last["spk_m"] / first["spk_m"] < 0.8
    assert abs(last["svk_m"] / first["svk_m"] - 1.0) < 0.1
    assert last["clr"] < first["clr"]
    assert np.all(history.final_surfaces.first.heights <= history.initial_surfaces.first.heights)


def test_a_larger_wear_coefficient_accelerates_wear_proportionally():
    slow, fast = worn(0.4), worn(0.1, {"wear.k": ["4e-17 1/Pa", "12e-17 1/Pa"]})
    for key in ("sq_m", "clr", "worn_depth_1_m", "worn_depth_2_m"):
        assert fast.table[key].iloc[-1] == pytest.approx(
            slow.table[key].iloc[-1], rel=1e-9, abs=0.0
        )


def test_halving_the_jump_hardly_changes_roughness_and_load_share():
    whole, half = (
        worn(0.25, {"wear.k": ["3e-17 1/Pa", "0 1/Pa"], "wear.step": step}) for step in (0.04, 0.02)
    )
    assert len(half.table) > 1.3 * len(whole.table)
    for key in ("sq_m", "clr"):
        assert half.table[key].iloc[-1] == pytest.approx(
            whole.table[key].iloc[-1], rel=0.02, abs=0.0
        )


def test_the_error_of_the_volume_covers_the_length_of_jumps():
    """Halving `step` from 0.1 to 0.0125 lowers the volume by 3.5 %: a jump removes at its initial
    rate, while wear slows down. The last two steps extrapolate to 4.0 % below the first.
    """
    whole, half = (run_wear(worn_case({"wear.step": step}), hours=0.3) for step in (0.1, 0.05))
    reference = 8.451e-12  # from steps of 0.025 and 0.0125
    for history in (whole, half):
        high = history.worn_volume[0] / reference - 1.0
        assert 0.01 < high < history.volume_error < 3.0 * high
    assert half.volume_error == pytest.approx(0.5 * whole.volume_error, rel=0.15)


@pytest.mark.skipif(not MEASURED.is_file(), reason="the measured surface is not beside the project")
def test_a_measured_surface_runs_in(tmp_path):
    """SurfaceTopography reads the files before and after wear and finds the parameters of the
    table.
    """
    surface = {"file": str(MEASURED), "fit": "tile"}
    surface_less = {key: value for key, value in LINE.items() if not key.startswith("surface")}
    wear = {"wear.k": ["2e-16 1/Pa", "0 1/Pa"], "wear.step": 0.1}
    case = worn_case({**surface_less, "surface": surface, **wear})
    history = run_wear(case, hours=0.2, out=tmp_path / "worn")
    first, last = history.table.iloc[0], history.table.iloc[-1]
    for path, row in zip(history.files[:2], (first, last), strict=True):
        heights = surface_topography().open_topography(str(path)).topography().heights()
        sq = float(np.std(heights))
        assert row["sq_1_m"] == pytest.approx(sq, rel=1e-9, abs=0.0)
        assert row["ssk_1"] == pytest.approx(
            np.mean((heights - heights.mean()) ** 3) / sq**3, rel=1e-6, abs=1e-9
        )
    assert last["sq_m"] < first["sq_m"]
    assert last["spk_m"] < first["spk_m"]
    assert history.balance_error < 1e-9
