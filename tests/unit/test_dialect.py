"""Surfaces and recordings read all usual notations for rows of numbers alike."""

import itertools

import numpy as np
import pytest

from asperity.core.text_dialect import Dialect, sniff_dialect
from asperity.surface.text import read_table

ROWS = [
    [0.5, 1.25],
    [1.0, -2.5],
    [2.25, 3e-3],
    [3.0, 4.0],
    [4.0, np.nan],
    [5.5, 7.25],
    [6.0, 1.0],
    [7.0, 2.5],
]


@pytest.mark.parametrize("separator", [";", "\t", " ", "  ", ",", ", "])
@pytest.mark.parametrize("comma", [False, True], ids=["points", "commas"])
def test_rows_are_read_however_they_are_written(separator, comma, tmp_path):
    for missing, header, trailing, quoted in itertools.product(
        ("NaN", "", "BAD"), ("", "x;y\n", "x, z [um]\n"), (False, True), (False, True)
    ):
        blank = not separator.strip() and separator != "\t"
        ambiguous = missing == "" and (blank or not (trailing or quoted))
        if ambiguous or (comma and not quoted and separator.startswith(",")):
            continue  # ambiguous

        def field(value, missing=missing, quoted=quoted):
            text = missing if np.isnan(value) else f"{value:g}".replace(".", "," if comma else ".")
            return f'"{text}"' if quoted else text

        lines = [
            separator.join(map(field, row)) + (separator if trailing and not blank else "")
            for row in ROWS
        ]
        (tmp_path / "a.txt").write_text(header + "\n".join(lines) + "\n")
        written = (missing, header, trailing, quoted)
        np.testing.assert_allclose(
            read_table(tmp_path / "a.txt"), ROWS, rtol=1e-6, err_msg=str(written)
        )


def test_decimal_commas_are_read_in_one_column_but_not_in_two_integers():
    lines = ["0,5", "1,2", "3,4"]
    assert sniff_dialect(lines) == Dialect(None, True)
    assert sniff_dialect(lines, fewest_columns=2) == Dialect(",", False)
