"""The choices that the paper leaves open, read from readings.yaml; and what a reading makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta, Struct

from fireworld.errors import FireworldError, TrainingError, expected
from fireworld.files import read_input
from fireworld.scenario import load_scenario
from fireworld.scenario.yaml_text import read_yaml
from fireworld.training.methods.sarsa import PAPER

SHIPPED: Final = Path(__file__).with_name("readings.yaml")
SIZE_MAX_BYTES: Final = 1_000_000
A_SCENARIO: Final = "test-1"
"""On which keys of scenarios are tried."""
CITY_PATHS: Final = ("city.file", "city.official")
"""Keys whose values are paths, relative to the folder of the file of readings."""


class StudySettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a level changes in how teams are trained and tested."""

    learn_in_tests: bool = False
    """Cooperative and non-cooperative teams continue to learn in every test, without exploring."""
    fires: Annotated[float, Meta(gt=0, le=10)] = 1.0
    """How many times as many buildings burn at first, in trainings and tests."""
    alone_through_both: bool = False
    """The non-cooperative team learns alone in the scenarios of the stages with cooperation, too."""
    score: str = "official"
    """`counts`: living civilians + the share of buildings that are not burnt out."""
    different_alone: bool = False
    """Every brigade of the non-cooperative team follows the table of another training."""


class Level(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One way to read a choice; empty: as fireworld does."""

    method: dict[str, Any] = {}
    scenario: dict[str, Any] = {}
    training: dict[str, Any] = {}
    study: dict[str, Any] = {}


class OpenChoice(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the paper leaves open."""

    number: Annotated[int, Meta(ge=1)]
    name: str
    sentence: str
    """The paper's."""
    ours: str
    levels: dict[str, Level]
    screen: tuple[str, ...] = ()
    """The two levels that the design compares, the first of which is ours; empty: it is left as it is."""


class ReadingsText(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A file of readings."""

    choices: Annotated[tuple[OpenChoice, ...], Meta(min_length=1)]


@dataclass(frozen=True)
class Reading:
    """The paper, read in one way.

    Attributes:
        levels: the level of each choice, by name; a choice that is left out is read as ours.
        level: all that these levels say, together.
        study: what they say of the study.
    """

    levels: Mapping[str, str]
    level: Level
    study: StudySettings


def load_choices(path: Path | str = SHIPPED) -> tuple[OpenChoice, ...]:
    """Read the choices of a file.

    Raises:
        TrainingError: a file that makes no sense; it names file, key, what is expected and what was found.
    """
    source = str(path)
    text = read_input(Path(path), what="readings", n_bytes_max=SIZE_MAX_BYTES, error=TrainingError, source=source)
    try:
        found = msgspec.convert(read_yaml(text, source=source), ReadingsText)
    except msgspec.ValidationError as error:
        fault, _, where = str(error).partition(" - at `$")
        key = where.strip(".`") or "choices"
        raise TrainingError(f"{source}: {key}: {fault[:1].lower() + fault[1:]}") from None
    names: set[str] = set()
    for choice in found.choices:
        _check_names(choice, names, source=source)
        names |= {choice.name, str(choice.number)}
    return tuple(_with_cities(choice, source=source, folder=Path(path).parent) for choice in found.choices)


def read_as(choices: Sequence[OpenChoice], levels: Mapping[str, str]) -> Reading:
    """Return the reading with these levels, by the names of their choices."""
    parts: dict[str, dict[str, Any]] = {part: {} for part in Level.__struct_fields__}
    for choice in choices:
        level = choice.levels[levels.get(choice.name, choice.ours)]
        for part, found in parts.items():
            found.update(getattr(level, part))
    return Reading(dict(levels), Level(**parts), msgspec.convert(parts["study"], StudySettings))


def _check_names(choice: OpenChoice, names: set[str], *, source: str) -> None:
    """Check the names of a choice, its levels and its screen; TrainingError if they make no sense."""
    where = f"{source}: choices.{choice.name}"
    if {choice.name, str(choice.number)} & names:
        raise TrainingError(expected(where, "name", "another name and number for every choice", choice.name))
    levels = ", ".join(choice.levels)
    for key, names_of in (("ours", (choice.ours,)), ("screen", choice.screen)):
        for name in names_of:
            if name not in choice.levels:
                raise TrainingError(expected(where, key, f"one of the levels {levels}", name))
    if choice.screen and (len(set(choice.screen)) != 2 or choice.screen[0] != choice.ours):
        raise TrainingError(expected(where, "screen", f"{choice.ours} and another level", list(choice.screen)))


def _with_cities(choice: OpenChoice, *, source: str, folder: Path) -> OpenChoice:
    """Check what the levels of a choice say, and return them with cities from files in place of the generated ones.

    Raises:
        TrainingError: a level that makes no sense.
    """
    levels = {}
    for name, level in choice.levels.items():
        try:
            PAPER.with_settings(level.method)
            load_scenario(A_SCENARIO).with_values(level.training)
            msgspec.convert(level.study, StudySettings)
            levels[name] = msgspec.structs.replace(level, scenario=_with_city(level.scenario, folder))
        except (FireworldError, msgspec.ValidationError) as error:
            raise TrainingError(f"{source}: choices.{choice.name}: levels.{name}: {error}") from None
    return msgspec.structs.replace(choice, levels=levels)


def _with_city(values: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Check keys of scenarios; return them with the digest of the city file that they name, so that it is read once."""
    found = dict(values)
    for key in CITY_PATHS:
        if isinstance(found.get(key), str):
            found = {"city.generated": None, **found, key: str((folder / found[key]).absolute())}
    scenario = load_scenario(A_SCENARIO).with_values(found)
    return found if scenario.city_sha256 is None else {**found, "city.sha256": scenario.city_sha256}
