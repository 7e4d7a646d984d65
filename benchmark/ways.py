"""The methods behind the values of the benchmark: closed forms, quadrature, dense solvers, solvers."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, fsolve

from asperity.benchmark import solver_named
from asperity.contact import hertz
from asperity.contact.conditions import ElasticPair

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.line import Oil, compliance, line_contact

Given = dict[str, Any]
Found = dict[str, float]


def modulus(given: Given) -> float:
    return ElasticPair(
        tuple(given["youngs_modulus_pa"]), tuple(given["poisson_ratio"])
    ).reduced_modulus


def contact_quantities(contact: hertz.HertzContact) -> Found:
    return {"p_max_pa": contact.p_max, "contact_area_m2": contact.area}


def hertz_line(given: Given) -> Found:
    found = hertz.line_contact(given["line_load_n_m"], 1.0, given["radius_m"], modulus(given))
    weighted = 8.0 / (3.0 * np.pi) * found.p_max
    return {
        "p_max_pa": found.p_max,
        "p_weighted_pa": weighted,
        "half_width_m": found.half_widths[0],
    }


def dense_line(given: Given, nodes: int = 1601) -> Found:
    """Solve an elastic line contact by a dense matrix of hat functions and an active set.

    The units do not come from a closed form.
    """
    e, radius, load = modulus(given), given["radius_m"], given["line_load_n_m"]
    scale = np.sqrt(load * radius / e)  # a length of the order of the half-width
    x = np.linspace(-1.6, 1.6, nodes)
    matrix = 2.0 * compliance(x)  # -(2/(pi E*)) ln|x|, pressures in E* scale/R
    shape = x**2 / 2.0
    for amplitude, along, _, phase in given.get("waves", []):
        shape = shape - amplitude * radius / scale**2 * np.cos(
            2.0 * np.pi * along * scale * x + phase
        )
    pressure, active = np.zeros(nodes), np.abs(x) < 1.0
    for _ in range(200):
        inside = np.flatnonzero(active)
        rows = np.block(
            [
                [matrix[np.ix_(inside, inside)], np.ones((inside.size, 1))],
                [np.ones((1, inside.size)), np.zeros((1, 1))],
            ]
        )
        solved = np.linalg.solve(rows, np.append(-shape[inside], 1.0 / (x[1] - x[0])))
        pressure[:] = 0.0
        pressure[inside] = solved[:-1]
        gap = shape + matrix @ pressure + solved[-1]
        following = (pressure > 0.0) | ((gap < -1e-12) & ~active)
        if np.array_equal(following, active):
            break
        active = following
    inside = np.flatnonzero(active)[-4:]
    slope, level = np.polyfit(x[inside] ** 2, pressure[inside] ** 2, 1)
    unit = e * scale / radius
    return {
        "p_max_pa": pressure.max() * unit,
        "p_weighted_pa": (pressure**2).sum() / pressure.sum() * unit,
        "half_width_m": np.sqrt(-level / slope) * scale,
    }


def hertz_point(given: Given) -> Found:
    found = hertz.point_contact(given["load_n"], given["radius_m"], modulus(given))
    return contact_quantities(found) | {
        "p_weighted_pa": 0.75 * found.p_max,
        "half_width_m": found.half_widths[0],
    }


def sneddon(given: Given) -> Found:
    """Solve an axisymmetric contact by quadrature of Sneddon's integrals of the profile's slope."""
    e, radius, load = modulus(given), given["radius_m"], given["load_n"]

    height, length = given.get("rings", (0.0, 1.0))
    number = 2.0 * np.pi / length

    def profile_slope(r: float) -> float:
        return r / radius + height * number * np.sin(number * r)

    def depth(x: float) -> float:
        return x * quad(lambda turn: profile_slope(x * np.sin(turn)), 0.0, np.pi / 2.0)[0]

    def force(a: float) -> float:
        return 2.0 * e * quad(lambda x: depth(a) - depth(x), 0.0, a)[0]

    hertz_a = (0.75 * load * radius / e) ** (1.0 / 3.0)
    a = brentq(lambda a: force(a) / load - 1.0, 0.3 * hertz_a, 3.0 * hertz_a, xtol=1e-16)
    step = 1e-4 * a

    def pressure(r: float) -> float:
        def slope(t: float) -> float:
            return (depth(t + step) - depth(t - step)) / (2.0 * step)

        ends = np.sqrt(a**2 - r**2)
        return e / np.pi * quad(lambda s: slope(np.hypot(r, s)) / np.hypot(r, s), 0.0, ends)[0]

    nodes, weights = np.polynomial.legendre.leggauss(80 if height else 24)
    r = a * np.sqrt((nodes + 1.0) / 2.0)  # even in area
    p = np.array([pressure(distance) for distance in r])
    return {
        "p_max_pa": pressure(0.0),
        "p_weighted_pa": weights @ p**2 / (weights @ p),
        "contact_area_m2": np.pi * a**2,
    }


def hertz_ellipse(given: Given) -> Found:
    return contact_quantities(
        hertz.elliptic_contact(given["load_n"], tuple(given["radius_m"]), modulus(given))
    )


def ellipse_by_chords(given: Given) -> Found:
    """Return the semi-axes whose half-ellipsoid of pressure yields both curvatures.

    The deflection is integrated over chords. The contact has one solution, so the half-ellipsoid
    need not be assumed.
    """
    e, load, (rx, ry) = modulus(given), given["load_n"], given["radius_m"]

    def curvatures(a: float, b: float) -> tuple[float, float]:
        def curvature(axis: float, part: Any) -> float:
            def chord(turn: float) -> float:
                gamma = (np.cos(turn) / a) ** 2 + (np.sin(turn) / b) ** 2
                return 1.0 / (axis**2 * gamma**0.5) - part(turn) ** 2 / (axis**4 * gamma**1.5)

            return (
                quad(chord, 0.0, np.pi, epsabs=0.0, epsrel=1e-11)[0]
                * 1.5
                * load
                / (np.pi * a * b)
                / (2.0 * e)
            )

        return 2.0 * curvature(a, np.cos), 2.0 * curvature(b, np.sin)

    start = np.cbrt(load * np.array([rx, ry]) / e)

    def residuals(logs: np.ndarray) -> np.ndarray:
        x, y = curvatures(*(start * np.exp(logs)))
        return np.array([x * rx - 1.0, y * ry - 1.0])

    a, b = start * np.exp(fsolve(residuals, np.zeros(2), xtol=1e-13))
    p_max = 1.5 * load / (np.pi * a * b)
    return {"p_max_pa": p_max, "contact_area_m2": np.pi * a * b}


def westergaard(given: Given) -> Found:
    """Evaluate Westergaard (1939), Johnson (1985) eqs 13.8 to 13.10, at s = p/p*."""
    s, amplitude = given["pressure_over_full"], given["amplitude_m"]
    mean = s * np.pi * modulus(given) * amplitude / given["wavelength_m"]
    return {
        "p_max_pa": 2.0 * mean / np.sqrt(s),
        "mean_gap_m": amplitude * (1.0 - s + s * np.log(s)),
    }


def dense_wave(given: Given, nodes: int = 800) -> Found:
    """Solve a wave on a periodic half-space by a dense matrix of Fourier terms and an active set."""
    e, length, amplitude = modulus(given), given["wavelength_m"], given["amplitude_m"]
    mean = given["pressure_over_full"] * np.pi * e * amplitude / length
    x = (np.arange(nodes) + 0.5) / nodes
    number = np.fft.fftfreq(nodes, 1.0 / nodes)
    answer = np.zeros(nodes)
    answer[1:] = 2.0 / (e * 2.0 * np.pi * np.abs(number[1:]) / length)
    column = np.fft.ifft(answer).real
    matrix = column[(np.arange(nodes)[:, None] - np.arange(nodes)[None, :]) % nodes]
    shape = amplitude * (1.0 - np.cos(2.0 * np.pi * x))
    active = shape < amplitude
    pressure = np.zeros(nodes)
    for _ in range(400):
        inside = np.flatnonzero(active)
        rows = np.block(
            [
                [matrix[np.ix_(inside, inside)], np.ones((inside.size, 1))],
                [np.full((1, inside.size), length / e / nodes), np.zeros((1, 1))],
            ]
        )
        solved = np.linalg.solve(rows, np.append(-shape[inside], mean * length / e))
        pressure[:] = 0.0
        pressure[inside] = solved[:-1]
        gap = shape + matrix @ pressure + solved[-1]
        following = (pressure > 0.0) | ((gap < -1e-9 * amplitude) & ~active)
        if np.array_equal(following, active):
            break
        active = following
    return {"p_max_pa": pressure.max(), "mean_gap_m": gap.mean()}


def random_waves(sq: float, side: float, seed: int) -> list[list[float]]:
    """Draw twelve waves of two to seven periods over the side; together they have this Sq."""
    assert side > 0.0
    rng = np.random.default_rng(seed)
    waves = [
        (int(rng.integers(2, 7)), int(rng.integers(-6, 7)), rng.uniform(0.0, 2.0 * np.pi))
        for _ in range(12)
    ]
    sizes = np.array([1.0 / (kx**2 + ky**2) ** 0.5 for kx, ky, _ in waves])
    sizes *= sq / np.sqrt((sizes**2).sum() / 2.0)
    return [
        [float(f"{size:.6g}"), kx, ky, round(phase, 6)]
        for size, (kx, ky, phase) in zip(sizes, waves, strict=True)
    ]


def refined(solver: str, given: Given, cells: tuple[int, ...]) -> tuple[Found, Found]:
    """Extrapolate from the last two grids at the order observed on the last three.

    Also returns the difference between the last two grids.
    """
    grids = [solver_named(solver).solve(given, count) for count in cells]
    value, step = {}, {}
    for key in grids[-1]:
        first, second, third = (grid[key] for grid in grids[-3:])
        ratio = (second - first) / (third - second) if third != second else 4.0
        # below 1.5 the grids do not converge: the whole step is the uncertainty
        gain = 1.0 / (ratio - 1.0) if ratio > 1.5 else 1.0
        value[key], step[key] = third + min(gain, 1.0) * (third - second), abs(third - second)
    return value, step


def newton_on_nodes(given: Given, grids: tuple[int, int] = (401, 801)) -> Found:
    """Solve by the tests' dense Newton method, extrapolated at second order."""
    oil, radius, speed = (
        given["oil"],
        given["radius_m"],
        float(np.mean(given["surface_speeds_m_s"])),
    )
    found = hertz.line_contact(given["line_load_n_m"], 1.0, radius, modulus(given))
    a, p_h = found.half_widths[0], found.p_max
    eta0, alpha = oil["eta0_pa_s"], oil["alpha_1_pa"]
    c1, c2 = oil["density_c1_1_pa"] * p_h, oil["density_c2_1_pa"] * p_h
    if oil["viscosity"] == "barus":
        thickening = (lambda p: alpha * p_h * p, lambda p: np.full_like(p, alpha * p_h))
    else:
        scale, q = np.log(eta0) + 9.67, p_h / oil["roelands_p0_pa"]
        z = alpha * oil["roelands_p0_pa"] / scale
        thickening = (
            lambda p: scale * ((1.0 + q * p) ** z - 1.0),
            lambda p: scale * z * q * (1.0 + q * p) ** (z - 1.0),
        )
    laws = Oil(
        *thickening, lambda p: 1.0 + c1 * p / (1.0 + c2 * p), lambda p: c1 / (1.0 + c2 * p) ** 2
    )
    number = 12.0 * eta0 * speed * radius**2 / (a**3 * p_h)
    films = [
        line_contact(given["inlet_half_widths"], given["outlet_half_widths"], nodes, number, laws)
        for nodes in grids
    ]
    unit = a**2 / radius
    return {
        "h_central_m": (4.0 * films[1].central - films[0].central) / 3.0 * unit,
        "h_min_m": (4.0 * films[1].smallest - films[0].smallest) / 3.0 * unit,
    }


