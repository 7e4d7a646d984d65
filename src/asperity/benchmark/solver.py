"""Interface of solvers for the benchmark, and lookup of a solver by name.

An adapter is an object with three attributes: `name`; `kinds`, the kinds of case that it solves;
and `solve(given, cells)`, which takes the case's table of plain SI numbers and the number of cells
along x, and returns quantities by key. It may omit quantities. `--solver package.module:attribute`
takes such an object or its class.
"""

import importlib
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Protocol, runtime_checkable

from asperity.benchmark.cases import CaseTable
from asperity.core.errors import BadInput

KNOWN = {
    "asperity": "asperity.benchmark.asperity_solver:AsperitySolver",
    "tamaas": "asperity.benchmark.external_solvers:Tamaas",
    "contactmechanics": "asperity.benchmark.external_solvers:ContactMechanics",
}


@runtime_checkable
class Solver(Protocol):
    """Solver, as called by the benchmark."""

    name: str
    kinds: Collection[str]

    def solve(self, inputs: CaseTable, cells: int) -> Mapping[str, float]:
        """Return quantities by key, in SI, of a case solved with this many cells along x."""
        ...


def solver_named(name: str) -> Solver:
    """Return the solver with this name, or at package.module:thing.

    Raises
    ------
    BadInput
        for an unknown name, or an object that is not a solver.
    """
    module, colon, attribute = KNOWN.get(name, name).partition(":")
    if not colon:
        raise BadInput(f"--solver must be {', '.join(KNOWN)} or package.module:thing, got {name}")
    sys.path.insert(0, str(Path.cwd()))  # for user adapters
    try:
        target = getattr(importlib.import_module(module), attribute)
        solver = target() if isinstance(target, type) else target
    except (ImportError, AttributeError) as error:
        raise BadInput(f"--solver {name}: {error}; install it or correct the name") from None
    finally:
        sys.path.pop(0)
    if not isinstance(solver, Solver):
        raise BadInput(
            f"--solver {name}: an adapter needs name, kinds and solve(given, cells); correct "
            f"{attribute}"
        )
    return solver
