"""Studies with contact vibration: damping and stiffness against Sq, and their correlation with the
load share.
"""

import numpy as np
import pytest
from test_report import texts_of
from test_study_report import PAPERS, figure_of, page_of, synthetic_study, with_knee, without_maps

from asperity.report import base
from asperity.report.study.dynamic import clr_correlations, damping_over_roughness, rank_correlation
from asperity.report.study.page import study_exhibits
from asperity.report.study.sweep import sweep_exhibits
from asperity.report.style import ON_PAPER
from asperity.study import StudyOverview, curve_from_study


def vibrating(*, seeds=5):
    """A study in which damping falls with the load share and stiffness is independent of it; one
    case has neither.
    """
    result = with_knee(seeds=seeds)
    table, random = result.table, np.random.default_rng(3)
    table["contact_damping_ratio"] = 0.03 * (
        1.0 - table["clr"] / 0.85
    ) + 0.0003 * random.standard_normal(len(table))
    table["contact_damping_ratio_virgin"] = 1.5 * table["contact_damping_ratio"]
    table["contact_stiffness_n_m"] = 3.3e8 + 1e7 * random.standard_normal(len(table))
    table["contact_resonance_hz"] = 2900.0
    table.loc[7, ["contact_damping_ratio", "contact_stiffness_n_m"]] = np.nan
    return result


def test_damping_and_stiffness_are_plotted_against_sq_with_their_intervals():
    result = vibrating()
    curve = curve_from_study(result)
    upper, lower = figure_of(damping_over_roughness, result).axes
    (mean,) = [line for line in upper.get_lines() if line.get_label() == "yielded cells elastic"]
    assert mean.get_ydata() == pytest.approx(curve.mean("contact_damping_ratio"))
    assert "damping ratio" in upper.get_ylabel()
    assert lower.get_ylabel() == "k [N/µm]"
    assert 280.0 < lower.get_ylim()[0] < lower.get_ylim()[1] < 380.0


def test_the_load_share_is_plotted_against_each_indicator_with_its_rank_correlation():
    result = vibrating()
    panels = figure_of(clr_correlations, result).axes
    assert [panel.get_xlabel() for panel in panels[:3]] == ["CRF, sound [Hz]", "k [N/µm]", "ζ"]
    offsets = {panel.get_xlabel(): panel.collections[0].get_offsets() for panel in panels[:3]}
    assert len(offsets["ζ"]) == len(result.table) - 1
    exhibit = clr_correlations(StudyOverview(result), curve_from_study(result))
    for key in ("contact_damping_ratio", "contact_stiffness_n_m", "crf_sound_hz"):
        rank = rank_correlation(result.table, key)
        assert f"{rank:+.2f}".replace("-", "−") in exhibit.caption


def test_the_rank_correlation_agrees_with_spearman():
    from scipy.stats import spearmanr

    table = vibrating().table
    known = table.dropna(subset=["contact_damping_ratio"])
    assert rank_correlation(table, "contact_damping_ratio") == pytest.approx(
        spearmanr(known["clr"], known["contact_damping_ratio"]).statistic
    )
    assert rank_correlation(table, "contact_damping_ratio") < -0.95
    assert abs(rank_correlation(table, "contact_stiffness_n_m")) < 0.3
    assert np.isnan(rank_correlation(table, "contact_resonance_hz"))  # a constant has no ranks


def test_only_a_study_with_vibration_shows_damping_on_its_page_and_levels(monkeypatch):
    result = vibrating()
    *_, damping, correlations = study_exhibits(without_maps(result))
    assert (damping.name, correlations.name) == ("damping", "load-share-correlations")
    assert damping.picture().uri.startswith("data:image/svg+xml,%3Csvg ")
    assert correlations.picture().uri.startswith("data:image/svg+xml,%3Csvg ")
    monkeypatch.setattr(base, "svg", texts_of)  # the page's text is of interest below
    summary = curve_from_study(result).summary()
    assert summary["contact_damping_ratio"].to_numpy() == pytest.approx(
        curve_from_study(result).mean("contact_damping_ratio")
    )
    assert {
        "contact_damping_ratio_std",
        "contact_damping_ratio_low",
        "contact_stiffness_n_m",
    } <= set(summary)
    page = page_of(without_maps(result))
    assert "Contact damping ratio" in page.text
    static = with_knee()
    names = [exhibit.name for exhibit in study_exhibits(without_maps(static))]
    assert not {"damping", "load-share-correlations"} & set(names)
    assert "Damping ratio of the contact" not in page_of(without_maps(static)).text


def test_another_study_shows_the_damping_as_an_output():
    points = [{"contact.load": f"{load} N"} for load in (300, 400, 500)]
    result = synthetic_study(
        points,
        case=PAPERS,
        **{
            "contact.load": [300.0, 400.0, 500.0],
            "clr": [0.5, 0.6, 0.7],
            "contact_damping_ratio": [0.02, 0.015, 0.01],
            "contact_stiffness_n_m": [3.3e8, 3.31e8, 3.34e8],
        },
    )
    study = StudyOverview(result)
    assert {"contact_damping_ratio", "contact_stiffness_n_m"} <= set(study.outputs)
    (exhibit,) = sweep_exhibits(study)
    assert {"ζ", "k [N/µm]"} <= {
        panel.get_title(loc="left") for panel in exhibit.figure(ON_PAPER).axes
    }
    assert "contact_damping_ratio_std" in study.tables["points"]
