"""Downloads of the page: the case file, and a Python script that solves it."""

from asperity.case import Case

CASE_FILE = "contact.toml"
SCRIPT = "contact.py"
REPORT = "contact.html"


def case_text(case: Case) -> str:
    """Return the case file of the current settings."""
    files = "".join(
        f"# Needs {part.name} in the same folder.\n"
        for part in case.contents.surface.parts.values()
        if hasattr(part, "file")
    )
    stored = (
        ""
        if case.stored is None
        else "# The roughness is stored in the original run; asperity report reads it.\n"
    )
    head = (
        f"# From the live page of asperity. To reproduce: asperity solve {CASE_FILE} --surfaces 1\n"
    )
    return f"{head}{files}{stored}{case.text}"


def python_script() -> str:
    """Return a Python script that solves the case file in its folder."""
    return "\n".join(
        [
            '"""Solve the contact shown by the live page of asperity."""',
            "",
            "from pathlib import Path",
            "",
            "from asperity import load_case, solve_case",
            "",
            f'case = load_case(Path(__file__).with_name("{CASE_FILE}"))',
            "run = solve_case(case)",
            "print(run.verdict())",
            "state = run.state",
            'print(f"CLR {state.clr:.4f}, CAR {state.car:.4f}, film {state.h_central:.4g} m")',
            "",
        ]
    )
