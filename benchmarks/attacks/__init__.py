"""Attacks on asperity and a runner that checks its response: `python -m benchmarks.attacks`."""
