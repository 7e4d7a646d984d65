"""Text exports of PCS tribometers, and sets of measurements that refer to them."""

import json
from pathlib import Path

import pytest

from asperity.benchmark import compare_experiments, load_experiments, read_tribometer
from asperity.cli import main
from asperity.core.errors import BadInput

FILMS = "\t".join(
    [
        *("Rolling Speed (mm/s)", "Average Film (nm)", "", "Rolling Speed (mm/s)"),
        *("Ball Load (N)", "Lube Temp (°C)", "Average Film (nm)", "Image file name"),
    ]
)
EXPORT = f"""EHS102 Test Data File
Output file name:\t
Lubricant name:\tFVA 3

Number of steps in profile:\t3
Test started at 02/05/2018 15:10:14

Step 1 started at 02/05/2018 15:10:20
Step type\tMAPPER\tStep description\tNew mapper step
Camera window load = 20.1 N

Step 2 "films" started at 02/05/2018 15:11:00
Step type\tFILM\tStep description\tNew film step\tStep duration\t00:05:00
{FILMS}
100.0\t180.1\t\t100.0\t20.01\t25.06\t180.1\ta.bmp
316.0\t\t\t316.0\t20.05\t25.10\t\tb.bmp
1000.0\t830.5\t\t1000.0\t19.98\t25.20\t830.5\tc.bmp

Step 3 started at 02/05/2018 15:20:00
Step type\tTRACTION\tStep description\tNew step
Step Time (s)\tTraction Coeff (-)\tRolling Speed (mm/s)
1\t0.0196\t200.0
2\t0.0233

All steps completed
"""


@pytest.fixture
def export(tmp_path):
    path = tmp_path / "test.txt"
    path.write_text(EXPORT, "utf-8")
    return path


def test_steps_and_their_tables(export):
    test = read_tribometer(export)
    assert test.facts == {"Lubricant name": "FVA 3", "Number of steps in profile": "3"}
    films, traction = test.steps
    assert (films.number, films.kind, films.description) == (2, "FILM", "New film step")
    assert list(films.table) == [
        *("Rolling Speed (mm/s)", "Average Film (nm)", "Ball Load (N)", "Lube Temp (°C)")
    ]
    assert films.table["Average Film (nm)"].dropna().tolist() == [180.1, 830.5]
    assert films.table["Ball Load (N)"].tolist() == [20.01, 20.05, 19.98]
    assert traction.number == 3
    assert traction.table["Traction Coeff (-)"].tolist() == [0.0196, 0.0233]
    assert traction.table["Rolling Speed (mm/s)"].isna().tolist() == [False, True]


def test_a_set_refers_to_an_export(export, capsys):
    source = Path(__file__).parents[2] / "benchmark" / "experiments" / "fva3-25c.toml"
    head, _, _ = source.read_text("utf-8").partition("columns = ")
    names = ["Rolling Speed (mm/s)", "Ball Load (N)", "Lube Temp (°C)", "Average Film (nm)"]
    columns = [
        *("contact.entrainment_speed [mm/s]", "contact.load [N]"),
        *("lubricant.temperature [degC]", "measured [nm]"),
    ]
    text = f"{head}columns = {json.dumps(columns)}\n"
    stated = {"file": "test.txt", "columns": names, "steps": [2]}
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in stated.items()]
    toml = export.with_name("set.toml")
    toml.write_text(f"{text}[export]\n" + "\n".join(lines) + "\n", "utf-8")
    (experiment,) = load_experiments(export.parent)
    assert [point.value for point in experiment.points] == [180.1e-9, 830.5e-9]
    assert experiment.points[1].conditions["contact.load"] == "19.98 N"
    result = compare_experiments(folder=export.parent)
    assert [row["ratio"] for row in result.rows()] == pytest.approx([1.06, 1.06], abs=0.08)
    with pytest.raises(SystemExit):
        main(["benchmark", "--against", "experiment", "--cases", str(export.parent), "--json"])
    assert json.loads(capsys.readouterr().out)["sets"][0]["points"] == 2
    toml.write_text(f"{text}[export]\n" + "\n".join(lines).replace("[2]", "[3]") + "\n", "utf-8")
    with pytest.raises(BadInput, match="points is empty"):
        load_experiments(export.parent)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not the text export of a PCS tribometer"),
        ("SLIM Mapper Analysis File\n", "is not the text export of a PCS tribometer"),
        ("MTM311 Test Data File\nStep 1 started at 1\nno table\n", "no step with a table"),
        ("MTM311 Test Data File\n", "no step with a table"),
    ],
)
def test_other_files_are_refused(tmp_path, text, message):
    path = tmp_path / "other.txt"
    path.write_text(text, "utf-8")
    with pytest.raises(BadInput, match=message):
        read_tribometer(path)


def test_a_missing_and_a_huge_file_are_refused(tmp_path, monkeypatch):
    with pytest.raises(BadInput, match="does not exist"):
        read_tribometer(tmp_path / "absent.txt")
    path = tmp_path / "huge.txt"
    path.write_text(EXPORT, "utf-8")
    monkeypatch.setenv("ASPERITY_MEMORY_GB", "1e-6")
    with pytest.raises(BadInput, match="of memory"):
        read_tribometer(path)
