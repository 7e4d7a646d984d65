"""
Film over speed, with the usual fit
===================================

A smooth ball on a disc. Hamrock and Dowson fitted their formula of 1977 to coarse solutions for
thick films. It holds for thick films; for thin films, the solved minimum film at the sides of the
ball is down to half of the fit.
"""

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity import ehl

oil = asp.Lubricant(
    viscosity=asp.Roelands(eta0=0.08, alpha=20e-9),
    density=asp.DowsonHigginson(rho0=870.0),
    rheology=asp.Newtonian(),
)


def ball(speed: float) -> asp.ContactConditions:
    """Return a contact of a 19 mm steel ball rolling on glass."""
    return asp.ContactConditions(
        pair=asp.ElasticPair((210e9, 75e9), (0.3, 0.22)),
        geometry="point",
        radius=9.525e-3,
        load=20.0,
        surface_speeds=(speed, speed),
    )


# %%
# Each speed has its own grid: ``auto_grid`` chooses the inlet length and resolution for the film.
speeds = np.geomspace(0.02, 2.0, 7)
solved, fitted = [], []
for speed in speeds:
    contact = ball(speed)
    grid = ehl.auto_grid(contact, oil, accuracy=0.03)
    state = asp.contact_state(asp.solve_contact(contact, oil, asp.flat_surface(grid)))
    solved.append((state.h_central, state.h_min))
    fits = {fit.place: fit.film for fit in ehl.film_fits(contact, oil) if "Hamrock" in fit.source}
    fitted.append((fits["central"], fits["least"]))

# %%
figure, axis = plt.subplots(figsize=(7, 4.5))
for place, marker, ours, fit in zip(
    ("central", "least"), "os", zip(*solved, strict=True), zip(*fitted, strict=True), strict=True
):
    name = {"central": "central", "least": "minimum"}[place]
    (line,) = axis.loglog(speeds, np.array(fit) * 1e9, label=f"{name}, Hamrock and Dowson")
    axis.loglog(
        speeds, np.array(ours) * 1e9, marker, color=line.get_color(), label=f"{name}, solved"
    )
axis.set(xlabel="rolling speed [m/s]", ylabel="film [nm]")
axis.legend()
for speed, ours, fit in zip(speeds, solved, fitted, strict=True):
    print(
        f"{speed:5.2f} m/s: solved over fit {ours[0] / fit[0]:.2f} for the central film,"
        f" {ours[1] / fit[1]:.2f} for the minimum film"
    )
