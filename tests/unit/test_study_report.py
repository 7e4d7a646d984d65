"""Page and figures of a study: they show the numbers of the table beside the published ones, and
report failures.
"""

import io
import json
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest
from matplotlib.colors import to_rgb
from scipy.stats import t as student
from test_report import Page, texts_of

import asperity
from asperity.case import load_case
from asperity.cli import main
from asperity.core.errors import BadInput
from asperity.paper import PAPER_ANCHORS, Anchor, is_papers_contact
from asperity.report import base, write_study_report
from asperity.report.study import contacts
from asperity.report.study.curve import resonance, rig, shares
from asperity.report.study.page import render_study_page, study_exhibits
from asperity.report.study.sweep import output_curves
from asperity.report.study.tables import anchor_rows
from asperity.report.style import CONTACT_COLOUR, ON_PAGE, ON_PAPER
from asperity.study import (
    StudyOverview,
    StudyResult,
    curve_from_study,
    group_means,
    load_study,
    overview,
    plan_points,
    plan_study,
    run_study,
    swept_axis,
)

PAPERS = load_case(Path(__file__).parents[2] / "examples" / "paper.toml")
SMALL = PAPERS.with_overrides(
    {"grid.cells": "[48, 32]", "surface.correlation_length": "40 um"}
).with_overrides({"contact.roughness": "standing"})
LEVELS_UM = (0.75, 1.0, 2.0, 3.5)
PRINTED_CAR = {
    0.5: 5.57,
    2.5: 59.22,
}  # Sq [um] and CAR [%], section 3.1 of Xu et al., Lubricants 2025, 13, 78
PRINTED_CRF = {0.54: 2921.93, 3.49: 3811.88}  # Sq [um] and CRF [Hz], its section 4.2
RINGS_UM = (
    0.54,
    0.87,
    1.25,
    1.31,
    1.64,
    1.68,
    1.92,
    2.17,
    2.43,
    2.90,
    3.06,
    3.49,
)  # its section 4.1
RINGS_STD_UM = (0.10, 0.08, 0.05, 0.05, 0.10, 0.06, 0.10, 0.08, 0.05, 0.05, 0.10, 0.06)


