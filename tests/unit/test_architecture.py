"""The page on the architecture names every room in its row, and every module in its room."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "asperity"
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")


def layers() -> list[set[str]]:
    """The rows that import-linter holds."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    rows = next(contract["layers"] for contract in contracts if contract["name"] == "Layers point downwards")
    return [{name.strip() for name in row.split("|")} for row in rows]


def rooms() -> list[tuple[int, str, str]]:
    """Row, room and what is said of it, as the page has them."""
    table = PAGE.split("## Rooms")[1].split("\n## ")[0]
    return [
        (int(row), room, text) for row, room, text in re.findall(r"^\| (\d+) \| `(\w+)/?` \| (.+) \|$", table, re.M)
    ]


def test_rooms_stand_in_the_rows_that_are_held():
    for number, names in enumerate(layers(), 1):
        assert {room for row, room, _ in rooms() if row == number} == names


def test_every_module_is_named_in_its_room():
    missing = [
        f"{room}/{module.name}"
        for _, room, text in rooms()
        for module in (PACKAGE / room).rglob("*.py")
        if room != "ehl" and module.stem not in ("__init__", room) and f"`{module.stem}`" not in text
    ]
    assert missing == []


def test_every_module_of_the_solver_is_named_in_its_layer():
    table = PAGE.split("Inside `ehl/`")[1].split("\n## ")[0]
    assert {module.stem for module in (PACKAGE / "ehl").glob("*.py")} - {"__init__"} <= set(
        re.findall(r"`(\w+)`", table)
    )


def test_every_folder_has_a_face_that_is_held():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    held = {name for contract in contracts for name in contract.get("protected_modules", ())}
    for face in PACKAGE.glob("*/__init__.pyi"):
        assert f"asperity.{face.parent.name}.*" in held
