"""A study of one's own on the front door, as mypy --strict sees it: every type is known, none is Any.

It is checked and not run.
"""

from pathlib import Path
from typing import assert_type

import fireworld as fw


class SpreadOut(fw.Policy):
    """Take the first action that no other brigade does."""

    def __init__(self, k: int = 4) -> None:
        self.k = k

    def decide(self, observation: fw.Observation) -> fw.Decision:
        free = [action for action in list(fw.Action)[: self.k] if not observation.others[action]]
        return fw.Decision(free[0] if free else fw.Action.NEAREST_TO_ME)


def nearest(observation: fw.Observation) -> str:
    """Decide by a function of the observation."""
    return "nearest-to-civilian" if observation.step > 3 else "easiest"


def runs(folder: Path) -> None:
    """Run, record, open, compare, take apart."""
    run = fw.run("quick", policy=SpreadOut, seed=3, steps=20, set={"brigades.n": 3}, record=folder / "a.mcap")
    assert_type(run, fw.Run)
    assert_type(run.digest, str)
    assert_type(run.outcome.score, float)
    assert_type(fw.run("quick", policy=nearest), fw.Run)
    values = {"city": {"generated": {"columns": 6, "rows": 4}}, "fires": [{"at": [0.5, 0.5]}], "steps": 50}
    scenario = fw.Scenario.from_dict(values)
    assert_type(fw.run(scenario, policy=SpreadOut(k=2)), fw.Run)

    log = fw.open_log(folder / "a.mcap", partial=True)
    assert_type(log, fw.Run)
    assert_type(log.path, Path | None)
    assert_type(log[5].score.n_burnt_out, int)
    assert log.series("buildings.temperature").shape == (21, len(log.city.building_id))

    assert_type(bool(fw.verify(folder / "a.mcap")), bool)
    difference = fw.diff(log, folder / "b.mcap", tolerances={"buildings.temperature": 1e-6}, ignore=["draws"])
    assert_type(difference, fw.Difference)
    assert_type(fw.fork(log, at=14, policy="chief", record=folder / "b.mcap"), fw.Run)
    assert_type(fw.explain(log, folder / "b.mcap", budget=20), fw.Explanation)
    fw.recover(folder / "broken.mcap", folder / "good.mcap", force=True)
    fw.export(log, folder / "tables", tables=["brigades"])
    fw.export_rlds([log, folder / "episodes.mcap"], folder / "dataset", observation="targets")
    assert_type(fw.load_dataset(folder / "dataset").run(0), fw.Run)
    assert_type(fw.open_episode(folder / "episodes.mcap", 3), fw.Run)


def loop() -> float:
    """Own the loop."""
    world = fw.world("quick", seed=1, set={"brigades.n": 2})
    assert_type(world, fw.Session)
    while not world.done:
        before = world.snapshot()
        world.step(["nearest-to-me"] * world.n_brigades)
        world.restore(before)
        world.step([fw.Action.EASIEST] * world.n_brigades)
    return world.outcome.score


def studies(folder: Path) -> None:
    """Train and compare."""
    team = fw.train("paper", method="search", seed=1, set={"n_generations": 2}, output=folder / "team.npz")
    assert_type(team, fw.Team)
    team.save(folder / "again.npz")
    assert_type(fw.load_team(folder / "again.npz"), fw.Team)
    comparison = fw.compare(["chief", team, SpreadOut], scenarios=["quick"], seeds=10, results=folder / "runs.parquet")
    assert_type(comparison, fw.Comparison)
    verdict: str = comparison.verdict("score", policy="best")
    assert verdict != "worse"
    assert_type(fw.scenarios(), list[fw.Scenario])
    checks = fw.check_scenarios(["quick", folder / "town.yaml"], counts=range(2, 9), seeds=4)
    assert_type(checks, fw.ScenarioChecks)
    assert_type(checks.checks[0], fw.ScenarioCheck)
    assert checks.checks[0].verdict != "lost"
    found = fw.new_scenarios(folder / "town.json", n=2, brigades=3, output=folder / "fires.yaml")
    assert_type(found, fw.NewScenarios)
    assert_type(found.scenarios, list[fw.Scenario])
    assert "best" in [policy.name for policy in fw.policies()]
