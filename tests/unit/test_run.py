"""What a run works out beside the contact: friction, heat and stress, kept as maps and worked out
anew.
"""

from importlib.resources import files

import numpy as np
import pytest
import xarray

import asperity.results.run as results
from asperity import AsperityError, BadInput, Run, load_case, load_run, solve_case
from asperity.cli.contact import run_table
from asperity.core.quantities import NO_VALUE, catalogue, quantity
from asperity.coupling import contact_vibration
from asperity.report import write_report
from asperity.results import SHORT_GROUPS
from asperity.solution import OwnResonance, own_resonance

MASS = {"mass": "0.5 kg", "damping_ratio": 0.02, "duration": "0.1 s"}
SMALL = {"grid.cells": [48, 48], "vibration": "none", "surface.sq": "0.5 um"}


@pytest.fixture(scope="module")
def run() -> Run:
    return solve_case(
        load_case(files("asperity.paper").joinpath("paper.toml").read_text("utf-8")).with_overrides(
            SMALL
        )
    )


def test_scalars_state_friction_heat_and_stress(run):
    found, p_max = run.scalars(), run.state.p_max
    parts = found["friction_asperity_part"] + found["friction_oil_part"]
    assert found["friction_coefficient"] == pytest.approx(parts)
    assert found["friction_asperity_part"] == pytest.approx(0.15 * found["clr"])
    assert found["friction_power_w"] == pytest.approx(
        found["friction_coefficient"] * 500.0 * 0.2 * 1.91
    )
    assert 0.0 < found["flash_temperature_max_k"] < 200.0
    assert 0.3 * p_max < found["von_mises_max_pa"] < p_max
    assert 0.0 < found["von_mises_core_pa"] <= found["von_mises_max_pa"]
    assert found["von_mises_core_depth_m"] >= 0.1 * run.case.conditions.hertz.half_widths[0]
    assert (
        found["von_mises_max_pa"] / 2.0
        <= found["shear_stress_max_pa"]
        <= found["von_mises_max_pa"] / np.sqrt(3.0)
    )


def test_scalars_state_the_contacts_own_stiffness_and_damping(run):
    assert run.scalars()["contact_damping_ratio"] is None  # without [vibration] there is no mass
    assert "mass" in run.own_resonance_failure
    for model in ("unified", "mixed"):
        shaken = solve_case(run.case.with_overrides({"vibration": MASS, "model": model}))
        found, own = shaken.scalars(), own_resonance(shaken.solution, 0.5)
        omega = 2.0 * np.pi * found["contact_resonance_hz"]
        assert (
            found["contact_stiffness_n_m"]
            == own.elastic.stiffness
            == pytest.approx(0.5 * omega**2, rel=0.02)
        )
        assert found["contact_damping_ratio"] == pytest.approx(
            own.elastic.damping * omega / (2.0 * own.elastic.stiffness)
        )
        assert 0.0 < found["contact_damping_ratio"] < found["contact_damping_ratio_virgin"]
        assert found["contact_stiffness_virgin_n_m"] == own.virgin.stiffness < own.elastic.stiffness
        assert own.virgin.frequency_hz == own.elastic.frequency_hz
        assert shaken.own_resonance_failure is None


def test_the_deviation_of_damping_is_of_one_further_surface(run):
    """Student's prediction interval by hand, of three surfaces: t 2.92 at 95 %."""
    shaken = solve_case(run.case.with_overrides({"vibration": MASS}), surfaces=3)
    found = [row["contact_damping_ratio"] for row in (shaken.own_scalars, *shaken.others)]
    assert len(set(found)) == 3
    scalars = shaken.scalars()
    assert scalars["contact_damping_ratio"] == pytest.approx(np.mean(found))
    assert scalars["contact_damping_error"] == pytest.approx(
        2.91999 * np.sqrt(4.0 / 3.0) * np.std(found, ddof=1), rel=1e-5
    )
    assert (
        solve_case(run.case.with_overrides({"vibration": MASS})).scalars()["contact_damping_error"]
        is None
    )


def test_only_requested_quantities_are_computed(run, tmp_path, monkeypatch):
    """And what was not, on every surface, has no mean once a run is read back."""
    case = run.case.with_overrides({"vibration": MASS})
    whole = solve_case(case, surfaces=2)
    with monkeypatch.context() as patched:
        patched.setattr(
            OwnResonance, "virgin", property(lambda _: pytest.fail("shaken without being asked to"))
        )
        short = solve_case(case, surfaces=2, groups=SHORT_GROUPS)
        found = short.scalars()
        least = solve_case(case, surfaces=2, groups=())
        assert least.verdict() == whole.verdict()
    assert not {"clr", "crf_hz", "h_mean_m"} & set(least.scalars())
    virgin = {"contact_damping_ratio_virgin", "contact_stiffness_virgin_n_m"}
    assert set(whole.scalars()) - set(found) == virgin
    assert all(
        found[key] == value
        for key, value in whole.scalars().items()
        if key not in virgin | {"seconds"}
    )
    back = load_run(short.save(tmp_path / "short.nc"))
    assert back.scalars() | dict.fromkeys(virgin) == back.scalars()
    assert (
        back.own_scalars["contact_damping_ratio_virgin"]
        == whole.own_scalars["contact_damping_ratio_virgin"]
    )


def test_the_elastic_limit_remains_if_the_virgin_one_fails(run, monkeypatch):
    def lost(_):
        raise AsperityError("dynamic stiffness did not converge at 3000 Hz")

    monkeypatch.setattr(OwnResonance, "virgin", property(lost))
    found = solve_case(run.case.with_overrides({"vibration": MASS})).summary()
    assert found["contact_damping_ratio_virgin"] is None
    assert found["contact_damping_ratio"] > 0.0
    assert (
        "no stiffness of virgin roughness: dynamic stiffness did not converge at 3000 Hz."
        in found["notes"][-1]
    )


