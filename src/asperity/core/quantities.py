"""The one catalogue of quantities: what each is called, its unit, how it is shown and which field holds its deviation.

`quantities.csv` has a line each. Tables, pages, axes, tiles, JSON, netCDF and docs select keys
here and add nothing. Parameters of laws say their unit and symbol beside the parameter, as
`Parameter`.
"""

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, get_type_hints

from asperity.core.errors import require_positive

NO_VALUE = "–"
BOUNDED = ("load", "film")  # groups of what is never negative: shares, mostly at most 1, and films
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# display units over their SI unit; any other display unit is the SI unit itself
_FACTORS = {
    "%": 1e2,
    "nm": 1e9,
    "µm": 1e6,
    "mm": 1e3,
    "µs": 1e6,
    "ms": 1e3,
    "kHz": 1e-3,
    "MPa": 1e-6,
    "GPa": 1e-9,
}
_FACTORS |= {
    "1/µm": 1e-6,
    "1/GPa": 1e9,
    "mm/s": 1e3,
    "N/µm": 1e-6,
    "N/mm": 1e-3,
    "mJ": 1e3,
    "mm²/s": 1e6,
    "mPa s": 1e3,
}
_FACTORS |= {"mm³": 1e9, "°": 180.0 / math.pi, "h": 1.0 / 3600.0, "10⁶ turns": 1e-6}
_DISPLAYS = {
    "Pa": "MPa",
    "1/Pa": "1/GPa",
    "kg/m^3": "kg/m³",
}  # of laws' parameters, where it is not the SI unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A line of the catalogue.

    `unit` is that of the stored number (SI, as netCDF writes it), `display` the one people read,
    `form` a format specification for the number in it. `deviation` is the key that holds the
    standard deviation or error bar. `group` is the table it belongs to; `source` the attribute
    that it is read from, of a solved case or of what else the group is about; `detail` keeps it
    out of short tables. `standard_name` is CF's, where CF has one.
    """

    key: str
    symbol: str
    unit: str
    display: str
    form: str
    deviation: str
    group: str
    source: str
    detail: bool
    standard_name: str
    name: str
    meaning: str

    @property
    def factor(self) -> float:
        """What a stored number is multiplied with to be in the display unit."""
        return 1.0 if self.display == self.unit else _FACTORS.get(self.display, 1.0)

    @property
    def title(self) -> str:
        """Name and symbol: "load share of asperities, CLR"."""
        return f"{self.name}, {self.symbol}" if self.symbol else self.name

    @property
    def short(self) -> str:
        """Its symbol, or its name where it has none."""
        return self.symbol or self.name

    @property
    def label(self) -> str:
        """What an axis is called: symbol or name, and display unit."""
        return f"{self.short} [{self.display}]" if self.display else self.short

    @property
    def axis(self) -> str:
        """What an axis with room for it is called: name and symbol, and display unit."""
        return f"{self.title} [{self.display}]" if self.display else self.title

    @property
    def attributes(self) -> dict[str, str]:
        """What netCDF says of it, by the CF conventions."""
        known = {"long_name": self.title, "units": self.unit, "standard_name": self.standard_name}
        return {name: text for name, text in known.items() if text}

    def at(self, owner: Any) -> Any:
        """What stands at `source` in its owner; None where something on the way is None."""
        for name in self.source.split("."):
            if owner is None:
                return None
            owner = owner[name] if isinstance(owner, dict) else getattr(owner, name)
        return owner

    def number(self, value: Any, deviation: float | None = None) -> str:
        """A stored value as people read it, without its unit: "84.0 ± 2.4"; `NO_VALUE` for None and nan."""
        if isinstance(value, bool | str):
            return value if isinstance(value, str) else "yes" if value else "NO"
        if value is None or not math.isfinite(value):
            return NO_VALUE
        return with_deviation(
            value * self.factor, None if deviation is None else deviation * self.factor, self.form
        )

    def text(self, value: Any, deviation: float | None = None) -> str:
        """A stored value with its unit: "84.0 ± 2.4 %"."""
        number = self.number(value, deviation)
        return number if number == NO_VALUE or not self.display else f"{number} {self.display}"

    def interval(self, low: float, high: float) -> str:
        """From where to where, with its unit and no more digits than its width bears: "55.1 to 69.9 %"."""
        return f"{self._span(low, high)} {self.display}".rstrip()

    def _span(self, low: float, high: float) -> str:
        half = 0.5 * (high - low) * self.factor
        decimals = max(0, 1 - math.floor(math.log10(half))) if half > 0.0 else 6
        form = self.form
        if form.endswith("f"):
            form = f".{min(decimals, int(form.strip('.f')))}f"
        return " to ".join(with_deviation(end * self.factor, None, form) for end in (low, high))

    def named(self, value: Any, deviation: float | None = None) -> str:
        """A stored value behind its symbol: "CLR 84.0 ± 2.4 %"."""
        return f"{self.short} {self.text(value, deviation)}"

    @property
    def ends(self) -> tuple[str, str]:
        """Keys of the ends of its 90 % interval, where a row has one: `crf_low_hz` and `crf_high_hz` of `crf_hz`."""
        stem, unit = (
            (self.key.removesuffix("_hz"), "_hz") if self.key.endswith("_hz") else (self.key, "")
        )
        return f"{stem}_low{unit}", f"{stem}_high{unit}"

    def number_in(self, values: Mapping[str, Any]) -> str:
        """Its number in a row, a run's or a table's: "61.3 (44 to 78)", or "61.3 ± 2.4".

        One that has a whole interval, known or not, bears no deviation: that would be a part of
        the doubt alone. A share or film whose deviation reaches beyond what it can be has the
        interval that is left: "0.2 (0.0 to 7.1)".
        """
        value, (low, high) = values.get(self.key), (values.get(end) for end in self.ends)
        if self.ends[0] not in values:
            deviation = values.get(self.deviation)
            left = self.left(value, deviation)
            return (
                self.number(value, deviation)
                if left is None
                else f"{self.number(value)} ({self._span(*left)})"
            )
        if value is None or low is None or high is None:
            return self.number(value)
        return f"{self.number(value)} ({self._span(low, high)})"

    def left(self, value: float | None, deviation: float | None) -> tuple[float, float] | None:
        """The interval that is left of a share or film whose deviation reaches beyond what it can be; else None."""
        if (
            self.group not in BOUNDED
            or value is None
            or not deviation
            or not math.isfinite(value + deviation)
        ):
            return None
        most = 1.0 if (self.unit, self.display) == ("1", "%") and value <= 1.0 else math.inf
        low, high = max(0.0, value - deviation), min(most, value + deviation)
        return None if (low, high) == (value - deviation, value + deviation) else (low, high)

    def text_in(self, values: Mapping[str, Any]) -> str:
        """The same with its unit: "61.3 (44 to 78) %"."""
        number = self.number_in(values)
        return number if number == NO_VALUE or not self.display else f"{number} {self.display}"


def with_deviation(value: float, deviation: float | None, form: str = ".4g") -> str:
    """A value, its deviation where one is known and shows, and the power of ten of both.

    A fixed number of decimals (`.1f`) is what to show at most; `.3g` and `.1e` go over to powers
    of ten where a number is small or large. The deviation has two digits and the value ends where
    it does.
    """
    exponent = math.floor(math.log10(abs(value))) if value and not form.endswith("f") else 0
    if not form.endswith("e") and -3 <= exponent < 6:
        exponent = 0
    scaled, power = (
        value / 10.0**exponent,
        f"×10{str(exponent).translate(SUPERSCRIPTS)}" if exponent else "",
    )
    if deviation is None or not 0.0 < deviation < math.inf:
        return f"{scaled:{form.replace('e', 'f')}}{power}".replace("-", "−")
    spread = deviation / 10.0**exponent
    decimals = max(0, 1 - math.floor(math.log10(spread)))
    if form.endswith("f"):
        decimals = min(decimals, int(form.strip(".f")))
    shown = f" ± {spread:.{decimals}f}" if float(f"{spread:.{decimals}f}") > 0.0 else ""
    number = f"{scaled:.{decimals}f}{shown}"
    return (f"({number}){power}" if power and shown else f"{number}{power}").replace("-", "−")


def in_print(text: str) -> str:
    """Prose with 1.3e-05 as 1.3×10⁻⁵, um as µm, and numbers that stay on one line with their unit."""
    text = re.sub(r"\bum\b|(?<=\d )us\b", lambda unit: f"µ{unit[0][1]}", text)
    text = re.sub(
        r"\b\d(\.\d+)?e[+-]\d+",
        lambda number: with_deviation(float(number[0]), None, f".{len(number[1] or '.') - 1}e"),
        text,
    )
    return re.sub(r"(?<=\d) (?=[%±]|Hz|GPa|[µn]m\b)|(?<=±) ", "\N{NO-BREAK SPACE}", text)


@cache
def catalogue() -> dict[str, Quantity]:
    """Every quantity by its key, in the order in which tables have them."""
    from importlib.resources import files  # here: `asperity --help` shows no quantity

    lines = files("asperity.core").joinpath("quantities.csv").read_text("utf-8").splitlines()
    return {
        row["key"]: Quantity(detail=bool(row.pop("detail")), **row) for row in csv.DictReader(lines)
    }


def quantity(key: str) -> Quantity:
    """The quantity of this key; `crf_sound_hz` is `crf_hz` by the vibration preset sound, `sq_1_m` `sq_m` of body 1."""
    known = catalogue()
    if key in known:
        return known[key]
    for preset in ("sound", "paper"):
        plain = key.replace(f"_{preset}", "")
        if plain != key and plain in known:
            base = known[plain]
            deviation = base.deviation.replace("_std", f"_std_{preset}")
            return replace(
                base, key=key, symbol=f"{base.short}, {preset}", deviation=deviation, source=""
            )
    plain, body = re.sub(r"_[12](?=_m3?$|$)", "", key), re.search(r"_([12])(?=_m3?$|$)", key)
    if body is not None and plain in known:
        base = known[plain]
        return replace(
            base, key=key, symbol=f"{base.short} of body {body[1]}", deviation="", source=""
        )
    raise KeyError(f"{key} is not in the catalogue of quantities; add it to quantities.csv")


def lines(*groups: str) -> list[Quantity]:
    """Every quantity of these groups, deviations and details too."""
    return [entry for entry in catalogue().values() if entry.group in groups]


def read(owner: object, entries: Iterable[Quantity]) -> dict[str, Any]:
    """Numbers by key, each at the `source` that its line names in the owner; None where there is none or it is nan."""
    numbers = ((entry.key, entry.at(owner)) for entry in entries if entry.source)
    return {key: None if isinstance(n, float) and not math.isfinite(n) else n for key, n in numbers}


def select(*groups: str, detail: bool = False) -> list[Quantity]:
    """The quantities of these groups, deviations left out; those in `detail` too where asked."""
    deviations = {entry.deviation for entry in catalogue().values()}
    return [
        entry
        for entry in lines(*groups)
        if entry.key not in deviations and (detail or not entry.detail)
    ]


@dataclass(frozen=True, slots=True)
class Parameter:
    """Unit [SI] and symbol of a law's parameter, beside it: `eta0: Annotated[float, Parameter("Pa s", "η₀")]`.

    `positive` is what messages call a parameter that has to be positive; see `Parametric`.
    """

    unit: str = ""
    symbol: str = ""
    positive: str = ""

    def text(self, value: object) -> str:
        """A value in SI as people read it, with its unit: "18.2 1/GPa"; what is no number as it stands."""
        if isinstance(value, bool | str) or not isinstance(value, int | float):
            return str(value)
        display = _DISPLAYS.get(self.unit, self.unit)
        return f"{value * _FACTORS.get(display, 1.0):.4g} {display}".rstrip()


def parameters(law: type) -> Mapping[str, Parameter]:
    """The fields of a law by name, each with its unit and symbol; a field that states none is a plain number."""
    return _stated(law)


@cache  # every case of a study and every surface asks a dozen laws: 8 ms of evaluated hints
def _stated(law: type) -> Mapping[str, Parameter]:
    hints = get_type_hints(law, include_extras=True)
    marks = {entry.name: getattr(hints[entry.name], "__metadata__", ()) for entry in fields(law)}
    return {
        name: next((mark for mark in of if isinstance(mark, Parameter)), Parameter())
        for name, of in marks.items()
    }


class Parametric:
    """A dataclass with parameters; BadInput for one that has to be positive and is not, where it is not left out."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for name, parameter in parameters(type(self)).items():
            value = getattr(self, name)
            if parameter.positive and value is not None:
                require_positive(parameter.positive, value, parameter.unit)
