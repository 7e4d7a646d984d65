"""asperity hears how a lubricated contact wears.

Mixed-EHL contact, load sharing of asperities and oil, contact resonance. The names of a working
day are reached from here, the rest by their module (`asperity.lubricant.BairWiner`). Each is
loaded when it is first used, so that `import asperity` costs next to nothing.
"""

from typing import Any

import lazy_loader

_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("asperity")
    return _public_name(name)
