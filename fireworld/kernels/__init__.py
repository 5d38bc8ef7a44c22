"""Compiled kernels: plain functions of arrays, and the folder where their machine code is kept.

numba keys its cache by the file that defines a function, so an edit in another kernel file would leave stale code
behind. The folder is therefore named after the digest of all kernel sources and of numba's version.
"""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

import numba

from fireworld.kernels import jit

FOLDER = Path(__file__).parent


def sources_digest() -> str:
    """Digest all kernel sources, their data, the constants compiled into them and numba's version."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:2]} {jit.OPEN}".encode())
    for path in [*sorted(FOLDER.iterdir()), FOLDER.parent / "draws.py", FOLDER.parent / "rewards.py"]:
        if path.suffix in {".py", ".npy"}:
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Name the folder of compiled kernels: below NUMBA_CACHE_DIR, else the user's cache folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(chosen) if chosen else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fireworld"
    return base / f"kernels-{sources_digest()}"


numba.config.CACHE_DIR = str(cache_folder())
numba.config.SLP_VECTORIZE = 1  # turns four sums side by side into vector instructions; never reorders arithmetic


def is_cold() -> bool:
    """Return whether nothing is compiled yet, so that the first call will take a while."""
    return not any(Path(numba.config.CACHE_DIR).glob("**/*.nbi"))
