"""An emulator of a formula instead of a contact: its predictions are known, and nothing
is solved.
"""

from pathlib import Path

import numpy as np
from scipy.stats import qmc

from asperity.case import load_case
from asperity.inference import Emulator, EmulatorQuality, Setting, inference_setting
from asperity.inference.feature_map import emulator_features
from asperity.inference.gaussian_process import GaussianProcess
from asperity.inference.outputs import OUTPUTS

CASE = Path(__file__).parents[2] / "examples" / "infer.toml"
POINTS = 64  # a power of two
SMALL = {  # a few small contacts
    "contact.roughness": "standing",
    "surface.correlation_length": "40 um",
    "infer": {
        "points": 16,
        "surfaces": 2,
        "cells": [32, 24],
        "sq": {"from": "0.5 um", "to": "2 um"},
        "correlation_length": "known",
        "hardness": "known",
        "eta0": "known",
        "alpha": "known",
        "load": {"from": "400 N", "to": "600 N"},
        "entrainment_speed": {"from": "1 m/s", "to": "3 m/s"},
    },
}


def formula_setting(**overrides: object) -> Setting:
    """Return the example's setting."""
    case = load_case(CASE)
    return inference_setting(case.with_overrides(overrides) if overrides else case)


def formula(x: np.ndarray, sq: np.ndarray) -> dict[str, np.ndarray]:
    """Return shares, film, friction, stiffness, damping and capacitance of a contact with
    film ratio 1.6 exp(4 x).
    """
    film = 1.6 * np.exp(4.0 * x)
    share = 1.0 / (1.0 + film**2.5)
    return {
        "clr": share,
        "car": 0.2 * share,
        "h_mean_m": film * sq,
        "friction_coefficient": 0.02 + 0.13 * share,
        "contact_stiffness_n_m": 3.3e8 * (1.0 + 0.02 * share),
        "contact_damping_ratio": 0.03 * (1.0 - share),
        "capacitance_f": 2e-16 / (film * sq),
    }


def formula_emulator(setting: Setting) -> Emulator:
    """Return Gaussian processes through the formula on a Sobol sequence, without noise."""
    shares = qmc.Sobol(len(setting.ranges), rng=np.random.default_rng(1)).random(POINTS)
    features = emulator_features(setting)
    x = features(shares)
    speed = len(setting.contact) + 1
    values = formula(x[:, speed], 1e-6 * setting.contact[0].in_unit(_z(shares[:, 0])))
    lengths = np.full(x.shape[1], 30.0)
    lengths[[0, speed]] = 3.0, 0.6
    processes = {
        key: GaussianProcess(
            x, output.forward(values[key]), np.full(POINTS, 1e-4), lengths, 30.0, 4e-4
        )
        for key, output in OUTPUTS.items()
    }
    quality = {key: EmulatorQuality(0.01, 0.9, 0.05, 0.02) for key in OUTPUTS}
    return Emulator(
        setting.ranges, features, processes, quality, POINTS, 4, 0, Path("formula"), 0.0
    )


def _z(share: np.ndarray) -> np.ndarray:
    from scipy.special import ndtri

    return ndtri(np.clip(share, 1e-9, 1.0 - 1e-9))
