"""Sampling designs and sensitivity indices from SALib: Morris' effects, Sobol's variances."""

import math
from typing import Literal, NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, install_text

SensitivityMethod = Literal["morris", "sobol"]
# default number of trajectories and of base samples (a power of two)
SIZES: dict[SensitivityMethod, int] = {"morris": 12, "sobol": 64}
MEASURES: dict[SensitivityMethod, dict[str, str]] = {  # our names and SALib's
    "morris": {name: name for name in ("mu", "mu_star", "mu_star_conf", "sigma")},
    "sobol": {"s1": "S1", "s1_conf": "S1_conf", "st": "ST", "st_conf": "ST_conf"},
}
LEVELS = 4  # values of a factor in Morris' design
CONFIDENCE = 0.95  # of SALib's intervals
RESAMPLING = 1  # seed of their bootstrap; SALib treats 0 as none
FEWEST_BLOCKS = 2  # complete blocks of the sample needed for indices
ROUNDING = 1e-9  # relative difference attributed to rounding


class SampleDesign(NamedTuple):
    """Points to evaluate, as shares 0 to 1 of each factor's range, shape (points, factors).

    Points are used in blocks of `block`; a block with a missing outcome is left out.
    """

    method: SensitivityMethod
    shares: Field
    block: int


def sample_design(
    method: SensitivityMethod, factors: int, size: int, seed: int = 0
) -> SampleDesign:
    """Draw Morris' trajectories or Saltelli's sample; `BadInput` for an unusable size."""
    try:
        import SALib  # noqa: F401
    except ModuleNotFoundError:
        raise BadInput(f"sensitivity needs SALib; {install_text('study')}") from None
    if size < 2:
        counted = "trajectories" if method == "morris" else "samples"
        raise BadInput(f"{counted} must be 2 or more, got {size}; {SIZES[method]} is the default")
    if method == "morris":
        from SALib.sample import morris

        return SampleDesign(
            method,
            morris.sample(_problem(factors), size, num_levels=LEVELS, seed=seed),
            factors + 1,
        )
    if size & (size - 1):
        nearest = 2 ** round(math.log2(size))
        raise BadInput(
            f"samples of the method sobol must be a power of two, got {size}; use {nearest}"
        )
    from SALib.sample import sobol

    shares = sobol.sample(_problem(factors), size, calc_second_order=False, seed=seed)
    return SampleDesign(method, shares, factors + 2)


def indices(design: SampleDesign, outcome: Field) -> dict[str, Field]:
    """Compute each factor's effect on an outcome of shape (points,); blocks with nan are left out.

    Returns `mu`, `mu_star`, `mu_star_conf`, `sigma`, or `s1`, `s1_conf`, `st`, `st_conf`, of shape
    (factors,); `AsperityError` if fewer than two blocks remain.
    """
    complete = np.isfinite(outcome.reshape(-1, design.block)).all(axis=1)
    if np.count_nonzero(complete) < FEWEST_BLOCKS:
        raise AsperityError("too many contacts failed to rank the factors; narrow the ranges")
    retained = np.repeat(complete, design.block)
    values = outcome[retained]
    shares = design.shares[retained]
    names = MEASURES[design.method]
    if np.ptp(values) <= ROUNDING * np.abs(values).max():
        return {name: np.zeros(shares.shape[1]) for name in names}
    problem = _problem(shares.shape[1])
    if design.method == "morris":
        from SALib.analyze import morris

        measures = morris.analyze(
            problem, shares, values, num_levels=LEVELS, conf_level=CONFIDENCE, seed=RESAMPLING
        )
    else:
        from SALib.analyze import sobol

        measures = sobol.analyze(
            problem, values, calc_second_order=False, conf_level=CONFIDENCE, seed=RESAMPLING
        )
    return {name: np.asarray(measures[salib], dtype=float) for name, salib in names.items()}


def _problem(factors: int) -> dict[str, object]:
    return {
        "num_vars": factors,
        "names": [f"x{i}" for i in range(factors)],
        "bounds": [[0.0, 1.0]] * factors,
    }
