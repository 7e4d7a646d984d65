"""Command line: parses arguments, calls the library, prints. One module per group of commands.

The first line of the output is the verdict; `--json` prints one object and nothing else; progress
goes to stderr. Exit codes: 0 done, 2 bad input or usage, 1 anything else; of `track` and `watch` 3
an alarm (of `infer --forecast`, too), 4 they cannot tell, 5 sensor or machine off.
"""

from asperity.cli import (
    benchmark,
    check,
    contact,
    export,
    friction,
    infer,
    machine,
    new,
    observe,
    page,
    pages,
    rig,
    sensitivity,
    store,
    study,
    surface,
    track_watch,
    vibrate,
)
from asperity.cli.app import app, main
from asperity.cli.simulated import cycle, deplete, motion, wear

__all__ = [
    "app",
    "benchmark",
    "check",
    "contact",
    "cycle",
    "deplete",
    "export",
    "friction",
    "infer",
    "machine",
    "main",
    "motion",
    "new",
    "observe",
    "page",
    "pages",
    "rig",
    "sensitivity",
    "store",
    "study",
    "surface",
    "track_watch",
    "vibrate",
    "wear",
]
