"""Oversized requests are refused before computing, with the estimate and the remedy."""

import os

import numpy as np
import pandas
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import write_csv
from asperity.core.limits import memory_limit, require_affordable, require_plausible_size
from asperity.coupling import VibrationModel
from asperity.paper import RigSettings, papers_case, simulate_rig
from asperity.recording import read_recording
from asperity.simulation import run_history


def test_the_message_gives_the_estimate_and_the_remedy(monkeypatch):
    monkeypatch.setenv("ASPERITY_MEMORY_GB", "2")
    with pytest.raises(
        BadInput,
        match=r"a map would take about 3 GB of memory, more than the limit of 2 GB; .*MEMORY_GB",
    ):
        require_affordable("a map", memory=3e9)
    monkeypatch.setenv("ASPERITY_DAYS", "1.5")
    with pytest.raises(
        BadInput,
        match=r"a map would take about 2 days, more than the limit of 1\.5 days; .*ASPERITY_DAYS",
    ):
        require_affordable("a map", seconds=2 * 86400.0)
    require_affordable("a map", memory=1.9e9, seconds=86400.0)
    for unknown in (float("nan"), float("inf")):
        with pytest.raises(BadInput):
            require_affordable("a map", memory=unknown)


@pytest.mark.parametrize("text", ["much", "-1", "inf", "0", "nan"])
def test_an_invalid_limit_is_refused(monkeypatch, text):
    monkeypatch.setenv("ASPERITY_MEMORY_GB", text)
    with pytest.raises(BadInput, match="ASPERITY_MEMORY_GB must be a positive number"):
        memory_limit()


def test_the_default_limit_is_the_memory_of_the_machine(monkeypatch):
    monkeypatch.delenv("ASPERITY_MEMORY_GB", raising=False)
    assert 1e8 < memory_limit() <= 0.8 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def test_a_file_may_unpack_by_the_usual_factor_of_measured_data(tmp_path, monkeypatch):
    path = tmp_path / "x.h5"
    path.write_bytes(bytes(range(256)) * 40000)  # 10 MB
    require_plausible_size(path, 5e8, "export it again")
    with pytest.raises(
        UnreadableFile,
        match=r"x\.h5 of 0\.01 GB declares 0\.6 GB of content, more than the limit of 0\.51",
    ):
        require_plausible_size(path, 6e8, "export it again")
    monkeypatch.setenv("ASPERITY_MEMORY_GB", "1")
    require_plausible_size(path, 6e8, "export it again")


OVERSIZED = {
    "a grid of 20000 x 20000 cells": lambda: papers_case().with_overrides(
        {"grid.cells": [20000, 20000]}
    ),
    "a grid of 2560000 x 256 cells": lambda: (
        papers_case()
        .with_overrides({"motion": {"track": 10000}, "grid.cells": [256, 256]})
        .moving_surfaces()
    ),
    "a vibration record of 1e\\+06 s": lambda: VibrationModel(
        mass=0.1, damping_ratio=0.02, duration_s=1e6
    ),
    "a vibration record of 4 s at 1e\\+15 Hz": lambda: papers_case().with_overrides(
        {"vibration.rate": "1e15 Hz"}
    ),
    "a history of": lambda: run_history(papers_case(), passes=1e300),
    "a wear test of": lambda: simulate_rig(RigSettings(duration_s=1e6)),
}


@pytest.mark.parametrize("description", OVERSIZED)
def test_oversized_requests_are_refused_before_computing(monkeypatch, description):
    monkeypatch.setenv("ASPERITY_MEMORY_GB", "16")
    with pytest.raises(BadInput, match=f"{description}.* would take about .*; reduce it"):
        OVERSIZED[description]()


def test_an_invalid_scale_is_refused(tmp_path):
    np.save(tmp_path / "x.npy", np.arange(100.0))
    for scale in (float("inf"), float("nan"), 0.0):
        with pytest.raises(BadInput, match="scale must be finite and not 0"):
            read_recording(tmp_path / "x.npy", rate_hz=1e3, scale=scale)


@pytest.mark.parametrize("text", ["x = " + "[" * 3000 + "]" * 3000, "x = " + "9" * 5000])
def test_a_case_beyond_the_limits_of_the_parser_is_refused(text):
    with pytest.raises(UnreadableFile, match="not valid TOML"):
        load_case(f"{text}\n", name="case.toml")
    with pytest.raises(BadInput, match="cannot be read"):
        papers_case().with_overrides({"contact.load": text.removeprefix("x = ")})


def test_a_value_cannot_add_another_key():
    with pytest.raises(BadInput, match=r"contact\.load must be a force"):
        papers_case().with_overrides({"contact.load": "'500 N'\nsurface = 1"})


def test_a_long_value_is_abbreviated_in_the_message():
    with pytest.raises(BadInput) as caught:
        papers_case().with_overrides({"contact.load": "x" * 10**6})
    assert len(str(caught.value)) < 400
    assert "(1000002 characters)" in str(caught.value)


def test_formulas_are_escaped_in_csv_files(tmp_path):
    table = pandas.DataFrame(
        {
            "file": ["=1+1", "a.csv"],
            "unit": ["@g", None],
            "rms": [-1.0, np.nan],
            "fine": [True, False],
        }
    )
    write_csv(tmp_path / "t.csv", table)
    assert (
        tmp_path / "t.csv"
    ).read_text() == "file,unit,rms,fine\n'=1+1,'@g,-1.0,True\na.csv,,,False\n"
