"""Stored results of the page's presets: `cd tests; python -m support.stored_results [NAME...]`
solves the presets and writes their results into the package.
"""

import io
import json
import sys
import time
from dataclasses import fields
from importlib.metadata import version
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from asperity.app import presets
from asperity.app.contact_result import ContactResult, result_of_run
from asperity.app.settings import Settings
from asperity.case import Case
from asperity.results import solve_case
from support.source import PACKAGE

FOLDER = PACKAGE / "app" / "preset_data"
DIGESTS = FOLDER / "digests.json"


def solved(name: str) -> ContactResult:
    """Solve the contact of a preset as the page does."""
    start = time.perf_counter()
    run = solve_case(Settings(presets.preset_case(name)).case, strict=False)
    return result_of_run(run, time.perf_counter() - start)


def store_result(case: Case, result: ContactResult, path: Path) -> str:
    """Write the result of a case to a file; return the digest of the case."""
    skipped = {*presets.FIELDS, "spectrum", "sound", "sound_rate_hz"}
    values = {
        part.name: getattr(result, part.name) for part in fields(result) if part.name not in skipped
    }
    spectrum, curves = result.spectrum, {}
    values["spectrum"] = None
    if spectrum is not None:
        curves = {
            f"spectrum_{key}": getattr(spectrum, key).astype(np.float32) for key in presets.CURVES
        }
        values["spectrum"] = {
            part.name: getattr(spectrum, part.name)
            for part in fields(spectrum)
            if part.name not in presets.CURVES
        }
    values["version"] = version("asperity")
    arrays = {key: getattr(result, key) for key in presets.FIELDS} | curves
    arrays["values"] = np.array(json.dumps(values, default=float).encode())
    with ZipFile(path, "w", ZIP_DEFLATED, compresslevel=9) as file:
        for name, values in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, values, allow_pickle=False)
            file.writestr(f"{name}.npy", buffer.getvalue())
    return presets.case_digest(case)


def store(name: str) -> None:
    """Solve a preset and write its result."""
    case, result = Settings(presets.preset_case(name)).case, solved(name)
    assert result.converged, f"{name}: {result.explained}"
    file = f"{name}.npz"
    digest = store_result(case, result, FOLDER / file)
    table = json.loads(DIGESTS.read_text("utf-8"))
    table = {key: other for key, other in table.items() if other != file} | {digest: file}
    ordered = dict(sorted(table.items(), key=lambda entry: entry[1]))
    DIGESTS.write_text(json.dumps(ordered, indent=2) + "\n", "utf-8")
    sys.stdout.write(f"{name}: {result.verdict}\n")


if __name__ == "__main__":
    for chosen in sys.argv[1:] or presets.TITLES:
        store(chosen)
