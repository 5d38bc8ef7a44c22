"""Golden specs: what a golden recording holds about how to run it again."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec

from fireworld.errors import LogError, expected
from fireworld.files import name_from
from fireworld.policy.names import NamedPolicy, find_policy, with_file
from fireworld.recording.replay import build_recorded
from fireworld.recording.resume import refind_policy
from fireworld.records import RunHeader
from fireworld.scenario import load_scenario, scenario_names
from fireworld.simulation.built import CityCache
from fireworld.simulation.prepared_run import PreparedRun, prepare_run
from fireworld.version import __version__, simulator_digest

SPEC_ATTACHMENT: Final = "golden.json"
"""Name of the attachment of a golden recording that holds its spec."""


class GoldenSpec(msgspec.Struct, frozen=True, kw_only=True):
    """What to run, by names that are looked up anew each time, and how exactly to compare it."""

    scenario: str
    """A shipped one's name; the path of a file, from the folder of the golden; empty: the scenario as recorded."""
    policy: str
    """As on the command line; a team file or a file of code by its path from the folder of the golden."""
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)] = 1
    steps: Annotated[int, msgspec.Meta(ge=1)] | None = None
    """Last step; None: the scenario's."""
    settings: dict[str, str] = {}
    """YAML values by dotted key, as `--set` takes them."""
    tolerances: dict[str, float] = {}
    """The largest difference that is ignored, by field of the log."""
    ignore: tuple[str, ...] = ()
    """Topics and fields of the log that are not compared."""
    test: str = ""
    """The file of the test that made it, from the folder of the golden; empty: no test did."""


def make_spec(
    folder: Path,
    *,
    scenario: str | Path,
    policy: str,
    seed: int = 1,
    steps: int | None = None,
    settings: Mapping[str, Any] | None = None,
    tolerances: Mapping[str, float] | None = None,
    ignore: Collection[str] = (),
    test: Path | None = None,
) -> GoldenSpec:
    """Return the spec of a golden in `folder`; it names files by their paths from there.

    Args:
        folder: where the golden is going to be.
        scenario: a shipped name, or a file as seen from the current folder.
        policy: a name as on the command line; a file in it as seen from the current folder.
        seed: of the random draws.
        steps: last step; None: the scenario's.
        settings: values by dotted key; text is read as YAML.
        tolerances: by field of the log.
        ignore: topics and fields of the log.
        test: the file of the test that makes it.

    Raises:
        ScenarioError: no such scenario.
    """
    shipped = str(scenario) in scenario_names()
    if not shipped:
        load_scenario(scenario)  # the error names the path as given, not as seen from the folder
    return GoldenSpec(
        scenario=str(scenario) if shipped else name_from(Path(scenario), folder),
        policy=with_file(policy, lambda path: name_from(Path(path), folder)),
        seed=seed,
        steps=steps,
        settings=setting_texts(settings),
        tolerances=dict(tolerances or {}),
        ignore=tuple(ignore),
        test="" if test is None else name_from(test, folder),
    )


def spec_of(header: RunHeader) -> GoldenSpec:
    """Return the spec that a golden was made by; for any other recording, one that runs it again as recorded.

    Raises:
        LogError: the attached spec is not one.
    """
    content = header.attachments.get(SPEC_ATTACHMENT)
    if content is None:
        return GoldenSpec(scenario="", policy=header.policy, seed=header.seed, steps=header.n_steps_max)
    try:
        return msgspec.json.decode(content, type=GoldenSpec)
    except msgspec.DecodeError as error:
        raise LogError(f"{SPEC_ATTACHMENT}: {error}; the golden was not made by `fireworld golden`") from None


def encode_spec(spec: msgspec.Struct) -> bytes:
    """Return a spec as it is attached to a recording; a test that made it is named only if there is one."""
    return msgspec.json.encode(
        {key: value for key, value in msgspec.structs.asdict(spec).items() if key != "test" or value}
    )


def prepare_golden(
    spec: GoldenSpec,
    folder: Path,
    *,
    recorded: RunHeader | None = None,
    policy: NamedPolicy | None = None,
    cities: CityCache | None = None,
) -> PreparedRun:
    """Prepare the run of a spec, with everything as it is now.

    Args:
        spec: what to run.
        folder: where its golden is, or is going to be.
        recorded: header of the golden; needed to run the scenario as recorded.
        policy: the policy, where a name cannot find it.
        cities: cities built before, used and added to.

    Raises:
        ScenarioError, CityError, PolicyError, TrainingError, LogError: what the spec names cannot be found or loaded.
    """
    if not spec.scenario:
        return _prepare_recorded(spec, recorded)
    path = spec.scenario if spec.scenario in scenario_names() else path_to(folder, spec.scenario)
    scenario = load_scenario(path).with_settings(spec.settings)
    named = policy or find_policy(with_file(spec.policy, lambda way: str(path_to(folder, way))))
    if not named.attachments:  # a recording names a file of code as its spec does, not by where it is on this machine
        named = replace(named, name=spec.policy)
    built = (cities or CityCache()).build(scenario)
    run = prepare_run(built, named, seed=spec.seed, n_steps_max=spec.steps)
    attachments = {**run.header.attachments, SPEC_ATTACHMENT: encode_spec(spec)}
    return replace(run, header=replace(run.header, attachments=attachments))


def _prepare_recorded(spec: GoldenSpec, recorded: RunHeader | None) -> PreparedRun:
    """Prepare a run whose scenario, and team if there is one, are those in the recording."""
    if recorded is None:
        raise LogError(expected(SPEC_ATTACHMENT, "scenario", "a name or a file", "none"))
    if recorded.forked_from:
        raise LogError("a recording that branched off from another one cannot be a golden; it has no start of its own")
    named = refind_policy(recorded)
    built = build_recorded(recorded)
    world = built.world(seed=spec.seed, n_steps_max=spec.steps)
    header = replace(
        recorded, policy_digest=named.digest, fireworld_version=__version__, simulator_digest=simulator_digest()
    )
    return PreparedRun(header=header, city=built.city_record(), start=world, policy=named.policy)


def hash_line(digest: str) -> str:
    """Return the last line of a golden's text, by which it is known whose text it is."""
    return f"hash {digest}"


def setting_texts(settings: Mapping[str, Any] | None) -> dict[str, str]:
    """Return settings as `--set` takes them."""
    return {key: value if isinstance(value, str) else json.dumps(value) for key, value in (settings or {}).items()}


def path_to(folder: Path, relative: str) -> Path:
    """Return the path of a file that is given relative to a folder."""
    return Path(os.path.normpath(folder / relative))
