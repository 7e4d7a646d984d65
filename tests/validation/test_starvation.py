"""Starved contacts: mass balance, flooded limit, published curve, repeated passes, reflow."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.controls import effort

from asperity.case import load_case, load_machine
from asperity.core.errors import BadInput, NotConverged
from asperity.ehl import InletLayer, Options, solve_contact
from asperity.results import load_run, solve_case
from asperity.solution import Reflow, deplete_track, levelled, oil_flow

EXAMPLES = Path(__file__).parents[2] / "examples"
PUBLISHED = 2.0, 5.0  # exponents of r/(1 + r^γ)^(1/γ), Chevalier et al. 1998 (recollected)


def contact(name, **overrides):
    case = load_case(EXAMPLES / f"{name}.toml").with_written(
        {"surface": "flat", "model": "conserving", "grid.x": [-4.5, 2.5], **overrides}
    )
    return case.conditions, case.lubricant, case.surface()


def conserving(layer=None):
    return Options(
        model="conserving", inlet_layer=None if layer is None else InletLayer.uniform(layer)
    )


def central(solution):
    middle = solution.gap.shape[1] // 2
    return float(solution.gap[np.argmin(np.abs(solution.grid.x)), middle])


def carried(conditions, lubricant, film):
    """Oil of a film in the contact, at ambient density."""
    dense, thin = lubricant.density(np.array([conditions.hertz.p_max, 0.0]))
    return film * float(dense / thin)


@pytest.fixture(scope="module")
def ball():
    parts = contact("ball-on-disc", **{"grid.cells": [96, 96], "grid.y": [-3, 3]})
    return (*parts, solve_contact(*parts, options=conserving()))


@pytest.fixture(scope="module")
def curve(ball):
    *parts, flooded = ball
    unit = carried(parts[0], parts[1], central(flooded))
    ratios = (20.0, 5.0, 2.0, 1.2, 1.0, 0.8, 0.5, 0.3)
    return {r: solve_contact(*parts, options=conserving(r * unit)) for r in ratios}


@pytest.mark.parametrize("share", [0.8, 0.7, 0.5, 0.2])
def test_a_line_contact_passes_all_the_oil_that_enters(share):
    """Nothing flows aside: the film is that of the layer, in the flooded one's place."""
    parts = contact("paper", **{"grid.cells": [128, 8], "grid.y": [-0.2, 0.2]})
    flooded = solve_contact(*parts, options=conserving())
    unit = carried(parts[0], parts[1], central(flooded))
    starved = solve_contact(*parts, options=conserving(share * unit))
    assert central(starved) / central(flooded) == pytest.approx(share, rel=0.005)
    flow = oil_flow(starved)
    speed, width = parts[0].entrainment_speed, parts[2].grid.extent[1]
    assert flow.entering == pytest.approx(share * unit * speed * width, rel=1e-6)
    assert flow.leaving == pytest.approx(flow.entering, rel=1e-6)
    assert flow.beside == 0.0
    # a free meniscus: cavitated ahead, full in the contact
    content = starved.oil.content[:, 4]
    assert content[0] < 0.2
    assert content[np.argmin(np.abs(starved.grid.x))] == 1.0


@pytest.mark.parametrize("share", [0.99, 0.96, 0.9, 0.05])
def test_a_line_contact_is_solved_just_short_of_flooded_and_nearly_dry(share):
    """Just short of flooded, the front drifts far ahead and slowly."""
    parts = contact("paper", **{"grid.cells": [96, 8], "grid.y": [-0.2, 0.2]})
    flooded = solve_contact(*parts, options=conserving())
    passed = float(flooded.oil.content[-1, 4] * flooded.gap[-1, 4])
    starved = solve_contact(*parts, options=conserving(share * passed))
    flow = oil_flow(starved)
    assert flow.leaving == pytest.approx(flow.entering, rel=1e-6)
    leaving = float(starved.oil.content[-1, 4] * starved.gap[-1, 4])
    assert leaving == pytest.approx(share * passed, rel=1e-6)
    assert central(starved) / central(flooded) == pytest.approx(share, rel=0.002)


@pytest.mark.parametrize("name", ["6206", "nu206"])
def test_a_rolling_bearing_is_solved_on_any_layer(name):
    """An ellipse far wider than long loses little aside: its film is that of a line contact."""
    machine = load_machine(EXAMPLES / f"{name}.toml")
    loaded = max(machine.contacts, key=lambda row: row.load)
    case = machine.case(loaded).with_written(
        {"surface": "flat", "model": "conserving", "grid.cells": [96, 64]}
    )
    parts = case.conditions, case.lubricant, case.surface()
    flooded = solve_contact(*parts, options=conserving())
    middle = flooded.gap.shape[1] // 2
    passed = float(flooded.oil.content[-1, middle] * flooded.gap[-1, middle])
    for share in (0.95, 0.7, 0.3, 0.1):
        starved = solve_contact(*parts, options=conserving(share * passed))
        assert abs(oil_flow(starved).imbalance) < 1e-6
        assert 0.97 * share < central(starved) / central(flooded) < 1.005 * share


