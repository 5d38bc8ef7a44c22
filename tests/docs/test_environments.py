"""docs/environments.md: its examples run, and it names every array, option and fact that there is."""

from __future__ import annotations

import inspect
import re

import pytest

from fireworld import envs
from fireworld.envs.many_worlds import Worlds
from fireworld.envs.setup import SetupOptions
from fireworld.envs.views import OBSERVATIONS
from fireworld.kernels.batch import EACH, TEAM
from tests.docs.pages import README, ROOT, fenced
from tests.envs.extra import needs_extra

PAGE = ROOT / "docs" / "environments.md"
TEXT = PAGE.read_text(encoding="utf-8")
NAMED = set(re.findall(r"`([^`\n]+)`", TEXT))


@needs_extra()
def test_its_examples_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "docs_environments"}
    blocks = fenced(PAGE, "python")
    assert len(blocks) > 5
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)  # noqa: S102 - what a reader would type
    assert 0.0 < float(capsys.readouterr().out.split()[0]) <= 1.0
    assert names["ahead"].digest() == names["env"].digest() != names["other"].digest()


@needs_extra()
def test_the_example_of_the_readme_runs(tmp_path, monkeypatch):
    (example,) = [block for block in fenced(README, "python") if "fireworld import envs" in block]
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "readme"}
    exec(compile(example, str(README), "exec"), names)  # noqa: S102 - what a reader would type
    assert names["done"].reward.shape == (64,)
    assert names["rewards"].keys() == {"brigade_0", "brigade_1"}


@pytest.mark.parametrize("kind", OBSERVATIONS)
def test_it_has_every_array_with_its_shape_and_type(kind):
    worlds = envs.worlds("quick", 3, observation=kind, own_targets=5, n_burning_max=7)
    shapes = {"n": 3, "b": 2, "k": 5, "g": 7, "4 + k": 9}
    found = re.findall(r"^\| `(\w+)` \| \((.+?)\) \| (\w+)", TEXT, re.MULTILINE)
    rows = {name: (shape, dtype) for name, shape, dtype in found}
    for name, array in worlds.reset().items():
        shape, dtype = rows[name]
        assert array.shape == tuple(shapes.get(size) or int(size) for size in shape.split(", ")), name
        assert array.dtype == dtype, name


def test_it_names_all_that_is_known():
    worlds = envs.worlds("quick")
    assert {*worlds.info(), *TEAM, *EACH} <= NAMED
    assert {*SetupOptions.__annotations__, *OBSERVATIONS} <= {name.strip('"') for name in NAMED}
    assert {mode.name for mode in envs.Autoreset} <= NAMED


def test_it_names_what_worlds_can_do():
    methods = {name for name, _ in inspect.getmembers(Worlds, inspect.isfunction) if not name.startswith("_")}
    spoken = {"reset", "step", "graph", "world", "fork", "snapshot", "restore", "digest"}
    assert spoken <= methods
    assert all(f"{name}(" in TEXT for name in spoken)
