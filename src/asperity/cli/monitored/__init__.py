"""Output of `asperity track` and `watch`."""
