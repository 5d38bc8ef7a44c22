"""An episode that somebody else's learner played, computed again: as fast as kernels do, or step by step as a run."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import msgspec
import numpy as np
from fireworld_recorder.chain import Digest

from fireworld.errors import LogError, expected
from fireworld.kernels.allocation import may_name
from fireworld.kernels.arrays import TOTAL
from fireworld.kernels.choice import GIVEN
from fireworld.policy.kernel import NO_TABLES, KernelPolicy
from fireworld.policy.names import RECORDED
from fireworld.policy.protocol import Action
from fireworld.records import ACTION_NAMES, CityRecord, RunHeader, StepRecord, Steps
from fireworld.rewards import share_gained
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.world import World
from fireworld.training.log.environment import Environment
from fireworld.training.log.played import OWN, Decided, Played, columns_of

EPISODE_ATTACHMENT: Final = "episode.json"
Number = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]


class EpisodePlace(msgspec.Struct, frozen=True, kw_only=True):
    """Where an episode comes from; recorded with its run."""

    log: str
    """Digest of the training log."""
    world: int
    episode: int
    base: int
    first_step: int
    seeds: dict[Number, Number]
    """By the step after which each counts."""


@dataclass(frozen=True)
class PlayedEpisode:
    """An episode that somebody else's learner played, with the scenario that it was played in; t steps, b brigades.

    Attributes:
        record: as it is recorded.
        built: its scenario.
        method: the environment.
        decided: (t, b) what the brigades did from the start on, or from the first step that is known.
        log: digest of the log that it is in.
        source: what errors call it.
        digest: of the state after its last step, "" where it is not known.
        run_digest: of the log of its run, likewise.
    """

    record: Played
    built: BuiltScenario
    method: Environment
    decided: Decided
    log: str
    source: str
    digest: str = ""
    run_digest: str = ""

    @classmethod
    def of(
        cls,
        record: Played,
        built: BuiltScenario,
        method: Environment,
        *,
        log: str,
        source: str,
        digest: str = "",
        run_digest: str = "",
    ) -> PlayedEpisode:
        """Make it of its record.

        Raises:
            LogError: what is recorded is not of that scenario.
        """
        if record.target.max(initial=0) >= built.city.n_buildings:
            raise LogError(f"{source}: {record.topic}: a target that is no building")
        if record.last_step > method.last_step(built.scenario):
            raise LogError(f"{source}: {record.topic}: a step after the last one")
        return cls(record, built, method, record.decided(built.n_brigades), log, source, digest, run_digest)

    @property
    def place(self) -> EpisodePlace:
        """Where it comes from."""
        named = {name: getattr(self.record, name) for name in ("world", "episode", "base", "first_step", "seeds")}
        return EpisodePlace(log=self.log, **named)


class Again:
    """A world in which the brigades do again what they did in an episode, step by step.

    Raises:
        LogError: nobody knows what was done before the learner began.
    """

    def __init__(self, episode: PlayedEpisode) -> None:
        record, self._decided = episode.record, episode.decided
        if not record.replayable:
            wanted = "an episode that began at the start, in a fork, or in a snapshot of recorded worlds"
            got = f"one that began in an unknown state after step {record.first_step}"
            raise LogError(expected(episode.source, "", wanted, got))
        self._seeds = record.seeds
        last_step = episode.method.last_step(episode.built.scenario)
        self.world: World = episode.built.world(seed=record.seed, n_steps_max=last_step)
        self.team = KernelPolicy((GIVEN,), (0,), (0,), NO_TABLES)
        self._given = self.team.ready(self.world.n_brigades)
        self._bound = self.world.bound(self._given, describes=False)

    def decide(self) -> None:
        """Let the team do next what it did; where a brigade cannot go for its own target, `easiest`."""
        world, row = self.world, self.world.step_number
        world.seed = self._seeds.get(row, world.seed)
        action, target = self._decided.action[row], self._decided.target[row]
        np.maximum(action, 0, out=self._given.action)
        own = np.flatnonzero(action == OWN)
        if len(own):
            world.look()
            where = world.state.brigades.site, world.state.sites, world.constants.brigades.free
            can = np.array([may_name(brigade, target[brigade], *where) for brigade in own.tolist()], dtype=np.bool_)
            self._given.action[own[~can]] = Action.EASIEST
            self._given.table_of[own] = target[own]

    def step(self) -> None:
        """Run the next step."""
        self.decide()
        world = self.world
        world.step_number = self._bound.run(world.seed, world.step_number, world.step_number + 1)

    @property
    def over(self) -> bool:
        """Whether the world has ended, or all is done that was done."""
        world = self.world
        return world.terminated or world.truncated or world.step_number >= len(self._decided.action)


def play_again(episode: PlayedEpisode) -> Played:
    """Return the record of an episode as this fireworld computes it; what a function of the learner's returned stays.

    Raises:
        LogError: it cannot be replayed.
    """
    again, record = Again(episode), episode.record
    world, outcome, brigades = again.world, again.world.state.outcome, again.world.state.brigades
    actions, targets = (np.full_like(one, -1) for one in episode.decided)
    total = 0.0
    while not again.over:
        row, before = world.step_number, float(outcome.score[0] / outcome.score[1])
        again.step()
        actions[row], targets[row] = brigades.action, brigades.target
        if row >= record.first_step:
            gained = float(share_gained(outcome.score[0], outcome.score[1], before))
            total += gained if episode.method.reward == "score" else float(outcome.reward[TOTAL])
    n, came = world.step_number, world.outcome
    columns: dict[str, Any] = columns_of(Decided(actions[:n], targets[:n]))
    return replace(
        record,
        n_steps=n - record.first_step,
        terminated=world.terminated,
        truncated=world.truncated,
        total_reward=record.total_reward if episode.method.reward == "function" else total,
        score=came.score,
        score_max=came.score_max,
        n_burnt_out=came.n_burnt_out,
        n_civilians_alive=came.n_civilians_alive,
        **columns,
    )


class PlayedRun:
    """An episode as a run, a `fireworld.records.Steps`: each iteration plays it again from its start.

    It raises LogError at the first step that does not come out as it is recorded.
    """

    def __init__(self, episode: PlayedEpisode) -> None:
        record, built = episode.record, episode.built
        self._episode = episode
        decided = hashlib.sha256(b"".join(one.astype("<i4").tobytes() for one in episode.decided))
        header = built.header(
            seed=record.seed,
            policy=RECORDED,
            policy_digest=decided.hexdigest(),
            n_steps_max=episode.method.last_step(built.scenario),
        )
        carried = {EPISODE_ATTACHMENT: msgspec.json.encode(episode.place) + b"\n"}
        self.header: RunHeader = replace(header, attachments={**header.attachments, **carried})
        self.city: CityRecord = built.city_record()

    def __iter__(self) -> Iterator[StepRecord]:
        again = Again(self._episode)
        observer, digest = Observer(again.world), Digest(self.city)
        for record in self._steps(again, observer):
            if self._episode.run_digest:
                digest.write(record)
            yield record
        self._check_end(again.world, digest.digest)

    def _steps(self, again: Again, observer: Observer) -> Iterator[StepRecord]:
        """Yield the steps."""
        yield observer.record()
        while not again.over:
            again.decide()
            record = observer.record(again.world.step(again.team))
            self._check(record)
            yield record

    def _check_end(self, world: World, run_digest: str) -> None:
        """Compare how it ended with what is known of it."""
        episode, played = self._episode, self._episode.record
        pairs: dict[str, tuple[object, object]] = {
            "steps": (played.last_step, world.step_number),
            "terminated": (played.terminated, world.terminated),
            "score": (played.score, world.outcome.score),
        }
        if episode.digest:
            pairs["digest"] = episode.digest, state_digest(world)
        if episode.run_digest:
            pairs["digest of the run"] = episode.run_digest, run_digest
        for name, (wanted, got) in pairs.items():
            if wanted != got:
                raise LogError(self._differs(name, str(wanted), str(got)))

    def _check(self, record: StepRecord) -> None:
        """Compare what the brigades did with what is recorded of it."""
        made, row = record.decisions, record.step - 1
        own = made.action == OWN
        wanted, got = self._episode.decided.action[row], made.action
        for brigade in np.flatnonzero((wanted != got) | (own & (self._episode.decided.target[row] != made.target))):
            where = f"step {record.step}, brigade {brigade}"
            raise LogError(self._differs(where, _action_name(int(wanted[brigade])), _action_name(int(got[brigade]))))

    def _differs(self, where: str, wanted: str, got: str) -> str:
        hint = "this fireworld computes something else; see `fireworld verify`"
        return expected(self._episode.source, where, wanted, got, hint)


def digest_of(run: Steps) -> str:
    """Run a run, and return its digest."""
    digest = Digest(run.city)
    for record in run:
        digest.write(record)
    return digest.digest


def state_digest(world: World) -> str:
    """Return the digest of the state that a world is in when its brigades look next; the world stays as it is."""
    ahead = world.copy()
    ahead.look()
    return ahead.digest()


def recorded_seeds(header: RunHeader) -> Mapping[int, int]:
    """Return the seeds of a recorded run by the step after which each counts.

    Raises:
        LogError: what is attached of its episode makes no sense.
    """
    content = header.attachments.get(EPISODE_ATTACHMENT)
    if content is None:
        return {0: header.seed}
    try:
        return msgspec.json.decode(content, type=EpisodePlace).seeds
    except msgspec.DecodeError as error:
        raise LogError(f"recording: {EPISODE_ATTACHMENT}: {error}") from None


def _action_name(action: int) -> str:
    return ACTION_NAMES[action] if action >= 0 else "nothing to choose"
