"""Sensitivity: indices against functions whose own are known, ranges, and the real solver where
closed forms hold.
"""

import json
import math
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from asperity import load_case
from asperity.cli import main
from asperity.core.errors import AsperityError, BadInput
from asperity.study import ParameterRange, SensitivitySettings, global_sensitivity, sensitivity
from asperity.study.global_sensitivity import knee
from asperity.study.ranges import LENGTH_KEY, OPEN_RANGES, open_ranges, overrides_at, parse_range
from asperity.study.sensitivity_indices import indices, sample_design

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
SMALL = {"surface.correlation_length": "60 um", "vibration.duration": "1 s"}


@pytest.fixture(scope="module")
def paper():
    return load_case(PAPER)


@pytest.fixture
def threads():
    with ThreadPoolExecutor(1) as executor:
        yield executor


def test_sobol_indices_of_ishigami():
    """sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1: T. Ishigami, T. Homma, ISUMA '90, in closed form."""
    design = sample_design("sobol", 3, 2048)
    x = np.pi * (2.0 * design.shares - 1.0)
    found = indices(
        design, np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    )
    a, b = 7.0, 0.1
    first = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    second, mixed = a**2 / 8.0, 8.0 * b**2 * np.pi**8 / 225.0
    whole = first + second + mixed
    assert found["s1"] == pytest.approx([first / whole, second / whole, 0.0], abs=0.02)
    assert found["st"] == pytest.approx(
        [(first + mixed) / whole, second / whole, mixed / whole], abs=0.02
    )
    assert (
        np.abs(found["s1"] - [first / whole, second / whole, 0.0]) <= 2.0 * found["s1_conf"]
    ).all()


def test_morris_effects_of_a_line_are_its_slopes_and_of_a_product_scatter():
    design = sample_design("morris", 3, 40)
    line = indices(design, design.shares @ [2.0, -3.0, 0.0])
    assert line["mu"] == pytest.approx([2.0, -3.0, 0.0], abs=1e-12)
    assert line["mu_star"] == pytest.approx([2.0, 3.0, 0.0], abs=1e-12)
    assert line["sigma"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    product = indices(design, design.shares[:, 0] * design.shares[:, 1])
    # the other's place is 0, 1/3, 2/3 or 1, each as likely: mean 1/2, standard deviation sqrt(5)/6
    assert product["mu"][:2] == pytest.approx([0.5, 0.5], abs=0.1)
    assert product["sigma"][:2] == pytest.approx([math.sqrt(5) / 6] * 2, abs=0.05)


@pytest.mark.parametrize("method", ["morris", "sobol"])
def test_a_failed_point_takes_its_block_with_it_and_no_more(method):
    design = sample_design(method, 3, 16)
    outcome = design.shares @ [2.0, -3.0, 0.5]
    outcome[design.block + 1] = np.nan
    left = np.delete(np.arange(len(outcome)), np.arange(design.block, 2 * design.block))
    without = design._replace(shares=design.shares[left])
    for name, values in indices(design, outcome).items():
        assert values == pytest.approx(indices(without, outcome[left])[name], nan_ok=True)
    outcome[:: design.block] = np.nan
    with pytest.raises(AsperityError, match="too many contacts failed"):
        indices(design, outcome)


def test_an_outcome_that_nothing_moves_has_no_effects():
    design = sample_design("sobol", 2, 4)
    assert all(
        (values == 0.0).all() for values in indices(design, np.ones(len(design.shares))).values()
    )


def test_rounding_is_no_effect_and_counts_for_no_factor(paper, threads):
    dry = paper.with_overrides(
        {
            "surface.correlation_length": "30 um",
            "lubricant": "none",
            "grid.cells": [24, 24],
            "grid.x": [-1.9, 1.9],
            "vibration": "none",
        }
    )
    found = sensitivity(
        dry,
        settings=SensitivitySettings(
            vary=["contact.load=200 N..800 N"], size=2, sq=[1e-6], levels=0, cells=24
        ),
        executor=threads,
    )
    assert found.spread("clr at 1 um") == pytest.approx(
        (1.0, 1.0), abs=1e-12
    )  # all load on asperities, to rounding
    assert (found.ranking("clr at 1 um")["mu_star"] == 0.0).all()
    assert found.overall().sum() == pytest.approx(1.0)  # of CAR alone
    assert "CLR at Sq 1 um from 100 to 100 % (main factor: none of them)" in found.verdict()


def test_the_knee_of_a_broken_line_is_its_break():
    x = np.linspace(0.5, 4.0, 8)
    assert knee(x, 3.0 + 2.0 * x - 1.5 * np.maximum(x - 1.73, 0.0)) == pytest.approx(1.73, abs=0.02)
    assert math.isnan(knee(x, np.where(x > 1.0, x, np.nan)))


def test_ranges_are_read_and_gone_through():
    cap = parse_range("material.hardness=650 MPa..5 GPa")
    assert (cap.low, cap.high, cap.unit, cap.log) == (650.0, 5000.0, "MPa", True)
    assert cap.value(0.5) == pytest.approx(math.sqrt(650 * 5000), rel=1e-3)  # even in the logarithm
    assert cap.share(cap.value(0.25)) == pytest.approx(0.25, abs=1e-3)
    inlet = parse_range("grid.x[0]=-4.5..-1.9")
    assert (inlet.log, inlet.value(0.5), inlet.written(0.0)) == (False, -3.2, -4.5)
    assert cap.written(1.0) == "5000 MPa"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("material.hardness", "KEY=LOW..HIGH"),
        ("material.hardness=1 GPa..", "KEY=LOW..HIGH"),
        ("material.hardness=1 GPa..3 um", "must have the unit GPa"),
        ("material.hardness=3 GPa..1 GPa", "ascending range"),
        ("material.hardness=hard..harder", 'got "hard"'),
    ],
)
def test_what_is_no_range_is_refused_in_a_sentence(text, said):
    with pytest.raises(BadInput) as refused:
        parse_range(text)
    assert said in str(refused.value)


