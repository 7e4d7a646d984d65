"""Reading recordings: all formats give the same signal; source of rate, unit and channel."""

from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.signals import power_spectrum
from asperity.recording import open_channels, open_recording, read_recording
from asperity.recording.units import acceleration_scale, name_and_unit
from asperity.resonance import contact_resonance
from support.recordings import RATE, SHARED, uff_set, vibration, write_all, write_uff

G = 9.80665
VALUES = vibration()
LOSSY = {
    "short.wav": 16.0 / 2**15,
    "long.wav": 16.0 / 2**31,
}  # least significant bit of the converter [g]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings")
    return path, write_all(path, VALUES)


def test_every_format_gives_the_same_signal(folder):
    path, inputs = folder
    assert len(inputs) == 21
    for name, options in inputs.items():
        recording = read_recording(path / name, **options)
        assert recording.rate_hz == RATE, name
        assert recording.unit == "m/s^2", name
        error = np.abs(recording.values / G - VALUES).max()
        assert error <= LOSSY.get(name, 1e-6) * 1.001, name
        assert recording.facts["rate"].source, name
        assert recording.notes == (), name


def test_metadata_name_their_source(folder):
    path, _ = folder
    facts = read_recording(path / "beside.dat").facts
    assert facts["rate"].source == "beside.dat.json"
    assert facts["started"].value == datetime(2024, 1, 31, 12)
    facts = read_recording(path / "2024.01.31.12.00.00", rate_hz=RATE).facts
    assert (facts["rate"].source, facts["unit"].value, facts["unit"].source) == (
        "command line",
        "unknown",
        "not stated",
    )
    assert (facts["started"].value, facts["started"].source) == (
        datetime(2024, 1, 31, 12),
        "file name",
    )
    assert read_recording(path / "german.csv").facts["rate"].source == "file (column 'Zeit')"


def test_a_recording_is_read_in_blocks(folder):
    path, inputs = folder
    for name, options in inputs.items():
        opened = open_recording(path / name, **options)
        blocks = list(opened.blocks(999))
        assert max(block.size for block in blocks) <= 999, name
        assert np.array_equal(np.concatenate(blocks), opened.read().values), name
        assert opened.samples == VALUES.size, name


def test_missing_metadata_are_requested(folder, tmp_path):
    path, _ = folder
    with pytest.raises(BadInput, match=r"bare.npy states no sampling rate; give `rate_hz`"):
        read_recording(path / "bare.npy")
    (tmp_path / "a.csv").write_text(
        "time,acc\n" + "".join(f"{i / 100:.2f},{i % 7}.5\n" for i in range(50))
    )
    with pytest.raises(BadInput, match=r"names no unit; in seconds: 100 Hz"):
        read_recording(tmp_path / "a.csv")
    np.save(tmp_path / "two.npy", np.ones((100, 2)))
    with pytest.raises(BadInput, match=r"holds 2 channels \(two\[1\], two\[2\]\); give channel"):
        read_recording(tmp_path / "two.npy", rate_hz=1.0)
    assert (
        read_recording(tmp_path / "two.npy", rate_hz=1.0, channel="2").facts["channel"].value
        == "two[2]"
    )
    with pytest.raises(
        BadInput, match="has no channel '²'; it has two"
    ):  # a digit that is not ASCII
        read_recording(tmp_path / "two.npy", rate_hz=1.0, channel="²")


def test_contradictory_metadata_are_refused(folder):
    path, _ = folder
    with pytest.raises(BadInput, match=r"states 5000 Hz in its header, the command line 4000 Hz"):
        read_recording(path / "float.wav", rate_hz=4000.0)
    with pytest.raises(BadInput, match=r"states its unit as g, the command line as m/s\^2"):
        read_recording(path / "facts.npz", unit="m/s^2")
    with pytest.raises(BadInput, match="has no channel 'z'; it has acc"):
        read_recording(path / "facts.npz", channel="z")


