"""Trainings as pictures and as an HTML page: convergence, curves over the episodes, tables, how to repeat them."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from fireworld_viewer.pictures.curves import LearningPanel, draw_learning_curves
from fireworld_viewer.pictures.figure_files import STILLS, plain_style, png_bytes, save_figure
from fireworld_viewer.pictures.training import CoursePanel, draw_course, draw_tables

from fireworld.errors import one_line
from fireworld.files import check_output, write_file
from fireworld.html_page import compared_row, html_figure, html_page, html_table, text_cell
from fireworld.picture import Picture
from fireworld.policy.words import short_state
from fireworld.records import Array
from fireworld.scenario import scenario_names
from fireworld.training.curriculum import curriculum_names, find_curriculum
from fireworld.training.log.course import Course, course_of, opening
from fireworld.training.log.pages.played import again_played, scenarios_played
from fireworld.training.log.pages.view import TABLES_HELP, names_of, open_trainings
from fireworld.training.log.reader import AnyTraining, TrainingLog
from fireworld.training.log.records import Episode
from fireworld.version import simulator_version

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS: Final = (".html", ".htm")
RETURN: Final = "return"
SCORE: Final = "score"
CONVERGENCE: Final = (
    (RETURN, 1000.0, "return of the episode, in thousands"),
    ("learner_return", 1.0, "return of the episode, as the learner got it"),
    (SCORE, 1.0, "score of the episode, as a share of the best"),
)
"""Plots that are drawn scenario by scenario, by what their values are divided, and their labels."""
LOGARITHMIC: Final = frozenset({"return", "td_error"})
WINDOW: Final = 20
CAPTION: Final = (
    "Bands are scenarios of the first training; diamonds stand where a policy had settled. Returns and errors on a"
    " logarithmic scale."
)
NAMED_MAX: Final = 12
"""Scenarios at most that there is room to name in a panel."""


def render_training(logs: AnyTraining | Sequence[AnyTraining], output: Path | str, *, force: bool = False) -> None:
    """Draw one training, or two of one method: all curves over the episodes, as a .png, .svg or .pdf file.

    Args:
        logs: paths of training logs, or logs that are open; as far as they are good.
        output: the file.
        force: replace an existing one.

    Raises:
        LogError: one cannot be read, or they are of two methods.
        OutputError: the file exists or cannot be written.
        ViewError: matplotlib is not installed.
    """
    check_output(Path(output), endings=STILLS, force=force)
    opened = open_trainings(logs)
    courses = [course_of(log) for log in opened]
    with plain_style():
        save_figure(_whole(courses, names_of(opened)), Path(output), force=force)


def report_training(logs: AnyTraining | Sequence[AnyTraining], output: Path | str, *, force: bool = False) -> None:
    """Write one training, or two of one method, as an HTML page that needs no other file.

    The same logs give the same page, to the byte. Arguments and errors as for `render_training`.
    """
    check_output(Path(output), endings=ENDINGS, force=force)
    opened = open_trainings(logs)
    write_file(Path(output), training_page(opened))


def course_picture(log: TrainingLog) -> Picture:
    """Return the curves of a training; ViewError if matplotlib is not installed."""
    course, header = course_of(log), log.header
    title = f"{header.method} in {header.curriculum}, seed {header.seed}: {len(log):,} {header.unit}s"
    with plain_style():
        return Picture(title, png_bytes(_whole([course], [course.name])))


def training_page(logs: Sequence[TrainingLog]) -> str:
    """Return the page; errors as for `report_training`."""
    names, courses = names_of(logs), [course_of(log) for log in logs]
    by_part = f"All curves, {courses[0].unit} by {courses[0].unit}."
    scenarios, again = (scenarios_played, again_played) if logs[0].is_played else (_scenarios, _repetition)
    title = " against ".join(f"{one.header.method} in {one.header.curriculum}, seed {one.header.seed}" for one in logs)
    with plain_style():
        body = [
            f"<h1>Training: {escape(one_line(title))}</h1>",
            *(f'<p class="caveat">{escape(f"{log.path.name}: {log.damage}; the page ends there")}</p>'
              for log in logs if log.damage is not None),
            "<h2>What was asked for, and what came of it</h2>",
            _facts(logs, names),
            *_convergence(courses, names),
            "<h2>The whole training</h2>",
            html_figure(png_bytes(_whole(courses, names)),
                        CAPTION if courses[0].scenarios and not logs[0].is_played else by_part),
            *(part for course, name in zip(courses, names, strict=True) for part in _tables(course, name)),
            *(part for log, name in zip(logs, names, strict=True) for part in scenarios(log, name)),
            "<h2>How to get the same again</h2>",
            *(part for log, name in zip(logs, names, strict=True) for part in again(log, name)),
        ]  # fmt: skip
    return html_page(f"fireworld: {one_line(title)}", body, style=_STYLE)


_STYLE: Final = """
pre { background: #f0ede6; padding: .7rem 1rem; overflow-x: auto; font-size: 13px; }
td.text { overflow-wrap: anywhere; }
"""


def _facts(logs: Sequence[TrainingLog], names: Sequence[str]) -> str:
    columns = []
    for log in logs:
        facts = {key: str(value) for key, value in log.method.as_dict().items()}
        facts |= {"curriculum": f"{log.header.curriculum} ({log.header.curriculum_digest[:12]})"}
        facts |= {"seed": str(log.header.seed), f"{log.header.unit}s": f"{len(log):,}"}
        facts |= {
            "recorded by": f"fireworld {simulator_version(log.header.fireworld_version, log.header.simulator_digest)}"
        }
        facts |= {"ended": "yes" if log.done else "no", "digest": log.digest[:16]}
        facts |= {"team": "not known" if log.is_played else log.team().digest[:16]}
        columns.append(facts)
    rows = [compared_row(escape(key), [column[key] for column in columns]) for key in columns[0]]
    note = "<p>Bold: where they differ.</p>" if len(logs) > 1 else ""
    return html_table(["", *map(escape, names)], rows) + note


def _panels(courses: Sequence[Course], names: Sequence[str]) -> list[CoursePanel]:
    """Return a panel for every plot."""
    marks = {
        name: np.array([mark.part for mark in course.marks if mark.settled], dtype=np.int64)
        for course, name in zip(courses, names, strict=True)
    }
    found = []
    titles = {plot: title for course in courses for plot, title in course.titles.items()}
    for plot, title in titles.items():
        curves = {name: course.plots.get(plot, {}) for course, name in zip(courses, names, strict=True)}
        if any(curves.values()):
            own = plot in courses[0].own | courses[-1].own
            shown = f"{title}; dashed: {names[1]}" if own and len(names) > 1 else title
            marked = marks if plot == RETURN else {}
            found.append(CoursePanel(shown, curves, marked, logarithmic=plot in LOGARITHMIC, by_curve=own))
    return found


def _bands(course: Course) -> list[tuple[int, int]]:
    """Return first and last part of every scenario; nothing where they do not come one after another."""
    if not course.in_turn:
        return []
    places = [np.flatnonzero(course.scenario == number) for number in range(len(course.scenarios))]
    return [(int(one[0]), int(one[-1])) for one in places if len(one)]


def _labels(course: Course) -> list[tuple[int, int, str]]:
    """Return first and last part and name of what there is room to name: scenarios, or else their stages."""
    bands = _bands(course)
    if len(bands) <= NAMED_MAX:
        return [(*band, name) for band, name in zip(bands, course.scenarios, strict=False)]
    found: dict[str, list[int]] = {}
    for (first, last), stage in zip(bands, course.stages, strict=False):
        found.setdefault(stage, []).extend((first, last))
    return [(places[0], places[-1], stage) for stage, places in found.items()]


def _whole(courses: Sequence[Course], names: Sequence[str]) -> Figure:
    """Draw all curves."""
    first = courses[0]
    return draw_course(_panels(courses, names), _bands(first), _labels(first), unit=first.unit)


def _convergence(courses: Sequence[Course], names: Sequence[str]) -> Iterator[str]:
    """Yield the paper's kind of graphs: return and score of every episode, scenario by scenario."""
    if not courses[0].scenarios:
        return
    yield "<h2>Convergence</h2>"
    for plot, scale, label in CONVERGENCE:
        if plot not in courses[0].plots:
            continue
        panels = _by_scenario(courses, names, plot, scale)
        figure = draw_learning_curves(panels, label=label, mark="policy settled", shares=plot == SCORE)
        caption = f"By scenario: {label}. The dotted lines: the policy has settled."
        yield html_figure(png_bytes(figure), caption)


def _by_scenario(courses: Sequence[Course], names: Sequence[str], plot: str, scale: float) -> list[LearningPanel]:
    """Return a panel for every scenario that one of the trainings has begun, with a plot's only curve in it."""
    panels = []
    for scenario in dict.fromkeys(name for course in courses for name in course.scenarios):
        curves: dict[str, list[Array]] = {}
        marks = {}
        for course, name in zip(courses, names, strict=True):
            mine = np.isin(course.scenario, [k for k, one in enumerate(course.scenarios) if one == scenario])
            if not mine.any():
                continue
            curves[name] = [course.plots[plot][""][mine] / scale]
            if any(mark.settled and mine[mark.part] for mark in course.marks):
                marks[name] = float(mine.sum() - 1)
        panels.append(LearningPanel(title=scenario, curves=curves, marks=marks))
    return panels


def _tables(course: Course, name: str) -> Iterator[str]:
    picture = course.tables
    if picture is None:
        return
    labels = [
        f"{state}: {_brief(short_state(state, with_others=picture.with_others))}" for state in picture.states.tolist()
    ]
    yield f"<h2>The tables of {escape(name)}</h2>"
    figure = draw_tables(picture.action, picture.value, labels, picture.parts, unit=course.unit)
    yield html_figure(png_bytes(figure), TABLES_HELP.format(n=len(picture.states)))


def _brief(text: str) -> str:
    """Shorten the features of a state to what a label has room for."""
    short = {
        "free_edges=": "edges ", "distance_from_center=": "center ", "distance_from_civilian=": "civilian ",
        "volume=": "volume ", "others_nearest_to_": "others to ", "others_": "others ", "=yes": "", ",": ", ", "_": " ",
    }  # fmt: skip
    for long, brief in short.items():
        text = text.replace(long, brief)
    return text


def _scenarios(log: TrainingLog, name: str) -> Iterator[str]:
    """Yield the table of scenarios, with the command that opens the last episode of each."""
    names = [one.name for one in log.scenarios]
    rows = []
    for number, scenario in enumerate(names):
        lines = [line for line in log.lines if isinstance(line, Episode) and line.scenario == number]
        if not lines:
            continue
        last = lines[-WINDOW:]
        end = lines[-1]
        rows.append(
            [
                text_cell(escape(scenario)),
                str(len(lines)),
                "settled" if end.converged else "not settled" if end.ended else "under way",
                f"{np.mean([line.total_reward for line in last]):,.0f}",
                f"{np.mean([line.score / line.score_max for line in last if line.score_max]):.3f}",
                f"{np.mean([line.n_steps for line in last]):.0f}",
                str(end.n_visited),
                text_cell(f"<code>{escape(opening(log, scenario, end.episode))}</code>"),
            ]
        )
    if rows:
        yield f"<h2>Scenarios of {escape(name)}</h2>"
        heads = [
            "scenario",
            "episodes",
            "ended",
            "return",
            "score",
            "steps",
            "states visited",
            "opens its last episode",
        ]
        yield html_table(heads, rows)
        yield f"<p>Return, score (as a share of the best) and steps: means of the last {WINDOW} episodes.</p>"


def _repetition(log: TrainingLog, name: str) -> Iterator[str]:
    """Yield the commands that train the same again, and that check it."""
    path = shlex.quote(one_line(log.path.name))
    check = f"fireworld verify {path}   # from the log alone: every {log.header.unit} is trained again and compared"
    yield f"<h3>{escape(one_line(name))}</h3>"
    yield f"<pre>{escape(chr(10).join([check, _training_command(log)]))}</pre>"


def _training_command(log: TrainingLog) -> str:
    """Return the command that trains the same; in Python where the curriculum does not come with fireworld."""
    header, default = log.header, type(log.method)().as_dict()
    chosen = _shipped(log)
    if chosen is None:
        call = (
            f"import fireworld as fw; log = fw.open_training({one_line(log.path.name)!r}); fw.train(log.curriculum, "
            'method=log.method, seed=log.header.seed, output="again.npz", record="again.mcap")'
        )
        return f"{shlex.join(['python', '-c', call])}   # its curriculum is in the log"
    words = ["fireworld", "train", *chosen, "--method", header.method, "--seed", str(header.seed)]
    for key, value in log.method.as_dict().items():
        if value != default.get(key):
            words += ["--set", f"{key}={value if isinstance(value, str) else json.dumps(value)}"]
    return shlex.join([*words, "-o", "again.npz", "--record", "again.mcap"])


def _shipped(log: TrainingLog) -> list[str] | None:
    """Return the curriculum in the words of `fireworld train`; None where it does not come with fireworld."""
    name, stages = log.header.curriculum, [stage.name for stage in log.curriculum.stages]
    if name not in curriculum_names() and name not in scenario_names():
        return None
    whole = find_curriculum(name)
    if whole.digest == log.header.curriculum_digest:
        return [name]
    if {*stages} <= {stage.name for stage in whole.stages} and whole.only(stages).digest == log.curriculum.digest:
        return [name, "--stages", ",".join(stages)]
    return None
