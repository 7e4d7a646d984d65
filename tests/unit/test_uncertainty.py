"""Uncertainty of a contact's results: parts, combination, and scatter between surfaces."""

import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

import asperity.results.solve as solving
from asperity import BadInput, load_case, load_run, solve_case
from asperity.case import Case
from asperity.cli.contact import run_table
from asperity.ehl import Uncertainty
from asperity.results import prediction_interval

PAPER = (
    files("asperity.paper")
    .joinpath("paper.toml")
    .read_text("utf-8")
    .replace("[contact]", '[contact]\nroughness = "standing"', 1)
)
WITHOUT_COARSE_GRID = {
    "grid.cells": [48, 48],
    "vibration.duration": "0.2 s",
}  # too few cells for a coarser grid
SMALL = {"grid.cells": [96, 96], "vibration.duration": "0.2 s"}


def case(**overrides) -> Case:
    return load_case(PAPER).with_overrides({**WITHOUT_COARSE_GRID, **overrides})


@pytest.fixture(scope="module")
def without_coarse_grid():
    return solve_case(case())


@pytest.fixture(scope="module")
def run():
    return solve_case(load_case(PAPER).with_overrides(SMALL))


@pytest.fixture(scope="module")
def three_surfaces():
    return solve_case(case(), surfaces=3)


def test_independent_parts_add_in_quadrature_and_numerical_parts_linearly():
    error = Uncertainty(
        value=0.5, iteration=(0.01, 0.01), grid=(0.02, 0.03), surfaces=(0.04, 0.0), range=(0.0, 1.0)
    )
    assert error.low == pytest.approx(
        0.5 - 0.05
    )  # sqrt(0.03^2 + 0.04^2); iteration and grid are 0.01 + 0.02
    assert error.high == pytest.approx(0.5 + 0.04)


@pytest.mark.parametrize(
    ("value", "low", "high"), [(0.06, 0.0, 0.74), (0.95, 0.27, 1.0), (0.5, 0.0, 1.0)]
)
def test_the_interval_of_a_share_stays_within_0_and_1(value, low, high):
    error = Uncertainty(value=value, iteration=(0.0, 0.0), grid=(0.68, 0.68), range=(0.0, 1.0))
    assert error.interval == pytest.approx((low, high))


@pytest.mark.parametrize("missing", ["iteration", "grid", "record"])
def test_an_unknown_part_gives_no_interval(missing):
    known = Uncertainty(value=0.5, iteration=(0.1, 0.1), grid=(0.1, 0.1))
    assert known.interval is not None
    assert replace(known, **{missing: None}).interval is None


@pytest.mark.parametrize("count", [2, 3, 5, 12])
def test_prediction_intervals_cover_90_percent_of_further_surfaces(count):
    """Normally distributed values; 20 000 trials have a standard deviation of 0.2 %."""
    rng = np.random.default_rng(1)
    covered = 0
    for *few, new_value in rng.normal(3500.0, 100.0, (20_000, count + 1)):
        mean, (lower, upper) = prediction_interval(few, share=False)
        covered += mean - lower <= new_value <= mean + upper
    assert covered / 20_000 == pytest.approx(0.9, abs=0.008)


@pytest.mark.parametrize(("centre", "scatter"), [(0.0, 0.4), (2.5, 0.8), (-4.0, 1.0), (5.0, 2.0)])
def test_intervals_of_shares_cover_and_stay_within_0_and_1(centre, scatter):
    """Logit-normal shares from a twentieth to nearly all of the load."""
    rng = np.random.default_rng(2)
    covered = 0
    for *few, new_value in 1.0 / (1.0 + np.exp(-rng.normal(centre, scatter, (10_000, 6)))):
        mean, (lower, upper) = prediction_interval(few, share=True)
        assert 0.0 <= mean - lower <= mean + upper <= 1.0
        covered += mean - lower <= new_value <= mean + upper
    # the limit of one per cent of the load at either end makes the intervals conservative
    assert 0.88 < covered / 10_000 < 0.95


@pytest.mark.parametrize("share", [0.0, 1.0, 0.3])
def test_identical_surfaces_have_an_interval_of_zero_width(share):
    assert prediction_interval([share] * 4, share=True) == (
        share,
        pytest.approx((0.0, 0.0), abs=1e-12),
    )


