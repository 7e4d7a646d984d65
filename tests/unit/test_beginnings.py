import pytest

from asperity.case import KINDS, case_template, load_case


@pytest.mark.parametrize("kind", KINDS)
def test_every_starting_case_is_valid(kind):
    case = load_case(case_template(kind), name=kind)
    assert case.conditions.geometry == (kind if kind in ("point", "elliptic", "roller") else "line")
    assert (case.lubricant is None) == (kind == "dry")
    assert (case.contents.study is not None) == (kind == "study")
    assert (case.contents.motion is not None) == (kind == "motion")
    assert case.vibration is not None


def test_every_quantity_is_explained():
    lines = [
        line
        for line in case_template("line").splitlines()
        if "=" in line and not line.startswith("#")
    ]
    assert sum("#" in line for line in lines) > len(lines) / 2
