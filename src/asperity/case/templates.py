"""Case files to start from: every quantity with what it means beside it, in the order in which cases have them."""

CONTACTS = {
    "line": """\
geometry = "line"               # a roller: round along rolling, straight across it
radius = "10 mm"                # 1/R = 1/R1 + 1/R2 of both bodies
length = "10 mm"                # of the roller
load = "500 N"                  # on all of that length
""",
    "point": """\
geometry = "point"              # a ball on a plane, or two balls
radius = "10 mm"                # 1/R = 1/R1 + 1/R2 of both bodies
load = "20 N"
""",
    "elliptic": """\
geometry = "elliptic"           # two crowned bodies
radius = ["10 mm", "25 mm"]     # along rolling, and across it; 1/R = 1/R1 + 1/R2 of both bodies for each
load = "40 N"
""",
    "roller": """\
geometry = "roller"             # a roller that ends: what presses on its edges, where its load lies
radius = "3.63 mm"              # 1/R = 1/R1 + 1/R2 of both bodies
length = "5 mm"                 # of the roller, its chamfers included
load = "1000 N"                 # on all of that length
shape = { design_load = "1500 N", chamfer = "0.2 mm", tilt = "0 mrad" }  # how it falls back along its length
# in place of design_load: iso_diameter = "9 mm", or amplitude and end_drop; also crown_radius and flat
""",
}
MOVES = """\
entrainment_speed = "2 m/s"     # mean of both surfaces' speeds
slip = 0.1                      # (u1 - u2) over that mean
"""
BODIES = """
[material]
youngs_modulus = ["206 GPa", "206 GPa"]
poisson_ratio = [0.3, 0.3]
hardness = "6 GPa"              # pressure that flattens asperities for good; "none": elastic only
boundary_friction = 0.12        # shear over pressure where asperities touch
"""
OIL = """
[lubricant]                     # lubricant = "none", above [contact], is a dry contact
viscosity = { law = "roelands", eta0 = "0.08 Pa s", alpha = "20 1/GPa" }  # at the oil's temperature; cSt x density
density = { law = "dowson-higginson", rho0 = "0.87 g/cm^3" }
rheology = { law = "ree-eyring", tau0 = "5 MPa" }
# by its data sheet, in place of viscosity and density: grade = "VG 100", temperature = "70 degC"
"""
GENERATED = """
[surface]                       # of both bodies together
kind = "gaussian"               # or ground, run-in, sandblasted, self-affine, non-gaussian, flat
sq = "0.3 um"                   # root mean square height
correlation_length = ["30 um", "30 um"]  # along rolling, and across it
seed = 1                        # another seed is another surface of the same kind
"""
MEASURED = """
[surface]
file = "surface.x3p"            # a measured map beside this file: x3p, SDF, OPD, al3d, text ...
form = "quadratic"              # what is taken off before: none, mean, plane, quadratic ...
# unit = "um"                   # of the heights, and
# pixel = ["1 um", "1 um"]      # their distance, for files that do not say
"""
GRID = """
[grid]
cells = "auto"                  # as many as the film asks for; [128, 128] fixes them
"""
SOUND = """
[vibration]                     # a mass on the contact: left out, there is no resonance
mass = "0.1 kg"
damping_ratio = 0.02
"""
MOTION = """
[motion]                        # for `asperity run`: the roughness runs through
steps = 200
"""
STUDY = """
[study]                         # for `asperity study`: what is varied, over a range or a list
sq = { from = "0.2 um", to = "1 um", step = "0.2 um" }
seeds = 3                       # surfaces a point
"""
WEAR = """
[wear]                          # for `asperity wear CASE.toml --hours 10`
law = "archard"                 # or energy, film-defect
k = ["1e-17 1/Pa", "1e-17 1/Pa"]  # of each body; or "mild", "moderate", "severe", which ask for the hardness
flattening = false              # true: what the hardness presses flat stays flat
overrolling = ["50 Hz", "50 Hz"]  # how often a point of each body passes the contact
"""
HEAD = "# A case to start from: change what is yours. `asperity solve` says which value it cannot take, and why.\n\n"
SMOOTH = """
[surface]                       # of both bodies together
kind = "flat"                   # smooth; or gaussian, ground, run-in, sandblasted, self-affine, non-gaussian
"""
KINDS = ("line", "point", "elliptic", "roller", "dry", "measured", "motion", "study", "wear")


def beginning(kind: str) -> str:
    """The text of a case file to start from, of one of `KINDS`."""
    contact = f"[contact]\n{CONTACTS.get(kind, CONTACTS['line'])}{MOVES}"
    parts = [
        HEAD,
        'lubricant = "none"\n\n' if kind == "dry" else "",
        contact,
        BODIES,
        "" if kind == "dry" else OIL,
    ]
    parts += [{"measured": MEASURED, "roller": SMOOTH}.get(kind, GENERATED), GRID, SOUND]
    parts += [{"motion": MOTION, "study": STUDY, "wear": WEAR}.get(kind, "")]
    return "".join(parts)
