"""Small disks: file systems of some kilobytes, where this process may mount; else a limit on the size of files."""

from __future__ import annotations

import ctypes
import functools
import os
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_CLONE_NEWNS: Final = 0x00020000
NOBODY: Final = 65534
MOUNT: Final = shutil.which("mount") or "/bin/mount"
UMOUNT: Final = shutil.which("umount") or "/bin/umount"
SMALLEST_BYTES: Final = 4096


@functools.cache
def can_mount() -> bool:
    """Return whether this process may mount; from now on what it mounts is its own, and ends with it."""
    if os.geteuid() != 0 or ctypes.CDLL(None, use_errno=True).unshare(_CLONE_NEWNS) != 0:
        return False
    if subprocess.run([MOUNT, "--make-rprivate", "/"], check=False, capture_output=True).returncode:
        return False
    folder = tempfile.mkdtemp(prefix="fireworld-mount-")
    try:
        mounted = _mount(Path(folder), f"size={SMALLEST_BYTES}")
        if mounted:
            subprocess.run([UMOUNT, folder], check=False)
        return mounted
    finally:
        Path(folder).rmdir()


def _mount(folder: Path, options: str) -> bool:
    words = [MOUNT, "-t", "tmpfs", "-o", options, "none", str(folder)]
    return subprocess.run(words, check=False, capture_output=True).returncode == 0


@contextmanager
def small_disk(folder: Path, n_bytes: int) -> Iterator[Callable[[str], None]]:
    """Let a folder be a disk of a size; yield a function that mounts it anew with other options, as in "size=1m"."""
    if not _mount(folder, f"size={max(n_bytes, SMALLEST_BYTES)}"):
        raise OSError(f"{folder}: cannot be mounted")

    def again(options: str) -> None:
        subprocess.run([MOUNT, "-o", f"remount,{options}", str(folder)], check=True)

    try:
        yield again
    finally:
        subprocess.run([UMOUNT, "--lazy", str(folder)], check=True)


def limit_files(n_bytes: int) -> Callable[[], None]:
    """Return what limits the size of the files of a child."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))


def be_nobody() -> None:
    """Give up root's rights, in a child; the compiled kernels are in memory, their folder may be out of its reach."""
    import numba

    numba.config.CACHE_DIR = "."
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(NOBODY)
        os.setuid(NOBODY)


def open_way(folder: Path) -> None:
    """Let everybody reach a folder below the temporary one."""
    for place in [folder, *folder.parents]:
        if place == Path(tempfile.gettempdir()) or place.parent == place:
            return
        place.chmod(place.stat().st_mode | 0o055)
