"""Scale drawing of a machine with its contacts and their loads."""

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from asperity.case import MachineCase
from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.machine import (
    BallBearing,
    Cam,
    CylindricalRollerBearing,
    FlatCam,
    FourPointBearing,
    RollerCam,
    SpurGear,
    TaperedRollerBearing,
    TwinDisc,
)
from asperity.machines import MachineResult, machine_conditions
from asperity.report.base import Exhibit
from asperity.report.style import BLUE, GREY, VERMILION, Medium, Style

MM = 1e3
METAL, MATE, EDGE, IDLE = "#e5e7eb", "#d7dde5", "#556070", "#ffffff"
HEIGHT = 4.3  # inches
Polyline = tuple[Field, Field]
RollingBearing = CylindricalRollerBearing | TaperedRollerBearing | BallBearing | FourPointBearing


def machine_sketch(result: MachineResult) -> Exhibit:
    """Draw the machine to scale and mark its worst contact."""
    machine = result.case.machine
    draw: Callable[[Axes], None]
    if isinstance(machine, SpurGear):
        draw, caption = (
            partial(_gears, machine, result),
            (
                "Gear pair in mesh, to scale: the pinion (below) drives. Contact runs along the "
                f"line of action from A to E{_single_contact(machine)}. Fillets are not shown."
            ),
        )
    elif isinstance(machine, RollingBearing):
        draw, caption = (
            partial(_bearing, machine, result),
            (
                "Side view of the bearing, to scale. Shaded rolling elements carry load; the bars "
                "show it relative to the largest. The load on the inner ring acts downwards."
            ),
        )
    elif isinstance(machine, TwinDisc):
        draw = partial(_discs, machine)
        caption = "Side view of both discs, to scale."
    else:
        assert isinstance(machine, Cam)
        draw, caption = (
            partial(_cam, machine, result),
            ("Cam and follower at the worst contact, to scale. Dots: solved positions on the cam."),
        )

    def drawn(medium: Medium) -> Figure:
        figure, axes = medium.panel(HEIGHT)
        axes.set_aspect("equal")
        axes.set_axis_off()
        draw(axes)
        return figure

    return Exhibit("machine", drawn, caption, f"{machine.title()}, drawn to scale. {caption}")


def machine_drawing(case: MachineCase) -> tuple[str, str, str]:
    """Draw a machine without solving it; return data URI, alternative text and caption."""
    picture = machine_sketch(machine_conditions(case)).picture()
    return picture.uri, picture.alt, picture.caption


def _circle(axes: Axes, x: float, y: float, radius: float, **style: Any) -> None:
    axes.add_patch(
        Circle((MM * x, MM * y), MM * radius, **{"facecolor": "none", "edgecolor": EDGE, **style})
    )


def _line(axes: Axes, line: Polyline, **style: Any) -> None:
    axes.plot(MM * line[0], MM * line[1], **{"color": EDGE, "linewidth": 1.0, **style})


def _note(
    axes: Axes, text: str, position: tuple[float, float], shift: tuple[float, float], **style: Any
) -> None:
    """Write a note beside a position [m]; `shift` in points."""
    axes.annotate(
        text,
        (MM * position[0], MM * position[1]),
        shift,
        textcoords="offset points",
        **{"ha": "center", "color": VERMILION, "fontsize": "small", **style},
    )


