"""Commands of simulations in time: `asperity run`, `wear`, `cycle` and `deplete`."""
