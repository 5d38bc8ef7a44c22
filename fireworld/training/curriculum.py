"""Curriculum: the scenarios a team learns in, stage after stage, read from YAML."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta, Struct

from fireworld.errors import FireworldError, TrainingError, expected
from fireworld.scenario import Scenario, load_scenario
from fireworld.scenario.shipped import shipped_folder
from fireworld.scenario.yaml_text import read_yaml

SIZE_MAX_BYTES: Final = 1_000_000


class StageText(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A stage as written: scenarios by name, or every variation of one."""

    name: str
    cooperation: bool
    """Brigades see what the others do (4320 states), or not (270)."""
    scenarios: tuple[str, ...] = ()
    base: str | None = None
    set: dict[str, Any] = {}
    vary: dict[str, Annotated[list[Any], Meta(min_length=1)]] = {}


class CurriculumText(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A curriculum as written."""

    description: str = ""
    stages: Annotated[tuple[StageText, ...], Meta(min_length=1)]


@dataclass(frozen=True)
class CurriculumStage:
    """Scenarios that a team learns in one after another."""

    name: str
    cooperation: bool
    scenarios: tuple[Scenario, ...]


@dataclass(frozen=True)
class Curriculum:
    """What a team learns in."""

    name: str
    stages: tuple[CurriculumStage, ...]

    @property
    def digest(self) -> str:
        """SHA-256 of everything that can change a training."""
        content = [[stage.cooperation, [scenario.digest for scenario in stage.scenarios]] for stage in self.stages]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()

    @property
    def n_scenarios(self) -> int:
        """Scenarios of all stages."""
        return sum(len(stage.scenarios) for stage in self.stages)


def curriculum_names() -> list[str]:
    """Name the curricula that come with fireworld."""
    return sorted(path.stem for path in (shipped_folder() / "curricula").glob("*.yaml"))


def load_curriculum(name_or_path: str | Path) -> Curriculum:
    """Load a shipped curriculum by its name, or a curriculum file by its path.

    Raises:
        TrainingError: no such curriculum, or one that makes no sense.
        ScenarioError: a scenario in it that makes no sense.
    """
    path = Path(name_or_path)
    if str(name_or_path) in curriculum_names():
        path = shipped_folder() / "curricula" / f"{name_or_path}.yaml"
    source = str(name_or_path)
    try:
        with path.open("rb") as file:
            text = file.read(SIZE_MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        names = ", ".join(curriculum_names())
        reason = getattr(error, "strerror", None) or str(error)
        raise TrainingError(expected(source, "", f"a curriculum file or one of {names}", reason)) from None
    if len(text) > SIZE_MAX_BYTES:
        raise TrainingError(expected(source, "", f"a curriculum of at most {SIZE_MAX_BYTES} bytes", "more of them"))
    return _build(read_yaml(text, source=source), source=source, name=path.stem)


def _build(document: Any, *, source: str, name: str) -> Curriculum:
    try:
        read = msgspec.convert(document, CurriculumText)
    except msgspec.ValidationError as error:
        raise TrainingError(f"{source}: {error}") from None
    stages = tuple(_build_stage(stage, where=f"{source}: stages.{index}") for index, stage in enumerate(read.stages))
    return Curriculum(name=name, stages=stages)


def _build_stage(stage: StageText, *, where: str) -> CurriculumStage:
    if bool(stage.scenarios) == (stage.base is not None):
        raise TrainingError(expected(where, "", "either `scenarios` or `base`", "both" if stage.base else "neither"))
    try:
        scenarios = (
            tuple(load_scenario(name) for name in stage.scenarios)
            if stage.base is None
            else tuple(_variations(load_scenario(stage.base), stage))
        )
    except FireworldError as error:
        raise TrainingError(f"{where}: {error}") from None
    if stage.base is None and (stage.set or stage.vary):
        raise TrainingError(expected(where, "", "`set` and `vary` with `base`", "them with `scenarios`"))
    return CurriculumStage(name=stage.name, cooperation=stage.cooperation, scenarios=scenarios)


def _variations(base: Scenario, stage: StageText) -> list[Scenario]:
    """Return every combination of the values that a stage varies; what is named first changes last."""
    made = []
    for number, values in enumerate(itertools.product(*stage.vary.values()), 1):
        settings = {**stage.set, **dict(zip(stage.vary, values, strict=True))}
        varied = base.with_settings({key: json.dumps(value) for key, value in settings.items()})
        made.append(msgspec.structs.replace(varied, name=f"{stage.name}-{number}"))
    return made