def _frame(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    axes.set(xlim=(MM * x[0], MM * x[1]), ylim=(MM * y[0], MM * y[1]))


# Bearings
# ---------------------------------------------------------------------------------


def _bearing(bearing: RollingBearing, result: MachineResult, axes: Axes) -> None:
    diameter, loads = _loaded_elements(bearing, result)
    middle = bearing.pitch_diameter / 2.0
    radius = diameter / 2.0
    wall = 0.35 * diameter
    inner = middle - radius
    outer = middle + radius
    rim = outer + wall
    bore = inner - wall
    room = 1.1 * diameter
    _draw_rings(axes, rim, outer, inner, bore)
    largest = float(loads.max())
    for number, (angle, load) in enumerate(zip(bearing.angles, loads, strict=True)):
        _rolling_element(axes, number, middle * _direction(angle), radius, load / largest)
        if load > 0.0:
            _load_bar(axes, _direction(angle), rim, room * (load / largest))
    x, y = (rim + room) * _direction(bearing.angles[int(np.argmax(loads))])
    _note(axes, quantity("load_n").text(largest), (x, y), (0, -3), va="top")
    _draw_load(axes, bearing, bore)
    size = rim + 0.3 * diameter
    _frame(axes, (-size - room, size + room), (-size - 1.2 * room, size))


def _draw_rings(axes: Axes, rim: float, outer: float, inner: float, bore: float) -> None:
    for radius, colour in ((rim, METAL), (outer, "white"), (inner, METAL), (bore, "white")):
        _circle(axes, 0.0, 0.0, radius, facecolor=colour)


def _loaded_elements(bearing: RollingBearing, result: MachineResult) -> tuple[float, Field]:
    """Return the diameter of the rolling elements [m] and their loads [N]."""
    if isinstance(bearing, BallBearing):
        return bearing.ball_diameter, bearing.loads(result.case.pair)[0]
    if isinstance(bearing, FourPointBearing):
        return bearing.ball_diameter, bearing.loads(result.case.pair)[0].max(axis=0)
    return bearing.roller_diameter, bearing.loads


def _load_bar(axes: Axes, direction: Field, rim: float, length: float) -> None:
    bar = MM * np.outer(direction, [rim, rim + length])
    axes.plot(*bar, color=VERMILION, linewidth=4.0, solid_capstyle="butt")


def _direction(angle: float) -> Field:
    """Return the unit vector at an angle from the bottom of a bearing."""
    return np.array([math.sin(angle), -math.cos(angle)])


def _rolling_element(axes: Axes, number: int, centre: Field, radius: float, share: float) -> None:
    """Draw a numbered rolling element, shaded by its share of the largest load."""
    x, y = centre
    colour = BLUE if share > 0.0 else IDLE
    opacity = 0.25 + 0.6 * share
    _circle(axes, x, y, radius, facecolor=colour, alpha=opacity, zorder=2)
    axes.text(MM * x, MM * y, str(number), ha="center", va="center", fontsize="x-small", zorder=3)


def _draw_load(axes: Axes, bearing: RollingBearing, bore: float) -> None:
    """Draw the load on the shaft and the direction of rotation of the inner ring."""
    labels = []
    if bearing.radial_load > 0.0:
        style: Style = {"arrowstyle": "-|>", "color": VERMILION, "linewidth": 2.0}
        axes.annotate("", (0.0, -MM * 0.55 * bore), (0.0, MM * 0.3 * bore), arrowprops=style)
        labels.append(quantity("load_n").text(bearing.radial_load))
    if isinstance(bearing, TaperedRollerBearing):
        axial = bearing.thrust
    else:
        axial = getattr(bearing, "axial_load", 0.0)
    if axial > 0.0:
        labels.append(f"{quantity('load_n').text(axial)} axial")
    axes.text(
        0.0,
        MM * 0.38 * bore,
        "\n".join(labels),
        ha="center",
        va="bottom",
        color=VERMILION,
        fontsize="small",
    )
    angles = np.linspace(math.radians(150.0), math.radians(30.0), 40)
    arc = 0.85 * bore * np.array([np.cos(angles), np.sin(angles)])
    _line(axes, (arc[0], arc[1]), color=GREY)
    axes.annotate(
        "",
        tuple(MM * arc[:, -1]),
        tuple(MM * arc[:, -3]),
        arrowprops={"arrowstyle": "-|>", "color": GREY},
    )


# Gears
# ---------------------------------------------------------------------------------


def _gears(gears: SpurGear, result: MachineResult, axes: Axes) -> None:
    """Draw the pinion below and the wheel above, in contact at the worst point."""
    foot, along = _line_of_action(gears)
    pinion, wheel = _mesh(gears, foot + result.worst["position"] * along)
    axes.fill(MM * pinion[0], MM * pinion[1], facecolor=METAL, edgecolor=EDGE, linewidth=0.9)
    axes.fill(MM * wheel[0], MM * wheel[1], facecolor=MATE, edgecolor=EDGE, linewidth=0.9)
    points = np.array([foot + s * along for s in gears.path.values()])
    _line(axes, (points[[0, -1], 0], points[[0, -1], 1]), color=VERMILION, linewidth=1.6)
    _mark_path(axes, gears.path, points, result.worst["name"])
    size = 0.62 * float(np.ptp(points[:, 0])) + 1.2 * gears.module
    x, y = points.mean(axis=0)
    _frame(axes, (x - size, x + size), (y - 0.8 * size, y + 0.8 * size))


def _single_contact(gears: SpurGear) -> str:
    if gears.overlap_ratio > 0.0:
        return " in every section across the face, one after the other"
    return "; between B and D a single pair of teeth carries the load"


def _line_of_action(gears: SpurGear) -> tuple[Field, Field]:
    """Return the start of the line of action on the pinion's base circle, and its direction."""
    sine = math.sin(gears.working_angle)
    cosine = math.cos(gears.working_angle)
    return gears.base_radii[0] * np.array([sine, cosine]), np.array([-cosine, sine])


def _mesh(gears: SpurGear, touching: Field) -> tuple[Polyline, Polyline]:
    """Return the outlines of pinion and wheel in contact at a point."""
    centres = gears.centres
    # in the wheel's frame, rotated by 180 degrees
    wheel = _flanks(gears, 1, np.array([0.0, centres]) - touching)
    return _flanks(gears, 0, touching), (-wheel[0], centres - wheel[1])


def _mark_path(axes: Axes, names: Iterable[str], points: Field, worst: str) -> None:
    """Mark and name the points of the path of contact, the worst in bold."""
    for side, (name, (x, y)) in enumerate(zip(names, points, strict=True)):
        is_worst = name == worst
        size = 6.0 if is_worst else 3.5
        axes.plot(MM * x, MM * y, "o", color=VERMILION, markersize=size)
        style = {"color": "black", "fontweight": "bold" if is_worst else "normal"}
        _note(axes, name, (x, y), (0, 8) if side % 2 else (0, -9), va="center", **style)


def _flanks(gears: SpurGear, body: int, contact_point: Field) -> Polyline:
    """Return the outline of a gear about its axis with a flank through the contact point.

    The y axis points towards the mesh.
    """
    teeth = gears.teeth[body]
    half, tooth_angles, tooth_radii = _tooth(gears, body)
    base = gears.base_radii[body]
    contact_angle = math.acos(min(base / float(np.hypot(*contact_point)), 1.0))
    first = math.atan2(contact_point[0], contact_point[1]) + half - _involute(contact_angle)
    angles = (first + math.tau * np.arange(teeth)[:, None] / teeth + tooth_angles).ravel()
    radius = np.tile(tooth_radii, teeth)
    return radius * np.sin(angles), radius * np.cos(angles)


def _tooth(gears: SpurGear, body: int) -> tuple[float, Field, Field]:
    """Return half the angle of a tooth at the base circle, and its outline in polar coordinates."""
    base, root, tip = gears.base_radii[body], gears.root_radii[body], gears.tip_radii[body]
    half = gears.half_tooth_angles[body]
    radii = np.linspace(max(base, root), tip, 25)
    pressure_angles = np.arccos(np.clip(base / radii, -1.0, 1.0))
    # angle of a flank from the middle of its tooth, at each radius
    flank = half - (np.tan(pressure_angles) - pressure_angles)
    angles = np.concatenate([[-half], -flank, flank[::-1], [half]])
    return half, angles, np.concatenate([[root], radii, radii[::-1], [root]])


def _involute(angle: float) -> float:
    return math.tan(angle) - angle


# Discs and cams
# ---------------------------------------------------------------------------------


def _discs(discs: TwinDisc, axes: Axes) -> None:
    first, second = discs.radii
    for number, (x, radius, speed) in enumerate(
        zip((-first, second), discs.radii, discs.turning, strict=True), 1
    ):
        _circle(axes, x, 0.0, radius, facecolor=METAL)
        turning = f"disc {number}\n{speed * 30.0 / math.pi:.4g} r/min"
        axes.text(MM * x, 0.0, turning, ha="center", va="center", fontsize="small")
    axes.plot(0.0, 0.0, "o", color=VERMILION, markersize=6)
    _note(axes, quantity("load_n").text(discs.load), (0.0, 0.0), (0, 12))
    half_height = 1.05 * max(first, second)
    _frame(axes, (-2.1 * first, 2.1 * second), (-half_height, half_height))


def _cam(cam: Cam, result: MachineResult, axes: Axes) -> None:
    """Draw the cam rotated to its worst contact; the follower moves upwards."""
    rotation = result.worst["position"]
    angles = np.linspace(-math.pi, math.pi, 721)
    outline = np.array([_on_cam(cam, angle) for angle in angles])
    cosine = math.cos(rotation)
    sine = math.sin(rotation)
    matrix = np.array([[cosine, -sine], [sine, cosine]])
    x, y = (outline @ matrix.T).T
    axes.fill(MM * x, MM * y, facecolor=METAL, edgecolor=EDGE, linewidth=1.0)
    _circle(axes, 0.0, 0.0, cam.base_radius, linestyle=":")
    axes.plot(0.0, 0.0, "+", color=EDGE)
    dots = np.array([_on_cam(cam, angle) for angle in cam.angles]) @ matrix.T
    axes.plot(MM * dots[:, 0], MM * dots[:, 1], "o", color=GREY, markersize=3)
    height = _follower(axes, cam, rotation)
    axes.plot(*(MM * (matrix @ _on_cam(cam, rotation))), "o", color=VERMILION, markersize=6)
    size = 1.1 * (cam.base_radius + cam.law.largest)
    _frame(axes, (-size, size), (-size, 1.05 * (cam.base_radius + cam.law.largest + height)))


def _follower(axes: Axes, cam: Cam, rotation: float) -> float:
    """Draw the follower of a rotated cam; return its height [m]."""
    lift = cam.base_radius + cam.lift_at(rotation)
    if isinstance(cam, RollerCam):
        middle = cam.base_radius + cam.roller_radius + cam.lift_at(rotation)
        _circle(axes, 0.0, middle, cam.roller_radius, facecolor=MATE)
        axes.plot(0.0, MM * middle, "+", color=EDGE)
        return 2.0 * cam.roller_radius
    x = 1.1 * cam.base_radius * np.array([-1.0, 1.0, 1.0, -1.0])
    y = lift + np.array([0.0, 0.0, 0.2, 0.2]) * cam.base_radius
    axes.fill(MM * x, MM * y, facecolor=MATE, edgecolor=EDGE, linewidth=1.0)
    return 0.4 * cam.base_radius


def _on_cam(cam: Cam, angle: float) -> Field:
    """Return the contact point at a cam angle, in the cam's frame with the nose up."""
    law = cam.law
    limited = abs(angle) if law.symmetric else angle
    limited = min(max(limited, law.ends[0]), law.ends[1])
    along = np.array([math.sin(angle), math.cos(angle)])
    across = np.array([math.cos(angle), -math.sin(angle)])
    lift = cam.base_radius + cam.lift_at(limited)
    slope = law(limited, 1) * (math.copysign(1.0, angle) if law.symmetric else 1.0)
    if isinstance(cam, FlatCam):
        return np.asarray(lift * along + slope * across)
    assert isinstance(cam, RollerCam)
    centre = (lift + cam.roller_radius) * along
    normal = (lift + cam.roller_radius) * along - slope * across
    return np.asarray(centre - cam.roller_radius * normal / float(np.hypot(*normal)))
