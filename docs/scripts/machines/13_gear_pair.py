"""
Contacts along the path of contact of a gear pair
=================================================

Along the path of contact the radius rises and falls, and sliding changes sign at the pitch point.
Two pairs of teeth share the load, except in the middle, where one pair carries it. Each position is
a separate contact with its own film.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity import ehl, machine, machines
from asperity.case import case_template, load_machine

# FZG's gears of type C
gears = machine.SpurGear(
    module=4.5e-3,
    teeth=(16, 24),
    pressure_angle=np.radians(20.0),
    face_width=14e-3,
    torque=135.3,
    speed=2 * np.pi * 2250 / 60,
    profile_shift=(0.1817, 0.1715),
    centre_distance=91.5e-3,
    tip_diameters=(82.5e-3, 118.4e-3),
)
oil = asp.OilSheet(grade="VG 100").lubricant(363.15)
pair = asp.ElasticPair((206e9, 206e9), (0.3, 0.3))

# %%
contacts = gears.contacts(pair)
place = [contact.position * 1e3 for contact in contacts]
film = [
    min(fit.film for fit in ehl.film_fits(contact.conditions(pair), oil) if fit.place == "central")
    for contact in contacts
]
rows = (
    ("line load [N/mm]", [contact.line_load / 1e3 for contact in contacts]),
    ("Hertz pressure [GPa]", [contact.conditions(pair).hertz.p_max / 1e9 for contact in contacts]),
    ("slide-to-roll", [contact.slide_to_roll for contact in contacts]),
    ("central film (fit) [µm]", [1e6 * value for value in film]),
)
figure, axes = plt.subplots(2, 2, sharex=True, figsize=(8, 5.5))
for axis, (label, values) in zip(axes.flat, rows, strict=True):
    axis.plot(place, values, "o-")
    axis.set(ylabel=label)
for contact, x in zip(contacts, place, strict=True):
    axes[0, 0].annotate(
        contact.name, (x, 0.02), xycoords=("data", "axes fraction"), ha="center", fontsize="small"
    )
for axis in axes[1]:
    axis.set(xlabel="along the path of contact [mm]")
figure.tight_layout()

# %%
# A gear pair from a case file, drawn to scale; `asperity machine` solves its contacts.
Path("gear.toml").write_text(case_template("gear"), encoding="utf-8")
machines.machine_conditions(load_machine("gear.toml")).plot()
# sphinx_gallery_thumbnail_number = 2
