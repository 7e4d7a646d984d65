"""Readers that cannot be trusted with damaged files, in a process of their own: there they may crash, hang or swell.

One process serves all reads of its parent and ends with it. It is started when it is first needed;
a read that it does not survive, or that takes too long, is a sentence, and the next one starts
another.
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

SECONDS, A_MEGABYTE = (
    12.0,
    1.0,
)  # of a processor that a read may take: at all, and for every megabyte of the file
PATIENCE = 4.0  # times that by the clock, for a machine that has other work
LOADING_S = 300.0  # by the clock, in which a library must be there
_START = "import sys; sys.path[:] = sys.argv[1:]; from asperity.core.sandbox import serve; serve()"


def read_apart(path: Path, reader: str, *arguments: Any, remedy: str, library: str = "") -> Any:
    """What a reader ("module:function") makes of the absolute `path` of a file and further arguments.

    The `library` that it needs is loaded before, in time of its own.

    Raises
    ------
    BadInput
        as the reader raises it.
    ImportError
        where it needs a library that is not installed.
    UnreadableFile
        for whatever else becomes of the reader; it ends with the remedy.
    """
    stored = stored_size(path)
    memory, seconds = reading_limit(stored), SECONDS + A_MEGABYTE * stored / 1e6
    limits = (memory, seconds)
    server = _serving()
    if library:  # before the read, whose time it is not
        server.ask(("asperity.core.sandbox:load", (library,), (math.inf, math.inf)), LOADING_S)
    fate, told = server.ask((reader, (path, *arguments), limits), PATIENCE * seconds)
    if fate == "read":
        return told
    if fate == "refused":
        refusal: BadInput = told
        raise refusal
    if fate == "missing":
        raise ImportError(told)
    raise UnreadableFile(
        {
            "failed": f"{path.name} is damaged ({told}); {remedy}",
            "late": f"{path.name} took longer than {seconds:.0f} s to read; {remedy}",
            "full": f"{path.name} needs more than {memory / GIGABYTE:.2g} GB of memory to be read; {remedy}, or set "
            f"{MEMORY} if it is right",
            "died": f"{path.name} is damaged: its reader crashed on it; {remedy}",
        }[fate]
    )


# The parent's side
# ----------------------------------------------------------------------------------------------------


class _Server:
    """The process that reads, as its parent sees it."""

    def __init__(self) -> None:
        self.parent = os.getpid()
        self.lock = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def ask(self, request: Any, seconds: float) -> tuple[str, Any]:
        """What became of a request, and what was made of it."""
        with self.lock:
            if self.process is None:
                self.process = subprocess.Popen(
                    [sys.executable, "-c", _START, *sys.path],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                )
            process, late = self.process, threading.Event()
            assert process.stdin is not None
            assert process.stdout is not None

            def stop() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(seconds, stop)
            timer.daemon = True
            timer.start()
            try:
                pickle.dump(request, process.stdin, 5)
                process.stdin.flush()
                answer: tuple[str, Any] = pickle.load(process.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                with suppress(subprocess.TimeoutExpired):
                    process.wait(PATIENCE)
                code = process.returncode
                self.end()
                return (
                    "late" if late.is_set() or code == -getattr(signal, "SIGXCPU", 0) else "died"
                ), None
            except (
                BaseException
            ):  # Ctrl-C: an answer that nobody waits for must not be taken for the next one's
                self.end()
                raise
            finally:
                timer.cancel()
            if late.is_set():
                self.end()
            return answer

    def end(self) -> None:
        """Stop the process, if it runs."""
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


def _serving() -> _Server:
    """The server of this process: one that was inherited by forking is the parent's."""
    if not _servers or _servers[0].parent != os.getpid():
        _servers[:] = [_Server()]
        atexit.register(_servers[0].end)
    return _servers[0]


# The reader's side
# ----------------------------------------------------------------------------------------------------


def serve() -> None:
    """Answer requests on standard input until it is closed; run in the process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    while True:
        try:
            reader, arguments, limits = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(_answer(reader, arguments, *limits), answers, 5)
        answers.flush()


def load(library: str) -> None:
    """Load a library, and nothing else."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import_module(library)


def _answer(
    reader: str, arguments: tuple[Any, ...], memory: float, seconds: float
) -> tuple[str, Any]:
    module, _, name = reader.partition(":")
    try:
        function = getattr(import_module(module), name)
        _take_at_most(memory, seconds)
        return "read", function(*arguments)
    except BadInput as refusal:
        return "refused", type(refusal)(str(refusal))
    except ImportError as error:
        return "missing", str(error)
    except MemoryError:
        return "full", None
    except Exception as error:  # noqa: BLE001 - whatever a library stumbles over
        return "failed", first_line(error)


def _take_at_most(memory: float, seconds: float) -> None:
    """Let this process take so much beside what it has; where the system knows no such limits, its parent's clock."""
    with suppress(ImportError, OSError, ValueError, StopIteration):
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_CPU)
        spent = time.process_time()
        soft = most if math.isinf(seconds) else math.ceil(spent + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (soft, most))

        status = Path("/proc/self/status").read_text("ascii").splitlines()
        taken = next(int(line.split()[1]) << 10 for line in status if line.startswith("VmData:"))
        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(
            resource.RLIMIT_DATA, (most if math.isinf(memory) else int(taken + memory), most)
        )
