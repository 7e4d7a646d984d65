"""Tables of overall values as historians write them: marks, units, times, conditions, sensors."""

import json
from decimal import Decimal

import numpy as np
import pandas
import pytest

from asperity.core.errors import BadInput
from asperity.monitoring import read_overalls, track_overalls

COUNT = 100
LEVELS = np.exp(0.1 * np.random.default_rng(5).standard_normal(COUNT))
GERMAN = str.maketrans(",.", ".,")


def stamp(number):
    return f"2025-01-{1 + number // 24:02}T{number % 24:02}:00:00"


def table(path, heading, fields, separator=","):
    """Write a csv whose rows are a time stamp and the fields of a row number."""
    rows = (separator.join([stamp(n), *map(str, fields(n))]) for n in range(COUNT))
    path.write_text("\n".join([separator.join(["time", *heading]), *rows]))
    return path


def json_lines(path, row):
    path.write_text("\n".join(json.dumps({"time": stamp(n), **row(n)}) for n in range(COUNT)))
    return path


# Decimal marks and thousands
# ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "last"),
    [
        (lambda n: f"{900 + 4 * n:,}", 1296.0),
        (lambda n: f"{900 + 50.0 * n:,.1f}", 5850.0),
        (lambda n: f"{900 + 50.0 * n:,.2f}".translate(GERMAN), 5850.0),
        (lambda n: f"{900 + 50.0 * n:,.1f}".replace(",", "'"), 5850.0),
        (lambda n: f"{0.9 + 0.01 * n:.3f}".replace(".", ","), 1.89),
        (lambda n: f"{1.1 + 0.001 * n:.3f}", 1.199),
        (lambda n: f"{1e3 + 2 * n:.4e}", 1198.0),
        (lambda n: f"{1e3 + 10 * n:.3e}".replace(".", ","), 1990.0),
    ],
)
def test_decimal_marks_and_thousands(text, last, tmp_path):
    path = table(tmp_path / "t.csv", ["rms"], lambda n: [text(n)], ";")
    overalls = read_overalls(path)
    assert overalls.values["rms"][-1] == pytest.approx(last)
    assert np.isfinite(overalls.values["rms"]).all()


def test_another_column_decides_on_marks_that_read_either_way(tmp_path):
    def fields(n):
        return [f"{0.5 + 0.01 * n:.2f}".replace(".", ","), f"{1200 + n % 7:,}".translate(GERMAN)]

    overalls = read_overalls(table(tmp_path / "t.csv", ["rms", "peak"], fields, ";"))
    assert overalls.values["peak"][0] == 1200.0


def test_quoted_decimals_beside_an_integer_column(tmp_path):
    path = table(
        tmp_path / "t.csv",
        ["rms", "count"],
        lambda n: [f'"{0.9 + 0.01 * n:.3f}"'.replace(".", ","), 17 + n % 5],
    )
    assert read_overalls(path).values["rms"][0] == 0.9


def test_words_are_counted(tmp_path):
    path = table(tmp_path / "t.csv", ["rms"], lambda n: ["Bad" if n < 3 else LEVELS[n]])
    assert read_overalls(path).notes == (
        "Column rms has 3 entries without a number, such as Bad; they count as missing.",
    )


@pytest.mark.parametrize(
    ("field", "message"),
    [
        (lambda n: f"{1200 + n:,}", "numbers such as 1,200, which may be 1.200 or 1200; write"),
        (lambda n: "1,5" if n % 2 else "1.5", "has decimal points and decimal commas; write"),
    ],
)
def test_ambiguous_numbers_are_refused(field, message, tmp_path):
    with pytest.raises(BadInput, match=message):
        read_overalls(table(tmp_path / "t.csv", ["rms"], lambda n: [field(n)], ";"))


# Columns
# ---------------------------------------------------------------------------------


def test_repeated_names_keep_their_headings(tmp_path):
    heading = ["rms [mm/s]", "rms [g]", "state", "peak", "peak"]
    path = table(tmp_path / "t.csv", heading, lambda n: [LEVELS[n] * k for k in range(1, 6)])
    overalls = read_overalls(path)
    assert overalls.units == {
        "rms [mm/s]": "mm/s",
        "rms [g]": "g",
        "state (column)": "",
        "peak": "",
        "peak (2)": "",
    }
    assert overalls.values["rms [g]"][0] == 2.0 * LEVELS[0]


def test_half_filled_columns_are_values(tmp_path):
    path = table(
        tmp_path / "t.csv", ["a", "b"], lambda n: [LEVELS[n], ""] if n % 2 else ["", LEVELS[n]]
    )
    judged = track_overalls(path)
    assert [np.isfinite(values).sum() for values in judged.overalls.values.values()] == [50, 50]
    assert (judged.state, judged.blind) == ("none", "")


