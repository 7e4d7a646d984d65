"""Time derivative in the balance of the oil."""

from dataclasses import dataclass, replace

from asperity.core.arrays import Field


@dataclass(frozen=True, slots=True)
class TransientTerm:
    """Time derivative in the oil's balance: `rate` times its content, plus `source`, (nx, ny).

    With `lagrangian`, oil is balanced along its path, so that `source` includes the wedge (unless
    oil is conserved, not in the first two rows of cells, which have no upstream path). Then
    `limiter_correction` is the second-order correction of the wedge one cell upstream and one step
    before, and `upstream` the content there; None where the source is of second order already.
    The path of one step is `cells` long.
    """

    rate: float
    source: Field
    lagrangian: bool
    upstream: Field | None = None
    limiter_correction: Field | None = None
    cells: int = 1

    @property
    def on_one_line(self) -> "TransientTerm":
        """The same on the first line of cells, for a problem uniform along y."""
        fields = ("source", "upstream", "limiter_correction")
        parts = {name: getattr(self, name) for name in fields}
        first = {name: part[:, :1] for name, part in parts.items() if part is not None}
        return replace(self, **first)
