import pytest

from asperity.case import COMMANDS, KINDS, case_template, load_case, load_machine

MACHINES = ("gear", "bearing", "cam")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in MACHINES])
def test_every_starting_case_is_valid(kind):
    case = load_case(case_template(kind), name=kind)
    assert case.conditions.geometry == (kind if kind in ("point", "elliptic", "roller") else "line")
    assert (case.lubricant is None) == (kind == "dry")
    for section in ("study", "motion", "wear", "infer"):
        assert (getattr(case.contents, section) is not None) == (kind == section)
    assert case.vibration is not None


@pytest.mark.parametrize("kind", MACHINES)
def test_every_starting_machine_is_complete(kind, tmp_path):
    path = tmp_path / f"{kind}.toml"
    path.write_text(case_template(kind), "utf-8")
    machine = load_machine(path)
    assert machine.complete
    assert machine.case(machine.contacts[0]).vibration is not None


@pytest.mark.parametrize("kind", KINDS)
def test_every_template_explains_its_quantities(kind):
    lines = [
        line
        for line in case_template(kind).splitlines()
        if "=" in line and not line.startswith("#")
    ]
    assert sum("#" in line for line in lines) > len(lines) / 3


def test_every_kind_has_its_commands():
    assert tuple(COMMANDS) == KINDS
