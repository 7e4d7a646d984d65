"""The commands of `asperity`, on the real solver and small grids."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import x3pio

from asperity import NotConverged, load_case, load_run, solve_case
from asperity.core.errors import BadInput
from asperity.paper import papers_case
from asperity.solution import OscillatingContact, OwnResonance
from asperity.surface import flat_surface

pytestmark = pytest.mark.usefixtures("two_passages", "blank_figures")

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = (EXAMPLES / "paper.toml").read_text("utf-8")
# keys of design.md, section 4: errors, load on capped oil, parts of friction, shear and the
# deviations of both
KEYS = [
    *("car", "car_error", "car_domain", "clr", "clr_error", "capped_oil_load_ratio"),
    *(
        "load_below_20nm",
        "load_below_50nm",
        "load_below_100nm",
        "load_below_200nm",
        "load_at_floor",
    ),
    *("cavitated_share", "oil_film_m", "sq_m", "contact_slope", "rms_slope"),
    *(
        "h_min_m",
        "h_min_error_m",
        "h_central_m",
        "h_central_error_m",
        "h_mean_m",
        "p_max_pa",
        "lambda_ratio",
    ),
    *("friction_coefficient", "friction_asperity_part", "friction_oil_part", "friction_power_w"),
    *(f"friction_{name}" for name in ("error", "oil_below", "oil_above", "heat_below")),
    *("friction_coefficient_low", "friction_coefficient_high"),
    *(f"rolling_friction_{name}" for name in ("coefficient", "force_n", "power_w")),
    *("flash_temperature_max_k", "film_temperature_max_k"),
    *("von_mises_max_pa", "von_mises_depth_m", "von_mises_core_pa", "von_mises_core_depth_m"),
    *("shear_stress_max_pa", "shear_stress_depth_m"),
    *("cells", "notes", "regime_card", "determined", "film_determined"),
    *(
        "converged",
        "iterations",
        "reynolds_residual",
        "load_error",
        "mass_flux_imbalance",
        "seconds",
    ),
    *("crf_hz", "crfa", "crf_std_hz", "crfa_std"),
    *(
        "contact_resonance_hz",
        "contact_stiffness_n_m",
        "contact_damping_ratio",
        "contact_damping_error",
    ),
    *("contact_stiffness_virgin_n_m", "contact_damping_ratio_virgin"),
    *("clr_low", "clr_high", "crf_low_hz", "crf_high_hz", "surfaces"),
    *(f"{film}_{end}_m" for film in ("h_min", "h_central") for end in ("low", "high")),
    *("clr_surfaces_error", "crf_error_hz", "crf_surfaces_error_hz", "crf_record_error_hz"),
    *("capacitance_f", "zone_capacitance_f", "contact_resistance_ohm"),
    *("ultrasonic_reflection", "interface_stiffness_n_m3"),
    *("snapshot_clr", "clr_std", "roughness", "verdict"),
]


def numbers(text: str) -> dict[str, float]:
    scalars = json.loads(text)
    return {key: value for key, value in scalars.items() if key not in ("seconds", "verdict")}


def test_json_has_the_documented_keys_and_stdout_nothing_else(asp):
    code, out, _ = asp("solve", "case.toml", "--json")
    assert code == 0
    assert sorted(json.loads(out)) == sorted(KEYS)
    assert json.loads(out)["converged"] is True
    assert json.loads(out)["sq_m"] == pytest.approx(1e-6)


def test_quantities_not_shown_are_not_computed(asp, monkeypatch):
    """The virgin contact's stiffness is in no short table and costs as much as the other limit."""
    expected = asp("solve", "case.toml")
    monkeypatch.setattr(
        OwnResonance,
        "virgin",
        property(lambda _: pytest.fail("the dynamic contact was solved unnecessarily")),
    )
    found = asp("solve", "case.toml")
    assert [line for line in found[1].splitlines() if " s" not in line] == [
        line for line in expected[1].splitlines() if " s" not in line
    ]
    monkeypatch.setattr(
        OscillatingContact,
        "resonance",
        lambda *_: pytest.fail("the dynamic contact was solved unnecessarily"),
    )
    assert asp("solve", "case.toml", "--quiet")[:2] == (0, f"{expected[1].splitlines()[0]}\n")


