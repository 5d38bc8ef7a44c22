"""The pytest plugin: a fixture `recording` that runs a policy, or trains a team, and compares with a golden recording.

pytest imports this module at every start, wherever fireworld is installed: it imports nothing else before a test asks.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Generator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    import pluggy

    from fireworld.policy.protocol import Policy
    from fireworld.recording.golden.check import GoldenResult
    from fireworld.recording.run import Run
    from fireworld.simulation.built import CityCache
    from fireworld.training.log.reader import TrainingLog
    from fireworld.training.log.verify import TrainedAgain

UPDATE: Final = "--fireworld-update"
KEEP: Final = "--fireworld-keep"
SUMMARY: Final = "--fireworld-summary"
ANNOTATE: Final = "--fireworld-annotate"
FOLDER_INI: Final = "fireworld_recordings"
DIGEST_INI: Final = "fireworld_digest_only"
STORED: Final = "fireworld-stored"
COMPARED: Final = "fireworld-compared"
NAME_MAX: Final = 150
_FOUND: Final = "fireworld_findings"
"""What a report holds of recordings compared; reports bring it here from all workers."""
_findings_key: Final = pytest.StashKey[list[dict[str, Any]]]()
_collected_key: Final = pytest.StashKey[set[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the flags and the settings."""
    group = parser.getgroup("fireworld")
    group.addoption(
        UPDATE, action="store_true", help="Store the recordings of tests that have none, or whose runs have changed."
    )
    group.addoption(KEEP, metavar="DIR", help="Keep new runs that differ in DIR: recording, pages, picture.")
    group.addoption(SUMMARY, metavar="FILE.md", help="Write what differs, and why, as Markdown.")
    group.addoption(ANNOTATE, choices=["github"], help="Print annotations for a CI server, if anything differs.")
    parser.addini(
        FOLDER_INI, "Folder of a test's golden recordings, from the folder of its file.", default="recordings"
    )
    parser.addini(DIGEST_INI, "Keep digests of some kB instead of recordings.", type="bool", default=False)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Keep which tests are going to run: a run that is broken off says nothing of what others use."""
    session.config.stash[_collected_key] = {item.nodeid for item in session.items}


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pluggy.Result[pytest.TestReport], None]:
    """Give a report what was found in comparing recordings."""
    outcome = yield
    found = item.stash.get(_findings_key, [])
    if found:
        setattr(outcome.get_result(), _FOUND, [*found])
        found.clear()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Write which recordings were stored, which no test uses, and what CI servers want."""
    reports = [one for several in terminalreporter.stats.values() for one in several if hasattr(one, "user_properties")]
    stored = list(dict.fromkeys(str(v) for report in reports for key, v in report.user_properties if key == STORED))
    if stored:
        terminalreporter.write_sep("=", f"fireworld: {len(stored)} recordings stored")
        for line in stored:
            terminalreporter.write_line(line)
    unused = [] if _is_selection(terminalreporter) else _unused(terminalreporter.config, reports)
    if unused and terminalreporter.config.getoption(UPDATE):
        for path in unused:
            path.unlink()
            path.with_suffix(".txt").unlink(missing_ok=True)
        terminalreporter.write_sep("=", f"fireworld: {len(unused)} recordings removed, which no test uses")
    elif unused:
        terminalreporter.write_sep("=", f"fireworld: {len(unused)} recordings that no test uses; {UPDATE} removes them")
    for path in unused:
        terminalreporter.write_line(_shown(path))
    found = [found for report in reports for found in getattr(report, _FOUND, ())]
    _report(
        terminalreporter,
        [*found, *_other_failures(terminalreporter, {one["name"] for one in found if one["verdict"] != "same"})],
    )


