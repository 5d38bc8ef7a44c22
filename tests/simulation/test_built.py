"""A built scenario: what its runs share, and what each has for itself."""

from fireworld.scenario import find_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.placement import SCENARIO_ATTACHMENT

OF_A_RUN = {"seed": 1, "policy": "chief", "policy_digest": "", "n_steps_max": 5}


def test_headers_of_its_runs_have_the_same_files_each_for_itself():
    built = build_scenario(find_scenario("quick"))
    one, other = built.header(**OF_A_RUN), built.header(**OF_A_RUN)
    assert one == other
    assert one.scenario_digest == built.scenario.digest
    assert one.attachments == {SCENARIO_ATTACHMENT: built.scenario.to_yaml().encode()}
    one.attachments["team.npz"] = b""
    assert SCENARIO_ATTACHMENT in built.header(**OF_A_RUN).attachments
    assert "team.npz" not in built.header(**OF_A_RUN).attachments


def test_the_record_of_its_city_is_made_once():
    built = build_scenario(find_scenario("quick"))
    assert built.city_record() is built.city_record()
