"""Result of a machine: one row per contact, the worst contact, verdict, notes and ratings."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

from asperity.case import MachineCase
from asperity.contact.materials import material
from asperity.core.displayed import Displayed
from asperity.core.quantities import SLIDING, quantity
from asperity.machine import BallBearing, CylindricalRollerBearing, MachineContact
from asperity.machines.fatigue_ratings import DangVan, dang_van_below
from asperity.machines.gear_ratings import warmer_teeth
from asperity.machines.rating_facts import Rating
from asperity.machines.ratings import machine_ratings
from asperity.results import BOUNDARY_FROM, FULL_FILM_BELOW, Run

STATIC_LIMIT = 4.2e9  # Hertz pressure of hardened bearing steel, ISO 76 [Pa]
STEEL_MODULI = 180e9, 230e9  # Young's moduli of steels [Pa]
YIELD_RATIO = 3.0  # hardness over yield stress (D. Tabor, The Hardness of Metals, 1951)
Row: TypeAlias = dict[str, Any]  # conditions and numbers of a contact by key
VERDICT_RATINGS = ("viscosity_ratio", "life_factor", "rated_film", "scuffing_margin_k")


@dataclass(frozen=True, repr=False)
class MachineResult(Displayed):
    """A machine's contacts, one row each, stored in `folder`; solved numbers if they were solved.

    `run` is the worst contact with its fields, if loaded.
    """

    case: MachineCase
    rows: tuple[Row, ...]
    solved: bool
    seconds: float
    folder: Path | None = None
    run: Run | None = None

    @property
    def failures(self) -> list[Row]:
        """Rows of the contacts that were not solved, each with its `reason`."""
        return [row for row in self.rows if row.get("reason")]

    def has_values(self, key: str) -> bool:
        """Return whether a contact has a value; zero counts unless sliding causes the quantity."""
        if key in (*SLIDING, "slide_to_roll"):
            return any(row.get(key) for row in self.rows)
        return any(row.get(key) is not None for row in self.rows)

    @property
    def worst(self) -> Row:
        """Row of the most critical contact.

        The solved contact with the highest CLR; in full film the lowest film ratio, for smooth
        surfaces the thinnest film; if none was solved, the highest Hertz pressure.
        """

        def severity(row: Row) -> tuple[float, ...]:
            if row.get("clr") is None:
                return -1.0, 0.0, row["p_hertz_pa"]
            share = row["clr"] if row["clr"] >= FULL_FILM_BELOW else 0.0
            film = row["h_min_m"] if row["lambda_ratio"] is None else row["lambda_ratio"]
            return share, -film, row["p_hertz_pa"]

        return max(self.rows, key=severity)

    @cached_property
    def dang_van(self) -> DangVan | None:
        """Dang Van stress below the worst contact, if loaded and fatigue limits are given."""
        limits = self.case.rating.fatigue_limits
        if self.run is None or limits is None:
            return None
        return dang_van_below(self.run, (float(limits[0]), float(limits[1])))

    @cached_property
    def ratings(self) -> tuple[Rating, ...]:
        """Ratings by standards, and those of fatigue below the worst contact."""
        return (
            *machine_ratings(self.case),
            *(() if self.dang_van is None else self.dang_van.ratings()),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the contacts, one sentence each."""
        yielding = *self._above_static_limit(), *self._above_hardness()
        return (*self.case.notes, *yielding, *warmer_teeth(self.case, self.ratings))

    def _above_hardness(self) -> Iterator[str]:
        """Warn of stresses above the strength of steel bodies, in solved contacts."""
        hardness = self.case.hardness
        steel = material(self.case.default_material)
        solved = [row for row in self.rows if row.get("p_max_pa") is not None]
        low, high = STEEL_MODULI
        if not solved or not all(low < modulus < high for modulus in self.case.pair.youngs_moduli):
            return
        pressed = max(solved, key=lambda row: row["p_max_pa"])
        stressed = max(solved, key=lambda row: row["von_mises_core_pa"] or 0.0)
        pressure, stress = pressed["p_max_pa"], stressed["von_mises_core_pa"] or 0.0
        limit, unit = (hardness or steel.hardness), quantity("p_max_pa")
        if hardness is None and pressure > limit:
            yield (
                f"The maximum pressure of {unit.text(pressure)} at {pressed['name']} is above "
                f"{unit.text(limit)}, the hardness of {steel.name}: asperities would yield. State "
                "material.hardness if they do."
            )
        if stress > limit / YIELD_RATIO:
            yield (
                f"The von Mises stress of {unit.text(stress)} below the surface at "
                f"{stressed['name']} is above {unit.text(limit / YIELD_RATIO)}, about the yield "
                f"stress at a hardness of {unit.text(limit)}: the body deforms plastically."
            )

    def _above_static_limit(self) -> Iterator[str]:
        """Warn of a Hertz pressure above the static limit of steel."""
        highest = max(self.rows, key=lambda row: row["p_hertz_pa"])
        steel = min(self.case.pair.youngs_moduli) > STEEL_MODULI[0]
        if steel and highest["p_hertz_pa"] > STATIC_LIMIT:
            pressure, limit = (
                quantity("hertz_pressure_pa").text(p) for p in (highest["p_hertz_pa"], STATIC_LIMIT)
            )
            yield (
                f"The Hertz pressure of {pressure} at {highest['name']} is above {limit}, the "
                "static limit of hardened bearing steel (ISO 76): the bodies deform plastically, "
                "and the elastic solution does not apply."
            )

    @property
    def stiffness_matrix(self) -> list[list[float]] | None:
        """Stiffness of a bearing's inner ring; None for other machines.

        Ball bearings: radial and axial [N/m], tilt [N m/rad]; roller bearings: radial.
        """
        machine = self.case.machine
        if not isinstance(machine, BallBearing | CylindricalRollerBearing):
            return None
        matrix: list[list[float]] = machine.stiffness_matrix(self.case.pair).tolist()
        return matrix

    def scalars(self) -> dict[str, object]:
        """Return the JSON output of `asperity machine`."""
        return {
            "verdict": self.verdict(),
            "contacts": list(self.rows),
            "frequencies": self.case.machine.frequencies,
            "stiffness_matrix": self.stiffness_matrix,
            "worst": self.worst["name"],
            "ratings": [rating.to_dict() for rating in self.ratings],
            "notes": list(self.notes),
            "seconds": self.seconds,
        }

    def verdict(self) -> str:
        """Return one sentence on lubrication regime, worst contact, film and ratings."""
        worst = self.worst
        title = self.case.machine.title()
        if not self.solved:
            sliding = ""
            slip = quantity("slide_to_roll")
            if worst["slide_to_roll"]:
                sliding = f", slide-to-roll ratio {slip.text(worst['slide_to_roll'])}"
            pressure = quantity("hertz_pressure_pa").text(worst["p_hertz_pa"])
            return (
                f"{title}: the highest Hertz pressure is {pressure} at {worst['name']}{sliding}; "
                "not solved."
            )
        if worst.get("clr") is None:
            return f"{title}: NOT SOLVED, {len(self.failures)} of {len(self.rows)} contacts failed."
        regimes = [_regime(row) for row in self.rows if row.get("clr") is not None]
        part = (
            ""
            if len(set(regimes)) == 1
            else f" at {regimes.count(_regime(worst))} of {len(self.rows)} contacts"
        )
        failed = (
            f"; {len(self.failures)} of {len(self.rows)} contacts were NOT SOLVED"
            if self.failures
            else ""
        )
        smooth = worst["lambda_ratio"] is None
        bearing = "solid contact carries" if smooth else "asperities carry"
        doubt = "" if worst["determined"] else " (not determined on this grid)"
        return (
            f"{title}: {_regime(worst)}{part}; worst is {worst['name']}, where {bearing} "
            f"{_share(worst)} of the load{doubt} on a film of {_film(worst)}"
            f"{self._rated()}{failed}."
        )

    def _rated(self) -> str:
        """Return the most important ratings as the end of a sentence."""
        parts = []
        for rating in self.ratings:
            if rating.key in VERDICT_RATINGS and not rating.reason and not rating.beyond:
                values = {name: value for name, value in rating.values.items() if value is not None}
                lowest = min(values, key=lambda name: values[name])
                contact = f" at {lowest}" if lowest else ""
                parts.append(f"{quantity(rating.key).named(values[lowest])}{contact}")
        return f"; rated {', '.join(parts)}" if parts else ""


