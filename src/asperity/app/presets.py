"""Preset cases of the page, and stored results that it shows until the solver is ready.

A stored result was computed by the solver for exactly the text of its case, whose digest
identifies it; `support.stored_results` of the tests writes it.
"""

import io
import json
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.app.contact_result import ContactResult, Numbers, ResonanceSpectrum
from asperity.case import Case, MachineCase, load_case, load_machine
from asperity.paper import papers_case

PAPER = "paper"
TITLES = {
    PAPER: "Paper's rig",
    "6205": "6205 bearing",
    "nu206": "NU 206 bearing",
    "fzg": "FZG gear",
    "cam": "Cam",
    "ball-on-disc": "Ball on disc",
}
DEFAULT_GRID = {"grid.cells": [192, 128]}  # 128 x 128 cells do not determine the paper's CLR
FIELDS = ("x", "y", "gap", "pressure", "cells")
CURVES = ("frequency", "density", "curve")


class StoredResult(NamedTuple):
    """A stored result, and the version that computed it."""

    result: ContactResult
    version: str


def default_case() -> Case:
    """Return the contact of the paper on a grid that is quick to solve."""
    return papers_case().with_written(DEFAULT_GRID)


@cache
def preset_case(name: str) -> Case | MachineCase:
    """Return the case of a preset, by its key in `TITLES`."""
    if name == PAPER:
        return default_case()
    file = files("asperity.app").joinpath("preset_data", f"{name}.toml")
    text = file.read_text("utf-8")
    if "[machine]" in text:
        return load_machine(Path(str(file)))
    return load_case(text, name=TITLES[name])


def case_digest(case: Case) -> str:
    """Return the digest that identifies a case: SHA-256 of its text."""
    return sha256(case.text.encode()).hexdigest()


@cache
def _stored() -> dict[str, str]:
    """Return the files of stored results by the digests of their cases."""
    folder = files("asperity.app").joinpath("preset_data")
    table: dict[str, str] = json.loads(folder.joinpath("digests.json").read_text("utf-8"))
    return table


def stored_result(case: Case) -> StoredResult | None:
    """Return the stored result of a case; None where none was computed for its exact text."""
    name = _stored().get(case_digest(case))
    if name is None:
        return None
    data = files("asperity.app").joinpath("preset_data", name).read_bytes()
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        values: Numbers = json.loads(stored["values"].item())
        spectrum = values.pop("spectrum")
        if spectrum is not None:
            curves = {key: stored[f"spectrum_{key}"] for key in CURVES}
            spectrum = ResonanceSpectrum(
                **curves, **{**spectrum, "band_hz": tuple(spectrum["band_hz"])}
            )
        maker = values.pop("version")
        values |= {key: _tuples(values[key]) for key in ("extent", "half_widths", "notes")}
        maps = {key: stored[key] for key in FIELDS}
    return StoredResult(ContactResult(**maps, **values, spectrum=spectrum), maker)


def _tuples(values: object) -> object:
    """Return nested lists as tuples."""
    return tuple(map(_tuples, values)) if isinstance(values, list) else values