def shooting(
    gap: Any, given: Given, start: float, widest_end: float, first: float, narrowest: float
) -> Found:
    """Find the flow at which pressure and its slope vanish together.

    The pressure gradient 12 eta (u h - q)/h^3 is integrated by quadrature.
    """
    eta, u = given["viscosity_pa_s"], given["speed_m_s"]
    points, weights = np.polynomial.legendre.leggauss(400)

    def pressure_gain(flux: float, end: float) -> float:
        x = start + (points + 1.0) / 2.0 * (end - start)
        return (end - start) / 2.0 * weights @ (12.0 * eta * (u * gap(x) - flux) / gap(x) ** 3)

    def rupture(flux: float) -> float:
        return brentq(lambda x: u * gap(x) - flux, narrowest, widest_end, xtol=1e-15)

    least = u * gap(narrowest)
    flux = brentq(
        lambda q: first + pressure_gain(q, rupture(q)),
        1.0001 * least,
        min(1.9 * least, 0.9999 * u * gap(widest_end)),
        xtol=1e-18,
    )
    top = brentq(lambda x: u * gap(x) - flux, start, narrowest, xtol=1e-15)
    x = np.linspace(start, rupture(flux), 4001)
    p = first + np.array([pressure_gain(flux, place) for place in x])
    return {
        "p_max_pa": first + pressure_gain(flux, top),
        "flux_m2_s": flux,
        "load_n_m": float(np.trapezoid(p, x)),
    }


