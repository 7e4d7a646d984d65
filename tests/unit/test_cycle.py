"""Cycles of load and speeds: their tables, machines, windows of rough contacts, totals."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case, load_machine
from asperity.contact.conditions import ElasticPair
from asperity.contact.cycle import OperatingCycle
from asperity.core.errors import BadInput, UnreadableFile
from asperity.machine import BallBearing, HelicalGear, machine_cycle
from asperity.simulation import CycleInstant, machine_contact_cycle, solve_cycle
from asperity.simulation.cycle.film import cycle_grid, merged, smooth_surfaces
from asperity.simulation.cycle.instants import (
    CELLS,
    SLIDING_CELLS,
    InstantJob,
    InstantRow,
    solve_instant,
    window_times,
)
from asperity.simulation.cycle.result import CycleResult
from asperity.simulation.cycle.run import _combined
from asperity.transient import cycle_contact
from asperity.transient.cycle import _mean_speeds
from asperity.wear import WearCoefficient

EXAMPLES = Path(__file__).parents[2] / "examples"
CAM = """
[machine]
kind = "cam-flat"
base_radius = "20 mm"
lift = "7 mm"
half_angle = "75 deg"
width = "14 mm"
speed = "1000 rpm"
spring_load = "250 N"
spring_rate = "35 N/mm"
follower_mass = "0.15 kg"

[lubricant]
viscosity = { law = "roelands", eta0 = "0.01 Pa s", alpha = "15 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.85 g/cm^3" }
rheology = { law = "newtonian" }

