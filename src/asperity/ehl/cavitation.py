"""Mass-conserving cavitation between rigid walls (Jakobsson, Floberg and Olsson).

One signed unknown per cell: s >= 0 is a pressure in a full film, s < 0 the missing share of a
ruptured one (film content 1 + s, no pressure), so that the complementarity always holds. The gap is
given; `asperity.ehl.models.mixed` adds its deformation. Source: H. G. Elrod, J. Lubr. Tech. 103
(1981) 350, for one universal unknown in both regions.
"""

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, NotConverged, require_positive
from asperity.ehl.controls import RIGID_FILM, STEP_LIMITS
from asperity.lubricant import Barus, DensityLaw, Incompressible, ViscosityLaw


@dataclass(frozen=True, slots=True, kw_only=True)
class FilmSolution:
    """An oil film between rigid walls.

    `pressure` [Pa] above the cavitation pressure, `content` (share of the gap that is oil, 0 to 1)
    and `gap` [m] have shape (nx,) or (nx, ny); `flux` [m^2/s], oil through the faces along x at
    ambient density and per width, has one more along x; `spacing` [m]; `steps` of Newton's method.
    """

    pressure: Field
    content: Field
    flux: Field
    gap: Field
    spacing: tuple[float, float]
    steps: int
    residual: float  # largest imbalance of a cell over the largest mean flow through a section

    @property
    def cavitated(self) -> Mask:
        """Cells that are not full of oil."""
        return np.asarray(self.content < 1.0)

    @property
    def load(self) -> float:
        """Load: [N/m] for a line of cells, [N] for a field."""
        area = self.spacing[0] * (self.spacing[1] if self.pressure.ndim == 2 else 1.0)
        return float(self.pressure.sum() * area)

    @property
    def fronts(self) -> tuple[Field, Field]:
        """Rupture and reformation fronts of a line of cells, distances [m] from its start.

        At reformation the last cell that is not full holds more oil than streams through the
        cavity. With no surplus the next cell has no pressure, and a full one is at the onset of
        pressure itself: the front lies between their centres.
        """
        if self.pressure.ndim != 1:
            raise BadInput(
                "fronts exist for a line of cells only, got a field; use one of its lines"
            )
        full = ~self.cavitated
        dx = self.spacing[0]
        ruptures = np.flatnonzero(full[:-1] & ~full[1:]) + 1
        # the last cell that is not full contains the front
        forms = np.flatnonzero(~full[:-1] & full[1:])
        upstream = np.maximum(forms - 1, 0)
        streaming = np.minimum(
            self.content[upstream] * self.gap[upstream] / self.gap[forms], self.content[forms]
        )
        filled = (self.content[forms] - streaming) / (1.0 - streaming)
        return ruptures * dx, (forms + 1.5 - filled) * dx


@dataclass(frozen=True, slots=True, kw_only=True)
class FilmBoundary:
    """Boundary conditions of an oil film; pressures [Pa] above the cavitation pressure.

    Parameters
    ----------
    ends : pressures at inlet and outlet
    sides : pressures along the two sides of a field; None where it is periodic across
    inflow_content : share of the gap at the inlet that is filled with oil
    """

    ends: tuple[float, float] = (0.0, 0.0)
    sides: tuple[float, float] | None = None
    inflow_content: float = 1.0


FLOODED = FilmBoundary()


def solve_film(
    gap: Field,
    *,
    spacing: float | tuple[float, float],
    entrainment_speed: float,
    viscosity: float | ViscosityLaw,
    density: DensityLaw | None = None,
    boundary: FilmBoundary = FLOODED,
    tolerance: float = 1e-11,
    strict: bool = True,
) -> FilmSolution:
    """Solve pressure and content of the oil in a given gap with mass-conserving cavitation.

    Parameters
    ----------
    gap : wall distance [m], shape (nx,) or (nx, ny), x along rolling; steps lie on faces
    spacing : cell size [m], (dx, dy) for a field
    entrainment_speed : mean speed of both walls [m/s], towards larger x
    viscosity : a law, or a constant [Pa s]
    density : a law; None for constant density
    boundary : pressures at the borders and inflow; by default cavitation pressure and a full inlet
    tolerance : bound on the imbalance of any cell, as a share of the flow
    strict : raise when the tolerance is not met; otherwise return the unconverged film

    Raises
    ------
    BadInput
        for an impossible gap, pressure, speed or content.
    NotConverged
        when strict and the tolerance was not met; carries the unconverged film.
    """
    gaps = np.asarray(gap, dtype=float)
    line = gaps.ndim == 1
    dx, dy = (spacing, 1.0) if isinstance(spacing, (int, float)) else spacing
    law = Barus(float(viscosity), 1e-30) if isinstance(viscosity, (int, float)) else viscosity
    channel = RoughChannel(
        gap=gaps[:, None] if line else gaps,
        spacing=(float(dx), float(dy)),
        speed=require_positive("entrainment speed", entrainment_speed, "m/s"),
        viscosity=law,
        density=density or Incompressible(1.0),
        boundary=boundary,
    )
    _check_channel(channel, is_line=line, two_cell_sizes=not isinstance(spacing, (int, float)))
    signed, flows, residual, steps = _solve_newton(channel, tolerance)
    pressure, content = channel.split(signed)
    index = np.s_[:, 0] if line else np.s_[:]
    film = FilmSolution(
        pressure=pressure[index],
        content=content[index],
        flux=flows.along[index],
        gap=gaps,
        spacing=channel.spacing,
        steps=steps,
        residual=residual,
    )
    if strict and not residual < tolerance:
        raise NotConverged(
            film,
            f"film not solved: a cell's imbalance is {residual:.1e} of the flow after {steps} "
            "steps",
        )
    return film


