from pathlib import Path

import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.study import plan_points, plan_study

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def paper():
    return load_case(EXAMPLES / "paper.toml")


def planned(case, **study):
    return plan_study(case.with_overrides({"study": study}))


def sq_range(**more):
    return {"from": "0.5 um", "to": "4 um", **more}


def test_the_papers_study_has_36_levels_of_5_surfaces(paper):
    plan = plan_study(paper)
    assert len(plan.points) == 36
    assert len(plan.cases) == 180
    assert plan.points[0] == {"surface.sq": "0.5 um"}
    assert plan.points[-1] == {"surface.sq": "4.0 um"}
    assert len({case.id for case in plan.cases}) == 180
    assert len({case.overrides["surface.seed"] for case in plan.cases}) == 180


def test_steps_are_decimal_so_that_levels_equal_hand_written_values(paper):
    # in binary floating point, 7 x 0.1 + 0.5 is 1.2000000000000002
    case = planned(paper, sq=sq_range(step="0.1 um")).cases[7]
    explicit = plan_points(paper, [{"surface.sq": "1.2 um"}]).cases[0]
    assert case.overrides["surface.sq"] == "1.2 um"
    assert case.id == explicit.id


def test_several_quantities_form_a_product_whose_last_factor_varies_fastest(paper):
    plan = planned(
        paper, sq=["1 um", "2 um"], contact={"load": ["200 N", "500 N", "1 kN"]}, seeds=2
    )
    assert plan.axes == ("surface.sq", "contact.load")
    assert [tuple(point.values()) for point in plan.points] == [
        (sq, load) for sq in ("1 um", "2 um") for load in ("200 N", "500 N", "1 kN")
    ]
    assert len(plan.cases) == 12


def test_ranges_by_count_include_both_ends_on_either_scale(paper):
    by_log = planned(paper, sq=sq_range(count=4, scale="log")).points
    assert [point["surface.sq"] for point in by_log] == ["0.5 um", "1 um", "2 um", "4 um"]
    linear = planned(paper, slip={"from": 0, "to": 0.3, "count": 4}).points
    assert [point["contact.slip"] for point in linear] == pytest.approx([0.0, 0.1, 0.2, 0.3])


def test_a_latin_hypercube_has_one_point_in_every_interval_of_every_quantity(paper):
    plan = planned(
        paper,
        sq=sq_range(scale="log"),
        slip={"from": 0.0, "to": 0.5},
        surface={"kind": ["gaussian"]},
        samples=20,
    )
    slips = sorted(point["contact.slip"] for point in plan.points)
    assert [int(20 * slip / 0.5) for slip in slips] == list(range(20))
    repeated = planned(
        paper,
        sq=sq_range(scale="log"),
        slip={"from": 0.0, "to": 0.5},
        surface={"kind": ["gaussian"]},
        samples=20,
    )
    assert repeated.points == plan.points


def test_the_same_case_has_the_same_id_however_it_is_written(paper):
    case = plan_points(paper, [{"surface.sq": "0.5 um"}]).cases[0]
    rewritten = plan_points(paper, [{"surface.sq": "500 nm"}]).cases[0]
    assert case.id == rewritten.id
    assert case.overrides["surface.seed"] == rewritten.overrides["surface.seed"]
    assert plan_points(paper, [{"surface.sq": "0.51 um"}]).cases[0].id != case.id
    harder = paper.with_overrides({"material.hardness": "3 GPa"})
    assert plan_points(harder, [{"surface.sq": "0.5 um"}]).cases[0].id != case.id


def test_adding_levels_or_seeds_keeps_the_existing_cases(paper):
    few = {case.id for case in planned(paper, sq=["1 um", "2 um"], seeds=2).cases}
    more = {case.id for case in planned(paper, sq=["0.5 um", "1 um", "2 um"], seeds=3).cases}
    assert few < more


def test_common_seeds_depend_on_the_realisation_only(paper):
    plan = planned(paper, sq=["1 um", "2 um"], seeds=3, seeding="common")
    seeds = [case.overrides["surface.seed"] for case in plan.cases]
    assert seeds[:3] == seeds[3:]
    assert len(set(seeds)) == 3


def test_given_seeds_are_the_surfaces_seeds(paper):
    plan = planned(paper, sq=["1 um", "2 um"], seeds=[7, 11])
    assert [case.overrides["surface.seed"] for case in plan.cases] == [7, 11, 7, 11]


def test_a_change_of_the_measured_surface_changes_the_case_ids(paper, tmp_path):
    heights = "1 2 3\n2 3 4\n5 6 7\n"
    (tmp_path / "map.txt").write_text(heights)
    case = load_case(paper.text, folder=tmp_path).with_overrides({"surface": {"file": "map.txt"}})
    before = plan_points(case, [{"contact.load": "200 N"}]).cases[0].id
    (tmp_path / "map.txt").write_text(heights.replace("7", "8"))
    assert plan_points(case, [{"contact.load": "200 N"}]).cases[0].id != before


