"""
A roller's ends
===============

A straight roller has its largest pressure at the ends. A logarithmic profile evens out the pressure
up to its design load; tilt reduces this margin. The contact is solved dry, which is fast: the end
pressure depends on the bodies, hardly on the oil.
"""

import matplotlib.pyplot as plt

import asperity as asp
from asperity import ehl
from asperity.contact import rollers

pair = asp.ElasticPair((206e9, 206e9), (0.3, 0.3))
length, radius = 9e-3, 4.0e-3
log = rollers.RollerShape.iso(9e-3, length)
shapes = {
    "circular crown, 2 m": rollers.RollerShape(crown_radius=2.0),
    "logarithmic (ISO 16281)": log,
    "the same, tilted by 0.5 mrad": log.tilted(0.5e-3),
}

# %%
figure, axis = plt.subplots(figsize=(7, 4))
for name, shape in shapes.items():
    roller = asp.ContactConditions(
        pair=pair,
        geometry="roller",
        radius=radius,
        length=length,
        load=2000.0,
        surface_speeds=(1.0, 1.0),
        shape=shape,
    )
    grid = ehl.auto_grid(roller, None, accuracy=0.05)
    solution = asp.solve_contact(roller, None, asp.flat_surface(grid))
    axis.plot(grid.y * 1e3, solution.pressure.max(axis=0) / 1e9, label=name)
axis.set(
    xlabel="along the roller [mm]", ylabel="largest pressure of each line [GPa]", ylim=(0, None)
)
axis.legend()
