"""Wear coefficient k fitted to a test: synthetic scars of known k, ambiguous profiles, and a public
test.
"""

from pathlib import Path

import numpy as np
import pytest

from asperity import BadInput
from asperity.surface import read_surface
from asperity.wear import Scar, find_scar, fit_wear_coefficient, read_friction_trace
from asperity.wear.fit import SCATTER, FrictionTrace

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"
TRIBOMETER, PROFILE = DATA / "tribometer" / "trib_c1.csv", DATA / "surfaces" / "wear_track_C1.csv"
WIDTH, DEPTH = 200e-6, 1e-6
AREA = 2.0 / 3.0 * WIDTH * DEPTH  # area of a parabola
TRACE = FrictionTrace(
    load=5.0,
    distance=100.0,
    laps=4000.0,
    track_radius=4e-3,
    friction_energy=50.0,
    coefficient=0.1,
    distance_error=0.0,
)
K = AREA / (5.0 * 4000.0)


def scar_file(folder, *, ridge=0.0, noise=0.02e-6, tilt=3e-3, seed=0, depth=DEPTH):
    """A 2 mm profile with a parabolic groove; the ridges contain the share `ridge` of its area."""
    x = np.arange(4000) * 0.5e-6
    offset = (x - 0.9e-3) / (0.5 * WIDTH)
    z = -depth * np.maximum(1.0 - offset**2, 0.0)
    for side in (-1.25, 1.25):
        z += ridge * depth * 2.0 * np.maximum(1.0 - ((offset - side) / 0.25) ** 2, 0.0)
    rng = np.random.default_rng(seed)
    waves = np.convolve(rng.standard_normal(x.size + 40), np.ones(41) / np.sqrt(41.0), "valid")
    z += noise * waves + tilt * x + 5e-6
    path = folder / f"scar{seed}.csv"
    path.write_text(
        "x,z\n" + "\n".join(f"{a * 1e3:.5f},{b * 1e6:.4f}" for a, b in zip(x, z, strict=True))
    )
    return path


def scar(folder, **options):
    return read_surface(scar_file(folder, **options), unit="um", lateral_unit="mm")


def test_a_clean_groove_gives_its_k(tmp_path):
    fitted = fit_wear_coefficient(TRACE, scar(tmp_path, noise=0.001e-6))
    assert isinstance(fitted.scar, Scar)
    assert fitted.scar.width == pytest.approx(WIDTH, rel=0.05, abs=0.0)
    assert fitted.k.median == pytest.approx(K, rel=0.02, abs=0.0)
    assert fitted.k_all_lost == pytest.approx(K, rel=0.01, abs=0.0)
    assert fitted.volume.median == pytest.approx(
        2.0 * np.pi * 100.0 / (2.0 * np.pi * 4000.0) * AREA, rel=0.02, abs=0.0
    )
    assert fitted.energy_coefficient.median == pytest.approx(
        fitted.k.median * 500.0 / 50.0, rel=1e-9, abs=0.0
    )
    assert fitted.k.low < K < fitted.k.high


def test_intervals_of_a_noisy_groove_cover_k_at_their_level(tmp_path):
    """The depth varies along the track, because a profile samples a single position."""
    rng = np.random.default_rng(3)
    covered = 0
    for seed in range(40):
        profile = scar(
            tmp_path, noise=0.05e-6, seed=seed, depth=DEPTH * (1.0 + 0.2 * rng.standard_normal())
        )
        fitted = fit_wear_coefficient(TRACE, profile)
        covered += fitted.k.low <= K <= fitted.k.high
    assert 32 <= covered <= 40


def test_noise_is_not_taken_for_wear(tmp_path):
    """Rectified roughness adds to both areas; its share measured beside the scar is subtracted."""
    scars = [find_scar(scar(tmp_path, noise=0.12e-6, seed=seed)) for seed in range(8)]
    assert np.mean([found.missing for found in scars]) == pytest.approx(AREA, rel=0.03, abs=0.0)
    assert np.mean([found.piled for found in scars]) < 0.03 * AREA


@pytest.mark.parametrize(("ridge", "lowest"), [(0.0, 0.67), (0.5, 0.44), (1.0, 0.04)])
def test_piled_up_material_may_stem_from_the_disc(tmp_path, ridge, lowest):
    fitted = fit_wear_coefficient(TRACE, scar(tmp_path, ridge=ridge, noise=0.001e-6))
    assert fitted.scar.piled == pytest.approx(ridge * AREA, rel=0.03, abs=0.01 * AREA)
    assert fitted.k_all_lost == pytest.approx(K, rel=0.02, abs=0.0)
    assert fitted.k_none_lost == pytest.approx((1.0 - ridge) * K, abs=0.03 * K)
    assert fitted.k.low == pytest.approx(lowest * K, abs=0.03 * K)
    assert fitted.k.median == pytest.approx((1.0 - 0.5 * ridge) * K, rel=0.05, abs=0.0)
    noted = any(
        "beside it; the profile" in note or "area above the old surface" in note
        for note in fitted.notes
    )
    assert noted == (ridge > 0.0)


