"""Make arrays read-only, so that worlds can share one city."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


def freeze(value: T) -> T:
    """Make every array in a dataclass, and in the dataclasses in it, read-only; return the same object."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif is_dataclass(value):
        for item in fields(value):
            part: Any = getattr(value, item.name)
            freeze(part)
    return value
