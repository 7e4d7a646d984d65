"""Runs of one case that differ in their roughness, in one sentence."""

from collections.abc import Mapping

from asperity.results.run import Run


def levels_verdict(runs: Mapping[str, Run]) -> str:
    """From where to where load sharing and resonance go, for runs by their roughness, as written and rising."""
    levels, solved = list(runs), list(runs.values())
    first, last = solved[0], solved[-1]
    less, more = (f"{100 * run.state.clr:.0f} %" for run in (first, last))
    at_last = last.resonance_in_words().removeprefix("contact resonance ")
    verdict = (
        f"From Sq {levels[0]} to {levels[-1]} the asperities' share of the load goes from {less} to {more}: "
        f"{first.resonance_in_words()} at first, {at_last} at last."
    )
    unfinished = not_converged(runs)
    return (
        f"NOT CONVERGED at Sq {', '.join(unfinished)}, do not use: {verdict}"
        if unfinished
        else verdict
    )


def not_converged(runs: Mapping[str, Run]) -> list[str]:
    """The roughnesses whose contacts did not converge."""
    return [level for level, run in runs.items() if not run.solution.convergence.converged]
