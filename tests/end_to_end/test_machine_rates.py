"""`asperity track` with a machine's case: fault frequencies at the speed of each recording."""

import json
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = str(Path(__file__).parents[2] / "examples" / "6206.toml")
RATE, SECONDS = 20e3, 2.0
OUTER = (
    9.0 / 2.0 * (1.0 - 9.525 / 46.0)
)  # ball passes over the outer ring per revolution, 9 balls of 9.525 mm on 46 mm
BAND = ("--band", "2000", "4000")


def bearing(rng, speed, size):
    """Return noise with a 5 kHz resonance struck at each ball pass, and the shaft angle [turns]."""
    time = np.arange(round(RATE * SECONDS)) / RATE
    turns = np.cumsum(np.broadcast_to(speed, time.shape)) / RATE
    impacts = np.flatnonzero(np.diff(np.floor(OUTER * turns), prepend=0.0))
    impulses = np.zeros(time.size)
    impulses[impacts] = 1.0 + 0.1 * rng.standard_normal(impacts.size)
    ring = np.exp(-800.0 * time[:200]) * np.sin(2.0 * np.pi * 5000.0 * time[:200])
    return rng.standard_normal(time.size) + size * np.convolve(impulses, ring)[: time.size], turns


def test_a_growing_fault_is_named_at_any_speed(asp):
    rows, rng = ["file,speed_hz"], np.random.default_rng(1)
    Path("in").mkdir()
    for number in range(26):
        speed = rng.uniform(20.0, 40.0)
        size = 1.0 * np.exp(0.25 * max(number - 12, 0))
        np.savez(f"in/r-{number:02}.npz", acc=bearing(rng, speed, size)[0], fs=RATE, unit="m/s^2")
        rows.append(f"r-{number:02}.npz,{speed:.4f}")
    Path("speeds.csv").write_text("\n".join(rows))
    code, out, _ = asp(
        "track", "in", "--table", "speeds.csv", "--case", EXAMPLE, *BAND, "--json", "--out", "t.csv"
    )
    result = json.loads(out)
    assert code == 3
    first, *_, last = result["recordings"]
    assert {"BPFO", "BPFI", "BSF", "FTF", "shaft"} <= set(first["depths"])
    assert last["depths"]["BPFO"] > 4.0 * first["depths"]["BPFO"]
    assert last["depths"]["BPFO"] > 2.0 * last["depths"]["BPFI"]
    assert result["alarm"]["raised_by"] == "the envelope at BPFO"
    head = Path("t.csv").read_text().splitlines()[0]
    assert {"depth_BPFO", "line_BPFO", "band_1 to 5 kHz"} <= set(head.split(","))


def test_a_tachometer_resolves_a_fault_at_varying_speed(asp):
    rng = np.random.default_rng(2)
    time = np.arange(round(RATE * SECONDS)) / RATE
    values, turns = bearing(rng, 25.0 + 10.0 * time, 2.0)
    pulses = ((turns % 1.0) < 0.1).astype(float)
    for name, stated in (("with", {"tacho": "pulse"}), ("without", {"speed_hz": 35.0})):
        Path(name).mkdir()
        np.savez(f"{name}/a.npz", acc=values, pulse=pulses, fs=RATE, unit="m/s^2")
        Path(f"{name}/a.npz.json").write_text(
            json.dumps({"channel": "acc", "faults_per_turn": {"BPFO": OUTER}} | stated)
        )
    with_tacho, without_tacho = (
        json.loads(asp("track", name, *BAND, "--json")[1])["recordings"][0]
        for name in ("with", "without")
    )
    assert with_tacho["speed_hz"] == pytest.approx(35.0, rel=0.01)
    assert with_tacho["depths"]["BPFO"] > 2.5 * without_tacho["depths"]["BPFO"]


def test_conditions_are_read_from_channels_in_their_units(asp):
    Path("in").mkdir()
    time = np.arange(4000) / RATE
    rows = np.stack(
        [
            time,
            np.random.default_rng(3).standard_normal(4000),
            np.full(4000, 1.5),
            60.0 + time,
            0 * time + 1500,
        ]
    )
    header = "time [s],acc [m/s^2],force [kN],oil [degC],shaft [rpm]\n"
    Path("in/a.csv").write_text(
        header + "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows.T)
    )
    beside = {"load_n": "force", "temperature_degc": "oil", "speed_hz": "shaft"}
    Path("in/a.csv.json").write_text(json.dumps({"channel": "acc", "condition_channels": beside}))
    row = json.loads(asp("track", "in", *BAND, "--json")[1])["recordings"][0]
    assert (row["load_n"], row["speed_hz"]) == (1500.0, pytest.approx(25.0))
    assert row["temperature_degc"] == pytest.approx(60.1, abs=0.01)
    Path("in/a.csv.json").write_text(
        json.dumps({"channel": "acc", "condition_channels": {"load_n": "oil"}})
    )
    row = json.loads(asp("track", "in", *BAND, "--json")[1])["recordings"][0]
    assert "channel oil is in degC, but load_n needs N, kN, mN, MN" in row["remarks"]


def output_with_channels(asp, stated, **channels):
    """Return the row of `track` for a recording with further channels and sidecar values."""
    Path("in").mkdir()
    acceleration = np.random.default_rng(3).standard_normal(40_000)
    np.savez("in/a.npz", acc=acceleration, fs=RATE, **channels)
    Path("in/a.npz.json").write_text(
        json.dumps({"channel": "acc", "unit": "m/s^2", "faults_per_turn": {"BPFO": 3.58}} | stated)
    )
    code, out, _ = asp("track", "in", *BAND, "--json")
    assert code == 4
    (row,) = json.loads(out)["recordings"]
    return row


def test_a_speed_channel_without_a_number_is_reported_with_its_recording(asp):
    row = output_with_channels(
        asp, {"condition_channels": {"speed_hz": "shaft"}}, shaft=np.full(40_000, np.nan)
    )
    assert "channel shaft contains no number; leave it out" in row["remarks"]
    assert row["speed_hz"] is None
    assert row["depths"] == {}


def test_a_tachometer_of_another_length_is_not_used(asp):
    row = output_with_channels(
        asp, {"tacho": "pulse"}, pulse=(np.arange(20_000) % 800 < 80).astype(float)
    )
    assert "the tacho in channel pulse has 20000 samples and the vibration 40000" in row["remarks"]
    assert row["speed_hz"] is None


@pytest.mark.parametrize(
    ("stated", "refusal"),
    [
        (
            {"faults_per_turn": {"BPFO": 0}},
            "faults_per_turn must be positive fault frequencies by name, such as { BPFO = 3.58 }",
        ),
        ({"bands_hz": {"low": [100]}}, "bands_hz must be two frequencies by name"),
        ({"condition_channels": {"load": "F"}}, "condition_channels must name channels by load_n"),
        ({"pulses_per_turn": 0}, "pulses_per_turn must be a positive number"),
    ],
)
def test_an_invalid_sidecar_is_refused(asp, stated, refusal):
    np.savez("a.npz", acc=np.ones(100), fs=RATE, unit="m/s^2")
    Path("a.npz.json").write_text(json.dumps(stated))
    code, _, err = asp("track", "a.npz", *BAND)
    assert code == 2
    assert refusal in err
