"""Options of a contact solve, and the record of its convergence."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Literal, get_args

from asperity.core.displayed import Brief
from asperity.core.errors import BadInput, require_positive
from asperity.ehl.inlet_layer import InletLayer
from asperity.ehl.uncertainty import ContactError

ContactModel = Literal["unified", "paper", "mixed", "conserving"]
UNIFIED, PAPER, MIXED, CONSERVING = MODELS = get_args(ContactModel)  # the first two are the same
TWO_PRESSURES = (MIXED, CONSERVING)
Start = Literal["steady", "stationary"]
MAX_CELLS_PER_TIME_STEP = 8.0  # cells that oil may travel in one time step


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options of a contact solve.

    Parameters
    ----------
    tolerance : bound on the relative residual, load error and change
    max_iterations : Newton steps allowed on each grid level and in each attempt
    contact_film : gap at which asperities count as touching [m]; a few molecules of oil. It moves
        the load share by some per cent per factor of ten, so quote it with every CLR.
    model : "unified" (or "paper"): one pressure for oil and asperities; "mixed": two pressures, at
        zero speed the dry contact; "conserving": mixed, with mass-conserving cavitation
    inlet_layer : oil that enters, for model "conserving"; None: the inlet is full of oil
    """

    tolerance: float = 1e-4
    max_iterations: int = 200
    contact_film: float = 5e-9
    model: ContactModel = "mixed"
    inlet_layer: InletLayer | None = None

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
        if self.inlet_layer is not None and self.model != CONSERVING:
            raise BadInput(
                f'an inlet layer needs the model "conserving", which balances the oil, got '
                f'{self.model!r}; set model = "conserving"'
            )


class SolveStrategy(StrEnum):
    """Way to a solution; its text completes the sentence on the outcome."""

    COARSE_TO_FINE = "coarse to fine"
    # smooth bodies only, whose usual wedge is third order
    SECOND_ORDER = "with the second-order wedge of rough surfaces"
    FIXED_APPROACH = "at fixed approach, found by bracketing"
    FROM_DRY = "from the dry contact"  # models with two pressures only
    # heated films whose exact mobilities do not converge
    ARITHMETIC_MEANS = "with arithmetic mean mobilities"


class SolveStatus(StrEnum):
    """Outcome of a solve."""

    CONVERGED = "converged"
    OUT_OF_ITERATIONS = "out of iterations"
    STALLED = "stalled"


@dataclass(frozen=True, slots=True)
class Iteration:
    """One Newton step: grid cells, step number on that grid, and three relative measures.

    Number 0 is the initial guess on that grid; its change is infinite.
    """

    cells: tuple[int, int]
    number: int
    residual: float
    load_error: float
    change: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """Key results: CAR in the Hertz zone, CLR, minimum and central film [m]; or their errors.

    For rollers also the largest pressure [Pa] and the smallest gap [m] at the ends; else None.
    """

    car: float
    clr: float
    h_min: float
    h_central: float
    edge_pressure: float | None = None
    end_film: float | None = None

    def abs_difference(self, other: "Figures") -> "Figures":
        """Return the absolute differences."""
        return self._combine(other, lambda mine, theirs: abs(mine - theirs))

    def difference(self, other: "Figures") -> "Figures":
        """Return the differences."""
        return self._combine(other, lambda mine, theirs: mine - theirs)

    def copysign(self, other: "Figures") -> "Figures":
        """Return the values with the signs of `other`."""
        return self._combine(other, math.copysign)

    def add(self, other: "Figures") -> "Figures":
        """Return the sums."""
        return self._combine(other, lambda mine, theirs: mine + theirs)

    def maximum(self, other: "Figures") -> "Figures":
        """Return the larger value of each pair."""
        return self._combine(other, max)

    def scale(self, factor: float) -> "Figures":
        """Return the values times a factor."""
        return self._combine(self, lambda mine, _: factor * mine)

    def _combine(self, other: "Figures", merge: Callable[[float, float], float]) -> "Figures":
        """Apply a function to each pair of values that exist."""
        pairs = ((name, getattr(self, name), getattr(other, name)) for name in FIGURES)
        return Figures(
            **{name: merge(mine, its) for name, mine, its in pairs if None not in (mine, its)}
        )


