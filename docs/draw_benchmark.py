"""Draw the error of the certified values over time from the csv of `make bench`."""

import csv
from pathlib import Path

from matplotlib.figure import Figure

from asperity.report.benchmark import FAMILIES
from asperity.report.style import ON_PAGE, write_figure

TABLE = Path(__file__).parent / "benchmarks" / "certified.csv"
STROKES = {"asperity": "-", "tamaas": "--", "contactmechanics": ":"}

Course = tuple[list[float], list[float]]  # median time of a case [s] and error [%], coarse to fine


def courses(table: Path = TABLE) -> dict[tuple[str, str], Course]:
    """Read times and errors by solver and family."""
    found: dict[tuple[str, str], Course] = {}
    with table.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            times, errors = found.setdefault((row["solver"], row["cases"]), ([], []))
            times.append(float(row["median time [s]"]))
            errors.append(float(row["median error [%]"]))
    return found


@ON_PAGE.drawing()
def figure(table: Path = TABLE) -> Figure:
    """Draw one panel with a line for each solver and family."""
    drawn = Figure(figsize=(ON_PAGE.single, 4.6), layout="constrained")
    axes = drawn.subplots()
    looks = {name: (colour, marker) for name, colour, marker in FAMILIES}
    for (solver, family), (times, errors) in courses(table).items():
        colour, marker = looks[family]
        axes.loglog(
            times, errors, STROKES[solver], color=colour, marker=marker, label=f"{family}, {solver}"
        )
    axes.set_xlabel("median CPU time per case [s]")
    axes.set_ylabel("error over certified value, median [%]")
    axes.set_title("Certified values: error over time, coarse to fine cells")
    drawn.legend(loc="outside lower center", ncols=2)
    return drawn


def write(path: Path) -> Path:
    """Write the figure as PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_figure(figure(), path)
