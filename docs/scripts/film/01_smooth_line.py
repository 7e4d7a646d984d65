"""
Pressure and film of a smooth line contact
==========================================

Oil that thickens under pressure carries the load almost with the pressure of the dry bodies,
Hertz's semi-ellipse. Three features differ: pressure builds up in the inlet, the film narrows at
the outlet, and a pressure spike precedes this constriction.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

# %%
# The paper's contact without its roughness: a steel roller on steel, 50 N/mm, 2 m/s.
contact = asp.ContactConditions(
    pair=asp.ElasticPair((200e9, 200e9), (0.3, 0.3)),
    geometry="line",
    radius=5.4e-3,
    length=10e-3,
    load=500.0,
    surface_speeds=(2.2, 1.8),
)
oil = asp.Lubricant(
    viscosity=asp.Roelands(eta0=0.04, alpha=18.2e-9),
    density=asp.DowsonHigginson(rho0=880.0),
    rheology=asp.Newtonian(),
)

# %%
# Eight cells across are enough, as nothing varies in this direction.
a = contact.hertz.half_widths[0]
grid = asp.Grid((512, 8), lower=(-4 * a, -0.04 * a), upper=(1.6 * a, 0.04 * a))
solution = asp.solve_contact(contact, oil, asp.flat_surface(grid))
state = asp.contact_state(solution)

# %%
# Position is given in half-widths of the Hertz contact.
figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7, 5))
x = grid.x / a
above.plot(x, solution.pressure[:, 0] / 1e9, label="oil")
above.plot(
    x,
    contact.hertz.p_max / 1e9 * np.sqrt(np.clip(1 - x**2, 0, None)),
    "--",
    color="0.4",
    label="dry (Hertz)",
)
above.set(ylabel="pressure [GPa]")
above.legend()
below.plot(x, solution.gap[:, 0] * 1e6)
below.set(xlabel="x / half-width", ylabel="film [µm]", ylim=(0, 1.5))
below.annotate(
    f"{state.h_central * 1e6:.2f} µm", (0, state.h_central * 1e6), (0, 0.75), ha="center"
)
below.annotate(f"{state.h_min * 1e6:.2f} µm", (0.9, state.h_min * 1e6), (1.2, 0.1))