@pytest.fixture
def without_image_files(monkeypatch):
    """Draw figures without encoding them; for tests of text."""
    monkeypatch.setattr(base, "svg", texts_of)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A small wear study, solved and stored."""
    folder = tmp_path_factory.mktemp("study") / "wear"
    points = [{"surface.sq": f"{sq} um"} for sq in LEVELS_UM]
    with ThreadPoolExecutor(1) as executor:
        run_study(plan_points(SMALL, points, seeds=3), out=folder, executor=executor)
    return folder


@pytest.fixture(scope="module")
def wear(folder):
    return load_study(folder)


@pytest.fixture(scope="module")
def overview_of_wear(wear):
    return StudyOverview(wear)


@pytest.fixture(scope="module")
def page(written):
    return Page(written[0].read_text("utf-8"))


def synthetic_study(points, *, case=PAPERS, seeds=1, **columns):
    """A study with the given columns in its table."""
    plan = plan_points(case, points, seeds=seeds)
    table = pandas.DataFrame(
        {
            "case_id": [planned.id for planned in plan.cases],
            "number": [planned.number for planned in plan.cases],
            "point": [planned.point for planned in plan.cases],
            "realisation": [planned.realisation for planned in plan.cases],
            "status": "done",
            "reason": "",
            **columns,
        }
    )
    return StudyResult(plan, table)


def with_knee(knee_um=2.5, *, seeds=5, scatter_hz=4.0):
    """A wear study whose CRF rises at 400 Hz/um up to the knee and at 20 Hz/um after it."""
    sq_um = np.repeat(np.arange(0.5, 4.01, 0.25), seeds)
    random = np.random.default_rng(5)
    crf = 2800.0 + 400.0 * np.minimum(sq_um, knee_um) + 20.0 * np.maximum(sq_um - knee_um, 0.0)
    crf += random.normal(0.0, scatter_hz, crf.size)
    vibration = {
        f"{name}_{preset}{unit}": values
        for preset in ("sound", "paper")
        for name, unit, values in (
            ("crf", "_hz", crf),
            ("crf_std", "_hz", np.full(crf.size, 1.0)),
            ("crfa", "", 0.02 * sq_um),
        )
    }
    shares = {"clr": 0.2 * sq_um, "car": 0.1 * sq_um, "car_domain": 0.15 * sq_um}
    points = [{"surface.sq": f"{sq:g} um"} for sq in np.unique(sq_um)]
    return synthetic_study(
        points,
        seeds=seeds,
        **{"surface.sq": 1e-6 * sq_um},
        **shares,
        **vibration,
        full_load_crf_hz=3834.0,
    )


def without_maps(result):
    """Overview without contact maps, for a study that was not solved."""
    overview = StudyOverview(result)
    overview.__dict__["mapped"] = []
    return overview


def page_of(study):
    """The parsed page of a study."""
    return Page(render_study_page(study, study_exhibits(study), lambda _: None))


def figure_of(exhibit, result, anchors=None, medium=ON_PAPER):
    """Draw an exhibit of a wear study."""
    study = StudyOverview(result, anchors)
    return exhibit(study, study.curve).figure(medium)


def with_ordinary_spaces(text):
    """`text` with ordinary instead of no-break spaces."""
    return text.replace("\N{NO-BREAK SPACE}", " ")


def line(axes, label):
    (match,) = [curve for curve in axes.get_lines() if curve.get_label() == label]
    return match


def points_of(axes, label):
    """Coordinates x, y of the markers of an error bar."""
    (bars,) = [container for container in axes.containers if container.get_label() == label]
    return bars[0].get_xydata()


# The page
# -------------------------------------------------------------------------------------------------


def test_the_page_loads_no_external_resources(page):
    assert not {tag for tag, _ in page.tags} & {
        "script",
        "iframe",
        "object",
        "embed",
        "video",
        "audio",
    }
    for tag, attributes in page.tags:
        for name in ("src", "href", "srcset", "data"):
            target = attributes.get(name, "data:")
            linked = tag == "a" and target.startswith(
                ("#", "https://doi.org/")
            )  # a link alone loads nothing
            assert linked or target.startswith("data:"), (tag, name, target[:80])
    assert len(page.images()) == 5  # the paper's Figs 5, 6, 7, 8 and 13
    assert all(len(image["alt"]) > 40 for image in page.images())
    assert "url(" not in re.sub(r'src="data:[^"]*"', "", page.html)


def test_levels_are_means_with_students_interval(page, wear):
    clr = 100.0 * wear.table.loc[np.isclose(wear.table["surface.sq"], 2e-6), "clr"]
    reach = student.ppf(0.95, 2) * clr.std() / np.sqrt(3)
    (row,) = [row for row in page.rows if row[:2] == ["2", "3"]]
    values = [float(number.replace("−", "-")) for number in re.findall(r"−?[\d.]+", row[2])]
    assert values == pytest.approx([clr.mean(), clr.mean() - reach, clr.mean() + reach], abs=0.051)


def test_anchors_are_listed_in_a_table(page, wear):
    rows = {
        with_ordinary_spaces(row[0]).split(" section")[0]: row[1:]
        for row in page.rows
        if "Lubricants" in row[0]
    }
    assert len(rows) == len(PAPER_ANCHORS)
    published, computed, *_ = rows["CRF at 3.49 µm, rig"]
    assert published.startswith("3812 ±")
    crf = wear.table.groupby("surface.sq")["crf_sound_hz"].mean().to_numpy()
    interpolated = np.interp(3.49, LEVELS_UM, crf)
    assert float(computed.removesuffix(" Hz")) == pytest.approx(interpolated, abs=0.6)
    assert rows["CAR of the domain at 0.5 µm"][1:] == [
        "–",
        "–",
        "–",
        "NO",
    ]  # the study begins at 0.75 um


def test_the_page_states_what_was_computed(page, wear):
    facts = {
        name: with_ordinary_spaces(value)
        for name, value in (row for row in page.rows if len(row) == 2)
    }
    assert facts["Cases"] == "12: 4 points of 3 surfaces"
    assert facts["surface.sq"] == "0.75 µm, 1.0 µm, 2.0 µm, 3.5 µm"
    assert f"asperity {asperity.__version__}" in facts["Versions"]
    assert wear.plan.case.text in page.text


@pytest.mark.usefixtures("without_image_files")
def test_failures_are_reported_and_excluded():
    study = with_knee()
    with_failures = study.table.copy()
    with_failures.loc[3, ["status", "reason", "clr"]] = ["failed", "<b>no</b> surface", 9.0]
    with_failures.loc[7, ["status", "reason", "clr"]] = ["not converged", "stalled", 9.0]
    overview = without_maps(replace(study, table=with_failures))
    page = page_of(overview)
    assert ("section", {"class": "verdict unfinished"}) in page.tags
    assert "2 of 75 cases failed or did not converge" in page.text
    (row,) = [row for row in page.rows if row[0] == "failed: <b>no</b> surface"]
    assert [with_ordinary_spaces(cell) for cell in row[1:]] == [
        "1",
        "surface.sq 0.5 µm (1 of 5 surfaces)",
    ]
    axes = figure_of(shares, overview.result, (), ON_PAGE).axes[0]
    assert line(axes, "CLR").get_ydata()[0] == pytest.approx(10.0)  # 0.2 per micrometre, not 900 %
    assert max(np.max(curve.get_ydata()) for curve in axes.get_lines()) < 100.0


def test_many_failure_reasons_are_summarised():
    study = with_knee()
    table = study.table.copy()
    table.loc[:13, "status"] = "not converged"
    table.loc[:13, "reason"] = [
        f"stalled at a residual of {number}e-3" for number in (1, 1, *range(1, 13))
    ]
    reasons = without_maps(replace(study, table=table)).reasons
    assert [reason.number for reason in reasons] == [3] + 9 * [1] + [2]
    assert reasons[-1].text == "2 other reasons"


def test_a_study_with_only_failures_has_a_page_and_an_empty_study_is_refused():
    study = with_knee()
    failed = replace(study, table=study.table.assign(status="failed", reason="no oil"))
    page = page_of(StudyOverview(failed))
    assert "75 OF 75 CASES FAILED" in page.text
    assert not page.images()
    with pytest.raises(BadInput, match=r"no computed case yet, of 75"):
        StudyOverview(replace(study, table=study.table[:0]))


@pytest.mark.usefixtures("without_image_files")
def test_a_case_without_vibration_shows_no_resonance():
    study = with_knee()
    vibration = [name for name in study.table if name.startswith("crf")] + ["full_load_crf_hz"]
    overview = without_maps(replace(study, table=study.table.drop(columns=vibration)))
    page = page_of(overview)
    assert len(page.images()) == 1  # Fig 7 alone
    assert "The case has no [vibration]" in page.text
    anchors = [row[0] for row in page.rows if "Lubricants" in row[0]]
    assert len(anchors) == 10  # CAR and CLR
    assert not any("CRF at" in name or "split" in name for name in anchors)


def test_an_unfinished_study_has_a_note():
    study = with_knee()
    overview = without_maps(replace(study, table=study.table[:60]))
    assert overview.notes == ["15 of 75 cases have not been computed yet: run the study again."]


# The paper's figures
# -------------------------------------------------------------------------------------------------


def test_shares_over_sq_with_the_printed_car(wear):
    axes = figure_of(shares, wear).axes[0]
    for label, column in (
        ("CLR", "clr"),
        ("CAR", "car"),
        ("CAR of the domain", "car_domain"),
    ):
        means = wear.table.groupby("surface.sq")[column].mean()
        drawn = line(axes, label).get_xydata()
        assert drawn == pytest.approx(np.column_stack([LEVELS_UM, 100.0 * means]))
    assert dict(points_of(axes, "CAR, printed")) | dict(
        axes.containers[1][0].get_xydata()
    ) == pytest.approx(PRINTED_CAR)
    assert axes.get_ylim()[1] >= 100.0
    assert axes.get_ylabel().endswith("[%]")


def test_stages_are_marked_where_crf_bends():
    figure = figure_of(resonance, with_knee(2.5))
    for axes in figure.axes:
        (strip,) = [patch for patch in axes.patches if patch.get_label() == "split, 90 %"]
        low, high = strip.get_x(), strip.get_x() + strip.get_width()
        assert low <= 2.5 <= high
        assert high - low < 0.3
        splits = sorted(
            float(curve.get_xdata()[0])
            for curve in axes.get_lines()
            if "printed split" in str(curve.get_label())
        )
        assert splits == [1.8, 2.5]  # simulated and between the rig's samples of 1.68 and 1.92 um
    assert [text.get_text() for text in figure.axes[0].texts] == ["normal", "severe"]
    assert dict(points_of(figure.axes[0], "CRF of the rig, printed")) == pytest.approx(
        {0.54: 2921.93}
    )


def test_levels_without_a_resonance_stay_on_the_axis():
    study = with_knee()
    table = study.table.copy()
    table.loc[
        table["surface.sq"] < 3.9e-6, ["crf_sound_hz", "crfa_sound", "crf_paper_hz", "crfa_paper"]
    ] = np.nan
    figure = figure_of(resonance, replace(study, table=table), ())
    # matplotlib warns if the label of a stage lies outside the axes and leaves them no room
    figure.savefig(io.BytesIO())
    low, high = figure.axes[0].get_xlim()
    assert low < 0.5
    assert high > 4.0


def test_a_preset_without_a_resonance_has_no_panel(wear):
    table = wear.table.assign(crf_paper_hz=np.nan, crfa_paper=np.nan)
    figure = figure_of(resonance, replace(wear, table=table), (), ON_PAGE)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["Vibration preset: sound", ""]


@pytest.mark.usefixtures("without_image_files")
def test_too_few_levels_for_a_split_have_no_tile(wear):
    assert "Split, preset" not in page_of(without_maps(wear)).text
    assert "Split, preset" in page_of(without_maps(with_knee())).text


def test_a_smooth_curve_has_no_stages(wear):
    figure = figure_of(resonance, wear, (), ON_PAGE)
    assert not [patch for axes in figure.axes for patch in axes.patches]
    assert [text.get_text() for text in figure.axes[0].texts] == ["too few"]


def test_the_rigs_rings_are_plotted_beside_the_prediction():
    curve = curve_from_study(with_knee(2.5, scatter_hz=0.01))
    axes = rig(curve, "sound").figure(ON_PAPER).axes[0]
    predicted = points_of(axes, "study at a ring's Sq")
    sq = np.array(RINGS_UM)
    expected = 2800.0 + 400.0 * np.minimum(sq, 2.5) + 20.0 * np.maximum(sq - 2.5, 0.0)
    assert predicted == pytest.approx(np.column_stack([sq, expected]), rel=1e-4)
    (bars,) = [item for item in axes.containers if item.get_label() == "study at a ring's Sq"]
    horizontal = bars[2][0].get_segments()
    assert [bar[1, 0] - bar[0, 0] for bar in horizontal] == pytest.approx(
        2.0 * np.array(RINGS_STD_UM)
    )
    assert dict(points_of(axes, "rings, published CRF")) == pytest.approx(PRINTED_CRF)


def test_maps_show_the_contact_of_the_study(overview_of_wear, wear):
    figure = contacts.contact_maps(overview_of_wear.runs).figure(ON_PAPER)
    panels = [axes for axes in figure.axes if axes.images]
    first_rows = wear.table.groupby("surface.sq").first()
    assert len(panels) == len(LEVELS_UM)
    for axes, (sq, row), run in zip(
        panels, first_rows.iterrows(), overview_of_wear.runs, strict=True
    ):
        title = axes.get_title("left")
        assert f"Sq {1e6 * sq:.3g} µm" in title
        shares = [float(share) for share in re.findall(r"([\d.]+) %", title)]
        assert shares == pytest.approx(
            [100 * row[name] for name in ("clr", "car", "car_domain")], abs=0.051
        )
        image = np.asarray(axes.images[0].get_array())
        yellow = np.all(np.isclose(image, to_rgb(CONTACT_COLOUR)), axis=2)
        in_zone = np.abs(run.case.grid.x) <= run.case.conditions.hertz.half_widths[0]
        assert yellow[:, in_zone].mean() == pytest.approx(row["car"])  # an image's rows are y
    assert not any("mapped" in note for note in overview_of_wear.notes)


def test_surfaces_share_one_scale(overview_of_wear):
    figure = contacts.surface_maps(overview_of_wear.runs).figure(ON_PAPER)
    images = [axes.images[0] for axes in figure.axes if axes.images]
    assert len({image.get_clim() for image in images}) == 1
    spread = [float(np.std(image.get_array())) for image in images]
    assert spread == pytest.approx(LEVELS_UM, rel=1e-6)  # um


@pytest.mark.usefixtures("short_tracks", "in_this_process")
def test_maps_of_running_roughness_are_the_contacts_of_the_table():
    """They were solved on another grid, and a note blamed other versions of asperity."""
    few = {"grid.cells": "[96, 64]", "surface.correlation_length": "40 um"}
    case = PAPERS.with_overrides({**few, "study": {"sq": ["0.5 um", "1 um"], "seeds": 1}})
    result = run_study(plan_study(case), workers=1)
    assert not [note for note in StudyOverview(result).notes if "mapped" in note]


def test_a_map_that_differs_from_the_table_is_noted(wear, overview_of_wear):
    table = wear.table.copy()
    table.loc[table["number"] == 3, "clr"] += 0.01
    overview = StudyOverview(replace(wear, table=table))
    overview.__dict__["runs"] = overview_of_wear.runs
    (note,) = (note for note in overview.notes if "mapped" in note)
    assert note.startswith("The contact mapped at Sq 1 µm has a CLR of")


@pytest.mark.parametrize(
    ("overrides", "papers"),
    [
        ({}, True),
        ({"material.hardness": "0.65 GPa", "contact.entrainment_speed": "2 m/s"}, True),
        ({"contact.load": "200 N"}, False),
        ({"contact.geometry": "point", "contact.length": "none"}, False),
        ({"lubricant": "none"}, False),
    ],
)
def test_published_numbers_are_shown_for_the_papers_contact_only(overrides, papers):
    assert is_papers_contact(PAPERS.with_overrides(overrides)) is papers


def test_user_anchors_replace_the_papers_anchors(wear, overview_of_wear):
    anchors = (Anchor(name="CLR of my rig", quantity="clr", value=0.7, tolerance=0.1, sq=2e-6),)
    overview = StudyOverview(wear, anchors)
    overview.__dict__["runs"] = overview_of_wear.runs
    assert [exhibit.name for exhibit in study_exhibits(overview)] == [
        "shares",
        "resonance",
        "contact-maps",
        "surfaces",
    ]
    axes = figure_of(shares, wear, anchors, ON_PAGE).axes[0]
    assert points_of(axes, "CLR, given") == pytest.approx(np.array([[2.0, 70.0]]))
    assert [row["name"] for row in anchor_rows(overview)] == ["CLR of my rig"]


# Any other study
# -------------------------------------------------------------------------------------------------


def two_quantity_study():
    points = [
        {"contact.load": f"{load} N", "surface.correlation_length": length}
        for load in (200, 300)
        for length in ("10 um", "0.02 mm", "80 um")
    ]
    clr = np.array([10, 20, 30, 40, 50, 60, 70, 80, 90, 15, 25, 35]) / 100.0
    return synthetic_study(points, seeds=2, clr=clr, crf_hz=3000.0 + 100.0 * clr)


def test_means_over_two_quantities_are_shown_as_a_map():
    overview = StudyOverview(two_quantity_study())
    assert [exhibit.name for exhibit in study_exhibits(overview)] == [
        "against-contact-load",
        "against-surface-correlation-length",
        "over-contact-load-and-surface-correlation-length",
    ]
    figure = study_exhibits(overview)[-1].figure(ON_PAPER)
    image = figure.axes[0].images[0].get_array()
    assert np.asarray(image) == pytest.approx(
        np.array([[15, 75], [35, 52.5], [55, 30]])
    )  # means of pairs, computed by hand
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert labels == ["10", "20", "80"]  # um, one of them written in mm
    assert figure.get_supylabel() == "correlation length [µm]"
    assert figure.get_supxlabel() == "load [N]"


def test_map_cells_without_a_case_have_no_colour():
    study = two_quantity_study()
    study.table.loc[study.table["point"] == 4, "status"] = "failed"
    figure = study_exhibits(StudyOverview(study))[-1].figure(ON_PAGE)
    image = np.ma.filled(figure.axes[0].images[0].get_array(), np.nan)
    assert np.isnan(image[1, 1])
    assert np.isnan(image).sum() == 1


def test_means_against_one_quantity_have_students_interval():
    overview = StudyOverview(two_quantity_study())
    axes = study_exhibits(overview)[0].figure(ON_PAPER).axes[0]
    at_200 = np.array([10, 20, 30, 40, 50, 60])
    (bars,) = axes.containers
    assert bars[0].get_xydata() == pytest.approx(np.array([[200, 35], [300, 52.5]]))
    reach = student.ppf(0.95, 5) * at_200.std(ddof=1) / np.sqrt(6)
    assert bars[2][0].get_segments()[0][:, 1] == pytest.approx([35 - reach, 35 + reach])


def test_samples_are_averaged_in_groups():
    sq = np.random.default_rng(1).uniform(0.5, 3.0, 40)
    points = [
        {"surface.sq": f"{value:.4f} um", "lubricant.viscosity.alpha": "20 1/GPa"} for value in sq
    ]
    overview = StudyOverview(synthetic_study(points, clr=sq / 4.0))
    (axis,) = overview.axes  # alpha has a single value and no axis
    assert axis.binned
    x, mean, low, high = group_means("crf_hz", axis.values, 25.0 * axis.values, binned=True)
    assert len(x) == 8
    assert mean == pytest.approx(25.0 * x)
    assert mean.mean() == pytest.approx(25.0 * axis.values.mean())  # groups of five
    assert np.all((low < mean) & (mean < high))
    assert len(page_of(overview).images()) == 1


@pytest.mark.parametrize(
    ("values", "logarithmic"),
    [((10, 20, 40, 80), True), ((1, 2, 3, 4, 5), False), ((1, 10), False), ((0, 1, 9), False)],
)
def test_geometrically_spaced_values_get_a_logarithmic_axis(values, logarithmic):
    study = synthetic_study(
        [{"contact.slip": float(value)} for value in values], clr=np.arange(len(values))
    )
    assert swept_axis(study.plan, study.table, "contact.slip").logarithmic is logarithmic


def test_a_key_that_a_point_does_not_set_has_the_cases_value():
    study = synthetic_study([{"contact.load": "200 N"}, {"surface.sq": "2 um"}], clr=[0.1, 0.2])
    assert swept_axis(study.plan, study.table, "contact.load").values.tolist() == [200.0, 500.0]
    assert swept_axis(study.plan, study.table, "surface.sq").values.tolist() == [1.0, 2.0]


def test_many_cases_are_drawn_as_a_raster_image():
    sq = np.linspace(0.5, 3.0, 4000)
    study = synthetic_study(
        [{"surface.sq": f"{value:.6f} um"} for value in sq], clr=sq / 4.0, car=sq / 5.0
    )
    axis = swept_axis(study.plan, study.table, "surface.sq")
    figure = output_curves(StudyOverview(study), axis).figure(ON_PAGE)
    drawing = io.BytesIO()
    figure.savefig(drawing, format="svg")
    assert drawing.tell() < 200_000  # 8000 dots as vector graphics take a megabyte


def test_non_numeric_values_are_categories_on_an_axis():
    points = [
        {"surface.correlation_length": pair} for pair in (["10 um", "40 um"], ["20 um", "40 um"])
    ]
    study = synthetic_study(points, clr=[0.1, 0.2])
    axis = swept_axis(study.plan, study.table, "surface.correlation_length")
    assert axis.names == ("10 um, 40 um", "20 um, 40 um")
    assert axis.values.tolist() == [0.0, 1.0]


# On disk and from the command line
# -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def written(wear, tmp_path_factory):
    """Page and folder of figures, written from Python."""
    out = tmp_path_factory.mktemp("written")
    write_study_report(wear, out / "page.html", figures=out / "paper" / "figures")
    return out / "page.html", out / "paper" / "figures"


def test_figures_and_tables_for_a_paper_are_written(written, wear):
    _, out = written
    names = ("shares", "rig", "resonance", "contact-maps", "surfaces")
    for name in names:
        for width_mm in (85, 175):
            document = (out / f"{name}-{width_mm}mm.pdf").read_bytes()
            assert document.startswith(b"%PDF")
            width = float(re.search(rb"/MediaBox \[ ?0 0 ([\d.]+)", document)[1])
            assert width / 72.0 * 25.4 == pytest.approx(width_mm, abs=0.1), name
            assert b"/FontFile2" in document  # TrueType, so that text can be searched and edited
            assert b"/Type3" not in document
        assert f"**{name}**" in (out / "captions.md").read_text("utf-8")
    cases = pandas.read_csv(out / "cases.csv")
    assert cases["clr"].to_numpy() == pytest.approx(wear.table["clr"].to_numpy(), rel=1e-12)
    levels = pandas.read_csv(out / "levels.csv")
    assert levels["sq_um"].to_numpy() == pytest.approx(np.array(LEVELS_UM))
    rig = pandas.read_csv(out / "rig-sound.csv")
    assert rig["sq_um"].tolist() == list(RINGS_UM)
    assert {file.suffix for file in out.iterdir()} == {".pdf", ".csv", ".md"}


def test_the_command_writes_identical_files(written, folder, tmp_path, capsys):
    with pytest.raises(SystemExit) as end:
        main(
            [
                "report",
                str(folder),
                "--out",
                str(tmp_path / "p.html"),
                "--figures",
                str(tmp_path / "f"),
                "--json",
            ]
        )
    assert not end.value.code
    printed = json.loads(capsys.readouterr().out)
    assert printed["report"] == str(tmp_path / "p.html")
    assert printed["figures"] == str(tmp_path / "f")
    assert (printed["cases"], printed["failed"]) == (12, 0)
    page, figures = written
    assert (tmp_path / "p.html").read_bytes() == page.read_bytes()
    assert {file.name for file in (tmp_path / "f").iterdir()} == {
        file.name for file in figures.iterdir()
    }
    for file in figures.iterdir():
        assert file.read_bytes() == (tmp_path / "f" / file.name).read_bytes(), file.name


def test_an_unwritable_output_is_refused_before_anything_is_solved(wear, tmp_path, monkeypatch):
    monkeypatch.setattr(overview, "solve_case", lambda *_, **__: pytest.fail("solved first"))
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="it is a file; name a folder"):
        write_study_report(wear, tmp_path / "page.html", figures=tmp_path / "file")
    with pytest.raises(BadInput, match="does not exist"):
        write_study_report(wear, tmp_path / "nowhere" / "page.html")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["STUDY", "STUDY"], "a folder's page has no other contents"),
        (["STUDY", "--anchors", "none.toml"], "none.toml cannot be read"),
        (["run.nc", "--figures", "DIR"], "run.nc does not exist; check its name"),
        (["EMPTY"], "holds no study"),
        (["STUDY", "--out", "page.pdf"], "--out must be a file that ends in .html"),
    ],
)
def test_the_command_refuses_in_one_sentence(
    arguments, sentence, folder, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "EMPTY").mkdir()
    with pytest.raises(SystemExit) as end:
        main(["report", *(str(folder) if word == "STUDY" else word for word in arguments)])
    assert end.value.code == 2
    output = capsys.readouterr()
    assert not output.out
    assert sentence in output.err
    assert len(output.err.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["EMPTY"]
    assert not (folder / "report.html").exists()
