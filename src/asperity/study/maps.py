"""Maps of a study's cases in zarr: one group per case, one chunk per map, readable by other tools.

A group stores a digest of its maps and case; each chunk has a checksum, so that other readers
detect damage too. `store` knows the cases of a folder.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, UnreadableFile, install_text
from asperity.core.limits import require_plausible_size
from asperity.core.sandbox import read_in_subprocess
from asperity.core.storage import digest
from asperity.core.third_party import first_line

MAPS = "fields.zarr"
_SEAL, _STUDY = "asperity_sha256", "asperity_study"  # attributes of a group
REMEDY = "delete its group and part; the case is then computed again"


def require_zarr() -> Any:
    """Import zarr; BadInput if it is not installed."""
    try:
        import zarr
    except ModuleNotFoundError:
        raise BadInput(f"storing fields needs zarr; {install_text('study')}") from None
    return zarr


def write_maps(folder: Path, study: str, case_id: str, maps: Mapping[str, Field]) -> None:
    """Write the maps of a case, the digest last; `AsperityError` if the system refuses to write."""
    zarr, path = require_zarr(), folder / MAPS
    codecs = (zarr.codecs.ZstdCodec(), zarr.codecs.Crc32cCodec())
    try:
        group = zarr.open_group(path, mode="a").create_group(case_id, overwrite=True)
        for name, values in maps.items():
            group.create_array(name, data=values, chunks=values.shape, compressors=codecs)
        group.attrs.update({_STUDY: study, _SEAL: _sealed(study, case_id, maps)})
    except OSError as error:
        raise AsperityError(
            f"{path} could not be written: {error.strerror or error}; finished cases are kept"
        ) from error


def read_maps(folder: Path, study: str, case_id: str) -> dict[str, Field]:
    """Read the maps of a case; UnreadableFile if there are none, or they belong to another case."""
    require_zarr()
    path = folder / MAPS / case_id
    if any(part.is_symlink() for part in (path.parent, path, *path.rglob("*"))):
        raise UnreadableFile(f"{path} contains a link, which is not followed; {REMEDY}")
    if not path.is_dir():
        raise UnreadableFile(
            f"{folder} has no maps of case {case_id}; run the study with --fields in a new folder, "
            "because finished cases are not computed again"
        )
    maps: dict[str, Field] = read_in_subprocess(
        path.absolute(), f"{__name__}:unpack_maps", study, case_id, remedy=REMEDY
    )
    return maps


def unpack_maps(path: Path, study: str, case_id: str) -> dict[str, Field]:
    """Return the maps of a group and verify their digest, in the subprocess of `core.sandbox`."""
    zarr = require_zarr()
    try:
        group = zarr.open_group(path, mode="r", zarr_format=3)
        attributes = dict(group.attrs)
        arrays = dict(group.arrays())
        require_plausible_size(path, float(sum(array.nbytes for array in arrays.values())), REMEDY)
        maps = {name: np.asarray(array[...]) for name, array in sorted(arrays.items())}
    except (UnreadableFile, MemoryError):
        raise
    except Exception as error:
        raise UnreadableFile(f"{path} is damaged ({first_line(error)}); {REMEDY}") from error
    if attributes.get(_SEAL) != _sealed(study, case_id, maps):
        raise UnreadableFile(
            f"{path} is damaged or belongs to another study (digest mismatch); {REMEDY}"
        )
    return maps


def _sealed(study: str, case_id: str, maps: Mapping[str, Field]) -> str:
    return digest(
        {"study": study, "case": case_id, "maps": {name: np.asarray(maps[name]) for name in maps}}
    )