REFUSED = [
    ({"sqq": ["1 um"]}, "study.sqq is not a key of the case; did you mean sq?"),
    ({"seed": [1, 2]}, "surface.seed or vibration.seed"),
    ({"sq": sq_range()}, "study.sq needs either step or count"),
    ({"sq": sq_range(step="0.1 um", count=3)}, "study.sq needs either step or count"),
    ({"sq": sq_range(step="0 um")}, "study.sq.step must be positive"),
    (
        {"sq": sq_range(step="0.1 N")},
        'must have the unit um, as the start of the range, got "0.1 N"',
    ),
    ({"sq": {"from": "2 um", "to": "1 um", "step": "1 um"}}, "study.sq must be ascending"),
    ({"sq": ["1 N"]}, "surface.sq must be a length"),
    ({"sq": ["1 foobar"]}, 'got "1 foobar", whose unit is unknown'),
    ({"sq": [1]}, "got the bare number 1"),
    ({"correlation_length": [[40, 40]]}, "got the bare number 40"),
    ({"lubricant": {"viscosity": [{"law": "barus", "eta0": 0.04, "alpha": 22}]}}, "bare number"),
    ({"sq": []}, "study.sq must be a list of values or a range"),
    ({"sq": ["1 um"], "surface": {"sq": ["2 um"]}}, "sweeps one quantity twice"),
    ({"kind": "solve"}, "study varies nothing"),
    ({"sq": sq_range(step="0.1 pm"), "seeds": 5}, "use larger steps"),
    ({"sq": sq_range(step="1 um"), "seeds": 0}, "study.seeds must be 1 or more"),
    ({"slip": {"from": 0, "to": 1, "count": 3, "scale": "log"}}, "must be positive on a log scale"),
    ({"load": ["200 N", "0.2 kN"]}, "has the point contact.load = 0.2 kN twice"),
    ({"load": ["200 N", "300 N"], "samples": 3}, "twice; write each value once"),
    ({"sq": ["1 um"], "seeds": [3, 3]}, "seeds must differ from one another, got 3, 3"),
    (
        {"sq": ["1 um"], "surface": [{"kind": "flat"}]},
        "sweeps surface and surface.sq, a part of it",
    ),
    ({"motion": {"steps": [3, 4]}}, "study.motion.steps has no effect in a study"),
]


@pytest.mark.parametrize(("study", "sentence"), REFUSED)
def test_an_invalid_study_is_refused_in_one_sentence(paper, study, sentence):
    with pytest.raises(BadInput) as caught:
        planned(paper, **study)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_error_for_a_case_without_a_study_explains_how_to_add_one(paper):
    with pytest.raises(BadInput, match=r"add \[study\] with the quantity to vary"):
        plan_study(paper.with_overrides({"study": "none"}))


def test_the_text_of_a_case_restates_its_study(paper):
    case = paper.with_overrides(
        {
            "study": {
                "sq": sq_range(count=3),
                "contact": {"load": ["200 N"]},
                "seeds": [1, 2],
                "samples": 4,
            }
        }
    )
    assert load_case(case.text) == case
    assert plan_study(load_case(case.text)).points == plan_study(case).points


def test_swept_tables_keep_the_seeds_they_specify(paper):
    plan = planned(
        paper,
        surface=[
            {"kind": "gaussian", "sq": "1 um", "correlation_length": "30 um"},
            {"kind": "gaussian", "sq": "2 um", "correlation_length": "30 um", "seed": 5},
            {"kind": "flat"},
        ],
        lubricant={"viscosity": [{"law": "roelands", "eta0": "0.1 Pa s", "alpha": "20 1/GPa"}]},
        seeds=2,
    )
    assert plan.axes == ("surface", "lubricant.viscosity")
    cases = [paper.with_overrides(case.overrides) for case in plan.cases]
    assert [case.contents.surface.kind for case in cases] == 2 * ["gaussian"] + 2 * [
        "gaussian"
    ] + 2 * ["flat"]
    assert cases[0].contents.surface.seed != cases[1].contents.surface.seed
    assert [case.contents.surface.seed for case in cases[2:4]] == [5, 5]
    assert {case.contents.lubricant.viscosity.law for case in cases} == {"roelands"}
    assert len({case.id for case in plan.cases}) == 6
    assert "seed" not in plan.points[0]["surface"]
    assert planned(
        paper, viscosity=[{"law": "barus", "eta0": "1 Pa s", "alpha": "20 1/GPa"}]
    ).axes == ("lubricant.viscosity",)


def test_a_change_of_one_swept_surface_file_changes_only_its_case_id(paper, tmp_path):
    files = [tmp_path / "one.txt", tmp_path / "two.txt"]
    for file in files:
        file.write_text("1 2 3")
    measured = paper.with_overrides({"surface": {"file": str(files[0]), "pixel": "1 um"}})
    study = {"surface": {"file": [str(file) for file in files]}}
    before = [case.id for case in planned(measured, **study).cases]
    files[1].write_text("1 2 4")
    after = [case.id for case in planned(measured, **study).cases]
    assert before[0] == after[0]
    assert before[1] != after[1]


def test_values_in_a_file_need_their_unit(paper):
    text = paper.text.split("[study]")[0] + "[study]\nsq = [1.0]\n"
    with pytest.raises(BadInput, match="got the bare number 1"):
        plan_study(load_case(text))
