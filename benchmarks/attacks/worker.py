"""Run attacks of one kind in a disposable process; print a line of JSON before and after each."""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

from asperity.core.errors import BadInput
from benchmarks.attacks import damage, inputs, names, runner, stores

KINDS = {
    "case files": inputs.cases,
    "--set values": inputs.settings,
    "damaged results": damage.results,
    "recordings and surfaces": damage.measured,
    "stores": stores.damaged_stores,
    "injections": names.injections,
}


def main(kind: str, first: int, last: int) -> None:
    """Run the attacks of a kind from one number to another; discard their output."""
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def send(**about: object) -> None:
        print(json.dumps(about), file=channel, flush=True)

    with tempfile.TemporaryDirectory(prefix="asperity-attack-") as folder:
        attack = KINDS[kind](Path(folder))
        for number in range(first, last):
            send(start=number)
            start, processor_before = time.perf_counter(), runner.processor_s(os.getpid())
            try:
                fault = attack(number)
            except BadInput as refusal:
                fault = f"uncaught refusal: {refusal}"[:200]
            except Exception as error:  # noqa: BLE001 - tracebacks are faults
                fault = f"traceback: {type(error).__name__}: {error}"[:200]
            megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
            processor = runner.processor_s(os.getpid()) - processor_before
            seconds = time.perf_counter() - start
            send(
                done=number,
                fault=fault,
                seconds=seconds,
                processor_s=processor,
                megabytes=megabytes,
            )


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
