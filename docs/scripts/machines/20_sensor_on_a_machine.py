"""
Contact as seen by a sensor on a machine
========================================

A sensor sees a contact through the modes of the machine around it. Each drawing has the motion at
the sensor per height of roughness that passes the contact, at three roughnesses. The share of the
contact in the strain energy of a mode stands at its peak: half of it is how far the frequency moves
with the contact's stiffness. The four structures come with the package, each with a data sheet of
its masses and springs.
"""

import matplotlib.pyplot as plt

from asperity.case import case_template, load_case
from asperity.results import observe_contact, solve_course
from asperity.structure import load_structure

# %%
# A line contact, with 1.25, 1 and 0.8 times its Sq, serves for all four structures.

case = load_case(case_template("line")).with_overrides({"grid.cells": "[96, 96]"})
course = solve_course(case)

# %%
# The paper's rig
# ---------------
# Most of the mode's strain energy is in the bearings between roller and load block.

observe_contact(course, load_structure("paper-rig")).plot()

# %%
# Twin disc
# ---------

observe_contact(course, load_structure("twin-disc")).plot()

# %%
# Gear pair
# ---------
# Below 3 kHz shafts and bearings move; the contact has about 1 % of those modes.

observe_contact(course, load_structure("fzg-gears")).plot()

# %%
# Rotor on roller bearings
# ------------------------

observe_contact(course, load_structure("roller-bearing")).plot()
plt.show()