def test_columns_left_out_have_a_reason(tmp_path):
    def row(n):
        more = {"few": 1.0} if n < 5 else {}
        return {"rms": LEVELS[n], "on": True, "gain": 192, "tag": "DE", "m": {"a": 1}} | more

    overalls = read_overalls(json_lines(tmp_path / "t.jsonl", row))
    assert [*overalls.values] == ["rms"]
    assert sorted(overalls.notes) == [
        "Column few has only 5 numbers in 100 rows and is left out.",
        "Column gain is always 192 and is left out.",
        "Column m holds nested values and is left out.",
        "Column on holds true and false and is left out.",
        "Column tag holds text, such as DE, and is left out.",
    ]


def test_samples_in_several_units(tmp_path):
    samples = np.random.default_rng(1).standard_normal((COUNT, 50))

    def row(other):
        return lambda n: {"unit": other if n % 2 else "m/s^2", "values": [*samples[n]]}

    overalls = read_overalls(json_lines(tmp_path / "t.jsonl", row("g")))
    assert overalls.units == {"rms": "m/s^2", "kurtosis": ""}
    assert overalls.values["rms"][:2] == pytest.approx(samples.std(axis=1)[:2] * [1.0, 9.80665])
    with pytest.raises(BadInput, match=r"rows in different units \(m/s\^2, mm/s\); write all"):
        read_overalls(json_lines(tmp_path / "t.jsonl", row("mm/s")))


@pytest.mark.parametrize("values", [{"a": 1}, [[1, 2], [3]], ["a"], "abc", [{"a": 1}]])
def test_samples_that_are_no_numbers_are_refused(values, tmp_path):
    path = json_lines(tmp_path / "t.jsonl", lambda _: {"values": values})
    with pytest.raises(BadInput, match="line 1 has values that are no list of numbers; write"):
        read_overalls(path)


@pytest.mark.parametrize(
    ("rows", "line"), [("2025-01-01,1,2\n", 2), ("2025-01-01,1\n2025-01-02\n", 3)]
)
def test_rows_have_as_many_fields_as_the_heading(rows, line, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text(f"time,rms\n{rows}")
    with pytest.raises(BadInput, match=f"line {line} has .* the heading 2; write one field"):
        read_overalls(path)


def test_a_trailing_separator_is_allowed(tmp_path):
    path = table(tmp_path / "t.csv", ["rms"], lambda n: [LEVELS[n], ""])
    assert np.allclose(read_overalls(path).values["rms"], LEVELS)


# Conditions
# ---------------------------------------------------------------------------------


def test_conditions_by_their_units(tmp_path):
    heading = ["rms [g]", "temperature [degC]", "speed [rpm]", "load [kN]", "quality"]
    path = table(
        tmp_path / "t.csv", heading, lambda n: [LEVELS[n], 40 + n % 5, 1500, 1.5 + n % 2, 192]
    )
    overalls = read_overalls(path)
    assert [*overalls.values] == ["rms"]
    firsts = {key: values[0] for key, values in overalls.conditions.items()}
    assert firsts == {"temperature_degc": 40.0, "speed_hz": 25.0, "load_n": 1500.0}
    assert "Column quality holds codes and is left out." in overalls.notes


@pytest.mark.parametrize(("unit", "value"), [("°F", 140.0), ("K", 333.15), ("°C", 60.0)])
def test_temperatures_in_other_units(unit, value, tmp_path):
    path = table(tmp_path / "t.csv", ["rms", f"oil [{unit}]"], lambda n: [LEVELS[n], value])
    assert read_overalls(path).conditions["temperature_degc"][0] == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("heading", "message"),
    [
        ("temperature", "states no unit, but temperature_degc needs degC"),
        ("load [%]", "is in %, but load_n needs N, kN"),
        ("shaft speed", "states no unit, but speed_hz needs Hz"),
    ],
)
def test_conditions_without_a_known_unit_are_refused(heading, message, tmp_path):
    path = table(tmp_path / "t.csv", ["rms", heading], lambda n: [LEVELS[n], 50 + n % 5])
    with pytest.raises(BadInput, match=message):
        read_overalls(path)


def test_parts_of_a_machine_are_no_conditions(tmp_path):
    path = table(
        tmp_path / "t.csv", ["high speed shaft [mm/s]", "load side rms"], lambda n: [1 + n % 2, n]
    )
    assert read_overalls(path).conditions == {}


