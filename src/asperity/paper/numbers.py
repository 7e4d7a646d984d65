"""Numbers published by Xu et al., with their place; ours are marked. Wear anchors: anchors.toml."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Citation:
    """Reference of a paper."""

    authors: str
    year: int
    title: str
    journal: str
    place: str
    doi: str


CITATION = Citation(
    authors="Xu, C., Fan, Q., Zhang, Q., Tong, Y., Wang, S., & Wu, T.",
    year=2025,
    title="Vibration-Based Wear Evolution Characterisation of Lubricated Rolling-Sliding Contact",
    journal="Lubricants",
    place="13(2), 78",
    doi="10.3390/lubricants13020078",
)

# Sections 2 and 3: the contact and its vibration
RADIUS, MASS, DAMPING_RATIO = 5.4e-3, 0.1, 0.02
TABLE1_PRINTED = (  # cut-off [Hz], height [um], load [N], CRF [Hz], CRFA [(m/s^2)^2/Hz]
    (30.0, 2.0, 100.0, 2965.45, 2.05),
    (30.0, 2.0, 200.0, 3322.55, 0.64),
    (30.0, 2.0, 300.0, 3573.43, 0.31),
    (30.0, 2.0, 400.0, 3742.52, 0.25),
    (30.0, 1.0, 200.0, 3322.55, 0.16),
    (30.0, 2.0, 200.0, 3322.55, 0.64),
    (30.0, 3.0, 200.0, 3322.55, 1.45),
    (30.0, 4.0, 200.0, 3322.55, 2.58),
    (10.0, 2.0, 200.0, 3322.55, 0.01),
    (20.0, 2.0, 200.0, 3322.55, 0.13),
    (30.0, 2.0, 200.0, 3322.55, 0.64),
    (40.0, 2.0, 200.0, 3322.55, 2.04),
)

# Section 4: the rig, its twelve rings in 4.1, their resonances in 4.2
RIG_LOAD = 500.0  # [N]
SHAFT_HZ = (3375.0 / 60.0, 300.0 / 60.0)  # roller, ring
SAMPLES_SQ_UM = (0.54, 0.87, 1.25, 1.31, 1.64, 1.68, 1.92, 2.17, 2.43, 2.90, 3.06, 3.49)
SAMPLES_STD_UM = (0.10, 0.08, 0.05, 0.05, 0.10, 0.06, 0.10, 0.08, 0.05, 0.05, 0.10, 0.06)
CRF_ENDS_HZ = (2921.93, 3811.88)  # smoothest and roughest sample; the others have no numbers
RIG_SPLIT_UM = (1.68, 1.92)  # onset of severe wear lies between these samples
