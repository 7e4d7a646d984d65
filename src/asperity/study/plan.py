"""Plan of a study: points from lists, ranges, products or a Latin hypercube; seeds; ids.

A case's id is the hash of everything that affects its result.
"""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from difflib import get_close_matches
from functools import cached_property
from itertools import permutations, product
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import scipy

from asperity.case import (
    Case,
    RangeSection,
    Section,
    Seeding,
    StudyKind,
    StudySection,
    split_amount,
    to_si,
)
from asperity.core.documents import Table
from asperity.core.errors import BadInput, UnreadableFile

Swept: TypeAlias = tuple[str, tuple[object, ...] | RangeSection]  # name and values of a key
PlanKind: TypeAlias = StudyKind | Literal["surfaces", "still"]
SEED_KEYS = ("surface.seed", "vibration.seed")
MAX_CASES = 10_000_000
DIGITS = 9  # significant digits of a sampled value
RUN_SECTION = "motion"  # the section that only `asperity run` reads
# keys that may change the seeds of a case and the files of its surface
_SURFACE_KEYS = (
    "surface",
    "surface.kind",
    "surface.file",
    "surface.second",
    "surface.second.kind",
    "surface.second.file",
)
SHAPING = frozenset({*_SURFACE_KEYS, "vibration"})


class StudyCase(NamedTuple):
    """One case of a study: its position in the plan, its overrides of the shared case, its id."""

    number: int
    point: int
    realisation: int
    overrides: dict[str, object]
    id: str


@dataclass(frozen=True)
class StudyPlan:
    """The cases that a study computes.

    Parameters
    ----------
    case : shared by all cases, without [study]
    axes : the swept keys, such as "surface.sq"
    points : overrides by key, as in a case file
    realisations : surfaces (and vibration records) per point
    kind : "solve", the contact; "shake", also its dynamic stiffness and damping; "vibrate", only
        the vibration model; "still", the contact with its dynamic stiffness but no vibration
        record; "surfaces", means and intervals over the surfaces set in [solver]
    seeding : "independent", every case has its own seeds; "common", the k-th realisation has the
        same seeds at every point, so that differences between points need fewer of them
    seeds : seeds of the surfaces, instead of drawn ones
    ids : of the cases, if computed by a version of asperity whose case file had other keys
    """

    case: Case
    axes: tuple[str, ...]
    points: tuple[Table, ...]
    realisations: int = 1
    kind: PlanKind = "solve"
    seeding: Seeding = "independent"
    seeds: tuple[int, ...] | None = None
    ids: tuple[str, ...] | None = field(default=None, repr=False)

    @cached_property
    def cases(self) -> tuple[StudyCase, ...]:
        """All cases in order: all realisations of a point, then the next point."""
        return tuple(self._cases())

    @cached_property
    def _fixed(self) -> dict[str, object]:
        # [infer] does not change a contact
        entries = ((k, v) for k, v in _entries(self.case.contents) if k != "infer")
        values = {key: to_si(value) for key, value in entries if not isinstance(value, Section)}
        return {"kind": self.kind, "surface file": self.surface_digest, **values}

    @cached_property
    def surface_digest(self) -> str | None:
        """Hash of the surface file or the stored roughness, which the case file lacks; or None."""
        return _surface_digest(self.case)

    @cached_property
    def design(self) -> str:
        """Hash of everything that the cases share."""
        return _hash(self._fixed)

    def _cases(self) -> Iterator[StudyCase]:
        base = int(getattr(self.case.contents.surface, "seed", None) or 0)
        number = 0
        for position, point in enumerate(self.points):
            values = {key: to_si(value) for key, value in point.items()}
            shaped = self.case if SHAPING.isdisjoint(point) else self.case.with_written(point)
            seeded = [
                key for key in SEED_KEYS if _has_seed(shaped, key) and not _states(point, key)
            ]
            shared: dict[str, object] = {}
            if self.ids is None:
                file = self.surface_digest if shaped is self.case else _surface_digest(shaped)
                shared = {**self._fixed, **values, "surface file": file}
            words = (
                []
                if self.seeding == "common"
                else [int(_hash(values)[i : i + 8], 16) for i in (0, 8)]
            )
            for realisation in range(self.realisations):
                drawn = self._seeds(base, realisation, words)
                chosen = {key: drawn[key] for key in seeded}
                name = _hash({**shared, **chosen})[:16] if self.ids is None else self.ids[number]
                yield StudyCase(number, position, realisation, {**point, **chosen}, name)
                number += 1

    def _seeds(self, base: int, realisation: int, words: Sequence[int]) -> dict[str, int]:
        """Return the seeds of surface and vibration of a realisation."""
        if self.seeds is None:
            drawn = np.random.SeedSequence([base, realisation, *words]).generate_state(2)
        else:
            entropy = self.seeds[realisation]
            drawn = np.array(
                [entropy, np.random.SeedSequence([entropy, *words]).generate_state(1)[0]]
            )
        return {key: int(seed) for key, seed in zip(SEED_KEYS, drawn, strict=True)}


