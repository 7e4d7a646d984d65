"""Films over a dimple that runs through a contact, beside measured and simulated ones."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from asperity.benchmark.measurements import DimpleExperiment, DimpleRun, Profile
from asperity.case import Case
from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, NotConverged
from asperity.surface import MovingSurfaces, Surface, flat_surface
from asperity.transient import moving_contact

GRID_X, GRID_Y = (-2.8, 1.5), (-1.7, 1.7)  # ends of the grid, in half-widths
RADIUS_RATIO, DECAY = 1.2, 2.0  # of the dimple's shape
UPSTREAM = 60e-6  # from the dimple's middle [m], where the film is undisturbed
MIN_UPSTREAM_POINTS = 5


@dataclass(frozen=True)
class DimpleProfile:
    """A measured and a simulated film on the axis, and the computed ones at their best moments.

    `half_width` of the Hertz zone [m]; `films` [m] at `x` [m], one per time step.
    """

    experiment: DimpleExperiment
    run: str
    number: int
    measured: Profile
    simulated: Profile
    half_width: float
    x: Field
    films: tuple[Field, ...]

    @cached_property
    def beside_measured(self) -> Field:
        """Computed film [m] that is closest to the measured one."""
        return min(self.films, key=lambda film: self._deviation(self.measured, (self.x, film)))

    @property
    def from_measured(self) -> float:
        """Root mean square difference of the computed from the measured film, over its mean."""
        return self._deviation(self.measured, (self.x, self.beside_measured))

    @property
    def from_simulated(self) -> float:
        """The same from the simulated film."""
        return min(self._deviation(self.simulated, (self.x, film)) for film in self.films)

    @property
    def simulated_from_measured(self) -> float:
        """The same of the simulated from the measured film."""
        return self._deviation(self.measured, self.simulated)

    @property
    def upstream_ratio(self) -> float | None:
        """Computed over measured mean film upstream of the dimple; None with few points there."""
        x, film = self.measured
        inside = np.abs(x) < 0.8 * self.half_width
        middle = x[inside][np.argmax(film[inside])]
        upstream = inside & (x < middle - UPSTREAM)
        if upstream.sum() < MIN_UPSTREAM_POINTS:
            return None
        computed = np.interp(x[upstream], self.x, self.beside_measured)
        return float(computed.mean() / film[upstream].mean())

    def row(self) -> dict[str, object]:
        """Return the comparison for `--json`."""
        return {
            "experiment": self.experiment.name,
            "run": self.run,
            "profile": self.number,
            "from_measured": self.from_measured,
            "from_simulated": self.from_simulated,
            "simulated_from_measured": self.simulated_from_measured,
            "upstream_ratio": self.upstream_ratio,
        }

    def _deviation(self, reference: Profile, other: Profile) -> float:
        """Return the relative difference inside the Hertz zone and both profiles."""
        (x, film), (other_x, other_film) = reference, other
        kept = (np.abs(x) <= self.half_width) & (x >= other_x[0]) & (x <= other_x[-1])
        difference = np.interp(x[kept], other_x, other_film) - film[kept]
        return float(np.sqrt(np.mean(difference**2)) / film[kept].mean())


def compute_dimples(experiment: DimpleExperiment) -> list[DimpleProfile]:
    """Compute every run of a dimple and compare its profiles.

    Raises
    ------
    BadInput
        for a case without oil.
    NotConverged
        if a time step does not converge.
    """
    profiles = []
    for run in experiment.runs:
        case = experiment.case.with_overrides({"contact.slip": run.slip})
        x, films = _films(case, run)
        half_width = case.conditions.hertz.half_widths[0]
        for number, (measured, simulated) in enumerate(
            zip(run.measured, run.simulated, strict=True), 1
        ):
            profiles.append(
                DimpleProfile(
                    experiment=experiment,
                    run=run.name,
                    number=number,
                    measured=measured,
                    simulated=simulated,
                    half_width=half_width,
                    x=x,
                    films=films,
                )
            )
    return profiles


def _films(case: Case, run: DimpleRun) -> tuple[Field, tuple[Field, ...]]:
    """Return x and the film on the axis at every time step [m]."""
    conditions, lubricant = case.conditions, case.lubricant
    if lubricant is None:
        raise BadInput(f"{run.name}: a dimple needs oil; add [lubricant] to the case")
    surfaces, middle = _surfaces(conditions, run), run.cells[1] // 2
    a, speed, (start, end) = (
        conditions.hertz.half_widths[0],
        conditions.surface_speeds[0],
        run.ends,
    )
    films: list[Field] = []
    for snapshot in moving_contact(conditions, lubricant, surfaces, options=case.options):
        solution = snapshot.solution
        if not solution.convergence.converged:
            raise NotConverged(
                solution, f"{run.name}: time step {snapshot.number} is not solved; change `cells`"
            )
        films.append(solution.gap[:, middle - 1 : middle + 1].mean(axis=1))
        if start * a + speed * snapshot.time > end * a:
            break
    return surfaces.grid.x, tuple(films)


def _surfaces(conditions: ContactConditions, run: DimpleRun) -> MovingSurfaces:
    """Return body 1 with the dimple and a flat body 2."""
    a, (nx, ny) = conditions.hertz.half_widths[0], run.cells
    low, high = (GRID_X[0] * a, GRID_Y[0] * a), (GRID_X[1] * a, GRID_Y[1] * a)
    grid = Grid((nx, ny), low, high, periodic=(False, False))
    end_of_track = low[0] + 2 * nx * grid.spacing[0]
    track = Grid((2 * nx, ny), low, (end_of_track, high[1]), periodic=(True, False))
    distance = np.hypot(track.x[:, None] - run.ends[0] * a, track.y) / (RADIUS_RATIO * run.radius)
    dimple = -run.depth * np.cos(np.pi / 2.0 * distance) * np.exp(-DECAY * distance**2)
    return MovingSurfaces(
        Surface(dimple, track), flat_surface(track), conditions.surface_speeds, grid
    )
