"""Optional packages: imported where they are used, and named where they are missing."""

import importlib
from typing import Any

__all__ = ["require"]


def require(module: str, extra: str) -> Any:
    """Import a module of an optional package.

    Parameters
    ----------
    module : str
        Full name of the module.
    extra : str
        The extra of alignscores that brings it.

    Returns
    -------
    module
        The module.

    Raises
    ------
    ModuleNotFoundError
        Where the package is not installed; the message says what to install.

    Examples
    --------
    >>> from alignscores.trajectories.extras import require
    >>> require("no_such_package.io", "files")
    Traceback (most recent call last):
    ModuleNotFoundError: no_such_package is not installed: pip install "alignscores[files]"
    """
    package = module.partition(".")[0]
    try:
        importlib.import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package:  # an import inside the package fails, which no extra repairs
            raise
        reason = f'{package} is not installed: pip install "alignscores[{extra}]"'
        raise ModuleNotFoundError(reason, name=package) from None
    return importlib.import_module(module)
