"""How hard a contact is to be solved, and how its solution went."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Literal, get_args

from asperity.core.errors import BadInput, require_positive
from asperity.ehl.uncertainty import ContactError

ContactModel = Literal["unified", "paper", "mixed", "conserving"]
UNIFIED, PAPER, MIXED, CONSERVING = MODELS = get_args(ContactModel)  # the first two are one
TWO_PRESSURES = (MIXED, CONSERVING)
Start = Literal["steady", "stationary"]
MAX_CELLS_PER_TIME_STEP = 8.0  # cells that the oil may travel in one step of time


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How hard to solve.

    Parameters
    ----------
    tolerance : bound on residual, load error and change, each relative
    max_iterations : Newton steps allowed on each grid level and in each attempt
    contact_film : gap at which asperities count as touching [m]; a few molecules of oil. It moves the load share by
        some per cent per factor of ten, so it belongs beside every CLR.
    model : "unified" (or "paper"), one pressure for oil and asperities; "mixed", a pressure each, which without speed
        is the dry contact; "conserving", in which no oil is lost
    """

    tolerance: float = 1e-4
    max_iterations: int = 200
    contact_film: float = 5e-9
    model: ContactModel = "mixed"

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 0.1:
            raise BadInput(
                f"tolerance must lie between 0 and 0.1, got {self.tolerance:g}; 1e-4 is the default"
            )
        if self.max_iterations < 1:
            raise BadInput(f"max_iterations must be at least 1, got {self.max_iterations}")
        require_positive("contact film", self.contact_film, "m")
        if self.model not in MODELS:
            raise BadInput(f"model must be one of {', '.join(MODELS)}, got {self.model!r}")


# what is tried, one after the other, until one converges
ATTEMPTS = (
    "coarse to fine",
    # smooth bodies only: they have a better one at first
    "with the second-order wedge of rough bodies",
    "with the bodies held while their distance was searched",
)
FROM_DRY = "from the dry contact"  # of two pressures only


class SolveStatus(StrEnum):
    """How a solve ended."""

    CONVERGED = "converged"
    OUT_OF_ITERATIONS = "out of iterations"
    STALLED = "stalled"


@dataclass(frozen=True, slots=True)
class Iteration:
    """Where a Newton step led: grid cells, step number on that grid, and three relative figures that must become small.

    Number 0 is the start on that grid, which no step has led to: its change is infinite.
    """

    cells: tuple[int, int]
    number: int
    residual: float
    load_error: float
    change: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What a solution is asked for first: CAR in the Hertz zone, CLR, least and central film [m]; or their errors.

    Of a roller also the largest pressure [Pa] and the least gap [m] at its ends; None of other
    contacts.
    """

    car: float
    clr: float
    h_min: float
    h_central: float
    edge_pressure: float | None = None
    end_film: float | None = None

    def abs_difference(self, other: "Figures") -> "Figures":
        """Absolute differences."""
        return self._combine(other, lambda mine, theirs: abs(mine - theirs))

    def difference(self, other: "Figures") -> "Figures":
        """Differences."""
        return self._combine(other, lambda mine, theirs: mine - theirs)

    def copysign(self, other: "Figures") -> "Figures":
        """Each with the other's sign."""
        return self._combine(other, math.copysign)

    def add(self, other: "Figures") -> "Figures":
        """Sums."""
        return self._combine(other, lambda mine, theirs: mine + theirs)

    def maximum(self, other: "Figures") -> "Figures":
        """The larger of each pair."""
        return self._combine(other, max)

    def scale(self, factor: float) -> "Figures":
        """All of them times a factor."""
        return self._combine(self, lambda mine, _: factor * mine)

    def _combine(self, other: "Figures", merge: Callable[[float, float], float]) -> "Figures":
        pairs = ((name, getattr(self, name), getattr(other, name)) for name in FIGURES)
        return Figures(
            **{name: merge(mine, its) for name, mine, its in pairs if None not in (mine, its)}
        )


FIGURES = tuple(field.name for field in fields(Figures))