def _other_failures(terminalreporter: pytest.TerminalReporter, known: Collection[str]) -> Iterator[dict[str, Any]]:
    """Yield what else failed: tests that expect more than a recording, and files that cannot be collected."""
    stats = terminalreporter.stats
    for report in [*stats.get("error", ()), *stats.get("failed", ())]:
        if report.nodeid in known:
            continue
        crash = getattr(report.longrepr, "reprcrash", None)
        text = crash.message if crash is not None else report.longreprtext
        lines = [line for line in text.splitlines() if line.strip()] or ["failed"]
        file, line, _ = getattr(report, "location", None) or (report.nodeid, 0, "")
        place = _shown(terminalreporter.config.rootpath / file)
        headline = lines[0] if crash is not None else lines[-1].removeprefix("E").strip()
        yield {"name": report.nodeid, "verdict": "cannot", "headline": headline, "file": place, "line": (line or 0) + 1}


def _report(terminalreporter: pytest.TerminalReporter, found: Sequence[Mapping[str, Any]]) -> None:
    """Write the summary and the annotations, if they were asked for."""
    summary, annotate = (terminalreporter.config.getoption(name) for name in (SUMMARY, ANNOTATE))
    if not (summary or annotate):
        return
    from fireworld.annotations import annotation_lines
    from fireworld.files import make_folder, write_file
    from fireworld.findings import Finding
    from fireworld.markdown import WORDS, markdown_page

    findings = [Finding(**one) for one in found]
    if summary:
        path = Path(summary)
        make_folder(path.parent)
        words = {**WORDS, "cannot": "failed otherwise"}
        write_file(path, markdown_page("recordings of tests", findings, beside=path.parent, words=words))
    if annotate:
        for line in annotation_lines(findings):
            terminalreporter.write_line(line)


def _is_selection(terminalreporter: pytest.TerminalReporter) -> bool:
    """Return whether tests of a file may have been left out, skipped or broken off, which may use recordings.

    Where pytest-xdist shares tests out nobody knows which ones were left out.
    """
    stats, config = terminalreporter.stats, terminalreporter.config
    some = any("::" in str(word) for word in config.invocation_params.args)
    some = some or bool(config.getoption("keyword") or config.getoption("markexpr") or config.getoption("maxfail"))
    some = some or bool(config.getoption("numprocesses", None))
    ran = {report.nodeid for several in stats.values() for report in several if hasattr(report, "nodeid")}
    some = some or not config.stash.get(_collected_key, set()) <= ran
    return some or any(stats.get(key) for key in ("deselected", "skipped", "failed", "error", "xfailed"))


