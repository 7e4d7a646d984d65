"""Semismooth Newton iterations of each contact model."""
