"""Whether what only some commands need is installed, asked before there is any work in it."""

from __future__ import annotations


def check_matplotlib(wanted_by: str) -> None:
    """See that figures can be drawn, without importing what draws them.

    Args:
        wanted_by: the command or option that draws.

    Raises:
        ViewError: matplotlib is not installed.
    """
    from importlib.util import find_spec

    from fireworld.errors import ViewError

    if find_spec("matplotlib") is None:
        raise ViewError(f"{wanted_by}: matplotlib is not installed; try pip install 'fireworld[figures]'")
