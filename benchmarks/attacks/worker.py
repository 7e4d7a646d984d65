"""Attacks of one kind in a process that may die: a line of JSON before and after each."""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

from asperity.core.errors import BadInput
from benchmarks.attacks import damage, inputs, names, runner

KINDS = {
    "case files": inputs.cases,
    "--set values": inputs.settings,
    "damaged results": damage.results,
    "recordings and surfaces": damage.measured,
    "injections": names.injections,
}


def main(kind: str, first: int, last: int) -> None:
    """Do the attacks of a kind from one number to another; what they print is not ours."""
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def tell(**about: object) -> None:
        print(json.dumps(about), file=channel, flush=True)

    with tempfile.TemporaryDirectory(prefix="asperity-attack-") as folder:
        attack = KINDS[kind](Path(folder))
        for number in range(first, last):
            tell(begun=number)
            begun, spent = time.perf_counter(), runner.processor_s(os.getpid())
            try:
                fault = attack(number)
            except BadInput as refusal:
                fault = f"refusal that no command caught: {refusal}"[:200]
            except Exception as error:  # noqa: BLE001 - a traceback is what is looked for
                fault = f"traceback: {type(error).__name__}: {error}"[:200]
            megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
            processor = runner.processor_s(os.getpid()) - spent
            seconds = time.perf_counter() - begun
            tell(
                done=number,
                fault=fault,
                seconds=seconds,
                processor_s=processor,
                megabytes=megabytes,
            )


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
