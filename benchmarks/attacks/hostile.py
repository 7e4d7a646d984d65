"""Small files that try to exhaust the machine, each with the command that reads it."""

import json
import os
import struct
import zipfile
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

GIGABYTE = 1 << 30
Attack = Callable[[Path], tuple[str, ...]]  # writes files in a folder, returns arguments
CASE = Path(__file__).parents[2] / "examples" / "paper.toml"


def _check(path: Path, *more: str) -> tuple[str, ...]:
    return ("check", str(path), "--rate", "20000", *more)


def _stated(path: Path) -> tuple[str, ...]:
    return ("check", str(path))


def _series(path: Path) -> tuple[str, ...]:
    return ("track", str(path))


def _track(path: Path) -> tuple[str, ...]:
    return ("track", str(path), "--rate", "20000", "--band", "1000", "5000")


def _surface(path: Path, *more: str) -> tuple[str, ...]:
    return ("surface", str(path), *more)


def _matrix(path: Path) -> tuple[str, ...]:
    return (
        "solve",
        str(CASE),
        "--set",
        f"surface={{file='{path}', unit='um', pixel='1 um'}}",
        "--quiet",
    )


# Files that claim to be large
# ----------------------------------------------------------------------------------------------


def sparse(name: str, head: bytes, size: int, command: Callable[[Path], tuple[str, ...]]) -> Attack:
    """Return an attack by a sparse file of this size."""

    def make(folder: Path) -> tuple[str, ...]:
        path = folder / name
        with path.open("wb") as file:
            file.write(head)
            file.truncate(size)
        return command(path)

    return make


def content(
    name: str, make: Callable[[], bytes], command: Callable[[Path], tuple[str, ...]]
) -> Attack:
    """Return an attack by a file of these bytes."""

    def made(folder: Path) -> tuple[str, ...]:
        path = folder / name
        path.write_bytes(make())
        return command(path)

    return made


