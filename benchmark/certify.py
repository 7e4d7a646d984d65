"""Writes the cases of the benchmark: each statement, and each value by two ways that share no code.

`python -m benchmark.certify` from the repository's root; it needs the tests' slow twins and tamaas. A value is that of
the first way, the one nearer to exact; its uncertainty is the distance of the two, and at least what is
left open: 1e-9 of it for closed forms, the whole step between the two finest grids for rough contacts, a third of that
step for films and cavities, which settle at second order.
"""

import csv
import sys
import tomllib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from benchmark import ways

HERE = Path(__file__).parent
MOST = 0.02  # of a value, for an uncertainty: what is known worse is not certified

Value = tuple[str, str, tuple[str, float], tuple[str, float], float]  # quantity, unit, two ways, least uncertainty

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
WAVE = BODIES + (
    "Plane strain, z = amplitude cos(2 pi x/wavelength), endless and periodic, pressed on a flat by a mean pressure of "
    "pressure_over_full times pi E* amplitude/wavelength. mean_gap_m: mean of the gap over a wavelength."
)
OILED = BODIES + (
    "Line contact in plane strain: h = h0 + x^2/(2 R) + u(p), d/dx(rho h^3/(12 eta) dp/dx) = um d(rho h)/dx, um the mean of "
    "surface_speeds_m_s, p = 0 at inlet and outlet (in Hertz half-widths from the centre, oil fills the inlet), p >= 0 with "
    "p = dp/dx = 0 where the film ruptures, the integral of p is line_load_n_m. Newtonian, isothermal. barus: eta = eta0 "
    "exp(alpha p). roelands: eta = eta0 exp((ln(eta0/(Pa s)) + 9.67)((1 + p/p0)^z - 1)), z = alpha p0/(ln eta0 + 9.67). "
    "dowson-higginson: rho = rho0 (1 + c1 p/(1 + c2 p)). h_central_m: h at x = 0; h_min_m: least h anywhere."
)
CAVITY = (
    "Rigid walls, d/dx(h^3/(12 eta) dp/dx) = u d(theta h)/dx, u the mean of the walls' speeds, p >= 0, 0 <= theta <= 1, p (1 "
    "- theta) = 0 (Jakobsson, Floberg, Olsson), pressures_pa at both ends. flux_m2_s: the flow u theta h - h^3/(12 eta) dp/dx. "
)
SLIDER = CAVITY + "h = least_m (1 + (2 x/length_m - 1)^2) from 0 to length_m. load_n_m: integral of p."
JOURNAL = CAVITY + "h = clearance_m (1 + eccentricity cos(x/radius_m)) from 0 to 2 pi radius_m, full of oil at x = 0."

STEEL = {"youngs_modulus_pa": [200e9, 200e9], "poisson_ratio": [0.3, 0.3]}


def dry_smooth() -> Iterator[tuple[str, dict[str, Any], list[Value]]]:
    for number, (load, radius) in enumerate(((50e3, 5.4e-3), (400e3, 20e-3))):
        given = {
            "kind": "dry",
            "definition": DRY,
            "geometry": "line",
            "radius_m": radius,
            "line_load_n_m": load,
            **STEEL,
        }
        closed, twin = ways.hertz_line(given), ways.dense_line(given)
        yield (
            f"dry-line-{number + 1}",
            given,
            paired("Hertz, closed form", closed, "dense active set, 1601 nodes", twin),
        )
    for number, (load, radius) in enumerate(((20.0, 10e-3), (500.0, 25e-3))):
        given = {"kind": "dry", "definition": DRY, "geometry": "point", "radius_m": radius, "load_n": load, **STEEL}
        closed, twin = ways.hertz_point(given), ways.sneddon(given)
        yield (
            f"dry-ball-{number + 1}",
            given,
            paired("Hertz, closed form", closed, "Sneddon's integrals by quadrature", twin),
        )
    for number, radii in enumerate(([5e-3, 10e-3], [12e-3, 4e-3], [8e-3, 80e-3])):
        given = {"kind": "dry", "definition": DRY, "geometry": "elliptic", "radius_m": radii, "load_n": 50.0, **STEEL}
        closed, twin = ways.hertz_ellipse(given), ways.ellipse_by_chords(given)
        yield (
            f"dry-ellipse-{number + 1}",
            given,
            paired("Hertz, elliptic integrals", closed, "chords by quadrature", twin),
        )


def dry_waves() -> Iterator[tuple[str, dict[str, Any], list[Value]]]:
    for number, share in enumerate((0.25, 0.5, 0.75)):
        given = {
            "kind": "wave",
            "definition": WAVE,
            "wavelength_m": 1e-4,
            "amplitude_m": 2e-7,
            "pressure_over_full": share,
            **STEEL,
        }
        closed, twin = ways.westergaard(given), ways.dense_wave(given)
        yield (
            f"dry-wave-{number + 1}",
            given,
            paired("Westergaard, closed form", closed, "dense active set, 800 nodes", twin),
        )


def dry_rough() -> Iterator[tuple[str, dict[str, Any], list[Value]]]:
    for number, (sq, seed) in enumerate(((1e-7, 1), (3e-7, 2), (1e-6, 3))):
        given = {"kind": "dry", "definition": ROUGH, "geometry": "point", "radius_m": 10e-3, "load_n": 20.0, **STEEL}
        a = ways.hertz_point(given)["half_width_m"]
        given["side_m"] = 3.2 * a
        given["waves"] = ways.random_waves(sq, given["side_m"], seed)
        (first, step) = ways.only(ways.refined("tamaas", given, (128, 256, 512)), "p_weighted_pa")
        (second, _) = ways.only(ways.refined("asperity", given, (96, 192, 384)), "p_weighted_pa")
        least = step["p_weighted_pa"] / first["p_weighted_pa"]
        told = ("tamaas, 128 to 512 cells", first, "asperity, 96 to 384 cells", second, least)
        yield f"dry-rough-{number + 1}", given, paired(*told)