def _solve_newton(channel: "RoughChannel", tolerance: float) -> tuple[Field, "Flows", float, int]:
    """Iterate from a film without pressure; return signed unknown, flows, residual and steps."""
    signed = np.zeros(channel.gap.shape)
    best, stagnation, damping, steps = np.inf, 0, 1.0, 0
    while True:
        flows = channel.flows(signed)
        residual = float(np.max(np.abs(flows.outflow)) / flows.through)
        if residual < tolerance or steps == RIGID_FILM.max_steps or not np.isfinite(residual):
            return signed, flows, residual, steps
        stagnation += 1
        if residual < 0.9 * best:
            best, stagnation, damping = residual, 0, min(1.0, 1.5 * damping)
        elif stagnation == STEP_LIMITS.stagnation_iterations:  # damp alternating cells
            best, stagnation, damping = residual, 0, max(0.5 * damping, STEP_LIMITS.min_damping)
        signed = signed + damping * channel.limit_step(signed, -_newton_step(flows))
        steps += 1


Index: TypeAlias = npt.NDArray[np.intp]


class Cells(NamedTuple):
    """State of each cell, with derivatives in the signed unknown.

    Pressure, content, oil of a full gap, and conductance.
    """

    pressure: Field
    d_pressure: Field
    content: Field
    d_content: Field
    oil: Field
    d_oil: Field
    conductance: Field
    d_conductance: Field


class Flows(NamedTuple):
    """Flows [m^2/s] through the faces along x, and the imbalance of each cell.

    Its derivatives in the signed unknown are matrix entries.
    """

    along: Field
    outflow: Field
    through: float
    rows: Index
    columns: Index
    slopes: Field


