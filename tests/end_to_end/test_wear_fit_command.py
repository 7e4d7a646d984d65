"""`asperity wear --fit`: the wear coefficient from a friction record and a profile across the
track.
"""

import json

import numpy as np
import pytest


@pytest.fixture
def recorded(tmp_path):
    """Write a groove 200 um wide and 1 um deep with noise, after 4000 laps of 4 mm under 5 N."""
    rows = [f"{i};{0.1 * i:.3f};{4.0 * i:.3f};0.1;0.5" for i in range(1, 1001)]
    trace = tmp_path / "trace.csv"
    trace.write_text("Time;Distance;Laps;mu;FrictionForce\n" + "\n".join(rows))
    x = np.arange(4000) * 0.5e-3
    z = -np.maximum(1.0 - ((x - 0.9) / 0.1) ** 2, 0.0) + 0.005 * np.random.default_rng(
        1
    ).standard_normal(x.size)
    scar = tmp_path / "scar.csv"
    scar.write_text("x,z\n" + "\n".join(f"{a:.5f},{b:.5f}" for a, b in zip(x, z, strict=True)))
    return str(trace), str(scar)


KEYS = [
    *("verdict", "wear_coefficient", "wear_coefficient_all_lost", "wear_coefficient_none_lost"),
    *(
        "energy_wear_coefficient",
        "scar_volume_m3",
        "second_volume_m3",
        "second_load_n",
        "second_distance_m",
    ),
    *(
        "load_n",
        "distance_m",
        "laps",
        "track_radius_m",
        "friction_coefficient",
        "friction_energy_j",
    ),
    *("scar_width_m", "scar_missing_m2", "scar_piled_m2", "profile_roughness_m", "notes"),
]


def test_the_coefficient_and_the_predicted_volume_of_a_second_test(asp, recorded):
    trace, scar = recorded
    units = ("--unit", "um", "--lateral-unit", "mm")
    code, out, _ = asp("wear", "--fit", trace, "--scar", scar, *units, "--json")
    assert code == 0
    result = json.loads(out)
    assert sorted(result) == sorted(KEYS)
    k = 2.0 / 3.0 * 200e-12 / (5.0 * 4000.0)
    assert result["wear_coefficient"]["median"] == pytest.approx(k, rel=0.05, abs=0.0)
    assert result["wear_coefficient"]["low"] < k < result["wear_coefficient"]["high"]
    assert result["load_n"] == pytest.approx(5.0)
    halved = json.loads(
        asp(
            "wear",
            "--fit",
            trace,
            "--scar",
            scar,
            *units,
            "--second-distance",
            "50 m",
            "--load",
            "10 N",
            "--json",
        )[1]
    )
    assert halved["wear_coefficient"]["median"] == pytest.approx(
        result["wear_coefficient"]["median"] / 2.0, rel=1e-9
    )
    assert halved["second_volume_m3"]["high"] == pytest.approx(
        result["second_volume_m3"]["high"] / 2.0, rel=1e-9
    )
    code, out, _ = asp("wear", "--fit", trace, "--scar", scar, *units)
    assert code == 0
    assert out.splitlines()[0] == result["verdict"]
    assert "wear coefficient of the disc" in out


def test_an_incomplete_fit_is_refused(asp, recorded):
    trace, scar = recorded
    for given, message in (
        (("--fit", trace), "--fit TRACE and --scar PROFILE go together"),
        (("--scar", scar), "--fit TRACE and --scar PROFILE go together"),
        (("--fit", trace, "--scar", scar, "--lift-off"), "without a case, --hours or --lift-off"),
        (
            ("case.toml", "--hours", "1", "--fit", trace, "--scar", scar),
            "without a case, --hours or --lift-off",
        ),
        (("case.toml",), "needs a case and --hours"),
        ((), "needs a case and --hours"),
        (("--fit", trace, "--scar", scar), "states no units"),
        (("--fit", trace, "--scar", "nowhere.csv"), "nowhere.csv does not exist"),
        (("--fit", trace, "--scar", scar, "--load", "5 m"), "--load must be"),
    ):
        code, out, error = asp("wear", *given)
        assert (code, out) == (2, ""), given
        assert message in error
        assert len(error.strip().splitlines()) == 1
