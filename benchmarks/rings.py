"""CLR of the paper's twelve rings from their measured Sq, and from the two published CRF.

`python -m benchmarks.rings` runs this part alone; the emulator is that of `benchmarks.inference`.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from asperity.case import load_case
from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.inference import (
    Observation,
    Unknown,
    build_emulator,
    infer_observations,
    inference_setting,
)
from asperity.paper import CRF_ENDS_HZ, SAMPLES_SQ_UM, SAMPLES_STD_UM
from benchmarks.inference import CASE, KEPT

CRF_STD_HZ = 15.0  # size of a point in the paper's figure
LOAD_N, SPEED_M_S = 500.0, 1.91


def main() -> None:
    """Print the table."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder of the stored emulator")
    print("\n".join(lines(fast=True, kept=arguments.parse_args().kept)))


def lines(*, fast: bool, kept: Path = KEPT) -> Iterator[str]:  # noqa: ARG001 - already short
    """Yield the output of `python -m benchmarks rings`."""
    setting = inference_setting(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    clr, kg = quantity("clr"), quantity("mass_kg")
    yield "## The paper's rings at 500 N: CLR from Sq, and from a published CRF"
    yield (
        "| Sq [um] | CLR from Sq, 90 % | published CRF [Hz] | CLR from CRF, 90 % | bits |"
        " effective mass, 90 % | P(law own) |"
    )
    yield "|---|---|---|---|---|---|---|"
    for number, (sq, std) in enumerate(zip(SAMPLES_SQ_UM, SAMPLES_STD_UM, strict=True)):
        known = Unknown("sq_m", setting.contact[0].range, sq, std)
        ring = replace(setting, contact=(known, *setting.contact[1:]))
        printed = {0: CRF_ENDS_HZ[0], len(SAMPLES_SQ_UM) - 1: CRF_ENDS_HZ[1]}.get(number)
        observations = (
            []
            if printed is None
            else [
                Observation(
                    load_n=LOAD_N, entrainment_m_s=SPEED_M_S, crf_hz=printed, crf_std_hz=CRF_STD_HZ
                )
            ]
        )
        found = infer_observations(ring, emulator, observations)
        before = _interval(found.values(found.prior)["clr"])
        cells = [f"{sq:.2f} ± {std:.2f}", clr.interval(*before), "", "", "", "", ""]
        if printed is not None:
            share, mass = found.posterior()["clr"], found.posterior()["mass_kg"]
            cells[2:] = [
                f"{printed:.0f}",
                clr.interval(share.low, share.high),
                f"{share.information_bits:.1f}",
                kg.interval(mass.low, mass.high),
                f"{found.law_probability('own'):.2f}",
            ]
        yield f"| {' | '.join(cells)} |"
    yield "The paper states two of the twelve CRF; the other rings have only Sq."


def _interval(values: Field) -> tuple[float, float]:
    low, high = np.quantile(values, (0.05, 0.95))
    return float(low), float(high)


if __name__ == "__main__":
    main()
