"""Geometry of a wearing contact: bodies, tracks, worn surfaces and the positions of a jump."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.simulation.wear.reach import cropped, reached_cells
from asperity.simulation.wear.state import WearState
from asperity.surface import MovingSurfaces, Surface
from asperity.wear import Body, TrackPosition, WearModel, is_uniform_along, positions

MIN_PATCHES = 4
# reference height of smooth contacts, relative to their approach a^2/(2R)
MIN_HEIGHT = 0.1
# standard deviation of the filter of ISO 16610-61 over its cut-off
GAUSS = math.sqrt(0.5 * math.log(2.0)) / math.pi
BODIES = (0, 1)


@dataclass(frozen=True)
class WearingTracks:
    """Bodies and tracks of a case that wears."""

    case: Case
    model: WearModel
    surfaces: MovingSurfaces

    @cached_property
    def overrolling(self) -> tuple[float, float]:
        """Over-rolling frequency of a point of each body [1/s]; 0 for one that stands still."""
        conditions = self.case.conditions
        if self.model.overrolling is not None:
            rates = self.model.overrolling
        else:
            round_trip = 4.0 * math.pi * conditions.radius_along_rolling
            first, second = (abs(speed) / round_trip for speed in conditions.surface_speeds)
            rates = (first, second)
        stationary = [speed == 0.0 for speed in conditions.surface_speeds]
        return 0.0 if stationary[0] else rates[0], 0.0 if stationary[1] else rates[1]

    @cached_property
    def bodies(self) -> tuple[Body, Body]:
        """Material and speed of both bodies."""
        conditions = self.case.conditions
        first, second = (
            Body(
                youngs_modulus=modulus,
                poisson_ratio=ratio,
                hardness=conditions.hardness,
                speed=speed,
            )
            for modulus, ratio, speed in zip(
                conditions.pair.youngs_moduli,
                conditions.pair.poisson_ratios,
                conditions.surface_speeds,
                strict=True,
            )
        )
        return first, second

    @cached_property
    def patches(self) -> int:
        """Positions per jump; one where no body moves along a varying track."""
        if self.model.patches is not None:
            return self.model.patches
        length = self.surfaces.first.grid.extent[0]
        return max(
            MIN_PATCHES, math.ceil(length / self.case.conditions.hertz.half_widths[0] - 1e-9)
        )

    @property
    def seed(self) -> int:
        """Seed of all random numbers: that of the case's surface."""
        return int(getattr(self.case.contents.surface, "seed", 0))

    def perimeter(self, body: int) -> float:
        """Return the length that wears as the track does [m]: circumference, or domain at rest."""
        speed = self.bodies[body].speed
        rate = self.overrolling[body]
        return self.surfaces.first.grid.extent[0] if speed == 0.0 else abs(speed) / rate

    @property
    def width(self) -> float:
        """Width of the wearing track across rolling [m]: a line contact's length, else domain."""
        length = self.case.conditions.length if self.case.conditions.endless else None
        return self.surfaces.grid.extent[1] if length is None else length

    def volume(self, depth: Field, body: int) -> float:
        """Return the volume [m^3], all round the body, of a depth on its track [m]."""
        return float(depth.mean()) * self.perimeter(body) * self.width

    def worn_surfaces(self, state: WearState) -> MovingSurfaces:
        """Return both tracks in their present state."""
        return self.surfaces.lowered(state.lowered(0), state.lowered(1))

    def track(self, state: WearState, body: int) -> tuple[slice, slice]:
        """Return the cells of a body's track in the contact: the Hertz zone, or the larger scar.

        It has all cells along rolling of a body that moves, and all across in a line contact.
        """
        along = transverse = slice(None)
        grid = self.surfaces.grid
        half_widths = self.case.conditions.hertz.half_widths
        if self.bodies[body].speed == 0.0:
            along = reached_cells(state.worn[body].mean(axis=1), grid.x, half_widths[0])
        if not self.case.conditions.endless:
            profile = state.worn[0].mean(axis=0) + state.worn[1].mean(axis=0)[::-1]
            transverse = reached_cells(
                profile + profile[::-1], 0.5 * (grid.y - grid.y[::-1]), half_widths[1]
            )
        return along, transverse

    def levelled(self, state: WearState) -> tuple[Surface, Surface]:
        """Return both tracks' roughness inside the contact, without the form that wear created."""
        surfaces = self.worn_surfaces(state)
        first, second = (
            cropped(
                Surface(surface.heights + self._form(state, body), surface.grid),
                self.track(state, body),
            )
            for body, surface in enumerate((surfaces.first, surfaces.second))
        )
        return first, second

    def _form(self, state: WearState, body: int) -> Field:
        """Return the worn form: a groove's mean profile, or the long waves of a bounded scar.

        If both bodies are smooth, the whole scar is form.
        """
        lowered = state.lowered(body)
        endless = self.case.conditions.endless
        moves = self.bodies[body].speed != 0.0
        if endless and moves:
            return np.zeros_like(lowered)
        if endless or moves:
            return np.broadcast_to(
                lowered.mean(axis=0 if moves else 1, keepdims=True), lowered.shape
            )
        scar = state.worn[body] + state.flattened[body]
        if not any(self.surfaces.rough):
            return np.asarray(scar)
        half_width = self.case.conditions.hertz.half_widths[0]
        spacing = self.surfaces.grid.spacing
        return np.asarray(
            scipy.ndimage.gaussian_filter(
                scar, [GAUSS * half_width / step for step in spacing], mode="nearest"
            )
        )

    def positions(self, state: WearState) -> tuple[TrackPosition, ...]:
        """Return the positions at which the contact is solved in this jump."""
        surfaces = self.worn_surfaces(state)
        tracks = (surfaces.first, surfaces.second)
        # a track that is uniform along rolling needs one position only
        first, second = (
            self.bodies[body].speed != 0.0 and not is_uniform_along(tracks[body].heights)
            for body in BODIES
        )
        cells = (surfaces.first.grid.cells[0], surfaces.second.grid.cells[0])
        count = self.patches if first or second else 1
        return positions(cells, (first, second), count, state.number, self.seed)

    def height(self, state: WearState) -> float:
        """Return the reference height of steps and errors [m]: composite Sq, with a lower bound.

        The bound is MIN_HEIGHT of the approach. The form of a scar is left out for rough bodies.
        """
        conditions = self.case.conditions
        surfaces = self.worn_surfaces(state)
        bodies = (
            self.levelled(state) if any(self.surfaces.rough) else (surfaces.first, surfaces.second)
        )
        approach = conditions.hertz.half_widths[0] ** 2 / (2.0 * conditions.radius_along_rolling)
        return max(math.hypot(*(surface.sq for surface in bodies)), MIN_HEIGHT * approach)
