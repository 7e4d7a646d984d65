"""Derived results of a run: friction, heat and stress, stored as maps and recomputed."""

from importlib.resources import files

import numpy as np
import pytest
import xarray

import asperity.results.run as results
from asperity import AsperityError, BadInput, Run, load_case, load_run, solve_case
from asperity.case import case_template
from asperity.cli.contact import CONVERGENCE, run_table
from asperity.core.quantities import NO_VALUE, catalogue, quantity
from asperity.coupling import contact_vibration
from asperity.report import write_report
from asperity.results import SHORT_GROUPS, lubrication
from asperity.solution import OwnResonance, own_resonance

MASS = {"mass": "0.5 kg", "damping_ratio": 0.02, "duration": "0.1 s"}
SMALL = {"grid.cells": [48, 48], "vibration": "none", "surface.sq": "0.5 um"} | {
    "contact.roughness": "standing"
}


@pytest.fixture(scope="module")
def run() -> Run:
    return solve_case(
        load_case(files("asperity.paper").joinpath("paper.toml").read_text("utf-8")).with_overrides(
            SMALL
        )
    )


def test_scalars_state_friction_heat_and_stress(run):
    scalars, p_max = run.scalars(), run.state.p_max
    parts = scalars["friction_asperity_part"] + scalars["friction_oil_part"]
    assert scalars["friction_coefficient"] == pytest.approx(parts)
    assert scalars["friction_asperity_part"] == pytest.approx(0.15 * scalars["clr"])
    assert scalars["friction_power_w"] == pytest.approx(
        scalars["friction_coefficient"] * 500.0 * 0.2 * 1.91
    )
    assert 0.0 < scalars["flash_temperature_max_k"] < 200.0
    assert 0.3 * p_max < scalars["von_mises_max_pa"] < p_max
    assert 0.0 < scalars["von_mises_core_pa"] <= scalars["von_mises_max_pa"]
    assert scalars["von_mises_core_depth_m"] >= 0.1 * run.case.conditions.hertz.half_widths[0]
    assert (
        scalars["von_mises_max_pa"] / 2.0
        <= scalars["shear_stress_max_pa"]
        <= scalars["von_mises_max_pa"] / np.sqrt(3.0)
    )


def test_scalars_state_the_contacts_own_stiffness_and_damping(run):
    assert run.scalars()["contact_damping_ratio"] is None  # without [vibration] there is no mass
    assert "mass" in run.own_resonance_failure
    for model in ("unified", "mixed"):
        vibrating = solve_case(run.case.with_overrides({"vibration": MASS, "model": model}))
        scalars, own = vibrating.scalars(), own_resonance(vibrating.solution, 0.5)
        omega = 2.0 * np.pi * scalars["contact_resonance_hz"]
        assert (
            scalars["contact_stiffness_n_m"]
            == own.elastic.stiffness
            == pytest.approx(0.5 * omega**2, rel=0.02)
        )
        assert scalars["contact_damping_ratio"] == pytest.approx(
            own.elastic.damping * omega / (2.0 * own.elastic.stiffness)
        )
        assert 0.0 < scalars["contact_damping_ratio"] < scalars["contact_damping_ratio_virgin"]
        assert (
            scalars["contact_stiffness_virgin_n_m"] == own.virgin.stiffness < own.elastic.stiffness
        )
        assert own.virgin.frequency_hz == own.elastic.frequency_hz
        assert vibrating.own_resonance_failure is None


def test_the_error_of_damping_is_the_prediction_interval_of_a_further_surface(run):
    """Student's prediction interval of three surfaces by hand: t = 2.92 at 95 %."""
    vibrating = solve_case(run.case.with_overrides({"vibration": MASS}), surfaces=3)
    damping_ratios = [
        row["contact_damping_ratio"] for row in (vibrating.own_scalars, *vibrating.others)
    ]
    assert len(set(damping_ratios)) == 3
    scalars = vibrating.scalars()
    assert scalars["contact_damping_ratio"] == pytest.approx(np.mean(damping_ratios))
    assert scalars["contact_damping_error"] == pytest.approx(
        2.91999 * np.sqrt(4.0 / 3.0) * np.std(damping_ratios, ddof=1), rel=1e-5
    )
    assert (
        solve_case(run.case.with_overrides({"vibration": MASS})).scalars()["contact_damping_error"]
        is None
    )