def plan_study(case: Case) -> StudyPlan:
    """Return the plan defined by a case's [study].

    Raises
    ------
    BadInput
        for a case without [study]; a swept key or value that is invalid in a case file; too many
        cases.
    """
    section = case.contents.study
    if section is None:
        raise BadInput(
            f"{case.source}: study is missing; add [study] with the quantity to vary, such as "
            'sq = { from = "0.5 um", to = "4 um", step = "0.5 um" }'
        )
    if not section.axes and section.seeds == 1:
        raise BadInput(f"{case.source}: study varies nothing; add a swept quantity or seeds")
    keys = _swept_keys(case, section)
    count = math.prod(
        len(values) if isinstance(values, tuple) else _range_size(case, name, values)
        for name, values in keys.values()
    )
    seeds = section.seeds
    cases = (section.samples or count) * (seeds if isinstance(seeds, int) else len(seeds))
    if cases > MAX_CASES:
        remedy = "use larger steps, or samples"
        raise BadInput(f"{case.source}: study has {cases} cases, more than {MAX_CASES}; {remedy}")
    if section.samples is None:
        swept = (
            v if isinstance(v, tuple) else tuple(_range(case, name, v)) for name, v in keys.values()
        )
        points = [dict(zip(keys, combined, strict=True)) for combined in product(*swept)]
    else:
        points = _sampled(case, keys, section.samples, section.sample_seed)
    _require_distinct(case, points)
    return plan_points(
        case, points, axes=tuple(keys), seeds=seeds, kind=section.kind, seeding=section.seeding
    )


def _swept_keys(case: Case, section: StudySection) -> dict[str, Swept]:
    """Return name and values of each swept key; BadInput for a key that is swept twice."""
    keys = {full_key(case, name): (name, values) for name, values in section.axes.items()}
    if len(keys) < len(section.axes):
        raise BadInput(
            f"{case.source}: study sweeps one quantity twice; "
            f"the keys are {', '.join(section.axes)}"
        )
    for key, part in permutations(keys, 2):
        if part.startswith(f"{key}."):
            raise BadInput(
                f"{case.source}: study sweeps {key} and {part}, a part of it; "
                f"write {part} in its tables"
            )
    return keys


def plan_points(
    case: Case,
    points: Sequence[Table],
    *,
    axes: Sequence[str] | None = None,
    seeds: int | Sequence[int] = 1,
    kind: PlanKind = "solve",
    seeding: Seeding = "independent",
) -> StudyPlan:
    """Return a plan of explicitly given points.

    Parameters
    ----------
    case : shared by all cases; its [study] is ignored
    points : values by dotted key, as in a case file, such as
        {"surface.sq": "0.5 um", "contact.load": "200 N"}
    axes : the swept keys; by default all keys of the points
    seeds : number of realisations per point, or the seeds of the surfaces
    kind, seeding : see `StudyPlan`

    Raises
    ------
    BadInput
        for a value that is invalid in a case file.
    """
    if not points:
        raise BadInput("a study needs at least one point, got none")
    base = replace(case, contents=case.contents.model_copy(update={"study": None, "infer": None}))
    if axes is None:
        axes = tuple(dict.fromkeys(key for point in points for key in point))
    _require_values(base, axes, points)
    explicit, realisations = (None, seeds) if isinstance(seeds, int) else (tuple(seeds), len(seeds))
    if realisations < 1:
        raise BadInput(f"seeds must be 1 or more, got {realisations}")
    if explicit is not None and len(set(explicit)) < realisations:
        raise BadInput(f"seeds must differ from one another, got {str(explicit[:20])[1:80]}")
    return StudyPlan(base, tuple(axes), tuple(points), realisations, kind, seeding, explicit)


