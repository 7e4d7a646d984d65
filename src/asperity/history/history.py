"""A case's history: its roughness let move step after step, what is read off each, kept so that it can be gone on with.

The steps come from a model of the moving contact (`asperity.ehl.motion`); nothing is solved here. A folder holds the
case, one row a step, maps of some steps, and all that the next step needs to know: a run that is stopped at any moment
goes on from the last step kept and gives, bit for bit, the history it would have given.
"""

import hashlib
import json
import math
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from asperity.arrays import Field, Mask
from asperity.case import Case, load_case, relative_path
from asperity.coupling import Vibration, contact_vibration, needs_solution, oscillator
from asperity.ehl import (
    ContactState,
    Memory,
    Snapshot,
    Steps,
    friction,
    moving_conserving_contact,
    moving_contact,
    save_dataset,
    step_seconds,
)
from asperity.errors import BadInput, NotConverged, UnreadableFile
from asperity.files import MANIFEST, make_folder, read_manifest, require_writable, versions, whole_file
from asperity.surface import MovingSurfaces

if TYPE_CHECKING:
    import pandas

FORMAT = 1  # counts up when a reader of the format before could not read the folder
TABLE, MEMORY, MAPS = "history.parquet", "memory.npz", "fields"
KEPT_EVERY_S = 2.0  # what a crash may cost
MAPS_KEPT = 40  # in a whole history, unless said otherwise

MODELS: dict[str, Steps] = {"unified": moving_contact, "conserving": moving_conserving_contact}  # by the case's `model`

Row = dict[str, float | int | bool]


class Frame(NamedTuple):
    """Maps of one step in single precision, (nx, ny): film [m], pressure [Pa], where bodies touch."""

    number: int
    time: float
    gap: Field
    pressure: Field
    in_contact: Mask


class HistoryProgress(NamedTuple):
    """How far a history is: the step just taken, of how many, and its row."""

    number: int
    steps: int
    row: Row