def test_the_error_of_a_resonance_is_propagated_from_its_load_share(run):
    """CRF is proportional to CLR^(1/6); the error of CLR exceeds that of the fitted line."""
    clr, crf = run.error.clr, run.error.crf_hz
    assert clr.surfaces is crf.surfaces is None
    f0 = run.vibration.oscillator.natural_frequency_hz
    lower = f0 * (1.0 - ((clr.value - clr.grid[0]) / clr.value) ** (1.0 / 6.0))
    upper = f0 * (min(1.0, clr.value + clr.grid[1]) ** (1.0 / 6.0) / clr.value ** (1.0 / 6.0) - 1.0)
    assert crf.grid == pytest.approx((lower, upper))
    assert crf.record[0] == pytest.approx(1.645 * run.resonance.crf_std_hz, rel=1e-3)
    assert crf.high - crf.low > 10.0 * run.resonance.crf_std_hz
    assert crf.low < crf.value < crf.high
    assert f"at {crf.value:.0f} Hz ({crf.low:.0f} to {crf.high:.0f} Hz)" in run.verdict()
    numbers = run.scalars()
    assert (numbers["crf_low_hz"], numbers["crf_high_hz"]) == crf.interval
    assert (numbers["clr_low"], numbers["clr_high"]) == clr.interval


def test_without_a_coarser_grid_the_error_is_not_determined(without_coarse_grid):
    numbers = without_coarse_grid.scalars()
    for key in ("clr_low", "clr_high", "crf_low_hz", "crf_high_hz", "clr_error", "crf_error_hz"):
        assert numbers[key] is None
    assert numbers["crf_record_error_hz"] > 0.0
    assert without_coarse_grid.verdict().count("± not determined") == 2
    table = "\n".join(run_table(without_coarse_grid))
    assert re.search(r"load share, CLR +[\d.]+ % \(± not determined\)", table)
    assert re.search(r"CLR, cell size +not determined", table)


def test_results_of_several_surfaces_are_means(three_surfaces, without_coarse_grid):
    separate = [solve_case(case(**{"surface.seed": 7 + number})) for number in range(3)]
    numbers = three_surfaces.scalars()
    for key in ("clr", "car", "h_mean_m", "friction_coefficient", "von_mises_max_pa", "crf_hz"):
        assert numbers[key] == pytest.approx(
            np.mean([single.scalars()[key] for single in separate]), rel=1e-9
        )
        assert numbers[key] != pytest.approx(without_coarse_grid.scalars()[key], rel=1e-9)
    assert numbers["surfaces"] == 3
    # solver details are those of the first surface
    assert numbers["iterations"] == without_coarse_grid.scalars()["iterations"]
    mean, sides = prediction_interval([single.state.clr for single in separate], share=True)
    assert three_surfaces.error.clr.value == mean
    assert three_surfaces.error.clr.surfaces == sides
    assert three_surfaces.state.clr == separate[0].state.clr
    assert "mean of 3 surfaces" in three_surfaces.verdict()


def test_the_scatter_of_the_load_share_is_propagated_to_the_resonance(three_surfaces):
    clr, crf = three_surfaces.error.clr, three_surfaces.error.crf_hz
    lower, upper = (
        (end / clr.value) ** (1.0 / 6.0)
        for end in (clr.value - clr.surfaces[0], clr.value + clr.surfaces[1])
    )
    f0 = three_surfaces.vibration.oscillator.natural_frequency_hz * (
        clr.value / three_surfaces.state.clr
    ) ** (1.0 / 6.0)
    assert crf.surfaces == pytest.approx((f0 * (1.0 - lower), f0 * (upper - 1.0)))


def test_a_law_that_needs_the_solved_contact_has_no_numerical_error():
    tangent = {
        "vibration.stiffness_law": "tangent",
        "vibration.rate": "200 kHz",
        "surface.sq": "2 um",
    }
    solved_run = solve_case(case(**tangent, **{"grid.cells": [96, 96]}))
    assert solved_run.error.clr.interval is not None
    assert solved_run.error.crf_hz.grid is None
    assert solved_run.error.crf_hz.interval is None
    assert "resonance at" in solved_run.verdict()


def test_a_loaded_run_has_the_same_results(three_surfaces, tmp_path):
    loaded = load_run(three_surfaces.save(tmp_path / "run.nc"))
    assert loaded.scalars() == three_surfaces.scalars()
    assert loaded.verdict() == three_surfaces.verdict()


