"""Summary: what a training log holds and how far it is good, as plain values and in lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any, Final

from fireworld.shown import SHOWN_MAX, Block, TextTable
from fireworld.training.log.played import Played
from fireworld.training.log.reader import TrainingLog
from fireworld.training.log.records import FORMAT, Episode, Evolved, Improved, Lesson, Tried
from fireworld.training.log.spread import LAST
from fireworld.version import simulator_version

HEADS: Final = ("scenario", "episodes", "steps", "ends", "return", "score", "states")
HEADS_PLAYED: Final = ("scenario", "episodes", "steps", "left", "unknown", "return", "score")
NOTE_PLAYED: Final = (
    f"left: before their end; unknown: begun in states that nobody knows, so that they\n"
    f"cannot be replayed; return, score: means of the last {LAST}"
)


def training_summary(log: TrainingLog) -> dict[str, Any]:
    """Return a training's header, state, course and sizes, as `fireworld info --json` writes them.

    Raises:
        LogError: the log changed since it was opened.
    """
    header = log.header
    return {
        "path": str(log.path),
        "format": FORMAT,
        "state": log.state,
        "damage": log.damage,
        "digest": log.digest,
        "method": {"name": log.method.name, **log.method.as_dict()},
        "curriculum": {"name": header.curriculum, "digest": header.curriculum_digest},
        "seed": header.seed,
        "fireworld_version": header.fireworld_version,
        "simulator_digest": header.simulator_digest,
        "unit": header.unit,
        "n_parts": len(log),
        "done": log.done,
        "team_digest": log.team().digest if len(log) and not log.is_played else None,
        "scenarios": list(played_in_scenarios(log) if log.is_played else _scenarios(log)),
        "attachments": {name: len(data) for name, data in header.attachments.items()},
        "n_bytes": log.found.n_bytes,
        "topics": {topic: asdict(size) for topic, size in log.topics.items()},
    }


def _scenarios(log: TrainingLog) -> Iterator[dict[str, Any]]:
    """Yield how far each scenario that has begun has come; nothing of a search."""
    names = [one.name for one in log.scenarios]
    lines = [line for line in log.lines if isinstance(line, Episode)]
    for number, name in enumerate(names):
        mine = [line for line in lines if line.scenario == number]
        if mine:
            last = mine[-1]
            yield {
                "name": name,
                "n_episodes": len(mine),
                "n_steps": sum(line.n_steps for line in mine),
                "ended": last.ended,
                "converged": last.converged,
                "return": last.total_reward,
                "score": last.score,
                "score_max": last.score_max,
                "n_visited": last.n_visited,
                "drawn": last.drawn,
            }


def played_in_scenarios(log: TrainingLog) -> Iterator[dict[str, Any]]:
    """Yield what a learner played in each scenario of which an episode is recorded."""
    names = [scenario.name for scenario in log.scenarios]
    for name in dict.fromkeys(names):
        mine: list[Played] = [line for line in log.lines if names[line.scenario] == name]
        last = mine[-LAST:]
        if mine:
            yield {
                "name": name,
                "n_episodes": len(mine),
                "n_steps": sum(line.n_steps for line in mine),
                "n_left": sum(line.left for line in mine),
                "n_unknown": sum(not line.replayable for line in mine),
                "return": math.fsum(line.total_reward for line in last) / len(last),
                "score": math.fsum(line.score for line in last) / len(last),
                "score_max": last[-1].score_max,
            }


COLUMNS: Final[Mapping[type[Any], Mapping[str, tuple[str, str]]]] = {
    Tried: {
        "generation": ("generation", "d"),
        "score": ("score_mean", ".3f"),
        "of the best": ("score_best", ".3f"),
        "spread": ("spread_mean", ".2f"),
    },
    Lesson: {
        "lesson": ("lesson", "d"),
        "epsilon": ("epsilon", ".3f"),
        "score": ("score_mean", ".3f"),
        "TD error": ("error_mean", ".2f"),
    },
    Evolved: {
        "generation": ("generation", "d"),
        "score": ("score_mean", ".3f"),
        "of the best": ("score_best", ".3f"),
        "on all fires": ("score_checked", ".3f"),
        "of the team": ("score_kept", ".3f"),
    },
    Improved: {
        "generation": ("generation", "d"),
        "score": ("score_mean", ".3f"),
        "decisions": ("n_decisions", ",d"),
        "gain": ("gain", ".5f"),
        "of the team on all fires": ("score_checked", ".3f"),
    },
}
"""What is shown of parts that are of no one scenario: by heading, the field and how it is written."""


def describe_training(log: TrainingLog, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
    """Yield what there is to see of a training: its header, then a table of its scenarios or generations."""
    found = training_summary(log)
    complete = "complete" if log.done or log.is_played else "complete as far as it goes: the training is not done"
    method = ", ".join(f"{key} {value}" for key, value in found["method"].items() if key != "name")
    lines = {
        "training": f"{log.path}, {found['n_bytes']:,} bytes, {found['format']}",
        "state": found["damage"] or complete,
        "method": f"{found['method']['name']}: {method}",
        "curriculum": f"{found['curriculum']['name']} ({found['curriculum']['digest'][:12]}), seed {found['seed']}",
        "fireworld": simulator_version(found["fireworld_version"], found["simulator_digest"]),
        "digest": found["digest"],
        "team": found["team_digest"] or ("not known" if log.is_played else "none"),
        log.header.unit + "s": f"{len(log):,}",
    }
    for label, text in lines.items():
        yield f"{label:<12} {text}"
    rows = found["scenarios"]
    if rows:
        yield ""
        heads, cells = (HEADS_PLAYED, played_cells) if log.is_played else (HEADS, _cells)
        shown = rows if len(rows) <= limit else [*rows[: limit // 2], *rows[-(limit - limit // 2) :]]
        yield TextTable(heads, [cells(row) for row in shown])
        if len(rows) > len(shown):
            yield f"{len(rows) - len(shown)} scenarios between these; --json has all"
        if log.is_played:
            yield from ("", NOTE_PLAYED)
    elif len(log):
        yield ""
        columns = COLUMNS.get(type(log.lines[0]), {})
        table = [[format(getattr(line, name), how) for name, how in columns.values()] for line in log.lines[-limit:]]
        yield TextTable([*columns], table)


def played_cells(row: dict[str, Any]) -> list[str]:
    """Return a row of `played_in_scenarios` under `HEADS_PLAYED`."""
    return [
        row["name"],
        f"{row['n_episodes']:,}",
        f"{row['n_steps']:,}",
        str(row["n_left"]),
        str(row["n_unknown"]),
        f"{row['return']:.4g}",
        f"{row['score']:.2f}/{row['score_max']:.0f}",
    ]


def _cells(row: dict[str, Any]) -> list[str]:
    ends = "settled" if row["converged"] else "not settled" if row["ended"] else "under way"
    return [
        row["name"],
        str(row["n_episodes"]),
        f"{row['n_steps']:,}",
        ends,
        f"{row['return']:,.0f}",
        f"{row['score']:.2f}/{row['score_max']:.0f}",
        str(row["n_visited"]),
    ]
