"""Coverage of every stated interval, 90 %: the one place that sets it.

The intervals of a solution's discretisation error (`ERROR_ESTIMATE` in `ehl.controls`) are
calibrated to the same coverage: calibrate them again when it changes.
"""

COVERAGE = 0.90  # share of the intervals that contain the true value
UPPER = 0.95  # quantile at the upper end of an interval: (1 + COVERAGE)/2
QUANTILES = (0.05, 0.5, UPPER)  # lower end, median, upper end
NORMAL_FACTOR = 1.6448536269514722  # half-width of a normal interval [standard deviations]
