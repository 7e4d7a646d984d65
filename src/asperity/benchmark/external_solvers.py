"""Adapters of external solvers: `pip install tamaas`, `pip install ContactMechanics`."""

from abc import ABC, abstractmethod

import numpy as np

from asperity.benchmark.asperity_solver import dry_roughness, pressures
from asperity.benchmark.cases import CaseTable
from asperity.contact.conditions import ElasticPair
from asperity.contact.grid import Grid
from asperity.contact.hertz import elliptic_contact, point_contact
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError


class DryContactSolver(ABC):
    """Dry contact of rough balls, ellipses and periodic waves, in units of a side and E*."""

    name: str
    kinds = ("dry", "wave")

    def solve(self, inputs: CaseTable, cells: int) -> dict[str, float]:
        """Return quantities by key; none for line contacts (mixed periodicity)."""
        modulus = ElasticPair(
            tuple(inputs["youngs_modulus_pa"]), tuple(inputs["poisson_ratio"])
        ).reduced_modulus
        if inputs["kind"] == "wave":
            return self._wave(inputs, cells, modulus)
        return {} if inputs["geometry"] == "line" else self._bounded(inputs, cells, modulus)

    def _bounded(self, inputs: CaseTable, cells: int, modulus: float) -> dict[str, float]:
        load = inputs["load_n"]
        radius = inputs["radius_m"]
        radii = tuple(radius) if isinstance(radius, list) else (radius, radius)
        hertz = (
            elliptic_contact(load, radii, modulus)
            if radii[0] != radii[1]
            else point_contact(load, radius, modulus)
        )
        a, b = hertz.half_widths
        x, y = (inputs["side_m"] / 2.0,) * 2 if "side_m" in inputs else (1.5 * a, 1.5 * b)
        grid = Grid((cells, cells), (-x, -y), (x, y), periodic=(False, False))
        heights = -(grid.x[:, None] ** 2) / (2.0 * radii[0]) - grid.y[None, :] ** 2 / (
            2.0 * radii[1]
        )
        heights = heights + dry_roughness(grid, inputs)
        side = grid.extent[0]
        pressure, _ = self.pressed(
            heights / side, (1.0, grid.extent[1] / side), load / np.prod(grid.extent) / modulus
        )
        return pressures(pressure * modulus, grid.spacing[0] * grid.spacing[1])

    def _wave(self, inputs: CaseTable, cells: int, modulus: float) -> dict[str, float]:
        length = inputs["wavelength_m"]
        amplitude = inputs["amplitude_m"]
        mean = inputs["pressure_over_full"] * np.pi * amplitude / length
        wave = amplitude / length * np.cos(2.0 * np.pi * (np.arange(cells) + 0.5) / cells)
        pressure, gap = self.pressed(np.tile(wave, (cells, 1)), (1.0, 1.0), mean, images=True)
        return {
            "p_max_pa": float(pressure.max() * modulus),
            "mean_gap_m": float(gap.mean() * length),
        }

    @abstractmethod
    def pressed(
        self, heights: Field, sides: tuple[float, float], mean: float, *, images: bool = False
    ) -> tuple[Field, Field]:
        """Return pressure and gap under a mean pressure; with `images` periodic."""


class Tamaas(DryContactSolver):
    """Adapter of tamaas: conjugate gradients by Polonsky and Keer."""

    name = "tamaas"

    def __init__(self) -> None:
        import tamaas

        tamaas.set_log_level(tamaas.LogLevel.error)
        self.tamaas = tamaas

    def pressed(
        self, heights: Field, sides: tuple[float, float], mean: float, *, images: bool = False
    ) -> tuple[Field, Field]:
        """Solve by PolonskyKeerRey, with the kernel dcfft if not periodic."""
        model = self.tamaas.ModelFactory.createModel(
            self.tamaas.model_type.basic_2d, list(sides), list(heights.shape)
        )
        model.E, model.nu = 1.0, 0.0
        solver = self.tamaas.PolonskyKeerRey(model, np.ascontiguousarray(heights), 1e-9)
        if not images:
            self.tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
            solver.setIntegralOperator("dcfft")
        solver.solve(mean)
        gap = np.asarray(model.displacement) - heights
        return np.asarray(model.traction), gap - gap.min()


class ContactMechanics(DryContactSolver):
    """Adapter of ContactMechanics: constrained conjugate gradients."""

    name = "contactmechanics"

    def __init__(self) -> None:
        import ContactMechanics as library
        from ContactMechanics.Factory import make_system

        self.library, self.make_system = library, make_system

    def pressed(
        self, heights: Field, sides: tuple[float, float], mean: float, *, images: bool = False
    ) -> tuple[Field, Field]:
        """Solve with a hard wall on a free or periodic half-space."""
        from SurfaceTopography import Topography

        nx, ny = heights.shape
        kind = (
            self.library.PeriodicFFTElasticHalfSpace
            if images
            else self.library.FreeFFTElasticHalfSpace
        )
        substrate = kind((nx, ny), 1.0, sides)
        topography = Topography(heights, sides, periodic=images)
        system = self.make_system(interaction="hardwall", substrate=substrate, surface=topography)
        area = sides[0] * sides[1]
        result = system.minimize_proxy(external_force=mean * area, pentol=1e-9, maxiter=5000)
        if not result.success:
            raise AsperityError(f"ContactMechanics: {result.message}")
        pressure = np.abs(np.asarray(substrate.force)[:nx, :ny]) * (nx * ny / area)
        gap = np.asarray(result.x)[:nx, :ny] - heights
        return pressure, gap - gap.min()
