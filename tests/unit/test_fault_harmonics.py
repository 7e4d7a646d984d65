"""Harmonics shared by two fault frequencies: a fault must not show at the other one."""

import numpy as np
import pytest
from scipy.io import loadmat

from asperity.monitoring.auxiliary_channels import lines
from asperity.vibration import Envelope, separable_harmonics
from support.recordings import SHARED

RATE = 20e3
RATES = {"BPFO": 87.3, "BPFI": 131.9}  # 3 BPFO = 261.9 Hz, 2 BPFI = 263.8 Hz
MFPT = SHARED / "vibration" / "mfpt"
MFPT_ORDERS = {"BPFO": 3.245, "BPFI": 4.755, "BSF": 2.557, "FTF": 0.4056}


def faulty_bearing(rate_hz, seconds=8.0):
    """Return noise with impacts at a rate that ring at 5 kHz."""
    rng = np.random.default_rng(1)
    time = np.arange(round(seconds * RATE)) / RATE
    impacts = np.flatnonzero(np.diff(np.floor(rate_hz * time), prepend=0.0))
    impulses = np.zeros(time.size)
    impulses[impacts] = 1.0 + 0.1 * rng.standard_normal(impacts.size)
    ring = np.exp(-800.0 * time[:200]) * np.sin(2.0 * np.pi * 5000.0 * time[:200])
    return 0.2 * rng.standard_normal(time.size) + 5.0 * np.convolve(impulses, ring)[: time.size]


def depths(values, rate_hz, rates_hz):
    envelope = Envelope(rate_hz)
    for _ in envelope.watch([values]):
        pass
    return envelope.depths(rates_hz)


@pytest.mark.parametrize("slip", [-0.01, 0.0, 0.01])
@pytest.mark.parametrize(("fault", "other"), [("BPFO", "BPFI"), ("BPFI", "BPFO")])
def test_a_fault_does_not_show_at_a_rate_with_common_harmonics(fault, other, slip):
    values = faulty_bearing((1.0 + slip) * RATES[fault])
    both = depths(values, RATE, RATES)
    assert both[fault] > 1.0
    assert both[other] < 0.05 * both[fault]
    alone = depths(values, RATE, {other: RATES[other]})  # nothing else claims the line
    assert alone[other] < both[fault]


@pytest.mark.parametrize(
    ("rates_hz", "expected"),
    [
        ({"BPFO": 87.3, "BPFI": 131.9}, {"BPFO": (1, 2), "BPFI": (1, 3)}),
        # balls of a quarter of the pitch diameter: 5 BPFO = 3 BPFI
        ({"BPFO": 90.0, "BPFI": 150.0}, {"BPFO": (1, 2, 3), "BPFI": (1, 2)}),
        # a rate itself counts, whatever multiple of another it is
        ({"pinion": 25.0, "wheel": 12.5}, {"pinion": (1,), "wheel": (1, 3)}),
        # two bearings of one kind cannot be separated at all
        ({"BPFO DE": 87.3, "BPFO NDE": 87.4}, {"BPFO DE": (1, 2, 3), "BPFO NDE": (1, 2, 3)}),
        # the fifth harmonic of the cage is too weak to claim twice the shaft
        ({"shaft": 25.0, "FTF": 10.0}, {"shaft": (1, 2, 3), "FTF": (1, 2, 3)}),
    ],
)
def test_harmonics_that_rates_share_are_known(rates_hz, expected):
    assert separable_harmonics(rates_hz) == expected


def test_coarse_lines_share_more_harmonics():
    rates_hz = {"BPFO": 90.0, "BPFI": 127.0}  # 270 and 254 Hz: 6 % apart
    assert separable_harmonics(rates_hz, 1.0)["BPFO"] == (1, 2, 3)
    assert separable_harmonics(rates_hz, 10.0)["BPFO"] == (1, 2)


def test_a_shared_harmonic_counts_for_the_rate_whose_own_lines_are_present():
    frequency_hz = np.arange(0.0, 2000.0, 0.5)
    density = np.zeros(frequency_hz.size)
    density[np.isin(frequency_hz, (87.5, 174.5, 262.0))] = (4.0, 2.0, 1.0)
    density[frequency_hz == 132.0] = 0.01
    levels = lines(frequency_hz, density, RATES)
    assert levels["BPFO"] == pytest.approx(np.sqrt(0.5 * 7.0))
    assert levels["BPFI"] == pytest.approx(np.sqrt(0.5 * 0.02))


@pytest.mark.parametrize("load", ["1", "5"])
def test_a_measured_outer_race_fault_is_named_by_its_rate(load):
    file = MFPT / f"OuterRaceFault_vload_{load}.mat"
    if not file.is_file():
        pytest.skip(f"{file.name} is not beside the repository")
    bearing = loadmat(file)["bearing"][0, 0]
    speed_hz = float(bearing["rate"].item())
    rates_hz = {name: order * speed_hz for name, order in MFPT_ORDERS.items()}
    measured = depths(bearing["gs"].ravel().astype(float), float(bearing["sr"].item()), rates_hz)
    assert max(measured, key=measured.get) == "BPFO"
    assert measured["BPFI"] < 0.25 * measured["BPFO"]