def _film(row: Row) -> str:
    """Return film thickness and film ratio, and the flash temperature of a sliding contact."""
    film, ratio, heat = map(quantity, ("h_central_m", "lambda_ratio", "flash_temperature_max_k"))
    parts = [film.text(row[film.key])]
    if row[ratio.key] is not None:
        parts.append(ratio.named(row[ratio.key]))
    if row["slide_to_roll"]:
        parts.append(f"{heat.name} {heat.text(row[heat.key])}")
    return ", ".join(parts)


def _share(row: Row) -> str:
    """Return the load share with its interval, if it has one."""
    entry = quantity("clr")
    low, high = (row.get(end) for end in entry.ends)
    interval = "" if low is None or high is None else f" ({entry.interval(low, high)})"
    return f"{entry.text(row['clr'])}{interval}"


def condition_row(contact: MachineContact, case: MachineCase) -> Row:
    """Return a contact's conditions, known before it is solved."""
    speeds = contact.surface_speeds
    return {
        "name": contact.name,
        "bodies": list(contact.bodies),
        "position": contact.position,
        "load_n": contact.load,
        "line_load_n_m": contact.line_load,
        "radius_m": list(contact.radius) if isinstance(contact.radius, tuple) else contact.radius,
        "length_m": contact.length,
        "u1_m_s": speeds[0],
        "u2_m_s": speeds[1],
        "entrainment_m_s": contact.entrainment_speed,
        "slide_to_roll": contact.slide_to_roll,
        "p_hertz_pa": contact.hertz(case.pair).p_max,
        "overrolling_hz": list(contact.overrolling_hz),
    }


