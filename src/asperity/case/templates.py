"""Templates of case files: every quantity with its meaning, in the usual order."""

CONTACTS = {
    "line": """\
geometry = "line"               # cylinders: curved along rolling, straight across it
radius = "10 mm"                # 1/R = 1/R1 + 1/R2 of both bodies
length = "10 mm"                # of the roller
load = "500 N"                  # total load on that length
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
radius = "3.63 mm"              # 1/R = 1/R1 + 1/R2 of both bodies
length = "5 mm"                 # of the roller, its chamfers included
load = "1000 N"                 # total load on that length
# axial profile; in place of design_load: iso_diameter = "9 mm", or amplitude and end_drop;
# also crown_radius and flat
shape = { design_load = "1500 N", chamfer = "0.2 mm", tilt = "0 mrad" }
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
hardness = "6 GPa"              # pressure that deforms asperities plastically; "none": elastic
boundary_friction = 0.12        # shear over pressure where asperities touch
"""
OIL = """
[lubricant]                     # lubricant = "none", above [contact], is a dry contact
# dynamic viscosity at the oil's temperature: kinematic viscosity times density
viscosity = { law = "roelands", eta0 = "0.08 Pa s", alpha = "20 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.87 g/cm^3" }
rheology = { law = "ree-eyring", tau0 = "5 MPa" }
# or an oil's data sheet in place of viscosity and density:
# grade = "VG 100", temperature = "70 degC"
"""
GENERATED = """
[surface]                       # composite roughness of both bodies
kind = "gaussian"               # or ground, run-in, sandblasted, self-affine, non-gaussian, flat
sq = "0.3 um"                   # root mean square height
correlation_length = ["30 um", "30 um"]  # along and across rolling
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
SOUND = """
[vibration]                     # a mass on the contact; without it, no resonance
mass = "0.1 kg"
damping_ratio = 0.02
"""
MOTION = """
[motion]                        # for `asperity run`: the roughness moves
steps = 200
"""
STUDY = """
[study]                         # for `asperity study`: quantities to vary, over a range or a list
sq = { from = "0.2 um", to = "1 um", step = "0.2 um" }
seeds = 3                       # surfaces per point
"""
WEAR = """
[wear]                          # for `asperity wear CASE.toml --hours 10`
law = "archard"                 # or energy, film-defect
k = ["1e-17 1/Pa", "1e-17 1/Pa"]  # of each body; or "mild", "moderate", "severe" (need hardness)
flattening = false              # true: keep plastic flattening
overrolling = ["50 Hz", "50 Hz"]  # over-rolling frequency of a point of each body
"""
HEAD = "# Template of a case: adapt its values. `asperity solve` reports invalid ones.\n\n"
SMOOTH = """
[surface]                       # composite roughness of both bodies
kind = "flat"  # smooth; or gaussian, ground, run-in, sandblasted, self-affine, non-gaussian
"""
KINDS = ("line", "point", "elliptic", "roller", "dry", "measured", "motion", "study", "wear")


def case_template(kind: str) -> str:
    """Return the template of a case file, one of `KINDS`.

    Examples
    --------
    >>> from asperity.case import case_template
    >>> case_template("line").splitlines()[0]
    '# Template of a case: adapt its values. `asperity solve` reports invalid ones.'
    """
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