def _require_values(case: Case, axes: Sequence[str], points: Sequence[Table]) -> None:
    """Raise BadInput for an invalid value; of many values of a quantity, check the extremes."""
    for key in axes:
        values = {json.dumps(to_si(point[key])): point[key] for point in points if key in point}
        chosen = list(values.values())
        if len(chosen) > 100 and all(isinstance(to_si(value), float | int) for value in chosen):
            chosen = [min(chosen, key=to_si), max(chosen, key=to_si)]
        for value in chosen:
            case.with_written({key: value})


def _require_distinct(case: Case, points: Sequence[Table]) -> None:
    """Raise BadInput for a duplicate point, whose cases would count as independent ones."""
    seen = set()
    for point in points:
        encoded = json.dumps({key: to_si(value) for key, value in point.items()}, sort_keys=True)
        if encoded in seen:
            text = ", ".join(f"{key} = {as_written(value)}" for key, value in point.items())
            remedy = "write each value once, and set seeds for more surfaces"
            raise BadInput(f"{case.source}: study has the point {text} twice; {remedy}")
        seen.add(encoded)


def full_key(case: Case, name: str, section: str = "study") -> str:
    """Return the dotted key of a name in [study] or another section: itself, or its unique match.

    Raises
    ------
    BadInput
        for a name that matches no key of the case, or several.
    """
    entries = [
        (k, v)
        for k, v in _entries(case.contents)
        if k.partition(".")[0] not in ("study", "infer", RUN_SECTION)
    ]
    tables = [key for key, value in entries if isinstance(value, Section)]
    keys = [key for key, value in entries if not isinstance(value, Section)]
    if name.partition(".")[0] == RUN_SECTION:
        raise BadInput(
            f"{case.source}: {section}.{name} has no effect in a study; "
            f"[{RUN_SECTION}] is for asperity run"
        )
    if name in (*keys, *tables):
        return name
    matches = [key for key in keys if key.rpartition(".")[2] == name]
    matches = matches or [key for key in tables if key.rpartition(".")[2] == name]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise BadInput(
            f"{case.source}: {section}.{name} could mean {' or '.join(matches)}; write one of them"
        )
    candidates = [*tables, *keys, *(key.rpartition(".")[2] for key in keys)]
    close = get_close_matches(name, candidates, n=1)
    remedy = f"did you mean {close[0]}?" if close else "name one such as surface.sq or contact.load"
    raise BadInput(f"{case.source}: {section}.{name} is not a key of the case; {remedy}")


def _entries(section: Section, parents: tuple[str, ...] = ()) -> Iterator[tuple[str, object]]:
    """Yield every key of a case with its value, tables and their entries."""
    for name, entry in type(section).model_fields.items():
        keys = (*parents, entry.alias or name)
        value = getattr(section, name)
        yield ".".join(keys), value
        if isinstance(value, Section):
            yield from _entries(value, keys)


