"""Templates of case files: every quantity with its meaning, in the usual order.

Each is in mixed lubrication as written, the dry one apart.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from asperity.contact.grid import Grid
from asperity.core.files import write_text
from asperity.surface import Surface, ground_surface, write_surface

CONTACTS = {
    "line": """\
geometry = "line"               # cylinders: curved along rolling, straight across it
radius = "10 mm"                # 1/R = 1/R1 + 1/R2 of both bodies
length = "10 mm"                # of the roller
load = "1000 N"                 # total load on that length
""",
    "point": """\
geometry = "point"              # a ball on a plane, or two balls
radius = "10 mm"                # 1/R = 1/R1 + 1/R2 of both bodies
load = "20 N"
""",
    "elliptic": """\
geometry = "elliptic"           # two crowned bodies
radius = ["10 mm", "25 mm"]     # along and across rolling; each 1/R = 1/R1 + 1/R2
load = "40 N"
""",
    "roller": """\
geometry = "roller"             # a roller of finite length, with edge loading
radius = "4.91 mm"              # 12 mm roller on a 54 mm ring; 1/R = 1/R1 + 1/R2
length = "1 mm"                 # of the roller, its chamfers included
load = "100 N"                  # total load on that length
# axial profile; in place of design_load: iso_diameter = "12 mm", or amplitude and end_drop;
# also crown_radius and flat
shape = { design_load = "200 N", chamfer = "0.1 mm", tilt = "0 mrad" }
""",
    "rig": """\
geometry = "line"               # the contact of `asperity rig`
radius = "5.4 mm"               # 12 mm roller on a 108 mm ring; 1/R = 1/R1 + 1/R2
length = "10 mm"                # of the roller
load = "500 N"                  # total load on that length
""",
}
MOVES = """\
entrainment_speed = "1 m/s"     # mean of both surfaces' speeds
slip = 0.1                      # (u1 - u2) over that mean
"""
RIG_MOVES = """\
entrainment_speed = "1.91 m/s"  # mean of both surfaces' speeds
slip = 0.2                      # (u1 - u2) over that mean
"""
MACHINES = {
    "gear": """\
[machine]
kind = "spur-gear"              # or helical-gear, with helix_angle; both external
module = "4.5 mm"
teeth = [16, 24]                # of pinion and wheel, as the next pairs
profile_shift = [0.1817, 0.1715]
tip_diameters = ["82.46 mm", "118.36 mm"]
face_width = "14 mm"
torque = "135 N m"              # on the pinion
speed = "2170 r/min"            # of the pinion
""",
    "bearing": """\
[machine]
designation = "NU 206"          # or 6203 to 6208, 6306 to 6308, NU 205; any other by its kind
clearance = "20 um"             # diametral
radial_load = "4 kN"
speed = "500 r/min"             # of the inner ring
""",
    "cam": """\
