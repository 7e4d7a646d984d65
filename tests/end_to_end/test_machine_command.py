"""`asperity machine`: conditions, solved contacts, stored results and refusals."""

import json
import shutil
from pathlib import Path

import pytest

from asperity.case import load_machine
from asperity.cli import main
from asperity.core.errors import BadInput
from asperity.machines import machine_conditions

EXAMPLES = Path(__file__).parents[2] / "examples"
CONDITIONS = [  # from design.md, section 9, and the bodies' names
    *(
        "name",
        "bodies",
        "position",
        "load_n",
        "line_load_n_m",
        "radius_m",
        "length_m",
        "u1_m_s",
        "u2_m_s",
    ),
    *("entrainment_m_s", "slide_to_roll", "p_hertz_pa", "overrolling_hz"),
]
SOLVED = [  # from the same section, with further keys of a solved contact
    *(
        "h_central_m",
        "lambda_ratio",
        "clr",
        "car",
        "friction_coefficient",
        "friction_coefficient_low",
        "friction_coefficient_high",
        "flash_temperature_max_k",
        "crf_hz",
    ),
    *("h_min_m", "determined", "p_max_pa", "friction_power_w"),
    *("rolling_friction_power_w", "von_mises_core_pa", "reason"),
    *(f"{film}_{end}_m" for film in ("h_min", "h_central") for end in ("low", "high")),
    *("clr_low", "clr_high", "crf_low_hz", "crf_high_hz", "surfaces"),
]
RATING = ["beyond", "formula", "key", "reason", "standard", "validity"]
KEYS = [
    "contacts",
    "frequencies",
    "notes",
    "ratings",
    "seconds",
    "stiffness_matrix",
    "verdict",
    "worst",
]
DISCS = """
[machine]
kind = "twin-disc"
radii = ["20 mm", "30 mm"]
speeds = ["1000 r/min", "500 r/min"]
load = "500 N"
length = "5 mm"
[material]
youngs_modulus = "206 GPa"
poisson_ratio = 0.3
[lubricant]
viscosity = { law = "barus", eta0 = "0.05 Pa s", alpha = "15 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.85 g/cm^3" }
rheology = "newtonian"
"""
QUICK = ("--workers", "1", "--set", "grid.cells=[48, 24]")


