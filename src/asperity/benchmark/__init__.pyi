from .cases import BenchmarkCase as BenchmarkCase
from .cases import Certified as Certified
from .cases import load_benchmark as load_benchmark
from .run import BenchmarkResult as BenchmarkResult
from .run import BenchmarkRow as BenchmarkRow
from .run import run_benchmark as run_benchmark
from .solver import Solver as Solver
from .solver import solver_named as solver_named
