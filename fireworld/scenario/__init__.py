"""Scenarios: what burns where, who is in danger and who comes to help, read from YAML."""

from fireworld.scenario.scenario import Scenario, parse_scenario, read_scenario, split_settings
from fireworld.scenario.shipped import load_scenario, scenario_names

__all__ = ["Scenario", "load_scenario", "parse_scenario", "read_scenario", "scenario_names", "split_settings"]
