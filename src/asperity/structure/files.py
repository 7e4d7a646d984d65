"""Structure of a file: bodies, matrices, modes or receptances, in TOML, csv or netCDF."""

import csv
import tomllib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile, install_text
from asperity.core.files import require_file
from asperity.core.sandbox import read_in_subprocess
from asperity.core.storage import read_netcdf
from asperity.structure.bodies import BODY_KEYS, structure_of_bodies
from asperity.structure.matrices import Structure
from asperity.structure.rational import Complex
from asperity.structure.receptance import Receptances
from asperity.structure.universal_file import FREQUENCY_RESPONSE, POWER_SPECTRUM, REMEDY, Function

MACHINES = Path(__file__).parent / "machines"
FREQUENCY_STD = 0.05  # relative, of a structure whose masses and springs were not measured
MAX_LENGTH = {1: 100_000, 2: 500}  # of frequencies or modes; of matrices
MAX_BYTES = 20_000_000  # of a file: matrices of a thousand degrees of freedom
MATRIX_KEYS = ("mass", "stiffness", "damping", "contact", "sensor")
MODE_KEYS = ("frequency_hz", "damping_ratio", "contact", "sensor")
RECEPTANCE_KEYS = (
    *("frequency_hz", "approach_real", "approach_imag", "transfer_real", "transfer_imag"),
)
NODE_KEYS = ("file", "body_1", "body_2", "sensor")
Content: TypeAlias = Mapping[str, object]


@dataclass(frozen=True, eq=False)
class SensorNoise:
    """Amplitude density of a sensor's noise [m/s²/√Hz] over frequency, constant beyond its ends."""

    frequencies_hz: Field
    density: Field

    def interpolate(self, frequency_hz: float) -> float:
        """Return the density at a frequency."""
        return float(np.interp(frequency_hz, self.frequencies_hz, self.density))


@dataclass(frozen=True, eq=False, kw_only=True)
class NamedStructure:
    """Structure without its contact, with its name, and the noise of its sensor, if known.

    `frequency_std` is the relative standard deviation of its frequencies.
    """

    name: str
    structure: Structure | Receptances
    noise: SensorNoise | None = None
    frequency_std: float = FREQUENCY_STD


def machine_structures() -> tuple[str, ...]:
    """Return the names of the built-in structures, each with a data sheet of its numbers."""
    return tuple(sorted(path.stem for path in MACHINES.glob("*.toml")))


def load_structure(path: str | Path, *, folder: Path | None = None) -> NamedStructure:
    """Load a structure in SI units from a file, or a built-in one by its name.

    A file has one of

    - bodies and springs, see `structure_of_bodies`,
    - the matrices `mass`, `stiffness` and perhaps `damping`, with `contact` and `sensor`,
    - modes: `frequency_hz`, `damping_ratio`, `contact` and `sensor`,
    - receptances: `frequency_hz`, `approach_real`, `approach_imag`, `transfer_real` and
      `transfer_imag`,

    as keys of TOML, where modes stand in `[modes]`; all but bodies also as variables of netCDF, and
    modes and receptances as columns of csv. TOML and the attributes of netCDF may state `name`,
    `noise` [m/s²/√Hz] and `frequency_std`, the relative standard deviation of its frequencies (0.05
    by default).

    `[receptances]` in TOML names a universal `file` (data set 58, function type 4) and in it
    `body_1`, perhaps `body_2`, and `sensor`, each as node and axis such as "11Z", both bodies along
    one axis. Missing responses from body 1 or the sensor to body 2 count as 0, as of separate
    bodies. The power spectrum of the sensor (type 9) is the noise.

    Parameters
    ----------
    path : of the file, or the name of a built-in structure
    folder : base of a relative path; None: the current one

    Raises
    ------
    UnreadableFile
        for a missing file, a large one, or one that is damaged or in another format.
    BadInput
        for missing or unknown keys, a universal file without the extra `recordings`, and as
        `Structure` and `Receptances`.
    """
    if str(path) in machine_structures():
        path = MACHINES / f"{path}.toml"
    elif not Path(path).suffix:
        raise BadInput(
            f"structure {str(path)!r} is not built in; use {', '.join(machine_structures())}, or "
            "name a file"
        )
    path = Path(path) if folder is None else folder / path
    require_file(path)
    if path.stat().st_size > MAX_BYTES:
        raise UnreadableFile(
            f"{path} has {path.stat().st_size} bytes, too many for a structure; reduce it to fewer "
            "modes"
        )
    readers = {".csv": _read_csv, ".nc": _read_netcdf, ".toml": _read_toml}
    if path.suffix.lower() not in readers:
        raise BadInput(
            f"a structure is read from .toml, .csv or .nc, got {path.name}; "
            "name a universal file in [receptances] of a .toml file"
        )
    content = readers[path.suffix.lower()](path)
    try:
        return _named(path, content)
    except UnreadableFile:
        raise
    except KeyError as missing:
        raise BadInput(f"{path}: {missing.args[0]} is missing; add it") from None
    except (TypeError, ValueError, OverflowError) as error:
        reason = str(error) if isinstance(error, BadInput) else f"not numbers ({error})"
        raise BadInput(f"{path}: {reason}") from None


