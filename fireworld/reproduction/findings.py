"""What a reproduction found, in sentences made from the numbers: what holds, what does not, what stays open."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Final, Literal

from fireworld.evaluation.statistics import Estimate, mean
from fireworld.reproduction.paper_tables import (
    APART,
    NEAR,
    WITHIN,
    PaperCell,
    PaperPair,
    PaperTables,
    TeamComparison,
    cells_of,
)
from fireworld.reproduction.study import (
    ALONE,
    DIFFERENT_ALONE,
    NO_WATER,
    RANDOM_ALONE,
    RANDOM_ALONE_FOR_ALL,
    RANDOM_TABLES,
    TOGETHER,
    TOGETHER_WITHOUT_FLAGS,
    Study,
)
from fireworld.shown import text_table

Answer = Literal["reproduced", "partly", "not reproduced", "open", "yes", "no"]
N_ENOUGH: Final = 20  # repetitions and seeds below which a claim about learning is not to be made
_MARKS: Final = {WITHIN: "=", NEAR: "~", APART: "x"}
_QUANTITIES: Final = {"convergence episode": "episodes", "time to complete": "time"}
_HEADS: Final = ("scenario", "quantity", "without cooperation", "with")


@dataclass(frozen=True)
class Finding:
    """A question, its answer in a word, and the numbers it rests on."""

    question: str
    verdict: Answer
    text: str


def findings(study: Study, tables: PaperTables) -> list[Finding]:
    """Return what a study found, the paper's main claim first."""
    return [
        _cooperation(tables),
        *(
            Finding(_sentence(row.question).rstrip("."), _answer(row.difference), _sentence(_difference(row)))
            for row in tables.comparisons[1:]
        ),
        _parts(tables),
        _uncontrolled(study, tables),
        _more_brigades(tables),
        _convergence(tables),
        _same_tables(tables),
    ]


def caveat(study: Study) -> str | None:
    """Return a warning where a study is too small for claims about learning."""
    if study.n_repetitions >= N_ENOUGH and len(study.seeds) >= N_ENOUGH:
        return None
    return (
        f"{study.n_repetitions} repetitions and {len(study.seeds)} seeds show how the tables look; a claim about "
        f"learning needs at least {N_ENOUGH} of each. Intervals over so few repetitions are too narrow."
    )


def tally(cells: Sequence[PaperCell]) -> str:
    """Count the verdicts of cells in words."""
    counts = {verdict: sum(cell.verdict == verdict for cell in cells) for verdict in (WITHIN, NEAR, APART)}
    return (
        f"of the paper's {len(cells)} values {counts[WITHIN]} lie within our 95 % interval, to {counts[NEAR]} more "
        f"our mean is within 25 %, and to {counts[APART]} it is not"
    )


def report_text(study: Study, tables: PaperTables) -> str:
    """Return the report as text: the paper's Tables 1 to 3 beside ours, and what was found."""
    lines = [
        f"in {tables.world.description}; paper: ours [95 % interval]",
        text_table(_HEADS, _rows(tables), "<<>>"),
        "= the paper's value is in it, ~ our mean is within 25 % of it, x neither",
        "",
        "findings",
        *(f"  {finding.question} {finding.verdict}" for finding in findings(study, tables)),
    ]
    return "\n".join([*lines, *filter(None, [caveat(study)])])


def _cooperation(tables: PaperTables) -> Finding:
    main = tables.comparisons[0]
    theirs = fmean((row.score[1] - row.score[0]) / row.score_max for row in tables.world.table_2)
    unsure = main.difference.low <= theirs <= main.difference.high
    return Finding(
        "Is the cooperative team better than the non-cooperative one (Table 2)?",
        "reproduced" if main.difference.above_zero else "open" if unsure else "not reproduced",
        f"Share of the greatest score, mean over the three tests, in {tables.world.description}: {_difference(main)}; "
        f"in the paper it is {theirs:+.2f}. {_directions(tables.tests)} {_sentence(tally(cells_of(tables.tests)))}",
    )


def _parts(tables: PaperTables) -> Finding:
    """Compare how much comes of brigades that differ, of the flags, and of what was learned."""
    found = {(row.team, row.other): row.difference for row in tables.comparisons}
    differ = found[RANDOM_ALONE, RANDOM_ALONE_FOR_ALL]
    flags, learned = found[TOGETHER, TOGETHER_WITHOUT_FLAGS], found[TOGETHER, RANDOM_TABLES]
    largest = max(flags.mean, learned.mean) < differ.mean
    return Finding(
        "Does more come of brigades that differ than of flags and learning?",
        "open" if not (differ.above_zero or differ.below_zero) else "yes" if differ.above_zero and largest else "no",
        f"Share of the greatest score: that brigades differ at all, by tables drawn at random, adds "
        f"{differ.text(sign=True)}; the flags add {flags.text(sign=True)} to what is learned in the team, and "
        f"{found[RANDOM_TABLES, RANDOM_ALONE].text(sign=True)} to tables drawn at random; what the cooperative team "
        f"learned adds {learned.text(sign=True)} to such tables, what one brigade learned alone "
        f"{found[ALONE, RANDOM_ALONE_FOR_ALL].text(sign=True)}; four different ones of those add "
        f"{found[DIFFERENT_ALONE, ALONE].text(sign=True)} to four copies of one.",
    )


