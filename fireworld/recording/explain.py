"""Explain: which decisions of the better of two runs make up how much of the difference between their scores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from html import escape
from typing import Any, Final

from fireworld.arguments import whole_number
from fireworld.errors import FireworldError, LogError, expected
from fireworld.executors import AnyExecutor, Workers, threads, workers_for
from fireworld.html_page import html_table, text_cell
from fireworld.interrupt import gentle_interrupt
from fireworld.policy.names import RECORDED
from fireworld.policy.protocol import Policy
from fireworld.recording.decisions import RecordedDecisions, check_same_draws
from fireworld.recording.explanation.counterfactual import CounterfactualRun, MakePolicy, prepare_counterfactuals
from fireworld.recording.explanation.search import ScoreAll, SearchResult, SpanEffect, search_effects
from fireworld.recording.explanation.spans import DecisionSpan, find_spans
from fireworld.recording.explanation.text import HEADS, SMALL_DIFFERENCE, closing_lines, opening_lines, rows
from fireworld.recording.inputs import AnyRun, check_replayable, open_run, run_name
from fireworld.recording.replay import Replay, build_recorded, check_replay
from fireworld.recording.resume import recorded_policy
from fireworld.records import ACTION_NAMES, ACTIONS, RunHeader, StoredRun
from fireworld.shown import text_table

BUDGET: Final = 200
BUDGET_MAX: Final = 10**9
N_THREADS: Final = 2
SHOWN_MAX: Final = 20


@dataclass(frozen=True, repr=False)
class Explanation:
    """What is known about the difference of two runs' scores.

    Attributes:
        worse: the run with the lower score; of equal ones, the first.
        better: the other one.
        worse_score: at the end of the worse run.
        better_score: at the end of the better run.
        result: what was found; nothing if the scores are equal.
        why_recorded: why the recorded decisions continue after forced ones; empty if the worse run's policy does.
        interrupted: Ctrl-C ended the search; more may be found.
    """

    worse: StoredRun
    better: StoredRun
    worse_score: float
    better_score: float
    result: SearchResult
    why_recorded: str = ""
    interrupted: bool = False

    @property
    def difference(self) -> float:
        """Of the scores."""
        return self.better_score - self.worse_score

    @property
    def is_small(self) -> bool:
        """Whether the difference is too small to be shared out."""
        return self.difference < SMALL_DIFFERENCE * (len(self.better.city.civilian_hp) + 1)

    @property
    def effects(self) -> Sequence[SpanEffect]:
        """Of the spans that were tried, those that explain most first."""
        return self.result.effects

    @property
    def together(self) -> tuple[float, float] | None:
        """Score and share of all spans to be tried at once; None if that was not tried."""
        return self.result.together

    @property
    def n_spans(self) -> int:
        """Spans in which the runs' decisions differ."""
        return self.result.n_spans

    @cached_property
    def _better_decisions(self) -> RecordedDecisions:
        return RecordedDecisions(self.better)

    def targets(self, span: DecisionSpan) -> list[int]:
        """Return the ids of the buildings that a brigade named itself in a span; empty with another action."""
        if span.action < len(ACTIONS):
            return []
        named = self._better_decisions.targets(span.brigade, first=span.first, last=span.last)
        return [int(self.better.city.building_id[building]) for building in named]

    def to_dict(self) -> dict[str, Any]:
        """Return what is known as plain values, as `fireworld explain --json` writes it; stretches are spans."""
        if self.difference == 0:
            return {"score": self.worse_score, "difference": 0.0, "stretches": []}
        runs = {"worse": (self.worse, self.worse_score), "better": (self.better, self.better_score)}
        sides = {
            side: {"path": run_name(run), "digest": run.digest, "score": score} for side, (run, score) in runs.items()
        }
        return {
            **sides,
            "difference": self.difference,
            "goes_on": "recorded" if self.why_recorded else "policy",
            "why_recorded": self.why_recorded or None,
            "n_stretches": self.n_spans,
            "n_tried": len(self.effects),
            "n_replays": self.result.n_replays,
            "interrupted": self.interrupted,
            "together": self.together and dict(zip(("score", "share"), self.together, strict=True)),
            "stretches": [self._effect_to_dict(one) for one in self.effects],
        }

    def _effect_to_dict(self, one: SpanEffect) -> dict[str, Any]:
        span, core = one.span, one.core
        return {
            "brigade": span.brigade,
            "first": span.first,
            "last": span.last,
            "action": ACTION_NAMES[span.action],
            "targets": self.targets(span),
            "instead_of": [ACTION_NAMES[action] for action in span.instead_of],
            "score": one.score,
            "share": one.share,
            "share_without": one.share_without,
            "narrowed": core
            and {"first": core.span.first, "last": core.span.last, "score": core.score, "share": core.share},
        }

    def __repr__(self) -> str:
        listed = rows(self, limit=SHOWN_MAX)
        table = ["", text_table(HEADS, listed, ">><>>>"), ""] if listed else []
        return "\n".join([*opening_lines(self), *table, *closing_lines(self, limit=SHOWN_MAX)])

    def _repr_html_(self) -> str:
        cells = [[text_cell(escape(cell)) for cell in row] for row in rows(self, limit=SHOWN_MAX)]
        parts = [f"<p>{escape(line)}</p>" for line in opening_lines(self)]
        parts += [html_table(HEADS, cells, n_text=len(HEADS))] if cells else []
        return "\n".join([*parts, *(f"<p>{escape(line)}</p>" for line in closing_lines(self, limit=SHOWN_MAX))])


