"""Leaderboard: policies ranked by how they do in suites, as text, Markdown, JSON and a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any, Final

from fireworld.evaluation.inputs import in_a_row, seeds_text
from fireworld.evaluation.paired import N_SEEDS_ENOUGH
from fireworld.evaluation.standings import Standing
from fireworld.evaluation.statistics import Estimate
from fireworld.files import check_output, write_file
from fireworld.html_page import html_page, html_table, text_cell
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable, block_text

FORMAT: Final = "fireworld-leaderboard/1"
OVERALL: Final = "overall"
N_CELLS: Final = 3
"""Columns of suites in a table of text, which has 80 characters."""
NAME_CHARACTERS, HEAD_CHARACTERS = 20, 14
"""Of a policy and of a suite, as far as they are shown in a table of text."""
_CAPTION: Final = "share of the greatest score [95 % interval]; overall, suites count the same"


@dataclass(frozen=True)
class BoardSuite:
    """What policies were measured in: a suite, or a scenario."""

    name: str
    digest: str
    description: str
    n_scenarios: int


@dataclass(frozen=True, repr=False)
class Leaderboard(Shown):
    """Policies ranked by how they do in suites."""

    suites: tuple[BoardSuite, ...]
    seeds: Sequence[int]
    version: str
    """Of the simulator."""
    standings: tuple[Standing, ...]
    """The best first; at the end, without a rank, those that miss a suite."""
    apart: Mapping[str, tuple[Standing, ...]] = field(default_factory=dict)
    """Those that another version of the simulator measured, by its version: not to be compared with these."""
    warnings: tuple[str, ...] = ()
    """How teams are used differently from their training."""

    def of(self, policy: str) -> Standing:
        """Return how a policy stands; KeyError if it was not measured."""
        for standing in self.standings:
            if standing.name == policy:
                return standing
        raise KeyError(policy)

    @property
    def notes(self) -> list[str]:
        """What a reader has to know besides."""
        notes = []
        if any(standing.rank is None for standing in self.standings):
            notes.append("- : a suite without a seed of which all runs are known, so without a rank")
        if any(standing.n_seeds != len(self.seeds) for standing in self.standings):
            notes.append("seeds: of these, how many a policy was run with in every suite")
        if any(standing.n_seeds < N_SEEDS_ENOUGH for standing in self.standings):
            notes.append(f"intervals of fewer than {N_SEEDS_ENOUGH} seeds are too narrow")
        return notes

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield the tables: overall and the first suites, then the others.

        Args:
            limit: policies at most of each other simulator.
        """
        yield self._title
        yield f"fireworld {self.version}"
        yield from self._tables(self.standings)
        yield ""
        yield _CAPTION
        yield from self.notes
        for version, standings in self.apart.items():
            yield ""
            yield f"apart: measured by another simulator, fireworld {version}"
            yield from self._tables(standings[:limit])

    def __repr__(self) -> str:
        return "\n".join(map(block_text, self.describe()))

    @property
    def markdown(self) -> str:
        """The ranked policies as a table of Markdown."""
        heads = ["rank", "policy", "seeds", OVERALL, *(f"{one.name} ({one.n_scenarios})" for one in self.suites)]
        rows = [[_rank(one), _code(one.name), str(one.n_seeds), *self._cells(one)] for one in self.standings]
        return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows))

    def to_dict(self) -> dict[str, Any]:
        """Return the leaderboard as plain values (docs/leaderboard.md)."""
        return {
            "format": FORMAT,
            "version": self.version,
            "first_seed": self.seeds[0],
            "n_seeds": len(self.seeds),
            **({} if in_a_row(self.seeds) else {"seeds": list(self.seeds)}),
            "suites": [vars(one) for one in self.suites],
            "policies": [standing.to_dict() for standing in self.standings],
            "apart": {version: [one.to_dict() for one in those] for version, those in self.apart.items()},
            "notes": self.notes,
        }

    def page(self) -> str:
        """Return the leaderboard as a page of HTML that needs nothing else."""
        body = [
            "<h1>Leaderboard</h1>",
            f"<p>{escape(self._title)}; fireworld {escape(self.version)}.</p>",
            self._html(self.standings),
            "".join(f"<p>{escape(line)}</p>" for line in (_CAPTION, *self.notes)),
            "<h2>Suites</h2>",
            html_table(
                ["suite", "what it is", "scenarios", "digest"],
                [
                    [
                        text_cell(escape(one.name)),
                        text_cell(escape(one.description)),
                        str(one.n_scenarios),
                        one.digest[:12],
                    ]
                    for one in self.suites
                ],
                n_text=2,
            ),
        ]
        for version, standings in self.apart.items():
            body += [f"<h2>Apart: fireworld {escape(version)}</h2>", self._html(standings)]
        return html_page("fireworld: leaderboard", body)

    def save_html(self, path: Path | str, *, force: bool = False) -> None:
        """Write the page.

        Raises:
            OutputError: the file exists, or cannot be written.
        """
        page = Path(path)
        check_output(page, force=force)
        write_file(page, self.page())

    @property
    def _title(self) -> str:
        n_scenarios = sum(one.n_scenarios for one in self.suites)
        counts = ((len(self.standings), "policies"), (len(self.suites), "suites"), (n_scenarios, "scenarios"))
        return f"{', '.join(f'{word}: {n}' for n, word in counts)}; {seeds_text(self.seeds)}"

    def _found(self, standing: Standing) -> list[Estimate | None]:
        """Return overall and the suites."""
        return [standing.overall, *(standing.cells.get(one.name) for one in self.suites)]

    def _cells(self, standing: Standing) -> list[str]:
        return [*map(_cell, self._found(standing))]

    def _tables(self, standings: Sequence[Standing]) -> Iterator[Block]:
        heads = [OVERALL, *(one.name for one in self.suites)]
        for first in range(0, len(heads), N_CELLS):
            shown = slice(first, first + N_CELLS)
            rows = [
                [_rank(one), _short(one.name, NAME_CHARACTERS), str(one.n_seeds), *self._cells(one)[shown]]
                for one in standings
            ]
            yield ""
            yield TextTable(
                ["#", "policy", "seeds", *(_short(head, HEAD_CHARACTERS) for head in heads[shown])], rows, n_left=2
            )

    def _html(self, standings: Sequence[Standing]) -> str:
        heads = ["rank", "policy", "digest", "seeds", OVERALL, *(escape(one.name) for one in self.suites)]
        rows = [
            [
                _rank(one),
                text_cell(escape(one.name)),
                one.digest[:12],
                str(one.n_seeds),
                *map(_html_cell, self._found(one)),
            ]
            for one in standings
        ]
        return html_table(heads, rows, n_text=2)


def _rank(standing: Standing) -> str:
    return "-" if standing.rank is None else str(standing.rank)


def _code(name: str) -> str:
    """Write a name in a table of Markdown."""
    return "`" + name.replace("|", "\\|").replace("`", "'") + "`"


def _short(name: str, n_characters: int) -> str:
    return name if len(name) <= n_characters else name[: n_characters - 3] + "..."


def _share(value: float) -> str:
    """Write a share without the zero before its point, and all of it as 1.0."""
    text = f"{value:.2f}"
    return "1.0" if text == "1.00" else text.removeprefix("0")


def _cell(found: Estimate | None) -> str:
    return "-" if found is None else f"{_share(found.mean)} [{_share(found.low)}, {_share(found.high)}]"


def _html_cell(found: Estimate | None) -> str:
    if found is None:
        return "-"
    interval = f"[{found.low:.3f}, {found.high:.3f}]"
    return f'{found.mean:.3f}<br><span class="interval">{interval}</span>'
