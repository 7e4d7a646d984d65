"""Solution strategies: initial guesses and grid continuation."""
