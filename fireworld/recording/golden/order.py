"""Golden recordings: what a recording that is kept to compare with says about how to run it again."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

import msgspec

from fireworld import __version__
from fireworld.errors import LogError, expected
from fireworld.parameters import PRESETS
from fireworld.policy.names import TEAM_ATTACHMENT, NamedPolicy, find_policy
from fireworld.policy.teams.npz import SUFFIX
from fireworld.policy.teams.team import parse_team
from fireworld.recording.replay import build_recorded
from fireworld.records import RunHeader
from fireworld.scenario import Scenario, load_scenario, parse_scenario, scenario_names
from fireworld.scenario.document import DIRECTIONS
from fireworld.simulation.built import CityCache
from fireworld.simulation.placement import SCENARIO_ATTACHMENT
from fireworld.simulation.run import PreparedRun, prepare_run

ORDER_ATTACHMENT: Final = "golden.json"
"""What a golden recording calls the order that it was made by."""


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """What to run, by names that are looked up anew each time, and how exactly to compare it."""

    scenario: str
    """A shipped one's name; the path of a file, from the folder of the golden; empty: the scenario as recorded."""
    policy: str
    """As on the command line; a team file by its path from the folder of the golden."""
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)] = 1
    steps: Annotated[int, msgspec.Meta(ge=1)] | None = None
    """Last step; None: the scenario's."""
    settings: dict[str, str] = {}
    """YAML values by dotted key, as `--set` takes them."""
    tolerances: dict[str, float] = {}
    """The largest difference that counts as none, by field of the log."""
    ignore: tuple[str, ...] = ()
    """Topics and fields of the log that are not compared."""


def place_order(
    folder: Path,
    *,
    scenario: str | Path,
    policy: str,
    seed: int,
    steps: int | None = None,
    settings: Mapping[str, str] | None = None,
    tolerances: Mapping[str, float] | None = None,
    ignore: Collection[str] = (),
) -> Order:
    """Word an order for a golden in `folder`, so that files are found again from there.

    Args:
        folder: where the golden is going to be.
        scenario: a shipped name, or a file as seen from the current folder.
        policy: a name as on the command line; a team file as seen from the current folder.
        seed: of the run's luck.
        steps: last step; None: the scenario's.
        settings: YAML values by dotted key.
        tolerances: by field of the log.
        ignore: topics and fields of the log.

    Raises:
        ScenarioError: no such scenario.
    """
    shipped = str(scenario) in scenario_names()
    if not shipped:
        load_scenario(scenario)  # complains in the user's words, not in those of the path from the folder
    return Order(
        scenario=str(scenario) if shipped else _seen_from(folder, Path(scenario)),
        policy=_seen_from(folder, Path(policy)) if policy.endswith(SUFFIX) else policy,
        seed=seed,
        steps=steps,
        settings=dict(settings or {}),
        tolerances=dict(tolerances or {}),
        ignore=tuple(ignore),
    )


def order_of(header: RunHeader) -> Order:
    """Read the order that a golden was made by; of any other recording, make one that runs it again as recorded.

    Raises:
        LogError: the order is none.
    """
    content = header.attachments.get(ORDER_ATTACHMENT)
    if content is None:
        return Order(scenario="", policy=header.policy, seed=header.seed, steps=header.n_steps_max)
    try:
        return msgspec.json.decode(content, type=Order)
    except msgspec.DecodeError as error:
        raise LogError(f"{ORDER_ATTACHMENT}: {error}; the golden was not made by `fireworld golden`") from None


