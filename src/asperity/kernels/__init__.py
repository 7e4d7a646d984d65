"""Compiled loops: arrays in, in place or one number out. The only place that imports numba."""