def _named(path: Path, content: Content) -> NamedStructure:
    noise = _positive(content, "noise", " in m/s²/√Hz", None)
    sensor_noise = None if noise is None else SensorNoise(np.zeros(1), np.full(1, noise))
    nodes, modes = content.get("receptances"), content.get("modes")
    structure: Structure | Receptances
    if isinstance(nodes, Mapping):
        _require_keys("[receptances]", nodes, NODE_KEYS)
        structure, measured = _measured(path, nodes)
        sensor_noise = sensor_noise or measured
    else:
        if isinstance(modes, Mapping):
            _require_keys("[modes]", modes, MODE_KEYS)
            content = {**content, **modes}
        structure = _structure(content)
    return NamedStructure(
        name=str(content.get("name", path.stem)),
        structure=structure,
        noise=sensor_noise,
        frequency_std=_positive(content, "frequency_std", "", FREQUENCY_STD) or FREQUENCY_STD,
    )


def _structure(content: Content) -> Structure | Receptances:
    if "approach_real" in content:
        frequencies_hz, *parts = (_numbers(content, key) for key in RECEPTANCE_KEYS)
        return Receptances(
            frequencies_hz=frequencies_hz,
            approach=parts[0] + 1j * parts[1],
            transfer=parts[2] + 1j * parts[3],
        )
    if "bodies" in content:
        return structure_of_bodies(content)
    if "frequency_hz" in content:
        frequencies_hz, ratios, contact, sensor = (_numbers(content, key) for key in MODE_KEYS)
        return Structure.from_modes(frequencies_hz, ratios, contact=contact, sensor=sensor)
    if "mass" not in content:
        raise BadInput(
            "it has no structure: give bodies, matrices with mass, modes with frequency_hz, or "
            "receptances with approach_real"
        )
    mass = _numbers(content, "mass")
    return Structure(
        mass=mass,
        stiffness=_numbers(content, "stiffness"),
        damping=_numbers(content, "damping") if "damping" in content else np.zeros(mass.shape),
        contact=_numbers(content, "contact"),
        sensor=_numbers(content, "sensor"),
    )


def _numbers(content: Content, key: str) -> Field:
    values = np.asarray(content[key], dtype=float)
    if values.ndim and len(values) > MAX_LENGTH[min(values.ndim, 2)]:
        raise BadInput(f"{key} has {len(values)} entries, too many; reduce the structure")
    return values


def _require_keys(table: str, content: Content, keys: tuple[str, ...]) -> None:
    if unknown := sorted(set(content) - set(keys)):
        raise BadInput(f"unknown key {unknown[0]!r} in {table}; use {', '.join(keys)}")


def _positive(content: Content, key: str, unit: str, default: float | None) -> float | None:
    value = content.get(key, default)
    if value is None:
        return None
    if isinstance(value, np.ndarray | list) and np.size(value) == 1:  # of netCDF
        value = np.ravel(np.asarray(value))[0].item()
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < np.inf:
        raise BadInput(f"{key} must be a positive number{unit}, got {value!r}")
    return float(value)


# Formats
# ----------------------------------------------------------------