def test_the_verdict_comes_first_and_is_the_only_output_of_quiet(asp):
    code, out, _ = asp("solve", "case.toml", "--snapshot")
    assert code == 0
    scalars = json.loads(asp("solve", "case.toml", "--snapshot", "--json")[1])
    coarse = (
        "Grid too coarse, CLR not determined (3.3 cells along the correlation length in x, where 4"
        " are needed; "
    )
    unknown = "no coarser grid is available to estimate its error): "
    assert out.splitlines()[0].startswith(f"{coarse}{unknown}on this grid asperities carry ")
    assert (scalars["determined"], scalars["cells"]) == (False, [64, 64])
    assert f"{100 * scalars['clr']:.1f} % of the load (± not determined" in out.splitlines()[0]
    assert f"on {100 * scalars['car']:.1f} % of the Hertz zone" in out.splitlines()[0]
    assert f"resonance at {scalars['crf_hz']:.0f} Hz (± not determined" in out.splitlines()[0]
    assert "; snapshot of standing roughness, 90 % intervals" in out.splitlines()[0]
    quiet = asp("solve", "case.toml", "--snapshot", "--quiet")
    assert quiet[1:] == (out.splitlines()[0] + "\n", "")


def test_a_required_accuracy_sets_the_cells_and_keeps_the_domain(asp):
    quick = ("--surfaces", "1", "--set", "surface=flat", "--set", "vibration=none")
    coarser = json.loads(asp("solve", "case.toml", "--accuracy", "0.05", "--json", *quick)[1])
    finer = json.loads(asp("solve", "case.toml", "--accuracy", "0.005", "--json", *quick)[1])
    assert coarser["cells"][0] < finer["cells"][0] / 1.5
    assert coarser["determined"] is finer["determined"] is True
    assert coarser["h_central_m"] == pytest.approx(finer["h_central_m"], rel=0.05)
    card = finer["regime_card"]
    assert card["regime"] == "piezoviscous-elastic"
    assert card["half_width_m"] == pytest.approx(55.93e-6, rel=1e-3)
    assert [fit["source"] for fit in card["fits"]] == ["Moes", "Dowson (1968)"]
    assert any("is starved" in note for note in finer["notes"])
    assert asp("solve", "case.toml", "--accuracy", "3")[:2] == (2, "")


def test_several_surfaces_are_solved_and_stored(asp):
    quick = ("--set", "grid.cells=[48, 48]", "--set", "vibration.duration=0.2 s", "--snapshot")
    code, out, _ = asp("solve", "case.toml", "--surfaces", "2", "--out", "run.nc", "--json", *quick)
    assert code == 0
    assert json.loads(out)["surfaces"] == 2
    assert load_run("run.nc").summary() | {"verdict": json.loads(out)["verdict"]} == json.loads(out)
    # the number of surfaces is stated, too
    assert numbers(asp("solve", "run.nc", "--json")[1]) == numbers(out)
    code, out, _ = asp("solve", "case.toml", "--set", "solver={}", "--json", *quick)
    assert json.loads(out)["surfaces"] == 5
    assert asp("solve", "case.toml", "--surfaces", "0")[:2] == (2, "")


@pytest.mark.parametrize(
    ("arguments", "plain"),
    [
        (("solve", "case.toml", "--snapshot"), "(m/s^2)^2/Hz"),
        (("vibrate", "case.toml"), "damping ratio, zeta"),
        (("surface", "ring.x3p", "absent.x3p"), "arithmetic mean height, Sa"),
    ],
)
def test_a_terminal_without_unicode_shows_ascii_signs(asp, monkeypatch, arguments, plain):
    x3pio.write(
        "ring.x3p",
        np.random.default_rng(5).standard_normal((32, 48)) * 1e-6,
        x_scale=2e-6,
        y_scale=3e-6,
    )
    code, out, _ = asp(*arguments)
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    command = [sys.executable, "-m", "asperity", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, encoding="ascii", check=False)
    assert done.returncode == code
    assert plain in done.stdout
    assert "?" not in done.stdout
    assert len(done.stdout.splitlines()) == len(out.splitlines())


def test_solving_a_run_again_gives_the_same_numbers(asp):
    first = numbers(asp("solve", "case.toml", "--out", "run.nc", "--json")[1])
    assert load_run("run.nc").case == load_case("case.toml")
    Path("case.toml").unlink()
    assert numbers(asp("solve", "run.nc", "--json")[1]) == first
    assert load_run("run.nc").summary() | {"seconds": 0} == first | {"seconds": 0}


