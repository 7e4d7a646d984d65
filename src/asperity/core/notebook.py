"""Progress bar in notebooks, for functions that are called without a progress callback."""

import sys
from collections.abc import Callable
from html import escape
from time import monotonic

INTERVAL_S = 0.2  # between updates


def notebook_progress(
    label: str, describe: Callable[..., tuple[float, str]]
) -> Callable[..., None] | None:
    """Return a callback that updates a bar below the cell; None outside of notebooks.

    Parameters
    ----------
    label : name of the calculation
    describe : takes what the callback is called with; returns the completed share, 0 to 1, and a
        text
    """
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if type(shell).__name__ != "ZMQInteractiveShell":
        return None
    from IPython.display import HTML, display

    handle = display(HTML(_bar(label, 0.0, "starting ...")), display_id=True)
    next_s = monotonic()

    def update(*state: object) -> None:
        nonlocal next_s
        share, text = describe(*state)
        if monotonic() >= next_s or share >= 1.0:
            next_s = monotonic() + INTERVAL_S
            handle.update(HTML(_bar(label, share, text)))

    return update


def count_progress(label: str, items: str) -> Callable[[int, int], None] | None:
    """Return a callback for numbers done and in total; None outside of notebooks."""
    return notebook_progress(
        label, lambda done, total: (done / max(total, 1), f"{done} of {total} {items}")
    )


def _bar(label: str, share: float, text: str) -> str:
    return f'{escape(label)} <progress value="{share:.3f}" max="1"></progress> {escape(text)}'
