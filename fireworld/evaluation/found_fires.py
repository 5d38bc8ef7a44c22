"""Contested fires that were found in a city: as a table, JSON, and scenario files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from fireworld.arguments import path_of
from fireworld.errors import OutputError, expected
from fireworld.evaluation.fire_text import curriculum_text, fire_text
from fireworld.evaluation.growth import Grown
from fireworld.evaluation.inputs import seeds_text
from fireworld.evaluation.scenario_check import (
    MEANS,
    NO_WATER,
    SCORES,
    ScenarioCheck,
    counted,
    limits_text,
    shortened,
    wrapped,
)
from fireworld.files import check_output, check_outputs, written_beside
from fireworld.scenario import Scenario
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable, block_text
from fireworld.version import __version__

FORMAT: Final = "fireworld-new-scenarios/1"
ENDINGS: Final = (".yaml", ".yml")
NAME_MAX: Final = 16
"""Letters of a name for which there is room in a table of 80 columns."""
_HEADS: Final = ("fire", "at", "burning", "mean", "lowest", "highest", NO_WATER)


def files_of(output: Path, n: int) -> list[Path]:
    """Return the files of so many fires: the one; or fires-1.yaml, fires-2.yaml ..."""
    if n == 1:
        return [output]
    return [output.with_name(f"{output.stem}-{number}{output.suffix}") for number in range(1, n + 1)]


def check_files(output: Path, n: int, *, force: bool) -> None:
    """Check that so many fires could be written; OutputError if not."""
    check_output(output, force=force, endings=ENDINGS)
    check_outputs([output, *files_of(output, n)][n == 1 :], force=force)


@dataclass(frozen=True, kw_only=True, repr=False)
class NewScenarios(Shown):
    """Contested fires that were found in a city."""

    checks: tuple[ScenarioCheck, ...]
    """Each with its scenario, in the order of the places."""
    tried: tuple[Grown, ...]
    """All places that were tried, also those where no fire is contested."""
    n_wanted: int
    """Fires that were asked for; if there are not as many, no files are written."""
    options: str
    """Of `fireworld scenarios new`, to find the same again."""
    city: str
    """Its name."""
    files: tuple[Path, ...] = ()
    """What was written: a scenario file; of several fires the curriculum, then their files."""

    @property
    def scenarios(self) -> list[Scenario]:
        """The scenarios."""
        return [check.scenario for check in self.checks]

    @property
    def complete(self) -> bool:
        """Whether as many were found as were asked for."""
        return len(self.checks) == self.n_wanted

    @property
    def sentence(self) -> str:
        """How many were found, what became of the other places, and what to try if some are missing."""
        n, tried = len(self.checks), counted(len(self.tried), "place")
        found = ("" if self.complete else f"{n} of ") + counted(self.n_wanted, "contested fire")
        even = [grown for grown in self.tried if not grown.brigades_matter]
        held, lost, none = (
            [grown for grown in self.tried if grown.verdict == kind and grown.brigades_matter]
            for kind in ("held", "lost", None)
        )
        groups = {
            f"held with {_burning(held)}": held,
            f"lost with {_burning(lost)}": lost,
            "where it makes hardly a difference what brigades do": even,
            "without room for people and fire": none,
        }
        text = f"{found} found at {tried}" + "".join(
            f"{', ' if k else ': '}{len(group)} {words}"
            for k, (words, group) in enumerate((words, group) for words, group in groups.items() if group)
        )
        return text if self.complete else f"{text}; try {self._advice(len(held), len(lost), len(even))}"

    def _advice(self, n_held: int, n_lost: int, n_even: int) -> str:
        """Return what to try if fires are missing."""
        most = max(n_held, n_lost, n_even)
        if most == n_even:
            return "people nearer to the fire, a denser city, more burning buildings or steps, or more places"
        if most == n_held:
            return "fewer brigades, more burning buildings, or more places"
        return "more brigades, or more places"

    def save(self, output: str | os.PathLike[str], *, force: bool = False) -> list[Path]:
        """Write the scenarios: one to `output`; several beside it, numbered, and `output` is the curriculum of them.

        Returns:
            What was written.

        Raises:
            OutputError: there are none, or a file exists or cannot be written; then none is.
        """
        path = path_of("output", output)
        if not self.checks:
            raise OutputError(expected(str(path), "", "a contested fire to write", "none"))
        check_files(path, len(self.checks), force=force)
        texts = self._texts(path)
        with ExitStack() as together:  # all, or none; what is entered first gets its name last
            for file, text in texts.items():
                together.enter_context(written_beside(file)).write_text(text, encoding="utf-8")
        return [*texts]

    def _texts(self, output: Path) -> dict[Path, str]:
        """Return what is to be written, by file; the curriculum first."""
        made = f"Made by `fireworld scenarios new {self.options}`, fireworld {__version__}."
        places = [grown.place.number for grown in self.tried if grown.verdict == "contested" and grown.brigades_matter]
        files, texts = files_of(output, len(self.checks)), dict[Path, str]()
        if len(files) > 1:
            cooperation = any(scenario.brigades.n > 1 for scenario in self.scenarios)
            text = f"{len(self.checks)} contested fires in {self.city}."
            texts[output] = curriculum_text(files, cooperation=cooperation, description=text, comment=made)
        for file, check, place in zip(files, self.checks, places, strict=True):
            texts[file] = fire_text(check.scenario, folder=file.parent, comment=f"{made} {_how(check, place)}")
        return texts

    def to_dict(self) -> dict[str, Any]:
        """Return what was found, and what was tried, as plain values."""
        limits = asdict(self.checks[0].limits) if self.checks else {}
        return {
            "format": FORMAT,
            "city": self.city,
            "options": self.options,
            **limits,
            "complete": self.complete,
            "sentence": self.sentence,
            "fires": [{**check.to_dict(), **_place_of(check)} for check in self.checks],
            "places": [
                {
                    "number": grown.place.number,
                    "at": [list(at) for at in grown.place.at],
                    "n_burning": grown.n_burning,
                    "verdict": grown.verdict,
                    "brigades_matter": grown.brigades_matter,
                    "error": None if grown.error is None else str(grown.error),
                }
                for grown in self.tried
            ],
            "files": [str(path) for path in self.files],
        }

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield a table of the fires, and how they were found."""
        del limit
        if self.checks:
            yield TextTable(_HEADS, [_row(check) for check in self.checks])
            yield ""
            seeds = seeds_text(self.checks[0].seeds)
            yield from wrapped(f"{SCORES}; {MEANS}; {seeds}. {limits_text(self.checks[0].limits)}")
            yield ""
        yield from wrapped(self.sentence)

    def __repr__(self) -> str:
        return "\n".join(map(block_text, self.describe()))


