"""Slow, plain, independent solutions that the package is measured against; they share no code with it."""
