"""Anderson mixing, which speeds up fixed-point iterations of fields."""

from itertools import pairwise

import numpy as np

from asperity.core.arrays import Field

MEMORY = 5  # previous guesses


class Mixer:
    """Anderson mixing for a fixed point; the step is halved when the residual grows.

    Source: D. G. Anderson, J. ACM 12 (1965) 547.
    """

    def __init__(self) -> None:
        self.damping, self.last_residual = 1.0, np.inf
        self.guesses: list[Field] = []
        self.changes: list[Field] = []

    def __call__(self, guess: Field, change: Field) -> Field:
        """Return the next guess, given the change that the iteration proposes at `guess`."""
        residual = float(np.linalg.norm(change))
        if residual > self.last_residual:
            self.damping = max(0.5 * self.damping, 0.05)
            self.guesses, self.changes = [], []
        self.last_residual = residual
        self.guesses = [*self.guesses[-MEMORY:], guess]
        self.changes = [*self.changes[-MEMORY:], change]
        if len(self.guesses) == 1:
            return np.asarray(guess + self.damping * change)
        guesses = np.stack([(new - old).ravel() for old, new in pairwise(self.guesses)], axis=1)
        changes = np.stack([(new - old).ravel() for old, new in pairwise(self.changes)], axis=1)
        weights = np.linalg.lstsq(changes, change.ravel(), rcond=1e-10)[0]
        return (
            guess
            + self.damping * change
            - ((guesses + self.damping * changes) @ weights).reshape(guess.shape)
        )
