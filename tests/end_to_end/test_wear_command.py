"""`asperity wear` from the command line."""

import json
import re
from pathlib import Path

import pandas
import pytest

WEAR = (Path(__file__).parents[2] / "examples" / "wear.toml").read_text("utf-8")
COARSE = (
    "--set",
    "grid.cells=[32, 16]",
    "--set",
    "surface.correlation_length='50 um'",
    "--set",
    "wear.patches=3",
    "--workers",
    "1",
)
KEYS = [
    *(
        "verdict",
        "hours",
        "overrollings",
        "worn_volume_m3",
        "worn_volume_interval_m3",
        "worn_depth_m",
        "volume_error",
        "balance_error",
    ),
    *(
        "jump_error",
        "jumps",
        "computed",
        "failed",
        "patches",
        "seconds",
        "folder",
        "table",
        "surfaces",
        "notes",
    ),
    *("sq_m", "clr", "car", "h_mean_m", "friction_coefficient", "crf_hz", "crfa"),
    *("clr_low", "clr_high", "crf_low_hz", "crf_high_hz", "stage", "report"),
    *("clr_mean_low", "clr_mean_high", "crf_mean_low_hz", "crf_mean_high_hz"),
]


@pytest.fixture
def worn_case(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wear.toml").write_text(WEAR, "utf-8")
    return tmp_path


def test_json_has_the_documented_keys(asp, worn_case, request):
    code, out, err = asp(
        "wear",
        "wear.toml",
        "--hours",
        "1",
        "--out",
        "worn",
        "--report",
        "w.html",
        "--json",
        *COARSE,
    )
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert sorted(result) == sorted(KEYS)
    assert result["hours"] == 1.0
    assert result["overrollings"] == pytest.approx([56.25 * 3600.0, 5.0 * 3600.0])
    assert result["balance_error"] < 1e-9
    table = pandas.read_parquet(result["table"])
    assert len(table) == result["jumps"] + 1
    for key in ("sq_m", "clr", "crf_hz"):
        assert result[key] == [table[key].iloc[0], table[key].iloc[-1]]
    assert [Path(name).is_file() for name in result["surfaces"]] == [True] * 4
    page = (worn_case / "w.html").read_text("utf-8")
    assert "Wear of a contact" in page
    shown = json.loads(page.split('id="data">')[1].split("</script>")[0])
    assert (
        len(shown["frames"]) == len(shown["captions"]) == result["jumps"] + 1
    )  # few enough that no frame is left out
    assert shown["captions"][-1].startswith("after 1 h, at ")
    again = json.loads(
        asp("wear", "wear.toml", "--hours", "1", "--out", "worn", "--json", *COARSE)[1]
    )
    assert again["computed"] == 0
    assert {key: again[key] for key in ("sq_m", "clr", "crf_hz")} == {
        key: result[key] for key in ("sq_m", "clr", "crf_hz")
    }
    request.getfixturevalue("blank_figures")  # those of w.html again
    code, out, _ = asp("report", "worn", "--json")
    assert code == 0
    assert json.loads(out)["wear"]["sq_m"] == result["sq_m"]
    assert (worn_case / "worn" / "report.html").is_file()


def test_the_verdict_comes_first_and_tables_follow(asp, worn_case):  # noqa: ARG001
    code, out, _ = asp("wear", "wear.toml", "--hours", "0.5", *COARSE)
    assert code == 0
    first, *rest = out.splitlines()
    assert first.startswith("After 0.5 h the bodies have worn by ")
    assert any(line.split() == ["new", "after", "0.5", "h"] for line in rest)
    assert "not determined" not in first
    assert re.search(r"worn by [\d.]+ nm and [\d.]+ nm: Sq", first)
    assert first.endswith("; 90 % intervals of the mean over positions.")
    assert re.search(r"CLR [\d.]+ to [\d.]+ % \([\d.]+ to [\d.]+ %\)", first)
    assert out.count("are not determined") == 1
    assert any(line.strip().startswith("wear volume") for line in rest)
    assert "  note: Only removal is modelled, no roughening." in rest


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--hours", "0"), "hours of wear must be positive"),
        (("--hours", "1", "--set", "wear=none"), "wear is left out; add [wear] with k"),
        (
            ("--hours", "1", "--set", "wear.k=hard"),
            'wear.k[0] must be a coefficient such as "1e-18 1/Pa", or one of mild',
        ),
        (
            ("--hours", "1", "--set", "wear.k=mild", "--set", "material.hardness=none"),
            "the case states no hardness",
        ),
        (
            ("--hours", "1", "--set", "wear.law=archrd"),
            "must be one of archard, energy, film-defect",
        ),
        (("--hours", "1", "--report", "w.txt"), "--report must be a file that ends in .html"),
    ],
)
def test_invalid_arguments_are_refused_in_one_sentence(asp, worn_case, arguments, words):
    code, out, err = asp("wear", "wear.toml", *arguments, "--out", "worn")
    assert (code, out) == (2, "")
    assert words in err
    assert len(err.splitlines()) == 1
    assert not (worn_case / "worn").exists()
