"""Table [surface] of the case file: every kind of surface, and the errors for invalid ones."""

from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.results import solve_case
from asperity.surface import parameters

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
COARSE = {"grid.cells": [64, 64]}
KINDS = {
    "gaussian": {"correlation_length": ["40 um", "20 um"], "direction_deg": 30},
    "non-gaussian": {"correlation_length": "20 um", "skewness": -0.8, "kurtosis": 4},
    "self-affine": {"hurst": 0.8, "cutoffs": ["20 um", "100 um"]},
    "ground": {"groove_width": "30 um", "groove_length": "80 um", "direction_deg": 90},
    "sandblasted": {"crater_radius": "20 um"},
    "run-in": {"correlation_length": "20 um", "plateau_share": 0.4},
}


@pytest.fixture(scope="module")
def paper():
    return load_case(PAPER).with_overrides(COARSE)


def write_ring(folder, name="ring.x3p", seed=1):
    import x3pio

    heights = np.random.default_rng(seed).standard_normal((200, 220)).cumsum(0).cumsum(1)
    heights *= 1e-6 / heights.std()
    x3pio.write(folder / name, heights.T, x_scale=2e-6, y_scale=2e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_surface_is_generated_and_restated(paper, kind):
    case = paper.with_overrides(
        {"surface": {"kind": kind, "sq": "0.7 um", "seed": 3, **KINDS[kind]}}
    )
    assert case.surface().sq == pytest.approx(0.7e-6, rel=1e-9)
    restated = load_case(case.text, folder=case.folder)
    assert restated == case
    np.testing.assert_array_equal(restated.surface().heights, case.surface().heights)
    other = case.with_overrides({"surface.seed": 4})
    assert not np.allclose(other.surface().heights, case.surface().heights)


def test_a_sample_that_misses_its_correlation_lengths_is_noted(paper):
    notes = paper.with_overrides({"surface.correlation_length": ["150 um", "60 um"]}).surface_notes
    assert len(notes) == 1
    assert "150 x 60 um were requested" in notes[0]


def test_two_measured_surfaces_keep_their_speeds(paper, tmp_path):
    write_ring(tmp_path)
    write_ring(tmp_path, "roller.x3p", seed=2)
    text = paper.with_overrides(
        {
            "surface": {
                "file": "ring.x3p",
                "sq": "0.5 um",
                "second": {
                    "file": "roller.x3p",
                    "sq": "0.2 um",
                    "turn": True,
                    "l_filter": "0.2 mm",
                },
            }
        }
    ).text
    case = load_case(text, folder=tmp_path)
    composite = case.composite()
    assert composite.speeds == case.conditions.surface_speeds
    assert (composite.first.sq, composite.second.sq) == pytest.approx((0.5e-6, 0.2e-6))
    np.testing.assert_array_equal(composite.surface.heights, case.surface().heights)
    assert any("face down" in note for note in case.surface_notes)
    turned = "roller.x3p: The preparation turned the map by 90 degrees"
    assert any(note.startswith(turned) for note in case.surface_notes)
    assert paper.composite() is None


def test_turning_a_grooved_surface_aligns_its_grooves_with_rolling(paper, tmp_path):
    import x3pio

    grooves = 1e-6 * np.sin(np.arange(200) / 3.0)[:, None] * np.ones(220)
    x3pio.write(tmp_path / "ring.x3p", grooves.T, x_scale=2e-6, y_scale=2e-6)
    across = load_case(
        paper.with_overrides({"surface": {"file": "ring.x3p"}}).text, folder=tmp_path
    )
    along = across.with_overrides({"surface.turn": True})
    assert np.ptp(across.surface().heights, axis=1).max() < 1e-12  # constant along y
    assert np.ptp(along.surface().heights, axis=0).max() < 1e-12  # turned: constant along x
    assert along.surface().sq == pytest.approx(across.surface().sq, rel=0.1)


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        ({"kind": "grund"}, 'did you mean "ground"'),
        ({"kind": "ground", "sq": "1 um", "groove_width": "30 um"}, "groove_length is missing"),
        ({"file": "ring.x3p", "form": "sphere"}, "surface.form"),
        ({"file": "ring.x3p", "turn": 90}, "surface.turn"),
        ({"file": "ring.x3p", "pixel": "5"}, "without a unit"),
        (
            {"kind": "flat", "second": {"kind": "flat", "second": {"kind": "flat"}}},
            "surface.second.second would be a third",
        ),
        ({"kind": "flat", "second": {"kind": "grund"}}, 'did you mean "ground"'),
        (
            {"file": "ring.x3p", "second": {"fil": "x"}},
            "surface.second.fil is not a known key; did you mean file",
        ),
        (
            {
                "kind": "non-gaussian",
                "sq": "1 um",
                "correlation_length": "20 um",
                "skewness": -3,
                "kurtosis": 4,
            },
            "kurtosis must be above 1",
        ),
        (
            {"kind": "sandblasted", "sq": "1 um", "crater_radius": "1 um"},
            "crater_radius must lie between",
        ),
        (
            {"kind": "run-in", "sq": "1 um", "correlation_length": "20 um", "plateau_share": 1.5},
            "plateau_share must lie between 0 and 1",
        ),
        (
            {
                "kind": "gaussian",
                "sq": "1 um",
                "correlation_length": ["20 um", "5 um"],
                "direction_deg": 45,
            },
            "across it must be at least 2 cells",
        ),
    ],
)
def test_an_invalid_surface_is_refused(paper, surface, message):
    with pytest.raises(BadInput, match=message):
        paper.with_overrides({"surface": surface}).surface()


