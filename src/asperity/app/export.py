"""What is taken away from the page: the case file, and Python lines that solve it again."""

from asperity.case import Case

CASE_FILE, SCRIPT, REPORT = "contact.toml", "contact.py", "contact.html"


def case_text(case: Case) -> str:
    """The case file of what is shown."""
    beside = "".join(
        f"# {part.name} lies beside this file.\n"
        for part in case.contents.surface.parts.values()
        if hasattr(part, "file")
    )
    kept = (
        ""
        if case.stored is None
        else "# The run it came from holds its roughness; asperity report reads that.\n"
    )
    head = f"# From asperity's live page: `asperity solve {CASE_FILE} --surfaces 1` solves what it showed.\n"
    return f"{head}{beside}{kept}{case.text}"


def python_lines() -> str:
    """A script that solves the case file beside it, with the page's numbers."""
    return "\n".join(
        [
            '"""Solves the contact that asperity\'s live page showed; the case file lies beside this script."""',
            "",
            "from pathlib import Path",
            "",
            "from asperity import load_case, solve_case",
            "",
            f'case = load_case(Path(__file__).with_name("{CASE_FILE}"))',
            "run = solve_case(case)",
            "print(run.verdict())",
            'print(f"CLR {run.state.clr:.4f}, CAR {run.state.car:.4f}, film {run.state.h_central:.4g} m")',
            "",
        ]
    )
