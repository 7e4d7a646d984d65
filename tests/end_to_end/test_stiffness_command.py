"""`asperity machine --stiffness`: the table for rotor dynamics."""

import json

from support.bearings import BALLS


def test_the_table_has_a_row_for_each_point_of_the_study(tmp_path, asp):
    path = tmp_path / "machine.toml"
    path.write_text(BALLS, "utf-8")
    study = "study.machine.speed=['1000 r/min', '3000 r/min']".replace("'", '"')
    out = tmp_path / "bearing.csv"
    code, printed, _ = asp(
        *("machine", str(path), "--stiffness", str(out), "--set", study, "--json")
    )
    assert code == 0
    result = json.loads(printed)
    assert result["verdict"].endswith(" N s/m in 2 rows.")
    single = asp("machine", str(path), "--stiffness", str(tmp_path / "one.csv"), "--quiet")[1]
    assert " to " not in single
    assert single.rstrip().endswith("in 1 row.")
    assert [row["machine.speed"] for row in result["rows"]] == ["1000 r/min", "3000 r/min"]
    assert result["table"] == str(out)
    heading, *rows = out.read_text("utf-8").splitlines()
    assert heading == "machine.speed,frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy"
    assert len(rows) == 2
    slow, fast = result["rows"]
    assert fast["kxx"] < slow["kxx"]  # the film grows
    code, _, err = asp("machine", str(path), "--stiffness", str(tmp_path / "table.xlsx"))
    assert (code, "a stiffness table is saved as .csv, got table.xlsx" in err) == (2, True)
