"""Dry cases: each statement, and each value by two methods."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from benchmark import oiled, ways
from benchmark.values import Value, only, paired, stepped

Made = partial[list[Value]]
Stated = tuple[str, dict[str, Any], Made]

BODIES = "Elastic half-spaces, E* = 1/sum((1 - nu^2)/E), no friction, no adhesion. "
DRY = BODIES + (
    "Gap h = x^2/(2 Rx) + y^2/(2 Ry) + u(p) - delta (a line: x only, u of plane strain), u the surface displacement under "
    "p; p >= 0, h >= 0, p h = 0, the integral of p is the load. Radii along x and y. p_weighted_pa: integral of p^2 over "
    "integral of p. half_width_m of a line's contact."
)
ROUGH = DRY + (
    " Roughness z is taken off the gap (positive towards the other body): z = sum of a cos(2 pi (kx x + ky y)/side_m + "
    "phase) over waves = [a in m, kx, ky, phase in rad], origin in the middle of the contact. Nothing repeats."
)
LINE_WAVES = " z is taken off the gap: z = sum of A cos(2 pi m x + phase) over waves = [A in m, m in 1/m, 0, phase]."
RINGS = " z = A cos(2 pi r/length), rings = [A in m, length in m], r from the centre, is taken off the gap."
WAVE = BODIES + (
    "Plane strain, z = amplitude cos(2 pi x/wavelength), endless and periodic, pressed on a flat by a mean pressure of "
    "pressure_over_full times pi E* amplitude/wavelength. mean_gap_m: mean of the gap over a wavelength."
)
STEEL = {"youngs_modulus_pa": [200e9, 200e9], "poisson_ratio": [0.3, 0.3]}


def smooth() -> Iterator[Stated]:
    common = {"kind": "dry", "definition": DRY}
    for number, (load, radius) in enumerate(((50e3, 5.4e-3), (400e3, 20e-3))):
        given = {**common, "geometry": "line", "radius_m": radius, "line_load_n_m": load, **STEEL}
        both = (
            "Hertz, closed form",
            ways.hertz_line,
            "dense active set, 1601 nodes",
            ways.dense_line,
        )
        yield f"dry-line-{number + 1}", given, partial(_closed, given, *both)
    for number, (load, radius) in enumerate(((20.0, 10e-3), (500.0, 25e-3))):
        given = {**common, "geometry": "point", "radius_m": radius, "load_n": load, **STEEL}
        both = (
            "Hertz, closed form",
            ways.hertz_point,
            "Sneddon's integrals by quadrature",
            ways.sneddon,
        )
        yield f"dry-ball-{number + 1}", given, partial(_closed, given, *both)
    for number, radii in enumerate(([5e-3, 10e-3], [12e-3, 4e-3], [8e-3, 80e-3])):
        given = {**common, "geometry": "elliptic", "radius_m": radii, "load_n": 50.0, **STEEL}
        both = (
            "Hertz, elliptic integrals",
            ways.hertz_ellipse,
            "chords by quadrature",
            ways.ellipse_by_chords,
        )
        yield f"dry-ellipse-{number + 1}", given, partial(_closed, given, *both)


def waves() -> Iterator[Stated]:
    for number, share in enumerate((0.25, 0.5, 0.75)):
        given = {"kind": "wave", "definition": WAVE, "wavelength_m": 1e-4, "amplitude_m": 2e-7}
        given |= {"pressure_over_full": share, **STEEL}
        both = (
            "Westergaard, closed form",
            ways.westergaard,
            "dense active set, 800 nodes",
            ways.dense_wave,
        )
        yield f"dry-wave-{number + 1}", given, partial(_closed, given, *both)


def _closed(given: dict[str, Any], first: str, closed: Any, second: str, twin: Any) -> list[Value]:
    return paired(first, closed(given), second, twin(given))


def wavy_lines() -> Iterator[Stated]:
    for number, (height, length) in enumerate(((2e-7, 40e-6), (5e-8, 15e-6))):
        given = {
            "kind": "dry",
            "definition": DRY + LINE_WAVES,
            "geometry": "line",
            "radius_m": 5.4e-3,
        }
        given |= {"line_load_n_m": 50e3, **STEEL, "waves": [[height, 1.0 / length, 0, 0.0]]}
        yield f"dry-wavy-line-{number + 1}", given, partial(_wavy_line, given)


def _wavy_line(given: dict[str, Any]) -> list[Value]:
    grids = [only(ways.dense_line(given, nodes), "p_weighted_pa") for nodes in (801, 1601, 3201)]
    first = oiled.limit(grids, [4.0, 2.0, 1.0])
    other = ways.refined("asperity", given, (512, 1024, 2048))
    return stepped(
        "dense active set, up to 3201 nodes",
        first,
        "asperity, 512 to 2048 cells",
        other,
        "p_weighted_pa",
    )


def ringed_balls() -> Iterator[Stated]:
    for number, (height, length) in enumerate(((3e-8, 60e-6), (1e-8, 40e-6))):
        given = {
            "kind": "dry",
            "definition": DRY + RINGS,
            "geometry": "point",
            "radius_m": 10e-3,
            "load_n": 20.0,
        }
        given |= {**STEEL, "rings": [height, length]}
        yield f"dry-ringed-ball-{number + 1}", given, partial(_ringed_ball, given)


def _ringed_ball(given: dict[str, Any]) -> list[Value]:
    exact = ways.sneddon(given)
    other = ways.refined("tamaas", given, (128, 256, 512))
    both = (
        "Sneddon's integrals by quadrature",
        (exact, dict.fromkeys(exact, 0.0)),
        "tamaas, 128 to 512 cells",
        other,
    )
    return stepped(*both, "p_weighted_pa")


def rough_balls() -> Iterator[Stated]:
    for number, (sq, seed) in enumerate(((1e-7, 1), (3e-7, 2), (1e-6, 3))):
        given = {
            "kind": "dry",
            "definition": ROUGH,
            "geometry": "point",
            "radius_m": 10e-3,
            "load_n": 20.0,
            **STEEL,
        }
        given["side_m"] = 3.2 * ways.hertz_point(given)["half_width_m"]
        given["waves"] = ways.random_waves(sq, given["side_m"], seed)
        yield f"dry-rough-{number + 1}", given, partial(_rough_ball, given)


def _rough_ball(given: dict[str, Any]) -> list[Value]:
    """Solve by two third-party codes.

    Both assume constant pressure on rectangles, so the whole last step counts as uncertainty.
    """
    first = ways.refined("tamaas", given, (128, 256, 512))
    value, step = ways.refined("contactmechanics", given, (96, 192, 384))
    other = (value, {key: 3.0 * first[1][key] for key in step})
    return stepped(
        "tamaas, 128 to 512 cells",
        first,
        "contactmechanics, 96 to 384 cells",
        other,
        "p_weighted_pa",
    )


FAMILIES = (smooth, waves, wavy_lines, ringed_balls, rough_balls)
