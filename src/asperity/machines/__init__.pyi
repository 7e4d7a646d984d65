from .fatigue_ratings import DangVan as DangVan
from .rating_facts import Rating as Rating
from .result import MachineResult as MachineResult
from .solve import machine_conditions as machine_conditions
from .solve import solve_machine as solve_machine
from .sweep import MachineSweep as MachineSweep
from .sweep import sweep_machine as sweep_machine
from .sweep import sweep_points as sweep_points
