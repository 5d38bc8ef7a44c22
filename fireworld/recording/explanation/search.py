"""The search for the decisions of the better of two runs that make up the difference between their scores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from fireworld.recording.explanation.spans import DecisionSpan

KEPT_SHARE: Final = 0.8
"""A span is narrowed down as long as one half of it gains at least this share of what the whole gains."""
NARROWED_FROM_SHARE: Final = 0.05
"""Spans that explain less are not narrowed down."""
NARROWED_MAX: Final = 10
"""Spans that are narrowed down at most, those that explain most."""

ScoreAll = Callable[[Sequence[Sequence[DecisionSpan]]], Sequence[float | None]]
"""From lists of spans to the scores of the replays with these decisions forced; None: it was not done."""


@dataclass(frozen=True)
class SpanEffect:
    """What the decisions of one span explain.

    Attributes:
        span: the decisions.
        score: of the worse run with them in it.
        share: of the difference of the scores; negative if they make the worse run still worse, above 1 if it gets
            better than the better run.
        core: the part of the span that it was narrowed down to, with its score and share; None if it was not.
        share_without: what all other spans that were tried explain together, without this one; None if not tried.
    """

    span: DecisionSpan
    score: float
    share: float
    core: SpanEffect | None = None
    share_without: float | None = None


@dataclass(frozen=True)
class SearchResult:
    """What is known about the difference of two runs' scores.

    Attributes:
        n_spans: spans in which the runs' decisions differ.
        effects: of the spans that were tried, those that explain most first.
        together: score and share of all spans to be tried at once; None if that was not tried.
        n_replays: replays done.
    """

    n_spans: int = 0
    effects: tuple[SpanEffect, ...] = ()
    together: tuple[float, float] | None = None
    n_replays: int = 0


def search_effects(
    spans: Sequence[DecisionSpan], *, worse_score: float, better_score: float, budget: int, score_all: ScoreAll
) -> SearchResult:
    """Try spans one by one, the earliest first, all at once, and all but one; narrow down those that explain most.

    Args:
        spans: decisions of the better run.
        worse_score: of the worse run.
        better_score: of the better run; it must be higher.
        budget: replays at most.
        score_all: does replays.
    """
    search = _Search(worse_score=worse_score, better_score=better_score, budget=budget, score_all=score_all)
    tried = spans[: budget - 1]
    together, *scores = search.scores([tried, *((span,) for span in tried)]) if tried else [None]
    effects = [
        SpanEffect(span, score, search.share(score))
        for span, score in zip(tried, scores, strict=True)
        if score is not None
    ]
    effects.sort(key=lambda one: (-one.share, one.span.first, one.span.brigade))
    effects = search.leave_out(effects, tried)
    return SearchResult(
        n_spans=len(spans),
        effects=tuple(search.narrow(effects)),
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

    def scores(self, forced: Sequence[Sequence[DecisionSpan]]) -> Sequence[float | None]:
        """Do replays."""
        done = self._score_all(forced)
        self._left -= len(forced)
        self.n_replays += sum(score is not None for score in done)
        return done

    def leave_out(self, effects: Sequence[SpanEffect], tried: Sequence[DecisionSpan]) -> list[SpanEffect]:
        """Try all spans but one, for each of them, with at most half of the budget that is left."""
        chosen = sorted(effects, key=lambda one: -abs(one.share))[: self._left // 2] if len(tried) > 1 else []
        rests = [[span for span in tried if span is not one.span] for one in chosen]
        scores = dict(zip((one.span for one in chosen), self.scores(rests), strict=True))
        return [
            one if (score := scores.get(one.span)) is None else replace(one, share_without=self.share(score))
            for one in effects
        ]

    def narrow(self, effects: Sequence[SpanEffect]) -> list[SpanEffect]:
        """Halve the spans that explain most, again and again, while one half keeps most of what the whole gains."""
        cores = {place: one for place, one in enumerate(effects[:NARROWED_MAX]) if one.share >= NARROWED_FROM_SHARE}
        under_way = list(cores)
        while under_way := [place for place in under_way if cores[place].span.n_steps > 1][: self._left // 2]:
            halves = [half for place in under_way for half in cores[place].span.halves()]
            scores = self.scores([(half,) for half in halves])
            narrowed = []
            for turn, place in enumerate(under_way):
                pair = [
                    SpanEffect(half, score, self.share(score))
                    for half, score in zip(
                        halves[2 * turn : 2 * turn + 2], scores[2 * turn : 2 * turn + 2], strict=True
                    )
                    if score is not None
                ]
                best = max(pair, key=lambda one: one.share, default=None)
                if best is not None and best.share >= KEPT_SHARE * effects[place].share:
                    cores[place] = best
                    narrowed.append(place)
            under_way = narrowed
        return [
            replace(one, core=cores[place]) if place in cores and cores[place] is not one else one
            for place, one in enumerate(effects)
        ]
