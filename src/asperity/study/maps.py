"""Maps of a study's cases: a zarr group a case, one chunk a map, for other tools too.

A group carries a digest of all its maps and the case that they are of; each chunk has a checksum
besides, by which other readers notice damage. Which cases a folder holds is left to `store`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.limits import require_unpacked
from asperity.core.storage import digest
from asperity.core.third_party import first_line

MAPS = "fields.zarr"
_SEAL, _STUDY = "asperity_sha256", "asperity_study"  # attributes of a group
REMEDY = "delete its group and part, and the case is computed again"


def require_zarr() -> Any:
    """The zarr library; BadInput where it is not installed."""
    try:
        import zarr
    except ModuleNotFoundError:
        raise BadInput("keeping fields needs zarr; pip install 'asperity[study]'") from None
    return zarr


def write_maps(folder: Path, study: str, case_id: str, maps: Mapping[str, Field]) -> None:
    """Keep the maps of a case in a study's folder, the digest last; `AsperityError` if the system refuses to write."""
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
    """The maps of a case as they were kept; UnreadableFile where there are none, or others."""
    zarr, path = require_zarr(), folder / MAPS / case_id
    if not path.is_dir():
        raise UnreadableFile(
            f"{folder} keeps no maps of case {case_id}; name them with --fields when it is computed"
        )
    try:
        group = zarr.open_group(path, mode="r", zarr_format=3)
        about, arrays = dict(group.attrs), dict(group.arrays())
        require_unpacked(path, float(sum(array.nbytes for array in arrays.values())), REMEDY)
        maps = {name: np.asarray(array[...]) for name, array in sorted(arrays.items())}
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path} is damaged ({first_line(error)}); {REMEDY}") from error
    if about.get(_SEAL) != _sealed(study, case_id, maps):
        raise UnreadableFile(
            f"{path} is damaged, or of another study: its digest is of other content; {REMEDY}"
        )
    return maps


def _sealed(study: str, case_id: str, maps: Mapping[str, Field]) -> str:
    return digest(
        {"study": study, "case": case_id, "maps": {name: np.asarray(maps[name]) for name in maps}}
    )
