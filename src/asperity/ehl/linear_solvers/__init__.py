"""Linear solvers and preconditioners of the Newton steps."""
