"""Sensitivity: indices of functions with known ones, ranges, and the real solver in closed-form
cases.
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
    """sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1, closed form by T. Ishigami and T. Homma, ISUMA '90."""
    design = sample_design("sobol", 3, 2048)
    x = np.pi * (2.0 * design.shares - 1.0)
    sobol = indices(
        design, np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    )
    a, b = 7.0, 0.1
    first = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    second, mixed = a**2 / 8.0, 8.0 * b**2 * np.pi**8 / 225.0
    total = first + second + mixed
    assert sobol["s1"] == pytest.approx([first / total, second / total, 0.0], abs=0.02)
    assert sobol["st"] == pytest.approx(
        [(first + mixed) / total, second / total, mixed / total], abs=0.02
    )
    assert (
        np.abs(sobol["s1"] - [first / total, second / total, 0.0]) <= 2.0 * sobol["s1_conf"]
    ).all()


def test_morris_effects_of_a_plane_are_its_slopes_and_a_product_scatters():
    design = sample_design("morris", 3, 40)
    line = indices(design, design.shares @ [2.0, -3.0, 0.0])
    assert line["mu"] == pytest.approx([2.0, -3.0, 0.0], abs=1e-12)
    assert line["mu_star"] == pytest.approx([2.0, 3.0, 0.0], abs=1e-12)
    assert line["sigma"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    product = indices(design, design.shares[:, 0] * design.shares[:, 1])
    # the other factor takes 0, 1/3, 2/3 and 1 equally often: mean 1/2, standard deviation sqrt(5)/6
    assert product["mu"][:2] == pytest.approx([0.5, 0.5], abs=0.1)
    assert product["sigma"][:2] == pytest.approx([math.sqrt(5) / 6] * 2, abs=0.05)


@pytest.mark.parametrize("method", ["morris", "sobol"])
def test_a_failed_point_excludes_only_its_block(method):
    design = sample_design(method, 3, 16)
    outcome = design.shares @ [2.0, -3.0, 0.5]
    outcome[design.block + 1] = np.nan
    remaining = np.delete(np.arange(len(outcome)), np.arange(design.block, 2 * design.block))
    reduced = design._replace(shares=design.shares[remaining])
    for name, values in indices(design, outcome).items():
        assert values == pytest.approx(indices(reduced, outcome[remaining])[name], nan_ok=True)
    outcome[:: design.block] = np.nan
    with pytest.raises(AsperityError, match="too many contacts failed"):
        indices(design, outcome)


def test_a_constant_outcome_has_no_effects():
    design = sample_design("sobol", 2, 4)
    assert all(
        (values == 0.0).all() for values in indices(design, np.ones(len(design.shares))).values()
    )


def test_rounding_is_not_an_effect(paper, threads):
    dry = paper.with_overrides(
        {
            "surface.correlation_length": "30 um",
            "lubricant": "none",
            "grid.cells": [24, 24],
            "grid.x": [-1.9, 1.9],
            "vibration": "none",
        }
    )
    result = sensitivity(
        dry,
        settings=SensitivitySettings(
            vary=["contact.load=200 N..800 N"], size=2, sq=[1e-6], levels=0, cells=24
        ),
        executor=threads,
    )
    assert result.spread("clr at 1 um") == pytest.approx(
        (1.0, 1.0), abs=1e-12
    )  # all load on asperities, to rounding
    assert (result.ranking("clr at 1 um")["mu_star"] == 0.0).all()
    assert result.overall().sum() == pytest.approx(1.0)  # for CAR only
    assert "CLR at Sq 1 um from 100 to 100 % (main factor: none of them)" in result.verdict()


def test_the_knee_of_a_broken_line_is_its_break():
    x = np.linspace(0.5, 4.0, 8)
    assert knee(x, 3.0 + 2.0 * x - 1.5 * np.maximum(x - 1.73, 0.0)) == pytest.approx(1.73, abs=0.02)
    assert math.isnan(knee(x, np.where(x > 1.0, x, np.nan)))


def test_ranges_are_read_and_scanned():
    hardness = parse_range("material.hardness=650 MPa..5 GPa")
    assert (hardness.low, hardness.high, hardness.unit, hardness.log) == (
        650.0,
        5000.0,
        "MPa",
        True,
    )
    assert hardness.value(0.5) == pytest.approx(
        math.sqrt(650 * 5000), rel=1e-3
    )  # equal steps of the logarithm
    assert hardness.share(hardness.value(0.25)) == pytest.approx(0.25, abs=1e-3)
    inlet = parse_range("grid.x[0]=-4.5..-1.9")
    assert (inlet.log, inlet.value(0.5), inlet.written(0.0)) == (False, -3.2, -4.5)
    assert hardness.written(1.0) == "5000 MPa"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("material.hardness", "KEY=LOW..HIGH"),
        ("material.hardness=1 GPa..", "KEY=LOW..HIGH"),
        ("material.hardness=1 GPa..3 um", "must have the unit GPa"),
        ("material.hardness=3 GPa..1 GPa", "ascending range"),
        ("material.hardness=hard..harder", 'got "hard"'),
    ],
)
def test_an_invalid_range_is_refused_in_a_sentence(text, message):
    with pytest.raises(BadInput) as caught:
        parse_range(text)
    assert message in str(caught.value)