def merge_symmetric(table: Sequence[tuple[str, Sequence[str]]]) -> list[tuple[str, list[int]]]:
    """Return the names of contacts with their rows, rolling elements with equal cells once.

    Examples
    --------
    >>> from asperity.machines import merge_symmetric
    >>> merge_symmetric([("ball 1, inner ring", ["7"]), ("ball 8, inner ring", ["7"])])
    [('ball 1, 8, inner ring', [0, 1])]
    """
    merged: dict[tuple[str, ...], list[int]] = {}
    parts = [re.fullmatch(r"(\w+ )(\d+)(, .+)", name) for name, _ in table]
    for row, ((name, cells), part) in enumerate(zip(table, parts, strict=True)):
        key = (name,) if part is None else (part[1], part[3], *cells)
        merged.setdefault(key, []).append(row)

    def common_name(rows: list[int]) -> str:
        part = parts[rows[0]]
        if part is None:
            return table[rows[0]][0]
        return f"{part[1]}{', '.join(found[2] for row in rows if (found := parts[row]))}{part[3]}"

    return [(common_name(rows), rows) for rows in merged.values()]


def _regime(row: Row) -> str:
    if row["clr"] < FULL_FILM_BELOW:
        high = row.get("clr_high")
        return (
            "full film"
            if high is None or high < FULL_FILM_BELOW
            else "full film, or mixed lubrication"
        )
    return "boundary lubrication" if row["clr"] >= BOUNDARY_FROM else "mixed lubrication"