def test_a_run_on_a_measured_surface_does_not_need_its_file_again(asp):
    Path("maps").mkdir()
    heights = 1e-6 * np.random.default_rng(5).standard_normal((60, 40)).repeat(8, 0).repeat(8, 1)
    x3pio.write("maps/ring.x3p", heights.T, x_scale=2e-6, y_scale=2e-6)
    measured = ("solve", "case.toml", "--surface", "maps/ring.x3p")
    chosen = ("--set", "grid={}", "--set", "solver.running_cells=600")
    assert asp(*measured, *chosen, "--out", "running.nc", "--quiet")[0] == 0
    code, out, _ = asp(*measured, "--snapshot", "--out", "run.nc")
    assert code == 0
    assert "note: The preparation removed a quadratic form" in out
    first = load_run("run.nc")
    assert first.case.contents.surface.file == "maps/ring.x3p"
    Path("maps/ring.x3p").unlink()
    assert numbers(asp("solve", "run.nc", "--json")[1]) == {
        k: v for k, v in first.summary().items() if k != "seconds"
    }
    assert any("removed a quadratic form" in note for note in first.notes)
    assert (
        "note: The preparation removed a quadratic form"
        in asp("solve", "run.nc", "--out", "again.nc")[1]
    )
    assert load_run("again.nc").notes == first.notes
    # a running contact can be read and reported without its map, but solved only with it
    assert asp("report", "running.nc")[0] == 0
    code, _, err = asp("solve", "running.nc")
    assert (code, "maps/ring.x3p" in err) == (2, True)


@pytest.mark.parametrize(
    ("command", "solver"),
    [
        (["solve", "case.toml"], "results.solve_case"),
        (["study", "case.toml", "--out", "sweep"], "study.plan_study"),
        (["stribeck", "case.toml"], "results.stribeck_curve"),
        (["traction", "case.toml"], "results.traction_curve"),
        (["wear", "case.toml", "--hours", "1"], "simulation.run_wear"),
        (["infer", "--case", "case.toml", "--design", "0.3"], "inference.inference_setting"),
        (["machine", "machine.toml", "--dry-run"], "machines.machine_conditions"),
    ],
)
@pytest.mark.parametrize("snapshot", [True, False])
def test_roughness_moves_unless_a_snapshot_is_requested(
    asp, monkeypatch, command, solver, snapshot
):
    text = (EXAMPLES / "fzg-c.toml").read_text("utf-8")
    Path("machine.toml").write_text(text, "utf-8")
    captured = []

    def capture(chosen, *_, **__):
        captured.append(chosen)
        raise BadInput("captured")

    monkeypatch.setattr(f"asperity.{solver}", capture)
    assert asp(*command, *(["--snapshot"] if snapshot else []))[0] == 2
    (chosen,) = captured
    if command[0] == "machine":
        chosen = chosen.case(chosen.contacts[0])
    assert chosen.is_running is not snapshot


def test_set_changes_the_case(asp):
    code, out, _ = asp(
        "solve",
        "case.toml",
        "--set",
        "contact.load=250 N",
        "--set",
        "surface.seed=3",
        "--out",
        "run.nc",
    )
    assert code == 0
    assert "Saved in run.nc" in out
    run = load_run("run.nc")
    assert run.solution.conditions.load == 250.0
    assert run.case.contents.surface.seed == 3


def test_a_dry_smooth_contact_is_hertzian_and_has_all_load_on_asperities(asp):
    _, out, _ = asp(
        "solve", "case.toml", "--set", "lubricant=none", "--set", "surface=flat", "--json"
    )
    dry = json.loads(out)
    assert dry["clr"] == pytest.approx(1.0, abs=1e-3)
    assert dry["p_max_pa"] == pytest.approx(0.5691e9, rel=0.02)  # physics: p_h of the paper's case
    assert dry["lambda_ratio"] is None
    assert dry["crf_hz"] is None  # no roughness passes: no excitation


@pytest.mark.workers
def test_python_and_command_line_agree(asp, monkeypatch):
    """In this process, and with its further tracks in workers."""
    for module in ("results.running", "transient.running"):
        monkeypatch.setattr(f"asperity.{module}.PASSAGES", 6)  # as in the workers
    run = solve_case(load_case("case.toml"))
    assert {k: v for k, v in run.summary().items() if k != "seconds"} == numbers(
        asp("solve", "case.toml", "--json")[1]
    )


def test_a_case_without_vibration_has_no_resonance(asp):
    code, out, _ = asp("solve", "case.toml", "--set", "vibration=none", "--out", "run.nc")
    assert code == 0
    assert "vibration not requested" in out
    assert load_run("run.nc").scalars()["crf_hz"] is None
    assert asp("report", "run.nc")[0] == 0


