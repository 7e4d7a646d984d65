"""A page loads nothing and runs only its own script, whatever names it displays."""

import re
from base64 import b64encode
from hashlib import sha256

import pytest

from asperity.paper import papers_case
from asperity.report import write_motion_report, write_report
from asperity.results import solve_case
from asperity.simulation import run_history

POLICY = re.compile(r'<meta http-equiv="Content-Security-Policy" content="([^"]+)">')
SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um", "vibration": "none"}


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    case = papers_case().with_overrides(SMALL)
    write_report([solve_case(case, strict=False)], folder / "run.html")
    write_motion_report(run_history(case, steps=2, strict=False), folder / "motion.html")
    return {path.stem: path.read_text("utf-8") for path in folder.glob("*.html")}


def test_a_page_without_a_script_may_run_none(pages):
    policy = POLICY.findall(pages["run"])[0].replace("&#39;", "'")
    assert policy.startswith("default-src 'none'; img-src data:;")
    assert policy.endswith("script-src 'none'")
    assert "<script" not in pages["run"]


def test_the_page_of_a_motion_may_run_its_own_script_only(pages):
    policy = POLICY.findall(pages["motion"])[0].replace("&#39;", "'")
    (script,) = re.findall(r"<script>(.*?)</script>", pages["motion"], re.DOTALL)
    assert f"script-src 'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'" in policy
    assert not re.search(r"\son\w+=", pages["motion"].split("<script")[0])
