"""Discretisation error of a solution's key results, from the last grids."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from asperity.ehl.outcome import Figures, GridError


@dataclass(frozen=True, slots=True, kw_only=True)
class DiscretisationError:
    """Error bars from the last grids, calibrated for `core.coverage` (benchmark row: intervals)."""

    forward: float = 2.5  # in the difference d of the last two grids, in its direction ...
    backward: float = 1.5  # ... and against it
    min_difference: float = 0.25  # in the difference between the two grids before
    load_share_per_cell: float = 2.4  # in the squared cell [half-widths²]: unresolved load share
    two_order_share: float = 0.85  # of all this, if both orders of the wedge are known
    load_share_forward: float = 2.0  # the same of the load share, if three grids are known too
    load_share_backward: float = 0.5
    load_share_per_cell_three: float = 1.0
    # of edge pressure and end film, in d: their error falls with the cell, not with its square
    end_factor: float = 3.0
    max_end_growth: float = 10.0  # times that, of a figure that does not converge with the grid
    end_scatter: float = 0.03  # share of a figure below which differences have no trend


ERROR_ESTIMATE = DiscretisationError()


def grid_error(
    on_grids: Sequence[Figures],
    *,
    smooth: bool,
    cell: float,
    by_first_order: Figures | None = None,
    order: int = 2,
) -> GridError | None:
    """Return intervals of the key results from the last grids; None for a single grid.

    A smooth solution gets Roache's grid convergence index, three times its error: the difference of
    both grids if it is of second `order`, three times that for first order. A rough one has no such
    order. If its values on the last two grids differ by d, they get 2.5 d in the direction of the
    change, 1.5 d against it, and the load share 2.4 of the squared cell (`cell`, in half-widths)
    either way: what a hundred contacts of the wide sample need to cover four times the cells
    (`benchmarks.intervals`). A roller's edge pressure and end film get 3 d, and up to ten times
    that where d does not shrink with refinement. d is at least a quarter of the difference between
    the grids before, lest two grids agree by chance, and at least the change from the first-order
    wedge to the second-order one on the finest grid; if that is known, 0.85 of all this suffices.
    The load share, if three grids are known too, gets 2 d in the direction of the change, 0.5 d
    against it and one squared cell. Source: P. J. Roache, J. Fluids Eng. 116 (1994) 405.
    """
    if len(on_grids) < 2:
        return None
    *before, coarse, fine = on_grids
    zero, shift = fine.abs_difference(fine), fine.abs_difference(coarse)
    figures_of_ends = (
        (name, [getattr(results, name) for results in on_grids])
        for name in ("edge_pressure", "end_film")
    )
    errors = {name: ends_error(values) for name, values in figures_of_ends if None not in values}
    if before:
        shift = shift.maximum(
            coarse.abs_difference(before[-1]).scale(ERROR_ESTIMATE.min_difference)
        )
    if smooth:
        half, lean = shift if order > 1 else shift.scale(3.0), zero
    else:
        half, lean = _rough_interval(on_grids, shift, cell, by_first_order)
        lean = replace(lean, **dict.fromkeys(errors, 0.0))
    return GridError(**asdict(replace(half, **errors)), lean=lean)


def _rough_interval(
    on_grids: Sequence[Figures], shift: Figures, cell: float, by_first_order: Figures | None
) -> tuple[Figures, Figures]:
    """Return half the width and the lean of a rough solution's intervals; see `grid_error`."""
    coarse, fine = on_grids[-2:]
    zero, share = fine.abs_difference(fine), 1.0
    if by_first_order is not None:
        shift = shift.maximum(fine.abs_difference(by_first_order))
        share = ERROR_ESTIMATE.two_order_share
    half = shift.scale(0.5 * share * (ERROR_ESTIMATE.forward + ERROR_ESTIMATE.backward)).add(
        replace(zero, clr=share * ERROR_ESTIMATE.load_share_per_cell * cell**2)
    )
    lean = shift.scale(0.5 * share * (ERROR_ESTIMATE.forward - ERROR_ESTIMATE.backward)).copysign(
        fine.difference(coarse)
    )
    if by_first_order is not None and len(on_grids) > 2:
        half_clr, lean_clr = _load_share_error(shift.clr, fine.clr - coarse.clr, cell)
        half, lean = replace(half, clr=half_clr), replace(lean, clr=lean_clr)
    return half, lean


def _load_share_error(shift: float, change: float, cell: float) -> tuple[float, float]:
    """Return half the width and the lean of the load share's interval from three grids."""
    half = (
        0.5 * (ERROR_ESTIMATE.load_share_forward + ERROR_ESTIMATE.load_share_backward) * shift
        + ERROR_ESTIMATE.load_share_per_cell_three * cell**2
    )
    lean = 0.5 * (ERROR_ESTIMATE.load_share_forward - ERROR_ESTIMATE.load_share_backward) * shift
    return half, math.copysign(lean, change)


def ends_error(on_grids: Sequence[float]) -> float:
    """Return half the interval of a value at a roller's ends on successively finer grids.

    See `grid_error`.
    """
    *before, coarse, fine = on_grids
    shift, factor = abs(fine - coarse), ERROR_ESTIMATE.end_factor
    if before:
        earlier = abs(coarse - before[-1])
        if shift > ERROR_ESTIMATE.end_scatter * abs(fine):
            shrinks = min(shift / earlier, 1.0) if earlier > 0.0 else 1.0
            factor *= min(
                max(0.5 * shrinks / max(1.0 - shrinks, 1e-9), 1.0),
                ERROR_ESTIMATE.max_end_growth,
            )
        shift = max(shift, ERROR_ESTIMATE.min_difference * earlier)
    return factor * shift