def test_a_solve_that_does_not_converge_is_reported_and_stored(asp):
    code, out, err = asp(
        "solve", "case.toml", "--set", "solver.max_iterations=1", "--out", "run.nc"
    )
    assert code == 1
    assert out.startswith("NOT CONVERGED")
    assert err.startswith("error: not converged")
    assert "run.nc" in err
    stored = load_run("run.nc")
    assert not stored.solution.convergence.converged
    assert stored.scalars()["converged"] is False
    assert "Not converged" in stored.notes[0]
    with pytest.raises(NotConverged) as unfinished:
        solve_case(stored.case)
    assert unfinished.value.solution.attributes["case"] == stored.case.text


@pytest.mark.parametrize(
    ("words", "inside"),
    [([], "results.running.run_track"), (["--snapshot"], "results.solve.solve_thermal_contact")],
)
def test_ctrl_c_leaves_no_files(asp, monkeypatch, tmp_path, words, inside):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"asperity.{inside}", interrupted)
    code, out, err = asp("solve", "case.toml", "--out", "run.nc", *words)
    assert (code, out) == (1, "")
    assert err.startswith("error: interrupted")
    assert [entry.name for entry in tmp_path.iterdir()] == ["case.toml"]


def test_report_writes_a_page_of_one_run_or_several(asp):
    asp("solve", "case.toml", "--out", "run.nc", "--quiet")
    code, out, _ = asp("report", "run.nc")
    assert code == 0
    assert "run.html" in out
    code, out, _ = asp("report", "run.nc", "run.nc", "--out", "two.html", "--json")
    assert code == 0
    assert json.loads(out)["report"] == "two.html"
    assert all(Path(name).read_text("utf-8").startswith("<!") for name in ("run.html", "two.html"))


def test_surface_prints_its_parameters(asp):
    heights = np.random.default_rng(5).standard_normal((32, 48)) * 1e-6
    heights[:2] = np.nan
    x3pio.write("ring.x3p", heights.T, x_scale=2e-6, y_scale=3e-6)
    code, out, _ = asp("surface", "ring.x3p", "--out", "map.png", "--json")
    assert code == 0
    (found,) = json.loads(out)["files"]
    assert found["file"] == "ring.x3p"
    assert found["cells"] == [32, 48]
    assert found["pixel_m"] == pytest.approx([2e-6, 3e-6])
    assert found["missing"] == pytest.approx(2 / 32)
    assert found["sq_m"] == pytest.approx(1e-6, rel=0.1)
    assert Path("map.png").read_bytes().startswith(b"\x89PNG")
    assert asp("surface", "ring.x3p")[1].startswith("ring.x3p: Sq ")


def test_a_surface_on_another_grid_is_refused():
    case = load_case(PAPER)
    with pytest.raises(BadInput, match=r"case\.grid"):
        solve_case(case, surface=flat_surface(case.with_overrides({"grid.cells": [32, 32]}).grid))


def test_demo_runs_from_case_to_report(asp, monkeypatch):
    """On fewer cells than the paper's case; CI runs `make demo` on all."""
    few = {"grid.cells": [64, 64], "solver.running_cells": 400}
    fewer = papers_case().with_overrides(few).text
    assert papers_case().grid.cells == (256, 256)
    monkeypatch.setattr("asperity.paper.papers_text", lambda: fewer)
    code, out, _ = asp("demo", "--out", "shown")
    assert code == 0
    assert out.startswith("From Sq 0.5 µm to 3 µm the asperity load share changes from ")
    assert str(Path("shown", "report.html")) in out
    names = {"paper.toml", "report.html", "run-sq-0.5um.nc", "run-sq-1.5um.nc", "run-sq-3um.nc"}
    assert {entry.name for entry in Path("shown").iterdir()} == names
    runs = [load_run(f"shown/run-sq-{sq}um.nc") for sq in ("0.5", "1.5", "3")]
    assert [run.case.grid.cells for run in runs] == [(64, 64)] * 3
    shares = [run.state.clr for run in runs]
    assert shares == sorted(shares)


def test_new_writes_a_case_once(asp):
    code, output, _ = asp("new", "point")
    assert code == 0
    assert "point.toml" in output
    assert 'geometry = "point"' in Path("point.toml").read_text("utf-8")
    code, _, refused = asp("new", "point")
    assert code == 2
    assert "exists already" in refused
    assert asp("new", "sphere")[0] == 2
