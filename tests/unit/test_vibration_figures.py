import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.coupling import VibrationModel, contact_vibration, dry_full_load
from asperity.paper import TABLE1_PRINTED, Table1Row, papers_contact
from asperity.report import (
    excitation_figure,
    response_figure,
    table1_figure,
    trend_over_load_figure,
    write_figure,
)

PAPER = VibrationModel.preset("paper", mass=0.1, damping_ratio=0.02)
CONTACT = papers_contact(200.0)


@pytest.fixture(scope="module")
def vibration():
    return contact_vibration(dry_full_load(CONTACT, 2e-6), CONTACT, PAPER)


def test_fig_3_shows_the_noise_before_filtering(vibration):
    from scipy.signal import butter, lfilter

    figure = excitation_figure(vibration, PAPER)
    noise, profile = (
        axes.get_lines()[0].get_ydata() for axes in (figure.get_axes()[0], figure.get_axes()[2])
    )
    filtered = lfilter(*butter(2, 30.0, fs=10e3), noise)
    assert profile / np.std(profile) == pytest.approx(filtered / np.std(filtered), abs=1e-6)
    assert [axes.get_xlabel() for axes in figure.get_axes()] == ["time [s]", "frequency [Hz]"] * 2


def test_fig_4_marks_the_detected_resonance(vibration):
    marked = response_figure(vibration, PAPER).get_axes()[3].get_lines()[2]
    assert marked.get_xdata()[0] == vibration.resonance.crf_hz
    assert marked.get_ydata()[0] == vibration.resonance.crfa


def test_the_load_trend_vanishes_with_fine_sampling():
    figure = trend_over_load_figure(PAPER)
    drawn = {line.get_label(): line.get_ydata() for line in figure.get_axes()[0].get_lines()}
    assert [label.split(":")[0] for label in drawn] == [
        "10 kHz",
        "20 kHz",
        "50 kHz",
        "200 kHz",
        "continuous",
    ]
    ratios = [values[0] / values[-1] for values in drawn.values()]
    assert ratios[0] > 5.0
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[-1] == pytest.approx(1.0, abs=1e-6)


def test_table_1_is_drawn_with_its_printed_values(tmp_path):
    rows = [
        Table1Row(
            cutoff_hz=fc,
            height_m=um * 1e-6,
            load_n=load,
            crf_hz=crf,
            crfa=a,
            crfa_low=a / 2,
            crfa_high=2 * a,
            paper_crf_hz=crf,
            paper_crfa=a,
        )
        for fc, um, load, crf, a in TABLE1_PRINTED
    ]
    figure = table1_figure(rows)
    height = figure.get_axes()[1]
    assert "height^2.0" in height.get_title("left")
    printed = next(line for line in height.get_lines() if line.get_label() == "paper")
    assert list(printed.get_ydata()) == [0.16, 0.64, 1.45, 2.58]
    path = write_figure(figure, tmp_path / "table1.png")
    assert path.read_bytes().startswith(b"\x89PNG")


def test_a_flat_contact_has_no_figure():
    flat = contact_vibration(dry_full_load(CONTACT, 0.0), CONTACT, PAPER)
    for draw in (excitation_figure, response_figure):
        with pytest.raises(BadInput, match="flat"):
            draw(flat, PAPER)