@pytest.fixture
def asp(tmp_path, monkeypatch, capsys):
    """Return a function that runs a command beside the examples: exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    for name in ("fzg-c", "nu206", "6206"):
        shutil.copy(EXAMPLES / f"{name}.toml", tmp_path)

    def run(*arguments):
        with pytest.raises(SystemExit) as end:
            main(arguments)
        captured = capsys.readouterr()
        return end.value.code or 0, captured.out, captured.err

    return run


@pytest.mark.parametrize(
    ("name", "contacts", "worst", "frequency"),
    [
        ("fzg-c", 7, "B", ("mesh_hz", 578.667)),
        ("nu206", 10, "roller 0, inner ring", ("bpfi_hz", 387.903)),
        ("6206", 10, "ball 0, inner ring", ("ftf_hz", 19.8234)),
    ],
)
def test_a_dry_run_gives_only_the_conditions(asp, name, contacts, worst, frequency):
    code, out, _ = asp("machine", f"{name}.toml", "--dry-run", "--json")
    result = json.loads(out)
    assert code == 0
    assert sorted(result) == KEYS
    assert [sorted(row) for row in result["contacts"]] == [sorted(CONDITIONS)] * contacts
    assert result["worst"] == worst
    assert result["frequencies"][frequency[0]] == pytest.approx(frequency[1], rel=1e-5)
    first = asp("machine", f"{name}.toml", "--dry-run")[1].splitlines()[0]
    assert first == result["verdict"]
    assert worst in first
    assert list(Path().glob("*")) == list(Path().glob("*.toml"))


def test_the_drawing_of_a_machine_is_written_as_a_figure(asp):
    code, out, _ = asp("machine", "6206.toml", "--dry-run", "--figures", "figures", "--json")
    assert (code, json.loads(out)["figures"]) == (0, "figures")
    assert {"machine-85mm.pdf", "machine-175mm.pdf", "captions.md"} <= {
        path.name for path in Path("figures").iterdir()
    }


def test_only_solving_needs_oil_and_roughness(asp):
    lines = Path("nu206.toml").read_text("utf-8").splitlines()
    Path("bare.toml").write_text(
        "\n".join(line for line in lines if line.startswith("machine")), "utf-8"
    )
    assert asp("machine", "bare.toml", "--dry-run")[0] == 0
    code, out, err = asp("machine", "bare.toml", "--out", "kept")
    assert (code, out) == (2, "")
    assert "add them, or use --dry-run" in err
    assert not Path("kept").exists()


@pytest.mark.usefixtures("blank_figures")
def test_every_contact_is_solved_and_stored_once(asp, monkeypatch):
    monkeypatch.setattr("asperity.machines.solve.solve_case", pytest.fail)  # the worst one again
    arguments = (
        "machine",
        "nu206.toml",
        *QUICK[:2],
        "--set",
        "grid.cells=[128, 24]",
        "--set",
        "surface=flat",
        "--out",
        "kept",
    )
    code, out, _ = asp(*arguments, "--json")
    assert code == 0
    result = json.loads(out)
    rows = {row["name"]: row for row in result["contacts"]}
    assert [sorted(row) for row in rows.values()] == [sorted(CONDITIONS + SOLVED)] * 10
    assert (
        rows["roller 1, inner ring"]["h_min_m"] == rows["roller 12, inner ring"]["h_min_m"]
    )  # the same contact
    films = [rows[f"roller {number}, inner ring"]["h_min_m"] for number in (0, 1, 2)]
    assert films == sorted(films)
    assert rows["roller 0, outer ring"]["h_min_m"] > films[0]  # of larger radius
    assert (result["worst"], rows["roller 0, inner ring"]["clr"]) == ("roller 0, inner ring", 0.0)
    assert json.loads(Path("kept/machine.json").read_text("utf-8")) == result
    assert [sorted(rating)[:-1] for rating in result["ratings"]] == [RATING] * 7
    page = Path("kept/machine.html").read_text("utf-8")
    assert result["verdict"].split(",")[0] in page
    assert 'href="worst.html"' in page
    assert "roller 0, inner ring: the worst contact" in Path("kept/worst.html").read_text("utf-8")
    opened = Path("kept/worst.nc").stat().st_mtime_ns
    parts = sorted(Path("kept/parts").glob("*.parquet"))
    times = [part.stat().st_mtime_ns for part in parts]
    parts[0].unlink()  # as if it had been killed before this contact
    again = json.loads(asp(*arguments, "--json")[1])
    assert again["contacts"] == result["contacts"]
    assert [part.stat().st_mtime_ns for part in parts[1:]] == times[
        1:
    ]  # the first part may be batched differently now
    assert Path("kept/worst.nc").stat().st_mtime_ns == opened
    code, _, err = asp(*arguments, "--set", "machine.radial_load=3 kN")
    assert code == 2
    assert "holds a study of another case" in err


@pytest.mark.usefixtures("short_tracks")
def test_a_contacts_interval_is_that_of_solve(asp):
    """The interval covers several tracks of one kind; `solve` alone would use more cells."""
    rough = (
        'surface = { kind = "gaussian", sq = "1.2 um", correlation_length = "20 um", seed = 3 }\n'
    )
    rest = "[grid]\ncells = [96, 48]\n[solver]\nsurfaces = 2\nrunning_cells = 800\n"
    Path("discs.toml").write_text(rough + DISCS + rest, "utf-8")
    (row,) = json.loads(asp("machine", "discs.toml", "--workers", "1", "--json")[1])["contacts"]
    assert (row["surfaces"], row["clr_low"] < row["clr"] < row["clr_high"]) == (2, True)
    discs = load_machine("discs.toml")
    Path("one.toml").write_text(discs.case(discs.contacts[0]).text, "utf-8")
    alone = json.loads(asp("solve", "one.toml", "--json")[1])
    for key in ("clr", "clr_low", "clr_high", "h_central_m", "friction_coefficient"):
        assert row[key] == pytest.approx(alone[key], rel=1e-6)


def test_a_contact_equals_the_result_of_solve(asp):
    """A gear contact entered as a single case has the machine's numbers."""
    changed = {"grid.cells": [48, 24], "surface": "flat"}
    gears = load_machine("fzg-c.toml").with_overrides(changed)
    tooth_contact = next(contact for contact in gears.contacts if contact.name == "D")
    arguments = ("machine", "fzg-c.toml", *QUICK, "--set", "surface=flat", "--json")
    row = next(row for row in json.loads(asp(*arguments)[1])["contacts"] if row["name"] == "D")
    Path("d.toml").write_text(gears.case(tooth_contact).text, "utf-8")
    alone = json.loads(asp("solve", "d.toml", "--json")[1])
    for key in ("h_central_m", "h_min_m", "friction_coefficient", "flash_temperature_max_k"):
        assert row[key] == pytest.approx(alone[key], rel=1e-9)
    slips = [gears.case(contact).contents.contact.slip for contact in gears.contacts]
    assert slips == pytest.approx([contact.slide_to_roll for contact in gears.contacts], abs=1e-9)


