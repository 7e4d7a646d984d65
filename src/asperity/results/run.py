"""Run: a solved case with its load sharing, friction, stress and contact resonance.

It contains no physics of its own, solves nothing and prints nothing.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from asperity import ehl
from asperity.core.displayed import Displayed
from asperity.core.quantities import Quantity, lines, quantity, read
from asperity.coupling import Vibration
from asperity.resonance import Resonance
from asperity.results.derived import Derived
from asperity.results.determined import Determined
from asperity.results.dynamic import DynamicCurve, dynamic_curve
from asperity.results.film_errors import film_errors
from asperity.results.friction_interval import FrictionInterval, friction_interval, numerical_error
from asperity.results.lubrication_regime import lubrication
from asperity.results.oil_effect import AlphaEffect, alpha_effect, oil_summary, with_alpha
from asperity.results.run_contents import run_contents
from asperity.results.running import Running
from asperity.results.surface_spread import AVERAGED, Row, Scalar, half_interval, mean_row
from asperity.results.uncertainty_text import basis, ends_text, interval_text
from asperity.solution import (
    HOT,
    DynamicStiffness,
    OwnResonance,
    RegimeCard,
    own_resonance,
    regime_card,
    solved_inlet,
    uncertain_films,
    undetermined,
)

if TYPE_CHECKING:
    import xarray

PURE_ROLLING = (
    "In pure rolling friction is zero; what resists is rolling friction "
    "(rolling_friction_coefficient)."
)
RUN_GROUPS = (*AVERAGED, "solver")
SHORT_GROUPS = tuple(group for group in RUN_GROUPS if group != "virgin")  # of short tables
UNCERTAINTY = "uncertainty"  # group of the catalogue: intervals over all surfaces
RUNNING = "running"  # group of the catalogue: the running contact beside its snapshot
ENDS = "ends"  # group of the catalogue: rollers
DAMPING = "contact_damping_ratio"
ROUGHNESS_KEYS = ("lambda_ratio", "rms_slope")
SUMMARY_KEYS = ("clr", "clr_error", "car", *ROUGHNESS_KEYS, "crf_hz", "crf_std_hz")


@dataclass(frozen=True, kw_only=True, repr=False)
class Run(Derived, Displayed):
    """Solved case: the contact, its derived quantities, and the vibration of a mass on it.

    `vibration` is None for a case without [vibration]; `notes` qualify the numbers. Friction, heat
    and stress are computed on demand. `others` are the numbers of further surfaces of the same
    kind: fields, state, vibration and friction are those of the first surface, `scalars` are means
    over all, and `error` states how far a single surface may deviate from them. `groups` of the
    catalogue are available for every surface.

    Where the roughness moves, `running` has the means over time, which are the numbers and the
    state; fields and own resonance are those of the `solution`: the snapshot at the start, or the
    last moment, without own resonance, if that did not converge.
    """

    vibration: Vibration | None
    notes: tuple[str, ...] = ()
    others: tuple[Row, ...] = ()
    groups: tuple[str, ...] = RUN_GROUPS
    running: Running | None = None

    @property
    def friction_error(self) -> float | None:
        """Error of friction due to those of load share and film of the solution."""
        if self.friction is None:
            return None
        return numerical_error(self.friction, self.solution, self.state.clr)

    @cached_property
    def friction_interval(self) -> FrictionInterval | None:
        """Interval of friction over all surfaces; None if it was not computed."""
        return friction_interval((self.own_scalars, *self.others))

    @property
    def remarks(self) -> tuple[str, ...]:
        """`notes`, and those on friction, heat and stiffness over frequency."""
        heat = self.heat
        curve = self._dynamic_curve
        failures = () if curve.value is None else curve.value.failures
        if curve.reason:
            failures = (f"no stiffness over frequency: {curve.reason}",)
        notes = (*self.notes, *(f"{sentence[:1].upper()}{sentence[1:]}." for sentence in failures))
        if self.solution.lubricant is not None and self.case.conditions.sliding_speed == 0.0:
            notes = (*notes, PURE_ROLLING)
        if (
            heat is None
            or self.case.thermal.feedback
            or heat.film_max_k < HOT
            or self.solution.lubricant is None
        ):
            return notes
        hot_film = (
            f"The film warms by up to {heat.film_max_k:.4g} K, but the viscosity is that of the "
            "cold oil: friction and temperatures are too high. Set thermal.feedback=true."
        )
        return (*notes, hot_film)

    @property
    def resonance(self) -> Resonance | None:
        """Contact resonance; None if not found or not requested."""
        resonance = None if self.vibration is None else self.vibration.resonance
        return resonance if resonance is not None and resonance.found else None

    @cached_property
    def _own_resonance(self) -> Determined[OwnResonance]:
        """Resonance of the mass on the solved contact's own stiffness, if determined."""
        model = self.case.vibration
        if model is None:
            return Determined(None, "no mass is stated; add [vibration]")
        if not self.solution.convergence.converged:
            return Determined(None, "the contact is not solved")
        if self.snapshot_clr is None:
            return Determined(None, "the contact with standing roughness did not converge")
        return Determined.attempt(lambda: own_resonance(self.solution, model.mass))

    @property
    def own_resonance(self) -> OwnResonance | None:
        """Stiffness and damping of the contact itself where the mass resonates; None if unknown."""
        return self._own_resonance.value

    @property
    def own_resonance_failure(self) -> str | None:
        """Reason why `own_resonance` is not available; None if it is."""
        return self._own_resonance.reason or None

    @cached_property
    def _virgin_resonance(self) -> Determined[DynamicStiffness]:
        """The same while cells at the pressure cap still yield, if determined."""
        resonance = self._own_resonance.value
        if resonance is None:
            return Determined(None, self._own_resonance.reason)
        return Determined.attempt(lambda: resonance.virgin)

    @property
    def virgin_resonance(self) -> DynamicStiffness | None:
        """Stiffness and damping of virgin roughness; None if unknown."""
        return self._virgin_resonance.value

    @cached_property
    def _dynamic_curve(self) -> Determined[DynamicCurve]:
        """Stiffness and damping over frequency, if requested and determined."""
        count = self.case.contents.solver.dynamic
        if not count:
            return Determined(None)
        if not self.solution.convergence.converged:
            return Determined(None, "the contact is not solved")
        resonance = self.own_resonance
        resonance_hz = None if resonance is None else resonance.elastic.frequency_hz
        return Determined.attempt(lambda: dynamic_curve(self.solution, count, resonance_hz))

    @property
    def dynamic_curve(self) -> DynamicCurve | None:
        """Stiffness and damping over frequency of the first surface (`solver.dynamic`)."""
        return self._dynamic_curve.value

    @property
    def damping_error(self) -> float | None:
        """Half of the interval of the damping ratio on a further surface."""
        rows = (read(self, map(quantity, [DAMPING])), *self.others)
        values = [float(value) for row in rows if (value := row.get(DAMPING)) is not None]
        return half_interval(values) if len(values) > 1 else None

    @cached_property
    def error(self) -> ehl.ContactError:
        """Uncertainty of load share and resonance: that of `state`, and of an estimated alpha."""
        return with_alpha(self.case, self.state, self.alpha_effect)

    @cached_property
    def film_errors(self) -> dict[str, ehl.Uncertainty | None]:
        """Uncertainty of the minimum and the central film thickness, over all surfaces."""
        rows = (self.numbers(["film"]), *self.others)
        return film_errors(self.case, rows, self.alpha_effect)

    @cached_property
    def own_scalars(self) -> dict[str, Scalar]:
        """Numbers of the first surface by their catalogue keys, SI; None if not available."""
        return self.numbers(self.groups)

    def numbers(self, groups: Sequence[str]) -> dict[str, Scalar]:
        """Return the numbers of some groups of the catalogue, with those of a roller's ends."""
        return self.quantities(lines(*groups, *([] if self.axial is None else [ENDS])))

    def quantities(self, entries: Iterable[Quantity]) -> dict[str, Scalar]:
        """Return numbers by key: means over time of a running contact, else of the solution."""
        entries = list(entries)
        means = {} if self.running is None else self.running.numbers
        numbers = read(self, [entry for entry in entries if entry.key not in means])
        return {entry.key: means.get(entry.key, numbers.get(entry.key)) for entry in entries}

    def scalars(self) -> dict[str, Scalar]:
        """Return all numbers of the run by key, SI: means over surfaces, intervals, solver data."""
        means = mean_row((self.own_scalars, *self.others))
        return means | read(self, lines(UNCERTAINTY, RUNNING))

    @cached_property
    def alpha_effect(self) -> AlphaEffect | None:
        """Effect of an estimated alpha on film and load share, from standing roughness."""
        standing = self.snapshot_clr is not None
        return alpha_effect(self.case, self.solution) if standing else None

    @cached_property
    def card(self) -> RegimeCard:
        """Regime card: kind of contact, and comparison with published film formulas."""
        solution, thermal = self.solution, self.case.thermal
        card = regime_card(solution, thermal, solved_inlet(solution, thermal))
        if self.running is None:
            return card
        slope = self.state.rms_slope
        assert slope is not None  # of a rough contact
        return replace(card, lambda_ratio=self.state.lambda_ratio, rms_slope=slope)

    @cached_property
    def undetermined(self) -> str | None:
        """Reason why this grid does not determine CLR; None if it does."""
        assert self.state.error is not None  # set by contact_state
        # the error bar of a running contact compares two grids
        return undetermined(self.solution, self.state.error.clr, resolved=self.running is not None)

    @property
    def converged(self) -> bool:
        """True if the solution, or nearly every time step of a running contact, is converged."""
        return self.solution.convergence.converged and getattr(self.running, "converged", True)

    @property
    def convergence_text(self) -> str:
        """Outcome of the solver: its steps, or the time steps that did not converge."""
        running = self.running
        if running is None or not self.solution.convergence.converged:
            return self.solution.convergence.explain()
        coarse = "" if running.clr.grid is None else " and half as many along each axis"
        return (
            f"{running.steps - running.failed} of {running.steps} time steps converged, on "
            f"{running.cells[0]} x {running.cells[1]} cells{coarse}"
        )

    @property
    def determined(self) -> bool:
        """True if CLR is converged and resolved, with an error bar below 15 %."""
        return self.converged and self.undetermined is None

    @property
    def _uncertain_films(self) -> tuple[str, ...]:
        """Films that are not determined, each with the reason."""
        if self.solution.lubricant is None:
            return ()
        return uncertain_films(self.numbers(["film"]), self.solution)

    @property
    def film_determined(self) -> bool | None:
        """True if the solution is converged, with error bars of the films below 15 %.

        None for a dry contact.
        """
        if self.solution.lubricant is None:
            return None
        return self.converged and not self._uncertain_films

    @property
    def is_snapshot(self) -> bool:
        """True if roughness that moves was solved standing still."""
        moved = "running" in self.solution.attributes  # also if its start failed
        return not moved and self.state.sq > 0.0 and self.case.roughness_moves

    @property
    def snapshot_clr(self) -> float | None:
        """Load share of standing roughness; None if that did not converge."""
        return self.state.clr if self.running is None else self.running.snapshot_clr

    def summary(self) -> dict[str, object]:
        """Return the content of `solve --json`: numbers, cells, regime card, oil and notes."""
        curve, means = self.dynamic_curve, self.scalars()
        return {
            **means,
            "roughness": "standing" if self.running is None else "running",
            "cells": list(self.solution.grid.cells),
            "regime_card": self.card.to_dict(),
            **oil_summary(self.case, self.alpha_effect, means),
            **({} if curve is None else {"dynamic_curve": curve.scalars()}),
            "notes": [*self.remarks, *self._without_virgin()],
        }

    def _without_virgin(self) -> Iterator[str]:
        """Yield a note if the virgin stiffness was requested and only the elastic one is known."""
        if (
            "virgin" in self.groups
            and self.own_resonance is not None
            and self._virgin_resonance.reason
        ):
            reason = self._virgin_resonance.reason
            yield f"There is no stiffness of virgin roughness: {reason}."

    def verdict(self) -> str:
        """Return one sentence on the contact's state: means over surfaces with intervals.

        Full film: asperities carry less than 1 % of the load; boundary lubrication: 90 % or more;
        mixed between. Smooth bodies have solid contact, no asperities. If the grid does not
        determine CLR, the sentence states so, with the reason; likewise a film with an error bar
        above 15 %.
        """
        regime, shared = self._regime_and_shares()
        sentence = f"{regime}: {shared}"
        if self.undetermined is not None:
            sentence = (
                f"Grid too coarse, CLR not determined ({self.undetermined}): on this grid {shared}"
            )
        if not self.converged:
            sentence = f"NOT CONVERGED, do not use: {sentence}"
        films = self._uncertain_films
        doubt = ""
        if films and self.undetermined is None:
            doubt = f"film not determined ({', '.join(films)}); "
        ends = "" if self.axial is None else ends_text(self.axial, self.numbers([]), self.solution)
        contact = f"{ends}{self.resonance_text()}"
        return f"{sentence}; {doubt}{contact}; {basis(self.error, snapshot=self.is_snapshot)}."

    @property
    def lubrication(self) -> str:
        """Full film, mixed or boundary lubrication, or dry contact."""
        return self._regime_and_shares()[0]

    def _regime_and_shares(self) -> tuple[str, str]:
        """Return the lubrication regime, and the shares of load and area as text."""
        numbers = mean_row((self.summary_row, *self.others))
        clr, car = (float(numbers[key]) for key in ("clr", "car"))
        regime = lubrication(clr, lubricated=self.solution.lubricant is not None)
        load, area = (quantity(key).text(value) for key, value in (("clr", clr), ("car", car)))
        roughness = ", ".join(quantity(k).named(numbers[k]) for k in ROUGHNESS_KEYS if numbers[k])
        bearing = "asperities carry" if self.state.sq > 0.0 else "solid contact carries"
        shared = (
            f"{bearing} {load} of the load {interval_text('clr', self.error.clr)} on {area} of "
            f"the Hertz zone{roughness and f' ({roughness})'}"
        )
        if self.running is None:
            return regime, shared
        standing = "not determined"
        if self.snapshot_clr is not None:
            standing = quantity("clr").text(self.snapshot_clr)
        return regime, f"{shared}, {standing} in a snapshot of standing roughness"

    @property
    def summary_row(self) -> Row:
        """Numbers of the first surface for the verdict and the intervals; quick to compute."""
        return self.quantities(map(quantity, SUMMARY_KEYS))

    def resonance_text(self) -> str:
        """Return the contact resonance with its interval, or the reason why there is none."""
        if self.vibration is None:
            return "vibration not requested"
        rows = (self.summary_row, *self.others)
        count = sum(row["crf_hz"] is not None for row in rows)
        error = self.error.crf_hz
        if not count or error is None:
            return f"no contact resonance ({self.vibration.resonance.reason.rstrip('.')})"
        subset = "" if count == len(rows) else f", on {count} of {len(rows)} surfaces"
        return f"contact resonance at {error.value:.0f} Hz {interval_text('crf_hz', error)}{subset}"

    def to_dataset(self) -> "xarray.Dataset":
        """Return the run's `contents` as an xarray dataset."""
        return self.contents().to_dataset()

    def contents(self) -> ehl.FileContents:
        """Return the solution's contents with all numbers of the run and derived maps."""
        return run_contents(self)

    def save(self, path: str | Path) -> Path:
        """Save the run with its case as one netCDF file (atomically), and return the path.

        The format is `FileContents` of `ehl.contact_solution`; `load_run` reads it.
        """
        return self.contents().save(path)