@dataclass(frozen=True, kw_only=True)
class History:
    """A contact over time.

    `table` has a row a step, step 0 the start: `step`, `time_s`, the scalars of `ContactState`, `contact_force_n` (load
    that asperities carry), friction's coefficient, its two parts and `friction_power_w`, `flow_power_w` (heat of the
    pressure-driven flow), `heat_j` (both, summed over time by the trapezoidal rule), `elastic_energy_j` (of a line
    contact up to a constant), `rigid_approach_m`, `resonance_hz` (natural frequency of the contact oscillator on this
    step's contact; NaN without one), `track_sq_m` and `flattened_m` (Sq of the whole tracks, and how far they have been
    pressed down on average), `newton_steps` and `converged`. `seconds` is what computing took this time, of
    `computed` steps; `folder` where it is kept, `memory` what the
    next step needs to know.
    """

    case: Case
    table: "pandas.DataFrame"
    frames: tuple[Frame, ...]
    folder: Path | None
    seconds: float
    computed: int
    memory: Memory | None = field(default=None, repr=False)

    @property
    def steps(self) -> int:
        """Number of the last step."""
        return int(self.table["step"].iloc[-1])

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that a reader of the numbers has to know."""
        return (*self.case.surface_notes, *self.case.notes)

    @property
    def failed(self) -> tuple[int, ...]:
        """Steps that did not converge."""
        return tuple(int(number) for number in self.table["step"][~self.table["converged"]])

    @property
    def settled(self) -> "pandas.DataFrame":
        """The steps that means are of: oil has crossed the domain once, or else the second half.

        Where surfaces are flattened nothing repeats, and it is the last pass.
        """
        if self.case.motion.flattening:
            length = _steps_a_pass(self.case, self.case.moving_surfaces())
            if length < self.steps:
                last: pandas.DataFrame = self.table[self.table["step"] > self.steps - length + 1e-9]
                return last
        crossing = math.ceil(self.case.grid.cells[0] / self.case.motion.time_step)
        return self.table[self.table["step"] >= min(crossing, (self.steps + 1) // 2)]

    def by_pass(self) -> "pandas.DataFrame":
        """Each whole pass of the rough surface's track (of two, the slower one's), the start apart: means of its steps.

        Columns as in `table`, `pass` in place of `step`; of what only grows or falls (`time_s`, `track_sq_m`,
        `flattened_m`, `heat_j`) the value at its end.
        """
        length = _steps_a_pass(self.case, self.case.moving_surfaces())
        moving = self.table[self.table["step"] > 0]
        number = np.ceil(moving["step"] / length - 1e-9).astype(int)
        whole = moving[number * length <= self.steps + 1e-9]
        grouped = whole.groupby(number.rename("pass"))
        means: pandas.DataFrame = grouped.mean(numeric_only=True).drop(columns="step").reset_index()
        for column in ("time_s", "track_sq_m", "flattened_m", "heat_j"):
            means[column] = grouped[column].last().to_numpy()
        return means

    @cached_property
    def vibration(self) -> Vibration | None:
        """What the mean contact of the settled steps sounds like.

        None without [vibration], or where its stiffness or excitation is that of one solved contact.
        """
        model, case = self.case.vibration, self.case
        if model is None or needs_solution(model):
            return None
        with case.naming("vibration"):
            return contact_vibration(self.mean_state, case.conditions, model)

    @property
    def mean_state(self) -> ContactState:
        """The mean contact of the settled steps; it has no lambda ratio."""
        means = self.settled.mean(numeric_only=True)
        values: dict[str, Any] = {name: float(means[column]) for name, column in _STATE.items()}
        return ContactState(**values | {"lambda_ratio": None})

    def surfaces(self) -> MovingSurfaces:
        """The case's surfaces, as far pressed flat as they are at the end."""
        surfaces = self.case.moving_surfaces()
        if self.case.motion.flattening and self.memory is not None:
            return surfaces.lowered(self.memory["lowered_first"], self.memory["lowered_second"])
        return surfaces

    def scalars(self) -> dict[str, Any]:
        """What `asperity run --json` says of the history: means and standard deviations over the settled steps."""
        rows, first = self.settled, self.table.iloc[0]
        said: dict[str, Any] = {
            "verdict": self.verdict(),
            "steps": self.steps,
            "computed": self.computed,
            "failed": list(self.failed),
            "time_s": float(self.table["time_s"].iloc[-1]),
            "step_s": float(self.table["time_s"].iloc[1]) if self.steps else None,
            "settled_from_step": int(rows["step"].iloc[0]),
            "seconds": self.seconds,
            "folder": None if self.folder is None else str(self.folder),
        }
        for name in _SUMMARISED:
            said[name] = _number(rows[name].mean())
            said[f"{name}_std"] = _number(rows[name].std(ddof=0))
            said[f"{name}_start"] = _number(first[name])
        resonance = None if self.vibration is None else self.vibration.resonance
        heard = resonance is not None and resonance.found
        if self.case.motion.flattening:
            kept = ["pass", "time_s", "car", "clr", "track_sq_m", "flattened_m", "friction_coefficient", "resonance_hz"]
            passes = self.by_pass()[kept].astype(object)
            said["passes"] = passes.where(passes.notna(), None).to_dict("records")
        said["crf_hz"] = _number(resonance.crf_hz) if resonance is not None and heard else None
        said["crfa"] = _number(resonance.crfa) if resonance is not None and heard else None
        return said

    def verdict(self) -> str:
        """One sentence: what moving did to the contact."""
        rows, first = self.settled, self.table.iloc[0]
        at_start = "snapshot" if self.case.motion.start == "steady" else "contact at rest"
        sentence = (
            f"Asperities carry {100 * rows['clr'].mean():.1f} ± {100 * rows['clr'].std(ddof=0):.1f} % of the load in "
            f"motion, {100 * first['clr']:.1f} % in the {at_start}: {self.steps} steps, "
            f"{1e6 * self.table['time_s'].iloc[-1]:.4g} us"
        )
        if self.case.motion.flattening and len(passes := self.by_pass()):
            sentence += f", the mean of the last of {len(passes)} passes"
        if self.failed:
            sentence = f"NOT CONVERGED at step {self.failed[0]}, do not use what follows it: {sentence}"
        return f"{sentence}."


