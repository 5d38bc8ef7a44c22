"""Curriculum: the scenarios a team learns in, stage after stage, read from YAML."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta, Struct

from fireworld.errors import FireworldError, TrainingError, expected
from fireworld.files import read_input, text_of
from fireworld.scenario import Scenario, load_scenario, scenario_names
from fireworld.scenario.shipped import shipped_folder
from fireworld.scenario.yaml_text import read_yaml

SIZE_MAX_BYTES: Final = 1_000_000
N_VARIATIONS_MAX: Final = 10_000


class StageText(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A stage as written: scenarios by name, or variations of one."""

    name: str
    cooperation: bool
    """Brigades see what the others do (4320 states), or not (270)."""
    scenarios: tuple[str, ...] = ()
    base: str | None = None
    set: dict[str, Any] = {}
    vary: dict[str, Annotated[list[Any], Meta(min_length=1)]] = {}
    """Every combination of these values."""
    each: tuple[dict[str, Any], ...] = ()
    """One scenario, or one for every combination, for each of these groups of values."""


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
    def scenarios(self) -> list[Scenario]:
        """Of all stages, in their order."""
        return [scenario for stage in self.stages for scenario in stage.scenarios]

    @property
    def n_scenarios(self) -> int:
        """Scenarios of all stages."""
        return len(self.scenarios)

    def only(self, names: Sequence[str]) -> Curriculum:
        """Return the curriculum with these of its stages, in its own order.

        Raises:
            TrainingError: no stage of that name.
        """
        known = [stage.name for stage in self.stages]
        if not isinstance(names, Sequence):
            raise TrainingError(expected("--stages", "", "names of stages", type(names).__name__))
        for name in names:
            if name not in known:
                raise TrainingError(expected("--stages", "", f"stages of {self.name}: {', '.join(known)}", name))
        return replace(self, stages=tuple(stage for stage in self.stages if stage.name in names))

    def with_values(self, values: Mapping[str, Any]) -> Curriculum:
        """Return the curriculum with other values in all of its scenarios.

        Args:
            values: by dotted key, as in {"brigades.allocation": "free"}.

        Raises:
            ScenarioError: a key or value that a scenario file could not have either.
        """
        stages = (
            replace(stage, scenarios=tuple(one.with_values(values) for one in stage.scenarios)) for stage in self.stages
        )
        return replace(self, stages=tuple(stages))

    def as_dict(self) -> dict[str, Any]:
        """Return everything there is to learn in as plain values, scenarios as YAML."""
        texts = zip(self.stages, self._texts, strict=True)
        stages = [{**vars(stage), "scenarios": [*scenarios]} for stage, scenarios in texts]
        return {"name": self.name, "digest": self.digest, "stages": stages}

    @cached_property
    def _texts(self) -> list[list[str]]:
        """The scenarios of each stage as YAML, which takes a while."""
        return [[scenario.to_yaml() for scenario in stage.scenarios] for stage in self.stages]


def curriculum_names() -> list[str]:
    """Return the names of the curricula that come with fireworld."""
    return sorted(path.stem for path in (shipped_folder() / "curricula").glob("*.yaml"))


def names_curriculum(given: str | Path) -> bool:
    """Return whether a name or a path is that of a curriculum; a file that cannot be read is none."""
    if str(given) in curriculum_names():
        return True
    if str(given) in scenario_names():
        return False
    try:
        document = _read_document(Path(given), source=str(given))
    except FireworldError:
        return False
    return isinstance(document, dict) and "stages" in document


def find_curriculum(given: str | Path | Curriculum | Scenario) -> Curriculum:
    """Return the curriculum that is meant, or a curriculum of the one scenario that is meant.

    Args:
        given: a curriculum, the name of a shipped one or of a file; or a scenario, the name of a shipped one or of a
            file. A file with the key `stages` is a curriculum.

    Raises:
        TrainingError: no such curriculum or scenario, or a curriculum that makes no sense.
        ScenarioError: broken YAML, or a scenario that makes no sense.
    """
    if isinstance(given, Curriculum):
        return given
    if isinstance(given, Scenario):
        return curriculum_of(given)
    if not isinstance(given, str | Path):
        wanted = "a curriculum or a scenario: an object, a name or a path"
        raise TrainingError(expected("curriculum", "", wanted, type(given).__name__))
    if str(given) not in curriculum_names():
        if str(given) in scenario_names():
            return curriculum_of(load_scenario(str(given)))
        document = _read_document(Path(given), source=str(given))
        if isinstance(document, dict) and "stages" not in document:
            return curriculum_of(load_scenario(given))
    return load_curriculum(given)


