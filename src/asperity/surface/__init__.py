"""Rough surfaces: generated, measured, prepared and described."""

from asperity.surface.bearing import BearingCurve, bearing_curve
from asperity.surface.condition import condition, level
from asperity.surface.generate import gaussian_surface, non_gaussian_surface, run_in_surface, self_affine_surface
from asperity.surface.machined import ground_surface, sandblasted_surface
from asperity.surface.model import MeasuredSurface, Surface, flat_surface
from asperity.surface.parameters import (
    SurfaceDescription,
    SurfaceParameters,
    correlation_lengths,
    describe_surface,
    surface_parameters,
)
from asperity.surface.prepare import CompositeSurface, PreparedSurface, prepare_surface
from asperity.surface.profile import ProfileParameters, profile_parameters
from asperity.surface.read import read_surface
from asperity.surface.spectrum import SurfaceSpectrum, surface_spectrum

__all__ = [
    "BearingCurve",
    "CompositeSurface",
    "MeasuredSurface",
    "PreparedSurface",
    "ProfileParameters",
    "Surface",
    "SurfaceDescription",
    "SurfaceParameters",
    "SurfaceSpectrum",
    "bearing_curve",
    "condition",
    "correlation_lengths",
    "describe_surface",
    "flat_surface",
    "gaussian_surface",
    "ground_surface",
    "level",
    "non_gaussian_surface",
    "prepare_surface",
    "profile_parameters",
    "read_surface",
    "run_in_surface",
    "sandblasted_surface",
    "self_affine_surface",
    "surface_parameters",
    "surface_spectrum",
]