# Two bodies
# -------------------------------------------------------------------------------------------------

GROUND = {
    "kind": "ground",
    "sq": "0.3 um",
    "groove_width": "30 um",
    "groove_length": "80 um",
    "seed": 1,
}


def test_each_of_two_bodies_has_its_own_roughness_and_lay(paper):
    along = GROUND | {"second": GROUND | {"sq": "0.4 um", "direction_deg": 90}}
    case = paper.with_overrides({"surface": along})
    both = case.composite()
    assert (both.first.sq, both.second.sq) == pytest.approx((0.3e-6, 0.4e-6), rel=1e-6)
    assert both.speeds == case.conditions.surface_speeds
    slopes = [
        [
            np.abs(np.diff(body.heights, axis=axis)).mean() / case.grid.spacing[axis]
            for axis in (0, 1)
        ]
        for body in (both.first, both.second)
    ]
    assert slopes[0][1] > 1.5 * slopes[0][0]  # grooves along rolling
    assert slopes[1][0] > 1.3 * slopes[1][1]  # and across it
    combined = case.surface()
    assert combined.heights == pytest.approx(both.first.heights + both.second.heights[:, ::-1])
    assert any("ground (moving at" in note for note in case.surface_notes)
    assert load_case(case.text).surface().heights == pytest.approx(combined.heights)


def test_two_random_bodies_are_independent(paper):
    """Bodies of the same kind and seed are independent; a new seed of the first changes both."""
    gaussian = {"kind": "gaussian", "sq": "1 um", "correlation_length": "14 um", "seed": 4}
    case = paper.with_overrides({"surface": gaussian | {"second": gaussian}})
    both = case.composite()
    assert abs(np.corrcoef(both.first.heights.ravel(), both.second.heights.ravel())[0, 1]) < 0.1
    assert case.surface().sq == pytest.approx(2.0**0.5 * 1e-6, rel=0.1)
    other = case.with_overrides({"surface.seed": 5}).composite()
    assert abs(np.corrcoef(both.second.heights.ravel(), other.second.heights.ravel())[0, 1]) < 0.1
    assert case.surface_count(3) == 3
    third = case.on_surface(2).contents.surface
    assert (third.seed, third.second.seed) == (6, 6)


def test_a_flat_body_beside_a_rough_one_changes_nothing(paper):
    gaussian = {"kind": "gaussian", "sq": "1 um", "correlation_length": "14 um", "seed": 4}
    single = paper.with_overrides({"surface": gaussian})
    with_flat = paper.with_overrides({"surface": gaussian | {"second": {"kind": "flat"}}})
    assert np.array_equal(single.surface().heights, with_flat.surface().heights)
    assert with_flat.surface_count(3) == 3
    smooth = paper.with_overrides({"surface": {"kind": "flat", "second": {"kind": "flat"}}})
    assert smooth.surface_count(3) == 1
    swapped = paper.with_overrides({"surface": {"kind": "flat", "second": gaussian}})
    assert swapped.surface().sq == pytest.approx(1e-6, rel=1e-6)
    assert swapped.surface_count(3) == 3


def test_the_automatic_grid_resolves_both_bodies(paper):
    """The finer roughness determines the number of cells."""
    coarse = {"kind": "gaussian", "sq": "1 um", "correlation_length": "40 um"}
    fine = {"kind": "gaussian", "sq": "0.2 um", "correlation_length": "6 um"}
    cells = [
        paper.with_overrides({"grid": {}, "surface": surface}).grid.cells
        for surface in (coarse, coarse | {"second": fine})
    ]
    assert cells[1][0] > 1.5 * cells[0][0]


def test_two_random_bodies_move_at_their_own_speeds(paper):
    gaussian = {"kind": "gaussian", "sq": "1 um", "correlation_length": "20 um", "seed": 4}
    case = paper.with_overrides({"surface": gaussian | {"second": gaussian | {"sq": "0.5 um"}}})
    moving = case.moving_surfaces()
    assert (moving.first.sq, moving.second.sq) == pytest.approx((1e-6, 0.5e-6), rel=1e-3)


def test_a_solve_computes_the_correlation_lengths_of_a_surface_once(monkeypatch):
    calls = []
    autocorrelation = parameters._autocorrelation
    monkeypatch.setattr(
        parameters, "_autocorrelation", lambda *args: calls.append(1) or autocorrelation(*args)
    )
    case = load_case(PAPER).with_overrides(
        {"grid.cells": [32, 24], "surface.correlation_length": "40 um"}
    )
    run = solve_case(case, surfaces=2)
    assert run.determined in (True, False)
    assert len(calls) == 2
