"""Fleets: trees of watched folders, and outputs for time-series databases."""
