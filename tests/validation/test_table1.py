"""The paper's Table 1 against the dry, fully loaded contact (all load on asperities)."""

import csv
from pathlib import Path

import pytest

from asperity.conditions import ContactConditions, ElasticPair
from asperity.coupling import VibrationModel, oscillator
from asperity.ehl.state import ContactState

TABLE = Path(__file__).parents[1] / "reference" / "table1.csv"
ROWS = list(csv.DictReader(TABLE.read_text().splitlines()))


def dry(sq: float) -> ContactState:
    return ContactState(
        car=1.0,
        car_domain=1.0,
        clr=1.0,
        capped_oil_load_ratio=0.0,
        sq=sq,
        h_min=0.0,
        h_central=0.0,
        h_mean=0.0,
        lambda_ratio=None,
        p_max=1e9,
        reynolds_residual=0.0,
        load_error=0.0,
        mass_flux_imbalance=0.0,
    )


def test_the_table_has_the_papers_twelve_rows():
    assert len(ROWS) == 12


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row['cutoff_hz']}Hz-{row['height_um']}um-{row['load_n']}N")
def test_crf_of_the_dry_full_load_is_the_printed_one_within_a_third_of_a_percent(row):
    """E = 207 GPa (section 4's, E* = 113.74 GPa): the printed 219.78 GPa taken as E* would give 25 % more."""
    conditions = ContactConditions(
        pair=ElasticPair((207e9, 207e9), (0.3, 0.3)),
        geometry="line",
        radius=5.4e-3,
        load=float(row["load_n"]),
        surface_speeds=(2.12, 1.70),
        length=10e-3,
    )
    spring = oscillator(dry(float(row["height_um"]) * 1e-6), conditions, VibrationModel(mass=0.1, damping_ratio=0.02))
    assert spring.natural_frequency_hz == pytest.approx(float(row["crf_hz"]), rel=0.0035)