def test_more_oil_than_a_line_contact_passes_floods_it():
    parts = contact("paper", **{"grid.cells": [128, 8], "grid.y": [-0.2, 0.2]})
    flooded = solve_contact(*parts, options=conserving())
    unit = carried(parts[0], parts[1], central(flooded))
    assert central(solve_contact(*parts, options=conserving(1.1 * unit))) == central(flooded)


def test_much_oil_is_the_flooded_contact(ball, curve):
    *_, flooded = ball
    assert central(curve[20.0]) == pytest.approx(central(flooded), rel=0.005)


def test_the_film_over_the_layer_follows_the_published_curve(ball, curve):
    *_, flooded = ball
    for r, solution in curve.items():
        found = central(solution) / central(flooded)
        low, high = (r / (1.0 + r**exponent) ** (1.0 / exponent) for exponent in PUBLISHED)
        assert 0.995 * low <= found <= 1.005 * high
        assert found == pytest.approx(r / (1.0 + r**3.7) ** (1.0 / 3.7), rel=0.04)


def test_oil_enters_leaves_and_passes_beside(ball, curve):
    *_, flooded = ball
    for solution in (flooded, *curve.values()):
        flow = oil_flow(solution)
        assert abs(flow.imbalance) < 1e-6
        assert flow.leaving == pytest.approx(
            flow.layer_behind.sum()
            * solution.grid.spacing[1]
            * solution.conditions.entrainment_speed,
            rel=1e-9,
        )
    assert oil_flow(flooded).beside > 0.5 * oil_flow(flooded).entering
    assert abs(oil_flow(curve[0.5]).beside) < 1e-6 * oil_flow(curve[0.5]).entering


def test_repeated_passes_thin_the_film_as_by_the_curve(ball):
    """r after n passes is r/(1 + n r^γ)^(1/γ), as each pass turns r into the film's share."""
    *parts, flooded = ball
    unit = carried(parts[0], parts[1], central(flooded))
    passes = list(deplete_track(*parts, options=conserving(unit), passes=6))
    shares = [central(entry.solution) / central(flooded) for entry in passes]
    assert [entry.number for entry in passes] == [1, 2, 3, 4, 5, 6]
    assert shares == sorted(shares, reverse=True)
    expected = [(1.0 + n) ** (-1.0 / 3.7) for n in range(1, 7)]
    assert shares == pytest.approx(expected, rel=0.06)
    # oil pushed aside stays on the track
    spacing = parts[2].grid.spacing[1]
    first = unit * spacing * (parts[2].grid.cells[1] - 2)
    last = oil_flow(passes[-1].solution).layer_behind.sum() * spacing
    assert last == pytest.approx(first, rel=1e-5)


def test_supply_between_passes_holds_the_film():
    parts = contact("ball-on-disc", **{"grid.cells": [48, 48], "grid.y": [-3, 3]})
    flooded = solve_contact(*parts, options=conserving())
    unit = carried(parts[0], parts[1], central(flooded))
    bleeding = Reflow(time=0.1, surface_tension=0.0, supply=0.3 * unit)
    dry, fed = (
        [
            central(p.solution)
            for p in deplete_track(*parts, options=conserving(unit), passes=5, reflow=reflow)
        ]
        for reflow in (None, bleeding)
    )
    assert fed[-1] > 1.1 * dry[-1]
    assert fed[0] == pytest.approx(dry[0], rel=1e-6)


def test_a_wavy_layer_levels_as_by_orchard():
    """Amplitude exp(-σ h³ k⁴ t/3η) on each body; the volume stays."""
    count = 400
    y = (np.arange(count) + 0.5) / count * 2e-3 - 1e-3
    k = 2.0 * math.pi / 1e-3
    layer = 2e-6 * (1.0 + 0.01 * np.cos(k * y))
    for time in (50.0, 500.0):
        reflow = Reflow(time=time, surface_tension=0.03)
        found = levelled(layer, y, 0.1, reflow)
        amplitude = 2.0 * np.mean((found / found.mean() - 1.0) * np.cos(k * y)) / 0.01
        expected = math.exp(-0.03 * (1e-6) ** 3 * k**4 * time / (3.0 * 0.1))
        assert amplitude == pytest.approx(expected, rel=1e-4)
        assert found.sum() == pytest.approx(layer.sum(), rel=1e-12)
    assert levelled(layer, y, 0.1, Reflow(time=1.0, surface_tension=0.0, supply=1e-7)) == (
        pytest.approx(layer + 1e-7, rel=1e-12)
    )