def test_integer_samples_without_scale_are_not_comparable(folder):
    path, _ = folder
    recording = read_recording(path / "short.wav")
    assert (recording.unit, recording.comparable) == ("full scale", False)
    with pytest.raises(BadInput, match="a unit needs its scale"):
        read_recording(path / "short.wav", unit="g")
    assert read_recording(path / "float.wav", unit="g").comparable


def test_sidecars_are_validated(tmp_path):
    np.save(tmp_path / "a.npy", VALUES)
    side = tmp_path / "recordings.toml"  # sidecar of the whole folder
    side.write_text('rate_hz = 5000\nunit = "mm/s^2"\n')
    recording = read_recording(tmp_path / "a.npy")
    assert recording.facts["rate"].source == "recordings.toml"
    assert np.allclose(recording.values, 1e-3 * VALUES)
    for text, message in (
        ("rate = 5000", "did you mean rate_hz"),
        ("rate_hz = -1", "positive"),
        ("rate_hz = ", "correct it"),
    ):
        side.write_text(text)
        with pytest.raises(BadInput, match=message):
            read_recording(tmp_path / "a.npy")


def test_a_spectrum_file_is_refused_with_a_message(tmp_path):
    path = tmp_path / "psd.uff"
    write_uff(path, uff_set(np.abs(VALUES), func_type=9))
    with pytest.raises(
        UnreadableFile, match=r"psd\.uff holds a power spectral density, not a time record"
    ):
        read_recording(path)


def test_truncated_files_are_read_to_the_cut(folder, tmp_path):
    path, inputs = folder
    for name in ("comma.csv", "float.wav", "group.tdms", "bare.npy"):
        content = (path / name).read_bytes()
        (tmp_path / name).write_bytes(content[: int(0.6 * len(content))])
        recording = read_recording(tmp_path / name, **inputs[name])
        assert 0.5 * VALUES.size < recording.values.size < 0.7 * VALUES.size, name
        complete = min(
            recording.values.size - 1, VALUES.size
        )  # the last number of a text may be truncated, too
        assert np.allclose(recording.values[:complete] / G, VALUES[:complete], atol=1e-6), name
        if name != "comma.csv":  # a text file does not state its length
            assert "cut short" in " ".join(recording.notes), name


def test_missing_values_in_text_are_gaps(tmp_path):
    rows = [f"{i / 100:.2f},{np.sin(i):.5f}\n" for i in range(200)]
    rows[20] = "0.20,n/a\n"
    rows[30] = "sensor lost\n"
    del rows[50:60]
    (tmp_path / "a.csv").write_text("time (s),acc (g)\n" + "".join(rows))
    recording = read_recording(tmp_path / "a.csv")
    assert recording.values.size == 200
    missing = [20, 30, *range(50, 60)]
    assert np.flatnonzero(np.isnan(recording.values)).tolist() == missing
    valid = np.setdiff1d(np.arange(200), missing)
    assert np.allclose(recording.values[valid], G * np.sin(valid), atol=1e-4)
    assert any("11 samples are missing" in note for note in recording.notes)


def test_several_blocks_are_separate_channels(tmp_path):
    block = "Step {0}\nStarted at: 12:00:0{0}.5 12 May 2022\n\nFx,acc,T\ng,g,sec\n\n{1}\n"
    rows = ["\n".join(f"{k + i}.5,{i / 10},{i / 50}" for i in range(20)) for k in (100, 300)]
    (tmp_path / "a.csv").write_text(
        "".join(block.format(k + 1, text) for k, text in enumerate(rows))
    )
    names = [recording.channel.name for recording in open_channels(tmp_path / "a.csv")]
    assert names == ["1/Fx", "1/acc", "2/Fx", "2/acc"]
    assert read_recording(tmp_path / "a.csv", channel="1/acc").facts["channel"].value == "1/acc"
    with pytest.raises(BadInput, match="has 2 channels 'acc'; give 1/acc, 2/acc"):
        read_recording(tmp_path / "a.csv", channel="acc")
    force, acceleration = (
        read_recording(tmp_path / "a.csv", channel=name) for name in ("2/Fx", "2/acc")
    )
    assert (force.unit, force.values[0]) == ("gram-force", 300.5)
    assert (acceleration.unit, acceleration.rate_hz) == ("m/s^2", 50.0)
    assert acceleration.facts["started"].value == datetime(2022, 5, 12, 12, 0, 2, 500000)


