"""What became of a machine: its contacts, a row each, the worst of them, what is concluded, and its ratings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from asperity.case import MachineCase
from asperity.core.quantities import quantity
from asperity.machine import MachineContact
from asperity.machines.ratings import DangVan, Rating, dang_van_below, machine_ratings, warmer_teeth
from asperity.results import BOUNDARY_FROM, FULL_FILM_BELOW, Run

HARDEST, STEEL_FROM = (
    4.2e9,
    180e9,
)  # pressure; Young's modulus of both bodies from which it is meant [Pa]
SAID = (
    "viscosity_ratio",
    "life_factor",
    "rated_film",
    "scuffing_margin_k",
)  # ratings, in the verdict


@dataclass(frozen=True)
class MachineResult:
    """A machine's contacts, a row each; `folder` keeps them. Solved numbers are absent where none was solved.

    `run` is the worst contact with its fields, where it was opened.
    """

    case: MachineCase
    rows: tuple[dict[str, Any], ...]
    solved: bool
    seconds: float
    folder: Path | None = None
    run: Run | None = None

    @property
    def failures(self) -> list[dict[str, Any]]:
        """The contacts that were not solved, each with its `reason`."""
        return [row for row in self.rows if row.get("reason")]

    @property
    def worst(self) -> dict[str, Any]:
        """The contact to look at first.

        Of solved ones that whose asperities carry most; in full film the one with the least film
        ratio, of smooth ones the least film; not solved, that of the largest Hertz pressure.
        """

        def badness(row: Mapping[str, Any]) -> tuple[float, ...]:
            if row.get("clr") is None:
                return -1.0, 0.0, row["p_hertz_pa"]
            share = row["clr"] if row["clr"] >= FULL_FILM_BELOW else 0.0
            film = row["h_min_m"] if row["lambda_ratio"] is None else row["lambda_ratio"]
            return share, -film, row["p_hertz_pa"]

        return max(self.rows, key=badness)

    @cached_property
    def dang_van(self) -> DangVan | None:
        """Dang Van's measure below the worst contact, where it was opened and the material's limits are given."""
        limits = self.case.rating.fatigue_limits
        if self.run is None or limits is None:
            return None
        return dang_van_below(self.run, (float(limits[0]), float(limits[1])))

    @cached_property
    def ratings(self) -> tuple[Rating, ...]:
        """As standards have them, beside the solved numbers and without them; of fatigue, below the worst contact."""
        return (
            *machine_ratings(self.case),
            *(() if self.dang_van is None else self.dang_van.ratings()),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the contacts has to know, a sentence each."""
        return (*self.case.notes, *self._too_hard(), *warmer_teeth(self.case, self.ratings))

    def _too_hard(self) -> Iterator[str]:
        """A Hertz pressure that no rolling contact of steel bears."""
        hardest = max(self.rows, key=lambda row: row["p_hertz_pa"])
        steel = min(self.case.pair.youngs_moduli) > STEEL_FROM
        if steel and hardest["p_hertz_pa"] > HARDEST:
            pressure, most = (
                quantity("hertz_pressure_pa").text(p) for p in (hardest["p_hertz_pa"], HARDEST)
            )
            yield (
                f"Hertz's pressure of {pressure} at {hardest['name']} is above {most}, the static limit of hardened "
                "bearing steel (ISO 76): the bodies yield for good, and their elastic contact is none of theirs."
            )

    def scalars(self) -> dict[str, Any]:
        """What `machine --json` prints."""
        return {
            "verdict": self.verdict(),
            "contacts": list(self.rows),
            "frequencies": self.case.machine.frequencies,
            "worst": self.worst["name"],
            "ratings": [rating.to_dict() for rating in self.ratings],
            "notes": list(self.notes),
            "seconds": self.seconds,
        }

    def verdict(self) -> str:
        """What a tribologist would conclude, in a sentence."""
        worst, title = self.worst, self.case.machine.title()
        if not self.solved:
            sliding = ""
            if worst["slide_to_roll"]:
                sliding = f", slide-to-roll ratio {quantity('slide_to_roll').text(worst['slide_to_roll'])}"
            pressure = quantity("hertz_pressure_pa").text(worst["p_hertz_pa"])
            return f"{title}: most heavily pressed is {worst['name']}, Hertz pressure {pressure}{sliding}; not solved."
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
        doubt = "" if worst["determined"] else " (not determined on this grid)"
        film = (
            ""
            if worst["lambda_ratio"] is None
            else f", {quantity('lambda_ratio').named(worst['lambda_ratio'])}"
        )
        heat = quantity("flash_temperature_max_k")
        flash = (
            f", {heat.name} {heat.text(worst['flash_temperature_max_k'])}"
            if worst["slide_to_roll"]
            else ""
        )
        return (
            f"{title}: {_regime(worst)}{part}; worst is {worst['name']}, where asperities carry "
            f"{_share(worst)} of the load{doubt} on a film of "
            f"{quantity('h_central_m').text(worst['h_central_m'])}{film}{flash}{self._rated()}{failed}."
        )

    def _rated(self) -> str:
        """The ratings that a tribologist looks at first, as the end of a sentence."""
        said = []
        for rating in self.ratings:
            if rating.key in SAID and not rating.reason and not rating.beyond:
                known = {name: value for name, value in rating.values.items() if value is not None}
                least = min(known, key=lambda name: known[name])
                where = f" at {least}" if least else ""
                said.append(f"{quantity(rating.key).named(known[least])}{where}")
        return f"; rated {', '.join(said)}" if said else ""


def _share(row: Mapping[str, Any]) -> str:
    """The load share with its interval, where it has one."""
    entry = quantity("clr")
    low, high = (row.get(end) for end in entry.ends)
    whole = "" if low is None or high is None else f" ({entry.interval(low, high)})"
    return f"{entry.text(row['clr'])}{whole}"


def condition_row(contact: MachineContact, case: MachineCase) -> dict[str, Any]:
    """A contact's row, as far as it is known before it is solved."""
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


def _regime(row: Mapping[str, Any]) -> str:
    if row["clr"] < FULL_FILM_BELOW:
        high = row.get("clr_high")
        return (
            "full film"
            if high is None or high < FULL_FILM_BELOW
            else "full film, or mixed lubrication"
        )
    return "boundary lubrication" if row["clr"] >= BOUNDARY_FROM else "mixed lubrication"
