"""One recording, or two of one city, as an HTML page: outcome, maps, curves, decisions, events, how to repeat it."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from itertools import chain
from pathlib import Path
from typing import Final

import numpy as np
from fireworld_recorder.totals import final_outcome
from fireworld_viewer.pictures.curves import draw_curves, draw_timeline
from fireworld_viewer.pictures.figure_files import plain_style, png_bytes
from fireworld_viewer.pictures.maps import draw_steps
from fireworld_viewer.play.page import frame
from fireworld_viewer.story.narration import event_lines
from fireworld_viewer.story.series import Counts, count_choices
from fireworld_viewer.story.steps import evenly_spaced, select_steps

from fireworld.errors import one_line
from fireworld.files import check_output, write_file
from fireworld.html_page import compared_row, html_credit, html_figure, html_page, html_table, text_cell
from fireworld.outcome import NOT_RECORDED, QUANTITIES
from fireworld.recording.inputs import AnyRun, open_one_or_two, run_name
from fireworld.recording.pages.play import page_of_steps
from fireworld.records import ACTION_NAMES, EVENT_KINDS, Recording, StoredRun, name_of
from fireworld.version import simulator_version

_STYLE: Final = """
pre { background: #f0ede6; padding: .7rem 1rem; overflow-x: auto; font-size: 13px; }
td.text:first-child { white-space: nowrap; } summary { cursor: pointer; }
"""
ENDINGS: Final = (".html", ".htm")  # of the page's file
SCENARIO: Final = "scenario.yaml"  # every recording has its scenario in a file of that name
_ALWAYS_OF_NOTE: Final = frozenset({"civilian-hurt", "civilian-died", "brigade-hurt", "brigade-died", "site-out"})
_FIRST_OF_NOTE: Final = frozenset({"ignited", "burnt-out", "extinguished", "tank-empty"})
_MAPS: Final = 4  # in the strip
_MAPS_CAPTION: Final = "The city at the start, at the end and evenly between."
_ROWS_CAPTION: Final = "Above A, below B; a run that ended before the other keeps its last state."
_EVENTS_SHOWN: Final = 40
_TARGETS_SHOWN: Final = 12


def report(logs: AnyRun | Sequence[AnyRun], output: Path | str, *, force: bool = False) -> None:
    """Write one recording, or two of one city, as an HTML page that needs no other file.

    Recordings are paths or runs; those that were cut off or damaged are reported as far as they are good. Errors:
    OutputError, LogError, or ViewError if there is no matplotlib, no step, or if the cities differ.
    """
    check_output(Path(output), endings=ENDINGS, force=force)
    runs = open_one_or_two(logs)
    maps = evenly_spaced(runs, _MAPS)
    shown = [select_steps(run) for run in runs]  # each file is read once
    with plain_style():
        images = {"maps": png_bytes(draw_steps(shown, maps)), "curves": png_bytes(draw_curves(shown))}
        if any(map(_has_decisions, runs)):
            images["timeline"] = png_bytes(draw_timeline(shown))
    write_file(Path(output), _run_page(runs, shown, images, page_of_steps(shown, runs)))


def _run_page(logs: Sequence[StoredRun], shown: Sequence[Recording], images: Mapping[str, bytes], played: str) -> str:
    """Write the page, with PNG files: "maps" and "curves" of all runs, "timeline" of decisions if there is one.

    `shown` are the steps of the runs, to be read often, `played` the page on which they play.
    """
    names = _names(logs)
    title = " against ".join(one_line(log.header.title) for log in logs)
    rewarded = not all(log.header.lacks("rewards") for log in logs)
    imported = all(log.header.imported for log in logs)
    signs = " Rewards are never above zero: less is worse." if rewarded else ""
    body = [
        f"<h1>{escape(title)}</h1>",
        *(f'<p class="caveat">{escape(f"{_name(log)}: {log.damage}; the page ends with the last good step")}</p>'
          for log in logs if log.damage is not None),
        "<h2>Outcome</h2>",
        _outcome(logs, names),
        "<h2>Play</h2>",
        frame(played, label="the run, which plays" if len(logs) == 1 else "both runs, side by side"),
        "<h2>Maps</h2>",
        html_figure(images["maps"], _MAPS_CAPTION if len(logs) == 1 else f"{_MAPS_CAPTION} {_ROWS_CAPTION}"),
        "<h2>Curves</h2>",
        html_figure(images["curves"], f"Steps are simulated minutes.{signs}"),
        "<h2>Decisions</h2>",
        *([html_figure(images["timeline"], "White where a brigade made no choice: it refilled, or nothing burned.")]
          if "timeline" in images else []),
        *(part for steps, name in zip(shown, names, strict=True) for part in _decisions(steps, name)),
        "<h2>Events</h2>",
        _event_counts(shown, names),
        *(part for steps, name in zip(shown, names, strict=True) for part in _events_of_note(steps, name)),
        f"<h2>{'Where it comes from' if imported else 'How to get the same again'}</h2>",
        *(part for log, name in zip(logs, names, strict=True) for part in _repetition(log, name)),
        *_scenarios(logs, names),
        *html_credit(log.city.attribution for log in logs),
    ]  # fmt: skip
    return html_page(f"fireworld: {title}", body, style=_STYLE)


def _names(logs: Sequence[StoredRun]) -> list[str]:
    """Return the names of the recordings, with A and B if there are two."""
    if len(logs) == 1:
        return [one_line(_name(logs[0]))]
    return [f"{letter}: {one_line(_name(log))}" for letter, log in zip("AB", logs, strict=True)]


def _name(log: StoredRun) -> str:
    return Path(run_name(log)).name


def _outcome(logs: Sequence[StoredRun], names: Sequence[str]) -> str:
    columns = [_outcome_of(log) for log in logs]
    rows = [compared_row(label, [column[label] for column in columns]) for label in columns[0]]
    note = "<p>Bold: where they differ.</p>" if len(logs) > 1 else ""
    return html_table(["", *map(escape, names)], rows) + note


def _outcome_of(log: StoredRun) -> dict[str, str]:
    outcome, last = final_outcome(log), log.step(int(log.steps[-1]))
    ended = "the scenario's last step" if last.truncated else "stopped"
    return {
        "scenario": one_line(log.header.scenario),
        "policy": one_line(log.header.policy),
        "seed": NOT_RECORDED if log.header.lacks("seed") else str(log.header.seed),
        "last step": f"{last.step}: {'nothing burned any more' if last.terminated else ended}",
        **{quantity.label: quantity.text(outcome) for quantity in QUANTITIES},
        "score by today's rule": f"{outcome.score_now:.3f}",
        "digest": log.digest[:12],
    }


def _decisions(log: Recording, name: str) -> Iterator[str]:
    """Write how often each brigade chose which action, and which targets it named itself."""
    if not _has_decisions(log):
        yield f"<p>{escape(name)}: {NOT_RECORDED}.</p>"
        return
    found = count_choices(log)
    used = [k for k in range(len(ACTION_NAMES)) if any(one.n_by_action[k] for one in found)]
    explored = any(one.n_explored for one in found)
    heads = ["brigade", *(ACTION_NAMES[k] for k in used), "no choice", "other than before",
             *(["explored"] if explored else []), "sprayed, litres", "driven, m", "refills"]  # fmt: skip
    rows = [
        [text_cell(str(one.brigade)), *(_share(one, one.n_by_action[k]) for k in used), _share(one, one.n_without),
         str(one.n_changes), *([str(one.n_explored)] if explored else []),
         f"{one.sprayed_litres:,}", f"{one.driven_m:,.0f}", str(one.n_refills)]
        for one in found
    ]  # fmt: skip
    yield f"<h3>{escape(name)}</h3>"
    yield html_table(heads, rows)
    yield "<p>Steps in which a brigade chose an action, and how often a choice was another than the one before.</p>"
    own = [(one.brigade, target) for one in found for target in one.own_targets[:_TARGETS_SHOWN]]
    if own:
        ids = log.city.building_id
        targets = [[text_cell(str(brigade)), str(int(ids[target.building])), str(target.n_steps),
                    str(target.first_step), str(target.last_step)] for brigade, target in own]  # fmt: skip
        yield html_table(["brigade", "own target, building", "steps", "first", "last"], targets)
        more = sum(max(0, len(one.own_targets) - _TARGETS_SHOWN) for one in found)
        if more:
            yield f"<p>The {_TARGETS_SHOWN} targets that each brigade pursued longest; {more} more are left out.</p>"


def _has_decisions(log: Recording) -> bool:
    return not log.header.lacks("decisions")


def _share(one: Counts, n: int) -> str:
    total = sum(one.n_by_action) + one.n_without
    return f'{n} <span class="interval">{100 * n / max(1, total):.0f}&nbsp;%</span>' if n else "0"


def _event_counts(logs: Sequence[Recording], names: Sequence[str]) -> str:
    """Write how often each kind of event happened, and when first and last."""
    found = [_steps_by_kind(log) for log in logs]
    known = dict.fromkeys([*EVENT_KINDS, *(kind for steps in found for kind in steps)])
    kinds = [kind for kind in known if any(steps.get(kind) for steps in found)]
    counts = [[_count_cells(steps.get(kind, [])) for steps in found] for kind in kinds]
    rows = [[text_cell(kind.replace("-", " ")), *chain(*cells)] for kind, cells in zip(kinds, counts, strict=True)]
    heads = [f"{escape(name)}: {what}" if len(logs) > 1 else what for name in names for what in ("how often", "steps")]
    return html_table(["event", *heads], rows) if rows else "<p>Nothing happened.</p>"


def _count_cells(steps: Sequence[int]) -> tuple[str, str]:
    if not steps:
        return "0", "-"
    return str(len(steps)), str(steps[0]) if steps[0] == steps[-1] else f"{steps[0]} to {steps[-1]}"


def _steps_by_kind(log: Recording) -> dict[str, list[int]]:
    steps: dict[str, list[int]] = {kind: [] for kind in EVENT_KINDS}
    for step, kinds in zip(log.steps.tolist(), log.ragged("/events", "kind"), strict=True):
        for kind in np.asarray(kinds).tolist():
            steps.setdefault(_event_kind(kind), []).append(step)
    return steps


def _event_kind(kind: int) -> str:
    """Return the name of a kind of events, its number where only a later version knows it."""
    return name_of(EVENT_KINDS, kind, "kind")


def _events_of_note(log: Recording, name: str) -> Iterator[str]:
    """List what happened to people, fires that are out, and the first of what happens often."""
    kinds = [_event_kind(kind) for row in log.ragged("/events", "kind") for kind in np.asarray(row).tolist()]
    met: set[str] = set()
    noted: list[tuple[int, str]] = []
    for kind, (step, _, text, _) in zip(kinds, event_lines(log), strict=True):
        if kind in _ALWAYS_OF_NOTE:
            noted.append((step, text))
        elif kind in _FIRST_OF_NOTE and kind not in met:
            noted.append((step, f"{text}, the first"))
        met.add(kind)
    if noted:
        yield f"<h3>{escape(name)}</h3>"
        rows = [[str(step), text_cell(escape(text))] for step, text in noted[:_EVENTS_SHOWN]]
        yield html_table(["step", "of note"], rows, n_text=0)
    if len(noted) > _EVENTS_SHOWN:
        yield f"<p>{len(noted) - _EVENTS_SHOWN} more are left out; the recording has them.</p>"


def _repetition(log: StoredRun, name: str) -> Iterator[str]:
    """Write what identifies a run, and which commands repeat it."""
    header = log.header
    rows = {
        "recording": _name(log),
        "scenario": f"{header.scenario}, {header.scenario_digest}",
        "policy": ", ".join(word for word in (header.policy, header.policy_digest) if word),
        "seed": "" if header.lacks("seed") else str(header.seed),
        "origin": header.origin,
        "not recorded": header.not_recorded,
        "forked from": header.forked_from,
        "digest of the run": log.digest,
        "recorded by": f"fireworld {simulator_version(header.fireworld_version, header.simulator_digest)}",
        "files in the recording": ", ".join(f"{file} ({len(data)} bytes)" for file, data in header.attachments.items()),
    }
    yield f"<h3>{escape(name)}</h3>"
    shown = ((label, one_line(value)) for label, value in rows.items() if value)
    yield html_table(["", ""], [[text_cell(label), text_cell(escape(value))] for label, value in shown], n_text=2)
    yield f"<pre>{escape(_commands(log))}</pre>"


def _scenarios(logs: Sequence[StoredRun], names: Sequence[str]) -> Iterator[str]:
    """Write the text of each scenario, once."""
    texts: dict[bytes, list[str]] = {}
    for log, name in zip(logs, names, strict=True):
        if SCENARIO in log.header.attachments:
            texts.setdefault(log.header.attachments[SCENARIO], []).append(name)
    for text, whose in texts.items():
        title = SCENARIO if len(whose) == len(logs) else f"{SCENARIO} of {', '.join(whose)}"
        shown = escape(text.decode("utf-8", errors="replace"))
        yield f"<details><summary>{escape(title)}</summary><pre>{shown}</pre></details>"


def _commands(log: StoredRun) -> str:
    """Return the commands that replay a run, and run it anew; a run that branched off has no beginning of its own."""
    header, recording = log.header, shlex.quote(one_line(_name(log)))
    if header.imported:
        return f"fireworld info {recording}   # an imported log has no decisions: it cannot be replayed"
    lines = [f"fireworld verify {recording}   # from the recording alone: every step is computed again and compared"]
    if not header.forked_from:
        words = ["fireworld", "run", SCENARIO, "--policy", one_line(header.policy)]
        words += ["--seed", str(header.seed), "--steps", str(header.n_steps_max), "--record", "again.mcap"]
        lines.append(f"{shlex.join(words)}   # {SCENARIO}: the text below")
    return "\n".join(lines)