def test_a_longer_inlet_keeps_the_cell_size(paper):
    case = paper.with_overrides({"grid.cells": [128, 96]})
    ranges = [ParameterRange("grid.x[0]", -4.5, -1.9)]
    spacings = []
    for share in (0.0, 0.37, 1.0):
        varied = case.with_overrides(overrides_at(case, ranges, [share]))
        assert varied.grid.cells[1] == 96
        assert varied.grid.upper == case.grid.upper
        spacings.append(varied.grid.spacing[0])
    assert spacings == pytest.approx([case.grid.spacing[0]] * 3, rel=0.01)
    assert varied.grid.lower[0] == pytest.approx(-1.9 * case.conditions.hertz.half_widths[0])


def test_only_the_cases_own_keys_are_varied_and_lengths_fit_its_grid(paper):
    all_keys = [entry.key for entry in OPEN_RANGES]
    assert [entry.key for entry in open_ranges(paper)] == all_keys
    dry = paper.with_overrides({"lubricant": "none", "vibration": "none"})
    inapplicable = {
        "lubricant.viscosity.alpha",
        "vibration.cutoff_exponent",
        "vibration.cutoff_reference",
    }
    assert [entry.key for entry in open_ranges(dry)] == [
        key for key in all_keys if key not in inapplicable
    ]
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
def test_no_length_of_a_range_is_refused_for_rounding(cells):
    case = load_case(PAPER.with_name("ball-on-disc.toml")).with_overrides({"grid.cells": cells})
    ranges = open_ranges(case)
    for share in (0.0, 1.0):
        for inlet in np.linspace(0.0, 1.0, 7):
            shares = [
                {LENGTH_KEY: share, "grid.x[0]": inlet}.get(entry.key, 0.5) for entry in ranges
            ]
            case.with_overrides(overrides_at(case, ranges, shares)).surface()


def test_a_chosen_domain_end_is_not_varied():
    case = load_case(PAPER.with_name("data-sheet-oil.toml"))
    assert "grid.x[0]" not in [entry.key for entry in open_ranges(case)]


def test_ranges_without_valid_values_are_refused_before_solving(paper, monkeypatch):
    def fail_if_called(*_, **__):
        raise AssertionError("solved")

    monkeypatch.setattr("asperity.study.global_sensitivity.run_study", fail_if_called)
    lengths = ParameterRange("surface.correlation_length", 1.0, 1.5, "um")  # on cells of 6 um
    with pytest.raises(
        BadInput, match=r"correlation length along x must be at least 2 cells.*; narrow the ranges"
    ):
        sensitivity(
            paper, settings=SensitivitySettings(vary=[lengths], sq=[1e-6], levels=0, cells=64)
        )


def test_causes_of_failures_are_reported_if_too_many_fail(paper, threads, monkeypatch):
    run_study = global_sensitivity.run_study

    def run_with_failures(plan, **options):
        result = run_study(plan, **options)
        result.table.loc[1:, ["status", "reason"]] = "failed", "the roller is square"
        return result

    monkeypatch.setattr(global_sensitivity, "run_study", run_with_failures)
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


