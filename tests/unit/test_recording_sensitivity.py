"""Volts become accelerations or velocities by the sensitivity that header or sidecar states."""

import h5py
import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.recording import check_recording, open_recording, read_recording
from asperity.recording.sensitivity import parse_sensitivity, sensitivity_text

RATE = 5000.0
VOLTS = np.round(0.2 * np.random.default_rng(0).standard_normal(4000), 6)
G = 9.80665


def text_file(path, *header, unit="V", values=VOLTS):
    rows = (f"{k / RATE:.4f},{value:.6f}" for k, value in enumerate(values))
    path.write_text("\n".join([*header, f"time [s],acc [{unit}]", *rows]), "utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "volts_per_unit", "unit"),
    [
        ("Sensitivity: 100 mV/g", 0.1 / G, "m/s^2"),
        ("# sensor sensitivity = 100mV/g", 0.1 / G, "m/s^2"),
        ("Sensitivity (mV/g): 100", 0.1 / G, "m/s^2"),
        ("sensitivity_mv_per_g = 98.5", 0.0985 / G, "m/s^2"),
        ('"Sensitivity","0.1 V/g"', 0.1 / G, "m/s^2"),
        ("Empfindlichkeit: 10,2 mV/(m/s²)", 0.0102, "m/s^2"),
        ("Sensitivity: 10.2 mV/m/s^2", 0.0102, "m/s^2"),
        ("Sensitivity: 10.2 mV/ms-2", 0.0102, "m/s^2"),
        ("Sensitivity: 10 g/V", 0.1 / G, "m/s^2"),
        ("Sensitivity: 4 mV/mm/s", 0.004, "mm/s"),
        ("Sensitivity: 4 mV/(mm/s)", 0.004, "mm/s"),
        ("Sensitivity: 100 mV/ips", 0.1, "ips"),
    ],
)
def test_volts_are_converted_by_the_sensitivity_of_the_header(
    tmp_path, header, volts_per_unit, unit
):
    read = read_recording(text_file(tmp_path / "a.csv", header))
    assert read.unit == unit
    assert read.values == pytest.approx(VOLTS / volts_per_unit, rel=1e-9)
    assert read.facts["sensitivity"].source == "file"
    assert any("V converted by the sensitivity of" in note for note in read.notes)


def test_millivolts_and_a_sidecar(tmp_path):
    path = text_file(tmp_path / "a.csv", unit="mV", values=1e3 * VOLTS)
    (tmp_path / "a.csv.toml").write_text('sensitivity = "100 mV/g"')
    read = read_recording(path)
    assert read.values == pytest.approx(VOLTS / 0.1 * G, rel=1e-6)
    assert read.facts["sensitivity"].source == "a.csv.toml"
    assert read_recording(path, unit="g").values == pytest.approx(read.values)  # it agrees
    with pytest.raises(BadInput, match="states its unit as mV, the command line as mm/s"):
        read_recording(path, unit="mm/s")


@pytest.mark.parametrize(
    "stated",
    [
        {"sensitivity": "100 mV/g"},
        {"sensitivity_unit": "mV/g", "sensitivity": 100.0},
        {"Sensitivity": 100, "Sensitivity Units": "mV/g"},
    ],
)
def test_attributes_of_a_file_state_a_sensitivity(tmp_path, stated):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("acc", data=VOLTS)
        data.attrs.update({"fs_hz": RATE, "unit": "V"} | stated)
    assert read_recording(tmp_path / "a.h5").values == pytest.approx(VOLTS / 0.1 * G)


def test_each_channel_has_its_own_sensitivity(tmp_path):
    rows = (f"{k / RATE:.4f};{value:.6f};{value:.6f}" for k, value in enumerate(VOLTS))
    header = ["Sensitivity [mV/g];100;50", "time [s];a [V];b [V]"]
    (tmp_path / "a.csv").write_text("\n".join([*header, *rows]))
    for channel, volts in (("a", 0.1), ("b", 0.05)):
        read = read_recording(tmp_path / "a.csv", channel=channel)
        assert read.values == pytest.approx(VOLTS / volts * G, rel=1e-9)


def test_accelerations_are_not_converted_again(tmp_path):
    read = read_recording(text_file(tmp_path / "a.csv", "Sensitivity: 100 mV/g", unit="g"))
    assert read.values == pytest.approx(VOLTS * G)
    assert read.notes == ()