@dataclass(frozen=True, slots=True, kw_only=True)
class RoughChannel:
    """A rigid gap, its oil and its boundary conditions."""

    gap: Field
    spacing: tuple[float, float]
    speed: float
    viscosity: ViscosityLaw
    density: DensityLaw
    boundary: FilmBoundary

    @property
    def pressure_scale(self) -> float:
        """Pressure drop per cell whose flow equals that of the walls [Pa]."""
        typical = float(np.exp(np.mean(np.log(self.gap))))
        return 12.0 * self.viscosity.eta0 * self.speed * self.spacing[0] / typical**2

    def split(self, signed: Field) -> tuple[Field, Field]:
        """Return pressure [Pa] and content of a signed unknown."""
        return np.maximum(signed, 0.0) * self.pressure_scale, 1.0 + np.minimum(signed, 0.0)

    def limit_step(self, signed: Field, change: Field) -> Field:
        """Limit a change to the range in which the laws of the oil are nearly linear."""
        steep = (
            self.viscosity.log_slope(np.maximum(signed, 0.0) * self.pressure_scale)
            * self.pressure_scale
        )
        longest = RIGID_FILM.max_log_viscosity_step / np.maximum(steep, 1e-12)
        return np.clip(change, -longest - np.abs(signed), longest + 1.0)

    def _cells(self, signed: Field) -> Cells:
        """Return the state of each cell, with derivatives."""
        pressure, content = self.split(signed)
        full = signed >= 0.0
        d_pressure, d_content = np.where(full, self.pressure_scale, 0.0), np.where(full, 0.0, 1.0)
        density = self.density(pressure) / self.density.rho0
        d_density = self.density.slope(pressure) / self.density.rho0 * d_pressure
        conductance = density * self.gap**3 / (12.0 * self.viscosity(pressure))
        d_conductance = conductance * (
            d_density / density - self.viscosity.log_slope(pressure) * d_pressure
        )
        oil, d_oil = density * self.gap, d_density * self.gap
        return Cells(
            pressure, d_pressure, content, d_content, oil, d_oil, conductance, d_conductance
        )

    def flows(self, signed: Field) -> Flows:
        """Return all flows and their derivatives."""
        cells = self._cells(signed)
        flow, by_left, by_right = self._inner_faces(cells)
        inlet_flow, d_inlet_flow, outlet_flow, d_outlet_flow = self._end_faces(cells)
        along = np.concatenate([inlet_flow[None], flow, outlet_flow[None]])
        diagonal = np.concatenate([by_left, d_outlet_flow[None]])
        diagonal[0] -= d_inlet_flow
        diagonal[1:] -= by_right
        index: Index = np.arange(self.gap.size, dtype=np.intp).reshape(self.gap.shape)
        entries = [
            (index, index, diagonal),
            (index[:-1], index[1:], by_right),
            (index[1:], index[:-1], -by_left),
        ]
        outflow = np.diff(along, axis=0)
        outflow += self._flow_across(cells, index, entries)
        rows, columns = (
            np.concatenate([entry[item].ravel() for entry in entries]) for item in (0, 1)
        )
        slopes = np.concatenate([entry[2].ravel() for entry in entries])
        through = float(np.max(np.abs(along.mean(axis=1))))
        return Flows(along, outflow, through, rows, columns, slopes)

    def _inner_faces(self, cells: Cells) -> tuple[Field, Field, Field]:
        """Return the flow through each inner face, rupturing or not, and both derivatives."""
        left, right = (Cells(*(part[cut] for part in cells)) for cut in (np.s_[:-1], np.s_[1:]))
        flow, by_left, by_right = self._full_faces(left, right)
        to_rupture, d_to_rupture = self._rupturing_faces(left)
        ruptures = to_rupture < flow
        return (
            np.where(ruptures, to_rupture, flow),
            np.where(ruptures, d_to_rupture, by_left),
            np.where(ruptures, 0.0, by_right),
        )

    def _full_faces(self, left: Cells, right: Cells) -> tuple[Field, Field, Field]:
        """Return the flow through faces with a full film and its derivatives in both cells.

        A face joins two half cells of constant gap (exact at steps), with equal flow on both sides.
        """
        u, (half_left, d_half_left) = self.speed, self._half_cells(left)
        half_right, d_half_right = self._half_cells(right)
        total = half_left + half_right
        weight = half_right / total  # weight of the left cell's oil in the face's
        face_oil = weight * left.oil + (1.0 - weight) * right.oil
        joint = weight * half_left
        step = (right.oil - left.oil) / total
        drop = left.pressure - right.pressure
        flow = u * left.content * face_oil + joint * drop
        by_left = (
            u * left.d_content * face_oil
            + u * left.content * (weight * left.d_oil + weight * step * d_half_left)
            + weight**2 * d_half_left * drop
            + joint * left.d_pressure
        )
        by_right = (
            u * left.content * ((1.0 - weight) * right.d_oil - (1.0 - weight) * step * d_half_right)
            + (1.0 - weight) ** 2 * d_half_right * drop
            - joint * right.d_pressure
        )
        return flow, by_left, by_right

    def _rupturing_faces(self, left: Cells) -> tuple[Field, Field]:
        """Return the flow through faces without pressure and its derivative in the left cell."""
        u, (half, d_half) = self.speed, self._half_cells(left)
        flow = u * left.content * left.oil + half * left.pressure
        slope = (
            u * left.d_content * left.oil
            + u * left.content * left.d_oil
            + d_half * left.pressure
            + half * left.d_pressure
        )
        return flow, slope

    def _half_cells(self, cells: Cells) -> tuple[Field, Field]:
        """Return the conductance of half a cell along x and its derivative."""
        dx = self.spacing[0]
        return 2.0 * cells.conductance / dx, 2.0 * cells.d_conductance / dx

    def _end_faces(self, cells: Cells) -> tuple[Field, Field, Field, Field]:
        """Return the flows through inlet and outlet, each with its derivative in the end cell."""
        u, (half, d_half) = self.speed, self._half_cells(cells)
        pressure, d_pressure, content, d_content, oil, d_oil, *_ = cells
        inlet, outlet = self.boundary.ends
        inlet_flow = (
            u
            * self.boundary.inflow_content
            * self.density(np.array(inlet))
            / self.density.rho0
            * self.gap[0]
        )
        inlet_flow = inlet_flow + half[0] * (inlet - pressure[0])
        d_inlet_flow = d_half[0] * (inlet - pressure[0]) - half[0] * d_pressure[0]
        outlet_flow = u * content[-1] * oil[-1] + half[-1] * (pressure[-1] - outlet)
        d_outlet_flow = (
            u * (d_content[-1] * oil[-1] + content[-1] * d_oil[-1])
            + d_half[-1] * (pressure[-1] - outlet)
            + half[-1] * d_pressure[-1]
        )
        return inlet_flow, d_inlet_flow, outlet_flow, d_outlet_flow

    def _flow_across(
        self, cells: Cells, index: Index, entries: list[tuple[Index, Index, Field]]
    ) -> Field:
        """Return the outflow of each cell across, and append its derivatives to `entries`.

        Rows are scaled like those along x.
        """
        flow, by_own, by_next = self._northern_faces(cells)
        outflow = np.zeros_like(flow)
        if self.boundary.sides is not None:
            for part in (flow, by_own, by_next):
                part[:, -1] = 0.0
            half, d_half = self._half_cells_across(cells)
            for column, outside in zip((0, -1), self.boundary.sides, strict=True):
                excess, line = cells.pressure[:, column] - outside, index[:, column]
                outflow[:, column] += half[:, column] * excess
                by_pressure = half[:, column] * cells.d_pressure[:, column]
                entries.append((line, line, d_half[:, column] * excess + by_pressure))
        north = np.roll(index, -1, 1)
        entries += [
            (index, index, by_own),
            (index, north, by_next),
            (north, index, -by_own),
            (north, north, -by_next),
        ]
        return outflow + flow - np.roll(flow, 1, 1)

    def _northern_faces(self, cells: Cells) -> tuple[Field, Field, Field]:
        """Return the flow through each northern face and its derivatives in both its cells."""
        half, d_half = self._half_cells_across(cells)
        north, d_north = np.roll(half, -1, 1), np.roll(d_half, -1, 1)
        joint = half * north / (half + north)
        drop = cells.pressure - np.roll(cells.pressure, -1, 1)
        by_own = (north / (half + north)) ** 2 * d_half * drop + joint * cells.d_pressure
        by_next = (half / (half + north)) ** 2 * d_north * drop
        by_next -= joint * np.roll(cells.d_pressure, -1, 1)
        return joint * drop, by_own, by_next

    def _half_cells_across(self, cells: Cells) -> tuple[Field, Field]:
        """Return the scaled conductance of half a cell along y and its derivative."""
        dy, ratio = self.spacing[1], self.spacing[0] / self.spacing[1]
        return 2.0 * ratio * cells.conductance / dy, 2.0 * ratio * cells.d_conductance / dy