[surface]
kind = "flat"
"""


def ramp(**changes):
    table = {
        "times": [0.0, 1.0, 3.0],
        "loads": [100.0, 200.0, 400.0],
        "speeds": [(2.0, 0.0), (4.0, 2.0), (-2.0, 0.0)],
        "radii": [0.01, 0.02, 0.02],
    }
    return OperatingCycle(**(table | changes))


def turning(speed=2.0, period=0.04, sliding=0.5):
    phase = np.linspace(0.0, 2.0 * math.pi, 361)
    mean = speed * np.cos(phase)
    return OperatingCycle(
        times=period * phase / (2.0 * math.pi),
        loads=np.full(361, 300.0),
        speeds=np.c_[mean + 0.5 * sliding, mean - 0.5 * sliding],
        radii=np.full(361, 0.01),
    )


def test_conditions_between_the_rows_vary_linearly():
    instant = ramp().state(2.0)
    assert instant == (2.0, 300.0, (1.0, 1.0), 0.02, 300.0)
    assert (instant.entrainment_speed, instant.sliding_speed) == (1.0, 0.0)
    assert ramp().state(0.5).speeds == (3.0, 1.0)


def test_paths_are_the_integrals_of_the_speeds():
    cycle = ramp()
    assert cycle.travelled(0.0) == (0.0, 0.0)
    assert cycle.travelled(1.0) == pytest.approx((3.0, 1.0))
    assert cycle.travelled(2.0) == pytest.approx((3.0 + 2.5, 1.0 + 1.5))
    assert cycle.travelled(3.0) == pytest.approx((3.0 + 2.0, 1.0 + 2.0))
    # outside a cycle that does not repeat, the speeds are those of its ends
    assert cycle.travelled(-1.0) == pytest.approx((-2.0, 0.0))
    assert cycle.travelled(4.0) == pytest.approx((5.0 - 2.0, 3.0))
    assert cycle.state(-1.0)[1:] == cycle.state(0.0)[1:]
    turns = turning()
    times = np.linspace(-0.02, 0.1, 4001)
    paths = np.array([turns.travelled(float(time)) for time in times])
    speeds = np.array([turns.state(float(time)).speeds for time in times])
    slopes = np.diff(paths, axis=0) / np.diff(times)[:, None]
    np.testing.assert_allclose(slopes, 0.5 * (speeds[1:] + speeds[:-1]), atol=2e-3)


def test_a_cycle_repeats_only_if_its_ends_agree():
    assert turning().repeats
    assert turning().state(0.05).load == turning().state(0.01).load
    assert not ramp().repeats
    passage = OperatingCycle([0.0, 1.0], [5.0, 5.0], [(1.0, 1.0)] * 2, [0.1, 0.1], continuous=False)
    assert not passage.repeats


def test_x_points_in_the_direction_of_entrainment():
    contact = load_case(EXAMPLES / "paper.toml").conditions
    forwards, backwards = (ramp().conditions(time, contact) for time in (0.5, 2.9))
    assert forwards.surface_speeds == (3.0, 1.0)
    assert backwards.surface_speeds == pytest.approx((1.7, -0.1))
    assert ramp().reverses
    still = ramp(speeds=[(2.0, 0.0), (0.0, 0.0), (-2.0, 0.0)])
    assert still.conditions(1.0, contact).entrainment_speed == 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"times": [0.0, 2.0, 1.0]}, "must increase from 0"),
        ({"times": [0.5, 2.0, 3.0]}, "must increase from 0"),
        ({"loads": [100.0, 0.0, 400.0]}, "load of a cycle must be positive, got 0 N at 1 s"),
        ({"radii": [0.01, math.nan, 0.02]}, "radius of a cycle must be positive, got nan m at 1 s"),
        ({"speeds": [(1.0, 0.0), (math.inf, 0.0), (1.0, 0.0)]}, "speeds of a cycle must be finite"),
        ({"loads": [100.0, 200.0]}, "a cycle of 3 times needs as many"),
        ({"times": [0.0]}, "2 to 100000 rows, got 1"),
        ({"times": [0.0, 1.0, math.inf]}, "times of a cycle must be finite"),
        ({"positions": [0.0, 1.0]}, "as many positions and carried loads, got 2 and 3"),
    ],
)
def test_impossible_tables_are_rejected(changes, message):
    with pytest.raises(BadInput, match=message):
        ramp(**changes)


def test_even_times_gather_where_the_conditions_change():
    cycle = OperatingCycle(
        times=[0.0, 1.0, 1.1, 10.0],
        loads=[100.0, 100.0, 400.0, 400.0],
        speeds=[(1.0, 1.0)] * 4,
        radii=[0.01] * 4,
    )
    times = cycle.even_times(30)
    assert (times[0], times[-1]) == (0.0, 10.0)
    assert np.all(np.diff(times) > 0.0)
    during = np.count_nonzero((times > 1.0) & (times < 1.1))
    assert during >= 9  # half of the change lasts a hundredth of the time


def test_a_grid_is_symmetric_only_if_oil_turns_round():
    case = load_case(EXAMPLES / "paper.toml")
    grid = cycle_grid(turning(), case.conditions, case.lubricant)
    assert grid.lower[0] == -grid.upper[0]
    one_way = OperatingCycle([0.0, 1.0], [300.0] * 2, [(1.0, 1.0)] * 2, [0.01] * 2)
    grid = cycle_grid(one_way, case.conditions, case.lubricant)
    assert -grid.lower[0] > 1.5 * grid.upper[0]


@pytest.mark.parametrize("time", [0.0, 0.0096, 0.01, 0.0297])
def test_steps_of_a_window_follow_the_oil_over_whole_cells(time):
    """Otherwise roughness moves a cell relative to it, or less; the instant is one of the steps."""
    spacing, half_width, cycle = 4e-6, 80e-6, turning()
    times = window_times(cycle, time, spacing, half_width)
    assert time in times
    assert np.all(np.diff(times) > 0.0)
    assert np.max(np.diff(times)) <= 1.001 * cycle.period / 200.0
    whole = 0
    for begin, end in itertools.pairwise(times):
        before, after = cycle.travelled(begin), cycle.travelled(end)
        first, second = ((b - a) / spacing for a, b in zip(before, after, strict=True))
        oil, slid = abs(0.5 * (first + second)), 0.5 * abs(first - second)
        followed = min(abs(oil - 1.0), abs(oil - 2.0)) < 1e-6
        whole += followed
        assert oil < 2.0 + 1e-6
        assert slid <= (CELLS if followed else SLIDING_CELLS) + 1e-6
    if time == 0.0:
        assert whole == len(times) - 1
        lengths = np.diff([cycle.travelled(float(moment))[0] for moment in times]) / spacing
        assert np.median(lengths) > 1.5  # two cells of oil, if roughness slides little


def test_a_window_extends_beyond_a_cycle_that_does_not_repeat():
    """At the conditions of its end, so that its first instant has forgotten the start, too."""
    for time in (0.0, 3.0):
        times = window_times(ramp(), time, 4e-6, 80e-6)
        assert times[0] < time < times[-1]
        assert np.all(np.diff(times) > 0.0)
    from_rest = window_times(ramp(), 1e-5, 4e-6, 80e-6, 0.0)
    assert from_rest[0] == 0.0
    assert window_times(ramp(), 0.0, 4e-6, 80e-6, 0.0)[0] == 0.0


def test_the_first_instant_of_an_asymmetric_table_is_solved():
    case = load_case(EXAMPLES / "paper.toml").among_many
    cycle = OperatingCycle(
        times=[0.0, 0.002, 0.004],
        loads=[500.0, 300.0, 400.0],
        speeds=[(2.0, 1.0), (1.2, 2.0), (2.0, 1.5)],
        radii=[case.conditions.radius] * 3,
    )
    first = solve_instant(InstantJob(case, cycle, 0.0, 0, coarse=True, start="steady"))
    assert (first.reason, first.failed) == ("", 0)
    assert 0.1 < first.numbers["clr"] < 0.9


def test_steps_of_no_length_are_rejected():
    case = load_case(EXAMPLES / "paper.toml").with_written({"surface": "flat"})
    grid = cycle_grid(turning(), case.conditions, case.lubricant)
    steps = cycle_contact(
        turning(), case.conditions, case.lubricant, smooth_surfaces(grid), np.zeros(2)
    )
    with pytest.raises(BadInput, match="must increase"):
        next(steps)


def test_a_grid_holds_a_short_peak_of_the_load():
    case = load_case(EXAMPLES / "paper.toml")
    peak = OperatingCycle(
        times=[0.0, 0.0505, 0.051, 0.0515, 0.1],
        loads=[500.0, 500.0, 20e3, 500.0, 500.0],
        speeds=[(1.0, 1.0)] * 5,
        radii=[0.01] * 5,
    )
    grid = cycle_grid(peak, case.conditions, case.lubricant)
    half_width = peak.conditions(0.051, case.conditions).hertz.half_widths[0]
    assert grid.lower[0] <= -2.0 * half_width
    assert grid.upper[0] >= 1.5 * half_width


def test_a_grid_holds_a_load_without_entrainment():
    case = load_case(EXAMPLES / "paper.toml")
    peak = OperatingCycle(
        times=[0.0, 0.04, 0.05, 0.06, 0.1],
        loads=[500.0, 500.0, 20e3, 500.0, 500.0],
        speeds=[(1.0, 1.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 1.0)],
        radii=[0.01] * 5,
    )
    grid = cycle_grid(peak, case.conditions, case.lubricant)
    half_width = peak.conditions(0.05, case.conditions).hertz.half_widths[0]
    assert grid.upper[0] >= 1.5 * half_width


def test_a_step_that_follows_oil_has_its_mean_speed():
    state = turning().state(0.005)
    first, second = _mean_speeds(state, 1.2)
    assert 0.5 * (first + second) == pytest.approx(1.2)
    assert first - second == pytest.approx(state.sliding_speed)


def test_times_equal_but_for_rounding_are_one():
    times = merged(np.array([0.0, 0.1, 0.3]), np.array([0.1 + 1e-17, 0.2]), period=0.3)
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3])


# Case files
# --------------------------------------------------------------------------------------------------


def case_with(tmp_path, cycle, **overrides):
    text = (EXAMPLES / "paper.toml").read_text("utf-8") + cycle
    (tmp_path / "case.toml").write_text(text, "utf-8")
    return load_case(tmp_path / "case.toml").with_written(overrides)


def test_start_and_stop_scale_the_speeds_of_the_contact(tmp_path):
    case = case_with(
        tmp_path,
        '\n[cycle]\nkind = "start-stop"\nrise = "0.1 s"\nrunning = "1 s"\nfall = "0.2 s"\n'
        'rest = "0.3 s"\n',
    )
    cycle = case.contents.cycle.cycle(case.conditions, case.folder)
    np.testing.assert_allclose(cycle.times, [0.0, 0.1, 1.1, 1.3, 1.6])
    assert cycle.state(0.05).speeds == pytest.approx(
        tuple(0.5 * speed for speed in case.conditions.surface_speeds)
    )
    assert cycle.state(1.5).speeds == (0.0, 0.0)
    assert cycle.repeats
    assert load_case(case.text, folder=case.folder) == case


def test_an_oscillation_is_a_cosine_of_both_speeds(tmp_path):
    case = case_with(tmp_path, '\n[cycle]\nkind = "oscillation"\nfrequency = "25 Hz"\n')
    cycle = case.contents.cycle.cycle(case.conditions, case.folder)
    assert cycle.period == pytest.approx(0.04)
    assert cycle.reverses
    first, second = case.conditions.surface_speeds
    assert cycle.state(0.0).speeds == pytest.approx((first, second))
    assert cycle.state(0.02).speeds == pytest.approx((-first, -second))
    stroke = cycle.travelled(0.01)[0]
    assert stroke == pytest.approx(first / (2.0 * math.pi * 25.0), rel=1e-4)


def test_a_table_is_read_with_its_columns(tmp_path):
    (tmp_path / "cycle.csv").write_text(
        "time_s,load_n,speed_first_m_s,speed_second_m_s\n0,100,1,2\n0.5,300,2,2\n", "utf-8"
    )
    case = case_with(tmp_path, '\n[cycle]\nkind = "table"\nfile = "cycle.csv"\n')
    cycle = case.contents.cycle.cycle(case.conditions, case.folder)
    assert cycle.state(0.25)[:4] == (0.25, 200.0, (1.5, 2.0), case.conditions.radius)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("time,load\n0,1\n", "must have the columns time_s, load_n"),
        ("time_s,load_n,speed_first_m_s,speed_second_m_s,x\n0,1,1,1,1\n", "must have the columns"),
        ("time_s,load_n,speed_first_m_s,speed_second_m_s\n0,1,a,1\n", "speed_first_m_s must be"),
        ("", "must have the columns"),
    ],
)
def test_other_tables_are_rejected(tmp_path, content, message):
    (tmp_path / "cycle.csv").write_text(content, "utf-8")
    case = case_with(tmp_path, '\n[cycle]\nkind = "table"\nfile = "cycle.csv"\n')
    with pytest.raises(UnreadableFile, match=message):
        solve_cycle(case)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"lubricant": "none", "contact.entrainment_speed": "0 m/s"}, "a cycle needs an oil"),
        ({"model": "conserving", "inlet.layer": "1 um"}, "got an inlet layer"),
    ],
)
def test_contacts_that_have_no_cycle_are_rejected(tmp_path, overrides, message):
    cycle = '\n[cycle]\nkind = "oscillation"\nfrequency = "25 Hz"\n'
    with pytest.raises(BadInput, match=message):
        solve_cycle(case_with(tmp_path, cycle, surface="flat", **overrides))


def test_instants_outside_the_cycle_are_rejected(tmp_path):
    case = case_with(tmp_path, '\n[cycle]\nkind = "oscillation"\nfrequency = "25 Hz"\n')
    with pytest.raises(BadInput, match=r"between 0 and the period of 0\.04 s"):
        solve_cycle(case, instants=[0.0, 0.05])
    for count in (0, 1):
        with pytest.raises(BadInput, match=f"2 to 200, got {count}"):
            solve_cycle(case, instants=count)


def test_a_cycle_without_entrainment_is_rejected(tmp_path):
    (tmp_path / "cycle.csv").write_text(
        "time_s,load_n,speed_first_m_s,speed_second_m_s\n0,100,1,-1\n0.5,300,2,-2\n", "utf-8"
    )
    case = case_with(tmp_path, '\n[cycle]\nkind = "table"\nfile = "cycle.csv"\n', surface="flat")
    with pytest.raises(BadInput, match="entrains no oil at any time"):
        solve_cycle(case)


# Machines
# --------------------------------------------------------------------------------------------------


def machine(tmp_path, text):
    (tmp_path / "machine.toml").write_text(text, "utf-8")
    return load_machine(tmp_path / "machine.toml")


def test_a_cam_turns_once_in_its_period(tmp_path):
    case = machine(tmp_path, CAM)
    _, cycle = machine_cycle(case.machine, case.pair)
    speed = 1000.0 * 2.0 * math.pi / 60.0
    assert cycle.period == pytest.approx(0.06)
    assert cycle.repeats
    assert cycle.place == "cycle_angle"
    nose = cycle.state(0.03)
    assert cycle.position(0.03) == pytest.approx(0.0, abs=1e-9)
    bend = -0.5 * 7e-3 * (math.pi / math.radians(75.0)) ** 2
    radius = 20e-3 + 7e-3 + bend
    assert nose.radius == pytest.approx(radius, rel=1e-3)
    assert nose.speeds == pytest.approx((speed * radius, speed * bend), rel=1e-3)
    assert nose.load == pytest.approx(250.0 + 35e3 * 7e-3 + 0.15 * speed**2 * bend, rel=1e-3)
    base = cycle.state(0.0)
    assert (base.load, base.radius) == pytest.approx((250.0, 20e-3))
    assert base.speeds == pytest.approx((speed * 20e-3, 0.0))


def test_a_tooth_passes_the_path_of_contact_with_its_load_shares():
    case = load_machine(EXAMPLES / "fzg-c.toml")
    gear = case.machine
    _, cycle = machine_cycle(gear, case.pair)
    points = gear.path
    assert cycle.period == pytest.approx(
        gear.contact_ratio * gear.base_pitch / (gear.speed * gear.base_radii[0])
    )
    assert not cycle.repeats
    shares = np.interp(
        [points[name] for name in ("A", "AB", "C", "DE", "E")],
        cycle.positions,
        np.asarray(cycle.loads) / gear.normal_force,
    )
    assert shares == pytest.approx([1 / 3, 1 / 2, 1.0, 1 / 2, 1 / 3], rel=1e-3)
    # before B the share rises to 2/3, and then to 1 within a thousandth of the path
    jump = np.interp(
        points["B"] + np.array([-1e-3, 1e-3]) * (points["E"] - points["A"]),
        cycle.positions,
        np.asarray(cycle.loads) / gear.normal_force,
    )
    assert jump == pytest.approx([2 / 3, 1.0], rel=5e-3)
    pitch = cycle.state(float(np.interp(points["C"], cycle.positions, cycle.times)))
    assert abs(pitch.sliding_speed) < 2e-3 * pitch.entrainment_speed


def test_two_teeth_carry_the_whole_load_of_a_spur_gear():
    case = load_machine(EXAMPLES / "fzg-c.toml")
    _, cycle = machine_cycle(case.machine, case.pair)
    pitch = case.machine.base_pitch
    for distance in np.linspace(case.machine.path["A"], case.machine.path["B"], 23)[1:-2]:
        shares = np.interp([distance, distance + pitch], cycle.positions, cycle.loads)
        assert shares.sum() == pytest.approx(case.machine.normal_force, rel=1e-3)


def test_the_slice_of_a_helical_gear_passes_with_its_line_load():
    gear = HelicalGear(
        module=4.5e-3,
        teeth=(16, 24),
        pressure_angle=math.radians(20.0),
        profile_shift=(0.18, 0.17),
        face_width=0.2,
        torque=265.1,
        speed=227.0,
        helix_angle=math.radians(15.0),
    )
    contact, cycle = machine_cycle(gear, ElasticPair((206e9, 206e9), (0.3, 0.3)))
    ahead = 0.5 * gear.face_width * math.tan(gear.base_helix_angle)
    for distance, load in zip(cycle.positions[::40], cycle.loads[::40], strict=True):
        line_load = float(gear.line_load(distance, distance - ahead))
        assert load == pytest.approx(line_load * gear.line_length, rel=1e-9)
        # of one slice, never more than the largest of a mesh cycle
        assert load <= (1.0 + 1e-9) * gear.contact("slice", distance).load
    assert contact.load == pytest.approx(max(cycle.loads))
    assert contact.length == gear.line_length
    # energy and wear count all slices of the face, b/cos β_b long
    whole = gear.face_width / math.cos(gear.base_helix_angle) / gear.line_length
    assert np.asarray(cycle.carried) == pytest.approx(whole * np.asarray(cycle.loads))


@pytest.mark.parametrize("name", ["6206", "nu206"])
def test_a_rolling_element_passes_the_load_zone_with_the_cage(name):
    case = load_machine(EXAMPLES / f"{name}.toml")
    contact, cycle = machine_cycle(case.machine, case.pair)
    assert not cycle.repeats
    of_contacts = {
        entry.position: entry.conditions(case.pair).load
        for entry in case.contacts
        if entry.bodies[0] == "inner ring"
    }
    for position, load in of_contacts.items():
        turned = (position + math.pi) % (2.0 * math.pi) - math.pi
        if cycle.positions[0] < turned < cycle.positions[-1]:
            assert np.interp(turned, cycle.positions, cycle.loads) == pytest.approx(load, rel=1e-3)
    assert max(cycle.loads) == pytest.approx(contact.conditions(case.pair).load)
    cage = 2.0 * math.pi * case.machine.frequencies["ftf_hz"]
    travelled = cycle.positions[-1] - cycle.positions[0]
    assert cycle.period == pytest.approx(travelled / cage, rel=1e-6)
    assert cycle.loads[0] == pytest.approx(0.02 * max(cycle.loads), rel=0.5)


def test_a_profiled_roller_is_solved_for_its_line_load_and_counted_with_its_load(tmp_path):
    text = (EXAMPLES / "nu206.toml").read_text("utf-8") + '\nmachine.profile = "iso"\n'
    text = text.replace("\n[", '\nmachine.profile = "iso"\n[', 1) if "\n[" in text else text
    case = machine(tmp_path, text)
    _, cycle = machine_cycle(case.machine, case.pair)
    worst = max(case.contacts, key=lambda contact: contact.load)
    assert max(cycle.carried) == pytest.approx(worst.load, rel=1e-6)
    assert max(cycle.loads) == pytest.approx(worst.line_load * worst.length, rel=1e-6)
    assert max(cycle.loads) > 1.1 * max(cycle.carried)


def test_a_load_zone_in_two_parts_is_followed_through_the_heavier_one():
    bearing = BallBearing(
        balls=9,
        ball_diameter=7.94e-3,
        pitch_diameter=39.04e-3,
        speed=188.0,
        radial_load=300.0,
        tilt=8e-3,
    )
    pair = ElasticPair((206e9, 206e9), (0.3, 0.3))
    _, cycle = machine_cycle(bearing, pair)
    assert not cycle.repeats
    assert max(cycle.loads[0], cycle.loads[-1]) < 0.1 * max(cycle.loads)
    assert np.max(np.abs(np.diff(cycle.loads))) < 0.05 * max(cycle.loads)  # no gap is bridged


def test_a_stated_cycle_applies_to_the_most_loaded_contact(tmp_path):
    text = (EXAMPLES / "6206.toml").read_text("utf-8")
    case = machine(tmp_path, text + '\n[cycle]\nkind = "oscillation"\nfrequency = "2 Hz"\n')
    chosen, cycle = machine_contact_cycle(case)
    worst = max(case.contacts, key=lambda contact: contact.load)
    assert chosen.conditions.load == pytest.approx(worst.load)
    assert cycle.state(0.0).load == pytest.approx(worst.load)
    assert cycle.state(0.25).entrainment_speed == pytest.approx(-worst.entrainment_speed)


def test_a_machine_of_constant_contact_has_no_cycle(tmp_path):
    text = CAM[CAM.index("[lubricant]") :]
    discs = (
        '[machine]\nkind = "twin-disc"\nradii = ["20 mm", "20 mm"]\nload = "500 N"\n'
        'length = "10 mm"\nentrainment_speed = "2 m/s"\nslide_to_roll = 0.1\n'
    )
    with pytest.raises(BadInput, match=r"has no cycle of its own; state one in \[cycle\]"):
        machine_contact_cycle(machine(tmp_path, discs + text))


# Totals
# --------------------------------------------------------------------------------------------------


def instant(time, clr, friction=0.1, half=0.05):
    return CycleInstant(
        time=time,
        numbers={"clr": clr, "friction_coefficient": friction},
        half_widths={"clr": half, "friction_coefficient": 0.0},
        friction_sides=(0.01, 0.02),
        tracks=3,
    )


def result_of(instants, wear=None):
    cycle = turning(speed=0.0001, period=2.0, sliding=0.5)
    return CycleResult(
        case=None,
        cycle=cycle,
        film=None,
        coarse=None,
        steady_times=np.array([]),
        steady=[],
        steady_thinnest=math.nan,
        instants=tuple(instants),
        wear_coefficients=wear,
        seconds=0.0,
    )


class Course:
    """Film without further numbers."""

    def __init__(self):
        self.measured = {}


def test_friction_energy_is_force_times_path():
    """0.1 times 300 N over 0.5 m/s for 2 s, with the interval of the coefficient."""
    result = result_of([instant(time, 0.5) for time in (0.0, 0.5, 1.0, 1.5)])
    object.__setattr__(result, "film", Course())
    energy = result.friction_energy
    assert energy.value == pytest.approx(30.0)
    assert (energy.low, energy.high) == pytest.approx((27.0, 36.0))
    object.__setattr__(result, "cycle", turning(speed=0.0001, period=2.0, sliding=-0.5))
    assert result.friction_energy.value == pytest.approx(30.0)


def test_wear_is_archards_with_the_load_of_the_asperities():
    first, second = WearCoefficient.from_value(1e-15), WearCoefficient.from_value(3e-15)
    result = result_of(
        [instant(0.0, 0.5), instant(0.5, 0.3), instant(1.0, 0.1), instant(1.5, 0.3)],
        (first, second),
    )
    object.__setattr__(result, "film", Course())
    worn = result.wear_volume(0)
    assert worn.value == pytest.approx(1e-15 * 0.3 * 300.0 * 1.0, rel=1e-6)
    assert result.wear_volume(1).value == pytest.approx(3.0 * worn.value)
    assert worn.low < worn.value * first.low
    assert worn.high > worn.value * first.high
    assert result.mean_clr.value == pytest.approx(0.3)


def test_a_number_without_an_interval_gives_a_total_without_one():
    few = result_of(
        [instant(0.0, 0.5), instant(1.0, 0.1)]
    )  # nor do few instants, by their distance
    object.__setattr__(few, "film", Course())
    assert (few.mean_clr.value, few.mean_clr.low) == (pytest.approx(0.3), None)
    result = result_of([instant(0.0, 0.5, half=None), instant(1.0, 0.1)])
    object.__setattr__(result, "film", Course())
    assert result.mean_clr.value == pytest.approx(0.3)
    assert result.mean_clr.low is None
    assert result.instants[0].interval("clr") == (None, None)
    assert result.instants[1].interval("clr") == pytest.approx((0.05, 0.15))


def row(clr, reason=""):
    numbers = {"clr": clr, "car": clr, "friction_below": 0.01, "friction_above": 0.02}
    return InstantRow({} if reason else numbers, 10, 0, reason)


def test_tracks_are_corrected_by_the_difference_of_both_grids():
    """Mean of 0.5, 0.6 and 0.4; half-width by Student's t of three, and the grids' difference."""
    combined = _combined(0.1, row(0.5), [row(0.3), row(0.4), row(0.2)], [])
    assert combined.numbers["clr"] == pytest.approx(0.5)
    scatter = 2.919986 * 0.1 / math.sqrt(3.0)
    assert combined.half_widths["clr"] == pytest.approx(math.hypot(scatter, 0.2), rel=1e-5)
    assert (combined.tracks, combined.friction_sides) == (3, (0.01, 0.02))


def test_without_a_coarse_grid_tracks_are_those_of_the_fine_one():
    failed = row(0.0, "too coarse")
    combined = _combined(0.1, row(0.5), [failed, failed], [row(0.7)])
    assert combined.numbers["clr"] == pytest.approx(0.6)
    assert combined.half_widths["clr"] is None
    unsolved = _combined(0.1, failed, [failed], [])
    assert (unsolved.reason, unsolved.numbers) == ("too coarse", {})


class Film:
    """Film of 1 um, thinner by a share."""

    def __init__(self, thinner):
        self.times, self.measured = np.array([0.0, 2.0]), {}
        self.h_min = self.h_central = np.array([1.0, 1.0]) * 1e-6 * (1.0 - thinner)

    def interpolated(self, name, times):
        return np.interp(times, self.times, getattr(self, name))


def test_the_interval_of_a_film_is_by_cells_and_time_steps():
    result = result_of([])
    object.__setattr__(result, "film", Film(0.0))
    assert result.film_interval("h_min", 1.0) == (None, None)
    object.__setattr__(result, "coarse", Film(0.03))
    low, high = result.film_interval("h_min", 1.0)
    error = math.hypot(0.03, 0.02)
    assert (low, high) == pytest.approx((1e-6 * (1.0 - error), 1e-6 * (1.0 + error)), rel=1e-9)


def test_energy_counts_the_carried_load():
    cycle = OperatingCycle(
        times=[0.0, 2.0],
        loads=[300.0, 300.0],
        speeds=[(1.25, 0.75)] * 2,
        radii=[0.01, 0.01],
        carried=[100.0, 100.0],
    )
    result = result_of([instant(time, 0.5) for time in (0.0, 0.5, 1.0, 1.5)])
    object.__setattr__(result, "film", Course())
    object.__setattr__(result, "cycle", cycle)
    assert result.friction_energy.value == pytest.approx(10.0)
