"""Comparison of runs of one case at several roughness levels."""

from collections.abc import Mapping

from asperity.results.run import Run


def levels_verdict(runs: Mapping[str, Run]) -> str:
    """Return one sentence on load share and resonance over increasing roughness levels."""
    levels = list(runs)
    solved = list(runs.values())
    first, last = solved[0], solved[-1]
    first_clr, last_clr = (f"{100 * run.state.clr:.0f} %" for run in (first, last))
    at_last = last.resonance_text().removeprefix("contact resonance ")
    verdict = (
        f"From Sq {levels[0]} to {levels[-1]} the asperity load share changes from {first_clr} to "
        f"{last_clr}; {first.resonance_text()} at the first level, {at_last} at the last."
    )
    unfinished = not_converged(runs)
    return (
        f"NOT CONVERGED at Sq {', '.join(unfinished)}, do not use: {verdict}"
        if unfinished
        else verdict
    )


def not_converged(runs: Mapping[str, Run]) -> list[str]:
    """Return the roughness levels whose contacts did not converge."""
    return [level for level, run in runs.items() if not run.converged]
