"""Generated surfaces: statistics over 20 seeds, time, comparison with surfalize, effect of the lay.

docs/theory/surfaces.md quotes the results.
"""

import statistics
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.results import solve_case
from asperity.surface import (
    Surface,
    correlation_lengths,
    gaussian_surface,
    ground_surface,
    level,
    non_gaussian_surface,
    profile_parameters,
    read_surface,
    run_in_surface,
    sandblasted_surface,
    self_affine_surface,
    surface_parameters,
    surface_spectrum,
)

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
MEASURED = Path(__file__).parents[2] / "shared" / "data" / "surfaces"
SEEDS = range(20)
SIDE = 512e-6
LENGTHS = (20e-6, 10e-6)
Maker = Callable[[Grid, np.random.Generator], Surface]

KINDS: dict[str, Maker] = {
    "gaussian": lambda g, r: gaussian_surface(g, sq=1e-6, correlation_length=LENGTHS, rng=r),
    "gaussian, lay at 30°": lambda g, r: gaussian_surface(
        g, sq=1e-6, correlation_length=LENGTHS, direction=np.pi / 6.0, rng=r
    ),
    "non-gaussian, Ssk -1, Sku 5": lambda g, r: non_gaussian_surface(
        g, sq=1e-6, skewness=-1.0, kurtosis=5.0, correlation_length=LENGTHS, rng=r
    ),
    "non-gaussian, Ssk 0, Sku 2": lambda g, r: non_gaussian_surface(
        g, sq=1e-6, skewness=0.0, kurtosis=2.0, correlation_length=LENGTHS, rng=r
    ),
    "non-gaussian, Ssk -2, Sku 9": lambda g, r: non_gaussian_surface(
        g, sq=1e-6, skewness=-2.0, kurtosis=9.0, correlation_length=LENGTHS, rng=r
    ),
    "self-affine, H 0.8": lambda g, r: self_affine_surface(
        g, sq=1e-6, hurst=0.8, cutoffs=(8e-6, 200e-6), rng=r
    ),
    "run-in, plateau 0.4": lambda g, r: run_in_surface(
        g, sq=1e-6, correlation_length=LENGTHS, plateau_share=0.4, rng=r
    ),
    "ground, lay at 30°": lambda g, r: ground_surface(
        g, sq=1e-6, groove_width=12e-6, groove_length=150e-6, direction=np.pi / 6.0, rng=r
    ),
    "sandblasted": lambda g, r: sandblasted_surface(g, sq=1e-6, crater_radius=12e-6, rng=r),
}


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the tables as Markdown."""
    yield (
        "## Generated surfaces, 256 x 256 cells of 2 um, means over 20 seeds (standard deviation)\n"
    )
    yield (
        "| kind | Sq error | 1/e length along, across [um] | Ssk | Sku | seconds at 1024 x 1024 |"
    )
    yield "|---|---|---|---|---|---|"
    for kind, make in KINDS.items():
        yield _row(kind, make)
    yield (
        f"\nSlope of the self-affine spectrum, nominal -3.6: {_slope(0.8):.3f}; nominal -2.6:"
        f" {_slope(0.3):.3f}."
    )
    if not MEASURED.is_dir():
        yield (
            "\nThe measured surfaces are not available here: no comparison with surfalize, no lay."
        )
        return
    yield "\n## Parameters against surfalize: largest difference\n"
    yield from _surfalize_comparison()
    if not fast:
        yield "\n## Lay across and along rolling: measured surfaces in the paper's contact\n"
        yield from _lay()


def _row(kind: str, make: Maker) -> str:
    grid = Grid((256, 256), (0.0, 0.0), (SIDE, SIDE), (True, True))
    direction = np.pi / 6.0 if "30°" in kind else 0.0
    made = [make(grid, np.random.default_rng(seed)) for seed in SEEDS]
    lengths = 1e6 * np.array([correlation_lengths(surface, direction) for surface in made])
    shapes = np.array([(p.ssk, p.sku) for p in map(surface_parameters, made)])
    means, spreads = lengths.mean(axis=0), lengths.std(axis=0)
    off = max(abs(surface.sq / 1e-6 - 1.0) for surface in made)
    fine = Grid((1024, 1024), (0.0, 0.0), (SIDE, SIDE), (True, True))
    seconds = []
    for seed in range(3):
        began = perf_counter()
        make(fine, np.random.default_rng(seed))
        seconds.append(perf_counter() - began)
    moments = [f"{shapes[:, i].mean():.3f} ({shapes[:, i].std():.3f})" for i in range(2)]
    return (
        f"| {kind} | {off:.0e} | {means[0]:.2f} ({spreads[0]:.2f}), {means[1]:.2f}"
        f" ({spreads[1]:.2f}) | {moments[0]} | {moments[1]} | {statistics.median(seconds):.2f} |"
    )


def _slope(hurst: float) -> float:
    grid = Grid((256, 256), (0.0, 0.0), (SIDE, SIDE), (True, True))
    spectra = [
        surface_spectrum(
            self_affine_surface(
                grid, sq=1e-6, hurst=hurst, cutoffs=(8e-6, 200e-6), rng=np.random.default_rng(seed)
            )
        )
        for seed in SEEDS
    ]
    q = spectra[0].wavenumber
    inside = (q > 2.0 * np.pi / 150e-6) & (q < 2.0 * np.pi / 9e-6)
    density = np.mean([spectrum.density for spectrum in spectra], axis=0)
    return float(np.polyfit(np.log(q[inside]), np.log(density[inside]), 1)[0])


def _surfalize_comparison() -> Iterator[str]:
    import surfalize
    from surfalize.profile import Profile

    areal = (
        "sa",
        "sq",
        "ssk",
        "sku",
        "sp",
        "sv",
        "sz",
        "sdq",
        "sdr",
        "sal",
        "str_",
        "sk",
        "spk",
        "svk",
        "smr1",
        "smr2",
    )
    linear = (
        "ra",
        "rq",
        "rsk",
        "rku",
        "rp",
        "rv",
        "rz",
        "rt",
        "rdq",
        "rk",
        "rpk",
        "rvk",
        "rmr1",
        "rmr2",
    )
    scales = dict.fromkeys(("ssk", "sku", "sdq", "str_", "rsk", "rku", "rdq"), 1.0)
    scales |= dict.fromkeys(("sdr", "smr1", "smr2", "rmr1", "rmr2"), 1e-2)

    def worst(ours: object, theirs: Any, names: tuple[str, ...]) -> str:
        off = {}
        for name in names:
            expected = getattr(theirs, name.rstrip("_").capitalize())() * scales.get(name, 1e-6)
            off[name] = abs(getattr(ours, name) / expected - 1.0)
        name = max((name for name in off if off[name] == off[name]), key=off.__getitem__)
        missing = [name for name in off if off[name] != off[name]]
        without = f"; surfalize gives no {missing[0].rstrip('_').capitalize()}" if missing else ""
        return f"{100.0 * off[name]:.2f} % ({name.rstrip('_').capitalize()}){without}"

    for name in ("isotropic.al3d", "ground_lay.plu"):
        levelled, _ = level(read_surface(MEASURED / name), "quadratic")
        dx, dy = (1e6 * pixel for pixel in levelled.grid.spacing)
        heights = 1e6 * (levelled.heights - levelled.heights.mean())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            theirs = surfalize.Surface(heights.T, dx, dy)
            yield f"- {name}: {worst(surface_parameters(levelled), theirs, areal)}"
    stylus, _ = level(read_surface(MEASURED / "stylus_4p8mm.hfm"), "quartic")
    ours = profile_parameters(stylus.profile, stylus.grid.spacing[0])
    theirs = Profile(1e6 * (stylus.profile - stylus.profile.mean()), 1e6 * stylus.grid.spacing[0])
    yield f"- stylus_4p8mm.hfm: {worst(ours, theirs, linear)}"


def _lay() -> Iterator[str]:
    case = load_case(CASE)
    yield (
        "| surface | Sq [um] | lay | CAR [%] | CLR [%] | load on capped oil [%] | oil imbalance [%]"
        " | converged |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for name in ("milled_1.opd", "ground_lay.plu"):
        for sq in (None, "0.5 um", "1 um"):
            for turn, lay in ((False, "across"), (True, "along")):
                surface = {"file": str(MEASURED / name), "turn": turn} | ({"sq": sq} if sq else {})
                run = solve_case(case.with_overrides({"surface": surface}), strict=False)
                state = run.state
                percent = [
                    100.0 * share for share in (state.car, state.clr, state.capped_oil_load_ratio)
                ]
                yield (
                    f"| {name} | {1e6 * state.sq:.3f}{'' if sq else ' as measured'} | {lay} |"
                    f" {percent[0]:.2f} | {percent[1]:.2f} | {percent[2]:.1f} |"
                    f" {100 * state.mass_flux_imbalance:.0f} |"
                    f" {'yes' if run.solution.convergence.converged else 'no'} |"
                )
