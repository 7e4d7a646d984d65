"""Constants that control the search for a solution, each with its unit and its reason.

They decide whether and how fast the solver converges, not what it converges to, unless a comment
says otherwise. Residuals are root mean squares as a share of p_h. Each constant has a row in
`benchmarks/controls.py` that shows what another value costs.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Residuals:
    """Residuals at which the search changes its method."""

    initial_guess: float = 0.1  # a result with more is no initial guess for the next grid
    # of the first-order wedge or the dry contact, before the equations solved
    rough_solution: float = 1e-2
    divergence: float = 10.0  # ratio to the initial residual from which steps seldom recover
    coarse_grid: float = 1e-3  # of a coarser grid, whose solution only has to be a good guess


@dataclass(frozen=True, slots=True, kw_only=True)
class StepLimits:
    """Largest changes of one Newton step, of all models; further ones are in `MixedNewton`."""

    max_pressure_step: float = 0.5  # of a cell, in p_h ...
    max_relative_step: float = 0.5  # ... or in its own pressure: elastic asperities reach 100 p_h
    # in a²/R or rms roughness, whichever is more: a contact at the cap responds nonlinearly
    max_approach_step: float = 0.3
    approach_growth: float = 1.2  # of the approach limit from step to step without reversal
    stagnation_iterations: int = 8  # without a decrease, until the damping changes
    min_damping: float = 1.0 / 16.0  # a line search stops there


@dataclass(frozen=True, slots=True, kw_only=True)
class MixedNewton:
    """Newton iteration of the mixed model."""

    line_search_residual: float = 0.03  # below it a step that increases the residual is halved
    max_residual_growth: float = 1.5  # of a step that is not halved
    # of one step: in the content of a ruptured cell and, with exact face mobilities, in the film
    # (in a time step plus the rms roughness) ...
    max_film_decrease: float = 0.8
    max_pressure_change: float = 2.0  # ... and in the pressure, or in p_h if that is more


@dataclass(frozen=True, slots=True, kw_only=True)
class MixedLinearSolver:
    """Linear solver of the mixed model's Newton steps; `KrylovMethod` has the usual tolerance."""

    # close to the solution for exact face mobilities, whose rows differ by more, and for oil
    # conserved along its path; and for conserved oil between bodies that touch nowhere, if their
    # film is a small difference of far larger deflections (`thin_film`, a²/R): the cavity's
    # equations dominate the residual
    tolerance_close: float = 1e-2
    thin_film: float = 1e-3
    # in a time step the residual, between `tolerance_close` and this one: closer steps far from the
    # solution are not better ones
    max_tolerance_time_step: float = 0.3
    # share of the flattened cells: fewer nearly closed ones make the contact firm
    max_nearly_closed: float = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Preconditioner:
    """Approximate inverse of the linearised equations."""

    # along each axis of a grid that is factored; multigrid needs as many along both
    max_coarse_cells: int = 64
    min_halved_cells: int = 12  # along an axis that multigrid still halves
    cycles: int = 2  # of coarse correction and line relaxation on each level
    min_pivot: float = 0.02  # in its row's entries along x; keeps elimination stable


@dataclass(frozen=True, slots=True, kw_only=True)
class KrylovMethod:
    """GMRES and its variant with a frequency."""

    tolerance: float = 0.1  # relative residual: an inexact Newton method
    max_steps: int = 100
    reorthogonalise: float = 0.5  # share of a vector left, below which it is orthogonalised again


@dataclass(frozen=True, slots=True, kw_only=True)
class DryContact:
    """Active sets and conjugate gradients for dry bodies."""

    max_krylov_steps: int = 1000  # of conjugate gradients, in all
    max_rounds: int = 30  # of active sets, of windows around them, of redistributed load
    window_margin: int = 32  # a window adds one in so many of all lines on either side
    tolerance: float = 1e-4  # residual of conjugate gradients once the set is stable


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalRefinement:
    """Nonlinear elimination of the worst cells of an initial guess."""

    worst_residual: float = 0.05  # in the largest residual: cells that belong to a box
    max_box_share: float = 0.25  # of the grid's cells: larger boxes do not pay
    margin: int = 6  # cells around the worst ones in a box, of which the outer third is fixed


@dataclass(frozen=True, slots=True, kw_only=True)
class GridContinuation:
    """Search from the coarsest grid to the finest."""

    # where another way is left: on a coarser grid, at one approach while it is bracketed, of the
    # second-order wedge, of a roller's third-order wedge, in a time step
    max_iterations: int = 40
    min_coarse_inlet_cells: float = 2.0  # across the inlet of a line contact: else it closes


@dataclass(frozen=True, slots=True, kw_only=True)
class MixedSearchControls:
    """Strategies of the mixed model."""

    # of the first-order wedge from a distant guess, and of exact face mobilities from arithmetic
    # means
    max_long_iterations: int = 80
    # back to first order, for the error estimate, until a step moves the load share by less of its
    # change
    backward_tolerance: float = 0.2
    # sum of gains and losses over the throughflow, if conserving ...
    max_imbalance: float = 1e-6
    imbalance_to_tolerance: float = 1e-2  # ... or this share of the tolerance, if that is more


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeMarching:
    """Implicit time steps towards a steady state; lengths are the oil's path in one step."""

    tolerance: float = 5e-2  # of one step
    max_newton_steps: int = 10  # in one step; beyond it shorter ones are faster
    max_steps: int = 1000  # a nearly flooded meniscus moves slowly
    final_length: float = 3.0  # half-widths; the last step is at least as long
    min_length: float = 0.05  # in the first step: shorter ones do not help


@dataclass(frozen=True, slots=True, kw_only=True)
class Meniscus:
    """Time steps to the steady meniscus ahead of a starved contact."""

    front: float = 4.0  # gap at the initial meniscus, in the layer's thickness ...
    front_film: float = 2.0  # ... or in the central film, if that is more
    first_length: float = 0.5  # the oil's path in one step, in half-widths
    forcing: float = 0.1  # mass imbalance of a time step, in that of the steady equations before it


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidFilm:
    """Mass-conserving film between rigid walls."""

    max_steps: int = 200
    max_log_viscosity_step: float = 1.0  # change of log viscosity in one cell and step


RESIDUALS = Residuals()
STEP_LIMITS = StepLimits()
MIXED_NEWTON = MixedNewton()
MIXED_SOLVER = MixedLinearSolver()
PRECONDITIONER = Preconditioner()
KRYLOV = KrylovMethod()
DRY = DryContact()
REFINEMENT = LocalRefinement()
CONTINUATION = GridContinuation()
SEARCH = MixedSearchControls()
MARCHING = TimeMarching()
MENISCUS = Meniscus()
RIGID_FILM = RigidFilm()
