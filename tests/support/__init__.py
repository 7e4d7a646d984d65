"""Shared test code: slow reference solutions independent of the package, recordings of all formats,
golden numbers.
"""