def test_a_moved_inlet_takes_its_cells_along(paper):
    case = paper.with_overrides({"grid.cells": [128, 96]})
    ranges = [ParameterRange("grid.x[0]", -4.5, -1.9)]
    spacings = []
    for share in (0.0, 0.37, 1.0):
        moved = case.with_overrides(overrides_at(case, ranges, [share]))
        assert moved.grid.cells[1] == 96
        assert moved.grid.upper == case.grid.upper
        spacings.append(moved.grid.spacing[0])
    assert spacings == pytest.approx([case.grid.spacing[0]] * 3, rel=0.01)
    assert moved.grid.lower[0] == pytest.approx(-1.9 * case.conditions.hertz.half_widths[0])


def test_only_what_the_case_has_is_varied_and_lengths_fit_its_grid(paper):
    every = [entry.key for entry in OPEN_RANGES]
    assert [entry.key for entry in open_ranges(paper)] == every
    dry = paper.with_overrides({"lubricant": "none", "vibration": "none"})
    gone = {"lubricant.viscosity.alpha", "vibration.cutoff_exponent", "vibration.cutoff_reference"}
    assert [entry.key for entry in open_ranges(dry)] == [key for key in every if key not in gone]
    small = paper.with_overrides({"grid.cells": [32, 32], "grid.y": [-0.6, 0.6]})
    lengths = next(
        entry for entry in open_ranges(small) if entry.key == "surface.correlation_length"
    )
    for share in (0.0, 1.0):
        for inlet in (-4.5, -1.9):
            small.with_overrides(
                {"surface.correlation_length": lengths.written(share), "grid.x": [inlet, 1.9]}
            ).surface()


@pytest.mark.parametrize("cells", [[32, 32], [40, 40], [52, 44], [64, 64]])
def test_no_length_of_a_carried_range_is_refused_for_its_rounding(cells):
    case = load_case(PAPER.with_name("ball-on-disc.toml")).with_overrides({"grid.cells": cells})
    ranges = open_ranges(case)
    for share in (0.0, 1.0):
        for inlet in np.linspace(0.0, 1.0, 7):
            shares = [
                {LENGTH_KEY: share, "grid.x[0]": inlet}.get(entry.key, 0.5) for entry in ranges
            ]
            case.with_overrides(overrides_at(case, ranges, shares)).surface()


