"""The recorder: records to MCAP logs and back. `from recorder import open_log` is the way in for those who read one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from recorder.reader import Log, open_log

__all__ = ["Log", "open_log"]


def __getattr__(name: str) -> Any:
    """Import the reader when it is asked for: whoever wants another module of the recorder does not wait for it."""
    if name in __all__:
        from recorder import reader

        return getattr(reader, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
