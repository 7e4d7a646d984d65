"""The command line: parses, calls, prints. No physics. One module a group of commands.

The first line of the output is the verdict; `--json` prints one object and nothing else; progress goes to stderr.
Exit codes: 0 done, 2 bad input or usage, 3 done but the verdict is an alarm, 1 anything else.
"""

from asperity.cli import (  # each adds its commands
    contact,
    exploration,
    friction,
    live,
    machine,
    motion,
    new,
    pages,
    recordings,
    rig,
    study,
    surface,
    vibrate,
    wear,
)
from asperity.cli.app import app, main

__all__ = [
    "app",
    "contact",
    "exploration",
    "friction",
    "live",
    "machine",
    "main",
    "motion",
    "new",
    "pages",
    "recordings",
    "rig",
    "study",
    "surface",
    "vibrate",
    "wear",
]
