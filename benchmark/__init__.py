"""Certified cases and the program that computes them."""