def test_the_cutoff_changes_crfa_by_its_cube_and_nothing_else(paper, threads, tmp_path):
    """Noise of equal height behind a second-order low pass far below the resonance: CRFA ~ fc³."""
    case = paper.with_overrides(SMALL)
    ranges = ["vibration.cutoff_reference=10 Hz..40 Hz", "material.hardness=0.7 GPa..3 GPa"]
    settings = SensitivitySettings(vary=ranges, size=3, sq=[1e-6, 3e-6], levels=0, cells=32)
    out = tmp_path / "study"
    result = sensitivity(case, settings=settings, out=out, executor=threads)
    assert result.factors == ("vibration.cutoff_reference", "material.hardness", "seed")
    effect = result.effects.set_index(["outcome", "factor"])["mu_star"]
    for sq in ("1 um", "3 um"):
        assert effect[f"car at {sq}", "vibration.cutoff_reference"] == 0.0
        assert effect[f"clr at {sq}", "vibration.cutoff_reference"] == 0.0
        cube = effect[f"log10_crfa at {sq}", "vibration.cutoff_reference"]
        assert cube == pytest.approx(3.0 * math.log10(4.0), abs=0.05)
        assert effect[f"car at {sq}", "material.hardness"] > 0.02
        assert effect[f"clr at {sq}", "seed"] > 1e-3
    assert result.ranking("car at 3 um")["factor"].iloc[0] != "vibration.cutoff_reference"
    assert result.effects.groupby("outcome")["share"].sum().to_numpy() == pytest.approx(
        np.ones(len(result.outcomes))
    )
    assert "vibration.cutoff_reference" in result.verdict()
    json.dumps(result.scalars(), allow_nan=False)

    reloaded = sensitivity(
        case, settings=settings, out=out, executor=threads
    )  # loaded from the folder
    assert reloaded.result.computed == 0
    assert reloaded.effects.equals(result.effects)


def test_the_seed_changes_once_per_trajectory(paper, threads):
    """Along a Morris trajectory the surface changes at the seed's step only."""
    result = sensitivity(
        paper.with_overrides({**SMALL, "vibration": "none"}),
        settings=SensitivitySettings(
            vary=["material.hardness=1 GPa..3 GPa"], size=4, sq=[2e-6], levels=0, cells=32
        ),
        executor=threads,
    )
    seeds = result.result.table["surface.seed"].to_numpy().reshape(4, 3)
    places = result.values["seed"].to_numpy().reshape(4, 3)
    assert ((np.diff(seeds) != 0) == (np.diff(places) != 0.0)).all()
    assert len(set(seeds.ravel())) == 8  # two surfaces per trajectory, none shared


def test_a_contact_without_resonance_counts_as_a_share_of_one_percent(paper, threads):
    case = paper.with_overrides({**SMALL, "contact.entrainment_speed": "40 m/s"})
    result = sensitivity(
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
    assert result.full_film_share == 1.0
    full_load_crf = result.result.table["full_load_crf_hz"].iloc[0]
    assert result.values["crf_hz at 0.1 um"].to_numpy() == pytest.approx(
        full_load_crf * 0.01 ** (1 / 6)
    )
    assert (result.effects["mu_star"] == 0.0).all()


@pytest.mark.parametrize(
    ("settings", "message"),
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
def test_an_impossible_analysis_is_refused_in_a_sentence(paper, settings, message):
    with pytest.raises(BadInput) as caught:
        sensitivity(paper, settings=SensitivitySettings(**settings))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_salib_names_the_package_to_install(paper, monkeypatch):
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
    ]
    with pytest.raises(SystemExit) as end:
        main(arguments)
    out, err = capsys.readouterr()
    assert (end.value.code or 0, err) == (0, "")
    assert out.splitlines()[0].startswith("Over the ranges")
    assert Path("kept/effects.png").read_bytes().startswith(b"\x89PNG")
    assert (
        Path("kept/effects.csv")
        .read_text("utf-8")
        .startswith("outcome,quantity,sq_m,factor,mu,mu_star")
    )
    with pytest.raises(SystemExit):
        main([*arguments, "--json"])
    output = json.loads(capsys.readouterr().out)
    assert output["verdict"] == out.splitlines()[0]
    assert {row["factor"] for row in output["outcomes"][0]["effects"]} == {
        "material.hardness",
        "seed",
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--samples", "64"], "--samples does not apply to --method morris"),
        (["--method", "guess"], "--method must be morris or sobol"),
        (["--sq", "2 N"], "--sq must be a length"),
    ],
)
def test_the_command_refuses_in_one_line(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["sensitivity", str(PAPER), *arguments])
    out, err = capsys.readouterr()
    assert (end.value.code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert not list(tmp_path.iterdir())
