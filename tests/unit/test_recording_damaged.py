"""Damaged recordings: read or refused in one sentence, and never a traceback."""

import gc
import resource
from time import perf_counter

import numpy as np
import pytest

from asperity.errors import BadInput
from asperity.recording import check_recording, open_channels
from support.recordings import SHARED, damaged, vibration, write_all

MANY = 250  # the benchmark takes 500


@pytest.mark.filterwarnings("ignore")  # readers that fail leave files open, and say so when they are collected
def test_damaged_recordings_leave_no_traceback(tmp_path, capfd):
    said = write_all(tmp_path, vibration(1500))
    contents = [(name, (tmp_path / name).read_bytes()) for name in said]
    if SHARED.is_dir():
        contents.append(("endaq.ide", (SHARED / "vibration" / "endaq" / "ActTest_009.IDE").read_bytes()[:100_000]))
    rng = np.random.default_rng(8)
    (tmp_path / "bad").mkdir()
    outcomes = []
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(MANY):
        name, content = contents[number % len(contents)]
        path = tmp_path / "bad" / f"{number}-{name}"
        path.write_bytes(damaged(content, rng))
        began = perf_counter()
        outcomes.append((path.name, outcome(path, said.get(name, {}))))
        assert perf_counter() - began < 10.0, path.name
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 20  # kB
    for name, told in outcomes:
        if isinstance(told, str):
            assert name in told
            assert "\n" not in told
            assert len(told) < 500
    read = sum(isinstance(told, int) for _, told in outcomes)
    assert 0.2 * MANY < read < 0.9 * MANY  # neither everything refused nor everything swallowed
    gc.collect()
    assert capfd.readouterr() == ("", "")


def outcome(path, beside):
    """How many samples were read, or the sentence that refuses them; anything else is the traceback not to be seen."""
    try:
        return sum(check_recording(one).samples for one in open_channels(path, **beside))
    except BadInput as refusal:
        return str(refusal)