def npy_head(shape: str, kind: str = "<f8") -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text = text.ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def zeros_zip(path: Path, names: dict[str, bytes], large: str, size: int) -> None:
    """Write a zip archive with one member of `size` zeros."""
    block = bytes(1 << 24)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, body in names.items():
            archive.writestr(name, body)
        with archive.open(large, "w", force_zip64=True) as member:
            for _ in range(size // len(block)):
                member.write(block)


MAIN_XML = """<?xml version="1.0"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">
<Record1><Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>
<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>1e-6</Increment><Offset>0</Offset></CX>
<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>1e-6</Increment><Offset>0</Offset></CY>
<CZ><AxisType>A</AxisType><DataType>D</DataType><Increment>1</Increment><Offset>0</Offset></CZ></Axes></Record1>
<Record3><MatrixDimension><SizeX>{n}</SizeX><SizeY>{n}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink></Record3></p:ISO5436_2>"""


def x3p_bomb(folder: Path) -> tuple[str, ...]:
    zeros_zip(
        folder / "bomb.x3p",
        {"main.xml": MAIN_XML.format(n=23170).encode()},
        "bindata/data.bin",
        4 * GIGABYTE,
    )
    return _surface(folder / "bomb.x3p")


def x3p_entities(folder: Path) -> tuple[str, ...]:
    lines = ["<!ENTITY a0 'ha'>", *(f"<!ENTITY a{n} '{f'&a{n - 1};' * 10}'>" for n in range(1, 10))]
    text = f"<?xml version='1.0'?><!DOCTYPE x [{''.join(lines)}]><x>&a9;</x>"
    with zipfile.ZipFile(folder / "laughs.x3p", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", text)
    return _surface(folder / "laughs.x3p")


def npz_bomb(folder: Path) -> tuple[str, ...]:
    block = npy_head(f"({4 * GIGABYTE // 8},)")
    archive = zipfile.ZipFile(folder / "bomb.npz", "w", zipfile.ZIP_DEFLATED)
    with archive, archive.open("x.npy", "w", force_zip64=True) as member:
        member.write(block)
        for _ in range(256):
            member.write(bytes(1 << 24))
    return _check(folder / "bomb.npz")


def mat_head() -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8) + struct.pack("<H", 0x0100) + b"IM"


def mat_bomb(folder: Path) -> tuple[str, ...]:
    """Write one variable of 2.5 GB zeros, compressed."""
    count = 312_000_000
    name = struct.pack("<II", 1, 1) + b"x".ljust(8, b"\0")
    inner = struct.pack("<IIII", 6, 8, 6, 0) + struct.pack("<IIII", 5, 8, count, 1) + name
    inner += struct.pack("<II", 9, 8 * count)
    packer = zlib.compressobj(9)
    body = packer.compress(struct.pack("<II", 14, len(inner) + 8 * count) + inner)
    for _ in range(8 * count // (1 << 22)):
        body += packer.compress(bytes(1 << 22))
    body += packer.compress(bytes(8 * count % (1 << 22))) + packer.flush()
    (folder / "bomb.mat").write_bytes(mat_head() + struct.pack("<II", 15, len(body)) + body)
    return _check(folder / "bomb.mat")


def mat4(rows: int, columns: int, tail: int = 80) -> bytes:
    return struct.pack("<IIIII", 0, rows, columns, 0, 2) + b"x\0" + bytes(tail)


def hdf5(name: str, **about: object) -> Attack:
    """Return an attack by a data set that claims more data than any disk holds."""

    def make(folder: Path) -> tuple[str, ...]:
        import h5py

        with h5py.File(folder / name, "w") as file:
            data = file.create_dataset("x", **about)
            data.attrs["sampling_rate_hz"] = 20000.0
            if about.get("compression"):
                data[: min(10, data.shape[0])] = 1.0
        return ("check", str(folder / name))

    return make


def hdf5_cycle(folder: Path) -> tuple[str, ...]:
    import h5py

    with h5py.File(folder / "cycle.h5", "w") as file:
        group = file.create_group("a")
        for number in range(20):
            group[f"again{number}"] = file["/a"]
    return ("check", str(folder / "cycle.h5"))


def hdf5_outside(folder: Path) -> tuple[str, ...]:
    import h5py

    with h5py.File(folder / "outside.h5", "w") as file:
        file.create_dataset(
            "x", (10**9,), dtype="f8", external=[("/dev/zero", 0, h5py.h5f.UNLIMITED)]
        )
        file["link"] = h5py.ExternalLink("/dev/zero", "/x")
    return ("check", str(folder / "outside.h5"))


def hdf5_text(mark: bytes, behind: int, value: int) -> Attack:
    """Return an attack by samples and text with one byte that the library does not expect."""

    def make(folder: Path) -> tuple[str, ...]:
        import h5py

        path = folder / "text.h5"
        with h5py.File(path, "w") as file:
            file["text"] = [b"abc", b"d"]
            file.create_dataset("x", data=np.zeros(5000)).attrs["fs"] = 2e4
        content = bytearray(path.read_bytes())
        content[content.index(mark) + behind] = value
        path.write_bytes(content)
        return ("check", str(path))

    return make


def hdf5_groups(folder: Path) -> tuple[str, ...]:
    import h5py

    with h5py.File(folder / "groups.h5", "w") as file:
        for number in range(20000):
            file.create_group(f"g{number}")
    return ("check", str(folder / "groups.h5"))


def parquet(name: str, columns: int, rows: int) -> Attack:
    """Return an attack by a table of equal numbers, which parquet stores once."""

    def make(folder: Path) -> tuple[str, ...]:
        import pyarrow
        import pyarrow.parquet

        values = pyarrow.array(np.ones(min(rows, 1_000_000), np.float32))
        table = pyarrow.table({f"c{n}": values for n in range(columns)})
        with pyarrow.parquet.ParquetWriter(folder / name, table.schema) as writer:
            for _ in range(max(1, rows // 1_000_000)):
                writer.write_table(table)
        return _check(folder / name)

    return make


def wav_head(size: int, rate: int = 20000, channels: int = 1, *, riff: bytes = b"RIFF") -> bytes:
    block = 2 * channels
    return (
        riff
        + struct.pack("<I", min(36 + size, 2**32 - 1))
        + b"WAVEfmt "
        + struct.pack("<IHHIIHH", 16, 1, channels, rate, rate * block % 2**32, block % 65536, 16)
        + b"data"
        + struct.pack("<I", min(size, 2**32 - 1))
    )


def flac_bomb(folder: Path) -> tuple[str, ...]:
    import soundfile

    with soundfile.SoundFile(folder / "bomb.flac", "w", 48000, 8, "PCM_24", format="FLAC") as file:
        for _ in range(120):
            file.write(np.zeros((480000, 8), np.int32))
    return ("check", str(folder / "bomb.flac"), "--channel", "1")


def tdms_claim() -> bytes:
    def text(value: str) -> bytes:
        return struct.pack("<I", len(value)) + value.encode()

    index = struct.pack("<IIIQ", 20, 10, 1, 10**12)
    meta = struct.pack("<I", 1) + text("/'g'/'x'") + index + struct.pack("<I", 0)
    return (
        b"TDSm"
        + struct.pack("<IIQQ", 0xE, 4713, len(meta) + 8 * 10**12, len(meta))
        + meta
        + bytes(64)
    )


def uff_claim() -> bytes:
    lines = [
        "    -1",
        "    58",
        *(["NONE"] * 5),
        "    1         0    0         0 NONE       1   1 NONE       1   1",
    ]
    lines += ["         21000000000         1  0.00000E+00  5.00000E-05  0.00000E+00"]
    lines += [" 17    0    0    0 Time                 s"] + [
        " 12    0    0    0 NONE                 g"
    ] * 3
    lines += ["  1.00000E+00  1.00000E+00" * 3] * 100
    return ("\n".join([*lines, "    -1", ""])).encode()


def ide_formula(folder: Path) -> tuple[str, ...]:
    """Write a recorder's file whose clock is a formula; evaluated, it has 370 million digits."""
    from ebmlite import loadSchema

    schema = loadSchema("mide_ide.xml")
    head = {
        "EBMLVersion": 1,
        "EBMLReadVersion": 1,
        "EBMLMaxIDLength": 4,
        "EBMLMaxSizeLength": 8,
        "DocType": "mide",
    }
    clock = {"TimeCodeScale": "9**9**9", "TimeCodeModulus": 16777216, "ChannelFormat": "<H"}
    channel = {
        "ChannelID": 8,
        "ChannelName": "x",
        **clock,
        "SubChannel": [{"SubChannelID": 0, "SubChannelName": "x"}],
    }
    about = {"RecorderInfo": {"RecorderTypeUID": 18}, "ChannelList": {"Channel": [channel]}}
    content = schema.encodes({"EBML": head | {"DocTypeVersion": 2, "DocTypeReadVersion": 1}})
    (folder / "x.ide").write_bytes(content + schema.encodes({"RecordingProperties": about}))
    return ("check", str(folder / "x.ide"))


def wrong_byte_xyz() -> bytes:
    n = 400
    lines = [f"{i:.4f} {j:.4f} {(i * j) % 7 * 0.1:.6f}" for i in range(n) for j in range(n)]
    lines[n * n // 2] = "\x01" + lines[n * n // 2]
    return "\n".join(lines).encode()


def sidecar(text: str, suffix: str = "toml") -> Attack:
    """Return an attack by a valid recording with a hostile sidecar file."""

    def make(folder: Path) -> tuple[str, ...]:
        np.save(folder / "x.npy", np.random.default_rng(1).standard_normal(20000))
        (folder / f"x.npy.{suffix}").write_text(text)
        return ("check", str(folder / "x.npy"), "--rate", "20000")

    return make


# Pipes, devices and links
# -------------------------------------------------------------------------------------------------


def fifo(name: str, command: Callable[[Path], tuple[str, ...]]) -> Attack:
    """Return an attack by a pipe that no process writes to."""

    def make(folder: Path) -> tuple[str, ...]:
        os.mkfifo(folder / name)
        return command(folder / name)

    return make


def linked(name: str, target: str, command: Callable[[Path], tuple[str, ...]]) -> Attack:
    """Return an attack by a symbolic link."""

    def make(folder: Path) -> tuple[str, ...]:
        (folder / name).symlink_to(target)
        return command(folder / name)

    return make


def folder_file(name: str, body: bytes | None, of: str) -> Attack:
    """Return an attack by a folder of results with one hostile file; None: a pipe."""

    def make(folder: Path) -> tuple[str, ...]:
        manifest = {"of": of, "format": 2}
        (folder / "manifest.json").write_text(json.dumps(manifest))
        (folder / "history.parquet").write_bytes(b"PAR1")
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.unlink(missing_ok=True)
        if body is None:
            os.mkfifo(path)
        else:
            path.write_bytes(body)
        return ("report", str(folder), "--out", str(folder / "page.html"))

    return make


def _solve(path: Path) -> tuple[str, ...]:
    return ("solve", str(path), "--quiet")


def case_text(text: str) -> Callable[[], bytes]:
    return lambda: (CASE.read_text("utf-8") + text).encode()


ALICONA = (
    b"AliconaImaging\0\r\n"
    + b"Cols".ljust(20, b"\0")
    + b"2000000000".ljust(30, b"\0")
    + b"\r\n" * 99
)
ASC = b"# Channel: T\n# Width: 1e9 um\n# Value units: m\n" + b"1 2\n" * 9
NUMBERS = ("1," * 200_000).rstrip(",")
HOSTILE: dict[str, Attack] = {
    "x3p of 4 MB that unpacks to 4 GB": x3p_bomb,
    "x3p with entities of entities": x3p_entities,
    "npz that unpacks to 4 GB": npz_bomb,
    "mat that unpacks to 2.5 GB": mat_bomb,
    "mat 4 of 1e9 x 1e9": content("x.mat", partial(mat4, 10**9, 10**9), _check),
    "mat 4 of 2e9 rows, sparse file": sparse("x.mat", mat4(2 * 10**9, 1), 16 * GIGABYTE, _check),
    "npy that claims 1e12 numbers": content("x.npy", partial(npy_head, "(1000000000000,)"), _check),
    "npy of 30 axes": content("x.npy", lambda: npy_head("(" + "9," * 30 + ")"), _check),
    "npy map that claims 1e6 x 1e6": content(
        "x.npy", partial(npy_head, "(1000000, 1000000)"), _matrix
    ),
    "npy map of 30 GB, sparse": sparse("x.npy", npy_head("(60000, 65536)"), 30 * GIGABYTE, _matrix),
    "HDF5 that claims 1e11 samples": hdf5("x.h5", shape=(10**11,), dtype="f8", chunks=(10**6,)),
    "HDF5 with a chunk of 1 GB, gzip": hdf5(
        "x.h5", shape=(2**27,), dtype="f8", chunks=(2**27,), compression="gzip", fillvalue=0.0
    ),
    "HDF5 with 1e6 channels": hdf5("x.h5", shape=(100, 10**6), dtype="f4", chunks=(100, 1000)),
    "HDF5 whose groups hold themselves": hdf5_cycle,
    "HDF5 whose samples are /dev/zero": hdf5_outside,
    "HDF5 with 20000 groups": hdf5_groups,
    "HDF5 whose heap leads to itself": hdf5_text(b"GCOL", 24, 0),
    "HDF5 whose text is of no kind": hdf5_text(b"\x19\x01", 1, 0x66),
    "HDF5 map that claims 1e6 x 1e6": lambda folder: (
        hdf5("m.h5", shape=(10**6, 10**6), dtype="f8", chunks=(100, 100))(folder),
        _surface(folder / "m.h5"),
    )[1],
    "parquet of 300 million equal numbers": parquet("x.parquet", 1, 300_000_000),
    "parquet of 5000 columns": parquet("x.parquet", 5000, 100),
    "parquet cut to its head": content(
        "x.parquet", lambda: b"PAR1" + bytes(100) + b"\xff\xff\xff\x7fPAR1", _check
    ),
    "csv of 200 000 columns": content(
        "x.csv", lambda: f"{NUMBERS}\n{NUMBERS}\n{NUMBERS}\n".encode(), _check
    ),
    "csv map of 200 000 columns": content(
        "x.csv", lambda: f"{NUMBERS}\n{NUMBERS}\n{NUMBERS}\n".encode(), _matrix
    ),
    "csv of one line of 50 MB": content("x.csv", lambda: b"1," * 25_000_000, _check),
    "csv map of one line of 50 MB": content("x.csv", lambda: b"1," * 25_000_000, _matrix),
    "csv of one number of 10 MB": content(
        "x.csv", lambda: b"1\n2\n3\n" + b"9" * 10_000_000, _check
    ),
    "csv with a quote that never ends": content(
        "x.csv", lambda: b'a,b\n"1,2\n' + b"3,4\n" * 200_000, _check
    ),
    "csv whose lines change their columns": content(
        "x.csv", lambda: b"1,2\n1,2,3\nx\n" * 100_000, _check
    ),
    "text of blanks": content("x.txt", lambda: b" " * 20_000_000, _check),
    "text of commas": content("x.csv", lambda: b"," * 5_000_000 + b"\n" + b"1,2\n" * 100, _check),
    "UTF-16 that is none": content("x.csv", lambda: b"\xff\xfe" + b"\x00\xd8" * 2_000_000, _check),
    "xyz with one wrong byte": content("x.xyz", wrong_byte_xyz, partial(_surface)),
    "wav that claims 4 GB": content("x.wav", lambda: wav_head(2**32 - 1) + bytes(100), _stated),
    "wav of 65535 channels": content(
        "x.wav", lambda: wav_head(2**31, channels=65535) + bytes(9999), _series
    ),
    "wav of 4 GHz": content("x.wav", lambda: wav_head(4000, rate=2**32 - 1) + bytes(4000), _stated),
    "wav of 20 GB, sparse": sparse(
        "x.wav", wav_head(2**32 - 1, riff=b"RF64"), 20 * GIGABYTE, _stated
    ),
    "flac of silence": flac_bomb,
    "tdms that claims 1e12 samples": content("x.tdms", tdms_claim, _check),
    "uff that claims 1e9 points": content("x.uff", uff_claim, _stated),
    "IDE of nonsense": content(
        "x.ide", lambda: b"\x1a\x45\xdf\xa3" + b"\x08" * 3 + b"\xff" * 9999, _check
    ),
    "IDE whose text is evaluated": ide_formula,
    "opd that claims 30000 x 30000": content(
        "x.opd", lambda: b"\x01\x00Directory\x00".ljust(6000, b"\x7f"), _surface
    ),
    "sdf that claims 1e9 x 1e9": content(
        "x.sdf",
        lambda: b"aBCR-1.0" + bytes(34) + struct.pack("<HH", 65535, 65535) + bytes(60),
        _surface,
    ),
    "al3d that claims 2e9 columns": content(
        "x.al3d",
        lambda: ALICONA,
        _surface,
    ),
    "asc of 1e9 x 1e9": content("x.asc", lambda: ASC, _surface),
    "nc map of nonsense": content("x.nc", lambda: b"CDF\x02" + b"\xff" * 4000, _surface),
    "pipe as recording": fifo("x.csv", _check),
    "pipe in a series": fifo("x.csv", lambda path: _track(path.parent)),
    "pipe as surface": fifo("x.x3p", _surface),
    "pipe as case": fifo("case.toml", _solve),
    "pipe as table": fifo("t.csv", lambda path: (*_track(path), "--table", str(path))),
    "pipe as run": fifo("run.nc", lambda path: ("report", str(path), "--out", "page.html")),
    "/dev/zero as recording": linked("x.csv", "/dev/zero", _check),
    "/dev/zero as surface": linked("x.x3p", "/dev/zero", _surface),
    "/dev/zero as case": linked("case.toml", "/dev/zero", _solve),
    "a link to itself": linked("x.csv", "x.csv", _check),
    "run of 40 GB, sparse": sparse(
        "run.nc", b"\x89HDF\r\n\x1a\n", 40 * GIGABYTE, lambda path: ("report", str(path))
    ),
    "case of 4 GB, sparse": sparse("case.toml", b"[contact]\n", 4 * GIGABYTE, _solve),
    "case with 3000 brackets": content(
        "case.toml", case_text("\nx = " + "[" * 3000 + "]" * 3000), _solve
    ),
    "case with an integer of 5000 digits": content(
        "case.toml", case_text("\n[more]\nx = " + "9" * 5000), _solve
    ),
    "sidecar with 100 000 brackets": sidecar("[" * 100_000, "json"),
    "sidecar with 3000 brackets": sidecar("x = " + "[" * 3000 + "]" * 3000),
    "sidecar with an integer of 5000 digits": sidecar("rate_hz = " + "9" * 5000),
    "pipe as manifest": folder_file("manifest.json", None, "history"),
    "manifest with 100 000 brackets": folder_file("manifest.json", b"[" * 100_000, "history"),
    "table of a history that is a pipe": folder_file("history.parquet", None, "history"),
}
