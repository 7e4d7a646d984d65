"""Rough surfaces: generated, measured, prepared and described."""

from asperity.surface.generate import gaussian_surface, self_affine_surface
from asperity.surface.model import MeasuredSurface, Surface, flat_surface
from asperity.surface.parameters import SurfaceDescription, SurfaceParameters, describe_surface, surface_parameters
from asperity.surface.prepare import PreparedSurface, level, prepare_surface
from asperity.surface.read import read_surface

__all__ = [
    "MeasuredSurface",
    "PreparedSurface",
    "Surface",
    "SurfaceDescription",
    "SurfaceParameters",
    "describe_surface",
    "flat_surface",
    "gaussian_surface",
    "level",
    "prepare_surface",
    "read_surface",
    "self_affine_surface",
    "surface_parameters",
]
