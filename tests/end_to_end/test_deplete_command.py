"""`asperity deplete`: repeated passes over a track with little oil, of a contact and a machine."""

import json
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
CELLS = (
    "--set",
    "model=conserving",
    "--set",
    "grid.cells=[64, 64]",
    "--set",
    "grid.x=[-4, 2]",
    "--set",
    "grid.y=[-2.5, 2.5]",
)


@pytest.fixture
def ball(asp):
    def run(inlet, *words):
        text = (
            (EXAMPLES / "ball-on-disc.toml")
            .read_text("utf-8")
            .replace('"mixed"', '"conserving"', 1)
        )
        Path("ball.toml").write_text(text + inlet, "utf-8")
        code, out, err = asp("deplete", "ball.toml", *CELLS, "--json", *words)
        return code, json.loads(out) if code == 0 else err

    return run


def test_a_track_without_supply_thins_and_one_with_it_settles(ball):
    layer = '\n[inlet]\nlayer = "0.1 um"\n'
    code, alone = ball(layer, "--passes", "4")
    assert code == 0
    films = [row["h_central_m"] for row in alone["passes"]]
    assert films == sorted(films, reverse=True)
    assert alone["passes"][0]["layer_m"] == pytest.approx(1e-7)
    assert alone["share"] == pytest.approx(films[-1] / alone["h_central_flooded_m"])
    assert alone["interval_s"] is None
    fed = layer + 'interval = "10 ms"\nbleed = "20 nm"\n'
    code, supplied = ball(fed, "--passes", "4")
    assert code == 0
    assert supplied["share"] > alone["share"]
    assert supplied["passes"][1]["layer_m"] > alone["passes"][1]["layer_m"] + 15e-9


def test_the_contact_of_a_machine_passes_at_its_own_rate(asp):
    text = (EXAMPLES / "nu206.toml").read_text("utf-8")
    Path("bearing.toml").write_text(text + '\n[inlet]\nlayer = "0.2 um"\npasses = 2\n', "utf-8")
    words = (
        "--set",
        "model=conserving",
        "--set",
        "grid.cells=[128, 8]",
        "--set",
        "grid.y=[-0.2, 0.2]",
        "--json",
    )
    code, out, _ = asp("deplete", "bearing.toml", *words)
    result = json.loads(out)
    assert code == 0
    rate = 1.0 / result["interval_s"]
    assert 50.0 < rate < 1000.0  # of the inner ring's points under 13 rollers
    assert len(result["passes"]) == 2


@pytest.mark.parametrize(
    ("inlet", "message"),
    [
        ("", "depletion needs [lubricant] and [inlet]"),
        ('\n[inlet]\nlayer = "1 um"\nbleed = "1 nm"\n', "inlet.bleed needs the time"),
        ('\n[inlet]\nlayer = "1 um"\npasses = 0\n', "passes"),
    ],
)
def test_cases_without_passes_are_rejected(ball, inlet, message):
    code, err = ball(inlet)
    assert code == 2
    assert message in err
