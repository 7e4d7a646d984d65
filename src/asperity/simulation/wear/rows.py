"""Columns of the wear history: roughness of both bodies, and contact; time and wear: `run._row`."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from asperity.case import Case
from asperity.core.coverage import UPPER
from asperity.core.errors import BadInput
from asperity.coupling import excitation, oscillator, resonance_at
from asperity.ehl import ContactState, Sides, Uncertainty
from asperity.results import FrictionInterval, prediction_interval
from asperity.simulation.wear.contact import SolvedPosition
from asperity.surface import Surface, height_parameters

Row = dict[str, float | int]

RESONANCE = {  # end of an interval of CRF: the corresponding end of CLR
    "crf_low_hz": "clr_low",
    "crf_high_hz": "clr_high",
    "crf_mean_low_hz": "clr_mean_low",
    "crf_mean_high_hz": "clr_mean_high",
}
UNITS = ("_m3_s", "_m3", "_m")  # at the end of a column
MIN_SQ = 1e-15  # [m] below which heights are rounding errors

ROUGHNESS = {  # column: field of HeightParameters
    "sq_m": "sq",
    "sa_m": "sa",
    "ssk": "ssk",
    "sku": "sku",
    "sk_m": "sk",
    "spk_m": "spk",
    "svk_m": "svk",
}
STATE = {  # field of ContactState: its column
    "clr": "clr",
    "car": "car",
    "car_domain": "car_domain",
    "capped_oil_load_ratio": "capped_oil_load_ratio",
    "h_min": "h_min_m",
    "h_central": "h_central_m",
    "h_mean": "h_mean_m",
    "p_max": "p_max_pa",
    "contact_slope": "contact_slope",
    "sq": "sq_m",
}


def body_column(key: str, body: int) -> str:
    """Return the column of one body's quantity: `sq_1_m` of `sq_m`."""
    unit = next((unit for unit in UNITS if key.endswith(unit)), "")
    return f"{key.removesuffix(unit)}_{body + 1}{unit}"


def roughness(surfaces: tuple[Surface, Surface]) -> Row:
    """Return Sq, Sa, Ssk, Sku, Sk, Spk and Svk of each body and of their initial superposition.

    A shorter track (of a body at rest) is repeated along the other's. A surface smooth to rounding
    has no skewness or kurtosis.
    """
    first, second = surfaces
    longer = max(surfaces, key=lambda surface: surface.grid.cells[0]).grid
    combined = Surface(
        np.resize(first.heights, longer.cells) + np.resize(second.heights, longer.cells)[:, ::-1],
        longer,
    )
    row: Row = {}
    for surface, name in ((first, 0), (second, 1), (combined, None)):
        parameters = height_parameters(surface)
        rough = parameters.sq > MIN_SQ
        for key, field in ROUGHNESS.items():
            defined = rough or key not in ("ssk", "sku")
            row[key if name is None else body_column(key, name)] = (
                float(getattr(parameters, field)) if defined else math.nan
            )
    return row


def load_share(solved: Sequence[SolvedPosition]) -> Uncertainty:
    """Return CLR over the positions, with the grid's uncertainty and the scatter of positions."""
    shares = [position.state.clr for position in solved]
    errors = [position.state.error.clr for position in solved if position.state.error is not None]

    def mean(sides: list[Sides | None]) -> Sides | None:
        valid = [pair for pair in sides if pair is not None]
        below, above = (
            np.mean(valid, axis=0) if valid and len(valid) == len(sides) else (math.nan, math.nan)
        )
        return None if math.isnan(below) else (float(below), float(above))

    value, scatter = (
        (shares[0], None) if len(shares) < 2 else prediction_interval(shares, share=True)
    )
    return Uncertainty(
        value=float(np.mean(shares)) if len(shares) > 1 else value,
        iteration=mean([error.iteration for error in errors]),
        grid=mean([error.grid for error in errors]),
        surfaces=scatter,
        range=(0.0, 1.0),
    )


