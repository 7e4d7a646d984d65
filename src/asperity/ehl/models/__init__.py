"""Discretised contact models: residuals and linearisation."""
