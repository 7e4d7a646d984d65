"""Features of the emulator: an estimated film ratio in place of the speed."""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.inference.settings import LOAD, SPEED, TEMPERATURE, Setting
from asperity.study import ParameterRange, overrides_at

# exponents of the film ratio Λ, after Dowson and Higginson
FILM_EXPONENTS = {"viscosity": 0.7, "alpha": 0.54, "load": -0.13, "sq": -1.0}


@dataclass(frozen=True)
class EmulatorFeatures:
    """Inputs of the processes: shares of the ranges, with an estimated film ratio instead of speed.

    Film and contact depend on the product of viscosity and speed with approximately known
    exponents; the process models the remainder from the other shares.
    """

    ranges: tuple[ParameterRange, ...]
    oil: tuple[Field, Field, Field] | None = (
        None  # shares of a temperature's range; ln viscosity; ln alpha there
    )

    def __call__(self, shares: Field) -> Field:
        """Convert shares to inputs of the processes, shape (n, d)."""
        index = {entry.key: number for number, entry in enumerate(self.ranges)}

        def log(key: str) -> Field:
            if key not in index:
                return np.zeros(len(shares))
            entry = self.ranges[index[key]]
            share = shares[:, index[key]]
            ratio = np.log(entry.high / entry.low)
            return np.asarray(share * ratio if entry.log else np.log1p(share * np.expm1(ratio)))

        viscous = log("lubricant.viscosity.eta0") + log(SPEED)
        alpha = log("lubricant.viscosity.alpha")
        if self.oil is not None:
            knots, viscosity, piezo = self.oil
            viscous = viscous + np.interp(shares[:, index[TEMPERATURE]], knots, viscosity)
            alpha = alpha + np.interp(shares[:, index[TEMPERATURE]], knots, piezo)
        powers = FILM_EXPONENTS
        ratio = powers["viscosity"] * viscous + powers["alpha"] * alpha + powers["load"] * log(LOAD)
        ratio += powers["sq"] * log("surface.sq")
        x = shares.copy()
        x[:, index[SPEED]] = ratio / 4.0
        return x


def emulator_features(setting: Setting) -> EmulatorFeatures:
    """Return the features of a setting; with viscosity over temperature for a data-sheet oil."""
    ranges = setting.ranges
    entry = next((entry for entry in ranges if entry.key == TEMPERATURE), None)
    if entry is None:
        return EmulatorFeatures(ranges)
    shares, logs = np.linspace(0.0, 1.0, 9), []
    for share in shares:
        oil = setting.case.with_written(overrides_at(setting.case, [entry], [share])).lubricant
        assert oil is not None
        zero = np.zeros(1)
        viscosity = float(oil.viscosity(zero)[0])
        logs.append((np.log(viscosity), np.log(float(oil.viscosity.log_slope(zero)[0]))))
    viscosity, alpha = np.array(logs).T
    return EmulatorFeatures(ranges, (shares, viscosity - viscosity.mean(), alpha - alpha.mean()))