@dataclass(frozen=True, slots=True, kw_only=True)
class GridError(Figures):
    """What the cells' size may have done to the figures: half-widths of 90 % intervals.

    `lean` is how far the middle of each interval lies above the figure: a finer grid mostly goes
    on the way that the figures took from the coarser one.
    """

    lean: Figures

    def sides(self, name: str) -> tuple[float, float]:
        """How far a figure may lie below and above, not less than not at all."""
        half, lean = getattr(self, name), getattr(self.lean, name)
        return max(0.0, half - lean), max(0.0, half + lean)


@dataclass(frozen=True, slots=True)
class Convergence:
    """How the solve went: status, every step on every grid level, and the time it took [s].

    `attempt` is the manner that led here: the first, unless what was tried before it failed.
    `iteration_error` is how far the last step moved the figures, `discretisation_error` what the
    cells' size may have done to them, from the solutions on coarser grids: None on a grid too
    small to have a coarser one. A warm start hands on its own.
    """

    status: SolveStatus
    history: tuple[Iteration, ...]
    tolerance: float
    seconds: float
    attempt: str = ATTEMPTS[0]
    iteration_error: Figures | None = None
    discretisation_error: GridError | None = None

    @property
    def error(self) -> Figures | None:
        """How far off the figures may be: iteration and discretisation error together."""
        if self.iteration_error is None or self.discretisation_error is None:
            return None
        return self.iteration_error.add(self.discretisation_error)

    @property
    def converged(self) -> bool:
        """Whether residual, load error and change all met the tolerance on the finest grid."""
        return self.status is SolveStatus.CONVERGED

    @property
    def iterations(self) -> int:
        """Newton steps on all grid levels together."""
        return sum(step.number > 0 for step in self.history)

    def explain(self) -> str:
        """One sentence on how the solve ended."""
        last = self.history[-1]
        tried = "" if self.attempt == ATTEMPTS[0] else f", at last {self.attempt},"
        if self.attempt == FROM_DRY:  # of thin films the first attempt, of thick ones the second
            tried = f", {FROM_DRY},"
        return (
            f"{self.status}{tried} after {self.iterations} steps in {self.seconds:.2f} s: "
            f"residual {last.residual:.1e}, load error {last.load_error:.1e}, change {last.change:.1e}; "
            f"tolerance {self.tolerance:.0e}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactState:
    """Scalars of a solved contact, SI.

    The Hertz zone is |x| <= a for a line contact, the ellipse of half-widths a, b for others.
    `car` contact cells in it over all cells there; `car_domain` contact area of the whole domain
    over the Hertz area; `clr` load on contact cells over the load; `capped_oil_load_ratio` load on
    cells that stand at the pressure cap without touching, over the load: oil that the model holds
    at the hardness, which a coarser contact threshold would count as contact; `sq` composite
    roughness [m]; films [m]: `h_min` smallest gap of the domain (the contact film where bodies
    touch), `h_central` mean over a tenth of the Hertz zone's half-widths, `h_mean` mean over the
    zone; `lambda_ratio` the smooth contact's least film, by the fit of its regime, over Sq
    (`least_film`; None for a smooth surface or a dry contact); `p_max` [Pa]; `reynolds_residual`
    root mean square of what is left of every cell's equation, as a share of p_h; `load_error`
    relative; `mass_flux_imbalance` oil that vanishes or appears in the cells of the Hertz zone, of
    one pressure in those where Reynolds' equation does not hold, in sum, over the oil that the
    surfaces carry through the zone, u times mean film (0 when dry). The cavity behind the contact
    is left out: the model refills it, which changes nothing upstream; `contact_slope` mean slope
    of the undeformed roughness over touching cells (None where none touch); `error` how far load
    share and resonance may be off, and why (None for a mean over the steps of a history).
    """

    car: float
    car_domain: float
    clr: float
    capped_oil_load_ratio: float
    sq: float
    h_min: float
    h_central: float
    h_mean: float
    lambda_ratio: float | None
    p_max: float
    reynolds_residual: float
    load_error: float
    mass_flux_imbalance: float
    contact_slope: float | None = None
    error: ContactError | None = None
