"""Mixed elastohydrodynamic lubrication: dimensionless inside, SI at its border."""
