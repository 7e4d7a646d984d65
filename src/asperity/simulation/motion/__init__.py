"""Roughness moving through the contact, step by step."""