def explain(
    a: AnyRun,
    b: AnyRun,
    *,
    budget: int = BUDGET,
    executor: AnyExecutor = None,
    on_replay: Callable[[], object] = lambda: None,
) -> Explanation:
    """Find out which decisions make up how much of the difference between the scores of two runs.

    The run with the lower score is replayed, each time with some decisions of the other one forced. Ctrl-C ends the
    search; what is known by then is returned.

    Args:
        a: the path of a recording, or a run.
        b: another run of the same scenario and seed.
        budget: replays at most.
        executor: what does the replays, as for `fw.compare`; None: two threads.
        on_replay: called after each replay.

    Raises:
        LogError: a run cannot be read, has not reached its end, does not replay to what is recorded, or the two have
            another scenario, seed or last step.
        PolicyError: the policy of the worse run fails.
        ArgumentError, ExecutorError: the budget or the executor makes no sense.
    """
    whole_number("budget", budget, least=2, most=BUDGET_MAX)
    workers_for(executor)  # raises for what is no executor
    first, second = open_run(a), open_run(b)
    check_replayable(first)
    check_replayable(second)
    worse, better, scores = _sorted_by_score(first, second)
    if scores[0] == scores[1]:
        return Explanation(worse, better, *scores, SearchResult())
    for run in (worse, better):
        check_replay(run, Replay(run), source=run_name(run))
    make_policy, why_recorded = _policy_of(worse)
    decisions = RecordedDecisions(better)
    built = build_recorded(worse.header)
    counterfactuals = prepare_counterfactuals(built, worse, decisions, make_policy)
    spans = find_spans(counterfactuals.recorded, decisions, n_brigades=built.n_brigades)
    with gentle_interrupt() as interrupted:
        n_threads = N_THREADS if counterfactuals.compiled else 1
        workers = threads(n_threads, stop=interrupted) if executor is None else workers_for(executor, stop=interrupted)
        result = search_effects(
            spans,
            worse_score=scores[0],
            better_score=scores[1],
            budget=budget,
            score_all=_score_all(counterfactuals, workers, on_replay),
        )
    return Explanation(worse, better, *scores, result, why_recorded, interrupted.is_set())


def _sorted_by_score(a: StoredRun, b: StoredRun) -> tuple[StoredRun, StoredRun, tuple[float, float]]:
    """Return two runs that can be compared, the worse first, and their scores."""
    names = run_name(a), run_name(b)
    check_same_draws(a.header, b.header, names=names)
    if a.header.n_steps_max != b.header.n_steps_max:
        wanted = f"at most {a.header.n_steps_max}, as in {names[0]}"
        raise LogError(expected(names[1], "steps", wanted, f"at most {b.header.n_steps_max}"))
    scores = _final_score(a), _final_score(b)
    return (a, b, scores) if scores[0] <= scores[1] else (b, a, scores[::-1])


def _final_score(run: StoredRun) -> float:
    name, wanted = run_name(run), "a run that has reached its end"
    if not len(run):
        raise LogError(expected(name, "", wanted, "one without a step"))
    last = run.step(int(run.steps[-1]))
    if not (last.terminated or last.truncated):
        hint = f"`fireworld fork {name} --at {last.step} --record FILE` runs it to its end"
        raise LogError(expected(name, "", wanted, f"one that stopped at step {last.step}", hint))
    return last.score.score


def _policy_of(run: StoredRun) -> tuple[MakePolicy | None, str]:
    """Return what makes the policy of a run anew, or why that is not possible."""
    if run.header.policy == RECORDED:
        return None, f"{run_name(run)} is a fork in which recorded decisions continue"
    make = partial(_load_policy, run.header, run_name(run))
    try:
        make()
    except FireworldError as error:
        return None, str(error).partition("; ")[0]
    return make, ""


def _load_policy(header: RunHeader, source: str) -> Policy:
    return recorded_policy(header, source=source).policy


def _score_all(run: CounterfactualRun, workers: Workers, on_replay: Callable[[], object]) -> ScoreAll:
    """Return what does replays, as many at a time as there are workers, until somebody interrupts."""

    def score_all(forced: Sequence[Sequence[DecisionSpan]]) -> list[float | None]:
        scores: list[float | None] = [None] * len(forced)

        def note(number: int, score: float) -> None:
            scores[number] = score
            on_replay()

        if not workers.stop.is_set():
            workers.run([partial(run.score, spans) for spans in forced], note)
        return scores

    return score_all
