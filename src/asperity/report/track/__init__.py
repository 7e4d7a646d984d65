"""Report of a tracked series."""
