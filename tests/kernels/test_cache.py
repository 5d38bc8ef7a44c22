"""The folder of compiled kernels: what is wrong in it is compiled again, and damaged machine code never runs."""

from __future__ import annotations

import ast
import gc
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fireworld.kernels import cache, jit
from fireworld.kernels.cache import ENDING, SPARE, STORE, UNUSED_DAYS_MAX, Store

NAME, PURPOSE, DATA = f"fire.burn-0{ENDING}", b"fire.burn of this processor", bytes(range(256))
RUN = ("-m", "fireworld", "run", "quick", "--policy", "chief", "--steps", "3", "--json")
BUILD = (
    "-c",
    """
import hashlib, json
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario

def add(value):
    if hasattr(value, "tobytes"):
        digest.update(value.tobytes())
    else:
        [add(part) for part in value]

digest = hashlib.sha256()
add(build_scenario(load_scenario("quick")).city_arrays)
print(json.dumps({"digest": digest.hexdigest()}))
""",
)
"""Builds a city by four kernels, compiled in a few seconds; that of a whole episode takes longer than all others."""
EPISODE = "episode.run_episode-"


@pytest.fixture
def caches(tmp_path, monkeypatch):
    """A folder for caches that is empty; no spare one is left to other tests."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "caches"))
    monkeypatch.setenv(SPARE, "")
    return tmp_path / "caches"


@pytest.fixture
def folder(caches):
    return caches / f"kernels-{cache.DIGEST}"


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"*{ENDING}"))


class TestStore:
    def test_what_was_written_is_read(self, folder):
        store = Store()
        assert store.is_empty()
        store.write(NAME, PURPOSE, DATA)
        assert Store().read(NAME, PURPOSE) == DATA
        assert not store.is_empty()
        assert [path.name for path in folder.iterdir()] == [NAME], "no scratch file is left"

    def test_of_damaged_bytes_nothing_is_read(self, folder):
        store = Store()
        store.write(NAME, PURPOSE, DATA)
        whole = (folder / NAME).read_bytes()
        for position in range(len(whole)):
            damaged = bytearray(whole)
            damaged[position] ^= 1 << position % 8
            (folder / NAME).write_bytes(damaged)
            assert store.read(NAME, PURPOSE) is None, position
            (folder / NAME).write_bytes(whole[:position])
            assert store.read(NAME, PURPOSE) is None, position
        store.write(NAME, PURPOSE, DATA)
        assert store.read(NAME, PURPOSE) == DATA, "compiled again"

    def test_what_was_kept_for_something_else_is_not_read(self, folder):
        """The file of another processor, or of another function, under this name."""
        store = Store()
        store.write("other", b"fire.burn of another processor", DATA)
        (folder / "other").rename(folder / NAME)
        assert store.read(NAME, PURPOSE) is None

    @pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
    def test_what_is_no_file_is_not_read(self, folder, make):
        folder.mkdir(parents=True)
        make(folder / NAME)
        assert Store().read(NAME, PURPOSE) is None

    @pytest.mark.parametrize("place", ["base", "folder", "entry"])
    def test_what_cannot_be_kept_is_kept_for_this_process(self, caches, folder, capsys, place):
        if place == "entry":  # a folder where the file should be
            (folder / NAME).mkdir(parents=True)
        else:
            blocked = caches if place == "base" else folder
            blocked.parent.mkdir(exist_ok=True)
            blocked.write_text("a file\n")
        store = Store()
        store.write(NAME, PURPOSE, DATA)
        store.write("another", PURPOSE, DATA)
        line = capsys.readouterr().err
        assert line.count("\n") == 1, "said once"
        assert line.startswith(f"fireworld: compiled code cannot be kept in {folder}: ")
        assert line.endswith(
            "; it is kept for this process alone; set NUMBA_CACHE_DIR to a folder that can be written\n"
        )
        assert store.read(NAME, PURPOSE) == DATA
        spare = Path(os.environ[SPARE])
        assert spare.stat().st_mode & 0o777 == 0o700
        assert Store().read(NAME, PURPOSE) == DATA, "a process that this one starts finds it"
        Store().write("third", PURPOSE, DATA)
        assert capsys.readouterr().err == "", "and says nothing"
        shutil.rmtree(spare)

    def test_a_folder_that_may_not_be_read_holds_nothing(self, folder, monkeypatch):
        """Root may read any folder, so the system is made to say no."""
        Store().write(NAME, PURPOSE, DATA)

        def refuse(path: object, *_: object, **__: object) -> object:
            raise PermissionError(13, "Permission denied", str(path))

        monkeypatch.setattr(cache.os, "scandir", refuse)
        monkeypatch.setattr("builtins.open", refuse)
        store = Store()
        assert store.is_empty()
        assert store.read(NAME, PURPOSE) is None

    def test_without_any_place_it_is_in_memory_alone(self, caches, monkeypatch):
        caches.write_text("a file\n")
        monkeypatch.setattr(cache.tempfile, "mkdtemp", lambda **_: (_ for _ in ()).throw(OSError(28, "no space")))
        store = Store()
        store.write(NAME, PURPOSE, DATA)
        assert store.read(NAME, PURPOSE) is None

    def test_folders_of_other_versions_are_removed_after_a_month(self, caches, folder):
        long_ago = time.time() - (UNUSED_DAYS_MAX + 1) * 86400
        for name in ("kernels-0123456789abcdef", "kernels-fedcba9876543210", "kernels-of-mine", "else"):
            (caches / name).mkdir(parents=True)
            os.utime(caches / name, (long_ago, long_ago))
        os.utime(caches / "kernels-fedcba9876543210")
        Store().write(NAME, PURPOSE, DATA)
        left = {path.name for path in caches.iterdir()}
        assert left == {folder.name, "kernels-fedcba9876543210", "kernels-of-mine", "else"}

    def test_a_folder_in_use_is_noted(self, folder):
        folder.mkdir(parents=True)
        os.utime(folder, (0, 0))
        Store()
        assert time.time() - folder.stat().st_mtime < 3600

    def test_there_is_no_place_without_a_home(self, monkeypatch):
        for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
            monkeypatch.delenv(name, raising=False)
        monkeypatch.setenv("HOME", "/nonexistent")
        assert Store().folders == []
        assert not Path("/nonexistent").exists()


def test_whatever_kernels_are_made_of_is_part_of_the_digest():
    ground = {path.stem for path in cache._SOURCES.parent.glob("*.py")} - {"__init__", "files", "interrupt"}
    found, looked_at = set(), [path for path in cache._SOURCES.glob("*.py") if path.stem not in {"cache", "jit"}]
    while looked_at:
        for node in ast.walk(ast.parse(looked_at.pop().read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            names = [alias.name for alias in node.names] if node.module == "fireworld" else [node.module.split(".")[-1]]
            new = {name for name in names if name in ground and node.module.count(".") <= 1} - found
            found |= new
            looked_at += [cache._SOURCES.parent / f"{name}.py" for name in new]
    assert {f"{name}.py" for name in found - {"errors"}} == set(cache.COMPILED_ELSEWHERE)


def test_kernels_elsewhere_are_not_kept():
    """The name of the folder stands for the sources of this room only."""

    @jit.kernel
    def twice(x: float) -> float:
        return 2 * x

    assert type(twice._cache).__name__ == "NullCache"


def test_no_kernel_falls_back_on_the_compilers_own_cache():
    from numba.core.registry import CPUDispatcher

    from fireworld.kernels import episode, rays

    kernels = [value for module in (episode, rays) for value in vars(module).values()]
    kinds = {type(kernel._cache) for kernel in kernels if isinstance(kernel, CPUDispatcher)}
    assert kinds == {cache.KernelCache}


class Machine:
    """Another machine with a cache of its own, a copy of this one's."""

    def __init__(self, home: Path) -> None:
        self.home, self.folder = home, home / ".cache" / "fireworld" / f"kernels-{cache.DIGEST}"
        self.folder.parent.mkdir(parents=True)
        plain = {name: value for name, value in os.environ.items() if name not in {"NUMBA_CACHE_DIR", SPARE}}
        self.environment = plain | {"HOME": str(home)}
        self.environment.pop("XDG_CACHE_HOME", None)

    def warm(self) -> None:
        """Copy what is compiled here; what the run needs is compiled first."""
        self.digest(self.start(*RUN, environment=dict(os.environ)))
        shutil.copytree(STORE.folders[0], self.folder)

    def start(self, *words: str, environment: dict[str, str] | None = None) -> subprocess.Popen[str]:
        command = [sys.executable, *words]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(command, env=environment or self.environment, cwd=self.home, **pipes)

    def digest(self, process: subprocess.Popen[str]) -> tuple[str, str]:
        """Return the digest of the run, and what went to the error stream."""
        out, err = process.communicate(timeout=300)
        assert process.returncode == 0, err
        return json.loads(out)["digest"], err


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path / "home")


