"""Recorded episodes, from logs of runs and of what learners played: what a dataset is made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import numpy as np

from fireworld.arguments import RUN_SEED_MAX
from fireworld.errors import LogError, expected, one_line
from fireworld.kernels.arrays import Array
from fireworld.recording.inputs import AnyRun, check_replayable, is_training, open_run, run_name
from fireworld.recording.replay import build_recorded
from fireworld.records import StoredRun
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.placement import CITY_ATTACHMENT
from fireworld.training.log.environment import ENVIRONMENT
from fireworld.training.log.played import OWN, Decided, Played, check_played, columns_of
from fireworld.training.log.played_run import PlayedEpisode, PlayedRun, digest_of, recorded_seeds
from fireworld.training.log.reader import AnyTraining, TrainingLog, opened
from fireworld.training.log.writer import CITY_FOLDER

SCENARIOS_OWN: Final = "scenario"
"""The reward that the scenario says."""
SCORE: Final = "score"


@dataclass(frozen=True)
class RecordedEpisode:
    """An episode that is recorded; t steps, b brigades.

    Attributes:
        built: its scenario.
        city: content of its city file, None of a city that is generated.
        decided: (t, b) what the brigades did from the start on.
        seeds: by the step after which each counts.
        n_steps_max: its last step, if it lasts so long.
        terminated, truncated: how it ended; neither: it was left.
        score: at its end.
        own_targets: how many a brigade of the learner could name; 0: none, or they are those of a policy.
        first_step: the step after which a learner played it, 0 from the start.
        name: where it is recorded, as in "episodes-1.mcap:17".
        world, number: of what a learner played, in which world, and its number there; else 0.
        run_digest: of the run, computed again from its decisions; "" of what learners played, of which it is not known.
        log_digest: of the log that it is in.
        source: what errors call it.
    """

    built: BuiltScenario
    city: bytes | None
    decided: Decided
    seeds: Mapping[int, int]
    n_steps_max: int
    terminated: bool
    truncated: bool
    score: float
    own_targets: int
    first_step: int
    name: str
    world: int
    number: int
    run_digest: str
    log_digest: str
    source: str

    @property
    def scenario(self) -> Scenario:
        """What it was played in."""
        return self.built.scenario

    @property
    def names_targets(self) -> bool:
        """Whether a brigade named a target of its own."""
        return bool((self.decided.action == OWN).any())


@dataclass(frozen=True)
class Recorded:
    """The episodes of some logs, each read when it is iterated over.

    Attributes:
        logs: of runs, and of what learners played.
        n_unknown: episodes that began in states that nobody knows, and are left out.
    """

    logs: Sequence[StoredRun | TrainingLog]
    n_unknown: int

    def __iter__(self) -> Iterator[RecordedEpisode]:
        cities = CityCache()
        for log in self.logs:
            if isinstance(log, TrainingLog):
                yield from _played(log)
            else:
                yield _of_run(log, cities)

    def __len__(self) -> int:
        return sum(len(log) if isinstance(log, TrainingLog) else 1 for log in self.logs) - self.n_unknown

    @property
    def own_targets(self) -> int:
        """How many targets of its own a brigade could name where learners played; 0: none."""
        return max((log.player.method.own_targets for log in self.logs if isinstance(log, TrainingLog)), default=0)

    @property
    def observation(self) -> str:
        """What learners were shown, if they were shown what a dataset can hold, or else features."""
        kinds = {log.player.method.observation for log in self.logs if isinstance(log, TrainingLog)}
        return "targets" if kinds == {"targets"} else "features"

    @property
    def reward(self) -> str:
        """What learners were rewarded with, if that is known; of runs the scenario's own."""
        kinds = {log.player.method.reward for log in self.logs if isinstance(log, TrainingLog)}
        return SCORE if kinds & {"score", "function"} else SCENARIOS_OWN

    @property
    def origin(self) -> dict[str, Any]:
        """The logs, as a dataset names them."""
        return {"logs": [{"name": _name(log), "digest": log.digest} for log in self.logs]}


AnyLogs: TypeAlias = "AnyRun | AnyTraining | Sequence[AnyRun | AnyTraining] | Recorded"
"""The path of a log, or a log; or several; or what `recorded` returned."""


def recorded(logs: AnyLogs) -> Recorded:
    """Open logs for a dataset, as far as they are good.

    Args:
        logs: paths of logs of runs, and of what learners played in environments; or such logs.

    Raises:
        LogError: one cannot be read, has nothing to replay, or is of a training that fireworld did itself.
    """
    if isinstance(logs, Recorded):
        return logs
    given = list(logs) if isinstance(logs, list | tuple) else [logs]
    if not given:
        raise LogError(expected("logs", "", "one at least", "none"))
    found = [_opened(one) for one in given]
    unknown = sum(not line.replayable for log in found if isinstance(log, TrainingLog) for line in log.lines)
    whole = Recorded(found, unknown)
    if not len(whole):
        raise LogError(expected(_name(found[0]), "", "an episode that can be replayed", "none"))
    return whole


def _opened(given: Any) -> StoredRun | TrainingLog:
    if not is_training(given):
        run = open_run(given, partial=True)
        check_replayable(run)
        if run.steps.tolist() != [*range(len(run))] or len(run) < 2:
            raise LogError(
                expected(run_name(run), "steps", "every step from 0 on, two at least", f"{len(run)} of them")
            )
        return run
    log = opened(given, partial=True)
    if not log.is_played:
        hint = f"`fireworld replay {log.path} --every N -o DIR` writes its episodes as runs"
        got = f"the method {log.method.name}"
        raise LogError(expected(str(log.path), "", "a run, or what a learner played in an environment", got, hint))
    return log