def prepare_golden(
    order: Order,
    folder: Path,
    *,
    recorded: RunHeader | None = None,
    policy: NamedPolicy | None = None,
    cities: CityCache | None = None,
) -> PreparedRun:
    """Get the run of an order ready, with everything as it is now.

    Args:
        order: what to run.
        folder: where its golden is, or is going to be.
        recorded: header of the golden, for an order to run the scenario as recorded.
        policy: the policy, where a name cannot find it.
        cities: cities built before, used and added to.

    Raises:
        ScenarioError, CityError, PolicyError, TrainingError, LogError: what the order names cannot be had.
    """
    if not order.scenario:
        return _prepare_recorded(order, recorded)
    found = order.scenario if order.scenario in scenario_names() else _reached(folder, order.scenario)
    scenario = load_scenario(found).with_settings(order.settings)
    name = str(_reached(folder, order.policy)) if order.policy.endswith(SUFFIX) else order.policy
    built = (cities or CityCache()).build(scenario)
    run = prepare_run(built, policy or find_policy(name), seed=order.seed, n_steps_max=order.steps)
    attachments = {**run.header.attachments, ORDER_ATTACHMENT: msgspec.json.encode(order)}
    return replace(run, header=replace(run.header, attachments=attachments))


def recorded_scenario(header: RunHeader) -> Scenario:
    """Read the scenario that is attached to a recording.

    Raises:
        LogError: there is none.
        ScenarioError: it makes no sense.
    """
    text = header.attachments.get(SCENARIO_ATTACHMENT)
    if text is None:
        raise LogError(expected("recording", "attachments", SCENARIO_ATTACHMENT, sorted(header.attachments)))
    return parse_scenario(text, source=f"recording: {SCENARIO_ATTACHMENT}")


def kind_of(scenario: Scenario) -> str:
    """Say of which kind a scenario is: which ways through the simulator its runs take.

    Scenarios that differ in places, numbers of buildings or people, or luck alone are of one kind.
    """
    changed = scenario.resolved_parameters != PRESETS[scenario.preset]
    return ", ".join(
        (
            f"{'generated city' if scenario.city.generated else 'city'} of {scenario.city.summary}",
            f"{scenario.brigades.n} brigades",
            _where_fire_is(scenario),
            _where_people_are(scenario),
            f"choices {scenario.choices}",
            f"reward {scenario.reward}",
            f"parameters {scenario.preset}" + (" with changes" if changed else ""),
        )
    )


def _where_fire_is(scenario: Scenario) -> str:
    place = "one place" if len(scenario.fires) == 1 else "several places"
    return f"fire in {place}" + (", by building" if any(fire.buildings for fire in scenario.fires) else "")


def _where_people_are(scenario: Scenario) -> str:
    civilians = scenario.civilians
    if civilians.count == 0:
        return "no civilians"
    if civilians.buildings is not None:
        return "civilians by building"
    return "civilians all around" if set(civilians.directions) == set(DIRECTIONS) else "civilians on some sides"


def _prepare_recorded(order: Order, recorded: RunHeader | None) -> PreparedRun:
    """Get a run ready whose scenario, and team if there is one, are those in the recording."""
    if recorded is None:
        raise LogError(expected(ORDER_ATTACHMENT, "scenario", "a name or a file", "none"))
    if recorded.forked_from:
        raise LogError("a recording that branched off from another one cannot be a golden; it has no start of its own")
    content = recorded.attachments.get(TEAM_ATTACHMENT)
    if content is None:
        named = find_policy(order.policy)
    else:
        team = parse_team(content, source=f"recording: {TEAM_ATTACHMENT}")
        policy = team.policy()
        named = NamedPolicy(order.policy, policy.digest, policy)
    built = build_recorded(recorded)
    world = built.world(seed=order.seed, n_steps_max=order.steps)
    header = replace(recorded, policy_digest=named.digest, fireworld_version=__version__)
    return PreparedRun(header=header, city=built.city_record(), start=world, policy=named.policy)


def _seen_from(folder: Path, path: Path) -> str:
    """Write the way from a folder to a file, the same on every machine."""
    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()


def _reached(folder: Path, way: str) -> Path:
    """Follow the way from a folder to a file."""
    return Path(os.path.normpath(folder / way))