def as_written(value: object) -> str:
    """Return a value of a case file as text."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {as_written(entry)}" for key, entry in value.items()) + "}"
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


# Ranges
# ----------------------------------------------------------------------


class _Span(NamedTuple):
    """A range: its ends in the unit of `from`."""

    low: Decimal
    high: Decimal
    unit: str

    def text(self, number: Decimal) -> str | float | int:
        """Return a value of the range as in a case file."""
        if self.unit:
            return f"{number:f} {self.unit}"
        return int(number) if number == int(number) and self.low == int(self.low) else float(number)


def _span(case: Case, name: str, section: RangeSection) -> _Span:
    try:
        low, unit = split_amount(section.start)
        high = split_amount(section.to, unit)[0]
    except BadInput as error:
        raise BadInput(f"{case.source}: study.{name} {error}") from None
    if high < low:
        raise BadInput(
            f"{case.source}: study.{name} must be ascending, "
            f"got from {section.start} to {section.to}"
        )
    if section.scale == "log" and low <= 0:
        raise BadInput(
            f"{case.source}: study.{name} must be positive on a log scale, got from {section.start}"
        )
    return _Span(low, high, unit)


def _step(case: Case, name: str, section: RangeSection, span: _Span) -> Decimal:
    if (section.step is None) == (section.count is None):
        raise BadInput(
            f"{case.source}: study.{name} needs either step or count; or set study.samples"
        )
    if section.count is not None:
        return Decimal(0)
    if section.scale == "log":
        raise BadInput(
            f"{case.source}: study.{name} has a step, which a log scale does not use; give count"
        )
    try:
        step = split_amount(section.step, span.unit)[0]
    except BadInput as error:
        raise BadInput(f"{case.source}: study.{name}.step {error}") from None
    if step <= 0:
        raise BadInput(f"{case.source}: study.{name}.step must be positive, got {section.step}")
    return step


def _range_size(case: Case, name: str, section: RangeSection) -> int:
    if case.contents.study is not None and case.contents.study.samples is not None:
        return 1
    span = _span(case, name, section)
    step = _step(case, name, section, span)
    return section.count or int((span.high - span.low) / step) + 1


def _range(case: Case, name: str, section: RangeSection) -> Iterator[str | float | int]:
    span = _span(case, name, section)
    step = _step(case, name, section, span)
    if section.count is None:
        yield from (span.text(span.low + i * step) for i in range(_range_size(case, name, section)))
        return
    shares = [i / max(section.count - 1, 1) for i in range(section.count)]
    yield from (span.text(_between(span, share, section.scale)) for share in shares)


def _between(span: _Span, share: float, scale: str) -> Decimal:
    """Return the value at a share of the range; the ends are exact."""
    if share in (0.0, 1.0):
        return span.high if share else span.low
    low, high = float(span.low), float(span.high)
    value = low * (high / low) ** share if scale == "log" else low + share * (high - low)
    return Decimal(f"{value:.{DIGITS}g}")


def _sampled(
    case: Case, keys: Mapping[str, Swept], samples: int, sample_seed: int
) -> list[dict[str, object]]:
    """Return points of a Latin hypercube over ranges and lists."""
    shares = scipy.stats.qmc.LatinHypercube(len(keys), rng=sample_seed).random(samples)
    points: list[dict[str, object]] = [{} for _ in range(samples)]
    # sorted, since the order of keys may differ in an equivalent case
    for column, (key, (name, values)) in enumerate(sorted(keys.items())):
        for point, share in zip(points, shares[:, column], strict=True):
            if isinstance(values, tuple):
                point[key] = values[int(share * len(values))]
            else:
                span = _span(case, name, values)
                point[key] = span.text(_between(span, float(share), values.scale))
    return points


def _has_seed(case: Case, key: str) -> bool:
    section, name = key.split(".")
    table = getattr(case.contents, section)
    return table is not None and name in type(table).model_fields


def _states(point: Table, key: str) -> bool:
    """Return True if a point sets the seed, by its key or in a whole table."""
    section, name = key.split(".")
    table = point.get(section)
    return key in point or (isinstance(table, Mapping) and name in table)


def _surface_digest(case: Case) -> str | None:
    section = case.contents.surface
    if case.stored is not None:
        return hashlib.sha256(case.stored.heights.tobytes()).hexdigest()
    files = [getattr(part, "file", None) for part in (section, getattr(section, "second", None))]
    digest = hashlib.sha256()
    for file in (case.folder / name for name in files if name is not None):
        try:
            digest.update(file.read_bytes())
        except OSError as error:
            raise UnreadableFile(
                f"{file} cannot be read: {error.strerror}; check surface.file"
            ) from None
    return digest.hexdigest() if any(files) else None


def _hash(values: Table) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
