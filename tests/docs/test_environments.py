"""docs/environments.md: it names every array, option and fact that there is."""

from __future__ import annotations

import inspect
import re

import pytest

from fireworld import envs
from fireworld.envs.many_worlds import Worlds
from fireworld.envs.setup import SetupOptions
from fireworld.envs.views import OBSERVATIONS
from fireworld.kernels.batch import EACH, TEAM
from tests.docs.pages import ROOT

PAGE = ROOT / "docs" / "environments.md"
TEXT = PAGE.read_text(encoding="utf-8")
NAMED = set(re.findall(r"`([^`\n]+)`", TEXT))


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
