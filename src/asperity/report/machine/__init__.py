"""Report of a machine."""
