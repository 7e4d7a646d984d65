"""The architecture page lists every package in its layer and every solver module."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "asperity"
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")


def layers() -> list[set[str]]:
    """Layers enforced by import-linter."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    rows = next(
        contract["layers"] for contract in contracts if contract["name"] == "Layers point downwards"
    )
    return [{name.strip() for name in row.split("|")} for row in rows]


def listed_packages() -> list[tuple[int, str, str]]:
    """Layer, package and description from the page."""
    table = PAGE.split("## Rooms")[1].split("Inside `ehl/`")[0]
    return [
        (int(row), room, text)
        for row, room, text in re.findall(r"^\| (\d+) \| `(\w+)/?` \| (.+) \|$", table, re.M)
    ]


def test_packages_are_listed_in_their_enforced_layers():
    for number, names in enumerate(layers(), 1):
        assert {room for row, room, _ in listed_packages() if row == number} == names


def test_every_module_of_the_solver_is_listed():
    table = PAGE.split("Inside `ehl/`")[1].split("\n## ")[0]
    inside = {path.stem for path in (PACKAGE / "ehl").iterdir() if not path.name.startswith("_")}
    assert inside == set(re.findall(r"`(\w+)/?`", table.split("purpose |")[1])) - {
        "ContactSolution"
    }


def test_every_module_opens_with_a_docstring():
    lines = {path: path.read_text("utf-8").splitlines()[:1] for path in PACKAGE.rglob("*.py")}
    assert [path for path, line in lines.items() if not line or not line[0].startswith('"""')] == []


def test_folders_hold_at_most_25_modules():
    folders = {path.parent for path in PACKAGE.rglob("*.py")}
    sizes = {folder.name: len(list(folder.glob("*.py"))) for folder in folders}
    assert {name: count for name, count in sizes.items() if count > 26} == {}  # with __init__


def test_every_package_has_an_enforced_public_interface():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    protected = {name for contract in contracts for name in contract.get("protected_modules", ())}
    for interface in PACKAGE.glob("*/__init__.pyi"):
        assert f"asperity.{interface.parent.name}.*" in protected
