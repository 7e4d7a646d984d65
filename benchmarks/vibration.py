"""The vibration model: Table 1, trends, speed, loss of contact, stiffness of solved contacts.

`python -m benchmarks.vibration` runs this part alone.
"""

import statistics
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp
from scipy.ndimage import uniform_filter1d

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.core.signals import Signal, power_spectrum
from asperity.coupling import VibrationModel, oscillator
from asperity.ehl import solve_contact
from asperity.paper import continuous_crfa, expected_crfa, reproduce_table1
from asperity.solution import contact_state, tangent_stiffness
from asperity.surface import gaussian_surface
from asperity.vibration import (
    ContactOscillator,
    FilteredNoise,
    SurfaceTrack,
    acceleration,
    mass_motion,
)

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
SPRING = ContactOscillator(mass=0.1, stiffness=4.3765e7, damping_ratio=0.02, load=200.0)
LOADS = (100.0, 200.0, 300.0, 400.0)
SQ_UM = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)
SEEDS = (0, 1, 2)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield the tables as Markdown; `fast` omits the solved contacts."""
    yield "## Vibration: the paper's Table 1, preset paper, 200 records per row\n"
    yield from table_lines()
    yield "\n## Vibration: exponent of CRFA over load (100 to 400 N, closed form)\n"
    yield from trend_lines()
    yield "\n## Vibration: speed\n"
    yield from speed_lines()
    yield "\n## Vibration: Hertz's nonlinear spring against its tangent\n"
    yield from nonlinear_lines()
    if not fast:
        yield (
            "\n## Vibration: tangent stiffness of the solved contact, 256 x 256, mean and range of"
            " three surfaces\n"
        )
        yield from stiffness_lines()


def table_lines() -> Iterator[str]:
    yield (
        "| cut-off [Hz] | height [um] | load [N] | CRF [Hz] | published | deviation | CRFA |"
        " 5 to 95 % | published | inside |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for row in reproduce_table1():
        yield (
            f"| {row.cutoff_hz:.0f} | {1e6 * row.height_m:.0f} | {row.load_n:.0f} |"
            f" {row.crf_hz:.2f} | {row.paper_crf_hz:.2f} | {100 * row.crf_deviation:+.2f} % |"
            f" {row.crfa:.3f} | {row.crfa_low:.3f} to {row.crfa_high:.3f} | {row.paper_crfa:.2f} |"
            f" {'yes' if row.within else 'NO'} |"
        )


def trend_lines() -> Iterator[str]:
    yield (
        "| rate [kHz] | bilinear filter (paper) | continuous filter (sound) | continuous filter,"
        " point patch averaged |"
    )
    yield "|---|---|---|---|"
    for rate in (10e3, 20e3, 50e3, 200e3, None):
        figures = []
        for choices in ({"filter": "bilinear"}, {}, {"patch": "point"}):
            model = VibrationModel.preset(
                "paper", mass=0.1, damping_ratio=0.02, **{"filter": "continuous", **choices}
            )
            crfa = [
                (
                    continuous_crfa(model, 30.0, 2e-6, load)
                    if rate is None
                    else expected_crfa(replace(model, rate_hz=rate), 30.0, 2e-6, load)
                )
                for load in LOADS
            ]
            figures.append(f"{np.polyfit(np.log(LOADS), np.log(crfa), 1)[0]:+.3f}")
        yield f"| {'not sampled' if rate is None else f'{rate * 1e-3:g}'} | {' | '.join(figures)} |"


def median_seconds(run: Callable[[], object], times: int = 9) -> float:
    run()
    taken = []
    for _ in range(times):
        began = perf_counter()
        run()
        taken.append(perf_counter() - began)
    return statistics.median(taken)


def speed_lines() -> Iterator[str]:
    million = FilteredNoise(height=2e-6, cutoff_hz=30.0).profile(1_000_000, 20e3, 1)
    exact = median_seconds(lambda: acceleration(SPRING, million))
    yield f"- exact response, a million samples: {exact:.3f} s"
    rk5 = median_seconds(lambda: acceleration(SPRING, million, method="rk5", substeps=8), 3)
    yield f"- Runge-Kutta with 8 sub-steps, a million samples: {rk5:.3f} s"
    nonlinear = median_seconds(
        lambda: acceleration(SPRING, million, method="nonlinear", substeps=8), 3
    )
    yield f"- nonlinear, the same: {nonlinear:.3f} s"

    def noise_to_spectrum() -> object:
        profile = FilteredNoise(height=2e-6, cutoff_hz=30.0).profile(6_000_000, 20e3, 1)
        return power_spectrum(acceleration(SPRING, profile), segment=20_000)

    grid = Grid((512, 128), (-4e-4, -1e-4), (4e-4, 1e-4))
    surface = gaussian_surface(
        grid, sq=1e-6, correlation_length=20e-6, rng=np.random.default_rng(1)
    )

    def surface_to_spectrum() -> object:
        profile = SurfaceTrack.from_surface(surface, 0.42).profile(6_000_000, 20e3, 1)
        return power_spectrum(acceleration(SPRING, profile), segment=20_000)

    yield (
        "- 300 s at 20 kHz, filtered noise to spectrum:"
        f" {median_seconds(noise_to_spectrum, 3):.2f} s"
    )
    yield (
        "- 300 s at 20 kHz, spectrum of the surface to spectrum:"
        f" {median_seconds(surface_to_spectrum, 3):.2f} s"
    )
    few = Signal(million.values[:1000], 20e3, "m")
    reference = acceleration(SPRING, few).values
    error = np.max(np.abs(acceleration(SPRING, few, method="rk5").values - reference)) / np.max(
        np.abs(reference)
    )
    seconds, off = by_solve_ivp(few, reference, 1e-10)
    yield (
        f"- solve_ivp (RK45, rtol 1e-10; error {off:.0e} of the largest acceleration), a million"
        f" samples: {1e3 * seconds:.0f} s, {1e3 * seconds / exact:.0f} times the exact response and"
        f" {1e3 * seconds / rk5:.0f} times Runge-Kutta with 8 sub-steps (error {error:.0e})"
    )


def by_solve_ivp(profile: Signal, reference: np.ndarray, rtol: float) -> tuple[float, float]:
    """Return the seconds for the record and the largest error over the largest acceleration."""
    times = np.arange(profile.values.size) / profile.rate_hz
    slopes = np.diff(profile.values) * profile.rate_hz

    def change(t: float, state: np.ndarray) -> tuple[float, float]:
        r, v = state
        rate = slopes[min(int(t * profile.rate_hz), slopes.size - 1)] - v
        return rate, (SPRING.stiffness * r + SPRING.damping * rate) / SPRING.mass

    began = perf_counter()
    solved = solve_ivp(
        change,
        (0.0, times[-1]),
        (0.0, slopes[0]),
        "RK45",
        times,
        rtol=rtol,
        atol=1e-16,
        max_step=1 / profile.rate_hz,
    )
    seconds = perf_counter() - began
    both_sides = np.convolve(slopes, [0.5, 0.5])
    both_sides[[0, -1]] = slopes[[0, -1]]
    found = (
        SPRING.stiffness * solved.y[0] + SPRING.damping * (both_sides - solved.y[1])
    ) / SPRING.mass
    return seconds, float(np.max(np.abs(found - reference)) / np.max(np.abs(reference)))


def nonlinear_lines() -> Iterator[str]:
    yield "| rms dynamic force, linear | shift of the peak | out of contact |"
    yield "|---|---|---|"
    rate, samples = 50e3, 2_000_000
    kicks = np.cumsum(np.cumsum(np.random.default_rng(5).standard_normal(samples)))
    kicks -= np.linspace(kicks[0], kicks[-1], samples)
    unit = (
        np.std(acceleration(SPRING, Signal(kicks, rate, "m")).values[samples // 50 :]) * SPRING.mass
    )
    for force in (0.1, 0.22, 0.45, 0.89):
        moved = mass_motion(
            SPRING, Signal(kicks * force * 200.0 / unit, rate, "m"), method="nonlinear", substeps=4
        )
        spectrum = power_spectrum(Signal(moved.acceleration, rate, "m/s^2"), segment=20_000)
        highest = spectrum.frequency_hz[np.argmax(uniform_filter1d(spectrum.density, 16))]
        shift = highest / SPRING.natural_frequency_hz - 1.0
        yield f"| {force} F | {100 * shift:+.1f} % | {100 * moved.contact_loss:.1f} % |"


def stiffness_lines() -> Iterator[str]:
    yield (
        "| Sq [um] | CLR [%] | tangent [N/um] | asperities | film | step error of total, split |"
        " CRF tangent [Hz] | CRF paper's law | parallel film | line |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for sq_um in (0.0, *SQ_UM):
        columns = [stiffness_row(sq_um, seed) for seed in (SEEDS if sq_um else SEEDS[:1])]
        yield (
            f"| {sq_um:g} | "
            + " | ".join(mean_and_range(column) for column in zip(*columns, strict=True))
            + " |"
        )


def stiffness_row(sq_um: float, seed: int) -> list[tuple[float, ...]]:
    case = load_case(CASE)
    rough = {"surface.sq": f"{sq_um} um", "surface.seed": seed}
    case = case.with_overrides(rough if sq_um else {"surface": "flat"})
    solution = solve_contact(case.conditions, case.lubricant, case.surface())
    state = contact_state(solution)
    found = tangent_stiffness(solution)
    crf = [np.sqrt(found.total / 0.1) / (2.0 * np.pi)]
    for law in ("hertz-point", "parallel-film", "hertz-line"):
        model = VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law=law)
        no_spring = law != "parallel-film" and state.clr == 0.0
        crf.append(
            np.nan if no_spring else oscillator(state, case.conditions, model).natural_frequency_hz
        )
    micro = 1e-6
    return [
        (100.0 * state.clr,),
        (micro * found.total,),
        (micro * found.asperity,),
        (micro * found.film,),
        (100.0 * abs(found.step_change), 100.0 * abs(found.split_change)),
        *((value,) for value in crf),
    ]


def mean_and_range(values: tuple[tuple[float, ...], ...]) -> str:
    if len(values[0]) == 2:
        return ", ".join(f"{max(value[i] for value in values):.1f} %" for i in range(2))
    numbers = [value[0] for value in values]
    if np.isnan(numbers[0]):
        return "-"
    middle = f"{statistics.mean(numbers):.4g}"
    return middle if len(numbers) == 1 else f"{middle} ({min(numbers):.4g} to {max(numbers):.4g})"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
