"""Certified cases, and the program that makes them."""