def _name(log: StoredRun | TrainingLog) -> str:
    """Return the name of a log's file, which may be of any bytes, as a text."""
    name = log.path.name if isinstance(log, TrainingLog) else run_name(log).rpartition("/")[2]
    return one_line(name)


def _played(log: TrainingLog) -> Iterator[RecordedEpisode]:
    for number, line in enumerate(log.lines):
        if not line.replayable:
            continue
        episode = log.played_at(number)
        record, scenario = episode.record, episode.built.scenario
        yield RecordedEpisode(
            built=episode.built,
            city=log.header.attachments.get(f"{CITY_FOLDER}{scenario.city_sha256}.json"),
            decided=episode.decided,
            seeds=record.seeds,
            n_steps_max=episode.method.last_step(scenario),
            terminated=record.terminated,
            truncated=record.truncated,
            score=record.score,
            own_targets=episode.method.own_targets,
            first_step=record.first_step,
            name=f"{_name(log)}:{number}",
            world=record.world,
            number=record.episode,
            run_digest="",
            log_digest=log.digest,
            source=episode.source,
        )


def _of_run(run: StoredRun, cities: CityCache) -> RecordedEpisode:
    header = run.header
    built = build_recorded(header, cities=cities)
    actions = np.stack([*run.ragged("decisions", "action")][1:])
    targets = np.stack([*run.ragged("decisions", "target")][1:])
    last = run.step(int(run.steps[-1]))
    episode = RecordedEpisode(
        built=built,
        city=header.attachments.get(CITY_ATTACHMENT),
        decided=_fitting(run, built.n_brigades, actions.astype(np.int32), targets.astype(np.int32)),
        seeds=recorded_seeds(header),
        n_steps_max=header.n_steps_max,
        terminated=last.terminated,
        truncated=last.truncated,
        score=last.score.score,
        own_targets=0,
        first_step=0,
        name=_name(run),
        world=0,
        number=0,
        run_digest=run.digest,
        log_digest=run.digest,
        source=run_name(run),
    )
    return replace(episode, run_digest=_digest_again(episode)) if _has_values(run) else episode


def _has_values(run: StoredRun) -> bool:
    """Return whether decisions are recorded with what they were chosen by, which a dataset does not hold."""
    names = ("explored", "q_values", "td_error", "target_value")
    return any(values.any() for name in names for values in run.ragged("decisions", name))


def _digest_again(episode: RecordedEpisode) -> str:
    """Return the digest of a run of the same decisions."""
    same = {name: getattr(episode, name) for name in SAME}
    played = as_played(episode.built, episode.decided, seeds=episode.seeds, source=episode.source, **same)
    return digest_of(PlayedRun(replace(played, run_digest="")))


SAME: Final = (
    "world", "number", "first_step", "n_steps_max", "terminated", "truncated", "score", "run_digest",
)  # fmt: skip
"""What `as_played` takes of an episode as it is."""


def as_played(
    built: BuiltScenario,
    decided: Decided,
    *,
    seeds: Mapping[int, int],
    world: int,
    number: int,
    first_step: int,
    n_steps_max: int,
    terminated: bool,
    truncated: bool,
    score: float,
    run_digest: str,
    source: str,
    digest: str = "",
) -> PlayedEpisode:
    """Return an episode as one that a learner played, to be played again; arguments as of `RecordedEpisode`.

    Raises:
        LogError: what is known of it makes no sense.
    """
    if 0 not in seeds:
        raise LogError(expected(source, "seeds", "one from the start on", "none"))
    (_, seed), *later = sorted(seeds.items())
    steps, others = zip(*later, strict=True) if later else ((), ())
    if not all(0 <= one <= RUN_SEED_MAX for one in (seed, *others)):
        raise LogError(expected(source, "seeds", f"numbers from 0 to {RUN_SEED_MAX}", "others"))
    record = Played(
        scenario=0,
        world=world,
        episode=number,
        base=0,
        seed=seed,
        seed_given=True,
        first_step=first_step,
        state=b"",
        n_steps=len(decided.action) - first_step,
        terminated=terminated,
        truncated=truncated,
        total_reward=0.0,
        score=score,
        score_max=0.0,
        n_burnt_out=0,
        n_civilians_alive=0,
        later_step=np.array(steps, dtype=np.int64),
        later_seed=np.array(others, dtype=np.uint64),
        **columns_of(decided),
    )
    check_played(record, built.n_brigades)
    method = ENVIRONMENT.with_settings({"steps": n_steps_max})
    digests = {"digest": digest, "run_digest": run_digest}
    return PlayedEpisode.of(record, built, method, log="", source=source, **digests)


def _fitting(run: StoredRun, n_brigades: int, action: Array, target: Array) -> Decided:
    """Return the decisions of a run, if its scenario has that many brigades."""
    if action.shape[1:] != (n_brigades,) or target.shape != action.shape:
        raise LogError(expected(run_name(run), "decisions", f"those of {n_brigades} brigades", f"{action.shape[1:]}"))
    named = target[action == OWN]
    if ((action < -1) | (action > OWN)).any() or ((named < 0) | (named >= len(run.city.building_id))).any():
        raise LogError(f"{run_name(run)}: decisions: an action or a target that there is not")
    return Decided(action, np.where(action == OWN, target, -1))