def smooth_lines() -> Iterator[tuple[str, dict[str, Any], list[Value]]]:
    for number, (law, alpha, speed, inlet, outlet) in enumerate(LINES):
        oil = {"eta0_pa_s": 0.096, "alpha_1_pa": alpha * 1e-9, "viscosity": law, "rho0_kg_m3": 880.0}
        oil |= {"density": "dowson-higginson", "density_c1_1_pa": 0.6e-9, "density_c2_1_pa": 1.7e-9}
        if law == "roelands":
            oil["roelands_p0_pa"] = 1.96e8
        given = {"kind": "ehl", "definition": OILED, "geometry": "line", "radius_m": 5.4e-3, "line_load_n_m": 50e3}
        given |= {"surface_speeds_m_s": [speed, speed], "oil": oil}
        given |= {"inlet_half_widths": inlet, "outlet_half_widths": outlet, **STEEL}
        first = ways.newton_on_nodes(given)
        second, step = ways.refined("asperity", given, (128, 256, 512))
        least = max(step[key] / first[key] for key in first) / 3.0
        told = ("dense Newton on 401 and 801 nodes", first, "asperity, 128 to 512 cells", second, least)
        yield f"ehl-line-{number + 1}", given, paired(*told)


LINES = [
    ("barus", 20.0, 1.91, -3.0, 1.9),
    ("barus", 20.0, 1.91, -4.5, 1.9),
    ("barus", 20.0, 1.91, -8.0, 1.9),
    ("roelands", 18.2, 2.0, -4.0, 2.0),
    ("roelands", 18.2, 2.0, -8.0, 2.5),
    ("barus", 15.0, 1.0, -4.0, 1.9),
    ("roelands", 22.0, 1.0, -8.0, 2.5),
]


def cavities() -> Iterator[tuple[str, dict[str, Any], list[Value]]]:
    slider = {"kind": "slider", "definition": SLIDER, "viscosity_pa_s": 0.039, "speed_m_s": 2.285, "length_m": 76.2e-3}
    wall = {**slider, "shape": "parabola", "least_m": 25.4e-6, "pressures_pa": [3364.14, 0.0]}
    second, step = ways.refined("asperity", wall, (400, 800, 1600))
    first = ways.parabola(wall)
    least = max(step[key] / first[key] for key in first) / 3.0
    told = ("shooting on the flow, quadrature", first, "asperity, 400 to 1600 cells", second, least)
    yield "cavity-parabola", wall, paired(*told)
    for eccentricity in (0.3, 0.6, 0.8):
        given = {
            "kind": "slider",
            "definition": JOURNAL,
            "shape": "journal",
            "viscosity_pa_s": 0.02,
            "speed_m_s": 3.0,
            "radius_m": 25e-3,
        }
        given |= {"clearance_m": 30e-6, "eccentricity": eccentricity, "pressures_pa": [0.0, 0.0]}
        closed, twin = ways.sommerfeld(given), ways.journal(given)
        yield (
            f"cavity-journal-{eccentricity:g}",
            given,
            paired("Sommerfeld, closed form", closed, "shooting on the flow, quadrature", twin),
        )


UNITS = {"_pa": "Pa", "_m2_s": "m^2/s", "_n_m": "N/m", "_m2": "m^2", "_m": "m", "_n": "N"}


def paired(
    first_by: str, first: dict[str, float], second_by: str, second: dict[str, float], least: float = 1e-9
) -> list[Value]:
    """Both ways of every quantity that both have."""
    found = []
    for key in first:
        if key in second:
            unit = next((unit for suffix, unit in UNITS.items() if key.endswith(suffix)), "1")
            found.append((key, unit, (first_by, float(first[key])), (second_by, float(second[key])), least))
    return found


def main(wanted: Collection[str]) -> None:
    """Make the cases whose names begin so, all without any; then the table of all that there are."""
    for family, made in FAMILIES.items():
        if wanted and family not in wanted:
            continue
        for name, given, values in made():
            certified = [entry for value in values if (entry := _certified(name, *value)) is not None]
            text = tomli_w.dumps({**given, "certified": certified})
            (HERE / "cases" / f"{name}.toml").write_text(text, "utf-8")
    with (HERE / "certified.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["case", "quantity", "unit", "value", "uncertainty", "first way", "second way"])
        for path in sorted((HERE / "cases").glob("*.toml")):
            for entry in tomllib.loads(path.read_text("utf-8"))["certified"]:
                told = [entry[key] for key in ("quantity", "unit", "value", "uncertainty")]
                writer.writerow([path.stem, *told, *(way["by"] for way in entry["ways"])])


def _certified(
    name: str, key: str, unit: str, first: tuple[str, float], second: tuple[str, float], least: float
) -> dict[str, Any] | None:
    doubt = max(abs(first[1] - second[1]), least * abs(first[1]))
    kept = doubt <= MOST * abs(first[1])
    sentence = "" if kept else "NOT CERTIFIED"
    print(f"{name:18s} {key:16s} {first[1]:.6e} {second[1]:.6e} {100 * doubt / abs(first[1]):.4f} % {sentence}")
    both = [{"by": by, "value": value} for by, value in (first, second)]
    return {"quantity": key, "unit": unit, "value": first[1], "uncertainty": doubt, "ways": both} if kept else None


FAMILIES = {
    "dry-smooth": dry_smooth,
    "dry-waves": dry_waves,
    "dry-rough": dry_rough,
    "ehl-lines": smooth_lines,
    "cavities": cavities,
}


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main(sys.argv[1:])
