"""asperity hears how a lubricated contact wears.

Mixed-EHL contact, load sharing of asperities and oil, contact resonance. Every public name is reached from here and
loaded when it is first used, so that `import asperity` costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from asperity.case import Case, load_case
    from asperity.conditions import ContactConditions, ElasticPair
    from asperity.coupling import Vibration, VibrationModel, contact_vibration
    from asperity.curves import FrictionCurve, stribeck_curve, traction_curve
    from asperity.ehl.cavitation import FilmSolution, solve_film
    from asperity.ehl.flash import FlashTemperature, flash_temperature
    from asperity.ehl.friction import Friction, friction
    from asperity.ehl.motion import Snapshot, moving_contact
    from asperity.ehl.sharing import LoadSharing, load_below, load_sharing
    from asperity.ehl.solution import ContactSolution, Convergence, Iteration, Options, Status
    from asperity.ehl.solve import solve_contact
    from asperity.ehl.state import ContactState, contact_state
    from asperity.ehl.stiffness import TangentStiffness, tangent_stiffness
    from asperity.ehl.storage import load_solution
    from asperity.ehl.stress import StressTensor, SubsurfaceStress, subsurface_stress
    from asperity.ehl.thermal import friction_and_heat, solve_thermal_contact
    from asperity.errors import AsperityError, BadInput, NotConverged, UnreadableFile
    from asperity.excitation import FilteredNoise, PatchAverage, SurfaceTrack
    from asperity.grid import Grid
    from asperity.hearing import HistoryVibration, history_vibration
    from asperity.history import History, load_history, run_history
    from asperity.lubricant import (
        BairWiner,
        Barus,
        DowsonHigginson,
        EyringShear,
        Incompressible,
        LinearBairWiner,
        Lubricant,
        Newtonian,
        NewtonianShear,
        ReeEyring,
        Roelands,
        Solid,
        Thermal,
    )
    from asperity.recording import Recording, check_recording, open_recording, read_recording
    from asperity.report import write_report
    from asperity.report.motion_page import write_motion_report
    from asperity.report.study_page import write_study_report
    from asperity.report.track_page import write_track_report
    from asperity.rig import Disturbance, Rig, RigRecording, simulate_rig
    from asperity.run import Run, load_run, solve_case
    from asperity.signals import Signal, Spectrum, averaged_spectrum, power_spectrum, smooth
    from asperity.study.anchors import Anchor, compare, load_anchors, rig_deviation, rig_prediction
    from asperity.study.calibration import Calibration, calibrate
    from asperity.study.curve import WearCurve, curve_of, wear_curve
    from asperity.study.execute import StudyResult, load_study, run_study, study_executor
    from asperity.study.plan import Plan, plan_points, plan_study
    from asperity.study.ranges import Range
    from asperity.study.sensitivity import Sensitivity, sensitivity
    from asperity.surface import (
        CompositeSurface,
        ProfileParameters,
        Surface,
        SurfaceParameters,
        flat_surface,
        gaussian_surface,
        ground_surface,
        non_gaussian_surface,
        prepare_surface,
        profile_parameters,
        read_surface,
        run_in_surface,
        sandblasted_surface,
        self_affine_surface,
        surface_parameters,
    )
    from asperity.surface.moving import MovingSurfaces
    from asperity.tracking import Track, track_recordings
    from asperity.vibration import ContactOscillator, acceleration, expected_spectrum, motion
    from asperity.wear.indicators import Resonance, contact_resonance
    from asperity.wear.lines import CleanSpectrum, remove_lines
    from asperity.wear.series import series_resonances
    from asperity.wear.stages import Stages, split_stages
    from asperity.wear.trend import Alarm, Facts, LoadShare, alarm, consistency, load_share

_NAMES = {
    "case": ("Case", "load_case"),
    "conditions": ("ContactConditions", "ElasticPair"),
    "coupling": ("Vibration", "VibrationModel", "contact_vibration"),
    "curves": ("FrictionCurve", "stribeck_curve", "traction_curve"),
    "ehl.cavitation": ("FilmSolution", "solve_film"),
    "ehl.flash": ("FlashTemperature", "flash_temperature"),
    "ehl.friction": ("Friction", "friction"),
    "ehl.motion": ("Snapshot", "moving_contact"),
    "ehl.sharing": ("LoadSharing", "load_below", "load_sharing"),
    "ehl.solution": ("ContactSolution", "Convergence", "Iteration", "Options", "Status"),
    "ehl.solve": ("solve_contact",),
    "ehl.state": ("ContactState", "contact_state"),
    "ehl.stiffness": ("TangentStiffness", "tangent_stiffness"),
    "ehl.storage": ("load_solution",),
    "ehl.stress": ("StressTensor", "SubsurfaceStress", "subsurface_stress"),
    "ehl.thermal": ("friction_and_heat", "solve_thermal_contact"),
    "errors": ("AsperityError", "BadInput", "NotConverged", "UnreadableFile"),
    "excitation": ("FilteredNoise", "PatchAverage", "SurfaceTrack"),
    "grid": ("Grid",),
    "hearing": ("HistoryVibration", "history_vibration"),
    "history": ("History", "load_history", "run_history"),
    "lubricant": (
        "BairWiner",
        "Barus",
        "DowsonHigginson",
        "EyringShear",
        "Incompressible",
        "LinearBairWiner",
        "Lubricant",
        "Newtonian",
        "NewtonianShear",
        "ReeEyring",
        "Roelands",
        "Solid",
        "Thermal",
    ),
    "recording": ("Recording", "check_recording", "open_recording", "read_recording"),
    "report": ("write_report",),
    "report.study_page": ("write_study_report",),
    "report.motion_page": ("write_motion_report",),
    "report.track_page": ("write_track_report",),
    "rig": ("Disturbance", "Rig", "RigRecording", "simulate_rig"),
    "run": ("Run", "load_run", "solve_case"),
    "signals": ("Signal", "Spectrum", "averaged_spectrum", "power_spectrum", "smooth"),
    "study.calibration": ("Calibration", "calibrate"),
    "study.ranges": ("Range",),
    "study.sensitivity": ("Sensitivity", "sensitivity"),
    "study.anchors": ("Anchor", "compare", "load_anchors", "rig_deviation", "rig_prediction"),
    "study.curve": ("WearCurve", "curve_of", "wear_curve"),
    "study.execute": ("StudyResult", "load_study", "run_study", "study_executor"),
    "study.plan": ("Plan", "plan_points", "plan_study"),
    "surface": (
        "CompositeSurface",
        "ProfileParameters",
        "Surface",
        "SurfaceParameters",
        "flat_surface",
        "gaussian_surface",
        "ground_surface",
        "non_gaussian_surface",
        "prepare_surface",
        "profile_parameters",
        "read_surface",
        "run_in_surface",
        "sandblasted_surface",
        "self_affine_surface",
        "surface_parameters",
    ),
    "surface.moving": ("MovingSurfaces",),
    "tracking": ("Track", "track_recordings"),
    "vibration": ("ContactOscillator", "acceleration", "expected_spectrum", "motion"),
    "wear.indicators": ("Resonance", "contact_resonance"),
    "wear.lines": ("CleanSpectrum", "remove_lines"),
    "wear.series": ("series_resonances",),
    "wear.stages": ("Stages", "split_stages"),
    "wear.trend": ("Alarm", "Facts", "LoadShare", "alarm", "consistency", "load_share"),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "Alarm",
    "Anchor",
    "AsperityError",
    "BadInput",
    "BairWiner",
    "Barus",
    "Calibration",
    "Case",
    "CleanSpectrum",
    "CompositeSurface",
    "ContactConditions",
    "ContactOscillator",
    "ContactSolution",
    "ContactState",
    "Convergence",
    "Disturbance",
    "DowsonHigginson",
    "ElasticPair",
    "EyringShear",
    "Facts",
    "FilmSolution",
    "FilteredNoise",
    "FlashTemperature",
    "Friction",
    "FrictionCurve",
    "Grid",
    "History",
    "HistoryVibration",
    "Incompressible",
    "Iteration",
    "LinearBairWiner",
    "LoadShare",
    "LoadSharing",
    "Lubricant",
    "MovingSurfaces",
    "Newtonian",
    "NewtonianShear",
    "NotConverged",
    "Options",
    "PatchAverage",
    "Plan",
    "ProfileParameters",
    "Range",
    "Recording",
    "ReeEyring",
    "Resonance",
    "Rig",
    "RigRecording",
    "Roelands",
    "Run",
    "Sensitivity",
    "Signal",
    "Snapshot",
    "Solid",
    "Spectrum",
    "Stages",
    "Status",
    "StressTensor",
    "StudyResult",
    "SubsurfaceStress",
    "Surface",
    "SurfaceParameters",
    "SurfaceTrack",
    "TangentStiffness",
    "Thermal",
    "Track",
    "UnreadableFile",
    "Vibration",
    "VibrationModel",
    "WearCurve",
    "acceleration",
    "alarm",
    "averaged_spectrum",
    "calibrate",
    "check_recording",
    "compare",
    "consistency",
    "contact_resonance",
    "contact_state",
    "contact_vibration",
    "curve_of",
    "expected_spectrum",
    "flash_temperature",
    "flat_surface",
    "friction",
    "friction_and_heat",
    "gaussian_surface",
    "ground_surface",
    "history_vibration",
    "load_anchors",
    "load_below",
    "load_case",
    "load_history",
    "load_run",
    "load_share",
    "load_sharing",
    "load_solution",
    "load_study",
    "motion",
    "moving_contact",
    "non_gaussian_surface",
    "open_recording",
    "plan_points",
    "plan_study",
    "power_spectrum",
    "prepare_surface",
    "profile_parameters",
    "read_recording",
    "read_surface",
    "remove_lines",
    "rig_deviation",
    "rig_prediction",
    "run_history",
    "run_in_surface",
    "run_study",
    "sandblasted_surface",
    "self_affine_surface",
    "sensitivity",
    "series_resonances",
    "simulate_rig",
    "smooth",
    "solve_case",
    "solve_contact",
    "solve_film",
    "solve_thermal_contact",
    "split_stages",
    "stribeck_curve",
    "study_executor",
    "subsurface_stress",
    "surface_parameters",
    "tangent_stiffness",
    "track_recordings",
    "traction_curve",
    "wear_curve",
    "write_motion_report",
    "write_report",
    "write_study_report",
    "write_track_report",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("asperity")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, "__version__"})
