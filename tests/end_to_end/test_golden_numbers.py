"""Regression of every number that the commands state; see `golden_numbers`."""

import json
import os

import pytest

from support.golden_numbers import CASES, REFERENCE, differences, numbers

# Another processor sums in another order, so Newton's method stops elsewhere within the solver's
# tolerance of 1e-4.
TOLERANCE = float(os.environ.get("ASPERITY_GOLDEN_TOLERANCE", "2e-3"))


@pytest.mark.parametrize("name", CASES)
def test_numbers_match_the_reference(name):
    then = json.loads((REFERENCE / f"{name}.json").read_text("utf-8"))
    assert differences(then, numbers(name), TOLERANCE) == []


def test_a_difference_is_detected():
    then = {"rows": [{"clr": 0.5, "found": True, "reason": None}]}
    assert (
        differences(
            then, {"rows": [{"clr": 0.5004, "found": True, "reason": None, "new": 1}]}, 2e-3
        )
        == []
    )
    assert (
        len(differences(then, {"rows": [{"clr": 0.502, "found": False, "reason": ""}]}, 2e-3)) == 3
    )
    assert differences({"load_error": 2e-9}, {"load_error": -3e-8}, 2e-3) == []
    assert len(differences({"load_error": 2e-9}, {"load_error": 2e-4}, 2e-3)) == 1
    assert differences({"a": {"iterations": 20}}, {"a": {"iterations": 23}}, 2e-3) == []
    assert len(differences({"a": {"iterations": 20}}, {"a": {"iterations": 25}}, 2e-3)) == 1
    assert differences(then, {"rows": []}, 2e-3) == [
        ".rows: [{'clr': 0.5, 'found': True, 'reason': None}] is now []"
    ]
