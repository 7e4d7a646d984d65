"""Put this folder on the import path for `support`, and mark the slow files that `make quick`
skips.
"""

from pathlib import Path

import pytest

HERE = Path(__file__).parent
SLOW = set((HERE / "slow.txt").read_text("utf-8").split())  # files below tests, more than 5 s each


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.relative_to(HERE).as_posix() in SLOW:
            item.add_marker(pytest.mark.slow)
