"""Structure of a TOML file: matrices, or modes."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file
from asperity.structure.matrices import Structure

MAX_BYTES = 20_000_000  # of a file: matrices of a thousand degrees of freedom
KEYS = {"name", "mass", "stiffness", "damping", "contact", "sensor", "noise", "modes"}
MODE_KEYS = {"frequency_hz", "damping_ratio", "contact", "sensor"}


@dataclass(frozen=True, eq=False, kw_only=True)
class NamedStructure:
    """Structure with its name, and the noise density of its sensor [m/s²/√Hz], if known."""

    name: str
    structure: Structure
    noise: float | None = None


def load_structure(path: str | Path) -> NamedStructure:
    """Load a structure in SI units from a TOML file.

    The file has the matrices `mass`, `stiffness` and perhaps `damping`, with `contact` and
    `sensor`; or `[modes]` with `frequency_hz`, `damping_ratio`, `contact` and `sensor`. `name` and
    `noise` are optional.

    Raises
    ------
    UnreadableFile
        for a missing file, a large one, or one that is not TOML.
    BadInput
        for missing or unknown keys, and as `Structure`.
    """
    path = Path(path)
    require_file(path)
    if path.stat().st_size > MAX_BYTES:
        raise UnreadableFile(
            f"{path} has {path.stat().st_size} bytes, too many for a structure; reduce it to fewer "
            "modes"
        )
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise UnreadableFile(f"{path} is not valid TOML: {error}") from None
    unknown = sorted(set(content) - KEYS)
    if unknown:
        raise BadInput(f"{path}: unknown key {unknown[0]!r}; use {', '.join(sorted(KEYS))}")
    try:
        return NamedStructure(
            name=str(content.get("name", path.stem)),
            structure=_structure(content),
            noise=None if "noise" not in content else _positive(content["noise"]),
        )
    except KeyError as missing:
        raise BadInput(f"{path}: {missing.args[0]} is missing; add it") from None
    except (TypeError, ValueError) as error:
        reason = str(error) if isinstance(error, BadInput) else f"not numbers ({error})"
        raise BadInput(f"{path}: {reason}") from None


def _structure(content: dict[str, object]) -> Structure:
    modes = content.get("modes")
    if modes is None:
        mass = np.asarray(content["mass"], dtype=float)
        damping = content.get("damping")
        return Structure(
            mass=mass,
            stiffness=np.asarray(content["stiffness"], dtype=float),
            damping=np.zeros(mass.shape) if damping is None else np.asarray(damping, dtype=float),
            contact=np.asarray(content["contact"], dtype=float),
            sensor=np.asarray(content["sensor"], dtype=float),
        )
    if not isinstance(modes, dict) or set(modes) != MODE_KEYS:
        raise BadInput(f"[modes] must have {', '.join(sorted(MODE_KEYS))}")
    return Structure.from_modes(
        modes["frequency_hz"],
        modes["damping_ratio"],
        contact=modes["contact"],
        sensor=modes["sensor"],
    )


def _positive(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < np.inf:
        raise BadInput(f"noise must be a positive number in m/s²/√Hz, got {value!r}")
    return float(value)