def test_an_end_of_a_domain_that_the_case_leaves_to_be_chosen_is_not_varied():
    case = load_case(PAPER.with_name("data-sheet-oil.toml"))
    assert "grid.x[0]" not in [entry.key for entry in open_ranges(case)]


def test_ranges_of_which_nothing_would_be_left_are_refused_before_anything_is_solved(
    paper, monkeypatch
):
    def never(*_, **__):
        raise AssertionError("solved")

    monkeypatch.setattr("asperity.study.global_sensitivity.run_study", never)
    lengths = ParameterRange("surface.correlation_length", 1.0, 1.5, "um")  # on cells of 6 um
    with pytest.raises(
        BadInput, match=r"correlation length along x must be at least 2 cells.*; narrow the ranges"
    ):
        sensitivity(
            paper, settings=SensitivitySettings(vary=[lengths], sq=[1e-6], levels=0, cells=64)
        )


def test_why_contacts_failed_is_said_where_too_many_did(paper, threads, monkeypatch):
    kept = global_sensitivity.run_study

    def failing(plan, **options):
        result = kept(plan, **options)
        result.table.loc[1:, ["status", "reason"]] = "failed", "the roller is square"
        return result

    monkeypatch.setattr(global_sensitivity, "run_study", failing)
    hardness = ParameterRange("material.hardness", 1.0, 2.0, "GPa")
    case = paper.with_overrides({**SMALL, "lubricant": "none"})
    with pytest.raises(
        AsperityError, match="factors; the first: the roller is square; narrow the ranges"
    ):
        sensitivity(
            case,
            settings=SensitivitySettings(vary=[hardness], sq=[1e-6], levels=0, cells=32, size=2),
            executor=threads,
        )


def test_the_cutoff_moves_crfa_by_its_cube_and_nothing_else(paper, threads, tmp_path):
    """Noise of one height behind a second-order low pass far below the resonance: CRFA ~ fc³."""
    case = paper.with_overrides(SMALL)
    ranges = ["vibration.cutoff_reference=10 Hz..40 Hz", "material.hardness=0.7 GPa..3 GPa"]
    settings = SensitivitySettings(vary=ranges, size=3, sq=[1e-6, 3e-6], levels=0, cells=32)
    out = tmp_path / "study"
    found = sensitivity(case, settings=settings, out=out, executor=threads)
    assert found.factors == ("vibration.cutoff_reference", "material.hardness", "seed")
    effect = found.effects.set_index(["outcome", "factor"])["mu_star"]
    for sq in ("1 um", "3 um"):
        assert effect[f"car at {sq}", "vibration.cutoff_reference"] == 0.0
        assert effect[f"clr at {sq}", "vibration.cutoff_reference"] == 0.0
        cube = effect[f"log10_crfa at {sq}", "vibration.cutoff_reference"]
        assert cube == pytest.approx(3.0 * math.log10(4.0), abs=0.05)
        assert effect[f"car at {sq}", "material.hardness"] > 0.02
        assert effect[f"clr at {sq}", "seed"] > 1e-3
    assert found.ranking("car at 3 um")["factor"].iloc[0] != "vibration.cutoff_reference"
    assert found.effects.groupby("outcome")["share"].sum().to_numpy() == pytest.approx(
        np.ones(len(found.outcomes))
    )
    assert "vibration.cutoff_reference" in found.verdict()
    json.dumps(found.scalars(), allow_nan=False)

    again = sensitivity(case, settings=settings, out=out, executor=threads)  # from the folder
    assert again.result.computed == 0
    assert again.effects.equals(found.effects)


def test_the_seed_of_a_trajectory_changes_once(paper, threads):
    """Along a trajectory of Morris the surface changes at the seed's step and at no other."""
    found = sensitivity(
        paper.with_overrides({**SMALL, "vibration": "none"}),
        settings=SensitivitySettings(
            vary=["material.hardness=1 GPa..3 GPa"], size=4, sq=[2e-6], levels=0, cells=32
        ),
        executor=threads,
    )
    seeds = found.result.table["surface.seed"].to_numpy().reshape(4, 3)
    places = found.values["seed"].to_numpy().reshape(4, 3)
    assert ((np.diff(seeds) != 0) == (np.diff(places) != 0.0)).all()
    assert len(set(seeds.ravel())) == 8  # two surfaces a trajectory, none shared


