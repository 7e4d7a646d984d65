"""Sixty pairs of measured surfaces with parallel and crossed lays: how many contacts are solved.

`python -m benchmarks.measured_pairs FOLDER [--standing] [--accuracy SHARE] [--cells N]`, with the
folder of the measured surfaces. Every pair of five surfaces, each as it lies or turned by 90
degrees, alternately on a line contact and on a ball.
"""

import argparse
import itertools
import time
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from asperity.case import load_case
from asperity.core.errors import BadInput, NotConverged
from asperity.results import solve_case

SURFACES: dict[str, dict[str, Any]] = {
    "ground_lay.plu": {},
    "milled_1.opd": {},
    "bullet_land.x3p": {"l_filter": "0.25 mm"},
    "nanovea_test1.txt": {"unit": "um", "lateral_unit": "mm"},
    "isotropic.al3d": {"fit": "tile"},
}
LINE = {"geometry": "line", "radius": "6 mm", "length": "8 mm", "load": "1.2 kN"}
BALL = {"geometry": "point", "radius": "10 mm", "load": "60 N"}
CASE = """
contact = {{ {contact}, entrainment_speed = "0.8 m/s", slip = 0.2, roughness = "{roughness}" }}
material = {{ name = "case-hardened steel", boundary_friction = 0.11 }}
lubricant = {{ grade = "VG 46", temperature = "60 degC" }}
solver = {{ surfaces = 1{cells} }}
{grid}
[surface]
{first}
[surface.second]
{second}
"""


def pairs() -> list[tuple[str, str, bool, bool]]:
    """Return names of both surfaces, and whether each is turned."""
    names = itertools.combinations_with_replacement(SURFACES, 2)
    turns = list(itertools.product((False, True), repeat=2))
    return [(*pair, *turn) for pair in names for turn in turns]


def _toml(values: dict[str, Any]) -> str:
    return ", ".join(f'{key} = "{value}"' for key, value in values.items())


def _surface(folder: Path, name: str, turned: bool) -> str:
    values = {"file": folder / name, "sq": "0.25 um", **SURFACES[name]}
    return _toml(values).replace(", ", "\n") + f"\nturn = {str(turned).lower()}"


def main() -> None:
    """Solve the pairs and print a line for each, then the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--standing", action="store_true")
    parser.add_argument("--accuracy", type=float)
    parser.add_argument("--cells", type=int, help="cells of a running contact")
    parser.add_argument("--part", default="0/1", help="number and count of parts, such as 0/2")
    arguments = parser.parse_args()
    part, count = map(int, arguments.part.split("/"))
    outcomes: dict[str, int] = {}
    for number, (first, second, *turns) in enumerate(pairs()):
        if number % count != part:
            continue
        contact = (LINE, BALL)[number // 4 % 2]
        accuracy = arguments.accuracy
        text = CASE.format(
            contact=_toml(contact),
            roughness="standing" if arguments.standing else "running",
            cells="" if arguments.cells is None else f", running_cells = {arguments.cells}",
            grid="" if accuracy is None else f"grid = {{ accuracy = {accuracy} }}",
            first=_surface(arguments.folder, first, turns[0]),
            second=_surface(arguments.folder, second, turns[1]),
        )
        start = time.perf_counter()
        remark = ""
        try:
            with threadpool_limits(1):
                run = solve_case(load_case(text))
            outcome = "solved" if run.determined else "not determined"
            remark = f"CLR {100.0 * run.state.clr:.1f} %"
        except NotConverged as error:
            outcome, remark = "not converged", str(error)
        except BadInput as error:
            outcome, remark = "refused", str(error)
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        turned = " and ".join(
            f"{name}{' turned' if turn else ''}"
            for name, turn in zip((first, second), turns, strict=True)
        )
        seconds = time.perf_counter() - start
        kind = contact["geometry"]
        print(f"{number} {kind} {turned}: {outcome}, {seconds:.1f} s, {remark}", flush=True)
    print(outcomes)


if __name__ == "__main__":
    main()
