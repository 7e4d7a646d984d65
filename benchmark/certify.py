"""Write the cases of the benchmark: each statement, and each value by two methods without common code.

Run `python -m benchmark.certify` in the repository's root; it needs the tests' reference solvers,
tamaas and ContactMechanics. The value is that of the first method, the more exact one. Its
uncertainty is the difference of the two methods, but at least: 1e-9 of the value for closed forms;
the error of the extrapolation from the first method's two coarser grids; the whole step between the
two finest grids for rough contacts, a third of it for second-order convergence.
"""

import csv
import sys
import tomllib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from benchmark import dry_cases, oiled_cases

HERE = Path(__file__).parent
MAX_RELATIVE_UNCERTAINTY = 0.02  # values with a larger uncertainty are not certified


def stated() -> Iterator[dry_cases.Stated]:
    """Yield every case: its name, its statement, and the function that computes its values."""
    for family in (*dry_cases.FAMILIES, *oiled_cases.FAMILIES):
        yield from family()


def main(prefixes: Collection[str]) -> None:
    """Compute the cases whose names start with a prefix (default: all), then write the table."""
    for name, given, compute in stated():
        if prefixes and not name.startswith(tuple(prefixes)):
            continue
        certified = [
            entry for value in compute() if (entry := _certified(name, *value)) is not None
        ]
        text = tomli_w.dumps({**given, "certified": certified})
        (HERE / "cases" / f"{name}.toml").write_text(text, "utf-8")
    with (HERE / "certified.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            [
                "case",
                "quantity",
                "unit",
                "value",
                "uncertainty",
                "first way",
                "second way",
                "found by it",
            ]
        )
        for path in sorted((HERE / "cases").glob("*.toml")):
            for entry in tomllib.loads(path.read_text("utf-8"))["certified"]:
                first, second = entry["ways"]
                writer.writerow(
                    [
                        path.stem,
                        entry["quantity"],
                        entry["unit"],
                        f"{entry['value']:.8g}",
                        f"{entry['uncertainty']:.2g}",
                        first["by"],
                        second["by"],
                        f"{second['value']:.8g}",
                    ]
                )


def _certified(
    name: str,
    key: str,
    unit: str,
    first: tuple[str, float],
    second: tuple[str, float],
    min_relative_uncertainty: float,
) -> dict[str, Any] | None:
    uncertainty = max(abs(first[1] - second[1]), min_relative_uncertainty * abs(first[1]))
    certifiable = uncertainty <= MAX_RELATIVE_UNCERTAINTY * abs(first[1])
    sentence = "" if certifiable else "NOT CERTIFIED"
    print(
        f"{name:18s} {key:16s} {first[1]:.6e} {second[1]:.6e} {100 * uncertainty / abs(first[1]):.4f} % {sentence}"
    )
    both = [{"by": by, "value": value} for by, value in (first, second)]
    return (
        {"quantity": key, "unit": unit, "value": first[1], "uncertainty": uncertainty, "ways": both}
        if certifiable
        else None
    )


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main(sys.argv[1:])