def _read_toml(path: Path) -> Content:
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise UnreadableFile(f"{path} is not valid TOML: {error}") from None
    try:
        known = ("name", "noise", "frequency_std", "modes", "receptances")
        kind = BODY_KEYS if "bodies" in content else MATRIX_KEYS
        _require_keys("the file", content, (*known, *kind))
    except BadInput as error:
        raise BadInput(f"{path}: {error}") from None
    return content


def _read_csv(path: Path) -> Content:
    try:
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            rows = [[cell.strip() for cell in row] for row in csv.reader(file) if row]
    except csv.Error as error:
        raise UnreadableFile(f"{path} is not a table: {error}") from None
    if len(rows) < 2 or any(len(row) != len(rows[0]) for row in rows):
        raise UnreadableFile(f"{path} is not a table: give it a heading and full rows")
    return dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))


def _read_netcdf(path: Path) -> Content:
    names = {*MATRIX_KEYS, *MODE_KEYS, *RECEPTANCE_KEYS}
    dataset = read_netcdf(path, sorted(names), "write the structure again", sealed=False)
    known = ("name", "noise", "frequency_std")
    stated = {key: dataset.attrs[key] for key in known if key in dataset.attrs}
    return {**{str(name): dataset[name].to_numpy() for name in dataset.variables}, **stated}


def _measured(path: Path, nodes: Content) -> tuple[Receptances, SensorNoise | None]:
    """Return the receptances of the bodies and the sensor in a universal file, and the noise."""
    file = path.parent / str(nodes["file"])
    functions = _functions(file)
    first, second, sensor = (str(nodes.get(key, "")) for key in ("body_1", "body_2", "sensor"))
    found = _responses(file, functions, {first, second, sensor})
    required = [(first, first), (sensor, first), *([(second, second)] if second else [])]
    _require_responses(file, found, required)
    frequencies_hz, _ = found[frozenset((first,))]

    def values(response: str, reference: str) -> Complex:
        absent = frequencies_hz, np.zeros(frequencies_hz.size, dtype=complex)
        at_hz, measured = found.get(frozenset((response, reference)), absent)
        if not np.array_equal(at_hz, frequencies_hz):
            raise BadInput(f"{file.name}: its frequency responses have different frequencies")
        return measured

    approach = values(first, first) + values(second, second) - 2.0 * values(first, second)
    receptances = Receptances(
        frequencies_hz=frequencies_hz,
        approach=approach,
        transfer=values(sensor, first) - values(sensor, second),
    )
    return receptances, _measured_noise(functions, sensor)


def _responses(
    file: Path, functions: Sequence[Function], nodes: set[str]
) -> dict[frozenset[str], tuple[Field, Complex]]:
    """Return the frequency responses by their two nodes; those between `nodes` only once."""
    found: dict[frozenset[str], tuple[Field, Complex]] = {}
    for kind, response, reference, frequencies_hz, values in functions:
        pair = frozenset((response, reference))
        if kind != FREQUENCY_RESPONSE:
            continue
        if pair in found and pair <= nodes:
            raise BadInput(
                f"{file.name} has two frequency responses between {response} and {reference}; "
                "keep one"
            )
        found[pair] = (frequencies_hz, values)
    return found


def _require_responses(
    file: Path, found: Collection[frozenset[str]], required: Iterable[tuple[str, str]]
) -> None:
    for pair in required:
        if frozenset(pair) not in found:
            present = ", ".join(sorted(" and ".join(sorted(entry)) for entry in found))
            raise BadInput(
                f"{file.name} has no frequency response between {pair[0]} and {pair[1]}; it has "
                f"those between {present}"
            )


def _functions(file: Path) -> list[Function]:
    """Read a universal file in the reading process."""
    require_file(file)
    reader = "asperity.structure.universal_file:read_functions"
    try:
        functions: list[Function] = read_in_subprocess(
            file.absolute(), reader, remedy=REMEDY, library="pyuff"
        )
    except ImportError:
        raise BadInput(
            f"{file.name} needs pyuff; install it with {install_text('recordings')}"
        ) from None
    return functions


def _measured_noise(functions: Sequence[Function], sensor: str) -> SensorNoise | None:
    return next(
        (
            SensorNoise(frequencies_hz, np.sqrt(np.abs(density)))
            for kind, response, _, frequencies_hz, density in functions
            if kind == POWER_SPECTRUM and response == sensor
        ),
        None,
    )
