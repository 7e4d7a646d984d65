"""`asperity infer` from files to verdict: a small emulator is solved, stored and extended;
refusals.
"""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.inference import (
    ForwardModel,
    Observation,
    ObservationPoint,
    RecordingInput,
    build_emulator,
    design_contact,
    extend_emulator,
    forecast_observations,
    infer_observations,
    inference_setting,
    observe_recordings,
    refine_emulator,
)
from asperity.inference.outputs import OUTPUTS
from asperity.inference.posterior import emulated_share, posterior_shares
from asperity.monitoring import read_table
from asperity.report import write_inference_report
from asperity.study import overrides_at, plan_points, run_study
from support.emulated import SMALL, formula_emulator, formula_setting
from support.recordings import SHARED

EXAMPLE = Path(__file__).parents[2] / "examples" / "infer.toml"
REAL = ("mfpt", "ims", "mfpt-formats", "endaq", "uff")


def test_an_emulator_predicts_contacts_and_states_its_error(small):
    _, emulator, _ = small
    quality = emulator.quality["clr"]
    assert quality.error < 3.0 * quality.scatter
    assert set(emulator.grid) == set(emulator.quality)
    rough, smooth = (
        emulator.values(np.array([[share, 0.5, 0.5]]), "clr")[0] for share in (0.9, 0.1)
    )
    assert rough > smooth + 0.2  # more load on asperities for rougher surfaces
    slow, fast = (
        emulator.values(np.array([[0.5, 0.5, share]]), "clr")[0] for share in (0.05, 0.95)
    )
    assert slow > fast + 0.05  # and less where the film is thicker
    assert "this is corrected" in emulator.sentence()


def test_an_emulator_reloads_unchanged_and_only_for_its_own_case(small):
    setting, emulator, folder = small
    again = build_emulator(setting, folder=folder)
    at = np.random.default_rng(0).random((5, 3))
    for key in ("clr", "contact_stiffness_n_m"):
        assert np.array_equal(again(at, [key])[key], emulator(at, [key])[key])
    assert again.quality == emulator.quality
    other = inference_setting(load_case(EXAMPLE).with_overrides({**SMALL, "contact.slip": 0.1}))
    with pytest.raises(BadInput, match="holds the emulator of another case"):
        build_emulator(other, folder=folder)


def test_an_interrupted_emulator_resumes(small, tmp_path):
    setting, emulator, folder = small
    shutil.copytree(folder, tmp_path / "half")
    (tmp_path / "half" / "emulator.json").unlink()
    sorted((tmp_path / "half" / "parts").iterdir())[0].unlink()
    with ThreadPoolExecutor(1) as executor:
        again = build_emulator(setting, folder=tmp_path / "half", executor=executor)
    at = np.full((1, 3), 0.4)
    assert again.values(at, "clr") == pytest.approx(emulator.values(at, "clr"), abs=1e-6)


def test_an_emulator_is_extended_where_the_posterior_is(small, tmp_path):
    """In two rounds. Its deviation falls there, new contacts agree, and it is stored."""
    setting, first, folder = small
    shutil.copytree(folder, tmp_path / "own")
    emulator = replace(first, folder=tmp_path / "own")
    points = [ObservationPoint(load, speed) for load in (420.0, 580.0) for speed in (1.2, 2.8)]
    z = np.zeros((1, len(setting.unknowns)))
    shown = ForwardModel(setting, emulator, tuple(points)).predict(z, "hertz-point")
    observations = [
        Observation(
            load_n=point.load_n, entrainment_m_s=point.entrainment_m_s, crf_hz=hertz, crf_std_hz=3.0
        )
        for point, hertz in zip(points, np.exp(shown.crf[0]), strict=True)
    ]
    found = infer_observations(setting, emulator, observations)
    with ThreadPoolExecutor(1) as executor:
        wider = refine_emulator(found, 24, executor=executor)
        samples = posterior_shares(found.forward, found.draws, 8, seed=99)
        plan = plan_points(
            setting.case,
            [overrides_at(setting.case, setting.ranges, sample) for sample in samples],
            seeds=2,
            kind="still",
        )
        solved = run_study(plan, executor=executor).table
    groups, scale = solved.groupby("point")["clr"], OUTPUTS["clr"]
    truth = groups.mean().to_numpy()
    by_chance = np.sqrt(np.mean(groups.var() / 2)) * scale.slope(
        truth
    )  # as large as the errors of the emulators
    (_, before), (mean, after) = (
        process(samples, ["clr"])["clr"] for process in (emulator, wider.emulator)
    )
    assert after.mean() < 0.75 * before.mean()
    assert np.sqrt(np.mean(((scale.forward(truth) - mean) / np.hypot(after, by_chance)) ** 2)) < 2.0
    assert (wider.emulator.points, wider.emulator.further) == (40, 24)
    assert (
        f"makes up {100 * emulated_share(wider.forward, wider.draws):.0f} % of the posterior"
        in wider.notes[-1]
    )
    assert "before 24 points were added" in wider.notes[-1]
    assert len(list((tmp_path / "own" / "further").glob("*/shares.json"))) == 2
    again = build_emulator(setting, folder=tmp_path / "own")
    assert np.array_equal(again(samples, ["clr"])["clr"], wider.emulator(samples, ["clr"])["clr"])
    assert again.quality == wider.emulator.quality
    kept = refine_emulator(
        replace(found, forward=replace(found.forward, emulator=formula_emulator(setting))), 8
    )
    assert "it was not extended" in kept.notes[-1]
    with pytest.raises(BadInput, match="holds no emulator"):
        extend_emulator(setting, replace(emulator, folder=tmp_path), samples)
    with pytest.raises(BadInput, match="has at most 4096 points"):
        extend_emulator(setting, replace(emulator, points=4090), samples)