def test_a_starved_rough_contact_touches_more_and_is_stored(tmp_path):
    case = load_case(EXAMPLES / "paper.toml").with_written(
        {"model": "conserving", "grid.cells": [64, 64], "contact.roughness": "standing"}
    )
    flooded = solve_case(case, groups=())
    starved = solve_case(case.with_written({"inlet.layer": "0.3 um"}), groups=())
    assert starved.state.clr > flooded.state.clr + 0.05
    assert any("The inlet layer of 0.300 µm is 0.38 times" in note for note in starved.notes)
    assert not any("inlet layer" in note for note in flooded.notes)
    loaded = load_run(starved.save(tmp_path / "starved.nc"))
    assert loaded.solution.options == starved.solution.options
    assert oil_flow(loaded.solution).entering == pytest.approx(
        oil_flow(starved.solution).entering, rel=1e-9
    )


def test_running_roughness_is_starved_too():
    case = load_case(EXAMPLES / "paper.toml").with_written(
        {"model": "conserving", "grid.cells": [48, 48], "surface.correlation_length": "40 um"}
    )
    flooded, starved = (
        solve_case(entry, groups=())
        for entry in (case, case.with_written({"inlet.layer": "0.3 um"}))
    )
    assert starved.state.clr > flooded.state.clr + 0.05
    assert starved.state.h_mean < flooded.state.h_mean


def test_the_note_calls_a_line_contact_flooded_that_passes_less_than_the_layer():
    for name, layer, state in (
        ("paper", "0.9 um", "flooded"),
        ("paper", "0.7 um", "starved"),
        ("ball-on-disc", "0.04 um", "starved"),
        ("ball-on-disc", "0.2 um", "nearly flooded"),
    ):
        case = load_case(EXAMPLES / f"{name}.toml").with_written(
            {"model": "conserving", "inlet.layer": layer}
        )
        (note,) = (note for note in case.notes if note.startswith("The inlet layer of"))
        assert note.endswith(f"the contact is {state}.")


def test_a_layer_is_wider_or_narrower_along_the_track():
    layer = InletLayer((1e-7, 3e-7), (-1e-4, 1e-4))
    assert layer.thickness_at(np.array([-1.0, 0.0, 1.0])) == pytest.approx([1e-7, 2e-7, 3e-7])
    parts = contact("ball-on-disc", **{"grid.cells": [48, 48], "grid.y": [-3, 3]})
    skewed = InletLayer((1.2e-8, 1.6e-8), (-1e-4, 1e-4))
    solution = solve_contact(*parts, options=replace(conserving(), inlet_layer=skewed))
    flow = oil_flow(solution)
    assert flow.layer_before == pytest.approx(skewed.thickness_at(flow.y), rel=1e-6)
    assert abs(flow.imbalance) < 1e-6
    row = solution.gap[np.argmin(np.abs(solution.grid.x))]
    assert row[30] > row[17]  # more film where more oil enters


def test_unusable_layers_are_refused_in_one_sentence():
    with pytest.raises(BadInput, match='an inlet layer needs the model "conserving"'):
        Options(inlet_layer=InletLayer.uniform(1e-7))
    with pytest.raises(BadInput, match="inlet layer must be positive"):
        InletLayer.uniform(0.0)
    with pytest.raises(BadInput, match="a thickness for each place of an increasing y"):
        InletLayer((1e-7, 1e-7), (1.0, 0.0))
    with pytest.raises(BadInput, match="time between passes must be positive"):
        Reflow(time=0.0)
    with pytest.raises(BadInput, match="surface tension and supply must be 0 or more"):
        Reflow(time=1.0, supply=-1.0)
    parts = contact("ball-on-disc", **{"grid.cells": [32, 32], "grid.y": [-3, 3]})
    with pytest.raises(BadInput, match="needs options with an inlet layer"):
        next(deplete_track(*parts, options=conserving(), passes=2))
    mixed = solve_contact(*parts, options=Options())
    with pytest.raises(BadInput, match='the flow of oil needs the model "conserving"'):
        oil_flow(mixed)


def test_a_starved_contact_that_does_not_converge_is_loud():
    parts = contact("paper", **{"grid.cells": [96, 8], "grid.y": [-0.2, 0.2]})
    options = replace(conserving(0.2e-6), max_iterations=1)
    with pytest.raises(NotConverged, match="contact not solved") as raised:
        solve_contact(*parts, options=options)
    assert raised.value.solution.gap.shape == (96, 8)


def test_a_meniscus_does_without_short_time_steps():
    """318 Newton steps if time steps may be a twentieth as long as the first."""
    work = effort("starved rough line, 0.3 um")
    assert work.solved
    assert work.newton < 80
