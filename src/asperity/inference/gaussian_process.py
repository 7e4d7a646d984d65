"""Gaussian process over the unit cube, fitted by scikit-learn and evaluated in NumPy.

scikit-learn optimises the hyperparameters. Predictions avoid its overhead and use single
precision, accurate to 1e-5 of a standard deviation.
"""

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput, install_text

LENGTHS = (0.1, 30.0)  # bounds of the kernel's lengths, in widths of the cube
LEVELS = (1e-2, 1e2)  # bounds of the variance of the process over that of the data
WHITE_NOISE = (1e-5, 1.0)  # bounds of the noise in addition to the known one
TREND_NOISE = 0.02  # minimum variance of a point in the fit of the trend
CHUNK_SIZE = 512  # points evaluated at a time: their kernel fits in the processor's cache


@dataclass(frozen=True)
class GaussianProcess:
    """A linear trend plus a Gaussian process (Matern 5/2, anisotropic) of the residuals.

    Parameters
    ----------
    x : points, shape (n, d)
    y, noise : values and their known variances, shape (n,)
    lengths, level, rough : hyperparameters of the kernel relative to the squared scale of the
        residuals; `rough` is white noise, included in the predicted deviation
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
        """Transposed inverse Cholesky factor of the covariance; inverse covariance times data."""
        residual = (self.y - _basis(self.x) @ self._trend) / self._scale
        covariance = self._kernel(self.x, float) + np.diag(self.noise / self._scale**2 + self.rough)
        lower = scipy.linalg.cholesky(covariance, lower=True)
        whitener = scipy.linalg.solve_triangular(lower, np.eye(residual.size), lower=True).T
        return whitener, whitener @ (whitener.T @ residual)

    @cached_property
    def _single(self) -> tuple[Field, Field]:
        """`_solved` in single precision."""
        whitener, weights = self._solved
        return whitener.astype(np.float32), weights.astype(np.float32)

    def _kernel(self, x: Field, precision: type = np.float32) -> Field:
        scaled = x / self.lengths
        centres = self.x / self.lengths
        square = scaled @ (-2.0 * centres.T)
        square += np.sum(scaled**2, axis=1)[:, None]
        square += np.sum(centres**2, axis=1)
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
        """Predict mean and deviation at points, shape (n, d), of the mean over surfaces."""
        whitener, weights = self._single
        means, stds = [], []
        for part in np.array_split(x, max(1, -(-len(x) // CHUNK_SIZE))):
            kernel = self._kernel(part)
            white = kernel @ whitener
            explained = np.einsum("ij,ij->i", white, white).astype(float)
            means.append(_basis(part) @ self._trend + self._scale * (kernel @ weights))
            stds.append(self._scale * np.sqrt(np.maximum(self.level - explained, 0.0) + self.rough))
        return np.concatenate(means), np.concatenate(stds)

    def mean(self, x: Field) -> Field:
        """Predict only the mean, in a third of the time."""
        weights = self._single[1]
        parts = np.array_split(x, max(1, -(-len(x) // CHUNK_SIZE)))
        return np.concatenate(
            [_basis(p) @ self._trend + self._scale * (self._kernel(p) @ weights) for p in parts]
        )

    def correlations(self, x: Field) -> Field:
        """Return correlations of errors within groups of points (n, m, d), shape (n, m, m)."""
        count, size, _ = x.shape
        whitener = self._single[0]
        covariance = np.empty((count, size, size))
        for rows in np.array_split(np.arange(count), max(1, -(-count * size // CHUNK_SIZE))):
            part = x[rows]
            white = (self._kernel(part.reshape(-1, part.shape[2])) @ whitener).reshape(
                len(rows), size, -1
            )
            square = np.sum(((part[:, :, None] - part[:, None]) / self.lengths) ** 2, axis=-1)
            distance = np.sqrt(5.0 * square)
            correlation = (1.0 + distance + distance**2 / 3.0) * np.exp(-distance)
            residual = self.level * correlation - white @ white.transpose(0, 2, 1)
            covariance[rows] = residual + self.rough * correlation
        deviations = np.sqrt(np.maximum(np.einsum("nii->ni", covariance), 1e-12))
        scaled = covariance / deviations[:, :, None] / deviations[:, None]
        return np.asarray(np.clip(scaled, -1.0, 1.0))

    def settings(self) -> JsonObject:
        """Return the fitted hyperparameters."""
        return {
            "lengths": [float(length) for length in self.lengths],
            "level": self.level,
            "rough": self.rough,
        }


def _basis(x: Field) -> Field:
    return np.hstack([np.ones((len(x), 1)), x])


def require_learning() -> None:
    """Raise BadInput unless scikit-learn is installed."""
    try:
        import sklearn.gaussian_process  # noqa: F401 - an extra, and slow to load
    except ModuleNotFoundError:
        raise BadInput(
            f"the emulator needs scikit-learn, which is not installed; {install_text('infer')}"
        ) from None


def fit_process(
    x: Field, y: Field, noise: Field, start: GaussianProcess | None = None
) -> GaussianProcess:
    """Fit a process by maximum likelihood, starting from `start` or from unit lengths."""
    require_learning()
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    lengths: Field = np.ones(x.shape[1])
    level, rough = 1.0, 0.01
    if start is not None:
        lengths = start.lengths
        level = start.level
        rough = start.rough
    unscaled = GaussianProcess(x, y, noise, lengths, level, rough)
    kernel = ConstantKernel(level, LEVELS) * Matern(lengths, LENGTHS, nu=2.5) + WhiteKernel(
        rough, WHITE_NOISE
    )
    learner = GaussianProcessRegressor(
        kernel, alpha=noise / unscaled._scale**2 + 1e-10, random_state=0
    )
    with warnings.catch_warnings():
        # a length at its upper bound means that the axis has no effect
        warnings.simplefilter("ignore", ConvergenceWarning)
        learner.fit(x, (y - _basis(x) @ unscaled._trend) / unscaled._scale)
    product = learner.kernel_.k1
    white = learner.kernel_.k2
    return GaussianProcess(
        x,
        y,
        noise,
        np.atleast_1d(product.k2.length_scale),
        float(product.k1.constant_value),
        float(white.noise_level),
    )