def test_the_prediction_of_a_second_test_includes_the_scatter_between_tests(tmp_path):
    groove = scar(tmp_path, noise=0.001e-6)
    fitted = fit_wear_coefficient(TRACE, groove, second_load=10.0, second_distance=50.0)
    assert fitted.second_volume.median == pytest.approx(K * 500.0, rel=0.04, abs=0.0)
    spread = np.log(fitted.second_volume.high / fitted.second_volume.low) / 2.0 / 1.645
    assert spread == pytest.approx(np.hypot(np.sqrt(2.0) * SCATTER, 0.2), rel=0.05, abs=0.0)
    repeated = fit_wear_coefficient(TRACE, groove, second_load=10.0, second_distance=50.0)
    assert repeated.second_volume == fitted.second_volume


def trace_file(folder, header, row):
    path = folder / "trace.csv"
    lines = [";".join(row(i)) for i in range(1, 201)]
    path.write_text(header + "\n" + "\n".join(lines))
    return path


def test_load_radius_and_energy_are_derived_from_a_trace(tmp_path):
    def row(i):
        return f"{i * 0.1:.1f}", f"{0.02 * i:.4f}", f"{i * 0.8:.3f}", "0.25", "1.0"

    trace = read_friction_trace(trace_file(tmp_path, "Time;Distance;Laps;mu;FrictionForce", row))
    assert trace.load == pytest.approx(4.0, rel=1e-9, abs=0.0)
    assert trace.distance == pytest.approx(4.0, rel=1e-9, abs=0.0)
    assert trace.laps == pytest.approx(160.0, rel=1e-9, abs=0.0)
    assert trace.track_radius == pytest.approx(0.025 / (2.0 * np.pi), rel=1e-9, abs=0.0)
    assert trace.friction_energy == pytest.approx(
        4.0 * 0.995, rel=1e-9, abs=0.0
    )  # the integral starts at the first row
    repeated = read_friction_trace(tmp_path / "trace.csv", track_radius=4.1e-3)
    assert repeated.distance_error == pytest.approx(
        abs(0.025 / (2.0 * np.pi) / 4.1e-3 - 1.0), rel=1e-9, abs=0.0
    )
    assert any("off the stated one" in note for note in repeated.notes)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("Time;Distance;Laps;mu", "state the load"),
        ("Time;Laps;mu;FrictionForce", "no column of distance; state the track radius"),
        ("Time;Distance;mu;FrictionForce", "no column of laps; state the track radius"),
        ("Time;mu;FrictionForce", "no column of distance or laps"),
        ("Time;Distance;Laps", "state the load"),
    ],
)
def test_a_missing_column_of_a_trace_is_reported(tmp_path, header, message):
    values = {
        "Time": "0.1",
        "Distance": "0.02",
        "Laps": "0.8",
        "mu": "0.25",
        "FrictionForce": "1.0",
    }

    def row(i):
        return [
            f"{float(values[name]) * (i if name in ('Time', 'Distance', 'Laps') else 1):.4f}"
            for name in names
        ]

    names = header.split(";")
    with pytest.raises(BadInput, match=message):
        read_friction_trace(trace_file(tmp_path, header, row))


def test_a_profile_without_a_track_is_refused(tmp_path):
    with pytest.raises(BadInput, match="shows no track"):
        find_scar(scar(tmp_path, depth=0.0))


@pytest.mark.skipif(
    not PROFILE.exists() or not TRIBOMETER.exists(),
    reason="the public test is not available",
)
def test_the_public_test_bounds_k_and_notes_its_limits():
    """C1 of gokcemay/trib: the area above the old surface exceeds the area below it."""
    trace = read_friction_trace(TRIBOMETER)
    assert trace.load == pytest.approx(3.0, rel=1e-3, abs=0.0)
    assert trace.track_radius == pytest.approx(3.02e-3, rel=1e-3, abs=0.0)
    assert trace.distance == pytest.approx(30.23, rel=1e-3, abs=0.0)
    fitted = fit_wear_coefficient(trace, read_surface(PROFILE, unit="um", lateral_unit="mm"))
    assert fitted.scar.width == pytest.approx(190e-6, rel=0.1, abs=0.0)
    assert 1.5 < fitted.scar.piled / fitted.scar.missing < 2.5
    assert fitted.k_none_lost == 0.0
    assert 0.5e-15 < fitted.k.median < 2e-15
    assert fitted.k.low < 0.2e-15
    assert 2.2e-15 < fitted.k.high < 3.5e-15
    assert fitted.second_volume.high > 1.5 * fitted.volume.high
    assert any("upper bound" in note for note in fitted.notes)
