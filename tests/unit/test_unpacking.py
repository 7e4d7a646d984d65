"""Kept files of strangers with a valid digest: nothing outside the file is read, and no bomb."""

import io
import resource
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow
import pytest
import xarray

from asperity.cli import main
from asperity.core.errors import UnreadableFile
from asperity.core.storage import append_digest, read_netcdf, read_table, unpack_arrays, write_table
from asperity.paper import papers_case
from asperity.results import solve_case
from asperity.solution import load_solution
from asperity.study.maps import read_maps, write_maps

HUGE = 1 << 30  # bytes
NAMES = ("gap", "pressure")
SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um"}


def kept(path, fill):
    """Write a netCDF file with a valid digest, filled by a function."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file.create_dataset("pressure", data=np.zeros((4, 5)))
        fill(file)
        for name in ("pressure", "gap"):
            stored = file[name] if isinstance(file.get(name, getlink=True), h5py.HardLink) else None
            if not isinstance(stored, h5py.Dataset) or stored.is_virtual:
                continue
            for number, length in enumerate(stored.shape):  # dimensions, as netCDF has them
                if f"n{length}" not in file:
                    scale = file.create_dataset(f"n{length}", (length,), "f4", chunks=(4,))
                    scale.make_scale(
                        f"This is a netCDF dimension but not a netCDF variable.{length:10d}"
                    )
                stored.dims[number].attach_scale(file[f"n{length}"])
        file.attrs["asperity_format"] = 1
    path.write_bytes(append_digest(buffer.getvalue()))
    return path


def bomb(size=HUGE):
    """Return the deflated bytes of zeros."""
    packer, block = zlib.compressobj(9), bytes(1 << 20)
    return b"".join(packer.compress(block) for _ in range(size >> 20)) + packer.flush()


def gzip_bomb(file):
    gap = file.create_dataset("gap", (64, 32), "f8", chunks=(64, 32), compression="gzip")
    gap.id.write_direct_chunk((0, 0), bomb())


def external_storage(file):
    file.create_dataset("gap", (4,), "u1", external=[("/etc/passwd", 0, 4)])


def virtual(file):
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "gap", (4,))
    file.create_virtual_dataset("gap", layout)


def external_link(file):
    file["gap"] = h5py.ExternalLink("/tmp/other.h5", "/gap")


def soft_link(file):
    file["gap"] = h5py.SoftLink("/pressure")


def group(file):
    file.create_group("gap")


def declared(file):
    file.create_dataset("gap", (1 << 20, 1 << 20), "f8", chunks=(64, 64))


HOSTILE = {
    gzip_bomb: "is not a netCDF file",
    external_storage: "'gap' is not a variable stored in it",
    virtual: "'gap' is not a variable stored in it",
    external_link: "'gap' is not a variable stored in it",
    soft_link: "'gap' is not a variable stored in it",
    group: "'gap' is not a variable stored in it",
    declared: "GB of content, more than the limit",
}


def resident():
    """Return the largest memory of this process so far [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


@pytest.mark.parametrize("fill", HOSTILE, ids=lambda fill: fill.__name__)
def test_a_hostile_netcdf_file_is_refused_in_one_sentence(tmp_path, fill):
    path = kept(tmp_path / "run.nc", fill)
    before = resident()
    for read in (lambda: read_netcdf(path, NAMES, "solve again"), lambda: load_solution(path)):
        with pytest.raises(UnreadableFile) as refused:
            read()
        assert HOSTILE[fill] in str(refused.value)
        assert len(str(refused.value)) < 300
        assert "\n" not in str(refused.value)
    assert resident() - before < 100e6


def test_only_named_variables_are_read(tmp_path):
    def foreign(file):
        file.create_dataset("gap", data=np.ones(4))
        file.create_dataset("n1048576", (1 << 20,), "f4", chunks=(4,)).make_scale("n1048576")
        other = file.create_dataset("other", (1 << 20, 1 << 20), "f8", chunks=(64, 64))
        for dimension in other.dims:
            dimension.attach_scale(file["n1048576"])

    path = kept(tmp_path / "run.nc", foreign)
    dataset = read_netcdf(path, NAMES, "solve again")
    assert {*dataset.variables} == {*NAMES}


def test_a_saved_run_is_read_as_xarray_reads_it(tmp_path):
    case = papers_case().with_overrides(SMALL)
    path = solve_case(case).save(tmp_path / "run.nc")
    with xarray.open_dataset(path, engine="h5netcdf", decode_cf=False) as opened:
        expected = opened.load()
    stored = read_netcdf(path, {*expected.variables}, "solve again")
    xarray.testing.assert_identical(stored, expected)
    for name, variable in expected.variables.items():
        assert stored[name].dtype == variable.dtype
        assert {key: type(value) for key, value in stored[name].attrs.items()} == {
            key: type(value) for key, value in variable.attrs.items()
        }


def test_a_table_of_millions_of_equal_rows_is_refused(tmp_path):
    path = tmp_path / "part.parquet"
    numbers = pyarrow.chunked_array([pyarrow.array(np.zeros(1 << 16))] * 24)
    table = pyarrow.table({f"n{number}": numbers for number in range(60)})
    write_table(path, table, "case")
    assert path.stat().st_size < 10e6
    del table
    before = resident()
    with pytest.raises(UnreadableFile, match=r"part\.parquet needs more than 0\.51 GB of memory"):
        read_table(path, "case", "delete it")
    assert resident() - before < 100e6


@pytest.mark.parametrize("shape", [(), (1 << 40,)])
def test_arrays_that_declare_too_much_are_refused(shape):
    body = io.BytesIO()
    with zipfile.ZipFile(body, "w", zipfile.ZIP_DEFLATED) as packed:
        header = io.BytesIO()
        described = {"descr": "<f8", "fortran_order": False, "shape": shape or (HUGE // 8,)}
        np.lib.format.write_array_header_1_0(header, described)
        with packed.open("a.npy", "w", force_zip64=True) as entry:
            entry.write(header.getvalue())
            for _ in range(0 if shape else HUGE >> 20):
                entry.write(bytes(1 << 20))
    before = resident()
    with pytest.raises(UnreadableFile, match=r"memory\.npz (declares 1\.1 GB|is damaged)"):
        unpack_arrays(body.getvalue(), "memory.npz", "compute it again")
    assert resident() - before < 100e6


def test_maps_of_a_study_that_unpack_to_more_than_declared_are_refused(tmp_path):
    pytest.importorskip("zarr", reason="the extra study is not installed")
    zstd = pytest.importorskip("zstandard", reason="zstd bombs need zstandard")
    write_maps(tmp_path, "study", "case", {"gap": np.ones((8, 8))})
    assert read_maps(tmp_path, "study", "case")["gap"].sum() == 64.0
    (chunk,) = (path for path in tmp_path.rglob("c/*/*") if path.is_file())
    packer = zstd.ZstdCompressor(level=1).compressobj(size=HUGE)
    packed = b"".join(packer.compress(bytes(1 << 20)) for _ in range(HUGE >> 20)) + packer.flush()
    chunk.write_bytes(packed + bytes(4))
    before = resident()
    with pytest.raises(UnreadableFile):
        read_maps(tmp_path, "study", "case")
    assert resident() - before < 100e6


def test_a_report_of_a_hostile_run_exits_with_2(tmp_path, capsys):
    path = kept(tmp_path / "run.nc", gzip_bomb)
    with pytest.raises(SystemExit) as ended:
        main(["report", str(path), "--out", str(tmp_path / "page.html")])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not Path(tmp_path / "page.html").exists()