# Times
# ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("heading", "first", "times"),
    [
        ("date,time", "2025-01-03,04:00", "2025-01-03T04:00:00"),
        ("Datum,Uhrzeit", "13.01.25,04:00:30", "2025-01-13T04:00:30"),
        ("Datum,Uhrzeit", "13.01.2025,04:00:30", "2025-01-13T04:00:30"),
        ("time,date", "04:00,2025-01-03", "2025-01-03T04:00:00"),
        ("time", "20250103040000", "2025-01-03T04:00:00"),
        ("time", "20250103", "2025-01-03T00:00:00"),
        ("time", "2025-01-03T04:00:00+02:00", "2025-01-03T02:00:00Z"),
        ("time", "2025-01-03 04:00:00.25Z", "2025-01-03T04:00:00.25Z"),
        ("time", "1735876800000", "2025-01-03T04:00:00"),
    ],
)
def test_times(heading, first, times, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text(f"{heading},rms\n{first},1.5\n")
    assert read_overalls(path).times == [times]


def test_a_zone_of_parquet_is_shown_in_utc(tmp_path):
    times = pandas.date_range("2025-01-03 04:00", periods=3, freq="h", tz="Europe/Berlin")
    values = [Decimal("1.0"), Decimal("1.1"), Decimal("1.2")]
    pandas.DataFrame({"time": times, "rms": values}).to_parquet(tmp_path / "t.parquet")
    overalls = read_overalls(tmp_path / "t.parquet")
    assert overalls.times[0] == "2025-01-03T03:00:00Z"
    assert overalls.values["rms"].tolist() == [1.0, 1.1, 1.2]


@pytest.mark.parametrize(
    ("first", "message"),
    [
        ("04:00", "has times of day without a date; add a column date"),
        ("1e30", "times up to 1e\\+30, which are no seconds since 1970; write ISO 8601"),
    ],
)
def test_unusable_times_are_refused(first, message, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text(f"time,rms\n{first},1.5\n")
    with pytest.raises(BadInput, match=message):
        read_overalls(path)


# Judgement
# ---------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["dB", "dBV", "VdB", "AdB"])
def test_decibels_are_logarithmic(unit, tmp_path):
    def fields(n):
        return [-30.0 + 20.0 * np.log10(LEVELS[n] * (5.0 if n >= 90 else 1.0))]

    judged = track_overalls(table(tmp_path / "t.csv", [f"level [{unit}]"], fields))
    assert (judged.state, judged.blind) == ("alarm", "")
    assert judged.level.factor == pytest.approx(5.0, rel=0.15)


def test_zones_are_those_of_rms_velocities(tmp_path):
    heading = ["velocity [mm/s rms]", "velocity pk [mm/s]", "velocity", "v [mm/s 0-p]"]
    path = table(tmp_path / "t.csv", heading, lambda n: [3 * LEVELS[n]] + 3 * [9 * LEVELS[n]])
    (tmp_path / "t.csv.json").write_text('{"machine_class": "medium-rigid"}')
    judged = track_overalls(path)
    assert (judged.state, judged.raised_by) == ("alert", "zone")
    assert [note.partition(", because ")[2] for note in judged.notes if "zone" in note] == [
        "it is a peak value; add the rms.",
        "it states no unit; write velocity [mm/s].",
        "it is a peak value; add the rms.",
    ]


@pytest.mark.parametrize(
    ("ending", "reason"),
    [
        (0.0, "b has no value above 0 in the last row"),
        (1.1, "b has not changed in the last 30 rows"),
        ("", "b has no value in the last 40 rows"),
        ("inf", "b is infinite in the last row"),
    ],
)
def test_a_blind_sensor_beside_another_is_reported(ending, reason, tmp_path):
    def fields(n):
        return [LEVELS[n] * (6.0 if n > 90 else 1.0), LEVELS[-n] if n < 60 else ending]

    judged = track_overalls(table(tmp_path / "t.csv", ["a", "b"], fields))
    assert judged.state == "alarm"
    assert judged.scalars()["sensor"] == {"state": "blind", "reason": reason}
    assert f"Blind: {reason}; the alarm is that of the others." in judged.notes
    alone = track_overalls(table(tmp_path / "u.csv", ["b"], lambda n: fields(n)[1:]))
    assert (alone.state, alone.reason) == ("blind", reason)


@pytest.mark.parametrize(
    ("given", "rows"),
    [
        ("03.01.2025 04:00", 53),
        ("2025-01-03T04:00:00", 53),
        ("2025-01-03T04:00", 53),
        ("2025-01-03 05:00+01:00", 53),
        ("2025-01-03", 72),
        ("last", COUNT),
    ],
)
def test_acknowledged_stamps(given, rows, tmp_path):
    times = pandas.date_range("2025-01-01", periods=COUNT, freq="h").strftime("%d.%m.%Y %H:%M")
    path = tmp_path / "t.csv"
    path.write_text("\n".join(["time;rms", *(f"{time};1.5" for time in times)]))
    assert track_overalls(path, acknowledge=given).acknowledged == rows