def test_sliding_keeps_its_sign(asp):
    rows = json.loads(asp("machine", "fzg-c.toml", "--dry-run", "--json")[1])["contacts"]
    assert [row["slide_to_roll"] > 0.0 for row in rows] == [
        False,
        False,
        False,
        False,
        True,
        True,
        True,
    ]
    for row in rows:
        assert row["slide_to_roll"] * row["entrainment_m_s"] == pytest.approx(
            row["u1_m_s"] - row["u2_m_s"]
        )


def test_unsolved_contacts_are_reported(asp):
    few = ("--set", "solver.max_iterations=1", "--set", "surface.correlation_length=60 um")
    code, out, err = asp("machine", "fzg-c.toml", *QUICK, *few, "--snapshot")
    assert code == 1
    assert "NOT SOLVED" in out.splitlines()[0]
    assert "of 7 contacts were not solved; the first: A: " in err


@pytest.mark.parametrize(
    ("name", "setting", "words"),
    [
        ("fzg-c", "machine.torqe=3 N m", "machine.torqe is not a known key; did you mean torque?"),
        ("fzg-c", "machine.kind=spur", 'did you mean "spur-gear"?'),
        ("fzg-c", "machine.kind=", "--set machine.kind= lacks a value after the equals sign"),
        ("fzg-c", "machine=7", "machine must be a table with the key kind, got 7"),
        ("fzg-c", "machine.speed=50 Hz", "not in r/min or rad/s"),
        ("fzg-c", "machine.speed=50 1/s", "not in r/min or rad/s"),
        ("fzg-c", "machine.teeth=[16, 24.5]", "machine.teeth[1] must"),
        ("fzg-c", "machine.torque=-3 N m", "machine.torque must be positive and finite"),
        ("fzg-c", "machine.centre_distance=90 mm", "jams the teeth"),
        ("fzg-c", "material=none", "material must be a table, got"),
        ("fzg-c", "lubricant.grade=VG 99", "grade must be an ISO viscosity grade"),
        (
            "fzg-c",
            "lubricant.temperature=170 degC",
            "temperature must lie between -20 and 150 degC",
        ),
        ("fzg-c", "lubricant.base=ester", "alpha is missing and is required for base ester"),
        ("fzg-c", "machine.profile_shift=[-0.6, 0.3]", "the teeth cannot mesh"),
        ("fzg-c", 'machine.tip_diameters=["74 mm", "110 mm"]', "the teeth lose contact"),
        ("fzg-c", "machine.centre_distance=80 mm", "the base circles overlap"),
        (
            "fzg-c",
            "rating.contamination=0.5",
            "rating.contamination does not apply to a spur-gear; leave it out",
        ),
        (
            "nu206",
            "rating.scuffing_stage=12",
            "rating.scuffing_stage does not apply to a cylindrical-roller-bearing",
        ),
        (
            "6206",
            "rating.contamination=50",
            "from 0 (severe contamination) to 1 (clean), got 50",
        ),
        (
            "fzg-c",
            "rating.fatigue_limit=3 MPa",
            "rating.fatigue_limit is not a known key; did you mean fatigue_limits",
        ),
        ("nu206", "machine.clearance=2 mm", "a twentieth of the roller"),
        ("nu206", "machine.radial_load=0 N", "unloads every roller"),
        ("nu206", "machine.radial_load=-4 kN", "must be finite and not negative"),
        (
            "6206",
            "machine.contact_angle=20 deg",
            "an angular-contact bearing comes apart under a radial_load of 2000 N",
        ),
        ("6206", "machine.tilt=level", 'machine.tilt must be an angle such as "20 deg"'),
        ("6206", "machine.tilt=free", None),
        ("nu206", "machine.tilt=free", "machine.tilt is not a known key"),
        ("6206", "contact.load=4 N", "a [machine] and a [contact]; leave one of them out"),
    ],
)
def test_bad_machines_are_refused_in_one_sentence(asp, name, setting, words):
    code, out, err = asp("machine", f"{name}.toml", "--dry-run", "--set", setting)
    if words is None:
        assert code == 0
        return
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert words in err


