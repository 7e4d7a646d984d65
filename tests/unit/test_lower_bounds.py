"""The lowest allowed versions are those in `lowest.txt`, which CI installs and tests."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_lowest_allowed_versions_are_tested():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = [entry for names in project["optional-dependencies"].values() for entry in names]
    allowed = {
        entry.partition(",")[0].replace(">=", "==") for entry in (*project["dependencies"], *extras)
    }
    pinned = re.findall(r"^[A-Za-z].*$", (ROOT / "lowest.txt").read_text("utf-8"), re.MULTILINE)
    assert allowed == set(pinned)
