"""Rough, lubricated contacts: mixed EHL, wear, contact resonance, and its monitoring.

The most used names are exported here, all others by their package (`asperity.lubricant.BairWiner`).
Each is loaded on first use, so that `import asperity` takes hardly any time.
"""

from typing import Any

import lazy_loader

_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("asperity")
    return _public_name(name)
