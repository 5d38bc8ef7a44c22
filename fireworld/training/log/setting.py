"""What a training log carries of its setting: method, curriculum and cities; and whether its plan is of that."""

from __future__ import annotations

import json
from itertools import zip_longest

from fireworld.errors import FireworldError, LogError, expected
from fireworld.scenario import parse_scenario
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum, CurriculumStage
from fireworld.training.log.environment import method_named
from fireworld.training.log.records import Plan, TrainingHeader
from fireworld.training.log.writer import CITY_FOLDER, CURRICULUM_ATTACHMENT, METHOD_ATTACHMENT
from fireworld.training.method import Method


def setting_of(header: TrainingHeader) -> tuple[Method, Curriculum, CityCache]:
    """Return the method and the curriculum that a header carries, and its cities."""
    files = header.attachments
    for name in (METHOD_ATTACHMENT, CURRICULUM_ATTACHMENT):
        if name not in files:
            raise LogError(expected("attachments", "", name, ", ".join(sorted(files)) or "none"))
    try:
        method = json.loads(files[METHOD_ATTACHMENT])
        name = method.pop("name")
        made = method_named(name).with_settings(method)
        text = json.loads(files[CURRICULUM_ATTACHMENT])
        stages = tuple(
            CurriculumStage(
                stage["name"],
                bool(stage["cooperation"]),
                tuple(parse_scenario(files[one], source=f"training: {one}") for one in stage["scenarios"]),
            )
            for stage in text["stages"]
        )
        curriculum = Curriculum(str(text["name"]), stages)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise LogError(f"attachments: {CURRICULUM_ATTACHMENT} and {METHOD_ATTACHMENT} make no sense: {error}") from None
    except FireworldError as error:
        raise LogError(f"attachments: {error}") from None
    if curriculum.digest != header.curriculum_digest:
        raise LogError(expected("attachments", "curriculum", f"digest {header.curriculum_digest}", curriculum.digest))
    cities = {
        name.removeprefix(CITY_FOLDER).removesuffix(".json"): data
        for name, data in files.items()
        if name.startswith(CITY_FOLDER)
    }
    return made, curriculum, CityCache(cities)


def check_plan(plan: Plan, curriculum: Curriculum) -> None:
    """Check that a plan is that of the curriculum."""
    wanted = [
        [k, int(stage.cooperation), one.brigades.n]
        for k, stage in enumerate(curriculum.stages)
        for one in stage.scenarios
    ]
    columns = (plan.stage, plan.cooperation, plan.n_brigades)
    if [list(row) for row in zip_longest(*(column.tolist() for column in columns))] != wanted:
        raise LogError(f"{Plan.topic}: it has other stages or brigades than the curriculum that is attached")
