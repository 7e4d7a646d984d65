"""Regime card: lubrication regime of a solved contact, compared with published film formulas.

`ehl.film_formulas` decides the regime; `results.lubrication_regime` decides full film, mixed or
boundary lubrication, by CLR.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.core.quantities import quantity
from asperity.ehl import (
    ContactSolution,
    FilmNumbers,
    Regime,
    film_fits,
    film_loss,
    film_numbers,
    flooded_inlet,
    hertz_zone,
    inlet_heating_factor,
    inlet_length,
    least_film,
    loss_beyond_body,
    lubrication_regime,
)
from asperity.ehl.film_formulas import Place
from asperity.ehl.grid_design import MIN_CELLS_IN_INLET
from asperity.ehl.load_shares import CENTRE
from asperity.lubricant import Thermal

if TYPE_CHECKING:  # it loads the solver
    from asperity.solution.inlet import InletHeating

_NUMBERS = {  # key in the catalogue -> field
    "speed_number": "speed",
    "load_number": "load",
    "material_number": "material",
    "moes_load": "moes_load",
    "moes_oil": "moes_oil",
}
_PLACES = {"central": "h_central_m", "least": "h_min_m"}  # key in the catalogue
MAX_DEVIATION = 0.25  # of the film from all fits; their authors claim 5 to 15 %
FULL_FILM = 3.0  # film ratio from which roughness does not affect the mean film


@dataclass(frozen=True, slots=True)
class FittedFilm:
    """Film thickness by a published formula and as solved [m].

    If the formula assumes incompressible oil, `solved` is converted to ambient density.
    """

    source: str
    place: Place
    film: float
    solved: float

    @property
    def deviation(self) -> float:
        """Solved film over the fitted one, less 1."""
        return self.solved / self.film - 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RegimeCard:
    """Lubrication regime and dimensionless numbers of a contact.

    Half-widths a and b [m] (only a for a line contact), maximum Hertz pressure [Pa], E' [Pa], the
    dimensionless numbers, the regime, and the film formulas valid there; the last three are None or
    empty for a dry contact. `fits` is also empty for a contact narrower across rolling than along
    it, which no formula covers. Then the film ratio, and Sdq of the roughness in the Hertz zone, on
    which CLR depends more. `comparable` is False if roughness or heat affects the film: the
    formulas hold for smooth bodies and isothermal oil. `inlet_heating_fit` is the published factor
    of inlet shear heating on the film, `inlet_heating` the solved one, if it is computed.
    """

    half_width: float
    half_width_across: float | None
    hertz_pressure: float
    effective_modulus: float
    numbers: FilmNumbers | None
    regime: Regime | None
    fits: tuple[FittedFilm, ...]
    lambda_ratio: float | None
    rms_slope: float
    comparable: bool
    inlet_heating_fit: float | None = None
    inlet_heating: "InletHeating | None" = None

    def to_dict(self) -> dict[str, Any]:
        """Return the card as a dictionary for JSON in SI units; None if undefined."""
        heat = self.inlet_heating
        return {
            "half_width_m": self.half_width,
            "half_width_across_m": self.half_width_across,
            "hertz_pressure_pa": self.hertz_pressure,
            "effective_modulus_pa": self.effective_modulus,
            **{
                key: None if self.numbers is None else getattr(self.numbers, name)
                for key, name in _NUMBERS.items()
            },
            "regime": self.regime,
            "lambda_ratio": self.lambda_ratio,
            "rms_slope": self.rms_slope,
            "inlet_heating_fit": self.inlet_heating_fit,
            "inlet_heating_factor": heat and heat.film_factor,
            "inlet_temperature_rise_k": heat and heat.max_k,
            "fits": [
                {
                    "source": fit.source,
                    "place": fit.place,
                    "film_m": fit.film,
                    "solved_m": fit.solved,
                    "film_deviation": fit.deviation,
                }
                for fit in self.fits
            ],
        }

    def _film_ratio(self) -> str:
        """Return the film ratio with the film that it uses; empty without one."""
        if self.lambda_ratio is None:
            return ""
        least = [fit.film for fit in self.fits if fit.place == "least"]
        film = quantity("film_thickness_m").text(least[0]) if least else "its regime"
        ratio = quantity("lambda_ratio").named(self.lambda_ratio)
        return f"{ratio} (fitted minimum film of {film} over Sq), "

    def rows(self) -> list[tuple[str, str]]:
        """Return the card as named rows in display units."""
        values = self.to_dict()
        pair = [quantity("half_width_m").named(self.half_width)]
        if self.half_width_across is not None:
            pair.append(f"across rolling {quantity('half_width_m').text(self.half_width_across)}")
        hertz = [
            *pair,
            *(
                quantity(key).named(values[key])
                for key in ("hertz_pressure_pa", "effective_modulus_pa")
            ),
        ]
        rows = [("Hertz zone", ", ".join(hertz))]
        if self.rms_slope > 0.0:
            slope = quantity("rms_slope").named(self.rms_slope)
            rows.append(("roughness", f"{self._film_ratio()}{slope}"))
        if self.numbers is None:
            return rows
        numbers = ", ".join(quantity(key).named(values[key]) for key in _NUMBERS)
        rows += [("regime", str(self.regime)), ("dimensionless numbers", numbers)]
        rows.append(("inlet shear heating", self._inlet()))
        return rows + [
            (f"fitted {quantity(_PLACES[fit.place]).name}, {fit.source}", self._fitted(fit))
            for fit in self.fits
        ]

    def _inlet(self) -> str:
        """Return the effect of inlet shear heating on the film, as solved and by the fit."""
        assert self.inlet_heating_fit is not None  # of a lubricated contact
        fit = quantity("inlet_heating_fit").named(self.inlet_heating_fit)
        heat = self.inlet_heating
        if heat is None:
            return f"not computed, {fit}"
        solved = quantity("inlet_heating_factor").named(heat.film_factor)
        return f"{solved}, {quantity('inlet_temperature_rise_k').named(heat.max_k)}, {fit}"

    def _fitted(self, fit: FittedFilm) -> str:
        """Return a fitted film, beside the solved one where they are comparable."""
        film = quantity("film_thickness_m")
        if not self.comparable:
            return f"{film.text(fit.film)}, of smooth bodies and isothermal oil"
        deviation = quantity("film_deviation").text(fit.deviation)
        return f"{film.text(fit.film)}; solved {film.text(fit.solved)}, {deviation}"


def regime_card(
    solution: ContactSolution,
    thermal: Thermal | None = None,
    inlet: "InletHeating | None" = None,
) -> RegimeCard:
    """Return the regime card of a solved contact.

    `thermal` (default `Thermal()`) sets the published factor of inlet shear heating; `inlet` is the
    solved one, if it is computed.
    """
    conditions = solution.conditions
    lubricant = solution.lubricant
    hertz = solution.conditions.hertz
    a, b = hertz.half_widths
    regime = None if lubricant is None else lubrication_regime(conditions, lubricant)
    central, density = _central(
        solution, at_the_peak=regime in ("isoviscous-rigid", "piezoviscous-rigid")
    )
    solved = {"central": central, "least": float(solution.gap.min())}
    return RegimeCard(
        half_width=a,
        half_width_across=None if conditions.long else b,
        hertz_pressure=hertz.p_max,
        effective_modulus=conditions.pair.effective_modulus,
        numbers=None if lubricant is None else film_numbers(conditions, lubricant),
        regime=regime,
        lambda_ratio=film_ratio(solution),
        rms_slope=rms_slope(solution),
        comparable=_full_film(solution),
        inlet_heating_fit=None
        if lubricant is None
        else inlet_heating_factor(conditions, lubricant, thermal or Thermal()),
        inlet_heating=inlet,
        fits=()
        if lubricant is None
        else tuple(
            FittedFilm(
                fit.source,
                fit.place,
                fit.film,
                solved[fit.place] * (density if fit.incompressible else 1.0),
            )
            for fit in film_fits(conditions, lubricant)
        ),
    )


def rms_slope(solution: ContactSolution) -> float:
    """Return the root mean square gradient Sdq of the roughness in the Hertz zone, on the grid."""
    zone = hertz_zone(solution.conditions, solution.grid)
    heights = np.where(zone, solution.surface.heights, np.nan)
    steps = (np.diff(heights, axis=axis) / solution.grid.spacing[axis] for axis in (0, 1))
    return math.sqrt(sum(float(np.nanmean(step**2)) for step in steps if np.isfinite(step).any()))


def film_ratio(solution: ContactSolution) -> float | None:
    """Return the minimum film of the smooth contact over Sq; None for a dry or smooth contact."""
    oil, sq = solution.lubricant, solution.surface.sq
    return least_film(solution.conditions, oil) / sq if oil and sq > 0.0 else None


def _full_film(solution: ContactSolution) -> bool:
    """Return True if the oil carries all load on a film without effects of roughness and heat."""
    ratio = film_ratio(solution)
    isothermal = solution.viscosity_factor is None
    return isothermal and not solution.in_contact.any() and (ratio is None or ratio >= FULL_FILM)


def far_from_fits(solution: ContactSolution) -> str | None:
    """Return a note if the central film without asperity contact is far from all valid fits."""
    conditions = solution.conditions
    lubricant = solution.lubricant
    if (
        lubricant is None
        or not _full_film(solution)
        or loss_beyond_body(conditions, lubricant) > MAX_DEVIATION
    ):
        return None
    central = [fit for fit in regime_card(solution).fits if fit.place == "central"]
    if not central or min(abs(fit.deviation) for fit in central) <= MAX_DEVIATION:
        return None
    nearest = min(central, key=lambda fit: abs(fit.deviation))
    length = inlet_length(conditions, lubricant)
    cell = solution.grid.spacing[0]
    flooded = flooded_inlet(conditions, lubricant, missing=0.05)
    inlet_start = -solution.grid.lower[0]
    reason = (
        f"the grid has {length / cell:.2g} cells across the inlet"
        if length < MIN_CELLS_IN_INLET * cell
        else "the inlet is starved"
        if inlet_start < flooded or film_loss(conditions, lubricant, solution.grid) > 0.05
        else "the grid is fine enough and the inlet flooded; the formula may not cover this contact"
    )
    return (
        f"The central film of {nearest.solved * 1e6:.3g} um is "
        f"{100.0 * abs(nearest.deviation):.0f} % "
        f"{'above' if nearest.deviation > 0.0 else 'below'} the nearest fit, "
        f"{nearest.film * 1e6:.3g} um ({nearest.source}): {reason}."
    )


def _central(solution: ContactSolution, *, at_the_peak: bool) -> tuple[float, float]:
    """Return the central film [m] and the oil density there over the ambient one.

    It is the mean over the middle tenth of the Hertz zone. In the rigid regimes it is the film
    under the highest pressure, which the formulas call central there.
    """
    middle = hertz_zone(solution.conditions, solution.grid, CENTRE)
    if at_the_peak:
        middle = solution.pressure == solution.pressure.max()
    film = float(solution.gap[middle].mean())
    oil = solution.lubricant
    if oil is None:
        return film, 1.0
    return film, float(oil.density(solution.pressure[middle]).mean()) / oil.density.rho0
