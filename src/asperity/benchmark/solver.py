"""What a solver has to be for the benchmark, and the solver that a name stands for.

An adapter is an object with three things: `name`; `kinds`, what kinds of case it solves; and
`solve(given, cells)`, which takes the case's table of plain SI numbers and a number of cells along
x, and returns quantities by their key. It may leave out quantities that it does not have.
`--solver package.module:thing` takes such an object or a class of it.
"""

import importlib
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from asperity.core.errors import BadInput

KNOWN = {
    "asperity": "asperity.benchmark.asperity_solver:Ours",
    "tamaas": "asperity.benchmark.external_solvers:Tamaas",
    "contactmechanics": "asperity.benchmark.external_solvers:ContactMechanics",
}


@runtime_checkable
class Solver(Protocol):
    """A solver, as the benchmark calls it."""

    name: str
    kinds: Collection[str]

    def solve(self, given: Mapping[str, Any], cells: int) -> Mapping[str, float]:
        """Quantities by key, in SI, of a case solved on this many cells along x."""
        ...


def solver_named(name: str) -> Solver:
    """The solver of a name, or of package.module:thing.

    Raises
    ------
    BadInput
        for a name that nothing has, and for a thing that is no solver.
    """
    module, colon, thing = KNOWN.get(name, name).partition(":")
    if not colon:
        raise BadInput(f"--solver must be {', '.join(KNOWN)} or package.module:thing, got {name}")
    sys.path.insert(0, str(Path.cwd()))  # where somebody's adapter lies
    try:
        found = getattr(importlib.import_module(module), thing)
        solver = found() if isinstance(found, type) else found
    except (ImportError, AttributeError) as error:
        raise BadInput(f"--solver {name}: {error}; install it, or mend the name") from None
    finally:
        sys.path.pop(0)
    if not isinstance(solver, Solver):
        raise BadInput(
            f"--solver {name}: an adapter has name, kinds and solve(given, cells); mend {thing}"
        )
    return solver