FIGURES = tuple(field.name for field in fields(Figures))


@dataclass(frozen=True, slots=True, kw_only=True)
class GridError(Figures):
    """Discretisation error of the key results: half-widths of intervals.

    `lean` is the offset of each interval's centre from the value: a finer grid mostly continues in
    the direction of the last refinement.
    """

    lean: Figures

    def sides(self, name: str) -> tuple[float, float]:
        """Return the error below and above a value, each at least 0."""
        half = getattr(self, name)
        lean = getattr(self.lean, name)
        return max(0.0, half - lean), max(0.0, half + lean)


@dataclass(frozen=True, slots=True)
class Convergence:
    """Record of a solve: status, every step on every grid level, and its duration [s].

    `attempt` is the strategy that led here: the first, unless earlier ones failed.
    `iteration_error` is the change of the key results in the last step, `discretisation_error`
    their error from the solutions on coarser grids: None on a grid too small to have a coarser one.
    A warm start passes on its own.
    """

    status: SolveStatus
    history: tuple[Iteration, ...]
    tolerance: float
    seconds: float
    attempt: SolveStrategy = SolveStrategy.COARSE_TO_FINE
    iteration_error: Figures | None = None
    discretisation_error: GridError | None = None

    @property
    def error(self) -> Figures | None:
        """Sum of iteration and discretisation error."""
        if self.iteration_error is None or self.discretisation_error is None:
            return None
        return self.iteration_error.add(self.discretisation_error)

    @property
    def converged(self) -> bool:
        """True if residual, load error and change met the tolerance on the finest grid."""
        return self.status is SolveStatus.CONVERGED

    @property
    def iterations(self) -> int:
        """Newton steps on all grid levels together."""
        return sum(step.number > 0 for step in self.history)

    def explain(self) -> str:
        """Return one sentence on the outcome of the solve."""
        last = self.history[-1]
        tried = "" if self.attempt == SolveStrategy.COARSE_TO_FINE else f" ({self.attempt})"
        # the first attempt for thin films, the second for thick ones
        if self.attempt == SolveStrategy.FROM_DRY:
            tried = f" {self.attempt}"
        return (
            f"{self.status}{tried} after {self.iterations} steps in {self.seconds:.2f} s: "
            f"residual {last.residual:.1e}, load error {last.load_error:.1e}, change "
            f"{last.change:.1e}; "
            f"tolerance {self.tolerance:.0e}"
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ContactState(Brief):
    """Scalars of a solved contact, SI.

    The Hertz zone is |x| <= a for a line contact, the ellipse of half-widths a, b for others.

    `car`: contact cells in the Hertz zone over all cells there. `car_domain`: contact area of the
    whole domain over the Hertz area. `clr`: load on contact cells over the load.
    `capped_oil_load_ratio`: load on cells at the pressure cap without contact, over the load: oil
    that the model holds at the hardness, which a larger contact film would count as contact. `sq`:
    composite roughness [m]. Films [m]: `h_min` smallest gap of the domain (the contact film where
    bodies touch), `h_central` mean over a tenth of the Hertz zone's half-widths, `h_mean` mean over
    the zone. `lambda_ratio`: the smooth contact's minimum film, by the fit of its regime, over Sq
    (`least_film`; None for a smooth surface or a dry contact). `p_max` [Pa].

    `reynolds_residual`: root mean square of every cell's residual, as a share of p_h. `load_error`:
    relative. `mass_flux_imbalance`: sum over the Hertz zone's cells of oil lost or gained, in the
    single-pressure model in those where Reynolds' equation does not hold, over the oil transported
    through the zone, u times mean film (0 when dry). The cavity behind the contact is left out: the
    model refills it, which changes nothing upstream. `contact_slope`: mean slope of the undeformed
    roughness over touching cells (None where none touch); `rms_slope`: its root mean square
    gradient in the Hertz zone. `error`: uncertainty of load share and
    resonance (None for a mean over the steps of a history).
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
    rms_slope: float | None = None
    error: ContactError | None = None
