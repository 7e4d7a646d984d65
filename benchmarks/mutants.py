"""Mutants drawn by lot in the modules that decide results, and the share that tests find.

`python -m benchmarks.mutants [--count 12] [--seed 1] [MODULE ...]` changes one operator, number or
branch at a time in a copy of the sources, as cosmic-ray defines them, and runs the tests of the
module. Needs `pip install cosmic-ray`; a mutant takes up to three minutes.
"""

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
TIMEOUT_S = 180.0
LINES = 3  # of a difference that are printed
# annotations and texts are not run; `|` is mostly an annotation
LEFT_OUT = (
    *("BitOr", "BitAnd", "BitXor", "LShift", "RShift", "RemoveDecorator", "ExceptionReplacer"),
    *("VariableReplacer", "VariableInserter"),  # need a name
)

MODULES = {  # with the tests that are to find its mutants
    "core/storage.py": (
        "unit/test_kept.py unit/test_storage.py unit/test_unpacking.py unit/test_history.py "
        "end_to_end/test_missing_files.py"
    ),
    "trend/alarm.py": (
        "unit/test_alarm.py unit/test_alarm_memory.py unit/test_level_rule.py "
        "unit/test_benchmarks.py end_to_end/test_alarm_command.py"
    ),
    "trend/sequential.py": (
        "unit/test_alarm.py unit/test_alarm_memory.py unit/test_operating.py "
        "unit/test_benchmarks.py"
    ),
    "case/units.py": (
        "unit/test_units.py unit/test_case.py unit/test_quantities.py unit/test_oil_case.py "
        "unit/test_machine.py end_to_end/test_bad_input.py"
    ),
    "ehl/load_shares.py": (
        "unit/test_zones.py validation/test_mixed_contact.py validation/test_error_estimate.py "
        "unit/test_coupling.py unit/test_trend.py"
    ),
    "ehl/models/mixed.py": (
        "validation/test_mixed_contact.py unit/test_mirror.py validation/test_motion.py "
        "validation/test_smooth_bodies.py"
    ),
    "resonance/resonance.py": (
        "unit/test_indicators.py unit/test_lines.py unit/test_rig.py validation/test_resonance.py"
    ),
    "ehl/grid_design.py": (
        "unit/test_positions.py unit/test_rollers.py unit/test_grid.py unit/test_chosen_grid.py "
        "validation/test_auto_grid.py validation/test_two_pressures.py"
    ),
    "monitoring/store/database.py": (
        "end_to_end/test_store_command.py end_to_end/test_store_damage.py "
        "end_to_end/test_watch_survival.py"
    ),
    "app/serving/access.py": "end_to_end/test_page_access.py unit/test_page_server.py",
}


class Mutant(NamedTuple):
    """A changed source: operator, text and difference."""

    operator: str
    text: str
    difference: str


def draw(source: str, count: int, rng: random.Random) -> list[Mutant]:
    """Return mutants of a source, each place and replacement being equally likely."""
    from cosmic_ray.ast import get_ast
    from cosmic_ray.mutating import MutationVisitor
    from cosmic_ray.plugins import get_operator, operator_names

    operators = {
        name: get_operator(name)()
        for name in operator_names()
        if not any(part in name for part in LEFT_OUT)
    }
    nodes = [*_nodes(get_ast(source))]
    places = [
        (name, occurrence)
        for name, operator in operators.items()
        for occurrence in range(sum(len([*operator.mutation_positions(node)]) for node in nodes))
    ]
    rng.shuffle(places)
    drawn: list[Mutant] = []
    for name, occurrence in places:
        if len(drawn) == count:
            break
        text = MutationVisitor.mutate_code(source, operators[name], occurrence)
        difference = "" if text is None else _difference(source, text)
        if text is not None and difference:
            drawn.append(Mutant(name.rpartition("/")[2], text, difference))
    return drawn


def _nodes(node: Any) -> Iterator[Any]:
    """Yield a node of a syntax tree and all below it."""
    yield node
    for child in getattr(node, "children", ()):
        yield from _nodes(child)


def _difference(before: str, after: str) -> str:
    """Return the first changed lines; "" for annotations and for texts that no code reads."""
    old, new = before.splitlines(), after.splitlines()
    changed = [
        (number, was, now)
        for number, (was, now) in enumerate(zip(old, new, strict=False), 1)
        if was != now
    ][:LINES]
    if not changed or any("->" in was or was.strip().endswith('"""') for _, was, _ in changed):
        return ""
    return "; ".join(f"{number}: {was.strip()} > {now.strip()}" for number, was, now in changed)


def survives(tree: Path, module: str, mutant: Mutant) -> tuple[bool, float]:
    """Return whether the tests of a module pass on a mutant, and their duration [s]."""
    path = tree / "src/asperity" / module
    true = path.read_text("utf-8")
    path.write_text(mutant.text, "utf-8")
    began = time.monotonic()
    tests = [f"tests/{name}" for name in MODULES[module].split()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            command,
            cwd=tree,
            env=environment,
            capture_output=True,
            timeout=TIMEOUT_S,
            check=False,
        )
        passed = done.returncode == 0
    except subprocess.TimeoutExpired:
        passed = False
    finally:
        path.write_text(true, "utf-8")
    return passed, time.monotonic() - began


def lines(modules: list[str], count: int, seed: int) -> Iterator[str]:
    """Run mutants of each module and yield a table, then the survivors."""
    survivors = []
    yield "| module | mutants | found by its tests | longest [s] |\n|---|---|---|---|"
    with tempfile.TemporaryDirectory(prefix="asperity-mutants-") as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", "build"))
        counts = [0, 0]
        for module in modules:
            source = (tree / "src/asperity" / module).read_text("utf-8")
            drawn = draw(source, count, random.Random(f"{seed} {module}"))
            found, longest = 0, 0.0
            for mutant in drawn:
                passed, seconds = survives(tree, module, mutant)
                longest = max(longest, seconds)
                found += not passed
                if passed:
                    survivors.append(f"- `{module}` {mutant.operator}, line {mutant.difference}")
                    print(survivors[-1], file=sys.stderr, flush=True)
            counts = [counts[0] + len(drawn), counts[1] + found]
            yield f"| {module} | {len(drawn)} | {found} | {longest:.0f} |"
    share = counts[1] / max(counts[0], 1)
    yield f"| all | {counts[0]} | {counts[1]} ({share:.0%}) | |"
    yield from ("", *survivors)


def main() -> None:
    """Run the requested mutants and print the table."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=__doc__)
    arguments.add_argument("--count", type=int, default=12, help="mutants of each module")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("modules", nargs="*", help=", ".join(MODULES))
    options = arguments.parse_args()
    for line in lines(options.modules or [*MODULES], options.count, options.seed):
        print(line, flush=True)


if __name__ == "__main__":
    main()
