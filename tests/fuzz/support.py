"""What all fuzz tests share: how many examples, what may come out, and how inputs are altered."""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from fireworld.errors import FireworldError

CPU_SECONDS_MAX = 1.0
MEMORY_BYTES_MAX = 400_000_000
EXAMPLES = "FIREWORLD_FUZZ_EXAMPLES"
"""Environment variable: how many examples, other ones each time; else the few of every day, always the same."""
FUZZ = settings(
    max_examples=int(os.environ.get(EXAMPLES, "25")),
    derandomize=EXAMPLES not in os.environ,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],  # to make a failure smaller takes minutes
    suppress_health_check=list(HealthCheck),
)
FOLDER = tempfile.TemporaryDirectory(prefix="fireworld-fuzz-")
tried = {"n": 0}
"""How many inputs were tried by this process."""
TARGETS: dict[str, Callable[[], None]] = {}
"""Every fuzz test by its name, for `python -m tests.fuzz`."""


def target(test: Callable[[], None]) -> Callable[[], None]:
    """Register a fuzz test."""
    TARGETS[test.__name__.removeprefix("test_")] = test
    return test


@contextmanager
def only_complaints() -> Iterator[None]:
    """Let nothing come out but a FireworldError of one printable line, within a second and little memory."""
    tried["n"] += 1
    began, memory = time.process_time(), _peak_bytes()
    message = ""
    try:
        yield
    except FireworldError as error:
        message = str(error)
    assert message.isprintable(), message
    assert time.process_time() - began < CPU_SECONDS_MAX
    assert _peak_bytes() - memory < MEMORY_BYTES_MAX


def file_of(data: bytes, name: str) -> Path:
    """Write the input of a test to a file."""
    path = Path(FOLDER.name) / name
    path.write_bytes(data)
    return path


def altered(data: bytes, *, most: int = 6) -> st.SearchStrategy[bytes]:
    """Change, remove and insert some bytes."""
    edit = st.tuples(st.integers(0, len(data)), st.sampled_from([0, 0, 1, 1, 1, 4, 8, 64]), st.binary(max_size=12))
    return st.lists(edit, min_size=1, max_size=most).map(lambda edits: _edited(data, edits))


def _edited(data: bytes, edits: list[tuple[int, int, bytes]]) -> bytes:
    for position, n_removed, inserted in edits:
        data = data[:position] + inserted + data[position + n_removed :]
    return data


ODD = st.sampled_from(
    [None, True, 0, -1, 1, 2**31, 2**63, 2**200, 0.5, -0.0, 1e300, "", "a", "\n", "\ud83d\udd25", "é", [], {}]
)
"""Values that are at home nowhere."""
ANYTHING = st.recursive(
    ODD | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=8,
)


@st.composite
def changed(draw: st.DrawFn, document: Any, *, most: int = 3) -> Any:
    """Replace, remove or add some parts anywhere in a tree of dicts and lists."""
    tree = {"root": _copy(document)}
    for _ in range(draw(st.integers(1, most))):
        at: Any = tree
        key: Any = "root"
        while isinstance(at[key], dict | list) and at[key] and draw(st.integers(0, 4)):
            at = at[key]
            key = draw(st.sampled_from(sorted(at) if isinstance(at, dict) else range(len(at))))
        if isinstance(at, dict) and at is not tree and not draw(st.integers(0, 4)):
            del at[key]
            at[draw(st.text(max_size=6))] = draw(ANYTHING)
        else:
            at[key] = draw(ODD | ANYTHING)
    return tree["root"]


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copy(item) for key, item in value.items()}
    return [_copy(item) for item in value] if isinstance(value, list) else value


def _peak_bytes() -> int:
    """The most memory that this process ever had."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
