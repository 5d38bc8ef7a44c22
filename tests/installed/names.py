"""What the front door offers at least."""

FRONT_DOOR = {
    *("run", "play", "world", "Session", "open_log", "Run", "verify", "diff", "fork", "explain", "recover", "export"),
    *("compare", "reproduce", "train", "Team", "NetworkTeam", "load_team", "Scenario", "scenarios"),
    *("open_episode", "export_rlds", "export_minari", "load_dataset", "Dataset"),
    *("check_scenarios", "new_scenarios", "ScenarioCheck", "ScenarioChecks", "NewScenarios"),
    *("Policy", "policies", "Action", "Decision", "Observation"),
}