def test_only_requested_quantities_are_computed(run, tmp_path, monkeypatch):
    """Quantities not computed on every surface have no mean in a stored run."""
    case = run.case.with_overrides({"vibration": MASS})
    complete = solve_case(case, surfaces=2)
    with monkeypatch.context() as patched:
        patched.setattr(
            OwnResonance, "virgin", property(lambda _: pytest.fail("computed without a request"))
        )
        short = solve_case(case, surfaces=2, groups=SHORT_GROUPS)
        scalars = short.scalars()
        minimal = solve_case(case, surfaces=2, groups=())
        assert minimal.verdict() == complete.verdict()
    assert not {"clr", "crf_hz", "h_mean_m"} & set(minimal.scalars())
    virgin = {"contact_damping_ratio_virgin", "contact_stiffness_virgin_n_m"}
    assert set(complete.scalars()) - set(scalars) == virgin
    assert all(
        scalars[key] == value
        for key, value in complete.scalars().items()
        if key not in virgin | {"seconds"}
    )
    loaded = load_run(short.save(tmp_path / "short.nc"))
    assert loaded.scalars() | dict.fromkeys(virgin) == loaded.scalars()
    assert (
        loaded.own_scalars["contact_damping_ratio_virgin"]
        == complete.own_scalars["contact_damping_ratio_virgin"]
    )


def test_the_elastic_limit_remains_if_the_virgin_one_fails(run, monkeypatch):
    def fail(_):
        raise AsperityError("dynamic stiffness did not converge at 3000 Hz")

    monkeypatch.setattr(OwnResonance, "virgin", property(fail))
    summary = solve_case(run.case.with_overrides({"vibration": MASS})).summary()
    assert summary["contact_damping_ratio_virgin"] is None
    assert summary["contact_damping_ratio"] > 0.0
    assert (
        "no stiffness of virgin roughness: dynamic stiffness did not converge at 3000 Hz."
        in summary["notes"][-1]
    )


def test_each_surface_vibrates_once(run, monkeypatch):
    calls = []

    def record_call(*contact, **solved):
        calls.append(contact)
        return contact_vibration(*contact, **solved)

    monkeypatch.setattr("asperity.results.solve.contact_vibration", record_call)
    several = solve_case(run.case.with_overrides({"vibration": MASS}), surfaces=3)
    assert len(calls) == 3
    assert (
        several.vibration.resonance
        == contact_vibration(*calls[0], solution=several.solution).resonance
    )


def test_a_failed_dynamic_stiffness_is_stated_on_the_page(run, tmp_path):
    vibrating = solve_case(
        run.case.with_overrides({"vibration": MASS, "model": "conserving", "surface": "flat"})
    )
    assert vibrating.scalars()["contact_stiffness_n_m"] is None
    page = write_report([vibrating], tmp_path / "page.html").read_text("utf-8")
    assert "No dynamic stiffness and damping: " in page
    assert "got conserving" in page


def test_a_film_too_hot_for_its_viscosity_law_is_noted(run, monkeypatch):
    monkeypatch.setattr(results, "HOT", 1e3)
    assert run.remarks == run.notes
    monkeypatch.setattr(results, "HOT", 0.9 * run.heat.film_max_k)
    *notes, too_hot = run.remarks
    assert tuple(notes) == run.notes
    assert f"{run.heat.film_max_k:.4g} K" in too_hot


def test_friction_traction_contributes_to_the_stress(run):
    surface = run.stress.tensor_at(0.0)
    np.testing.assert_allclose(surface.xz, -run.friction.shear, atol=1e-3 * run.state.p_max)
    assert np.abs(run.friction.shear).max() > 0.1 * run.state.p_max


def test_a_stored_run_shows_its_maps_and_does_not_need_them(run, tmp_path):
    complete, solution_only = (
        run.save(tmp_path / "full.nc"),
        run.solution.save(tmp_path / "bare.nc"),
    )
    with xarray.open_dataset(complete) as dataset:
        for name, values in {
            "shear": run.friction.shear,
            "temperature_1": run.heat.surface_1,
            "temperature_2": run.heat.surface_2,
            "film_temperature": run.heat.film,
            "von_mises": run.stress.largest,
            "von_mises_depth": run.stress.depth_of_largest,
        }.items():
            np.testing.assert_allclose(
                dataset[name], values, rtol=1e-6, atol=1e-6 * np.abs(values).max()
            )
            assert dataset[name].attrs["units"] in ("Pa", "K", "m")
        np.testing.assert_allclose(
            dataset["von_mises_section"].max(), run.stress.largest.max(), rtol=1e-6
        )
        np.testing.assert_array_equal(dataset["depth"], run.stress.depths)
        for key, value in run.scalars().items():
            if isinstance(value, float):
                assert float(dataset[key]) == value
                assert dataset[key].attrs["units"] == quantity(key).unit
    assert load_run(complete).scalars() == load_run(solution_only).scalars() == run.scalars()


