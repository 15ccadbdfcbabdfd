"""Optional packages: imported where they are used, and named where they are missing."""

import importlib
from typing import Any

__all__ = ["require"]


def require(module: str, extra: str) -> Any:
    """Import a module of an optional package; the error names the extra that installs it."""
    package = module.partition(".")[0]
    try:
        importlib.import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package:  # an import inside the package fails, which no extra repairs
            raise
        reason = f'{package} is not installed: pip install "alignscores[{extra}]"'
        raise ModuleNotFoundError(reason, name=package) from None
    return importlib.import_module(module)
