"""A Gaussian process over the unit cube: fitted by scikit-learn, asked by a few lines of algebra.

scikit-learn finds the lengths and levels; what is asked a million times a second needs neither its
checks nor itself, and no more than single precision: 1e-5 of a deviation.
"""

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput

LENGTHS = (0.1, 30.0)  # of the kernel, in widths of the cube
LEVELS = (1e-2, 1e2)  # variance of the process over that of the data
ROUGHNESS = (1e-5, 1.0)  # white noise beside the stated one: what the process does not follow
TREND_NOISE = 0.02  # least variance of a point in the fit of the trend
AT_ONCE = 512  # points asked at a time: their kernel stays in the processor's cache


@dataclass(frozen=True)
class GaussianProcess:
    """A linear trend, and a Gaussian process (Matern 5/2, a length each axis) of what is left, on its own scale.

    Parameters
    ----------
    x : points, shape (n, d)
    y, noise : values there and their variance, which is known, shape (n,)
    lengths, level, rough : of the kernel, over `scale` squared; `rough` is white, and part of the stated deviation
    """

    x: Field
    y: Field
    noise: Field
    lengths: Field
    level: float
    rough: float

    @cached_property
    def _trend(self) -> Field:
        weight = 1.0 / np.sqrt(self.noise + TREND_NOISE)
        return np.asarray(
            np.linalg.lstsq(_basis(self.x) * weight[:, None], self.y * weight, rcond=None)[0]
        )

    @cached_property
    def _scale(self) -> float:
        return float(np.std(self.y - _basis(self.x) @ self._trend)) or 1.0

    @cached_property
    def _solved(self) -> tuple[Field, Field]:
        """The transposed inverse of the covariance's lower factor, and the inverse of the whole times the data."""
        rest = (self.y - _basis(self.x) @ self._trend) / self._scale
        covariance = self._kernel(self.x, float) + np.diag(self.noise / self._scale**2 + self.rough)
        lower = scipy.linalg.cholesky(covariance, lower=True)
        whitener = scipy.linalg.solve_triangular(lower, np.eye(rest.size), lower=True).T
        return whitener, whitener @ (whitener.T @ rest)

    @cached_property
    def _single(self) -> tuple[Field, Field]:
        """Both in single precision."""
        whitener, weights = self._solved
        return whitener.astype(np.float32), weights.astype(np.float32)

    def _kernel(self, x: Field, precision: type = np.float32) -> Field:
        near, far = x / self.lengths, self.x / self.lengths
        square = near @ (-2.0 * far.T)
        square += np.sum(near**2, axis=1)[:, None]
        square += np.sum(far**2, axis=1)
        distance: Field = np.maximum(5.0 * square, 0.0).astype(precision)
        np.sqrt(distance, out=distance)
        kernel = distance / 3.0
        kernel += 1.0
        kernel *= distance
        kernel += 1.0
        np.negative(distance, out=distance)
        kernel *= np.exp(distance, out=distance)
        kernel *= self.level
        return np.asarray(kernel)

    def __call__(self, x: Field) -> tuple[Field, Field]:
        """Mean and standard deviation at points, shape (n, d): of the mean over surfaces, not of one surface."""
        whitener, weights = self._single
        means, stds = [], []
        for part in np.array_split(x, max(1, -(-len(x) // AT_ONCE))):
            kernel = self._kernel(part)
            white = kernel @ whitener
            known = np.einsum("ij,ij->i", white, white).astype(float)
            means.append(_basis(part) @ self._trend + self._scale * (kernel @ weights))
            stds.append(self._scale * np.sqrt(np.maximum(self.level - known, 0.0) + self.rough))
        return np.concatenate(means), np.concatenate(stds)

    def mean(self, x: Field) -> Field:
        """The mean alone, in a third of the time."""
        weights = self._single[1]
        parts = np.array_split(x, max(1, -(-len(x) // AT_ONCE)))
        return np.concatenate(
            [_basis(p) @ self._trend + self._scale * (self._kernel(p) @ weights) for p in parts]
        )

    def correlations(self, x: Field) -> Field:
        """Of its errors at points that belong together, (n, m, d): (n, m, m)."""
        count, together, _ = x.shape
        whitener = self._single[0]
        found = np.empty((count, together, together))
        for rows in np.array_split(np.arange(count), max(1, -(-count * together // AT_ONCE))):
            part = x[rows]
            white = (self._kernel(part.reshape(-1, part.shape[2])) @ whitener).reshape(
                len(rows), together, -1
            )
            square = np.sum(((part[:, :, None] - part[:, None]) / self.lengths) ** 2, axis=-1)
            distance = np.sqrt(5.0 * square)
            alike = (1.0 + distance + distance**2 / 3.0) * np.exp(-distance)
            left = self.level * alike - white @ white.transpose(0, 2, 1)
            found[rows] = left + self.rough * alike
        deviations = np.sqrt(np.maximum(np.einsum("nii->ni", found), 1e-12))
        return np.asarray(np.clip(found / deviations[:, :, None] / deviations[:, None], -1.0, 1.0))

    def settings(self) -> dict[str, Any]:
        """What `fit_process` found, in numbers."""
        return {
            "lengths": [float(length) for length in self.lengths],
            "level": self.level,
            "rough": self.rough,
        }


def _basis(x: Field) -> Field:
    return np.hstack([np.ones((len(x), 1)), x])


def require_learning() -> None:
    """BadInput unless scikit-learn is there."""
    try:
        import sklearn.gaussian_process  # noqa: F401 - an extra, and long to load
    except ModuleNotFoundError:
        raise BadInput(
            "the emulator needs scikit-learn, which is not installed; pip install 'asperity[infer]'"
        ) from None


def fit_process(
    x: Field, y: Field, noise: Field, start: GaussianProcess | None = None
) -> GaussianProcess:
    """The likeliest process through values with known noise, from `start` or from lengths of the whole cube."""
    require_learning()
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    lengths: Field = np.ones(x.shape[1])
    level, rough = 1.0, 0.01
    if start is not None:
        lengths, level, rough = start.lengths, start.level, start.rough
    plain = GaussianProcess(x, y, noise, lengths, level, rough)
    kernel = ConstantKernel(level, LEVELS) * Matern(lengths, LENGTHS, nu=2.5) + WhiteKernel(
        rough, ROUGHNESS
    )
    learner = GaussianProcessRegressor(
        kernel, alpha=noise / plain._scale**2 + 1e-10, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", ConvergenceWarning
        )  # a length at its bound is one that does not matter
        learner.fit(x, (y - _basis(x) @ plain._trend) / plain._scale)
    product, white = learner.kernel_.k1, learner.kernel_.k2
    return GaussianProcess(
        x,
        y,
        noise,
        np.atleast_1d(product.k2.length_scale),
        float(product.k1.constant_value),
        float(white.noise_level),
    )