def test_a_friction_failure_keeps_all_other_results(run, monkeypatch):
    def refuse(*_, **__):
        raise AsperityError("friction and temperature did not converge")

    monkeypatch.setattr("asperity.results.derived.friction_and_heat", refuse)
    failed_run = Run(case=run.case, solution=run.solution, state=run.state, vibration=None)
    scalars = failed_run.scalars()
    assert scalars["friction_coefficient"] is scalars["flash_temperature_max_k"] is None
    assert scalars["von_mises_max_pa"] > 0.0
    assert scalars["clr"] == run.scalars()["clr"]
    lines = list(run_table(failed_run))
    assert lines[-1] == "  note: no friction: friction and temperature did not converge"
    title = quantity("friction_coefficient").title
    assert (
        next(line for line in lines if line.startswith(f"  {title} "))
        .removeprefix(f"  {title}")
        .strip()
        == NO_VALUE
    )
    assert "shear" not in failed_run.to_dataset()


def test_the_command_line_prints_every_table_quantity_of_the_catalogue(run):
    rows = dict(line.strip().split("  ", 1) for line in run_table(run) if "  " in line.strip())
    printed = {title.strip(): value.strip() for title, value in rows.items()}
    values = run.scalars()
    deviations = {entry.deviation for entry in catalogue().values()}
    for key in values.keys() - deviations - {*CONVERGENCE}:
        entry = quantity(key)
        assert entry.detail or printed[entry.title].startswith(entry.text_in(values))
    assert printed[quantity("h_central_m").title].endswith(", at one spot of the roughness")
    assert printed[quantity("p_max_pa").title] == f"{run.state.p_max / 1e9:.3f} GPa"


def test_one_catalogue_line_adds_a_number_everywhere(run, tmp_path):
    slope, name = run.state.contact_slope, "mean slope of contact cells"
    assert run.scalars()["contact_slope"] == slope
    assert any(
        line.split("  ")[1:] and name in line and f"{slope:.3f}" in line for line in run_table(run)
    )
    stored = run.save(tmp_path / "run.nc")
    with xarray.open_dataset(stored, engine="h5netcdf") as dataset:
        assert float(dataset["contact_slope"]) == slope
        assert dataset["contact_slope"].attrs == {"long_name": name, "units": "1"}
    page = write_report([load_run(stored)], tmp_path / "run.html").read_text("utf-8")
    assert name.capitalize() in page
    assert f"{slope:.3f}" in page


@pytest.mark.parametrize("coefficient", [2.5, -0.1])
def test_invalid_boundary_friction_is_refused_before_the_solve(coefficient):
    case = load_case(files("asperity.paper").joinpath("paper.toml").read_text("utf-8"))
    with pytest.raises(BadInput, match="boundary_friction must be"):
        case.with_overrides({"material.boundary_friction": coefficient})


@pytest.mark.parametrize(
    ("surface", "remedy"),
    [({}, 'contact.roughness = "running"'), ({"surface": "flat"}, "other grid.cells")],
)
def test_a_contact_that_does_not_converge_names_a_remedy(surface, remedy):
    overrides = {"solver.max_iterations": 1, "grid.cells": [128, 48], "solver.surfaces": 1}
    case = load_case(case_template("line")).with_overrides(
        {**overrides, "contact.roughness": "standing", "vibration": "none", **surface}
    )
    run = solve_case(case, strict=False)
    assert not run.converged
    assert run.notes[0].startswith("Not converged: ")
    assert run.notes[0].endswith(f"Try {remedy}.")


@pytest.mark.parametrize(
    ("clr", "name"),
    [
        (0.0, "Full film"),
        (0.0099, "Full film"),
        (0.01, "Mixed lubrication"),
        (0.8999, "Mixed lubrication"),
        (0.9, "Boundary lubrication"),
        (1.0, "Boundary lubrication"),
    ],
)
def test_full_film_ends_at_1_and_boundary_lubrication_begins_at_90_percent(clr, name):
    assert lubrication(clr, lubricated=True) == name
    assert lubrication(clr, lubricated=False) == "Dry contact"