def test_a_stated_scale_takes_precedence_or_adds_to_it(tmp_path):
    path = text_file(tmp_path / "a.csv", "Sensitivity: 10 pC/g")
    assert read_recording(path, scale=10.0, unit="g").values == pytest.approx(10.0 * G * VOLTS)
    path = text_file(tmp_path / "a.csv", "Sensitivity: 100 mV/g")  # behind an amplifier of 10
    assert read_recording(path, scale=0.1, unit="V").values == pytest.approx(G * VOLTS)


def test_a_charge_is_refused_with_the_reason(tmp_path):
    path = text_file(tmp_path / "a.csv", "Sensitivity: 10 pC/g")
    with pytest.raises(BadInput, match="charge output, whose volts depend on the gain of its"):
        read_recording(path)


def test_contradicting_sensitivities_are_refused(tmp_path):
    path = text_file(tmp_path / "a.csv", "Sensitivity: 100 mV/g")
    (tmp_path / "a.csv.toml").write_text('sensitivity = "10.2 mV/(m/s^2)"')  # the same, rounded
    assert read_recording(path).unit == "m/s^2"
    (tmp_path / "a.csv.toml").write_text('sensitivity = "10 mV/g"')
    with pytest.raises(BadInput, match=r"of 100 mV/g, the a\.csv\.toml 10 mV/g"):
        read_recording(path)


@pytest.mark.parametrize(
    ("header", "unit", "remark"),
    [
        ("name: a", "V", "values are in V and no sensitivity is stated; state it, such as"),
        ("Sensitivity: high", "mV", "in mV and 'high' is not a sensitivity; state it"),
        ("Sensitivity: 100 mV/g", "-", "a sensitivity of 100 mV/g is stated, but no unit of the"),
    ],
)
def test_what_volts_lack_is_remarked(tmp_path, header, unit, remark):
    opened = open_recording(text_file(tmp_path / "a.csv", header, unit=unit))
    assert any(remark in sentence for sentence in check_recording(opened).remarks)


@pytest.mark.parametrize("text", ["100", "100 mV", "1 mV/N", "0 mV/g", "-5 mV/g", "1..2 V/g"])
def test_what_is_no_sensitivity_is_refused(tmp_path, text):
    with pytest.raises(BadInput, match="must be positive, in volts per unit such as 100 mV/g"):
        parse_sensitivity(text)
    path = text_file(tmp_path / "a.csv")
    (tmp_path / "recordings.toml").write_text(f'sensitivity = "{text}"')
    with pytest.raises(BadInput, match=r"recordings\.toml: a sensitivity must be positive"):
        read_recording(path)


@pytest.mark.parametrize(
    ("text", "volts"),
    [
        ("1,000.0 mV/g", 1.0),
        ("1.000,0 mV/g", 1.0),
        ("1,000,000 uV/g", 1.0),
        ("10,25 mV/g", 0.01025),
        ("0,102 V/g", 0.102),
        ("1000 mV/g", 1.0),
        ("1.000 mV/g", 1e-3),
    ],
)
def test_decimal_marks_and_thousands(text, volts):
    assert parse_sensitivity(text).volts == pytest.approx(volts)


def test_a_number_that_reads_in_two_ways_is_refused():
    with pytest.raises(BadInput, match=r"may be 1\.000 or 1000 mV/g; write it"):
        parse_sensitivity("1,000 mV/g")


@pytest.mark.parametrize(
    "attributes",
    [
        {"sensitivity_calibration_date": "2024-01-31", "sensitivity": "100 mV/g"},
        {"Transverse sensitivity": "1.2 %", "Sensitivity": "100 mV/g"},
        {"Sensitivity date": 20240131, "Sensitivity": 100, "Sensitivity Units": "mV/g"},
        {"Sensitivity": np.array([100.0, 100.0]), "Sensitivity Units": "mV/g"},
        {"Sensitivity": "[100.0, 100.0] mV/g"},
        {"Charge sensitivity": "10 pC/g", "Sensitivity": b"100 mV/g"},
    ],
)
def test_the_value_that_is_a_sensitivity_counts(attributes):
    assert parse_sensitivity(sensitivity_text(attributes.items())).volts == pytest.approx(0.1)


def test_several_values_are_listed():
    stated = {"Sensitivity": [100.0, 99.0], "Sensitivity Units": "mV/g"}
    assert sensitivity_text(stated.items()) == "100.0 mV/g; 99.0 mV/g"
