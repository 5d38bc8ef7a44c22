"""What learners played, on the page of a training: a table of scenarios, and how to get an episode again."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from html import escape

from fireworld.errors import one_line
from fireworld.html_page import html_table, text_cell
from fireworld.training.log.course import opening
from fireworld.training.log.reader import TrainingLog
from fireworld.training.log.spread import LAST
from fireworld.training.log.summary import HEADS_PLAYED, played_cells, played_in_scenarios


def scenarios_played(log: TrainingLog, name: str) -> Iterator[str]:
    """Yield the table of scenarios, with the command that opens the last episode of each."""
    rows = []
    for row in played_in_scenarios(log):
        first, *cells = played_cells(row)
        command = opening(log, row["name"], -1)
        rows.append([text_cell(escape(first)), *cells, text_cell(f"<code>{escape(command)}</code>")])
    yield f"<h2>Scenarios of {escape(name)}</h2>"
    yield html_table([*HEADS_PLAYED, "opens its last episode"], rows)
    yield f"<p>Return and score: means of the last {LAST} episodes. Left: before their end. Unknown: begun in states"
    yield " that nobody knows, so that they cannot be replayed.</p>"


def again_played(log: TrainingLog, name: str) -> Iterator[str]:
    """Yield the command that plays everything again, for only the learner can learn it again."""
    path = shlex.quote(one_line(log.path.name))
    check = f"fireworld verify {path}   # from the log alone: every episode is played again and compared"
    yield f"<h3>{escape(one_line(name))}</h3>"
    yield f"<pre>{escape(check)}</pre>"
