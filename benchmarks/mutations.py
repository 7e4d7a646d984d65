"""Mutation tests: a deliberately wrong version of each term of the solver, and the test that fails.

`python -m benchmarks.mutations` breaks a copy of the sources, term by term, and runs the tests
that should fail.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SMOOTH, MIXED = (
    "tests/validation/test_smooth_line_contact.py",
    "tests/validation/test_mixed_contact.py",
)
HERTZ, KERNELS = "tests/validation/test_hertz.py", "tests/unit/test_kernels.py"
DRY = "tests/validation/test_dry_contact.py"


@dataclass(frozen=True)
class Mutation:
    """A term, its source text, the wrong replacement, and tests of which at least one must fail."""

    term: str
    file: str
    true: str
    broken: str
    tests: str


MUTATIONS = (
    Mutation("wedge: 2 % too much oil dragged in", "ehl/scales.py", "12.0 * ", "12.24 * ", SMOOTH),
    Mutation(
        "Poiseuille flow: h cubed becomes h squared",
        "kernels/reynolds.py",
        "conductance * content * h * h / ",
        "conductance * content * h / ",
        SMOOTH,
    ),
    Mutation(
        "density: held at its ambient value",
        "ehl/models/single_pressure.py",
        "oil.density(pascals) / oil.density.rho0,\n"
        "            oil.density.slope(pascals) * (self.p_scale / oil.density.rho0),",
        "np.ones_like(pascals),\n            np.zeros_like(pascals),",
        SMOOTH,
    ),
    Mutation(
        "viscosity: 2 % too steep",
        "ehl/models/single_pressure.py",
        "viscosity = oil.viscosity(pascals)",
        "viscosity = oil.viscosity(1.02 * pascals)",
        SMOOTH,
    ),
    Mutation(
        "deformation: 1 % too stiff",
        "ehl/deflection.py",
        "waves *= self.spectrum",
        "waves *= 0.99 * self.spectrum",
        HERTZ,
    ),
    Mutation(
        "cap: 5 % too high",
        "ehl/problem_setup.py",
        "conditions.hardness / scales.pressure",
        "1.05 * conditions.hardness / scales.pressure",
        DRY,
    ),
    Mutation(
        "load balance: 0.1 % too little carried",
        "ehl/models/single_pressure.py",
        "dx * dy / self.load - 1.0",
        "dx * dy / self.load - 0.999",
        MIXED,
    ),
    Mutation(
        "contact: asperities may overlap by 2 nm",
        "ehl/models/single_pressure.py",
        "touching = (gap - self.contact_gap)",
        "touching = (gap - 0.6 * self.contact_gap)",
        MIXED,
    ),
    Mutation(
        "Jacobian: mobility's slope in the gap left out",
        "kernels/reynolds.py",
        "d_log[j] = log_h[0, j] * d_gap[0, j] + ",
        "d_log[j] = ",
        KERNELS,
    ),
)


def caught(mutation: Mutation) -> str | None:
    """Return the first test that fails on the broken sources; None when all pass."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(
            ROOT / "src", folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
        )
        path = Path(folder) / "asperity" / mutation.file
        text = path.read_text("utf-8")
        if text.count(mutation.true) != 1:
            raise RuntimeError(
                f"{mutation.file} contains {mutation.true!r} {text.count(mutation.true)} times"
                " instead of once"
            )
        path.write_text(text.replace(mutation.true, mutation.broken), "utf-8")
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            mutation.tests,
        ]
        ran = subprocess.run(
            command,
            cwd=ROOT,
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": folder},
            check=False,
        )
        failed = [
            line.split("::")[1].split(" ")[0]
            for line in ran.stdout.splitlines()
            if line.startswith("FAILED")
        ]
        return failed[0] if failed else None


def lines() -> Iterator[str]:
    """Yield the table as Markdown."""
    yield "| mutation | failing test |"
    yield "|---|---|"
    for mutation in MUTATIONS:
        test = caught(mutation)
        yield f"| {mutation.term} | {f'`{test}` in `{mutation.tests}`' if test else 'NOTHING'} |"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
