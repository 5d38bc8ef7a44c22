"""The pytest plugin: a fixture `recording` that runs a policy, or trains a team, and compares with a golden recording.

pytest imports this module at every start, wherever fireworld is installed: it imports nothing else before a test asks.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from fireworld.policy.protocol import Policy
    from fireworld.recording.golden.check import GoldenResult
    from fireworld.recording.run import Run
    from fireworld.simulation.built import CityCache
    from fireworld.training.log.reader import TrainingLog
    from fireworld.training.log.verify import TrainedAgain

UPDATE: Final = "--fireworld-update"
FOLDER_INI: Final = "fireworld_recordings"
STORED: Final = "fireworld-stored"
COMPARED: Final = "fireworld-compared"
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
    """Write which recordings were stored; reports bring it here from all workers."""
    reports = terminalreporter.getreports("passed") + terminalreporter.getreports("failed")
    stored = [value for report in reports for key, value in report.user_properties if key == STORED]
    if stored:
        terminalreporter.write_sep("=", f"fireworld: {len(stored)} recordings stored")
        for line in stored:
            terminalreporter.write_line(str(line))
    unused = [] if _is_selection(terminalreporter) else _unused(reports)
    if unused and terminalreporter.config.getoption(UPDATE):
        for path in unused:
            path.unlink()
            path.with_suffix(".txt").unlink(missing_ok=True)
        terminalreporter.write_sep("=", f"fireworld: {len(unused)} recordings removed, which no test uses")
    elif unused:
        terminalreporter.write_sep("=", f"fireworld: {len(unused)} recordings that no test uses; {UPDATE} removes them")
    for path in unused:
        terminalreporter.write_line(_shown(path))


def _is_selection(terminalreporter: pytest.TerminalReporter) -> bool:
    """Return whether tests of a file may have been left out, skipped or broken off, which may use recordings.

    Where pytest-xdist shares tests out nobody knows which ones were left out.
    """
    stats, config = terminalreporter.stats, terminalreporter.config
    some = any("::" in str(word) for word in config.invocation_params.args)
    some = some or bool(config.getoption("keyword") or config.getoption("markexpr") or config.getoption("maxfail"))
    some = some or bool(config.getoption("numprocesses", None))
    return some or any(stats.get(key) for key in ("deselected", "skipped", "failed", "error", "xfailed"))


def _unused(reports: Sequence[pytest.TestReport]) -> list[Path]:
    """Return the recordings of the files of tests that ran which no test of theirs has compared or stored."""
    compared = {str(value) for report in reports for key, value in report.user_properties if key == COMPARED}
    files = {Path(name).name.split("-", 1)[0] for name in compared}
    folders = {Path(name).parent for name in compared}
    found = (path for folder in sorted(folders) for path in sorted(folder.glob("*.mcap")))
    return [path for path in found if path.name.split("-", 1)[0] in files and str(path) not in compared]


@pytest.fixture(scope="session")
def _fireworld_cities() -> CityCache:
    """Return the cities built so far: each is built once."""
    from fireworld.simulation.built import CityCache

    return CityCache()


@pytest.fixture
def recording(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, _fireworld_cities: CityCache
) -> Recorder:
    """Run a policy in a scenario, or train a team, and compare every step with the golden recording of this test.

    recording(scenario="test-1", policy="mine:Policy", seed=3), or recording.training("quick", set={"alpha": 0.5}),
    fails at the first difference. `--fireworld-update` stores the golden, the first time and whenever it has changed.
    """
    return Recorder(request, tmp_path_factory, _fireworld_cities)


class Recorder:
    """The fixture `recording`: call it to run and compare; `training` trains and compares."""

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
    ) -> Run:
        """Run, and compare every step with the golden recording of this test.

        The test fails, with the first difference and no traceback, if the runs differ, if there is no golden, or if
        the run cannot be made.

        Args:
            scenario: a shipped name, or a YAML file.
            policy: a name as for `fireworld run --policy`, a policy, or the class of one.
            seed: of the random draws.
            steps: stop after this step; None: the scenario's.
            overrides: keys of the scenario with other values, as in {"brigades.n": 7}.
            tolerances: the largest difference that is ignored, by field, as in {"buildings.temperature": 1e-6}.
            ignore: topics and fields that are not compared, as in ["draws", "decisions.q_values"].
            name: of this recording, where a test has several.

        Returns:
            The new run, for what else a test may expect: `run.column("score", "n_burnt_out")[-1] == 0`.
        """
        from fireworld.errors import FireworldError
        from fireworld.policy.names import find_policy
        from fireworld.recording.golden.again import run_again
        from fireworld.recording.golden.spec import make_spec, prepare_golden

        path = self._path(name)
        try:
            named = None if isinstance(policy, str | Path) else find_policy(policy)
            spec = make_spec(
                path.parent,
                scenario=scenario,
                policy=named.name if named is not None else str(policy),
                seed=seed,
                steps=steps,
                settings=overrides,
                tolerances=tolerances,
                ignore=ignore,
            )
            fresh = run_again(prepare_golden(spec, path.parent, policy=named, cities=self._cities))
            self._compare(path, fresh)
        except FireworldError as error:
            raise _failure(str(error)) from None
        return fresh

    def training(
        self,
        curriculum: str | Path,
        *,
        method: str = "paper",
        seed: int = 1,
        set: Mapping[str, Any] | None = None,
        stages: str | Sequence[str] | None = None,
        name: str = "",
    ) -> TrainingLog:
        """Train a team, and compare every step that it learns from with the golden training of this test.

        The test fails, with the first difference and no traceback, if the trainings differ, if there is no golden, or
        if it cannot be trained.

        Args:
            curriculum: the name of a curriculum or a scenario, or a YAML file of either.
            method: a name as for `fireworld train --method`.
            seed: of all random draws of the training.
            set: hyperparameters of the method by name, as in {"alpha": 0.1}.
            stages: the curriculum's stages to train in, by name; None: all.
            name: of this recording, where a test has several.

        Returns:
            The golden, which the training is the same as: `.team()` is its team, `.lines[-1].score` a score.
        """
        from fireworld.errors import FireworldError
        from fireworld.recording.golden.training import make_training_spec, prepare_training
        from fireworld.training.log.reader import open_training

        path = self._path(name)
        try:
            spec = make_training_spec(
                path.parent, curriculum=curriculum, method=method, seed=seed, stages=stages, settings=set
            )
            self._compare(path, prepare_training(spec, path.parent, cities=self._cities))
            return open_training(path)
        except FireworldError as error:
            raise _failure(str(error)) from None

    def _path(self, name: str) -> Path:
        """Return where the golden is; fail where it is missing, or another of this test has been compared with it."""
        path: Path = self._folder / f"{golden_name(self._node, name)}.mcap"
        if path in self._paths:
            raise _failure("recording: a second one in a test needs a name of its own: recording(..., name=...)")
        self._paths.add(path)
        self._node.user_properties.append((COMPARED, str(path)))
        if not (self._update or path.exists()):
            raise _failure(f"{_shown(path)}: there is no such recording; run with {UPDATE} to store it")
        return path

    def _compare(self, path: Path, fresh: Run | TrainedAgain) -> None:
        """Compare a run, or a training, with the golden, or store it."""
        from fireworld.recording.golden.check import compare_golden
        from fireworld.recording.golden.update import store_if_changed

        if not self._update:
            result = compare_golden(path, fresh)
            if result.result != "same":
                raise _failure(self._complaint(result))
        elif store_if_changed(path, fresh):
            self._node.user_properties.append((STORED, _shown(path)))

    def _complaint(self, result: GoldenResult) -> str:
        """Return what differs, and record the new run where it can be looked at."""
        from fireworld.recording.golden.store import store_recording

        lines = [result.headline, f"{_shown(result.path)}: the {result.kind} is not the same any more"]
        if result.fresh is not None and result.differs:
            lines += [f"  {line}".rstrip() for line in result.lines]
            new = self._factory.mktemp("fireworld") / result.path.name
            store_recording(new, result.fresh)
            lines.append(
                f"the new {result.kind}: {new}; compare it with the golden by `fireworld diff` or `fireworld view`"
            )
        return "\n".join([*lines, f"if that is meant, run with {UPDATE}"])


def golden_name(node: pytest.Item, name: str = "") -> str:
    """Return the name of a test's golden, as in test_mine-test_policy or test_mine-TestTeam.test_policy-easiest-second.

    Parameters whose names no file should have are replaced, and a short hash makes them unique.
    """
    classes = [parent.name for parent in node.listchain() if isinstance(parent, pytest.Class)]
    full = f"{node.path.stem}-{'.'.join([*classes, node.name])}" + (f"-{name}" if name else "")
    plain = re.sub(r"\[(.*)\]", r"-\1", full, flags=re.DOTALL)
    clean = re.sub(r"[^A-Za-z0-9_.,=+-]", "_", plain)[:NAME_MAX]
    return clean if clean == plain else f"{clean}-{hashlib.sha256(full.encode()).hexdigest()[:6]}"


def _shown(path: Path) -> str:
    """Return the path of a file from the current folder, if it is in there."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def _failure(message: str) -> BaseException:
    """Return what fails a test with a message and nothing else."""
    return pytest.fail.Exception(message, pytrace=False)