def swap_entries(paths: list[Path]) -> None:
    contents = [path.read_bytes() for path in paths]
    for path, content in zip(paths, [*contents[1:], contents[0]], strict=True):
        path.write_bytes(content)


def flip_code(paths: list[Path]) -> None:
    for path in paths:
        content = bytearray(path.read_bytes())
        for position in range(len(content) // 4, len(content), 997):
            content[position] ^= 0xFF
        path.write_bytes(content)


def cut(paths: list[Path]) -> None:
    for number, path in enumerate(paths):
        os.truncate(path, (0, 10, path.stat().st_size - 1)[number % 3])


@pytest.mark.heavy
def test_a_damaged_cache_heals(machine):
    machine.warm()
    right, err = machine.digest(machine.start(*RUN))
    assert err == ""
    paths = [path for path in kept(machine.folder) if not path.name.startswith(EPISODE)]
    for number, damage in enumerate((swap_entries, flip_code, cut)):
        assert len(paths[number::3]) > 1
        damage(paths[number::3])
    damaged = {path: path.stat().st_mtime_ns for path in paths}
    assert machine.digest(machine.start(*RUN)) == (right, "")
    files = {path: path.stat().st_mtime_ns for path in kept(machine.folder)}
    healed = {path.name.partition("-")[0] for path in paths if files[path] != damaged[path]}
    assert {"rays.count_hits", "outcome.assess", "recorded.record_step"} <= healed
    assert machine.digest(machine.start(*RUN)) == (right, "")
    assert {path: path.stat().st_mtime_ns for path in kept(machine.folder)} == files, "compiled once"


@pytest.mark.heavy
def test_a_folder_that_cannot_be_written(machine, tmp_path):
    machine.folder.parent.rmdir()
    machine.folder.parent.write_text("a file\n")
    machine.environment["TMPDIR"] = str(tmp_path)
    before = sorted(tmp_path.iterdir())
    _, err = machine.digest(machine.start(*BUILD))
    assert err.count("compiled code cannot be kept in") == 1
    assert sorted(tmp_path.iterdir()) == before, "the temporary folder is removed"


@pytest.mark.heavy
@pytest.mark.parametrize("after_seconds", [2, 4, 7])
def test_ctrl_c_while_kernels_are_compiled(machine, after_seconds):
    process = machine.start(*RUN, "--record", "a.mcap", "--debug")
    time.sleep(after_seconds)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert "ignored" not in err


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A machine on which two processes have compiled at once, inner functions closed; and what they ran."""
    machine = Machine(tmp_path_factory.mktemp("machine") / "home")
    machine.environment["FIREWORLD_OPEN_KERNELS"] = "0"
    both = [machine.start(*BUILD) for _ in range(2)]
    digests = [machine.digest(process)[0] for process in both]
    (machine.folder,) = machine.folder.parent.iterdir()
    return machine, digests


@pytest.mark.heavy
def test_two_first_compilations_at_once(compiled):
    machine, (one, other) = compiled
    assert one == other
    assert kept(machine.folder) == sorted(machine.folder.iterdir())


@pytest.mark.heavy
def test_a_kernel_takes_its_inner_functions_from_the_cache(compiled):
    machine, (right, _) = compiled
    (rays,) = machine.folder.glob("rays.count_hits-*")
    inner = [path for path in machine.folder.iterdir() if path != rays]
    assert any(path.name.startswith("draws.uniform_of-") for path in inner)
    before = {path: path.read_bytes() for path in inner}
    for path in inner:
        os.utime(path, (0, 0))
    rays.unlink()
    assert machine.digest(machine.start(*BUILD))[0] == right
    assert rays.exists()
    assert [path for path in inner if path.stat().st_mtime or path.read_bytes() != before[path]] == []


def test_inner_functions_have_no_machine_code():
    command = (
        "from fireworld.kernels.draws import hash_key; print(type(hash_key._cache).__name__); hash_key(1, 2, 3, 4)"
    )
    environment = dict(os.environ) | {"FIREWORLD_OPEN_KERNELS": "0"}
    done = subprocess.run([sys.executable, "-c", command], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout == "InnerCache\n"
    assert done.stderr.splitlines()[-1].startswith("TypeError: hash_key is for kernels only")


@pytest.mark.parametrize("enabled", [True, False])
def test_compilation_leaves_the_collection_of_garbage_as_it_was(enabled, monkeypatch):
    seen = []

    @jit.kernel
    def thrice(x: float) -> float:
        return 3 * x

    monkeypatch.setattr(thrice._compiler, "compile", _remembering(thrice._compiler.compile, seen))
    was_enabled = gc.isenabled()
    try:
        (gc.enable if enabled else gc.disable)()
        assert thrice(2.0) == 6.0
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if was_enabled else gc.disable)()
    assert seen == [False]


def _remembering(compile_it, seen):
    def compiled(*given):
        seen.append(gc.isenabled())
        return compile_it(*given)

    return compiled
