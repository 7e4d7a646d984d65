"""Results can be copied and sent to another process, with identical content."""

import copy
import json
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from asperity.core.signals import power_spectrum
from asperity.monitoring import TrackSettings, track_recordings
from asperity.paper import papers_case
from asperity.recording import check_recording, open_recording, read_recording
from asperity.resonance import contact_resonance
from asperity.results import solve_case
from asperity.simulation import run_history
from asperity.study import curve_from_study, plan_study, run_study, study_scalars
from asperity.surface import describe_surface

COPIES = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results by name, each with a function that returns the content to compare."""
    folder = tmp_path_factory.mktemp("copies")
    case = papers_case().with_overrides(
        {"grid.cells": [32, 32], "surface.correlation_length": "60 um"}
    )
    dry = case.with_overrides(
        {"lubricant": "none", "vibration.duration": "0.1 s", "grid.x": [-1.9, 1.9]}
    )
    plan = plan_study(dry.with_overrides({"study": {"sq": ["1 um", "2 um", "3 um"], "seeds": 2}}))
    with ThreadPoolExecutor(1) as executor:
        study = run_study(plan, executor=executor)
    paths = []
    for number in range(7):
        paths.append(folder / f"{number}.npy")
        np.save(paths[-1], np.random.default_rng(number).standard_normal(20_000))
    heights = np.random.default_rng(1).standard_normal((64, 64)) * 1e-6
    np.savetxt(folder / "map.txt", heights)
    recording = read_recording(paths[0], rate_hz=2e4)
    spectrum = power_spectrum(recording)
    return {
        "run": (solve_case(case, strict=False), lambda run: [run.verdict(), run.scalars()]),
        "history": (
            run_history(case, steps=2, every=1, strict=False),
            lambda moved: [moved.scalars(), moved.table],
        ),
        "plan": (plan, lambda plan: [plan.design, [entry.id for entry in plan.cases]]),
        "study": (study, lambda study: [study_scalars(study), study.table]),
        "curve": (curve_from_study(study), lambda curve: [curve.verdict(), curve.summary()]),
        "recording": (recording, lambda recording: [recording.values, recording.facts]),
        "quality": (
            check_recording(open_recording(paths[0], rate_hz=2e4)),
            lambda quality: [quality],
        ),
        "spectrum": (spectrum, lambda spectrum: [spectrum.density, spectrum.unit]),
        "resonance": (contact_resonance(spectrum, band_hz=(1e3, 5e3)), lambda line: [line]),
        "track": (
            track_recordings(paths, TrackSettings(band_hz=(1e3, 5e3), rate_hz=2e4)),
            lambda track: [track.verdict(), track.scalars()],
        ),
        "surface": (
            describe_surface(folder / "map.txt", unit="m", pixel=1e-6),
            lambda surface: [surface.scalars()],
        ),
    }


def as_text(value):
    if hasattr(value, "to_json"):
        return value.to_json(double_precision=15)
    return json.dumps(
        value, default=lambda item: getattr(item, "tolist", lambda: str(item))(), sort_keys=True
    )


RESULTS = (
    "run",
    "history",
    "plan",
    "study",
    "curve",
    "recording",
    "quality",
    "spectrum",
    "resonance",
    "track",
    "surface",
)


@pytest.mark.parametrize("method", COPIES)
@pytest.mark.parametrize("name", RESULTS)
def test_a_result_can_be_copied_and_sent_to_another_process(results, name, method):
    result, content = results[name]
    again = COPIES[method](result)
    assert type(again) is type(result)
    both = [content(item) for item in (result, again)]
    first, second = (
        [as_text(part) for part in parts] if isinstance(parts, list) else as_text(parts)
        for parts in both
    )
    assert first == second
