"""Writes the cases of the benchmark: each statement, and each value by two ways that share no code.

`python -m benchmark.certify` from the repository's root; it needs the tests' slow twins, tamaas and ContactMechanics. A
value is that of the first way, the one nearer to exact; its uncertainty is the distance of the two, and at least what
is left open: 1e-9 of it for closed forms; how far the first way's two coarser grids would have missed its limit; the
whole step between the two finest grids for rough contacts, a third of it for what settles at second order.
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
MOST = 0.02  # of a value, for an uncertainty: what is known worse is not certified


def stated() -> Iterator[dry_cases.Stated]:
    """Every case: its name, its statement, and what makes its values."""
    for family in (*dry_cases.FAMILIES, *oiled_cases.FAMILIES):
        yield from family()


def main(wanted: Collection[str]) -> None:
    """Make the cases whose names begin so, all without any; then the table of all that there are."""
    for name, given, made in stated():
        if wanted and not name.startswith(tuple(wanted)):
            continue
        certified = [entry for value in made() if (entry := _certified(name, *value)) is not None]
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
    least: float,
) -> dict[str, Any] | None:
    doubt = max(abs(first[1] - second[1]), least * abs(first[1]))
    kept = doubt <= MOST * abs(first[1])
    sentence = "" if kept else "NOT CERTIFIED"
    print(
        f"{name:18s} {key:16s} {first[1]:.6e} {second[1]:.6e} {100 * doubt / abs(first[1]):.4f} % {sentence}"
    )
    both = [{"by": by, "value": value} for by, value in (first, second)]
    return (
        {"quantity": key, "unit": unit, "value": first[1], "uncertainty": doubt, "ways": both}
        if kept
        else None
    )


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main(sys.argv[1:])
