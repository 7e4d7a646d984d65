"""Small recordings in every format that asperity reads, written by the formats' own libraries, and
damaged files.
"""

import json
import warnings
from pathlib import Path

import numpy as np

RATE = 5000.0
SHARED = Path(__file__).parents[2].parent / "shared" / "data"


def vibration(samples=4000, seed=3):
    """Return a signal like an acceleration [g]: noise with a resonance at 900 Hz."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(samples)
    time = np.arange(samples) / RATE
    return np.round(
        0.3 * noise
        + np.convolve(noise, np.exp(-time[:200] * 80) * np.sin(5654.9 * time[:200]))[:samples],
        6,
    )


def write_all(folder, values):
    """Write `values` [g] in every format; return {name: settings needed to read the file}."""
    import h5py
    import nptdms
    import pyarrow
    import pyarrow.parquet
    import soundfile
    from scipy.io import savemat

    time = np.arange(values.size) / RATE
    settings = {}

    def write(name, text, **given):
        (folder / name).write_text(text, "utf-8")
        settings[name] = given

    def lines(separator, comma, times=time, quote=""):
        rows = (
            f"{quote}{t:.6f}{quote}{separator}{quote}{v:.6f}{quote}"
            for t, v in zip(times, values, strict=True)
        )
        return "\n".join(row.replace(".", ",") if comma else row for row in rows) + "\n"

    write("comma.csv", "time_s,acc_g\n" + lines(",", comma=False))
    write(
        "german.csv",
        "Messung 1\nKanal: Lager 2\n\nZeit [s];Beschleunigung [g]\n" + lines(";", comma=True),
    )
    write(
        "quoted.csv",
        '"time (ms)","acc (g)"\n' + lines(",", comma=False, times=1e3 * time, quote='"'),
    )
    write("units.txt", "time\tacc\ns\tg\n" + lines("\t", comma=False))
    write(
        "declared.txt",
        "# sampling rate: 5 kHz\n# unit = g\n" + "".join(f"{v:.6f}\n" for v in values),
    )
    write("2024.01.31.12.00.00", "".join(f"{v:.6f}\n" for v in values), rate_hz=RATE, unit="g")
    (folder / "wide.txt").write_bytes(("time_s,acc_g\n" + lines(",", comma=False)).encode("utf-16"))
    settings["wide.txt"] = {}
    np.save(folder / "bare.npy", values)
    settings["bare.npy"] = {"rate_hz": RATE, "unit": "g"}
    np.savez_compressed(folder / "facts.npz", acc=values, fs=RATE, unit="g")
    settings["facts.npz"] = {}
    savemat(folder / "plain.mat", {"acc": values, "fs": RATE, "unit": "g"}, do_compression=True)
    savemat(folder / "struct.mat", {"bearing": {"sr": RATE, "rate": 25.0, "gs": values}})
    settings |= {"plain.mat": {}, "struct.mat": {"unit": "g"}}
    with h5py.File(
        folder / "v73.mat", "w", userblock_size=512
    ) as file:  # the layout of MATLAB -v7.3
        file["s/acc"] = values[None, :]
        file["s/fs"] = np.array([[RATE]])
        file["s/unit"] = np.array([[ord("g")]], np.uint16)
        file["s/unit"].attrs["MATLAB_class"] = np.bytes_("char")
    with (folder / "v73.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    settings["v73.mat"] = {}
    with h5py.File(folder / "attrs.h5", "w") as file:
        file["rig/acc"] = values.astype(np.float32)
        file["rig/acc"].attrs["units"] = "g"
        file["rig"].attrs["sampling_rate"] = RATE
    settings["attrs.h5"] = {}
    soundfile.write(folder / "float.wav", values.astype(np.float32), int(RATE), subtype="FLOAT")
    soundfile.write(folder / "short.wav", values / 16.0, int(RATE), subtype="PCM_16")
    soundfile.write(folder / "long.wav", values / 16.0, int(RATE), subtype="PCM_32")
    settings |= {
        "float.wav": {"unit": "g"},
        "short.wav": {"unit": "g", "scale": 16.0},
        "long.wav": {"unit": "g", "scale": 16.0},
    }
    with nptdms.TdmsWriter(folder / "group.tdms") as file:
        facts = {"wf_increment": 1.0 / RATE, "unit_string": "g"}
        file.write_segment([nptdms.ChannelObject("rig", "acc", values, properties=facts)])
    settings["group.tdms"] = {}
    for name, binary in (("binary.uff", 1), ("ascii.uff", 0)):
        write_uff(folder / name, uff_set(values * 9.80665, binary=binary))
        settings[name] = {}
    facts = {"fs_hz": str(RATE), "unit": "g"}
    table = pyarrow.table({"acc": values}).replace_schema_metadata(facts)
    pyarrow.parquet.write_table(table, folder / "meta.parquet")
    settings["meta.parquet"] = {}
    (folder / "beside.dat").write_text("".join(f"{v:.6f}\n" for v in values))
    (folder / "beside.dat.json").write_text(
        json.dumps({"rate_hz": RATE, "unit": "g", "started": "2024-01-31 12:00:00"})
    )
    settings["beside.dat"] = {}
    return settings


def write_uff(path, data_set):
    """Write a data set; suppress the warning about the file that pyuff leaves open."""
    import pyuff

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        pyuff.UFF(str(path)).write_sets(data_set, "add")


def uff_set(values, *, binary=1, func_type=1):
    """Return a data set 58 for pyuff, in m/s2."""
    return {
        "type": 58,
        "binary": binary,
        "func_type": func_type,
        "rsp_node": 1,
        "rsp_dir": 3,
        "ref_node": 1,
        "ref_dir": 3,
        "rsp_ent_name": "ring",
        "data": values,
        "x": np.arange(values.size) / RATE,
        "abscissa_spacing": 1,
        "abscissa_min": 0.0,
        "abscissa_inc": 1.0 / RATE,
        "ord_data_type": 4,
        "num_pts": values.size,
        "ordinate_spec_data_type": 12,
        "ordinate_axis_lab": "Acceleration",
        "ordinate_axis_units_lab": "m/s2",
        "abscissa_spec_data_type": 17,
        "abscissa_axis_lab": "Time",
        "abscissa_axis_units_lab": "s",
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
    }


def damaged(content, rng):
    """Return a file's bytes cut, flipped, zeroed, extended, or with huge counts, NaN or text in
    numbers.
    """
    data = bytearray(content)
    size = len(data)
    where, length = int(rng.integers(size)), int(rng.integers(1, 2000))
    match rng.integers(10):
        case 0:
            del data[where:]
        case 1:
            for i in rng.integers(size, size=rng.integers(1, 40)):
                data[i] = rng.integers(256)
        case 2:
            for i in rng.integers(min(size, 400), size=rng.integers(1, 20)):
                data[i] = rng.integers(256)
        case 3:
            data[where : where + length] = bytes(len(data[where : where + length]))
        case 4:
            data[where:where] = rng.bytes(length)
        case 5:
            del data[where : where + length]
        case 6:  # a huge count
            at = int(rng.integers(max(min(size, 2000) - 8, 1)))
            data[at : at + 8] = b"\xff" * int(rng.integers(2, 8)) + b"\x7f"
        case 7:
            data[where : where + 8] = [
                b"\x00\x00\xc0\x7f" * 2,
                b"\x00\x00\x80\x7f" * 2,
                b"1e999,na",
            ][rng.integers(3)]
        case 8:
            data[where : where + 5] = b"oops\n"
        case 9:
            del data[int(rng.integers(0, 60)) :]
    return bytes(data)