def contact_row(case: Case, solved: Sequence[SolvedPosition], sq: float) -> Row:
    """Return the mean contact with intervals of load share and resonance: total and mean.

    `sq` [m] is that of the tracks without the form that wear created.
    """
    share = load_share(solved)
    low, high = share.interval or (math.nan, math.nan)
    flashes = [position.flash_temperature for position in solved]
    row: Row = {"sq_m": sq} | _mean_state(solved)
    shares = [position.state.clr for position in solved]
    std = float(np.std(shares, ddof=1)) / math.sqrt(len(shares)) if len(shares) > 1 else math.nan
    half_width = std * float(scipy.special.stdtrit(max(len(shares) - 1, 1), UPPER))
    of_mean = max(0.0, row["clr"] - half_width), min(1.0, row["clr"] + half_width)
    row |= {
        "clr_low": low,
        "clr_high": high,
        "clr_mean_low": of_mean[0] if len(shares) > 1 else math.nan,
        "clr_mean_high": of_mean[1] if len(shares) > 1 else math.nan,
        **_friction(solved),
        "flash_temperature_max_k": max(flashes) if all(map(math.isfinite, flashes)) else math.nan,
        **_observables(solved),
    }
    return row | _resonance(case, row, std)


def _friction(solved: Sequence[SolvedPosition]) -> Row:
    """Return the mean friction coefficient and its interval: oil, heat, scatter of positions."""
    parts = [FrictionInterval.of_oil(position.friction) for position in solved]
    values = [part.value for part in parts]
    scatter = prediction_interval(values, share=False)[1] if len(values) > 1 else (0.0, 0.0)
    (below, above), heat = np.mean([part.oil for part in parts], axis=0), [p.heat for p in parts]
    interval = FrictionInterval(
        value=float(np.mean(values)),
        oil=(float(below), float(above)),
        heat=float(np.mean(heat)),
        numerical=0.0,
        surfaces=scatter,
    )
    low, high = interval.low, interval.high
    assert low is not None
    assert high is not None
    ends = {"friction_coefficient_low": low, "friction_coefficient_high": high}
    return {"friction_coefficient": interval.value, **ends}


def _observables(solved: Sequence[SolvedPosition]) -> Row:
    """Return the means of what sensors observe; the resistance is that of positions that touch."""
    seen = [position.observables for position in solved]
    resistances = [o.contact_resistance for o in seen if o.contact_resistance is not None]
    return {
        "capacitance_f": float(np.mean([o.capacitance for o in seen])),
        "contact_resistance_ohm": float(np.mean(resistances)) if resistances else math.nan,
        "ultrasonic_reflection": float(np.mean([o.ultrasonic_reflection for o in seen])),
    }


def _mean_state(solved: Sequence[SolvedPosition]) -> Row:
    """Return the mean of each column of `STATE` besides Sq; nan if unknown."""
    row: Row = {}
    for name, key in STATE.items():
        if name == "sq":
            continue
        attributes = (getattr(position.state, name) for position in solved)
        values = [value for value in attributes if value is not None]
        row[key] = float(np.mean(values)) if values else math.nan
    return row


def _resonance(case: Case, row: Row, clr_std: float) -> Row:
    """Return the mean contact's resonance and the height of its line, in closed form.

    `clr_std` is the standard deviation of the mean CLR.
    """
    unknown = dict.fromkeys(("crf_hz", "crf_std_hz", *RESONANCE, "crfa"), math.nan)
    model = case.vibration
    conditions = case.conditions
    state = state_of_row(row)
    if model is None or model.needs_solution:
        return unknown
    try:
        spring = oscillator(state, conditions, model)
        source = excitation(state, conditions, model)
    except BadInput:  # no asperity contact, or no roughness: no spring, or no excitation
        return unknown
    frequency_hz = np.array(spring.natural_frequency_hz)

    def frequency(clr: float) -> float:
        resonance = (
            None
            if math.isnan(clr)
            else resonance_at(min(max(clr, 0.0), 1.0), state, conditions, model)
        )
        return math.nan if resonance is None else resonance

    return {
        "crf_hz": float(frequency_hz),
        "crf_std_hz": 0.5 * (frequency(state.clr + clr_std) - frequency(state.clr - clr_std)),
        **{key: frequency(row[share]) for key, share in RESONANCE.items()},
        "crfa": float(spring.gain(frequency_hz) * source.density(frequency_hz, model.rate_hz)),
    }


def state_of_row(row: Mapping[str, float]) -> ContactState:
    """Return the mean contact state of a row, without convergence data."""
    values = {name: float(row[key]) for name, key in STATE.items()}
    slope = values.pop("contact_slope")
    return ContactState(
        **values,
        lambda_ratio=None,
        reynolds_residual=0.0,
        load_error=0.0,
        mass_flux_imbalance=0.0,
        contact_slope=None if math.isnan(slope) else slope,
        error=None,
    )
