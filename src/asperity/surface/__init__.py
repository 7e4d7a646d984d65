"""Rough surfaces: generated, measured, prepared and described."""
