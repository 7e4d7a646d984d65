"""Readers in a subprocess, where a damaged file may crash them, hang them or exhaust memory.

One subprocess serves all reads of its parent and ends with it. It starts with the first read and
again after a crash or timeout, which the caller gets as UnreadableFile.
"""

import atexit
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.limits import GIGABYTE, MEMORY, reading_limit, stored_size
from asperity.core.third_party import first_line

BASE_SECONDS = 12.0  # CPU time of a read
SECONDS_PER_MEGABYTE = 1.0  # additional CPU time, by the file's size
WALL_CLOCK_FACTOR = 4.0  # wall-clock over CPU time, for a busy machine
EXIT_TIMEOUT_S = 4.0  # wall-clock limit for a crashed subprocess to end
LOADING_S = 300.0  # wall-clock limit for importing a library
_START = "import sys; sys.path[:] = sys.argv[1:]; from asperity.core.sandbox import serve; serve()"


def read_in_subprocess(
    path: Path, reader: str, *arguments: object, remedy: str, library: str = ""
) -> Any:
    """Return `reader(path, *arguments)`, run in the subprocess.

    Parameters
    ----------
    path : absolute path of the file
    reader : "module:function"
    remedy : end of the message of UnreadableFile
    library : module to import before the read; its import has a time limit of its own

    Raises
    ------
    BadInput
        Raised by the reader.
    ImportError
        The reader needs a library that is not installed.
    UnreadableFile
        The reader failed, crashed, or exceeded its time or memory.
    """
    stored = stored_size(path)
    memory = reading_limit(stored)
    seconds = BASE_SECONDS + SECONDS_PER_MEGABYTE * stored / 1e6
    limits = (memory, seconds)
    server = _current_server()
    if library:  # outside the time limit of the read
        server.request(("asperity.core.sandbox:load", (library,), (math.inf, math.inf)), LOADING_S)
    outcome, content = server.request(
        (reader, (path, *arguments), limits), WALL_CLOCK_FACTOR * seconds
    )
    if outcome == "read":
        return content
    if isinstance(content, BadInput) and outcome == "refused":
        raise content
    if outcome == "missing":
        raise ImportError(content)
    raise UnreadableFile(
        {
            "failed": f"{path.name} is damaged ({content}); {remedy}",
            "late": f"{path.name} took longer than {seconds:.0f} s to read; {remedy}",
            "full": f"{path.name} needs more than {memory / GIGABYTE:.2g} GB of memory to be read; "
            f"{remedy}, or set {MEMORY} if the file is correct",
            "died": f"{path.name} is damaged: its reader crashed; {remedy}",
        }[outcome]
    )


# Parent process
# ------------------------------------------------------------------------------------------


class _Server:
    """The parent's handle on the reading subprocess."""

    def __init__(self) -> None:
        self.parent = os.getpid()
        self.lock = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def request(self, message: object, seconds: float) -> tuple[str, object]:
        """Send a request; return its outcome and content."""
        with self.lock:
            if self.process is None:
                self.process = subprocess.Popen(
                    [sys.executable, "-c", _START, *sys.path],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                )
            process = self.process
            late = threading.Event()
            assert process.stdin is not None
            assert process.stdout is not None

            def stop() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(seconds, stop)
            timer.daemon = True
            timer.start()
            try:
                pickle.dump(message, process.stdin, 5)
                process.stdin.flush()
                response: tuple[str, object] = pickle.load(process.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                with suppress(subprocess.TimeoutExpired):
                    process.wait(EXIT_TIMEOUT_S)
                code = process.returncode
                self.end()
                return (
                    "late" if late.is_set() or code == -getattr(signal, "SIGXCPU", 0) else "died"
                ), None
            except BaseException:  # Ctrl-C: a late answer must not be taken for the next request's
                self.end()
                raise
            finally:
                timer.cancel()
            if late.is_set():
                self.end()
            return response

    def end(self) -> None:
        """Stop the subprocess if it runs."""
        process, self.process = self.process, None
        if process is None or os.getpid() != self.parent:
            return
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(OSError):
                if stream is not None:
                    stream.close()


_servers: list[_Server] = []


def _current_server() -> _Server:
    """Return the server of this process; an inherited one belongs to the parent."""
    if not _servers or _servers[0].parent != os.getpid():
        _servers[:] = [_Server()]
        atexit.register(_servers[0].end)
    return _servers[0]


# Reading subprocess
# ------------------------------------------------------------------------------------------


def serve() -> None:
    """Answer requests from standard input until it closes; main function of the subprocess."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    while True:
        try:
            reader, arguments, limits = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(_answer(reader, arguments, *limits), answers, 5)
        answers.flush()


def load(library: str) -> None:
    """Import a library without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import_module(library)


def _answer(
    reader: str, arguments: tuple[object, ...], memory: float, seconds: float
) -> tuple[str, object]:
    module, _, name = reader.partition(":")
    try:
        function = getattr(import_module(module), name)
        _limit_resources(memory, seconds)
        return "read", function(*arguments)
    except BadInput as refusal:
        return "refused", type(refusal)(str(refusal))
    except ImportError as error:
        return "missing", str(error)
    except MemoryError:
        return "full", None
    except Exception as error:  # noqa: BLE001 - any error of a library
        return "failed", first_line(error)


def _limit_resources(memory: float, seconds: float) -> None:
    """Limit additional memory and CPU time, where the system supports such limits."""
    with suppress(ImportError, OSError, ValueError, StopIteration):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_CPU)
        spent = time.process_time()
        soft = hard if math.isinf(seconds) else math.ceil(spent + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))

        status = Path("/proc/self/status").read_text("ascii").splitlines()
        used = next(int(line.split()[1]) << 10 for line in status if line.startswith("VmData:"))
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(
            resource.RLIMIT_DATA, (hard if math.isinf(memory) else int(used + memory), hard)
        )