def _uncontrolled(study: Study, tables: PaperTables) -> Finding:
    rows = study.world.table_2
    names = [row.scenario for row in rows]
    burnt, steps = (
        [mean(study.values(name, NO_WATER, quantity)) for name in names] for quantity in ("n_burnt_out", "steps")
    )
    cells = [pair.without for pair in tables.tests if pair.without.quantity != "score"]
    n_near = sum(cell.is_near for cell in cells)
    return Finding(
        "Do a fire nearly uncontrolled, its time scale and its size agree (Table 2, without cooperation)?",
        _degree(n_near, len(cells)),
        f"{n_near} of the {len(cells)} times and numbers of burnt-out buildings of the non-cooperative team have our "
        f"mean within 25 %. Left to itself the fire burns {_list(burnt)} buildings out in {_list(steps)} "
        f"steps; the paper's non-cooperative team loses {_list(row.burnt_out[0] for row in rows)} in "
        f"{_list(row.steps[0] for row in rows)}.",
    )


def _more_brigades(tables: PaperTables) -> Finding:
    cells = cells_of(tables.more_brigades)
    n_near = sum(cell.is_near for cell in cells)
    return Finding(
        "Do the values with seven and eight brigades agree (Table 3)?",
        _degree(n_near, len(cells)),
        f"Our mean lies within 25 % of {n_near} of {len(cells)}; {tally(cells)}. {_directions(tables.more_brigades)}",
    )


def _convergence(tables: PaperTables) -> Finding:
    episodes = [cell for cell in tables.trainings if cell.quantity == "convergence episode"]
    n_near = sum(cell.is_near for cell in episodes)
    shares = ", ".join(f"{100 * share.mean:.0f} %" for share in tables.converged)
    return Finding(
        "Does the policy settle, and after as many episodes (Table 1)?",
        _degree(n_near, len(episodes)),
        f"The policy settled (20 episodes without a change, within 130) in {shares} of the repetitions, "
        f"scenario by scenario; {n_near} of {len(episodes)} mean episodes lie within 25 % of the paper's. Of all "
        f"values of Table 1, scores included: {tally(tables.trainings)}.",
    )


def _same_tables(tables: PaperTables) -> Finding:
    return Finding(
        "Do all brigades end with the same table, as the paper saw?",
        "reproduced" if tables.agreement.low > 0.99 else "not reproduced",
        f"At the end of the training all brigades prefer the same action in {100 * tables.agreement.mean:.0f} % "
        f"[{100 * tables.agreement.low:.0f}, {100 * tables.agreement.high:.0f}] of the states that one of them met.",
    )


def _answer(difference: Estimate) -> Answer:
    return "yes" if difference.above_zero else "no" if difference.below_zero else "open"


def _degree(n_met: int, n_all: int) -> Answer:
    return "reproduced" if n_met == n_all else "partly" if n_met else "not reproduced"


def _difference(row: TeamComparison) -> str:
    return (
        f"{row.team} - {row.other} is {row.difference.text(sign=True)}, and a run of the first is the better one "
        f"with probability {row.improvement.text()}"
    )


def _directions(pairs: Sequence[PaperPair]) -> str:
    held, reversed_, unsure = (sum(pair.claim_holds is answer for pair in pairs) for answer in (True, False, None))
    return (
        f"Value by value, cooperation changes {held} of {len(pairs)} the way the paper says, {reversed_} the other "
        f"way, and for {unsure} the interval of the paired difference holds zero."
    )


def _list(values: Iterable[float]) -> str:
    return " / ".join(f"{value:.0f}" for value in values)


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")


def _rows(tables: PaperTables) -> list[list[str]]:
    rows = [[cell.scenario, _quantity(cell), "", _compared(cell)] for cell in tables.trainings]
    for pair in (*tables.tests, *tables.more_brigades):
        scenario = pair.without.scenario.replace("-brigades-", ", ")
        rows.append([scenario, _quantity(pair.without), _compared(pair.without), _compared(pair.together)])
    return rows


def _quantity(cell: PaperCell) -> str:
    return _QUANTITIES.get(cell.quantity, cell.quantity)


def _compared(cell: PaperCell) -> str:
    digits = 1 if cell.quantity == "score" else 0
    return f"{_MARKS[cell.verdict]} {cell.paper:.3g}: {cell.ours.text(digits=digits)}"
