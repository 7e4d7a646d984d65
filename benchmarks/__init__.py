"""Every figure that the docs quote, measured: `make bench`."""