def test_a_machine_file_is_not_a_single_contact(asp):
    for command in ("solve", "run", "vibrate"):
        code, _, err = asp(command, "nu206.toml")
        assert code == 2
        assert "has a [machine] with several contacts; solve them with asperity machine" in err
    code, _, err = asp("study", "nu206.toml", "--dry-run")
    assert (code, "study is missing; add [study] with lists of values" in err) == (2, True)
    shutil.copy(EXAMPLES / "paper.toml", "paper.toml")
    assert "has no [machine]" in asp("machine", "paper.toml")[2]


def test_an_override_corrects_a_refused_file(asp):
    Path("discs.toml").write_text(DISCS.replace('"500 N"', '"-500 N"'), "utf-8")
    assert asp("machine", "discs.toml", "--dry-run")[0] == 2
    assert asp("machine", "discs.toml", "--dry-run", "--set", "machine.load=500 N")[0] == 0


def test_a_disc_may_be_at_rest(asp):
    Path("discs.toml").write_text(DISCS, "utf-8")
    out = asp(
        "machine",
        "discs.toml",
        "--dry-run",
        "--json",
        "--set",
        'machine.speeds=["1000 r/min", "0 r/min"]',
    )[1]
    (contact,) = json.loads(out)["contacts"]
    assert (contact["slide_to_roll"], contact["u2_m_s"], contact["overrolling_hz"][1]) == (
        2.0,
        0.0,
        0.0,
    )
    for speeds in ('["0 r/min", "0 r/min"]', '["-1 r/min", "3 r/min"]'):
        assert (
            asp("machine", "discs.toml", "--dry-run", "--set", f"machine.speeds={speeds}")[0] == 2
        )


def test_backward_slip_is_reported_or_refused(asp):
    Path("discs.toml").write_text(DISCS, "utf-8")
    for setting, words in (
        (
            'machine.speeds=["1000 r/min", "-500 r/min"]',
            "machine.speeds[1] must be finite and not negative",
        ),
        ("machine.slide_to_roll=0.1", "slide_to_roll follows from both speeds"),
        ("machine.entrainment_speed=2 m/s", "both are given; give one"),
    ):
        code, out, err = asp("machine", "discs.toml", "--dry-run", "--set", setting)
        assert (code, out) == (2, "")
        assert words in err
    slid = DISCS.replace(
        'speeds = ["1000 r/min", "500 r/min"]', 'entrainment_speed = "2 m/s"\nslide_to_roll = 2.2'
    )
    Path("discs.toml").write_text(slid, "utf-8")
    assert (
        "slide_to_roll must lie between -2 and 2, where one disc is at rest, got 2.2"
        in asp("machine", "discs.toml", "--dry-run")[2]
    )


def test_discs_from_python(tmp_path):
    path = tmp_path / "discs.toml"
    path.write_text(DISCS, "utf-8")
    (row,) = machine_conditions(load_machine(path)).rows
    assert (row["u1_m_s"], row["u2_m_s"]) == pytest.approx((2.0943951, 1.5707963))
    path.write_text(
        DISCS.replace('"1000 r/min"', '"104.71975512 rad/s"').replace("500 r/min", "500 rpm"),
        "utf-8",
    )
    assert machine_conditions(load_machine(path)).rows[0]["u1_m_s"] == pytest.approx(
        row["u1_m_s"], rel=1e-9
    )
    with pytest.raises(BadInput, match="length"):
        load_machine(path).with_overrides({"machine.crown_radius": "1 m"})
