"""Report of a wear simulation."""
