"""A recorded episode as learners see it: what each brigade saw, could do, did and got, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.arguments import ArgumentError, whole_number
from fireworld.envs.bound_worlds import BoundWorlds
from fireworld.envs.datasets.recorded import SCORE, Recorded, RecordedEpisode
from fireworld.envs.rewards import reward_of, score_share
from fireworld.envs.setup import Setup
from fireworld.envs.views import observed
from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import COUNTS, TOTAL, Array
from fireworld.kernels.batch import look_again, take_turn
from fireworld.kernels.observation import N_ACTIONS
from fireworld.training.log.environment import OWN_TARGETS_MAX
from fireworld.training.log.played import OWN

OBSERVATIONS: Final = ("features", "targets")
"""What a dataset can hold."""
OWN_TARGETS: Final = 64
"""Targets of its own that a brigade may name, of runs in which one does."""
_OF_BRIGADES: Final = frozenset({"features", "targets", "action_mask", "own"})
"""What each brigade sees for itself, when its turn comes."""
_WORLD: Final = 0


@dataclass(frozen=True)
class Shape:
    """What a dataset holds of every episode.

    Attributes:
        observation: "features" or "targets".
        reward: "score", the change of score / maximal score, or "scenario", the scenario's own.
        own_targets: k, how many of the burning buildings that a brigade may name as its own target are shown.
    """

    observation: str
    reward: str
    own_targets: int

    def __post_init__(self) -> None:
        """Raise ArgumentError for what there is not."""
        for name, known in (("observation", OBSERVATIONS), ("reward", (SCORE, "scenario"))):
            if getattr(self, name) not in known:
                raise ArgumentError(expected(name, "", f"one of {', '.join(known)}", getattr(self, name)))


@dataclass(frozen=True)
class Trajectory:
    """An episode as learners see it; t steps, b brigades, k targets of their own.

    Attributes:
        episode: as it is recorded.
        seen: arrays by name, (t + 1, ...): before every step and after the last one, as `Worlds.observe` has them:
            features (b, 8) int8 or targets (b, 4, 13) float32; action_mask (b, 4 + k) bool, alive (b,) bool, team (6,)
            float32, and own (b, k) int32, the buildings that may be named.
        decides: (t, b) bool, whether a brigade had something to choose.
        action: (t, b) int32, as environments take it: 0..3 as named, 4 + j the j-th own target, 0 if nothing.
        target: (t, b) int32, the building that a brigade named, -1 none.
        reward: (t,) float64, of the team.
        score: (t + 1,) float64, official score of the paper's time.
        counts: after the last step, by name.
        score_max: number of civilians + 1.
        state_digest: SHA-256 of the state after the last step.
    """

    episode: RecordedEpisode
    seen: dict[str, Array]
    decides: Array
    action: Array
    target: Array
    reward: Array
    score: Array
    counts: dict[str, int]
    score_max: float
    state_digest: str

    @property
    def n_steps(self) -> int:
        """Steps, t."""
        return len(self.reward)


def shape_of(
    episodes: Recorded, *, observation: str | None = None, reward: str | None = None, own_targets: int | None = None
) -> Shape:
    """Return what a dataset of some episodes holds, as far as it is not said what.

    Raises:
        ArgumentError: there is no such observation or reward, or no number.
    """
    if own_targets is None:
        more = any(one.names_targets and not one.own_targets for one in episodes)
        own_targets = max(episodes.own_targets, OWN_TARGETS if more else 0)
    return Shape(
        episodes.observation if observation is None else observation,
        episodes.reward if reward is None else reward,
        whole_number("own_targets", own_targets, least=0, most=OWN_TARGETS_MAX),
    )


def trajectory_of(episode: RecordedEpisode, shape: Shape) -> Trajectory:
    """Play a recorded episode again, and note what learners see of it.

    Brigades that choose in turn see what those before them have chosen.

    Raises:
        LogError: this fireworld computes something else than what is recorded, or a brigade named a target that is not
            among those that it may name.
    """
    return _Player(episode, shape).play()


class _Player:
    """Plays one episode in a world that kernels show to learners."""

    def __init__(self, episode: RecordedEpisode, shape: Shape) -> None:
        setup = Setup(
            (episode.scenario,),
            observation=shape.observation,
            reward=reward_of(SCORE),
            own_targets=shape.own_targets,
            n_burning_max=1,
            steps=episode.n_steps_max,
        )
        self._episode, self._shape = episode, shape
        self._bound = BoundWorlds(setup, [episode.built], [_WORLD], threads=1, others=None)
        self._seen: list[dict[str, Array]] = []
        self._in_turn = episode.scenario.choices == "in-turn"

    def play(self) -> Trajectory:
        episode, bound, result = self._episode, self._bound, self._bound.result
        bound.begin(_WORLD, _WORLD, episode.seeds[0])
        bound.show(np.array([_WORLD]), begun=False)
        n, b = episode.decided.action.shape
        action, decides, reward = np.zeros((n, b), dtype=np.int32), np.zeros((n, b), dtype=np.bool_), np.zeros(n)
        score = [float(result.score[_WORLD, 0])]
        for row in range(n):
            bound.draw_anew(_WORLD, episode.seeds.get(row, int(result.seed[_WORLD])))
            decides[row] = bound.shown.chooses[_WORLD] != 0
            before = score_share(result)[_WORLD]
            self._step(row)
            action[row] = bound.batch.actions[_WORLD]
            self._check(row)
            gained = score_share(result)[_WORLD] - before
            reward[row] = gained if self._shape.reward == SCORE else result.reward[_WORLD, TOTAL]
            score.append(float(result.score[_WORLD, 0]))
        self._seen.append({name: array[_WORLD] for name, array in self._shown().items()})
        self._check_end(n)
        return Trajectory(
            episode=episode,
            seen={name: np.stack([one[name] for one in self._seen]) for name in self._seen[0]},
            decides=decides,
            action=np.where(decides, action, 0),
            target=episode.decided.target,
            reward=reward,
            score=np.array(score),
            counts={name: int(result.counts[_WORLD, k]) for k, name in enumerate(COUNTS)},
            score_max=float(result.score[_WORLD, 1]),
            state_digest=bound.world(_WORLD).digest(),
        )

    def _shown(self) -> dict[str, Array]:
        return observed(self._bound.shown, self._shape.observation)

    def _step(self, row: int) -> None:
        """Let all brigades do what they did in a step, and note what they see before."""
        bound, looks = self._bound, list[dict[str, Array]]()
        for brigade in range(self._episode.built.n_brigades):
            if self._in_turn:
                look_again(bound.rows[_WORLD], bound.batch_row, _WORLD, brigade)
            looks.append(self._shown() if self._in_turn or not looks else looks[0])
            bound.batch.actions[_WORLD, brigade] = self._action(row, brigade)
            if self._in_turn:
                take_turn(bound.rows[_WORLD], bound.batch_row, _WORLD, brigade)
        seen = {name: array[_WORLD] for name, array in looks[0].items()}
        for name in _OF_BRIGADES & seen.keys():
            seen[name] = np.stack([look[name][_WORLD, brigade] for brigade, look in enumerate(looks)])
        self._seen.append(seen)
        bound.step(np.array([_WORLD]), decided=self._in_turn)

    def _action(self, row: int, brigade: int) -> int:
        """Return what a brigade did, as environments take it."""
        action, target = (int(one[row, brigade]) for one in self._episode.decided)
        if action != OWN:
            return max(action, 0)
        if not self._bound.shown.chooses[_WORLD, brigade]:  # it stays with the target that it keeps
            return 0
        places = np.flatnonzero(self._bound.shown.own[_WORLD, brigade] == target)
        if not len(places):
            where = f"step {row + 1}, brigade {brigade}"
            wanted = f"a target among the {self._shape.own_targets} that it may name"
            raise LogError(expected(self._episode.source, where, wanted, f"building {target}", "try more own targets"))
        return N_ACTIONS + int(places[0])

    def _check(self, row: int) -> None:
        """Compare what the brigades did in a step with what is recorded."""
        result, decided = self._bound.result, self._episode.decided
        wrong = np.flatnonzero(result.action[_WORLD] != decided.action[row])
        if len(wrong):
            got = int(result.action[_WORLD, wrong[0]])
            where = f"step {row + 1}, brigade {wrong[0]}"
            raise LogError(self._differs(where, f"action {decided.action[row, wrong[0]]}", str(got)))

    def _check_end(self, n: int) -> None:
        """Compare how it ended with what is recorded."""
        episode, result = self._episode, self._bound.result
        wanted = episode.terminated, episode.truncated, episode.score
        got = bool(result.terminated[_WORLD]), bool(result.truncated[_WORLD]), float(result.score[_WORLD, 0])
        if wanted != got:
            raise LogError(self._differs(f"step {n}", f"score {wanted[2]}", str(got[2])))

    def _differs(self, where: str, wanted: str, got: str) -> str:
        hint = "this fireworld computes something else; see `fireworld verify`"
        return expected(self._episode.source, where, wanted, got, hint)
