"""Film over a dimple that runs through a ball contact, against L. Mourier, D. Mazuyer, A. A.
Lubrecht and C. Donnet, Tribology International 39 (2006) 1745: their simulation and interferometry.

Shape and depth of the dimple are those of their simulation. The moments of their profiles are not
stated, so each profile is compared with that of the best moment.
"""

from dataclasses import replace

import numpy as np
import pytest

from asperity.benchmark import DimpleExperiment, ExperimentResult, compute_dimples, load_experiments
from asperity.core.errors import BadInput

(MOURIER,) = [entry for entry in load_experiments() if isinstance(entry, DimpleExperiment)]


@pytest.fixture(scope="module")
def profiles():
    found = compute_dimples(MOURIER)
    assert len(found) == 10
    return found


def test_films_agree_with_the_published_simulation(profiles):
    """Within 5 % rms of the film in all ten profiles; 1 to 4 % were found."""
    for profile in profiles:
        assert profile.from_simulated < 0.05, (profile.run, profile.number)


def test_measured_films_agree_as_well_as_with_the_published_simulation(profiles):
    """3 to 19 % rms of the film; the published simulation has 5 to 25 %."""
    for profile in profiles:
        limit = min(0.2, 1.1 * profile.simulated_from_measured)
        assert profile.from_measured < limit, (profile.run, profile.number)


def test_measured_films_before_the_dimple_agree(profiles):
    """Means from 60 µm upstream on: 2 % in pure rolling, 5.4 % at half the mean speed."""
    for run, tolerance, count in (("pure rolling", 0.02, 3), ("half the mean speed", 0.06, 2)):
        ratios = [profile.upstream_ratio for profile in profiles if profile.run.endswith(run)]
        known = [ratio for ratio in ratios if ratio is not None]
        assert len(known) == count
        assert known == pytest.approx([1.0] * count, abs=tolerance)


def test_the_deviation_of_a_film_that_is_a_tenth_thicker_is_a_tenth(profiles):
    x, film = profiles[0].measured
    flat = np.full_like(film, film.mean())
    thicker = replace(profiles[0], measured=(x, flat), simulated=(x, 1.1 * flat))
    assert thicker.simulated_from_measured == pytest.approx(0.1, rel=1e-12)
    known = next(profile for profile in profiles if profile.upstream_ratio is not None)
    best = (known.beside_measured,)
    half = replace(known, films=best, measured=(known.measured[0], 2.0 * known.measured[1]))
    assert half.upstream_ratio == pytest.approx(0.5 * known.upstream_ratio, rel=1e-12)


def test_the_verdict_states_the_largest_deviations(profiles):
    verdict = ExperimentResult((), tuple(profiles)).verdict()
    simulated = max(profile.from_simulated for profile in profiles)
    assert f"within {100.0 * simulated:.1f} % of a published simulation" in verdict
    assert verdict.endswith("of 10 measured profiles.")
    result = ExperimentResult((), tuple(profiles)).scalars()
    (described,) = result["profile_sets"]
    assert "far deeper than the simulated ones" in described["missed"]
    assert {row["experiment"] for row in result["profiles"]} == {described["experiment"]}


def test_a_dimple_needs_oil():
    dry = replace(MOURIER, case=MOURIER.case.with_overrides({"lubricant": "none"}))
    with pytest.raises(BadInput, match="pure rolling: a dimple needs oil"):
        compute_dimples(dry)