_STATE = {  # a field of ContactState, and the column that has it
    "car": "car",
    "car_domain": "car_domain",
    "clr": "clr",
    "capped_oil_load_ratio": "capped_oil_load_ratio",
    "sq": "sq_m",
    "h_min": "h_min_m",
    "h_central": "h_central_m",
    "h_mean": "h_mean_m",
    "p_max": "p_max_pa",
    "reynolds_residual": "reynolds_residual",
    "load_error": "load_error",
    "mass_flux_imbalance": "mass_flux_imbalance",
}
_SUMMARISED = (
    "car",
    "car_domain",
    "clr",
    "h_min_m",
    "h_central_m",
    "h_mean_m",
    "p_max_pa",
    "friction_coefficient",
    "friction_power_w",
    "flow_power_w",
    "contact_force_n",
    "resonance_hz",
    "mass_flux_imbalance",
)


def run_history(
    case: Case,
    *,
    steps: int | None = None,
    passes: float | None = None,
    out: Path | None = None,
    every: int | None = None,
    strict: bool = True,
    progress: Callable[[HistoryProgress], None] | None = None,
) -> History:
    """Let a case's roughness move.

    Parameters
    ----------
    case : with a [motion], or the defaults of one
    steps : the number of the last step; the case's unless given
    passes : in place of `steps`, how often the rough surface runs its whole track (of two, the slower one)
    out : folder to keep the history in, and to go on from where it holds the same case's; None keeps it in memory
    every : keep maps of every so many steps; about 40 in all unless given
    strict : stop at the first step that does not converge; else mark it and go on
    progress : called after every step

    Raises
    ------
    BadInput
        for a dry contact, heat that is fed back, no steps, or a folder that holds something else.
    NotConverged
        if `strict`; its `solution` is the history, the bad step the last of it.
    """
    from threadpoolctl import threadpool_limits

    surfaces = _surfaces_of(case)
    last = _last_step(case, surfaces, steps, passes)
    model = _model_of(case)
    began = time.perf_counter()
    # sums over several threads depend on their number, and vectors this short are slower for it
    with _keeper(case, surfaces, last, out, every) as keeper, threadpool_limits(1):
        before = len(keeper.rows)
        if last > keeper.last:
            taken: Iterator[Snapshot] = model(
                case.conditions,
                case.lubricant,
                surfaces,
                start=case.motion.start,
                resume=keeper.memory,
                time_step=case.motion.time_step,
                flattening=case.motion.flattening,
                options=case.options,
            )
            for snapshot in taken:
                row = _row(snapshot, case, keeper.rows[-1] if keeper.rows else None)
                bad = strict and not row["converged"]
                keeper.keep(snapshot, row, bad=bad)
                if progress is not None:
                    progress(HistoryProgress(snapshot.number, last, row))
                if bad or snapshot.number >= last:
                    break
        history = keeper.history(time.perf_counter() - began, len(keeper.rows) - before)
    if strict and history.failed:
        number = history.failed[0]
        raise NotConverged(
            history,
            f"step {number} of {last} did not converge; what came before it is good, --keep-going marks it and goes on",
        )
    return history


def load_history(folder: str | Path) -> History:
    """A history as its folder keeps it.

    Raises
    ------
    UnreadableFile
        if there is none, or it is damaged.
    """
    folder = Path(folder)
    manifest = read_manifest(folder, of="history", layout=FORMAT)
    home = (folder / manifest["case_folder"]).resolve()
    case = load_case(manifest["case"], folder=home, name=manifest["source"])
    rows = _rows(folder)
    if not rows:
        raise UnreadableFile(f"{folder} holds a history without a step; run its case again")
    return History(
        case=case,
        table=_table(rows),
        frames=_frames(folder, int(rows[-1]["step"])),
        folder=folder,
        seconds=0.0,
        computed=0,
        memory=_memory(folder),
    )