[machine]
kind = "cam-roller"             # roller follower; "cam-flat": flat, without roller_radius and slip
base_radius = "18 mm"
lift = "5 mm"                   # harmonic, or lift_table = a file of angles and lifts
half_angle = "70 deg"           # from the nose to the start of lift
roller_radius = "9 mm"
slip = 0.02                     # (u1 - u2) over the mean speed of cam and roller
width = "10 mm"                 # of the contact
speed = "500 r/min"             # of the cam
spring_load = "400 N"           # on the base circle
spring_rate = "60 N/mm"
follower_mass = "0.15 kg"
""",
}
BODIES = """
[material]
youngs_modulus = ["206 GPa", "206 GPa"]
poisson_ratio = [0.3, 0.3]
hardness = "6 GPa"              # pressure that deforms asperities plastically; "none": elastic
boundary_friction = 0.12        # shear over pressure where asperities touch
"""
STEEL = """
[material]
name = "{}"
boundary_friction = 0.12        # shear over pressure where asperities touch
"""
OIL = """
[lubricant]                     # lubricant = "none", above [contact], is a dry contact
# dynamic viscosity at the oil's temperature: kinematic viscosity times density
viscosity = { law = "roelands", eta0 = "0.024 Pa s", alpha = "19 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.85 g/cm^3" }
rheology = { law = "ree-eyring", tau0 = "5 MPa" }
# or an oil's data sheet in place of viscosity and density:
# grade = "VG 100", temperature = "70 degC"
"""
SHEET = """
[lubricant]
grade = "VG 100"                # or viscosity_40 and viscosity_100 of its data sheet
temperature = "{} degC"         # of the oil supplied
rheology = {{ law = "ree-eyring", tau0 = "5 MPa" }}
"""
GENERATED = """
[surface]                       # composite roughness of both bodies
kind = "gaussian"               # or ground, run-in, sandblasted, self-affine, non-gaussian, flat
sq = "{sq}"                   # root mean square height
correlation_length = ["{length}", "{length}"]  # along and across rolling
seed = 1                        # another seed gives another surface of the same kind
"""
MEASURED = """
[surface]
file = "surface.x3p"            # measured map beside this file: x3p, SDF, OPD, al3d, text ...
form = "quadratic"              # form to remove: none, mean, plane, quadratic ...
# unit = "um"                   # of the heights, if the file does not state it
# pixel = ["1 um", "1 um"]      # likewise their spacing
"""
GRID = """
[grid]
cells = "auto"                  # as many as the film needs, or fixed, such as [128, 128]
"""
COARSE = """
[grid]
cells = [64, 32]                # coarse, for a first look; "auto" for numbers to quote
"""
SOUND = """
[vibration]                     # a mass on the contact; without it, no resonance
mass = "0.1 kg"
damping_ratio = 0.02
"""
MOTION = """
[motion]                        # for `asperity run`: the roughness moves
steps = 60
"""
STUDY = """
[study]                         # for `asperity study`: quantities to vary, over a range or a list
sq = { from = "0.3 um", to = "0.9 um", step = "0.2 um" }
seeds = 2                       # surfaces per point
"""
WEAR = """
[wear]                          # for `asperity wear CASE.toml --hours 0.3`
law = "archard"                 # or energy, film-defect
k = ["1e-16 1/Pa", "1e-16 1/Pa"]  # of each body; or "mild", "moderate", "severe" (need hardness)
flattening = false              # true: keep plastic flattening
overrolling = ["8.36 Hz", "7.56 Hz"]  # over-rolling frequency of a point of each body: 20 mm radii
patches = 4                     # positions per jump and
step = 0.2                      # length of a jump: coarse, leave both out for numbers to quote
"""
INFER = """
[infer]                         # for `asperity infer`; a range, a value with its std, or "known"
points = 16                     # contacts solved for the emulator; 256 for numbers to quote
surfaces = 1                    # surfaces per contact; 4 for numbers to quote
cells = [48, 32]                # likewise [64, 64]
sq = { from = "0.3 um", to = "2.4 um" }
correlation_length = "known"
hardness = "known"
eta0 = "known"                  # viscosity at the oil's temperature
alpha = "known"
mass = "known"
damping_ratio = "known"
load = { from = "400 N", to = "600 N" }               # operating range: of the recordings
entrainment_speed = { from = "1 m/s", to = "4 m/s" }  # and of the recommended next one
"""
HEAD = "# Template of a case: adapt its values. `asperity {}` reports invalid ones.\n\n"
STEELS = {"gear": "case-hardened steel"}  # of the others: bearing steel
ROUGHNESS = {  # Sq and correlation length; of the others 0.6 and 25 um
    "gear": ("0.7 um", "20 um"),
    "bearing": ("0.3 um", "20 um"),
    "cam": ("0.3 um", "20 um"),
    "wear": ("1.0 um", "40 um"),
    "track": ("0.7 um", "20 um"),
    "infer": ("1.2 um", "40 um"),
}
SECTIONS = {"motion": MOTION, "study": STUDY, "wear": WEAR, "infer": INFER}
KINDS = (
    *("line", "point", "elliptic", "roller", "dry", "measured"),
    *("motion", "study", "wear", "gear", "bearing", "cam", "track", "infer"),
)
COMMANDS: Mapping[str, tuple[str, ...]] = MappingProxyType(  # that a template is made for
    dict.fromkeys(KINDS, ("solve {case} --out {name}.nc", "report {name}.nc"))
    | dict.fromkeys(MACHINES, ("machine {case} --dry-run", "machine {case} --out {name}"))
    | {
        "motion": ("run {case} --out {name} --report {name}.html",),
        "study": ("study {case} --out {name}", "report {name}"),
        "wear": ("wear {case} --hours 0.3 --out {name} --report {name}.html",),
        "track": (
            "rig --out {name}-recordings --repeats 2 --duration '2 s'",
            "track {name}-recordings --table {name}-recordings/table.csv --case {case} "
            "--report {name}.html",
        ),
        "infer": (
            "rig --out {name}-recordings --samples 1 --repeats 6 --snr 20",
            "infer {name}-recordings --table {name}-recordings/table.csv --case {case} "
            "--report {name}.html",
        ),
    }
)


def case_template(kind: str) -> str:
    """Return the template of a case file, one of `KINDS`.

    Examples
    --------
    >>> from asperity.case import case_template
    >>> case_template("line").splitlines()[0]
    '# Template of a case: adapt its values. `asperity solve` reports invalid ones.'
    """
    sq, length = ROUGHNESS.get(kind, ("0.6 um", "25 um"))
    rough = MEASURED if kind == "measured" else GENERATED.format(sq=sq, length=length)
    if kind in MACHINES:
        steel = STEEL.format(STEELS.get(kind, "through-hardened bearing steel"))
        oil = SHEET.format(70 if kind == "bearing" else 90)
        return "".join([HEAD.format("machine"), MACHINES[kind], steel, oil, rough, SOUND])
    on_the_rig = kind in ("track", "infer")
    contact = CONTACTS["rig"] if on_the_rig else CONTACTS.get(kind, CONTACTS["line"])
    parts = [
        HEAD.format("solve"),
        'lubricant = "none"\n\n' if kind == "dry" else "",
        f"[contact]\n{contact}{RIG_MOVES if on_the_rig else MOVES}",
        BODIES,
        "" if kind == "dry" else OIL,
        rough,
        COARSE if kind in ("motion", "wear") else GRID,
        SOUND,
        SECTIONS.get(kind, ""),
    ]
    return "".join(parts)


def write_template(kind: str, path: Path) -> tuple[Path, ...]:
    """Write the template of a case, and the map that `measured` names; return the files."""
    write_text(path, case_template(kind))
    if kind != "measured":
        return (path,)
    surface = path.parent / "surface.x3p"
    if not surface.exists():
        write_surface(_example_map(), surface)
    return path, surface


def _example_map() -> Surface:
    """Return a surface ground along rolling, 1.6 x 0.8 mm, that stands in for a measured one."""
    grid = Grid((320, 160), (0.0, 0.0), (1.6e-3, 0.8e-3), periodic=(True, True))
    rng = np.random.default_rng(1)
    return ground_surface(grid, sq=0.6e-6, groove_width=40e-6, groove_length=200e-6, rng=rng)
