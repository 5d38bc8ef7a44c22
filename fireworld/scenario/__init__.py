"""Scenarios: what burns where, who is in danger and who comes to help, read from YAML."""

from fireworld.scenario.scenario import Scenario, parse_scenario, read_scenario, split_settings
from fireworld.scenario.shipped import find_scenario, load_scenario, scenario_names, scenarios

__all__ = [
    "Scenario",
    "find_scenario",
    "load_scenario",
    "parse_scenario",
    "read_scenario",
    "scenario_names",
    "scenarios",
    "split_settings",
]
