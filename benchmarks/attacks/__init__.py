"""Attacks: what is thrown at asperity, and a runner that sees whether it holds. `python -m
benchmarks.attacks`.
"""
