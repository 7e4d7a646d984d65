"""Coverage of the intervals that asperity states."""

COVERAGE = 0.9
QUANTILES = (0.05, 0.5, 0.95)  # lower end, median, upper end
NORMAL_FACTOR = 1.6448536269514722  # half-width of a normal interval, in standard deviations