def is_history(folder: Path) -> bool:
    """Whether a folder says of itself that it holds a history."""
    try:
        return (folder / TABLE).exists() and json.loads((folder / MANIFEST).read_text("utf-8"))["of"] == "history"
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _surfaces_of(case: Case) -> MovingSurfaces:
    if case.lubricant is None:
        raise BadInput(f"{case.source}: a dry contact has no history; give it a [lubricant]")
    if case.thermal.feedback:
        raise BadInput(f"{case.source}: motion knows no warm film; set thermal.feedback=false")
    return case.moving_surfaces()


def _model_of(case: Case) -> Steps:
    name: str = case.contents.model
    if name not in MODELS:
        raise BadInput(f"{case.source}: model {name} has no steps in time; {' or '.join(MODELS)} has")
    return MODELS[name]


def _last_step(case: Case, surfaces: MovingSurfaces, steps: int | None, passes: float | None) -> int:
    if passes is None:
        wanted = case.motion.steps if steps is None else steps
    elif steps is not None:
        raise BadInput(f"both steps ({steps}) and passes ({passes:g}) are given; leave one out")
    else:
        exact = passes * _steps_a_pass(case, surfaces)
        if not 0.0 < exact < math.inf:
            raise BadInput(f"passes must be positive, of a rough surface that moves, got {passes:g}; give steps")
        wanted = math.ceil(exact - 1e-9)
    if wanted < 1:
        raise BadInput(f"steps must be at least 1, got {wanted}")
    return wanted


def _steps_a_pass(case: Case, surfaces: MovingSurfaces) -> float:
    rough = surfaces.rough if any(surfaces.rough) else (True, True)
    passage = max(surfaces.passage(index) for index in (0, 1) if rough[index])
    return passage / step_seconds(case.conditions, surfaces, case.motion.time_step)


def _row(snapshot: Snapshot, case: Case, before: Row | None) -> Row:
    """The line of the table; equal steps give equal lines, so what computing took is not in it."""
    solution, state = snapshot.solution, snapshot.state
    rubbing = friction(solution, boundary_friction=case.boundary_friction, thermal=case.thermal)
    row: Row = {"step": snapshot.number, "time_s": snapshot.time}
    row |= {column: getattr(state, name) for name, column in _STATE.items()}
    row |= {
        "contact_force_n": state.clr * case.conditions.load,
        "friction_coefficient": rubbing.coefficient,
        "friction_asperity_part": rubbing.asperity_part,
        "friction_oil_part": rubbing.oil_part,
        "friction_power_w": rubbing.power,
        "flow_power_w": snapshot.flow_power,
        "heat_j": 0.0,
        "elastic_energy_j": snapshot.elastic_energy,
        "rigid_approach_m": solution.rigid_approach,
        "resonance_hz": _resonance_hz(state, case),
        "track_sq_m": snapshot.track_sq,
        "flattened_m": snapshot.flattened,
        "newton_steps": solution.convergence.iterations,
        "converged": solution.convergence.converged,
    }
    if before is not None:
        warming = sum(float(one[name]) for one in (before, row) for name in ("friction_power_w", "flow_power_w"))
        row["heat_j"] = before["heat_j"] + 0.5 * warming * (snapshot.time - before["time_s"])
    return row


def _resonance_hz(state: ContactState, case: Case) -> float:
    model = case.vibration
    if model is None or needs_solution(model):
        return math.nan
    try:
        return oscillator(state, case.conditions, model).natural_frequency_hz
    except BadInput:  # nothing touches: there is no spring
        return math.nan


