"""The pytest plugin: a fixture `recording` that runs a policy and holds the run against its golden recording.

pytest imports this module at every start, wherever fireworld is installed: it imports nothing else before a test asks.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from fireworld.policy.names import NamedPolicy
    from fireworld.policy.protocol import Policy
    from fireworld.recording.golden.check import Checked
    from fireworld.recording.golden.order import Order
    from fireworld.records import MemoryRecording
    from fireworld.simulation.built import CityCache

UPDATE: Final = "--fireworld-update"
FOLDER_INI: Final = "fireworld_recordings"
STORED: Final = "fireworld-stored"
NAME_MAX: Final = 150


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the flag and the setting."""
    group = parser.getgroup("fireworld")
    group.addoption(
        UPDATE, action="store_true", help="Store the recordings of tests that have none, or whose runs have changed."
    )
    parser.addini(
        FOLDER_INI, "Folder of a test's golden recordings, from the folder of its file.", default="recordings"
    )


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say which recordings were stored; reports bring it here from all workers."""
    reports = terminalreporter.getreports("passed") + terminalreporter.getreports("failed")
    stored = [value for report in reports for key, value in report.user_properties if key == STORED]
    if stored:
        terminalreporter.write_sep("=", f"fireworld: {len(stored)} recordings stored")
        for line in stored:
            terminalreporter.write_line(str(line))


@pytest.fixture(scope="session")
def _fireworld_cities() -> CityCache:
    """Cities that were built, to be built once."""
    from fireworld.simulation.built import CityCache

    return CityCache()


@pytest.fixture
def recording(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, _fireworld_cities: CityCache
) -> Recorder:
    """Run a policy in a scenario and compare every step with the golden recording of this test.

    recording(scenario="test-1", policy="mine:Policy", seed=3) fails at the first difference. `--fireworld-update`
    stores the golden anew, and the first time.
    """
    return Recorder(request, tmp_path_factory, _fireworld_cities)


class Recorder:
    """What the fixture `recording` is: call it to run and compare."""

    def __init__(self, request: pytest.FixtureRequest, factory: pytest.TempPathFactory, cities: CityCache) -> None:
        self._node = request.node
        self._update = bool(request.config.getoption(UPDATE))
        self._folder = request.path.parent / request.config.getini(FOLDER_INI)
        self._factory = factory
        self._cities = cities
        self._paths: set[Path] = set()

    def __call__(
        self,
        *,
        scenario: str | Path,
        policy: str | Policy | type[Policy],
        seed: int = 1,
        steps: int | None = None,
        overrides: Mapping[str, Any] | None = None,
        tolerances: Mapping[str, float] | None = None,
        ignore: Collection[str] = (),
        name: str = "",
    ) -> MemoryRecording:
        """Run, and compare every step with the golden recording of this test.

        The test fails, with the first difference and no traceback, if the runs differ, if there is no golden, or if
        the run cannot be made.

        Args:
            scenario: a shipped name, or a YAML file.
            policy: a name as for `fireworld run --policy`, a policy, or the class of one.
            seed: of the run's luck.
            steps: stop after this step; None: the scenario's.
            overrides: keys of the scenario with other values, as in {"brigades.n": 7}.
            tolerances: the largest difference that counts as none, by field, as in {"buildings.temperature": 1e-6}.
            ignore: topics and fields that are not compared, as in ["draws", "decisions.q_values"].
            name: tells several recordings of one test apart.

        Returns:
            The new run, for what else a test may expect: `run.column("score", "n_burnt_out")[-1] == 0`.
        """
        from fireworld.errors import FireworldError
        from fireworld.policy.names import find_policy
        from fireworld.recording.golden.order import place_order

        path = self._path(name)
        if not (self._update or path.exists()):
            raise _failure(f"{_shown(path)}: there is no such recording; run with {UPDATE} to store it")
        settings = {key: _as_yaml(value) for key, value in (overrides or {}).items()}
        try:
            named = None if isinstance(policy, str) else find_policy(policy)
            order = place_order(
                path.parent,
                scenario=scenario,
                policy=named.name if named is not None else str(policy),
                seed=seed,
                steps=steps,
                settings=settings,
                tolerances=tolerances,
                ignore=ignore,
            )
            return self._run(path, order, named)
        except FireworldError as error:
            raise _failure(str(error)) from None

    def _path(self, name: str) -> Path:
        """Return where the golden is; each is compared with once."""
        path: Path = self._folder / f"{golden_name(self._node, name)}.mcap"
        if path in self._paths:
            raise _failure("recording: a second one in a test needs a name of its own: recording(..., name=...)")
        self._paths.add(path)
        return path

    def _run(self, path: Path, order: Order, named: NamedPolicy | None) -> MemoryRecording:
        """Run an order; compare with the golden, or store it."""
        from fireworld.recording.golden.check import carry_out, compare_golden
        from fireworld.recording.golden.order import prepare_golden

        fresh = carry_out(prepare_golden(order, path.parent, policy=named, cities=self._cities))
        if self._update:
            self._store(path, fresh, order)
        else:
            checked = compare_golden(path, fresh, order)
            if checked.result != "same":
                raise _failure(self._complaint(checked))
        return fresh

    def _store(self, path: Path, fresh: MemoryRecording, order: Order) -> None:
        """Store a golden, unless it is there already and the same."""
        from fireworld.recording.golden.check import is_current, make_golden_folder, store_golden, store_text

        if is_current(path, fresh, order):
            store_text(path)
            return
        make_golden_folder(path.parent)
        store_golden(path, fresh)
        self._node.user_properties.append((STORED, _shown(path)))

    def _complaint(self, checked: Checked) -> str:
        """Say what differs, and keep the new run where it can be looked at."""
        from fireworld.recording.golden.check import changes, store_recording

        lines = [f"{_shown(checked.path)}: the run is not the same any more", checked.sentence]
        if checked.difference is not None and checked.fresh is not None and not checked.difference.same:
            lines += [f"  {line}" for line in changes(checked.difference)]
            new = self._factory.mktemp("fireworld") / checked.path.name
            store_recording(new, checked.fresh)
            lines.append(f"the new run: {new}; hold it against the golden with `fireworld diff` or `fireworld view`")
        return "\n".join([*lines, f"if that is meant, run with {UPDATE}"])


def golden_name(node: pytest.Item, name: str = "") -> str:
    """Name the golden of a test, as in test_mine-test_policy or test_mine-TestTeam.test_policy-easiest-second.

    Parameters whose names no file should have are replaced, and a short hash tells them apart.
    """
    classes = [parent.name for parent in node.listchain() if isinstance(parent, pytest.Class)]
    full = f"{node.path.stem}-{'.'.join([*classes, node.name])}" + (f"-{name}" if name else "")
    plain = re.sub(r"\[(.*)\]", r"-\1", full, flags=re.DOTALL)
    clean = re.sub(r"[^A-Za-z0-9_.,=+-]", "_", plain)[:NAME_MAX]
    return clean if clean == plain else f"{clean}-{hashlib.sha256(full.encode()).hexdigest()[:6]}"


def _as_yaml(value: Any) -> str:
    """Write a value as `--set` takes it: text as it is, all else as JSON, which is YAML."""
    return value if isinstance(value, str) else json.dumps(value)


def _shown(path: Path) -> str:
    """Name a file as short as it can be found from the current folder."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def _failure(message: str) -> BaseException:
    """Return what fails a test with a message and nothing else."""
    return pytest.fail.Exception(message, pytrace=False)
