"""Coverage of the intervals that asperity states: 90 %."""

QUANTILES = (0.05, 0.5, 0.95)  # lower end, median, upper end