def test_worker_processes_do_not_change_results(three_surfaces, monkeypatch):
    monkeypatch.setattr(solving, "MIN_PARALLEL_S", 0.0)
    monkeypatch.setattr(solving, "cores", lambda: 2)
    calls = []
    parallel = solve_case(
        case(), surfaces=3, workers=2, surface_progress=lambda *counts: calls.append(counts)
    )
    assert calls == [(2, 3), (3, 3)]
    assert [without_time(row) for row in parallel.others] == [
        without_time(row) for row in three_surfaces.others
    ]


def without_time(row):
    return {key: value for key, value in row.items() if key != "seconds"}


def test_a_surface_that_fails_is_excluded_with_a_note(monkeypatch):
    solve_first = solving._first

    def fail_second(chosen, *rest, **options):
        if chosen.contents.surface.seed == 8:
            chosen = chosen.with_overrides({"solver.max_iterations": 1})
        return solve_first(chosen, *rest, **options)

    monkeypatch.setattr(solving, "_first", fail_second)
    solved_run = solve_case(case(), surfaces=3)
    assert solved_run.scalars()["surfaces"] == 2
    (note,) = [note for note in solved_run.notes if "excluded" in note]
    assert note.startswith(
        "Surface 2 of 3 is excluded from means and intervals: contact not solved"
    )
    assert "mean of 2 surfaces" in solved_run.verdict()


@pytest.mark.parametrize(
    ("overrides", "count"),
    [
        ({}, 5),
        ({"grid.cells": [512, 256]}, 3),
        ({"solver.surfaces": 2}, 2),
        ({"surface": {"kind": "flat"}}, 1),
        ({"surface": {"kind": "flat"}, "solver.surfaces": 4}, 1),
    ],
)
def test_the_number_of_surfaces_depends_on_grid_and_settings(overrides, count):
    assert case(**overrides).surface_count() == count
    assert case(**overrides).surface_count(1) == 1


@pytest.mark.parametrize("count", [1001, 0x7FFF])
def test_too_many_surfaces_are_refused(count):
    with pytest.raises(BadInput, match=f"surfaces must be 1 to 1000, got {count}"):
        case(**{"solver.surfaces": count}).surface_count()


def measured_case(folder, columns, rows, **overrides):
    """A contact of 358 um x 179 um with a measured map of 2 um pixels."""
    heights = 1e6 * gaussian(columns, rows)
    np.savetxt(folder / "map.txt", heights.T)
    surface = {"file": "map.txt", "unit": "um", "pixel": ["2 um", "2 um"]}
    return load_case(PAPER, folder=folder).with_overrides(
        {**WITHOUT_COARSE_GRID, "surface": surface, **overrides}
    )


def gaussian(columns, rows):
    from asperity.contact.grid import Grid
    from asperity.surface import gaussian_surface

    grid = Grid((columns, rows), (0.0, 0.0), (columns * 2e-6, rows * 2e-6))
    return gaussian_surface(
        grid, sq=1e-6, correlation_length=20e-6, rng=np.random.default_rng(3)
    ).heights


def test_a_measured_map_is_solved_at_non_overlapping_places(tmp_path):
    # 380 um x 620 um: three contacts side by side across, including the margins for blending
    measured = measured_case(tmp_path, 190, 310)
    assert measured.surface_count() == 3
    solved_run = solve_case(measured, surfaces=None)
    assert solved_run.error.surfaces == 3
    places = [measured.on_surface(number) for number in range(3)]
    assert [placed.contents.surface.place for placed in places] == [None, 1, 2]
    heights = [placed.surface().heights for placed in places]
    assert (
        max(
            abs(np.corrcoef(heights[i].ravel(), heights[j].ravel())[0, 1])
            for i, j in ((0, 1), (0, 2), (1, 2))
        )
        < 0.3
    )
    assert places[1].surface().heights == pytest.approx(
        load_case(places[1].text, folder=tmp_path).surface().heights
    )


def test_a_map_with_room_for_one_contact_is_solved_once_and_more_are_refused(tmp_path):
    small = measured_case(tmp_path, 190, 120)
    assert small.surface_count() == 1
    with pytest.raises(BadInput, match="holds 1 non-overlapping contacts"):
        small.surface_count(4)


def test_a_saved_run_contains_its_surface(tmp_path):
    measured = measured_case(tmp_path, 190, 310)
    solve_case(measured).save(tmp_path / "run.nc")
    (tmp_path / "map.txt").unlink()
    loaded = load_run(tmp_path / "run.nc").case
    assert loaded.surface_count() == 1