def test_a_contact_without_a_resonance_counts_as_a_share_of_one_percent(paper, threads):
    case = paper.with_overrides({**SMALL, "contact.entrainment_speed": "40 m/s"})
    found = sensitivity(
        case,
        settings=SensitivitySettings(
            vary=["vibration.cutoff_reference=20 Hz..40 Hz"],
            size=2,
            sq=[0.1e-6],
            levels=0,
            cells=32,
        ),
        executor=threads,
    )
    assert found.full_film_share == 1.0
    full = found.result.table["full_load_crf_hz"].iloc[0]
    assert found.values["crf_hz at 0.1 um"].to_numpy() == pytest.approx(full * 0.01 ** (1 / 6))
    assert (found.effects["mu_star"] == 0.0).all()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"method": "guess"}, "morris, sobol"),
        ({"method": "sobol", "size": 24}, "power of two, got 24"),
        ({"size": 1}, "trajectories must be 2 or more"),
        ({"vary": ["surface.sq=1 um..2 um"]}, "surface.sq cannot be varied"),
        ({"vary": ["surface.seed=1..9"]}, "surface.seed cannot be varied"),
        ({"vary": ["contact.load=100 N..200 N"] * 2}, "varied twice"),
        ({"vary": ["contact.laod=100 N..200 N"]}, "did you mean load"),
        ({"vary": ["contact.load=100 m..200 m"]}, "must be a force"),
        ({"vary": ["contact.load[0]=100 N..200 N"]}, "not an entry of the case"),
        ({"sq": []}, "at least one Sq"),
        ({"cells": 4}, "cells must be 8 or more"),
        ({"seeds": 0}, "seeds must be 1 or more"),
    ],
)
def test_what_cannot_be_asked_is_refused_in_a_sentence(paper, settings, said):
    with pytest.raises(BadInput) as refused:
        sensitivity(paper, settings=SensitivitySettings(**settings))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_without_salib_a_sentence_says_what_to_install(paper, monkeypatch):
    monkeypatch.setitem(sys.modules, "SALib", None)
    with pytest.raises(BadInput, match=r"needs SALib; pip install 'asperity\[study\]'"):
        sensitivity(paper)


def test_the_command_prints_its_verdict_first_and_draws(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    arguments = [
        "sensitivity",
        str(PAPER),
        "--vary",
        "material.hardness=1 GPa..3 GPa",
        "--trajectories",
        "2",
        "--sq",
        "1 um",
        "--levels",
        "0",
        "--cells",
        "32",
        "--workers",
        "1",
        "--set",
        "vibration.duration=1 s",
        "--set",
        "surface.correlation_length=60 um",
        "--out",
        "kept",
        "--figure",
        "effects.pdf",
    ]
    with pytest.raises(SystemExit) as end:
        main(arguments)
    out, err = capsys.readouterr()
    assert (end.value.code or 0, err) == (0, "")
    assert out.splitlines()[0].startswith("Over the ranges")
    assert Path("effects.pdf").read_bytes().startswith(b"%PDF")
    assert (
        Path("kept/effects.csv")
        .read_text("utf-8")
        .startswith("outcome,quantity,sq_m,factor,mu,mu_star")
    )
    with pytest.raises(SystemExit):
        main([*arguments, "--json"])
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] == out.splitlines()[0]
    assert {row["factor"] for row in said["outcomes"][0]["effects"]} == {
        "material.hardness",
        "seed",
    }


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--figure", "effects.svg"], ".png or .pdf"),
        (["--samples", "64"], "--samples does not apply to --method morris"),
        (["--method", "guess"], "--method must be morris or sobol"),
        (["--sq", "2 N"], "--sq must be a length"),
    ],
)
def test_the_command_refuses_in_one_line(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["sensitivity", str(PAPER), *arguments])
    out, err = capsys.readouterr()
    assert (end.value.code, out, err.count("\n")) == (2, "", 1)
    assert said in err
    assert not list(tmp_path.iterdir())
