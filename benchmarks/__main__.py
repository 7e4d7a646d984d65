"""`make bench`: every figure that the docs quote, measured in one run on one thread."""

import argparse
import platform
import statistics
import sys

from threadpoolctl import threadpool_limits

from benchmarks import (
    conserving,
    damping,
    films,
    friction,
    indicators,
    intervals,
    motion,
    motion_table,
    recordings,
    robustness,
    roughness_levels,
    speed,
    stress,
    study,
    surfaces,
    vibration,
)
from benchmarks.first_call import first_call


def main() -> None:
    """Run the benchmarks and print their tables as Markdown."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="leave out the solves 100 times tighter")
    wanted = arguments.parse_args()

    def told(one: roughness_levels.Outcome) -> None:
        print(f"  Sq {one.sq_um} um, seed {one.seed}: {one.seconds:.2f} s, CLR {one.clr:.4f}", file=sys.stderr)

    print(f"## Roughness levels of the paper's contact, 256 x 256 ({platform.processor() or platform.machine()})\n")
    with threadpool_limits(1):
        before = roughness_levels.fft_pair_seconds()
        results = roughness_levels.outcomes(tight=not wanted.fast, told=told)
        pair = statistics.mean([before, roughness_levels.fft_pair_seconds()])
    print("\n".join(roughness_levels.table(results)))
    median = statistics.median(one.seconds for one in results)
    print(
        f"\nMedian cold solve {median:.2f} s (slowest {max(one.seconds for one in results):.2f} s) = "
        f"{median / pair:.0f} times one real 512 x 512 FFT and back ({1e3 * pair:.2f} ms in the same run)."
    )
    seconds, said = first_call()
    print(
        f"\nFirst `asperity solve` after installation, compilation included: {seconds:.1f} s; "
        f"{'says what the wait is for' if said else 'SAYS NOTHING about the wait'}."
    )
    print()
    with threadpool_limits(1):
        for part in (
            speed,
            films,
            intervals,
            robustness,
            motion,
            motion_table,
            conserving,
            vibration,
            damping,
            surfaces,
            friction,
            stress,
            indicators,
        ):
            for line in part.lines(fast=wanted.fast):
                print(line, flush=True)
            print()
    for part in (recordings, study):  # on all processors, as their users have it
        for line in part.lines(fast=wanted.fast):
            print(line, flush=True)


if __name__ == "__main__":
    main()
