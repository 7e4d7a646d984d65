"""Benchmarks that measure every figure quoted in the docs: `make bench`."""
