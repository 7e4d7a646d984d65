"""Catalogue of quantities: name, unit, display format and key of the standard deviation.

`quantities.csv` has a line for each quantity. Tables, pages, axes, JSON, netCDF and docs take
labels and units only from here. Parameters of laws carry unit and symbol in their annotation, as
`Parameter`.
"""

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, SupportsFloat, get_type_hints

from asperity.core.coverage import PERCENT
from asperity.core.documents import Table
from asperity.core.errors import require_positive

NO_VALUE = "–"
UNKNOWN = "± not determined"  # interval of a number
ROLLING = "none: pure rolling"  # friction and heat where nothing slides
# groups of non-negative quantities: shares, film thicknesses, friction
BOUNDED = ("load", "sharing", "film", "friction")
SLIDING = (  # quantities that sliding causes
    *("friction_coefficient", "friction_asperity_part", "friction_oil_part"),
    *("friction_power_w", "flash_temperature_max_k"),
)
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# display units per SI unit; any other display unit is the SI unit itself
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
    "pF": 1e12,
    "mΩ": 1e3,
}
_FACTORS |= {
    "1/µm": 1e-6,
    "1/GPa": 1e9,
    "mm/s": 1e3,
    "N/µm": 1e-6,
    "N/mm": 1e-3,
    "N mm": 1e3,
    "mJ": 1e3,
    "mm²/s": 1e6,
    "mPa s": 1e3,
}
_FACTORS |= {"mm³": 1e9, "°": 180.0 / math.pi, "h": 1.0 / 3600.0, "10⁶ turns": 1e-6}
# units in headings of columns, as in print
COLUMN_UNITS = {"um": "µm"} | {unit: unit for unit in ("h", "s", "min", "d", "mm", "nm", "m", "km")}
_DISPLAYS = {  # display units of laws' parameters, where not the SI unit
    "Pa": "MPa",
    "1/Pa": "1/GPa",
    "kg/m^3": "kg/m³",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """An entry of the catalogue.

    `unit` is that of the stored number (SI, in netCDF notation), `display` the unit in tables and
    figures, `form` the format specification in that unit. `deviation` is the key of the standard
    deviation or error bar. `group` is the table of the quantity; `source` the attribute path in a
    solved case or other owner of the group; `detail` excludes it from short tables.
    `standard_name` is the CF name, if any.
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
        """Display units per stored unit."""
        return 1.0 if self.display == self.unit else _FACTORS.get(self.display, 1.0)

    @property
    def title(self) -> str:
        """Name and symbol: "asperity load share, CLR"."""
        return f"{self.name}, {self.symbol}" if self.symbol else self.name

    @property
    def short(self) -> str:
        """Symbol, or name if there is none."""
        return self.symbol or self.name

    @property
    def label(self) -> str:
        """Short axis label: symbol or name, and display unit."""
        return f"{self.short} [{self.display}]" if self.display else self.short

    @property
    def axis(self) -> str:
        """Long axis label: name and symbol, and display unit."""
        return f"{self.title} [{self.display}]" if self.display else self.title

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the netCDF variable, by the CF conventions."""
        values = {"long_name": self.title, "units": self.unit, "standard_name": self.standard_name}
        return {name: text for name, text in values.items() if text}

    def value_from(self, owner: object) -> Any:
        """Return the value at the path `source` in its owner; None if a part of it is None."""
        for name in self.source.split("."):
            if owner is None:
                return None
            owner = owner[name] if isinstance(owner, dict) else getattr(owner, name)
        return owner

    def number(self, value: Any, deviation: float | None = None) -> str:
        """Format a stored value without its unit: "84.0 ± 2.4"; `NO_VALUE` for None and nan."""
        if isinstance(value, bool | str):
            return value if isinstance(value, str) else "yes" if value else "NO"
        if value is None or not math.isfinite(value):
            return NO_VALUE
        return with_deviation(
            value * self.factor, None if deviation is None else deviation * self.factor, self.form
        )

    def text(self, value: float | str | None, deviation: float | None = None) -> str:
        """Format a stored value with its unit: "84.0 ± 2.4 %"."""
        number = self.number(value, deviation)
        return number if number == NO_VALUE or not self.display else f"{number} {self.display}"

    def interval(self, low: float, high: float) -> str:
        """Format an interval with its unit, digits by its width: "55.1 to 69.9 %"."""
        return f"{self._span(low, high)} {self.display}".rstrip()

    def _span(self, low: float, high: float) -> str:
        half = 0.5 * (high - low) * self.factor
        decimals = max(0, 1 - math.floor(math.log10(half))) if half > 0.0 else 6
        form = self.form
        if form.endswith("f"):
            form = f".{min(decimals, int(form.strip('.f')))}f"
        return " to ".join(with_deviation(end * self.factor, None, form) for end in (low, high))

    def named(self, value: float | str | None, deviation: float | None = None) -> str:
        """Format a stored value after its symbol: "CLR 84.0 ± 2.4 %"."""
        return f"{self.short} {self.text(value, deviation)}"

    @property
    def ends(self) -> tuple[str, str]:
        """Keys of the ends of the interval: `crf_low_hz` and `crf_high_hz` of `crf_hz`."""
        unit = next((end for end in ("_hz", "_m") if self.key.endswith(end)), "")
        stem = self.key.removesuffix(unit)
        return f"{stem}_low{unit}", f"{stem}_high{unit}"

    def number_in(self, values: Table) -> str:
        """Format its number in a row of a run or table: "61.3 (44 to 78)", or "61.3 ± 2.4".

        A quantity with keys for an interval shows no deviation, which is only a part of the
        uncertainty; without values for them the interval is "± not determined". A share or film
        thickness whose deviation exceeds the physical range shows the clipped interval: "0.2 (0.0
        to 7.1)". A text in place of the number is returned unchanged.
        """
        value = values.get(self.key)
        if isinstance(value, str):
            return value
        low, high = (_as_float(values.get(end)) for end in self.ends)
        if self.ends[0] not in values:
            deviation = _as_float(values.get(self.deviation))
            clipped = self.clipped_interval(_as_float(value), deviation)
            return (
                self.number(value, deviation)
                if clipped is None
                else f"{self.number(value)} ({self._span(*clipped)})"
            )
        number = self.number(value)
        if value is not None and (low is None or high is None):
            return f"{number} ({UNKNOWN})"
        if low is None or high is None or self.number(low) == self.number(high) == number:
            return number
        return f"{number} ({self._span(low, high)})"

    def clipped_interval(
        self, value: float | None, deviation: float | None
    ) -> tuple[float, float] | None:
        """Return value ± deviation clipped to the physical range; None where nothing is clipped."""
        if value is None or not deviation or not math.isfinite(value + deviation):
            return None
        low, high = self.within_range(value, value - deviation, value + deviation)
        return None if (low, high) == (value - deviation, value + deviation) else (low, high)

    def within_range(self, value: float, low: float, high: float) -> tuple[float, float]:
        """Clip the interval of a value to its physical range, such as 0 to 1 for a share.

        The true value lies in this range, so the part outside never contains it: clipping leaves
        the coverage unchanged.
        """
        if self.group not in BOUNDED:
            return low, high
        most = 1.0 if (self.unit, self.display) == ("1", "%") and value <= 1.0 else math.inf
        return max(0.0, low), min(most, high)

    def text_in(self, values: Table) -> str:
        """Format its number in a row with its unit: "61.3 % (44 to 78 %)" or "61.3 ± 2.4 %"."""
        number = self.number_in(values)
        if number == NO_VALUE or not self.display or isinstance(values.get(self.key), str):
            return number
        value, bracket, interval = number.partition(" (")
        if not bracket:
            return f"{number} {self.display}"
        end = "" if interval.startswith(UNKNOWN) else f" {self.display}"
        return f"{value} {self.display} ({interval.removesuffix(')')}{end})"


def mark_rolling(values: Table, *, rolling: bool, mark: str = ROLLING) -> Table:
    """Replace the numbers that sliding causes by a text, if the contact is in pure rolling."""
    return {**values, **{key: mark for key in SLIDING if rolling and key in values}}


def _as_float(value: object) -> float | None:
    return float(value) if isinstance(value, SupportsFloat) else None


def with_deviation(value: float, deviation: float | None, form: str = ".4g") -> str:
    """Format a value with its deviation, if known and visible, and their common power of ten.

    A fixed number of decimals (`.1f`) is an upper limit; `.3g` and `.1e` use powers of ten for
    small and large numbers. The deviation has two digits, the value the same number of decimals.

    Examples
    --------
    >>> from asperity.core.quantities import with_deviation
    >>> with_deviation(12.345, 0.678)
    '12.35 ± 0.68'
    """
    exponent = math.floor(math.log10(abs(value))) if value and not form.endswith("f") else 0
    if not form.endswith("e") and -3 <= exponent < 6:
        exponent = 0
    scaled = value / 10.0**exponent
    power = f"×10{str(exponent).translate(SUPERSCRIPTS)}" if exponent else ""
    if deviation is None or not 0.0 < deviation < math.inf:
        return f"{scaled:{form.replace('e', 'f')}}{power}".replace("-", "−")
    spread = deviation / 10.0**exponent
    decimals = max(0, 1 - math.floor(math.log10(spread)))
    if form.endswith("f"):
        decimals = min(decimals, int(form.strip(".f")))
    uncertainty = f" ± {spread:.{decimals}f}" if float(f"{spread:.{decimals}f}") > 0.0 else ""
    number = f"{scaled:.{decimals}f}{uncertainty}"
    return (f"({number}){power}" if power and uncertainty else f"{number}{power}").replace("-", "−")


def in_print(text: str) -> str:
    """Typeset prose: 1.3e-05 as 1.3×10⁻⁵, um as µm, and no line break before a unit.

    Examples
    --------
    >>> from asperity.core.quantities import in_print
    >>> in_print("N/um^2")
    'N/µm^2'
    """
    text = re.sub(r"\bum\b|(?<=\d )us\b", lambda unit: f"µ{unit[0][1]}", text)
    text = re.sub(
        r"\b\d(\.\d+)?e[+-]\d+",
        lambda number: with_deviation(float(number[0]), None, f".{len(number[1] or '.') - 1}e"),
        text,
    )
    return re.sub(r"(?<=\d) (?=[%±]|Hz|GPa|[µn]m\b)|(?<=±) ", "\N{NO-BREAK SPACE}", text)


def column_label(name: str) -> str:
    """Return the axis label of a column of a table from its heading with unit.

    Examples
    --------
    >>> from asperity.core.quantities import column_label
    >>> column_label("sq_um"), column_label("time_h")
    ('Sq [µm]', 'time [h]')
    """
    stem, separator, unit = name.rpartition("_")
    if separator and unit in COLUMN_UNITS:
        symbol = "Sq" if stem == "sq" else stem.replace("_", " ")
        return f"{symbol} [{COLUMN_UNITS[unit]}]"
    return name


@cache
def catalogue() -> dict[str, Quantity]:
    """Return all quantities by key, in the order of tables."""
    from importlib.resources import files  # slow import, not needed by `asperity --help`

    text = files("asperity.core").joinpath("quantities.csv").read_text("utf-8")
    lines = text.replace("{coverage}", PERCENT).splitlines()
    return {
        row["key"]: Quantity(detail=bool(row.pop("detail")), **row) for row in csv.DictReader(lines)
    }


def quantity(key: str) -> Quantity:
    """Return the quantity of a key.

    A key may name a vibration preset (`crf_sound_hz`: `crf_hz` of the preset sound) or a body
    (`sq_1_m`: `sq_m` of body 1).

    Examples
    --------
    >>> from asperity.core.quantities import quantity
    >>> quantity("clr").unit
    '1'
    """
    quantities = catalogue()
    if key in quantities:
        return quantities[key]
    for preset in ("sound", "paper"):
        plain = key.replace(f"_{preset}", "")
        if plain != key and plain in quantities:
            base = quantities[plain]
            deviation = base.deviation.replace("_std", f"_std_{preset}")
            return replace(
                base, key=key, symbol=f"{base.short}, {preset}", deviation=deviation, source=""
            )
    plain = re.sub(r"_[12](?=_m3?$|$)", "", key)
    body = re.search(r"_([12])(?=_m3?$|$)", key)
    if body is not None and plain in quantities:
        base = quantities[plain]
        return replace(
            base, key=key, symbol=f"{base.short} of body {body[1]}", deviation="", source=""
        )
    raise KeyError(f"{key} is not in the catalogue of quantities; add it to quantities.csv")


def lines(*groups: str) -> list[Quantity]:
    """Return all quantities of these groups, including deviations and details."""
    return [entry for entry in catalogue().values() if entry.group in groups]


def read(owner: object, entries: Iterable[Quantity]) -> dict[str, Any]:
    """Return numbers by key, each read from the owner at its `source`; None if missing or nan."""
    numbers = ((entry.key, entry.value_from(owner)) for entry in entries if entry.source)
    return {key: None if isinstance(n, float) and not math.isfinite(n) else n for key, n in numbers}


def select(*groups: str, detail: bool = False) -> list[Quantity]:
    """Return the quantities of these groups without deviations; details only with `detail`."""
    deviations = {entry.deviation for entry in catalogue().values()}
    return [
        entry
        for entry in lines(*groups)
        if entry.key not in deviations and (detail or not entry.detail)
    ]


@dataclass(frozen=True, slots=True)
class Parameter:
    """Unit [SI] and symbol of a parameter: `eta0: Annotated[float, Parameter("Pa s", "η₀")]`.

    `positive` is the name, in messages, of a parameter that must be positive; see `Parametric`.
    """

    unit: str = ""
    symbol: str = ""
    positive: str = ""

    def text(self, value: object) -> str:
        """Format an SI value in its display unit: "18.2 1/GPa"; other values unchanged."""
        if isinstance(value, bool | str) or not isinstance(value, int | float):
            return str(value)
        display = _DISPLAYS.get(self.unit, self.unit)
        return f"{value * _FACTORS.get(display, 1.0):.4g} {display}".rstrip()


def parameters(law: type) -> Mapping[str, Parameter]:
    """Return the parameters of a law by name; a field without annotation is dimensionless."""
    return _annotated_parameters(law)


@cache  # a study uses a dozen laws per case; evaluating their hints takes 8 ms
def _annotated_parameters(law: type) -> Mapping[str, Parameter]:
    hints = get_type_hints(law, include_extras=True)
    metadata = {entry.name: getattr(hints[entry.name], "__metadata__", ()) for entry in fields(law)}
    return {
        name: next((mark for mark in marks if isinstance(mark, Parameter)), Parameter())
        for name, marks in metadata.items()
    }


class Parametric:
    """Base of dataclasses with parameters; raises BadInput for one that must be positive."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for name, parameter in parameters(type(self)).items():
            value = getattr(self, name)
            if parameter.positive and value is not None:
                require_positive(parameter.positive, value, parameter.unit)
