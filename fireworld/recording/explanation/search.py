"""Explain: which decisions of the better of two runs make up how much of the difference between their scores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from fireworld.recording.explanation.stretches import Stretch

KEPT_SHARE: Final = 0.8
"""A stretch is narrowed down as long as one half of it gains at least this share of what the whole gains."""
NARROWED_FROM_SHARE: Final = 0.05
"""Stretches that explain less are not narrowed down."""
NARROWED_MAX: Final = 10
"""Stretches that are narrowed down at most, those that explain most."""

ScoreAll = Callable[[Sequence[Sequence[Stretch]]], Sequence[float | None]]
"""From lists of stretches to the scores of the replays in which brigades are told so; None: it was not done."""


@dataclass(frozen=True)
class Found:
    """What one stretch explains.

    Attributes:
        stretch: the decisions.
        score: of the worse run with them in it.
        share: of the difference of the scores; negative if they make the worse run still worse, above 1 if it gets
            better than the better run.
        core: the part of the stretch that it was narrowed down to, with its score and share; None if it was not.
        share_without: what all other stretches that were tried explain together, without this one; None if not tried.
    """

    stretch: Stretch
    score: float
    share: float
    core: Found | None = None
    share_without: float | None = None


@dataclass(frozen=True)
class Explanation:
    """What is known about the difference of two runs' scores.

    Attributes:
        worse_score: of the worse run.
        better_score: of the better run.
        n_stretches: stretches in which the runs' decisions differ.
        found: the stretches that were tried, those that explain most first.
        together: score and share of all stretches to be tried at once; None if that was not tried.
        n_replays: replays done.
    """

    worse_score: float
    better_score: float
    n_stretches: int
    found: tuple[Found, ...]
    together: tuple[float, float] | None
    n_replays: int


def explain(
    stretches: Sequence[Stretch], *, worse_score: float, better_score: float, budget: int, score_all: ScoreAll
) -> Explanation:
    """Try stretches one by one, the earliest first, all at once, and all but one; narrow down those that explain most.

    Args:
        stretches: decisions of the better run.
        worse_score: of the worse run.
        better_score: of the better run; it must be higher.
        budget: replays at most.
        score_all: does replays.
    """
    search = _Search(worse_score=worse_score, better_score=better_score, budget=budget, score_all=score_all)
    tried = stretches[: budget - 1]
    together, *scores = search.scores([tried, *((stretch,) for stretch in tried)]) if tried else [None]
    found = [
        Found(stretch, score, search.share(score))
        for stretch, score in zip(tried, scores, strict=True)
        if score is not None
    ]
    found.sort(key=lambda one: (-one.share, one.stretch.first, one.stretch.brigade))
    found = search.leave_out(found, tried)
    return Explanation(
        worse_score=worse_score,
        better_score=better_score,
        n_stretches=len(stretches),
        found=tuple(search.narrow(found)),
        together=None if together is None else (together, search.share(together)),
        n_replays=search.n_replays,
    )


class _Search:
    """The replays, counted."""

    def __init__(self, *, worse_score: float, better_score: float, budget: int, score_all: ScoreAll) -> None:
        self.n_replays = 0
        self._worse_score = worse_score
        self._difference = better_score - worse_score
        self._left = budget
        self._score_all = score_all

    def share(self, score: float) -> float:
        """Return the share of the difference that a replay's score makes up."""
        return (score - self._worse_score) / self._difference

    def scores(self, told: Sequence[Sequence[Stretch]]) -> Sequence[float | None]:
        """Do replays."""
        done = self._score_all(told)
        self._left -= len(told)
        self.n_replays += sum(score is not None for score in done)
        return done

    def leave_out(self, found: Sequence[Found], tried: Sequence[Stretch]) -> list[Found]:
        """Try all stretches but one, for each of them, with at most half of the budget that is left."""
        chosen = sorted(found, key=lambda one: -abs(one.share))[: self._left // 2] if len(tried) > 1 else []
        rests = [[stretch for stretch in tried if stretch is not one.stretch] for one in chosen]
        scores = dict(zip((one.stretch for one in chosen), self.scores(rests), strict=True))
        return [
            one if (score := scores.get(one.stretch)) is None else replace(one, share_without=self.share(score))
            for one in found
        ]

    def narrow(self, found: Sequence[Found]) -> list[Found]:
        """Halve the stretches that explain most, again and again, while one half keeps most of what the whole gains."""
        cores = {place: one for place, one in enumerate(found[:NARROWED_MAX]) if one.share >= NARROWED_FROM_SHARE}
        under_way = list(cores)
        while under_way := [place for place in under_way if cores[place].stretch.n_steps > 1][: self._left // 2]:
            halves = [half for place in under_way for half in cores[place].stretch.halves()]
            scores = self.scores([(half,) for half in halves])
            kept = []
            for turn, place in enumerate(under_way):
                pair = [
                    Found(half, score, self.share(score))
                    for half, score in zip(
                        halves[2 * turn : 2 * turn + 2], scores[2 * turn : 2 * turn + 2], strict=True
                    )
                    if score is not None
                ]
                best = max(pair, key=lambda one: one.share, default=None)
                if best is not None and best.share >= KEPT_SHARE * found[place].share:
                    cores[place] = best
                    kept.append(place)
            under_way = kept
        return [
            replace(one, core=cores[place]) if place in cores and cores[place] is not one else one
            for place, one in enumerate(found)
        ]
