"""Time derivative in the balance of the oil."""

from dataclasses import dataclass

from asperity.core.arrays import Field


@dataclass(frozen=True, slots=True)
class TransientTerm:
    """Time derivative in the oil's balance: `rate` times its content, plus `source`, (nx, ny).

    With `lagrangian`, oil is balanced along its path, so that `source` includes the wedge (unless
    oil is conserved, not in the first two rows of cells, which have no upstream path). Then
    `limiter_correction` is the second-order correction of the wedge one cell upstream and one step
    before, and `upstream` the content there; None where the source is of second order already.
    """

    rate: float
    source: Field
    lagrangian: bool
    upstream: Field | None = None
    limiter_correction: Field | None = None

    @property
    def on_one_line(self) -> "TransientTerm":
        """The same on the first line of cells, for a problem uniform along y."""
        parts = (
            None if part is None else part[:, :1]
            for part in (self.source, self.upstream, self.limiter_correction)
        )
        source, upstream, limiter_correction = parts
        assert source is not None
        return TransientTerm(self.rate, source, self.lagrangian, upstream, limiter_correction)