@pytest.mark.parametrize(
    "line",
    ["0,5;1,25;", "0,5\t1,25", "0,5 1,25", '"0,5","1,25"', "0.5,1.25", "0.5;1.25", "5e-1 1.25"],
)
def test_number_and_separator_dialects(tmp_path, line):
    (tmp_path / "a.dat").write_text((line + "\n") * 20)
    for channel, value in (("1", 0.5), ("2", 1.25)):
        assert (
            read_recording(tmp_path / "a.dat", rate_hz=1.0, channel=channel).values.tolist()
            == [value] * 20
        )


@pytest.mark.parametrize("label", ["acc [g]", "acc (g)", "# acc [g]"])
def test_the_label_of_a_single_column_may_contain_a_blank(tmp_path, label):
    file = tmp_path / "one.csv"
    file.write_text(label + "\n" + "".join(f"{np.sin(k / 9.0):.5f}\n" for k in range(4000)))
    recording = read_recording(file, rate_hz=20e3)
    assert recording.facts["unit"].value == "g"
    assert recording.facts["unit"].source == "file"


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        ("m/s²", 1.0),
        ("m/s**2", 1.0),
        ("m s-2", 1.0),
        ("[g]", G),
        ("mg", G / 1000),
        ("in/s^2", 0.0254),
        ("kg", None),
        ("V", None),
        ("mm/s", None),
    ],
)
def test_units_of_acceleration(unit, metres):
    assert acceleration_scale(unit) == metres


def test_labels_end_in_units_only_if_these_are_units():
    assert name_and_unit("acc_g") == ("acc", "g")
    assert name_and_unit("Beschl. [m/s²]") == ("Beschl.", "m/s²")
    assert name_and_unit("bearing_left") == ("bearing_left", None)


def test_large_text_is_read_in_chunks(tmp_path, monkeypatch):
    monkeypatch.setattr("asperity.recording.text._LARGE", 1000)
    monkeypatch.setattr("asperity.recording.text._CHUNK", 5000)
    rows = "".join(f"{i / RATE:.4f},{v:.6f}\n" for i, v in enumerate(VALUES))
    (tmp_path / "a.csv").write_text("time_s,acc_g\n" + rows + "Step 2\nacc\n" + rows)
    opened = open_recording(tmp_path / "a.csv")
    assert opened.samples is None
    recording = opened.read()
    assert np.allclose(recording.values / G, VALUES, atol=1e-6)
    assert recording.rate_hz == RATE
    assert "another block" in recording.notes[0]


@pytest.mark.parametrize("end", ["", "sep", "sep "])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_large_text_is_parsed_by_pandas_in_chunks(tmp_path, monkeypatch, separator, end):
    def fail_if_called(chunk, *_):
        assert chunk == b""
        return np.empty((0, 2)), None

    monkeypatch.setattr("asperity.recording.text._WORTH_PANDAS", 10_000)
    monkeypatch.setattr("asperity.recording.text._line_by_line", fail_if_called)
    ending = end.replace("sep", separator)
    rows = "".join(f"{i / RATE:.4f}{separator}{v:.6f}{ending}\n" for i, v in enumerate(VALUES))
    (tmp_path / "a.csv").write_text(f"time_s{separator}acc_g\n{rows}", "utf-8")
    recording = read_recording(tmp_path / "a.csv")
    assert recording.rate_hz == RATE
    assert recording.notes == ()
    assert np.allclose(recording.values / G, VALUES, atol=1e-6)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the developers' data are not on this machine")
def test_six_copies_of_a_measured_second_are_one_signal():
    folder = SHARED / "vibration" / "mfpt-formats"
    unit = {".wav": "g"}
    read = {
        path.suffix: read_recording(path, unit=unit.get(path.suffix))
        for path in sorted(folder.iterdir())
    }
    assert len(read) == 6
    first = read[".h5"]
    for suffix, recording in read.items():
        assert recording.rate_hz == pytest.approx(first.rate_hz, rel=1e-9), suffix
        assert recording.unit == first.unit == "m/s^2"
        assert np.abs(recording.values - first.values).max() < 1e-6 * np.abs(first.values).max(), (
            suffix
        )