@pytest.mark.usefixtures("blank_figures")
def test_noise_gives_no_estimate(asp, small):
    rng = np.random.default_rng(1)
    for number in range(2):
        wavfile.write(f"noise-{number}.wav", 20_000, rng.standard_normal(40_000).astype(np.float32))
    Path("recordings.toml").write_text(
        'unit = "m/s^2"\nscale = 1\nload_n = 500\nentrainment_m_s = 2\n', "utf-8"
    )
    folder = small[2]
    Path("infer.toml").write_text(load_case(EXAMPLE).with_overrides(SMALL).text, "utf-8")
    command = (
        "infer",
        "noise-0.wav",
        "noise-1.wav",
        "--case",
        "infer.toml",
        "--emulator",
        str(folder),
    )
    code, out, err = asp(*command, "--json", "--report", "page.html", "--figures", "figures")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert len(list(Path(result["figures"]).glob("*-85mm.pdf"))) >= 3
    assert result["verdict"].startswith("Not identified: no recording shows a contact resonance")
    assert result["identifiable"] is False
    assert len(result["silent"]) == 2
    assert "<script" not in Path("page.html").read_text("utf-8")
    assert asp(*command, "--quiet")[1] == result["verdict"] + "\n"
    assert (result["forecast"], result["design"]) == (None, None)
    code, out, err = asp(*command, "--forecast", "clr=0.5")
    assert (code, out) == (2, "")
    assert "a forecast needs resonances of at least 4 recordings at different times, got 0" in err
    code, out, _ = asp(
        "infer", "--case", "infer.toml", "--emulator", str(folder), "--design", "0.6", "--json"
    )
    design = json.loads(out)["design"]
    assert code == 0
    assert design["sentence"].startswith("CLR stays below 60.0 % with a probability of")
    assert [lever["key"] for lever in design["levers"]] == [
        "sq_m",
        "load_n",
        "entrainment_speed_m_s",
    ]
    smooth, rough = (design["levers"][0]["chances"][end] for end in (0, -1))
    assert smooth > rough + 0.3


def test_refusals_are_one_sentence(asp):
    shutil.copy(EXAMPLE, "infer.toml")
    wavfile.write(
        "a.wav", 20_000, np.random.default_rng(1).standard_normal(20_000).astype(np.float32)
    )
    Path("kilo.csv").write_text("file,load_kn\na.wav,0.5\n", "utf-8")
    Path("nan.csv").write_text("file,load_n\na.wav,nan\n", "utf-8")
    Path("empty").mkdir()
    for arguments, message in (
        (("a.wav",), "state --case"),
        (("--case", "infer.toml"), "asperity infer needs recordings"),
        (("a.wav", "--case", "infer.toml", "--worn", "d"), "add --forecast"),
        (
            ("a.wav", "--case", "infer.toml", "--forecast", "crf=3 kHz"),
            "--forecast takes a limit such as clr=0.5",
        ),
        (
            ("a.wav", "--case", "infer.toml", "--forecast", "clr=nan"),
            "a limit of CLR must lie between 0 and 1",
        ),
        (
            ("a.wav", "--case", "infer.toml", "--forecast", "clr=0.5", "--worn", "d"),
            "d holds no wear",
        ),
        (
            ("a.wav", "--case", "infer.toml", "--forecast", "sq=1 m"),
            "a limit of Sq must lie within the range in [infer]",
        ),
        (
            ("--case", "infer.toml", "--design", "nan"),
            "--design must be a load share between 0 and 1",
        ),
        (("empty", "--case", "infer.toml"), "contains no recordings"),
        (
            ("a.wav", "--case", "infer.toml", "--table", "kilo.csv"),
            "has a column load_kn; use load_n",
        ),
        (("a.wav", "--case", "infer.toml", "--table", "nan.csv"), "load_n must be a number"),
        (
            ("a.wav", "--case", "infer.toml", "--sampler", "mcmc"),
            "--sampler must be one of importance, nested",
        ),
    ):
        code, out, err = asp("infer", *arguments)
        assert (code, out) == (2, "")
        assert message in err
        assert err.count("\n") == 1