def _number(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def _table(rows: list[Row]) -> "pandas.DataFrame":
    import pandas

    return pandas.DataFrame(rows)


# On disk -------------------------------------------------------------------------------------------------------------


class _Keeper:
    """The rows and maps of a history as they come, in memory and, with a folder, on disk."""

    def __init__(self, case: Case, folder: Path | None, every: int) -> None:
        self.case, self.folder, self.every = case, folder, every
        self.rows: list[Row] = []
        self.frames: list[Frame] = []
        self.memory: Memory | None = None
        self.kept_at = time.monotonic()
        if folder is not None:
            self.memory = _memory(folder)
            if self.memory is not None:
                self.rows = [row for row in _rows(folder) if row["step"] <= int(self.memory["number"])]
                if not self.rows or self.rows[-1]["step"] != int(self.memory["number"]):
                    raise UnreadableFile(f"{folder / TABLE} ends before {folder / MEMORY}; start another folder")

    @property
    def last(self) -> int:
        """Number of the last step kept; -1 before the start."""
        return int(self.rows[-1]["step"]) if self.rows else -1

    def keep(self, snapshot: Snapshot, row: Row, *, bad: bool) -> None:
        """Keep a step; after a bad one the history goes on from the last good one."""
        self.rows.append(row)
        if not bad:
            self.memory = snapshot.memory
        if snapshot.number % self.every == 0 and not bad:
            frame = _frame(snapshot)
            if self.folder is None:
                self.frames.append(frame)
            else:
                _write_frame(frame, snapshot, self.folder)
        if self.folder is not None and time.monotonic() - self.kept_at > KEPT_EVERY_S:
            self.write(self.folder)

    def write(self, folder: Path) -> None:
        """Rows first, then what the next step needs: a crash between them leaves rows too many, which are dropped."""
        import pyarrow
        import pyarrow.parquet

        if self.memory is None:
            return
        table = pyarrow.Table.from_pylist(self.rows).replace_schema_metadata({"case": self.case.text})
        with whole_file(folder / TABLE) as part:
            pyarrow.parquet.write_table(table, part)
        with whole_file(folder / MEMORY) as part, part.open("wb") as file:
            arrays: dict[str, Any] = dict(self.memory)
            np.savez(file, **arrays)
        self.kept_at = time.monotonic()

    def history(self, seconds: float, computed: int) -> History:
        """All of it, written."""
        frames = tuple(self.frames)
        if self.folder is not None:
            if computed:
                self.write(self.folder)
            frames = _frames(self.folder, self.last)
        return History(
            case=self.case,
            table=_table(self.rows),
            frames=frames,
            folder=self.folder,
            seconds=seconds,
            computed=computed,
            memory=self.memory,
        )


@contextmanager
def _keeper(
    case: Case, surfaces: MovingSurfaces, last: int, folder: Path | None, every: int | None
) -> Iterator[_Keeper]:
    if every is not None and every < 1:
        raise BadInput(f"maps are kept every 1 step or more, got {every}; leave it out for about {MAPS_KEPT} in all")
    usual = max(1, math.ceil(last / MAPS_KEPT))
    if folder is None:
        yield _Keeper(case, None, every or usual)
        return
    import filelock

    if folder.exists():
        make_folder(folder)  # a file is refused
    digest, manifest = _digest(case, surfaces), folder / MANIFEST
    if manifest.exists():
        kept = read_manifest(folder, of="history", layout=FORMAT)
        if kept["versions"]["asperity"] != version("asperity"):
            raise BadInput(
                f"{folder} was computed by asperity {kept['versions']['asperity']}, this is {version('asperity')}; "
                "choose another folder"
            )
        if kept["digest"] != digest:
            raise BadInput(
                f"{folder} holds the history of another case than {case.source}; choose another folder, or the case "
                "as it was"
            )
        usual = kept["every"]
    elif folder.exists() and any(folder.iterdir()):
        raise BadInput(f"{folder} is not empty and holds no history; name a new folder")
    make_folder(folder / MAPS)
    require_writable(manifest)
    try:
        with filelock.FileLock(folder / ".lock", timeout=0):
            for left in (*folder.glob(".*.part"), *(folder / MAPS).glob(".*.part")):
                left.unlink(missing_ok=True)
            with whole_file(manifest) as part:
                part.write_text(json.dumps(_about(case, digest, every or usual, folder), indent=1), "utf-8")
            yield _Keeper(case, folder, every or usual)
    except filelock.Timeout:
        raise BadInput(f"another process computes this history in {folder}; wait for it, or stop it") from None


def _digest(case: Case, surfaces: MovingSurfaces) -> str:
    """What has to be the same for a history to go on: all of the case but how long it goes on, and its surfaces."""
    tables = tomllib.loads(case.text)
    tables["motion"] = case.motion.model_dump(exclude={"steps"})
    tables.pop("study", None)
    digest = hashlib.sha256(json.dumps(tables, sort_keys=True).encode())
    for surface in (surfaces.first, surfaces.second):
        digest.update(np.ascontiguousarray(surface.heights).tobytes())
    return digest.hexdigest()


def _about(case: Case, digest: str, every: int, folder: Path) -> dict[str, Any]:
    return {
        "of": "history",
        "format": FORMAT,
        "digest": digest,
        "versions": versions(),
        "source": case.source,
        "case": case.text,
        "case_folder": relative_path(case.folder.resolve(), folder.resolve()),
        "every": every,
    }


def _rows(folder: Path) -> list[Row]:
    import pyarrow
    import pyarrow.parquet

    path = folder / TABLE
    if not path.exists():
        return []
    try:
        rows: list[Row] = pyarrow.parquet.read_table(path).to_pylist()
    except (OSError, pyarrow.ArrowException) as error:
        raise UnreadableFile(f"{path} is damaged ({error}); run the case into another folder") from None
    return rows


def _memory(folder: Path) -> Mapping[str, Field] | None:
    path = folder / MEMORY
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as kept:
            return {name: kept[name] for name in kept.files}
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise UnreadableFile(f"{path} is damaged ({error}); run the case into another folder") from None


def _frame(snapshot: Snapshot) -> Frame:
    solution = snapshot.solution
    gap, pressure = solution.gap.astype(np.float32), solution.pressure.astype(np.float32)
    return Frame(snapshot.number, snapshot.time, gap, pressure, solution.in_contact)


def _write_frame(frame: Frame, snapshot: Snapshot, folder: Path) -> None:
    import xarray

    grid, on = snapshot.solution.grid, ("x", "y")
    touching = {"long_name": "asperity contact", "flag_values": np.array([0, 1], np.int8)}
    dataset = xarray.Dataset(
        {
            "gap": (on, frame.gap, {"long_name": "gap between the deformed surfaces", "units": "m"}),
            "pressure": (on, frame.pressure, {"long_name": "contact pressure", "units": "Pa"}),
            "in_contact": (on, frame.in_contact.astype(np.int8), touching | {"flag_meanings": "apart touching"}),
            "surface_height": (
                on,
                snapshot.solution.surface.heights.astype(np.float32),
                {"long_name": "composite roughness, positive is material", "units": "m"},
            ),
        },
        {
            "x": ("x", grid.x, {"long_name": "position along rolling", "units": "m", "axis": "X"}),
            "y": ("y", grid.y, {"long_name": "position along the contact line", "units": "m", "axis": "Y"}),
        },
        {"Conventions": "CF-1.11", "title": "Step of a moving contact", "step": frame.number, "time_s": frame.time},
    )
    save_dataset(dataset, folder / MAPS / f"step-{frame.number:06d}.nc")


def _frames(folder: Path, last: int) -> tuple[Frame, ...]:
    """The maps on disk, up to the last step kept."""
    import xarray

    frames = []
    for path in sorted((folder / MAPS).glob("step-*.nc")):
        try:
            with xarray.open_dataset(path, engine="h5netcdf", decode_cf=False) as opened:
                number, when = int(opened.attrs["step"]), float(opened.attrs["time_s"])
                maps = [opened[name].values for name in ("gap", "pressure", "in_contact")]
        except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError):
            raise UnreadableFile(f"{path} is damaged; delete it, or run the case into another folder") from None
        if number <= last:
            frames.append(Frame(number, when, maps[0], maps[1], maps[2].astype(bool)))
    return tuple(frames)