def parabola(given: Given) -> Found:
    length, least = given["length_m"], given["least_m"]
    return shooting(
        lambda x: least * (1.0 + (2.0 * x / length - 1.0) ** 2),
        given,
        0.0,
        length,
        given["pressures_pa"][0],
        length / 2.0,
    )


def journal(given: Given) -> Found:
    c, e, r = given["clearance_m"], given["eccentricity"], given["radius_m"]
    found = shooting(
        lambda x: c * (1.0 + e * np.cos(x / r)), given, 0.0, 2.0 * np.pi * r, 0.0, np.pi * r
    )
    return {key: found[key] for key in ("p_max_pa", "flux_m2_s")}


def sommerfeld(given: Given) -> Found:
    """Substitute 1 + e cos(phi) = (1 - e^2)/(1 - e cos(gamma)); Pinkus and Sternlicht (1961)."""
    c, e, r = given["clearance_m"], given["eccentricity"], given["radius_m"]
    eta, u = given["viscosity_pa_s"], given["speed_m_s"]

    def second(g: float) -> float:
        return (g - e * np.sin(g)) / (1.0 - e**2) ** 1.5

    def third(g: float) -> float:
        return (g * (1.0 + e**2 / 2.0) - 2.0 * e * np.sin(g) + e**2 * np.sin(2.0 * g) / 4.0) / (
            1.0 - e**2
        ) ** 2.5

    def film(g: float) -> float:
        return (1.0 - e**2) / (1.0 - e * np.cos(g))

    end = brentq(
        lambda g: second(g) - film(g) * third(g), np.pi + 1e-6, 2.0 * np.pi - 1e-6, xtol=1e-15
    )
    largest = 12.0 * (second(2.0 * np.pi - end) - film(end) * third(2.0 * np.pi - end))
    return {"p_max_pa": largest * eta * u * r / c**2, "flux_m2_s": u * c * film(end)}