def _unused(config: pytest.Config, reports: Sequence[pytest.TestReport]) -> list[Path]:
    """Return the recordings that tests made and none uses, of files that ran; of files that are gone, if all ran."""
    used = {Path(str(value)) for report in reports for key, value in report.user_properties if key == COMPARED}
    ran = {config.rootpath / report.nodeid.partition("::")[0] for report in reports}
    folders = {folder for file in ran if (folder := file.parent / config.getini(FOLDER_INI)).is_dir()}
    if not folders:
        return []
    from fireworld.recording.golden.find import unused_goldens

    whole = all(Path(config.invocation_params.dir, word).is_dir() for word in config.args)
    found = (unused_goldens(folder, used=used, ran=ran, whole=whole) for folder in sorted(folders))
    return [path for several in found for path in several]


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
        self._digest_only = bool(request.config.getini(DIGEST_INI))
        self._keep = _keep_folder(request)
        self._found = request.node.stash.setdefault(_findings_key, [])
        self._factory = factory
        self._cities = cities
        self._stems: set[str] = set()

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
        digest_only: bool | None = None,
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
            digest_only: keep a digest of some kB instead of the recording; None: as the setting says.

        Returns:
            The new run, for what else a test may expect: `run.column("score", "n_burnt_out")[-1] == 0`.
        """
        from fireworld.errors import FireworldError
        from fireworld.policy.names import find_policy
        from fireworld.recording.golden.again import run_again
        from fireworld.recording.golden.spec import make_spec, prepare_golden

        path = self._path(name, digest_only=self._digest_only if digest_only is None else digest_only)
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
                test=self._node.path,
            )
            fresh = run_again(prepare_golden(spec, path.parent, policy=named, cities=self._cities))
            self._compare(path, fresh)
        except FireworldError as error:
            raise self._cannot(path, str(error)) from None
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
                path.parent, curriculum=curriculum, method=method, seed=seed, stages=stages, settings=set,
                test=self._node.path,
            )  # fmt: skip
            self._compare(path, prepare_training(spec, path.parent, cities=self._cities))
            return open_training(path)
        except FireworldError as error:
            raise self._cannot(path, str(error)) from None

    def _path(self, name: str, *, digest_only: bool = False) -> Path:
        """Return where the golden is; fail where it is missing, or another of this test has been compared with it."""
        from fireworld.recording.golden.store import digest_path

        stem = golden_name(self._node, name)
        recording: Path = self._folder / f"{stem}.mcap"
        digest = digest_path(recording)
        path, other = (digest, recording) if digest_only else (recording, digest)
        if stem in self._stems:
            raise _failure("recording: a second one in a test needs a name of its own: recording(..., name=...)")
        self._stems.add(stem)
        self._node.user_properties.append((COMPARED, str(path)))
        if self._update or path.exists():
            return path
        if not other.exists():
            missing = f"{_shown(path)}: there is no such recording; run with {UPDATE} to store it"
            raise self._cannot(path, missing)
        return other  # is of the other kind until the next update

    def _compare(self, path: Path, fresh: Run | TrainedAgain) -> None:
        """Compare a run, or a training, with the golden, or store it."""
        from fireworld.recording.golden.check import compare_golden
        from fireworld.recording.golden.keep import keep_new
        from fireworld.recording.golden.store import LARGE_BYTES, LARGE_HINT
        from fireworld.recording.golden.update import store_if_changed

        if not self._update:
            result = compare_golden(path, fresh)
            if self._keep is not None:
                result = keep_new(result, self._keep)
            self._note(result)
            if result.result != "same":
                raise _failure(self._complaint(result))
        elif store_if_changed(path, fresh):
            n_bytes = path.stat().st_size
            hint = f", {n_bytes / 1e6:.1f} MB: {LARGE_HINT}" if n_bytes >= LARGE_BYTES else ""
            self._node.user_properties.append((STORED, _shown(path) + hint))

    def _complaint(self, result: GoldenResult) -> str:
        """Return what differs, and record the new run where it can be looked at."""
        from fireworld.recording.golden.store import is_digest, recording_path, store_recording

        lines = [result.headline, f"{_shown(result.path)}: the {result.kind} is not the same any more"]
        if result.fresh is not None and result.differs:
            lines += [f"  {line}".rstrip() for line in result.lines]
            if result.kept is not None:
                lines.append(f"the new {result.kind}: {_shown(result.kept.recording)}")
                lines += [f"to look at: {_shown(result.kept.page)}"] if result.kept.page is not None else []
            else:
                new = self._factory.mktemp("fireworld") / recording_path(result.path).name
                store_recording(new, result.fresh)
                how = "; compare it with the golden by `fireworld diff` or `fireworld view`"
                lines.append(f"the new {result.kind}: {new}{'' if is_digest(result.path) else how}")
        return "\n".join([*lines, f"if that is meant, run with {UPDATE}"])

    def _note(self, result: GoldenResult) -> None:
        """Keep a result for the summary; annotations point to the test."""
        file, line, _ = self._node.location
        place = _shown(self._node.config.rootpath / file)
        found = result.finding(name=self._node.nodeid, file=place, line=(line or 0) + 1)
        self._found.append(found.to_dict())

    def _cannot(self, path: Path, message: str) -> BaseException:
        """Return what fails the test where a run cannot be made or compared; keep that for the summary."""
        from fireworld.recording.golden.check import GoldenResult

        self._note(GoldenResult(path=path, error=message))
        return _failure(message)


def _keep_folder(request: pytest.FixtureRequest) -> Path | None:
    """Return where new runs of a file's tests are kept: in the folder that was named, below it by the file's folder."""
    keep, summary = request.config.getoption(KEEP), request.config.getoption(SUMMARY)
    if not keep and not summary:
        return None
    from fireworld.markdown import files_beside

    base = Path(keep) if keep else files_beside(Path(summary))
    root = request.config.rootpath
    below = request.path.parent.relative_to(root) if request.path.is_relative_to(root) else Path()
    start: Path = request.config.invocation_params.dir
    return start / base / below


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
