"""Stored results of the page's presets: `cd tests; python -m support.stored_results [NAME...]`
solves the presets and writes their results into the package.
"""

import json
import sys
import time

from asperity.app import presets
from asperity.app.contact_result import ContactResult, result_of_run
from asperity.app.settings import Settings
from asperity.results import solve_case
from support.source import PACKAGE

FOLDER = PACKAGE / "app" / "preset_data"
DIGESTS = FOLDER / "digests.json"


def solved(name: str) -> ContactResult:
    """Solve the contact of a preset as the page does."""
    start = time.perf_counter()
    run = solve_case(Settings(presets.preset_case(name)).case, strict=False)
    return result_of_run(run, time.perf_counter() - start)


def store(name: str) -> None:
    """Solve a preset and write its result."""
    case, result = Settings(presets.preset_case(name)).case, solved(name)
    assert result.converged, f"{name}: {result.explained}"
    file = f"{name}.npz"
    digest = presets.store_result(case, result, FOLDER / file)
    table = json.loads(DIGESTS.read_text("utf-8"))
    table = {key: other for key, other in table.items() if other != file} | {digest: file}
    ordered = dict(sorted(table.items(), key=lambda entry: entry[1]))
    DIGESTS.write_text(json.dumps(ordered, indent=2) + "\n", "utf-8")
    sys.stdout.write(f"{name}: {result.verdict}\n")


if __name__ == "__main__":
    for chosen in sys.argv[1:] or presets.TITLES:
        store(chosen)
