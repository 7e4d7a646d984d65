"""Single-pressure mixed-EHL problem on one grid, dimensionless, and its semismooth linearisation.

Every cell obeys one of four equations, each written so that it grows with the cell's own pressure
P: ruptured P, touching (H - H_c)/k, lubricated R/J, capped P - P_cap; phi = max(min(P, (H - H_c)/k,
R/J), P - P_cap) = 0. R is the cell's net oil outflow, J its derivative, k the compliance of near
cells, H_c the contact film.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
from asperity.ehl.deflection import MIRROR_THROUGH, Deflection, deflection
from asperity.ehl.grid_transfer import AnyField, average, interpolate, mirror_field
from asperity.ehl.inlet_layer import InletLayer
from asperity.ehl.load_shares import within_ellipse
from asperity.ehl.models.transient_term import TransientTerm
from asperity.ehl.roller_profile import BodyShape
from asperity.kernels import face_mobilities, reynolds
from asperity.kernels.reynolds import (
    CAPPED,
    LUBRICATED,
    RUPTURED,
    TOUCHING,
    Faces,
    Film,
    Liquid,
    Rows,
)
from asperity.lubricant import Lubricant

Precision: TypeAlias = type[np.floating]  # of a linearisation

CLOSED_WITHIN = 0.01  # of the contact film, above which a gap still counts as closed
SYMMETRY_TOLERANCE = 1e-6  # relative, about Y = 0: far below the solver's tolerance
# wedge weights of the next and the upstream cell; high orders fail on some rough surfaces
THIRD_ORDER, SECOND_ORDER, FIRST_ORDER = (0.375, 0.125), (0.0, 0.5), (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A contact on one grid, in the solver's units.

    `form` is the bodies' smooth shape and `roughness` their heights above it, shape (nx, ny);
    `load` is the sum of P dX dY; `p_cap` and `contact_gap` bound P above and H below; `speed` is
    the speed number. For the laws of the oil `p_scale` [Pa] converts P to pascals and `sliding`/H
    is the shear rate [1/s]; `viscosity_factor` is the local over the isothermal viscosity, shape
    (nx, ny), None for 1. An aperiodic contact is bounded by lines of cells at ambient pressure, a
    roller by everything outside it. `accurate` selects the third-order wedge and logarithmic mean
    mobilities, `exact` mobilities that are exact for a linear gap, which need a least mobility;
    `conserve` mass-conserving cavitation, of oil that enters as `inlet_layer`. `past` is the time
    derivative, None if steady. `fixed` marks cells, (nx, ny), of given pressure, at a fixed
    approach. If `mirror` is not 0, cells end at the plane Y = 0, MIRROR_BETWEEN two lines of cells
    or MIRROR_THROUGH the last one, and the rest is their image.
    """

    form: BodyShape
    roughness: Field
    lower: tuple[float, float]
    spacing: tuple[float, float]
    load: float
    p_cap: float
    contact_gap: float
    speed: float
    sliding: float
    p_scale: float
    lubricant: Lubricant | None
    viscosity_factor: Field | None = None
    accurate: bool = False
    exact: bool = False
    conserve: bool = False
    inlet_layer: InletLayer | None = None
    past: TransientTerm | None = None
    fixed: Mask | None = None
    mirror: int = 0

    @property
    def cells(self) -> tuple[int, int]:
        """Number of cells (nx, ny)."""
        nx, ny = self.roughness.shape
        return nx, ny

    @property
    def all_cells(self) -> tuple[int, int]:
        """Number of cells including those behind a mirror."""
        nx, ny = self.cells
        return nx, 2 * ny + 1 - self.mirror if self.mirror else ny

    def unfold(self, field: AnyField) -> AnyField:
        """Return a field, (nx', ny'), with its mirror image, of this grid or a coarser one."""
        return mirror_field(field, 2 * field.shape[1] + 1 - self.mirror) if self.mirror else field

    def interpolate(self, field: Field, *, cubic: bool = False) -> Field:
        """Interpolate a coarser grid's field onto this grid, (nx, ny), linearly or `cubic`."""
        finer = interpolate(self.unfold(field), self.all_cells, cubic=cubic)
        return np.ascontiguousarray(finer[:, : self.cells[1]])

    def sum_over_cells(self, field: Field) -> np.floating:
        """Sum a field, (nx, ny), over all cells, including those behind a mirror."""
        total: np.floating = (2.0 if self.mirror else 1.0) * field.sum()
        middle: np.floating = field[:, -1].sum()
        return total - middle if self.mirror == MIRROR_THROUGH else total

    @property
    def mean_pressure(self) -> float:
        """Mean over the whole grid."""
        (nx, ny), (dx, dy) = self.all_cells, self.spacing
        return self.load / (nx * ny * dx * dy)

    @property
    def unfolded(self) -> "Problem":
        """The same contact on all its cells."""
        if not self.mirror:
            return self
        factor = self.viscosity_factor
        return replace(
            self,
            roughness=self.unfold(self.roughness),
            viscosity_factor=None if factor is None else self.unfold(factor),
            mirror=0,
        )

    @property
    def x(self) -> Field:
        """Cell centres along rolling in Hertz half-widths, shape (nx,)."""
        return np.asarray(self.lower[0] + (np.arange(self.cells[0]) + 0.5) * self.spacing[0])

    @property
    def y(self) -> Field:
        """Cell centres across rolling in Hertz half-widths, shape (ny,)."""
        return np.asarray(self.lower[1] + (np.arange(self.cells[1]) + 0.5) * self.spacing[1])

    @cached_property
    def undeformed(self) -> Field:
        """Gap of the rough, undeformed bodies at H0 = 0, shape (nx, ny)."""
        return np.asarray(self.form.gap(self.x, self.y) - self.roughness)

    @cached_property
    def rim(self) -> Mask:
        """Lines of cells along x at ambient pressure, shape (ny,)."""
        fixed = np.zeros(self.cells[1], dtype=bool)
        if not self.form.periodic:
            fixed[[0] if self.mirror else [0, -1]] = True
        if self.form.roller is not None:
            fixed |= self.form.roller.outside(self.y)
        return fixed

    @cached_property
    def _nearest(self) -> np.ndarray | None:
        """Nearest line on the roller for each line of cells; None without ends."""
        if self.form.roller is None:
            return None
        inside = np.flatnonzero(~self.rim)
        return np.asarray(inside[np.abs(np.arange(self.cells[1])[:, None] - inside).argmin(axis=1)])

    @cached_property
    def _ends(self) -> Mask:
        """Lines of cells with an end of the roller on their side of larger y, shape (ny,)."""
        changes = self.rim != np.roll(self.rim, -1)
        return np.asarray(changes & (self.form.roller is not None))

    def filmed(self, gap: Field) -> Field:
        """Return a gap, or its change, with the values of a roller's ends beyond them.

        Oil flows out through the gap at the end.
        """
        return gap if self._nearest is None else gap[:, self._nearest]

    @property
    def deflection(self) -> Deflection:
        """Elastic half-space on this grid."""
        return deflection(
            self.cells, self.spacing, self.form.compliance, self.form.periodic, self.mirror
        )

    @property
    def softness(self) -> float:
        """Compliance of a cell to its own pressure, less that to a far one."""
        compliance = self.deflection.local_compliance
        return float(compliance[0] - compliance[3])

    @property
    def uniform(self) -> bool:
        """True if nothing varies along y, so that one line of cells suffices."""
        fields = self._varying_fields()
        return self.form.periodic and all(bool(np.all(field == field[:, :1])) for field in fields)

    def _varying_fields(self) -> list[Field]:
        """Return what may vary along y, each of shape (_, ny)."""
        fields = [self.roughness]
        if self.viscosity_factor is not None:
            fields.append(self.viscosity_factor)
        if self.inlet_layer is not None:
            fields.append(self.inlet_layer.thickness_at(self.y)[None, :])
        return fields

    @property
    def symmetric(self) -> bool:
        """True if the problem is symmetric about Y = 0: only half of it is then solved."""
        if self.form.periodic or self.form.roller is not None or np.any(self.roughness):
            return False
        (_, ny), dy = self.cells, self.spacing[1]
        even = all(
            np.allclose(field, field[:, ::-1], rtol=SYMMETRY_TOLERANCE, atol=0.0)
            for field in self._varying_fields()
        )
        return even and abs(2.0 * self.lower[1] + ny * dy) < SYMMETRY_TOLERANCE * dy

    def coarsened(self, cells: tuple[int, int]) -> "Problem":
        """Return the contact on a grid of fewer cells, with fields averaged over each cell.

        A mirror stays in the middle of a line or between two, which may change the lines by one.
        """
        (nx, ny), (dx, dy) = self.all_cells, self.spacing
        half = -(-cells[1] // 2)
        cells, kept = (
            (cells, cells[1]) if not self.mirror else ((cells[0], 2 * half + 1 - self.mirror), half)
        )
        roughness, factor = self.unfold(self.roughness), self.viscosity_factor
        return replace(
            self,
            roughness=average(roughness, cells)[:, :kept],
            viscosity_factor=None
            if factor is None
            else average(self.unfold(factor), cells)[:, :kept],
            spacing=(dx * (nx / cells[0]), dy * (ny / cells[1])),
        )

    def zone(self, share: float = 1.0) -> Mask:
        """Return the cells within `share` of the Hertz half-widths, shape (nx, ny).

        At least the central ones.
        """
        if self.form.roller is not None:
            return self.form.roller.zone(self.x, self.y, share, self.spacing)
        return within_ellipse(self.x, self.y, (share, share * self.form.aspect), self.spacing)

    def load_error(self, pressure: Field) -> float:
        """Return the excess of a pressure over the load, relative."""
        dx, dy = self.spacing
        return float(self.sum_over_cells(pressure) * dx * dy / self.load - 1.0)

    def evaluate(self, pressure: Field, approach: float) -> "Balance":
        """Return the residual of every equation at a pressure and a rigid approach H0."""
        gap = self.undeformed + self.deflection(pressure)
        gap += approach
        contact_scale = 1.0 / self.softness
        touching = (gap - self.contact_gap) * contact_scale
        film, faces, fluid = None, None, None
        outflow, fluid_scale = np.zeros_like(pressure), np.ones_like(pressure)
        if self.lubricant is not None:
            wedge = THIRD_ORDER if self.accurate else SECOND_ORDER
            film, faces, outflow, fluid_scale = self.flow(pressure, gap, self.lubricant, wedge)
            fluid = outflow * fluid_scale
        residual, state = self._equations(pressure, touching, fluid)
        if film is not None:  # the film between overlapping bodies does not depend on the approach
            film = film.with_fixed_gap((touching <= 0.0) & (state != LUBRICATED))
        rows = Rows(state, fluid_scale, contact_scale)
        return Balance(self, pressure, gap, residual, rows, film, faces, outflow)

    def _equations(
        self, pressure: Field, touching: Field, fluid: Field | None
    ) -> tuple[Field, Codes]:
        """Return residual and state of each cell from its contact and Reynolds residuals."""
        if fluid is None:
            residual, state = touching.copy(), np.full(pressure.shape, TOUCHING, dtype=np.int8)
        else:
            residual = np.minimum(fluid, touching)
            state = np.where(fluid < touching, np.int8(LUBRICATED), np.int8(TOUCHING))
        ruptured = pressure < residual
        residual[ruptured] = pressure[ruptured]
        state[ruptured] = RUPTURED
        capped = pressure - self.p_cap > residual
        residual[capped] = pressure[capped] - self.p_cap
        state[capped] = CAPPED
        residual[:, self.rim], state[:, self.rim] = pressure[:, self.rim], RUPTURED
        return residual, state

    def flow(
        self,
        pressure: Field,
        gap: Field,
        oil: Lubricant,
        wedge: tuple[float, float],
        least_mobility: float = 0.0,
    ) -> tuple[Film, Faces, Field, Field]:
        """Return film, faces, net outflow of each cell and the inverse of its derivative."""
        gap = self.filmed(gap)
        height = np.maximum(gap, self.contact_gap)
        film = self._film(pressure, height, oil, least_mobility)
        behind = self.cells[1] - self.mirror if self.mirror else 0
        east, north = np.empty((2, 3, *self.cells))
        by_gap = [*np.empty((4, *self.cells))] if self.exact else [*east[1:], *north[1:]]
        inlet = np.empty(self.cells[1])
        faces = Faces._make([*east, *north, inlet, np.array(wedge), *by_gap, behind])
        mean = face_mobilities.MEANS[2 if self.exact else int(self.accurate)]
        face_mobilities.face_mobilities(film, height, mean, self._ends, faces)
        outflow, diagonal = self._outflow(pressure, film, faces, gap)
        return film, faces, outflow, 1.0 / diagonal

    def _film(self, pressure: Field, height: Field, oil: Lubricant, least_mobility: float) -> Film:
        """Return the oil content and the mobility of every cell."""
        pascals = pressure * self.p_scale
        viscosity = oil.viscosity(pascals)
        ambient = height[[0, -1]] ** 3 / self.speed
        if self.viscosity_factor is not None:
            viscosity = viscosity * self.viscosity_factor
            ambient /= self.viscosity_factor[[0, -1]]
        liquid = Liquid(
            oil.density(pascals) / oil.density.rho0,
            oil.density.slope(pascals) * (self.p_scale / oil.density.rho0),
            viscosity,
            oil.viscosity.log_slope(pascals) * self.p_scale,
            *oil.rheology.thinning(viscosity * self.sliding / height),
        )
        film = Film._make([*np.empty((6, *self.cells)), ambient, 3.0 * ambient / height[[0, -1]]])
        least = least_mobility * self.contact_gap**3, 3.0 if self.exact else 0.0
        reynolds.fill_film(liquid, height, oil.viscosity.eta0 / self.speed, least, film)
        return film

    def entering(self, gap: Field) -> Field:
        """Return the content that the surfaces carry in, shape (ny,).

        The inlet is at ambient pressure, where the relative density is 1.
        """
        ahead: Field = self._before_inlet(gap, 1)[0]
        if self.conserve:  # upwind
            return ahead
        return np.asarray(0.5 * (ahead + np.maximum(gap[0], self.contact_gap)))

    def _before_inlet(self, gap: Field, cells: int) -> Field:
        """Return the content some cells upstream of as many first rows, (cells, ny).

        Each parcel of oil has the roughness of its row, which moves with it.
        """
        x = self.x[:cells, None]
        before = x - cells * self.spacing[0]
        filled = np.maximum(gap[:cells] + (before**2 - x**2) / 2.0, self.contact_gap)
        if self.inlet_layer is None or not self.conserve:
            return np.asarray(filled)
        return np.asarray(np.minimum(filled, self.inlet_layer.thickness_at(self.y)))

    def _outflow(
        self, pressure: Field, film: Film, faces: Faces, gap: Field
    ) -> tuple[Field, Field]:
        """Return the net outflow of each cell and its derivative in the cell's own pressure."""
        outflow, diagonal = np.empty_like(pressure), np.empty_like(pressure)
        past, content, spacing = self.past, film.content, self.spacing
        compliance = self.deflection.local_compliance
        if past is not None and past.lagrangian:
            nothing = np.zeros_like(content)
            reynolds.net_outflow(pressure, nothing, faces, nothing[0], *spacing, outflow)
            reynolds.fluid_diagonal(film.without_wedge, faces, compliance, *spacing, diagonal)
            self._add_inflow(past.cells, content, faces, gap, outflow)
        else:
            entering = self.entering(gap)
            reynolds.net_outflow(pressure, content, faces, entering, *spacing, outflow)
            reynolds.fluid_diagonal(film, faces, compliance, *spacing, diagonal)
        if past is not None:
            outflow += past.rate * content + past.source
            # compliance less that of far cells, as in a touching cell: stored oil is as stiff
            diagonal += past.rate * (film.content_by_gap * self.softness + film.content_by_pressure)
        return outflow, diagonal

    def _add_inflow(
        self, cells: int, content: Field, faces: Faces, gap: Field, outflow: Field
    ) -> None:
        """Add the oil that enters at the inlet to the outflow of oil balanced along its path."""
        dx = self.spacing[0]
        if self.conserve:  # along its path from before the inlet on
            outflow[:cells] -= self._before_inlet(gap, cells) / (cells * dx)
        else:
            outflow[0] += (content[0] - self.entering(gap)) / dx
            outflow[1] += (1.0 + faces.wedge[1]) * (content[1] - content[0]) / dx


@dataclass(frozen=True, slots=True)
class Balance:
    """A problem evaluated at one pressure: gap, residual phi, and terms of its linearisation."""

    problem: Problem
    pressure: Field
    # negative where the cap lets the bodies overlap: depth of plastic flattening
    gap: Field
    residual: Field
    rows: Rows
    film: Film | None
    faces: Faces | None
    outflow: Field  # net oil outflow per cell area

    @property
    def load_error(self) -> float:
        """Relative excess of the pressure over the load."""
        return self.problem.load_error(self.pressure)

    @property
    def height(self) -> Field:
        """Gap between the bodies, at least the contact film, (nx, ny)."""
        return np.maximum(self.gap, self.problem.contact_gap)

    @property
    def content(self) -> Field:
        """Oil over each cell, (nx, ny), of a lubricated contact."""
        assert self.film is not None
        return self.film.content

    @property
    def residual_rms(self) -> float:
        """Root mean square of phi, as a share of p_h."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def oil_pressure(self) -> Field:
        """Oil pressure, (nx, ny): the only pressure of this model."""
        return self.pressure

    @property
    def parted(self) -> Mask:
        """Cells in which a film or a cavity separates the bodies."""
        return np.asarray((self.rows.state == LUBRICATED) | (self.rows.state == RUPTURED))

    @property
    def yielded(self) -> Mask:
        """Cells at the cap."""
        return np.asarray(self.rows.state == CAPPED)

    @property
    def in_contact(self) -> Mask:
        """Cells in which the bodies touch: gap at the contact film, or flattened below it.

        Within 1 %, because oil leaves a contact at just that film and may keep it for many cells.
        """
        closed = self.gap <= (1.0 + CLOSED_WITHIN) * self.problem.contact_gap
        return np.asarray((self.rows.state == TOUCHING) | closed)

    @property
    def unknown(self) -> Mask:
        """Lubricated and touching cells, the unknowns of the linear system."""
        return np.asarray((self.rows.state == LUBRICATED) | (self.rows.state == TOUCHING))