def _newton_step(flows: Flows) -> Field:
    """Solve the linearised equations; NaN if they are singular."""
    size = flows.outflow.size
    matrix = scipy.sparse.csc_array((flows.slopes, (flows.rows, flows.columns)), shape=(size, size))
    try:
        change = scipy.sparse.linalg.splu(matrix).solve(flows.outflow.ravel())
    except RuntimeError:  # singular: the viscosity has overflowed
        return np.full_like(flows.outflow, np.nan)
    return np.asarray(change).reshape(flows.outflow.shape)


def _check_channel(channel: RoughChannel, *, is_line: bool, two_cell_sizes: bool) -> None:
    """Raise BadInput for an impossible channel."""
    gap = channel.gap
    if gap.ndim != 2 or len(gap) < 2:
        raise BadInput(
            f"gap must have shape (nx,) or (nx, ny) with two cells or more along x, got {gap.shape}"
        )
    if is_line == two_cell_sizes:
        expected = "one cell size" if is_line else "(dx, dy)"
        raise BadInput(
            f"spacing must be {expected} for a gap of shape {gap.shape[: 1 if is_line else 2]}"
        )
    if not np.all((gap > 0.0) & (gap < np.inf)):
        raise BadInput(
            f"gap must be positive and finite everywhere, got {np.min(gap):g} m; separate the walls"
        )
    for name, size in zip(("dx", "dy"), channel.spacing, strict=True):
        require_positive(f"spacing {name}", size, "m")
    for name, pressure in (
        ("ends", channel.boundary.ends),
        ("sides", channel.boundary.sides or (0.0, 0.0)),
    ):
        if not all(0.0 <= value < np.inf for value in pressure):
            raise BadInput(
                f"pressures at the {name} must be finite and at least the cavitation pressure, "
                f"0 Pa, got {pressure} Pa"
            )
    if not 0.0 < channel.boundary.inflow_content <= 1.0:
        raise BadInput(
            f"inflow_content must lie between 0 and 1, got {channel.boundary.inflow_content:g}; 1 "
            "is a full gap"
        )
    if channel.boundary.inflow_content < 1.0 and channel.boundary.ends[0] > 0.0:
        raise BadInput(
            "inflow_content must be 1 where the inlet pressure is above the cavitation pressure "
            f"({channel.boundary.ends[0]:g} Pa), got {channel.boundary.inflow_content:g}"
        )