def curriculum_of(scenario: Scenario) -> Curriculum:
    """Return the curriculum of one scenario.

    Its stage has cooperation (4320 states) if there is more than one brigade; a single one has nobody to see.
    """
    stage = CurriculumStage(scenario.name, scenario.brigades.n > 1, (scenario,))
    return Curriculum(name=scenario.name, stages=(stage,))


def load_curriculum(name_or_path: str | Path) -> Curriculum:
    """Load a shipped curriculum by its name, or a curriculum file by its path.

    Raises:
        TrainingError: no such curriculum, or one that makes no sense.
        ScenarioError: broken YAML.
    """
    path, source = Path(name_or_path), str(name_or_path)
    if source in curriculum_names():
        path = shipped_folder() / "curricula" / f"{source}.yaml"
    return _build(_read_document(path, source=source), source=source, path=path)


def _read_document(path: Path, *, source: str) -> Any:
    names = f"a curriculum file or one of {', '.join(curriculum_names())}, or a scenario"
    text = read_input(
        path,
        what="a curriculum",
        n_bytes_max=SIZE_MAX_BYTES,
        error=TrainingError,
        source=source,
        or_names=names,
    )
    return read_yaml(text, source=source)


def _build(document: Any, *, source: str, path: Path) -> Curriculum:
    try:
        read = msgspec.convert(document, CurriculumText)
    except msgspec.ValidationError as error:
        fault, _, where = str(error).partition(" - at `$")
        parts = (source, where.strip(".`"), fault[:1].lower() + fault[1:])
        raise TrainingError(": ".join(part for part in parts if part)) from None
    stages: list[CurriculumStage] = []
    for index, text in enumerate(read.stages):
        where = f"{source}: stages.{index}"
        if text.name in {stage.name for stage in stages}:
            raise TrainingError(expected(where, "name", "another name for every stage", text.name))
        if stages and stages[-1].cooperation and not text.cooperation:
            wanted = "true, as in the stage before: what was learned with cooperation has no place without"
            raise TrainingError(expected(where, "cooperation", wanted, "false"))
        stages.append(build_stage(text, where=where, folder=path.parent))
    return Curriculum(name=text_of(path.stem), stages=tuple(stages))


def build_stage(stage: StageText, *, where: str, folder: Path) -> CurriculumStage:
    """Load the scenarios of a stage, or make the variations; paths are relative to the folder.

    Raises:
        TrainingError: a stage that makes no sense, or a scenario that cannot be had, at this place.
    """
    if bool(stage.scenarios) == (stage.base is not None):
        got = "both" if stage.scenarios else "neither"
        raise TrainingError(expected(where, "", "either `scenarios` or `base`", got))
    if stage.base is None and (stage.set or stage.vary or stage.each):
        raise TrainingError(expected(where, "", "`set`, `vary` and `each` with `base`", "them with `scenarios`"))
    if math.prod(len(values) for values in stage.vary.values()) * max(1, len(stage.each)) > N_VARIATIONS_MAX:
        raise TrainingError(expected(where, "vary", f"at most {N_VARIATIONS_MAX} combinations", "more of them"))
    try:
        scenarios = tuple(_load(name, folder) for name in stage.scenarios)
        if stage.base is not None:
            scenarios = tuple(_variations(_load(stage.base, folder), stage))
    except FireworldError as error:
        raise TrainingError(f"{where}: {error}") from None
    return CurriculumStage(name=stage.name, cooperation=stage.cooperation, scenarios=scenarios)


def _load(name: str, folder: Path) -> Scenario:
    """Load a shipped scenario, or one of a file, whose path is relative to the curriculum's."""
    return load_scenario(folder / name if name.endswith((".yaml", ".yml")) else name)


def _variations(base: Scenario, stage: StageText) -> Iterator[Scenario]:
    """Yield each group of values with every combination of those that vary; what is named first changes last."""
    combinations = [dict(zip(stage.vary, values, strict=True)) for values in itertools.product(*stage.vary.values())]
    for number, (group, values) in enumerate(itertools.product(stage.each or ({},), combinations), 1):
        settings = {**stage.set, **group, **values}
        varied = base.with_values(settings)
        yield msgspec.structs.replace(varied, name=f"{stage.name}-{number}")