@pytest.mark.skipif(not SHARED.is_dir(), reason="the developers' data are not on this machine")
def test_every_measured_file_is_read_or_refused_with_a_message():
    refusals = {}
    channels = {}
    for path in sorted(Path(SHARED, "vibration").rglob("*")) + sorted(
        Path(SHARED, "tribometer").rglob("*")
    ):
        if not path.is_file():
            continue
        try:
            channels[path.name] = len(
                open_channels(path, rate_hz=20e3 if path.parent.name == "ims" else None)
            )
        except BadInput as reason:
            refusals[path.name] = str(reason)
    assert list(refusals) == ["trib_c1.csv"]
    assert (
        refusals["trib_c1.csv"]
        == "trib_c1.csv states no sampling rate (its column 'Time' names no unit; in seconds:"
        " 9.99994 Hz); give `rate_hz`, or state it as rate_hz in trib_c1.csv.toml beside it"
    )
    assert channels["ActTest_009.IDE"] == 15
    assert channels["2003.10.22.12.06.24"] == 8
    assert channels["HT-2n-6-4_2_001.csv"] == 20
    assert len(channels) == 66


def test_arrays_of_several_axes_and_fields(tmp_path):
    axes = np.stack([VALUES, -VALUES])
    np.save(tmp_path / "rows.npy", axes)
    np.save(tmp_path / "columns.npy", np.asfortranarray(axes.T))
    np.save(tmp_path / "fields.npy", np.rec.fromarrays(axes, names="a,b"))
    np.savez(tmp_path / "both.npz", acc=axes, columns=np.asfortranarray(axes.T), fs=RATE)
    second = {"rows.npy": "2", "columns.npy": "2", "fields.npy": "b", "both.npz": "acc[2]"}
    for name, channel in second.items():
        rate = None if name == "both.npz" else RATE
        assert np.array_equal(
            read_recording(tmp_path / name, rate_hz=rate, channel=channel).values, -VALUES
        ), name
    assert np.array_equal(
        read_recording(tmp_path / "both.npz", channel="columns[1]").values, VALUES
    )


@pytest.mark.skipif(not SHARED.is_dir(), reason="the developers' data are not on this machine")
def test_six_copies_of_a_measured_second_have_the_same_indicators():
    results = {}
    for path in sorted((SHARED / "vibration" / "mfpt-formats").iterdir()):
        recording = read_recording(path, unit="g" if path.suffix == ".wav" else None)
        spectrum = power_spectrum(recording, segment=8192)
        results[path.suffix] = [
            contact_resonance(spectrum, band_hz=(4e3, 8e3), method=method)
            for method in ("likelihood", "peak")
        ]
    assert len(results) == 6
    first, highest = results[".h5"]
    assert first.found
    for suffix, (fitted, peak) in results.items():
        assert fitted.crf_hz == pytest.approx(first.crf_hz, rel=1e-6), suffix
        assert fitted.crfa == pytest.approx(first.crfa, rel=1e-5), suffix
        assert (peak.crf_hz, peak.crfa) == pytest.approx(
            (highest.crf_hz, highest.crfa), rel=1e-6
        ), suffix


def test_time_stamps_give_rate_and_start(tmp_path, monkeypatch):
    rows = "".join(f"2024-01-31T12:00:{i / 20:06.3f},{i % 5}.5\n" for i in range(400))
    (tmp_path / "a.csv").write_text("timestamp,acc (g)\n" + rows)
    recording = read_recording(tmp_path / "a.csv")
    assert (recording.rate_hz, recording.values.size) == (20.0, 400)
    assert recording.facts["started"].value == datetime(2024, 1, 31, 12)
    monkeypatch.setattr("asperity.recording.text._LARGE", 100)
    large = read_recording(tmp_path / "a.csv")
    assert np.array_equal(large.values, recording.values)
    assert large.rate_hz == 20.0
