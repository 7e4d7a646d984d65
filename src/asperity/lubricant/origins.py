"""Origins of an oil's properties (given, measured, estimated or computed), and notes on them."""

from collections.abc import Iterator
from typing import Literal, NamedTuple

from asperity.core.quantities import quantity
from asperity.lubricant.data_sheet import MINERAL_INDEX, OilSheet
from asperity.lubricant.friction import ZERO_CELSIUS

Origin = Literal["given", "measured", "estimated", "computed"]

PLAUSIBLE_INDICES = 0.0, 250.0
MAX_COMPARED_VISCOSITY = 2.0  # [Pa s]; estimates were compared with measured oils up to here


class OilFact(NamedTuple):
    """Property of an oil: key in the catalogue of quantities, SI value, origin and method."""

    key: str
    value: float
    origin: Origin
    how: str = ""

    def __str__(self) -> str:
        entry = quantity(self.key)
        return f"{entry.name} {entry.text(self.value)}" + (f" ({self.how})" if self.how else "")


def oil_facts(oil: OilSheet, temperature: float) -> tuple[OilFact, ...]:
    """Return the properties of an oil at a temperature [K]; raises as `OilSheet.lubricant`."""
    return tuple(_facts(oil, temperature))


def _facts(oil: OilSheet, temperature: float) -> Iterator[OilFact]:
    yield OilFact("oil_temperature_k", temperature, "given", f"{temperature - ZERO_CELSIUS:.4g} °C")
    origin: Origin = "computed" if oil.measured is None else "measured"
    if oil.measured is None:
        method = f"mid-point of {oil.grade}" if oil.viscosity_40 is None else ""
        yield OilFact("oil_viscosity_40_m2_s", oil.at_40, "given", method)
        if oil.viscosity_100 is None:
            yield OilFact(
                "oil_viscosity_100_m2_s",
                oil.at_100,
                "computed",
                "from the viscosity index, ASTM D2270",
            )
        else:
            yield OilFact("oil_viscosity_100_m2_s", oil.at_100, "given")
        yield from _index(oil)
    if oil.density_15 is None:
        yield OilFact(
            "oil_density_15_kg_m3", oil.at_15, "estimated", "ISO/TR 15144-1, mineral oils"
        )
    else:
        yield OilFact("oil_density_15_kg_m3", oil.at_15, "given")
    line = oil.measured or "ASTM D341"
    yield OilFact(
        "oil_kinematic_viscosity_m2_s", oil.kinematic_viscosity(temperature), origin, line
    )
    yield OilFact(
        "oil_density_kg_m3", oil.density(temperature), "computed", "-0.7 kg/m³ per kelvin"
    )
    yield OilFact("oil_viscosity_pa_s", oil.viscosity(temperature), origin, line)
    yield OilFact(
        "oil_thinning_1_k", oil.walther.thinning(temperature), "computed", "slope of ASTM D341"
    )
    yield _alpha(oil, temperature)


def _index(oil: OilSheet) -> Iterator[OilFact]:
    if oil.index is None:
        return
    if oil.viscosity_100 is not None:
        yield OilFact(
            "oil_viscosity_index", oil.index, "computed", "from both viscosities, ASTM D2270"
        )
    elif oil.viscosity_index is not None:
        yield OilFact("oil_viscosity_index", oil.index, "given")
    else:
        yield OilFact("oil_viscosity_index", MINERAL_INDEX, "estimated", "typical of mineral oils")


def _alpha(oil: OilSheet, temperature: float) -> OilFact:
    alpha = oil.pressure_viscosity(temperature)
    if oil.measured is not None:
        return OilFact("oil_alpha_1_pa", alpha, "measured", oil.measured)
    if oil.alpha is not None:
        return OilFact("oil_alpha_1_pa", alpha, "given")
    estimator = oil.estimator
    spread = f"± {100.0 * estimator.spread_of(oil.base):.0f} %"
    assumed = "" if oil.base == "mineral" else " assumed"
    slope = "" if estimator.share == 1.0 else f" over {estimator.share:g}"
    return OilFact(
        "oil_alpha_1_pa", alpha, "estimated", f"{estimator.title}{slope}, {spread}{assumed}"
    )


def oil_notes(oil: OilSheet, temperature: float) -> tuple[str, ...]:
    """Return notes for results with this oil, a sentence each; raises as `OilSheet.lubricant`."""
    return tuple(_notes(oil, temperature))


def _notes(oil: OilSheet, temperature: float) -> Iterator[str]:
    facts = oil_facts(oil, temperature)
    for origin in ("given", "measured", "estimated"):
        if listed := "; ".join(str(fact) for fact in facts if fact.origin == origin):
            yield f"Oil by its data sheet, {origin}: {listed}."
    if oil.alpha is None and oil.base != "mineral":
        yield (
            f"Alpha of base {oil.base} is estimated with constants on which sources differ and "
            "which were not compared with measurements. The film thickness scales with about its "
            "square root, friction can change with its fourth power: give a measured alpha."
        )
    if oil.alpha is None and oil.viscosity(temperature) > MAX_COMPARED_VISCOSITY:
        yield (
            f"The viscosity of {oil.viscosity(temperature):.3g} Pa s exceeds the range in which "
            f"estimates of alpha were compared with measured oils, {MAX_COMPARED_VISCOSITY:g} Pa "
            "s; give alpha."
        )
    if (
        oil.measured is None
        and oil.index is not None
        and not PLAUSIBLE_INDICES[0] <= oil.index <= PLAUSIBLE_INDICES[1]
    ):
        yield (
            f"The viscosity index of {oil.index:.4g} is implausible, outside 0 to 250; check "
            "viscosity_40 and viscosity_100."
        )
