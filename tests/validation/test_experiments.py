"""asperity against experiment: mean and scatter of computed over measured values, as documented."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest

from asperity.benchmark import (
    Experiment,
    ExperimentResult,
    NotComputed,
    compare_with,
    load_experiments,
)
from asperity.benchmark.experiments import FIT_TOLERANCE
from asperity.cli import main
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.core.errors import BadInput
from asperity.ehl import inlet_heating_factor
from asperity.lubricant import (
    DowsonHigginson,
    ExponentialWarmth,
    Lubricant,
    Newtonian,
    Roelands,
    Thermal,
)

PAGE = Path(__file__).parents[2] / "docs" / "measured" / "experiment.md"
LOADED = load_experiments()
FILMS = Path(__file__).parents[1] / "reference" / "experiment_films.csv"
STORED = pandas.read_csv(FILMS)
SETS = {entry.name: entry for entry in LOADED if isinstance(entry, Experiment)}


@pytest.mark.parametrize("name", SETS)
def test_stored_values_agree_as_documented(name):
    """`asperity benchmark --against experiment --out FILMS` computes all of them again."""
    experiment, stored = SETS[name], STORED[STORED["experiment"] == name]
    assert [point.value for point in experiment.points] == pytest.approx(stored["measured"])
    assert [point.swept for point in experiment.points] == pytest.approx(stored["swept"])
    ratios = stored[["ratio", "isothermal_ratio"]].to_numpy()
    scatter, isothermal_scatter = np.std(ratios / ratios.mean(axis=0), axis=0)
    assert ratios[:, 0].mean() == pytest.approx(experiment.mean, abs=0.004)
    assert scatter == pytest.approx(experiment.scatter, abs=0.003)
    assert isothermal_scatter == pytest.approx(experiment.isothermal_scatter, abs=0.003)
    if experiment.fits_viscosity:  # that of the case
        assert abs(ratios[:, 0].mean() - 1.0) < FIT_TOLERANCE
    if name == "fva3-25c":
        low, high = (np.mean(stored[end] / stored["measured"]) for end in ("low", "high"))
        assert low < 1.0 < high
        assert experiment.scatter <= 0.027
        widths = (stored["high"] - stored["low"]) / stored["computed"]
        assert 0.15 < np.median(widths) < 0.25  # alpha to 20 %, and film ~ alpha^0.5


@pytest.mark.parametrize("name", SETS)
def test_computed_values_are_the_stored_ones(name):
    """At the ends of a set and in its middle."""
    stored = STORED[STORED["experiment"] == name]
    chosen = sorted({0, len(stored) // 2, len(stored) - 1})
    points = tuple(SETS[name].points[number] for number in chosen)
    comparison = compare_with(replace(SETS[name], points=points, fits_viscosity=False))
    known = stored["low"].notna().all()
    assert known == (name in ("fva3-25c", "fva3-54c", "unnamed-100c"))
    assert comparison.fitted_viscosity is None
    for point, (_, row) in zip(comparison.points, stored.iloc[chosen].iterrows(), strict=True):
        for key in ("ratio", "isothermal_ratio"):
            assert getattr(point, key) == pytest.approx(row[key], rel=1e-3)
        if known:
            assert (point.low, point.high) == pytest.approx((row["low"], row["high"]), rel=1e-2)


def test_the_page_states_every_set():
    """The title begins a row of its table, with the documented mean and scatter."""
    text = PAGE.read_text("utf-8")
    films = [experiment for experiment in SETS.values() if len(experiment.points) > 1]
    for experiment in films:
        (row,) = re.findall(rf"^\| {re.escape(experiment.title)}.*", text, re.MULTILINE)
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        assert cells[1] == str(len(experiment.points))
        assert float(cells[2].replace(",", "").split()[0]) == experiment.mean
        assert cells[3] == f"{100.0 * experiment.scatter:.1f} %"
        assert cells[4].endswith(f" {100.0 * experiment.isothermal_scatter:.1f} %")
        assert experiment.source.split(" (")[0].split(";")[0].removeprefix("github.com/") in text
    assert f"{sum(len(experiment.points) for experiment in films)} films in five sets" in text


def test_friction_of_a_growing_tribofilm_is_listed_as_not_computed():
    """Measured friction doubles at constant conditions."""
    (missing,) = [entry for entry in LOADED if isinstance(entry, NotComputed)]
    values = [point.value for point in missing.points]
    assert (len(values), values[0], values[-1]) == (24, 0.0588, 0.1176)
    result = ExperimentResult((), (), (missing,))
    assert result.verdict().startswith("Not computed: Friction while a tribofilm grows (24 values")
    assert result.scalars()["not_computed"][0]["measured"] == values
    assert f"| {values[0]:.3f} |" in PAGE.read_text("utf-8")


def test_a_change_of_the_film_by_a_percent_is_detected():
    """The tolerances see a film that is thicker by 1 %, or a fitted viscosity by 2 %."""
    comparison = compare_with(replace(SETS["fva3-25c"], points=SETS["fva3-25c"].points[:3]))
    moved = [replace(point, computed=1.01 * point.computed) for point in comparison.points]
    assert abs(replace(comparison, points=tuple(moved)).mean - comparison.mean) > 0.004


def test_the_factor_for_inlet_heat():
    """Values worked out by hand from Gupta et al. (1992); no heat at rest, more with sliding."""
    oil = Lubricant(
        viscosity=Roelands(0.1, 20e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
    )
    thermal = Thermal(warmth=ExponentialWarmth(0.05), oil_conductivity=0.125)

    def factor(speed, slip=0.0):
        conditions = ContactConditions(
            pair=ElasticPair((206e9, 206e9), (0.3, 0.3)),
            geometry="point",
            radius=0.01,
            load=20.0,
            surface_speeds=(speed * (1.0 + slip / 2.0), speed * (1.0 - slip / 2.0)),
        )
        ratio = conditions.hertz.p_max / conditions.pair.effective_modulus
        return inlet_heating_factor(conditions, oil, thermal), ratio

    found, ratio = factor(5.0)  # L = 0.1 * 0.05 * 25 / 0.125 = 1
    assert found == pytest.approx((1.0 - 13.2 * ratio) / 1.213, rel=1e-5)
    sliding, _ = factor(5.0, slip=1.0)
    assert sliding == pytest.approx((1.0 - 13.2 * ratio) / (1.0 + 0.213 * 3.23), rel=1e-5)
    assert factor(0.0)[0] == 1.0
    assert factor(1e-4)[0] == pytest.approx(1.0, abs=1e-3)
    speeds = [factor(speed)[0] for speed in (0.1, 0.5, 1.0, 3.0)]
    assert speeds == sorted(speeds, reverse=True)


def test_the_command_compares_a_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    source = Path(__file__).parents[2] / "benchmark" / "experiments"
    Path("sets").mkdir()
    text = (source / "fva3-25c.toml").read_text("utf-8")
    head, _, points = text.partition("points = [\n")
    few = head + "points = [\n" + "".join(points.splitlines(keepends=True)[:2]) + "]\n"
    Path("sets", "few.toml").write_text(few, "utf-8")
    arguments = ["benchmark", "--against", "experiment", "--cases", "sets", "--out", "a.csv"]
    with pytest.raises(SystemExit):
        main([*arguments, "--out", "a.png", "--json"])
    result = json.loads(capsys.readouterr().out)
    assert result["sets"][0]["points"] == 2
    assert result["rows"][0]["ratio"] == pytest.approx(1.02, abs=0.02)
    assert [Path(name).exists() for name in result["written"]] == [True, True]
    with pytest.raises(SystemExit) as end:
        main([*arguments, "--solver", "tamaas"])
    assert end.value.code == 2
    assert "compares asperity alone" in capsys.readouterr().err
    fitted = few.replace("fits_viscosity = false", "fits_viscosity = true")
    Path("sets", "few.toml").write_text(fitted.replace("[0.07135", "# [0.07135"), "utf-8")
    with pytest.raises(SystemExit) as end:
        main([*arguments[:5], "--json"])
    assert not end.value.code
    result = json.loads(capsys.readouterr().out)
    assert result["verdict"].startswith("1 measured values in 1 sets: largest scatter")
    assert result["sets"][0]["fitted_viscosity"] > 0.0
    assert result["sets"][0]["mean_interval"] is None
    with pytest.raises(SystemExit) as end:
        main([*arguments[:5], "--out", "a.png"])
    assert end.value.code == 2
    assert "a figure needs a set of two" in capsys.readouterr().err
    Path("sets", "few.toml").write_text(head + "points = []\n", "utf-8")
    with pytest.raises(BadInput, match="points is empty"):
        load_experiments(Path("sets"))
    Path("sets", "few.toml").write_text(few.replace("measured [nm]", "measured [um]"), "utf-8")
    with pytest.raises(BadInput, match=r"few\.toml is not a set of measurements"):
        load_experiments(Path("sets"))
    with pytest.raises(BadInput, match="contains no measurements"):
        load_experiments(tmp_path)
