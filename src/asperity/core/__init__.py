"""Shared basics: errors, arrays, files, limits, processes, storage, quantities and signals."""
