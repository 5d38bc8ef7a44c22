"""`fireworld scenarios`: the list, the map, and every error."""

import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from fireworld.cli.scenarios import command
from fireworld.errors import FireworldError, OutputError, ScenarioError
from fireworld.evaluation.suites import suite, suite_names
from fireworld.scenario import load_scenario, parse_scenario, scenario_names

PNG = b"\x89PNG\r\n\x1a\n"


def call(*words):
    """Run the command; users' mistakes are raised, as `fireworld.cli.main` expects."""
    result = CliRunner().invoke(command, [str(word) for word in words], catch_exceptions=False)
    return result.exit_code, result.output


def test_the_list_names_every_scenario():
    code, text = call()
    assert code == 0
    for name in (*scenario_names(), *suite_names()):
        assert f"\n{name} " in text
    assert "24 x 26 " in text


def test_the_list_as_json():
    code, text = call("--json")
    rows = {row["name"]: row for row in json.loads(text)}
    assert code == 0
    assert list(rows) == [*scenario_names(), *suite_names()]
    assert rows["larger"] == {
        "name": "larger",
        "description": suite("larger").description,
        "n_scenarios": 20,
        "digest": suite("larger").digest,
    }
    assert rows["test-2-brigades-8"] == {
        "name": "test-2-brigades-8",
        "description": "City centre, hard fire, civilians all around, eight brigades.",
        "city": "24 x 26 lots",
        "n_brigades": 8,
        "n_civilians": 11,
        "steps": 500,
        "digest": load_scenario("test-2-brigades-8").digest,
    }


def test_yaml_is_the_resolved_scenario():
    code, text = call("show", "quick", "--yaml", "--set", "brigades.n=3")
    assert code == 0
    assert parse_scenario(text, source="out").digest == load_scenario("quick").with_settings({"brigades.n": "3"}).digest


def test_a_map_is_drawn_once(tmp_path):
    path = tmp_path / "map.png"
    code, text = call("show", "quick", "-o", path)
    assert (code, text) == (0, f"{path}: 80 buildings, 4 burning\n")
    first = path.read_bytes()
    assert first.startswith(PNG)
    with pytest.raises(OutputError, match="an existing file; use --force"):
        call("show", "quick", "-o", path)
    call("show", "quick", "-o", path, "--force", "--set", "fires.0.n_buildings=9")
    assert path.read_bytes() != first
    call("show", "quick", "-o", path, "--force")
    assert path.read_bytes() == first
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.png"]


def test_a_map_is_named_after_its_scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert call("show", "quick")[0] == 0
    assert (tmp_path / "quick.png").read_bytes().startswith(PNG)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("show", "quik"), "got 'quik'; try quick"),
        (("show", "quick", "--set", "brigades.n"), "--set: expected KEY=VALUE, got 'brigades.n'; try brigades.n=7"),
        (("show", "quick", "--set", "brigades.n=0"), "brigades.n: expected a whole number from 1 to 1000, got 0"),
        (
            ("show", "quick", "--set", "fires.0.n_buildings=999"),
            "quick with --set fires.0.n_buildings=999: fires.0.n_bu",
        ),
    ],
)
def test_mistakes_are_told(words, message):
    with pytest.raises(ScenarioError) as caught:
        call(*words)
    assert message in str(caught.value)


def test_a_map_in_no_folder(tmp_path):
    with pytest.raises(FireworldError):
        call("show", "quick", "-o", tmp_path / "none" / "map.png")


@pytest.mark.parametrize("words", [("show",), ("--json", "show", "quick"), ("show", "quick", "--yaml", "-o", "a.png")])
def test_wrong_usage(words):
    code, text = call(*words)
    assert code == 2
    assert "Error: " in text


def test_the_list_imports_nothing_heavy():
    heavy = "{'numpy', 'numba', 'scipy', 'shapely', 'matplotlib', 'rerun', 'mcap'}"
    code = (
        "import sys; from fireworld.cli.scenarios import command; command(['--json'], standalone_mode=False);"
        f"print({heavy} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "set()"


@pytest.mark.parametrize("seed", ["1", "77"])
def test_digests_are_the_same_in_every_process(seed):
    code = "from fireworld.scenario import load_scenario; print(load_scenario('default').digest)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={"PYTHONHASHSEED": seed}
    )
    assert done.stdout.strip() == load_scenario("default").digest