def test_a_table_of_operating_points_needs_no_x(tmp_path):
    path = tmp_path / "conditions.csv"
    path.write_text(
        "file,load_n,entrainment_m_s,temperature_degc\na.wav,500,1.5,60\nb.wav,,2,61\n", "utf-8"
    )
    places = read_table(path).places
    assert (
        places["a.wav"].load_n,
        places["a.wav"].entrainment_m_s,
        places["a.wav"].temperature_degc,
    ) == (500, 1.5, 60)
    assert (places["b.wav"].load_n, places["b.wav"].x) == (None, 2.0)


@pytest.mark.parametrize("folder", REAL)
def test_real_recordings_without_a_contact_resonance_give_no_estimate(folder):
    """Faulty bearings, a stopped machine, a shaker and a microphone show no contact resonance."""
    if not (SHARED / "vibration" / folder).exists():
        pytest.skip("the shared data are not available")
    setting = formula_setting()
    options = {"ims": {"rate_hz": 20_000.0, "unit": "g", "channel": "1"}, "endaq": {"channel": "1"}}
    observed = observe_recordings(
        [SHARED / "vibration" / folder], setting, source=RecordingInput(**options.get(folder, {}))
    )
    found = infer_observations(
        setting, formula_emulator(setting), observed.observations, excluded=observed.excluded
    )
    assert found.verdict().startswith("Not identified")
    assert not found.identifiable


def test_a_page_shows_observations_forecast_and_design(tmp_path):
    setting = formula_setting()
    observations = [
        Observation(
            load_n=load,
            entrainment_m_s=1.0,
            crf_hz=3300.0 * (load / 500.0) ** 0.2,
            crf_std_hz=5.0,
            name=f"{load:g}.wav",
        )
        for load in (300.0, 500.0, 900.0)
    ]
    found = infer_observations(
        setting, formula_emulator(setting), observations, notes=("A note of its own.",)
    )
    series = [
        replace(observations[1], x=10.0 * number, crf_hz=3300.0 + 12.0 * number)
        for number in range(8)
    ]
    path = write_inference_report(
        found,
        tmp_path / "page.html",
        forecast=forecast_observations(
            setting, found.emulator, series, limit=("clr", 0.5), laws=("hertz-point",)
        ),
        design=design_contact(found.forward, found.draws.z, clr=0.3),
    )
    text = path.read_text("utf-8")
    for words in (
        "Forecast",
        "Design changes for a low CLR",
        "stays below 30.0",
        "Verdict",
        "A note of its own.",
        "Observed and predicted",
        "recommended next",
        "hertz-point",
    ):
        assert words in text
    assert text.count("<img") == 6


CAPACITANCES = """load_n,entrainment_m_s,capacitance_f,capacitance_std_f
450,1.5,2.4e-10,5e-12
550,2.5,2.1e-10,5e-12
"""


@pytest.mark.usefixtures("blank_figures")
def test_capacitances_replace_or_join_recordings(asp, small):
    _, _, folder = small
    Path("infer.toml").write_text(load_case(EXAMPLE).with_overrides(SMALL).text, "utf-8")
    Path("capacitance.csv").write_text(CAPACITANCES, "utf-8")
    arguments = ("infer", "--case", "infer.toml", "--emulator", str(folder), "--json")
    code, out, err = asp(*arguments, "--capacitance", "capacitance.csv", "--report", "page.html")
    assert not err
    result = json.loads(out)
    assert code == 0
    assert result["observations"] == 2
    assert [point["load_n"] for point in result["points"]] == [450.0, 550.0]
    assert result["posterior"]["h_mean_m"]["information_bits"] > 0.0
    assert Path("page.html").exists()
    Path("capacitance.csv").write_text(CAPACITANCES.replace("2.4e-10", "much"), "utf-8")
    code, _, err = asp(*arguments, "--capacitance", "capacitance.csv")
    assert code == 2
    assert "capacitance.csv, line 2: capacitance_f must be a number, got 'much'" in err
    Path("capacitance.csv").write_text("load_n\n1\n", "utf-8")
    code, _, err = asp(*arguments, "--capacitance", "capacitance.csv")
    assert (code, "needs rows with the columns load_n, entrainment_m_s" in err) == (2, True)
