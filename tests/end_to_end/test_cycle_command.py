"""`asperity cycle`: film, load share, friction and wear over a cycle, from the command line."""

import json
from functools import partial
from pathlib import Path

import pytest

from asperity.simulation.cycle.film import FILM_TOLERANCE, SmoothContact

EXAMPLES = Path(__file__).parents[2] / "examples"
OSCILLATION = '\n[cycle]\nkind = "oscillation"\nfrequency = "50 Hz"\ninstants = 2\n'
TABLE = """time_s,load_n,speed_first_m_s,speed_second_m_s,radius_m
0,300,1.5,1.0,0.005
0.002,500,2.0,1.5,0.006
0.004,300,1.5,1.0,0.005
"""


@pytest.fixture(autouse=True)
def coarse_film(monkeypatch):
    """Solve the smooth bodies on fewer cells and in longer time steps.

    test_cycles compares their films with others.
    """
    monkeypatch.setattr("asperity.simulation.cycle.film.MAX_LINE_CELLS", 128)
    monkeypatch.setattr("asperity.simulation.cycle.film.MAX_OUTPUTS", 80)
    monkeypatch.setattr(
        "asperity.simulation.cycle.run.SmoothContact",
        partial(SmoothContact, film_tolerance=10.0 * FILM_TOLERANCE),
    )


@pytest.fixture
def cycling(asp):
    def run(text, *words):
        Path("cycle.toml").write_text(Path("case.toml").read_text("utf-8") + text, "utf-8")
        return asp("cycle", "cycle.toml", *words)

    return run


def test_films_of_smooth_bodies_over_a_table(cycling):
    Path("cycle.csv").write_text(TABLE, "utf-8")
    code, out, _ = cycling(
        '\n[cycle]\nkind = "table"\nfile = "cycle.csv"\ninstants = 3\n',
        *("--set", "surface=flat", "--json"),
    )
    result = json.loads(out)
    assert code == 0
    assert result["h_min_low_m"] <= result["h_min_m"] <= result["h_min_high_m"]
    assert result["h_min_m"] == pytest.approx(min(row["h_min_m"] for row in result["film"]))
    assert {row["time_s"] for row in result["film"]} >= {0.0, 0.002}
    assert result["clr"] is None
    assert result["instants"][0]["h_min_steady_m"] == pytest.approx(
        result["instants"][0]["h_min_smooth_m"], rel=0.02
    )
    assert result["friction_energy_j"] > 0.0
    assert abs(result["load_error"]) < 1e-3
    assert "steady: " in result["verdict"]


def test_a_rough_contact_with_a_report(cycling):
    code, out, _ = cycling(
        OSCILLATION,
        *("--set", "solver.surfaces=2", "--set", 'wear.k="1e-17 1/Pa"', "--workers", "1"),
        *("--report", "cycle.html", "--figures", "figures"),
    )
    assert code == 0
    assert "asperities carry up to" in out.splitlines()[0]
    assert "Wear volume of the first body" in out or "wear volume of the first body" in out
    page = Path("cycle.html").read_text("utf-8")
    assert "A contact over a cycle" in page
    assert "The inlet is flooded at every instant" in page
    assert sorted(path.name for path in Path("figures").iterdir()) == [
        "captions.md",
        "cycle-175mm.pdf",
        "cycle-85mm.pdf",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "there is no cycle; add [cycle]"),
        ('\n[cycle]\nkind = "oscilation"\nfrequency = "50 Hz"\n', 'did you mean "oscillation"?'),
        ('\n[cycle]\nkind = "oscillation"\n', "cycle.frequency is missing"),
        ('\n[cycle]\nkind = "table"\nfile = "none.csv"\n', "none.csv"),
    ],
)
def test_cases_without_a_cycle_are_rejected(cycling, text, message):
    code, _, err = cycling(text)
    assert code == 2
    assert message in err


def test_a_machine_has_its_own_cycle(asp):
    Path("gear.toml").write_text((EXAMPLES / "fzg-c.toml").read_text("utf-8"), "utf-8")
    code, out, _ = asp(
        *("cycle", "gear.toml", "--set", 'surface={kind="flat"}', "--instants", "3", "--json")
    )
    result = json.loads(out)
    assert code == 0
    assert result["period_s"] == pytest.approx(2.484e-3, rel=1e-3)
    assert result["repeats"] is False
    first, last = result["film"][0], result["film"][-1]
    assert first["path_position_m"] < last["path_position_m"]
    # the squeeze hardly matters to a gear: within 3 % of the steady film at the pitch point
    pitch = result["instants"][1]
    assert pitch["h_min_smooth_m"] == pytest.approx(pitch["h_min_steady_m"], rel=0.03)
