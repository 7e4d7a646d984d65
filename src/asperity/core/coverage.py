"""Coverage of every computed interval, 90 %; texts and tables take it from here.

To change it, set `COVERAGE` and `NORMAL_FACTOR`, calibrate `ERROR_ESTIMATE` (`ehl.grid_error`)
again, and adapt the 90 % limits from the literature: `solution.traction`, `lubricant.model`,
`wear.laws`.
Sobol indices have intervals of their own (`study.sensitivity_indices.CONFIDENCE`).
"""

COVERAGE = 0.90  # share of the intervals that contain the true value
PERCENT = f"{100.0 * COVERAGE:.0f} %"  # the same in texts
UPPER = (1.0 + COVERAGE) / 2.0  # quantile at the upper end of an interval
QUANTILES = (round(1.0 - UPPER, 12), 0.5, UPPER)  # lower end, median, upper end
# half-width of a normal interval [standard deviations]: scipy.special.ndtri(UPPER), stated because
# NormalDist().inv_cdf(UPPER) differs in the last digits and scipy is slow to import
NORMAL_FACTOR = 1.6448536269514722
