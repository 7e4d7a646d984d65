"""Time and memory to track recordings, damaged files, and false detections on real bearings.

The recordings come from the rig simulator; the time to simulate them is not counted.
docs/recordings.md quotes the results.
"""

import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.monitoring import TrackSettings, search_target, track_recordings
from asperity.monitoring.reading import FINEST_HZ, read_spectrum
from asperity.paper import RigSettings, simulate_rig, write_rig
from asperity.recording import ReadOptions, check_recording, open_channels, read_recording
from asperity.resonance import contact_resonance, remove_lines

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
MEASURED = Path(__file__).parents[2] / "shared" / "data" / "vibration"
ASPERITY = [sys.executable, "-m", "asperity"]


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the tables as Markdown."""
    duration = 30.0 if fast else 300.0
    yield f"## Recordings: 60 of {duration:g} s at 20 kHz, from disk to report\n"
    with tempfile.TemporaryDirectory() as folder:
        where = Path(folder, "rig")
        write_rig(simulate_rig(RigSettings(duration_s=duration, seed=7)), where)
        table = ["--table", str(where / "table.csv"), "--case", str(where / "rig.toml")]
        page = [
            "--report",
            str(where.parent / "report.html"),
            "--out",
            str(where.parent / "track.nc"),
        ]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [*ASPERITY, "track", str(where), *table, *page, "--quiet"]
        seconds, peak, first_line = measured(command)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        yield (
            f"- `asperity track`: {seconds:.1f} s, {processor_s:.1f} s of CPU time, peak"
            f" {peak:.0f} MB in all processes together. {first_line}"
        )
        yield f"- {one_file(next(iter(sorted(where.glob('*.h5')))))}"
        if not fast:
            yield f"- {large_file(Path(folder))}"
    yield "\n## Damaged files\n"
    yield from damaged_files(100 if fast else 500)
    yield "\n## Real bearings, which have no contact resonance of this kind\n"
    if MEASURED.is_dir():
        yield from false_detections()
    else:
        yield "The measured recordings are not available on this machine."


def measured(command: list[str]) -> tuple[float, float, str]:
    """Run a command; return its seconds, peak memory [MB] with children, and first line.

    Memory is the proportional set size.
    """
    began = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    peak = 0.0
    while process.poll() is None:
        peak = max(peak, sum(map(_megabytes, _family(process.pid))))
        time.sleep(0.05)
    seconds = time.perf_counter() - began
    assert process.stdout is not None
    with process.stdout:
        return seconds, peak, process.stdout.readline().strip()


def _family(pid: int) -> list[int]:
    try:
        threads = list(Path(f"/proc/{pid}/task").iterdir())
        children = [(thread / "children").read_text().split() for thread in threads]
    except OSError:
        return [pid]
    return [pid, *(pid for group in children for child in group for pid in _family(int(child)))]


def _megabytes(pid: int) -> float:
    try:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return 0.0
    return (
        sum(int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")) / 1024
    )


def one_file(path: Path) -> str:
    """Measure the time from one file to its CRF."""
    target = search_target(load_case(CASE))
    times, processor = [], []
    for _ in range(5):
        began, worked = time.perf_counter(), time.process_time()
        reading = read_spectrum(path, ReadOptions(), target, FINEST_HZ)
        assert reading.spectrum is not None
        found = contact_resonance(remove_lines(reading.spectrum).spectrum, band_hz=target.band_hz)
        times.append(time.perf_counter() - began)
        processor.append(time.process_time() - worked)
    return (
        f"one recording from disk to CRF ({found.crf_hz:.1f} Hz): {np.median(times):.2f} s, "
        f"{np.median(processor):.2f} s of CPU time (medians of 5)"
    )


def large_file(folder: Path) -> str:
    """Check an npy file of 2 GB and a csv file of 0.5 GB."""
    results = []
    rng = np.random.default_rng(0)
    block = rng.standard_normal(1 << 20).astype(np.float32)
    large = np.lib.format.open_memmap(folder / "large.npy", "w+", np.float32, (500 << 20,))
    for start in range(0, large.size, block.size):
        large[start : start + block.size] = block
    large.flush()
    del large
    text = "".join(f"{value:.6f}\n" for value in block)
    with (folder / "large.csv").open("w") as file:
        for _ in range(54):
            file.write(text)
    for name in ("large.npy", "large.csv"):
        size = (folder / name).stat().st_size / 1e9
        command = [
            *ASPERITY,
            "check",
            str(folder / name),
            "--rate",
            "20000",
            "--unit",
            "m/s^2",
            "--quiet",
        ]
        seconds, peak, _ = measured(command)
        kind = name.split(".")[1]
        results.append(f"{kind} of {size:.1f} GB in {seconds:.0f} s and {peak:.0f} MB")
        (folder / name).unlink()
    return f"`asperity check` of {', '.join(results)}"


def damaged_files(count: int) -> Iterator[str]:
    """Check that damaged files are read or rejected with one message; report time and memory."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from support.recordings import damaged, vibration, write_all

    warnings.simplefilter("ignore")  # failing readers leave files open
    rng = np.random.default_rng(11)
    outcomes: Counter[str] = Counter()
    slowest = (0.0, "")
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak of the memory
    with tempfile.TemporaryDirectory() as folder:
        options = write_all(Path(folder), vibration())
        contents = [(name, Path(folder, name).read_bytes()) for name in options]
        if MEASURED.is_dir():
            contents.append(("endaq.ide", (MEASURED / "endaq" / "ActTest_009.IDE").read_bytes()))
        for number in range(count):
            name, content = contents[number % len(contents)]
            path = Path(folder, f"{number}-{name}")
            path.write_bytes(damaged(content, rng))
            began = time.perf_counter()
            try:
                for channel in open_channels(path, **options.get(name, {})):
                    check_recording(channel)
                outcomes["read"] += 1
            except BadInput as refusal:
                outcomes[
                    "rejected" if "\n" not in str(refusal) else "TRACEBACK IN THE MESSAGE"
                ] += 1
            except Exception as error:  # noqa: BLE001 - tracebacks are counted
                outcomes[f"TRACEBACK {type(error).__name__}"] += 1
            slowest = max(slowest, (time.perf_counter() - began, name))
            path.unlink()
    status = Path("/proc/self/status").read_text().splitlines()
    peak = sum(int(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1024
    counts = ", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common())
    yield (
        f"{count} files of {len(contents)} kinds, truncated, with flipped bits, lengthened, with"
        f" huge counts, NaN and text in numbers: {counts};"
        f" slowest {slowest[0]:.2f} s ({slowest[1]}); peak memory {peak:.0f} MB."
    )


def false_detections() -> Iterator[str]:
    """Count contact resonances detected on bearings that have none."""
    yield "| recordings | method | found | of |"
    yield "|---|---|---|---|"
    methods = {"default": None, "modes": "modes", "likelihood": "likelihood", "peak": "peak"}
    running = []
    for path in [*sorted((MEASURED / "mfpt").iterdir()), *sorted((MEASURED / "ims").iterdir())]:
        given = {"rate_hz": 20e3} if path.parent.name == "ims" else {"unit": "g"}
        running += [
            (path, given | {"channel": opened.channel.name})
            for opened in open_channels(path, **given)
        ]
    for name, method in methods.items():
        tracks = [
            track_recordings([path], TrackSettings(method=method, **given))
            for path, given in running
        ]
        usable = [track for track in tracks if track.recordings[0].reading.usable]
        found = sum(track.resonance_count for track in usable)
        yield (
            f"| MFPT and IMS channels, separately (machine running) | {name} | {found} |"
            f" {len(usable)} |"
        )
    with tempfile.TemporaryDirectory() as folder:
        found = total = 0
        for path in sorted((MEASURED / "mfpt").iterdir()):
            recording = read_recording(path, unit="g")
            names = []
            for number, piece in enumerate(np.array_split(recording.values, 8)):
                names.append(Path(folder, f"{path.stem}-{number}.npz"))
                np.savez(names[-1], acc=piece, fs=recording.rate_hz, unit="m/s^2")
            track = track_recordings(names)
            found, total = found + track.resonance_count, total + len(names)
        yield (
            f"| MFPT, each record as a series of 8 pieces | default (joint) | {found} | {total} |"
        )
        every = sorted(Path(folder).iterdir())
        count = track_recordings(every).resonance_count
        yield (
            f"| MFPT, all pieces of all records as one series | default (joint) | {count} |"
            f" {len(every)} |"
        )
