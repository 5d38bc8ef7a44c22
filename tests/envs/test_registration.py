"""Names in Gymnasium's registry, and imports: nothing heavy before it is used, one line where it is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fireworld.envs
from tests.envs.extra import MISSING, needs_extra


def run(code):
    """Run code in a new process and return what it printed, or its errors."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else done.stderr


def test_importing_the_room_loads_nothing_heavy():
    heavy = {"gymnasium", "pettingzoo", "torch", "numpy", "numba", "matplotlib"}
    found = set(run("import sys, fireworld.envs as e; dir(e); print(*sys.modules)").split())
    assert "fireworld.envs" in found
    assert not {name.partition(".")[0] for name in found} & heavy


@needs_extra()
@pytest.mark.parametrize(
    "lines",
    [
        "import gymnasium\nimport fireworld.envs",
        "import fireworld.envs\nimport gymnasium",
        "from fireworld import envs\nimport gymnasium as gym, gymnasium",
        "from fireworld.envs import worlds\nfrom gymnasium import vector\nimport gymnasium",
        "import gymnasium\nfrom fireworld.envs import Seeds, brigade",
        "import fireworld.envs, importlib.util as i\ni.find_spec('gymnasium')\nimport gymnasium",
    ],
)
def test_names_are_registered_in_any_order_of_imports(lines):
    code = f"{lines}\nprint([name for name in gymnasium.registry if 'fireworld' in name])"
    assert run(code) == "['fireworld/Team-v0', 'fireworld/Brigade-v0']\n"


@needs_extra()
def test_without_an_import_by_the_name_of_the_room():
    name = "fireworld.envs:fireworld/Team-v0"
    code = f"import gymnasium\nenv = gymnasium.make_vec({name!r}, num_envs=3, scenario='quick')\nprint(env)"
    assert run(code) == "TeamVectorEnv(fireworld/Team-v0, num_envs=3)\n"


@needs_extra()
def test_gymnasium_is_imported_as_ever():
    code = """
import sys, warnings
warnings.simplefilter("error")
import fireworld.envs, importlib
importlib.reload(fireworld.envs)
n = len(sys.meta_path)
import gymnasium
assert len(sys.meta_path) == n - 1
assert gymnasium.__spec__.name == "gymnasium" and gymnasium.__file__
importlib.reload(fireworld.envs)
fireworld.envs.registration.register()
assert gymnasium.make("CartPole-v1").reset(seed=1)
print("fine")
"""
    assert run(code) == "fine\n"


BLOCKED = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name.partition(".")[0])
sys.meta_path.insert(0, Missing())
from fireworld import envs
"""


@pytest.mark.parametrize(
    ("names", "name", "missing"),
    [
        (["gymnasium", "pettingzoo"], "team", "gymnasium|pettingzoo"),
        (["pettingzoo"], "turns", "pettingzoo"),
        (["gymnasium"], "brigade", "gymnasium"),
        (["gymnasium"], "TeamVectorEnv", "gymnasium"),
    ],
)
def test_a_missing_extra_is_named_in_one_line(names, name, missing):
    if MISSING:
        pytest.skip("some are missing already")
    last = run(BLOCKED.format(names=names) + f"envs.{name}").splitlines()[-1]
    error, _, message = last.partition(": ")
    assert error == "fireworld.errors.LibraryError"
    where, _, rest = message.partition(": ")
    assert where == f"fireworld.envs.{name}"
    assert rest in {f"{one} is not installed; try pip install 'fireworld[gym]'" for one in missing.split("|")}


def test_checks_need_the_extra():
    code = BLOCKED.format(names=["gymnasium"]) + "import runpy; runpy.run_module('fireworld.envs.check')"
    hint = "gymnasium is not installed; try pip install 'fireworld[gym]'"
    assert run(code) == f"fireworld.envs.check: fireworld.envs.team: {hint}\n"


def test_worlds_need_no_library():
    code = BLOCKED.format(names=["gymnasium", "pettingzoo"]) + "w = envs.worlds('quick', 2); w.reset(); print(w)"
    assert run(code) == "<Worlds 2 of quick: 2 brigades, features>\n"


def test_no_module_has_the_name_of_a_function():
    """Else it would take its place as soon as it is imported."""
    modules = {path.stem for path in Path(fireworld.envs.__file__).parent.iterdir()}
    assert not modules & set(fireworld.envs.__all__)


@needs_extra()
def test_all_names_are_there():
    for name in fireworld.envs.__all__:
        assert getattr(fireworld.envs, name).__name__ == name
    with pytest.raises(AttributeError, match="has no attribute 'teams'; there are Autoreset, "):
        _ = fireworld.envs.teams