def test_each_surface_vibrates_once(run, monkeypatch):
    heard = []

    def listening(*contact, **solved):
        heard.append(contact)
        return contact_vibration(*contact, **solved)

    monkeypatch.setattr(results, "contact_vibration", listening)
    several = solve_case(run.case.with_overrides({"vibration": MASS}), surfaces=3)
    assert len(heard) == 3
    assert (
        several.vibration.resonance
        == contact_vibration(*heard[0], solution=several.solution).resonance
    )


def test_a_failed_dynamic_stiffness_is_stated_on_the_page(run, tmp_path):
    shaken = solve_case(
        run.case.with_overrides({"vibration": MASS, "model": "conserving", "surface": "flat"})
    )
    assert shaken.scalars()["contact_stiffness_n_m"] is None
    page = write_report([shaken], tmp_path / "page.html").read_text("utf-8")
    assert "No dynamic stiffness and damping: " in page
    assert "got conserving" in page


def test_a_film_too_hot_for_its_viscosity_is_remarked_on(run, monkeypatch):
    monkeypatch.setattr(results, "HOT", 1e3)
    assert run.remarks == run.notes
    monkeypatch.setattr(results, "HOT", 0.9 * run.heat.film_max_k)
    *notes, hot = run.remarks
    assert tuple(notes) == run.notes
    assert f"{run.heat.film_max_k:.4g} K" in hot


def test_the_traction_of_friction_is_part_of_the_stress(run):
    surface = run.stress.tensor_at(0.0)
    np.testing.assert_allclose(surface.xz, -run.friction.shear, atol=1e-3 * run.state.p_max)
    assert np.abs(run.friction.shear).max() > 0.1 * run.state.p_max


def test_a_kept_run_shows_its_maps_and_does_not_need_them(run, tmp_path):
    full, bare = run.save(tmp_path / "full.nc"), run.solution.save(tmp_path / "bare.nc")
    with xarray.open_dataset(full) as kept:
        for name, values in {
            "shear": run.friction.shear,
            "temperature_1": run.heat.surface_1,
            "temperature_2": run.heat.surface_2,
            "film_temperature": run.heat.film,
            "von_mises": run.stress.largest,
            "von_mises_depth": run.stress.depth_of_largest,
        }.items():
            np.testing.assert_allclose(
                kept[name], values, rtol=1e-6, atol=1e-6 * np.abs(values).max()
            )
            assert kept[name].attrs["units"] in ("Pa", "K", "m")
        np.testing.assert_allclose(
            kept["von_mises_section"].max(), run.stress.largest.max(), rtol=1e-6
        )
        np.testing.assert_array_equal(kept["depth"], run.stress.depths)
        for key, value in run.scalars().items():
            if isinstance(value, float):
                assert float(kept[key]) == value
                assert kept[key].attrs["units"] == quantity(key).unit
    assert load_run(full).scalars() == load_run(bare).scalars() == run.scalars()


def test_a_failure_of_friction_keeps_all_other_results(run, monkeypatch):
    def refuse(*_, **__):
        raise AsperityError("friction and temperature did not converge")

    monkeypatch.setattr(results, "friction_and_heat", refuse)
    apart = Run(case=run.case, solution=run.solution, state=run.state, vibration=None)
    found = apart.scalars()
    assert found["friction_coefficient"] is found["flash_temperature_max_k"] is None
    assert found["von_mises_max_pa"] > 0.0
    assert found["clr"] == run.scalars()["clr"]
    lines = list(run_table(apart))
    assert lines[-1] == "  note: no friction: friction and temperature did not converge"
    title = quantity("friction_coefficient").title
    assert (
        next(line for line in lines if line.startswith(f"  {title} "))
        .removeprefix(f"  {title}")
        .strip()
        == NO_VALUE
    )
    assert "shear" not in apart.to_dataset()


def test_the_command_line_prints_every_number_the_catalogue_has_for_a_table(run):
    rows = dict(line.strip().split("  ", 1) for line in run_table(run) if "  " in line.strip())
    shown = {title.strip(): value.strip() for title, value in rows.items()}
    values = run.scalars()
    deviations = {entry.deviation for entry in catalogue().values()}
    for key in values.keys() - deviations:
        entry = quantity(key)
        assert entry.detail or shown[entry.title] == entry.text_in(values)
    assert shown[quantity("p_max_pa").title] == f"{run.state.p_max / 1e9:.3f} GPa"


def test_one_line_of_the_catalogue_brings_a_number_wherever_numbers_are(run, tmp_path):
    slope, name = run.state.contact_slope, "mean slope of contact cells"
    assert run.scalars()["contact_slope"] == slope
    assert any(
        line.split("  ")[1:] and name in line and f"{slope:.3f}" in line for line in run_table(run)
    )
    kept = run.save(tmp_path / "run.nc")
    with xarray.open_dataset(kept, engine="h5netcdf") as dataset:
        assert float(dataset["contact_slope"]) == slope
        assert dataset["contact_slope"].attrs == {"long_name": name, "units": "1"}
    page = write_report([load_run(kept)], tmp_path / "run.html").read_text("utf-8")
    assert name.capitalize() in page
    assert f"{slope:.3f}" in page


@pytest.mark.parametrize("coefficient", [2.5, -0.1])
def test_a_boundary_friction_that_cannot_be_is_refused_before_the_solve(coefficient):
    case = load_case(files("asperity.paper").joinpath("paper.toml").read_text("utf-8"))
    with pytest.raises(BadInput, match="boundary_friction must be"):
        case.with_overrides({"material.boundary_friction": coefficient})
