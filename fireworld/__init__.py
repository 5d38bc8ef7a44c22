"""A flight recorder, replayer and test bench for teams of fire brigades.

    import fireworld as fw

    run = fw.run("test-1", policy="best", seed=3, record="a.mcap")   # run a scenario, record every step
    fw.open_log("a.mcap").to_pandas("brigades")                      # read a recording
    fw.diff("a.mcap", fw.run("test-1", policy="chief", seed=3))      # where do two runs first differ?
    fw.compare(["chief", "best"], scenarios=["quick"], seeds=20)     # is it better?

Everything that the command line can do is here, by the same functions. Names are imported when they are first used:
`import fireworld` loads neither numpy nor a compiler.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fireworld.version import __version__ as __version__

if TYPE_CHECKING:
    from fireworld.envs.datasets.loading import Dataset as Dataset
    from fireworld.envs.datasets.loading import load_dataset as load_dataset
    from fireworld.envs.datasets.minari_form import export_minari as export_minari
    from fireworld.envs.datasets.rlds import export_rlds as export_rlds
    from fireworld.errors import FireworldError as FireworldError
    from fireworld.evaluation.board import Leaderboard as Leaderboard
    from fireworld.evaluation.check_scenarios import check_scenarios as check_scenarios
    from fireworld.evaluation.compare import compare as compare
    from fireworld.evaluation.comparison import Comparison as Comparison
    from fireworld.evaluation.found_fires import NewScenarios as NewScenarios
    from fireworld.evaluation.leaderboard import leaderboard as leaderboard
    from fireworld.evaluation.new_scenarios import new_scenarios as new_scenarios
    from fireworld.evaluation.scenario_check import ScenarioCheck as ScenarioCheck
    from fireworld.evaluation.scenario_check import ScenarioChecks as ScenarioChecks
    from fireworld.evaluation.suites import Suite as Suite
    from fireworld.evaluation.suites import suite as suite
    from fireworld.evaluation.suites import suites as suites
    from fireworld.maps.exporting import export_city as export_city
    from fireworld.maps.importing import ImportedCity as ImportedCity
    from fireworld.maps.importing import import_city as import_city
    from fireworld.maps.osm import ImportedOsm as ImportedOsm
    from fireworld.maps.osm import import_osm as import_osm
    from fireworld.outcome import Outcome as Outcome
    from fireworld.policy.names import policies as policies
    from fireworld.policy.protocol import Action as Action
    from fireworld.policy.protocol import Decision as Decision
    from fireworld.policy.protocol import Observation as Observation
    from fireworld.policy.protocol import Policy as Policy
    from fireworld.policy.teams.network_team import NetworkTeam as NetworkTeam
    from fireworld.policy.teams.table_team import TableTeam as TableTeam
    from fireworld.policy.teams.team import Team as Team
    from fireworld.policy.teams.team import load_team as load_team
    from fireworld.recording.difference import Difference as Difference
    from fireworld.recording.difference import diff as diff
    from fireworld.recording.episode import open_episode as open_episode
    from fireworld.recording.explain import Explanation as Explanation
    from fireworld.recording.explain import explain as explain
    from fireworld.recording.explanation.preference import Preferences as Preferences
    from fireworld.recording.explanation.preference import preferences as preferences
    from fireworld.recording.export import export as export
    from fireworld.recording.export import recover as recover
    from fireworld.recording.fork import fork as fork
    from fireworld.recording.official_log.imported import Imported as Imported
    from fireworld.recording.official_log.importer import import_log as import_log
    from fireworld.recording.pages.play import play as play
    from fireworld.recording.record import run as run
    from fireworld.recording.run import Run as Run
    from fireworld.recording.run import open_log as open_log
    from fireworld.recording.verify import Verification as Verification
    from fireworld.recording.verify import verify as verify
    from fireworld.reproduction.readings.try_readings import TriedReadings as TriedReadings
    from fireworld.reproduction.readings.try_readings import try_readings as try_readings
    from fireworld.reproduction.reproduce import Reproduction as Reproduction
    from fireworld.reproduction.reproduce import reproduce as reproduce
    from fireworld.scenario import Scenario as Scenario
    from fireworld.scenario import scenarios as scenarios
    from fireworld.simulation.session import Session as Session
    from fireworld.simulation.session import world as world
    from fireworld.training.log.reader import TrainingLog as TrainingLog
    from fireworld.training.log.reader import open_training as open_training
    from fireworld.training.log.replay import replay_episode as replay_episode
    from fireworld.training.train import train as train

_ROOMS = {
    "Action": "policy.protocol",
    "Comparison": "evaluation.comparison",
    "Dataset": "envs.datasets.loading",
    "Decision": "policy.protocol",
    "Difference": "recording.difference",
    "Explanation": "recording.explain",
    "FireworldError": "errors",
    "Imported": "recording.official_log.imported",
    "ImportedCity": "maps.importing",
    "ImportedOsm": "maps.osm",
    "Leaderboard": "evaluation.board",
    "NetworkTeam": "policy.teams.network_team",
    "NewScenarios": "evaluation.found_fires",
    "Observation": "policy.protocol",
    "Outcome": "outcome",
    "Policy": "policy.protocol",
    "Preferences": "recording.explanation.preference",
    "Reproduction": "reproduction.reproduce",
    "Run": "recording.run",
    "Scenario": "scenario",
    "ScenarioCheck": "evaluation.scenario_check",
    "ScenarioChecks": "evaluation.scenario_check",
    "Session": "simulation.session",
    "Suite": "evaluation.suites",
    "TableTeam": "policy.teams.table_team",
    "Team": "policy.teams.team",
    "TrainingLog": "training.log.reader",
    "TriedReadings": "reproduction.readings.try_readings",
    "Verification": "recording.verify",
    "check_scenarios": "evaluation.check_scenarios",
    "compare": "evaluation.compare",
    "diff": "recording.difference",
    "explain": "recording.explain",
    "export": "recording.export",
    "export_city": "maps.exporting",
    "export_minari": "envs.datasets.minari_form",
    "export_rlds": "envs.datasets.rlds",
    "fork": "recording.fork",
    "import_city": "maps.importing",
    "import_log": "recording.official_log.importer",
    "import_osm": "maps.osm",
    "leaderboard": "evaluation.leaderboard",
    "load_dataset": "envs.datasets.loading",
    "load_team": "policy.teams.team",
    "new_scenarios": "evaluation.new_scenarios",
    "open_episode": "recording.episode",
    "open_log": "recording.run",
    "open_training": "training.log.reader",
    "play": "recording.pages.play",
    "policies": "policy.names",
    "preferences": "recording.explanation.preference",
    "recover": "recording.export",
    "replay_episode": "training.log.replay",
    "reproduce": "reproduction.reproduce",
    "run": "recording.record",
    "scenarios": "scenario",
    "suite": "evaluation.suites",
    "suites": "evaluation.suites",
    "train": "training.train",
    "try_readings": "reproduction.readings.try_readings",
    "verify": "recording.verify",
    "world": "simulation.session",
}
"""The module, below fireworld, that each name of the front door lives in."""

__all__ = ["__version__", *sorted(_ROOMS)]  # noqa: PLE0604 - the names are those of the table


if not TYPE_CHECKING:  # else type checkers would take every name for one that is offered

    def __getattr__(name: str) -> Any:
        """Import a name of the front door from the module it lives in, at its first use."""
        if name not in _ROOMS:
            raise AttributeError(f"module 'fireworld' has no attribute {name!r}; there are {', '.join(sorted(_ROOMS))}")
        from importlib import import_module

        found = getattr(import_module(f"fireworld.{_ROOMS[name]}"), name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return [*__all__]