def _row(check: ScenarioCheck) -> list[str]:
    (x, y), *others = _place_of(check)["at"]
    at = f"{x:g}, {y:g}" + (f" + {len(others)}" if others else "")
    shares = (check.score_share, check.lowest, check.highest, check.no_water.score_share)
    return [shortened(check.name, NAME_MAX), at, str(check.n_burning), *(f"{share:.2f}" for share in shares)]


def _place_of(check: ScenarioCheck) -> dict[str, Any]:
    return {"at": [list(fire.at) for fire in check.scenario.fires if fire.at is not None]}


def _how(check: ScenarioCheck, place: int) -> str:
    """Return how a fire was found, for the head of its file."""
    return (
        f"Place {place} of those drawn: with {counted(check.n_burning, 'burning building')} the rules that do not "
        f"learn score {check.score_share:.2f} of the maximum on the mean ({seeds_text(check.seeds)}), from "
        f"{check.lowest:.2f} to {check.highest:.2f}, and {check.no_water.score_share:.2f} is left without water. "
        f"It is contested from {check.limits.lost_below:g} to {check.limits.held_above:g}."
    )


def _burning(fires: Sequence[Grown]) -> str:
    """Return how many buildings burn in fires."""
    numbers = {grown.n_burning for grown in fires} or {0}
    low, high = min(numbers), max(numbers)
    return counted(high, "burning building") if low == high else f"{low} to {high} burning buildings"
