"""The site: every page is in it, it builds without a warning, loads nothing from elsewhere, finds what is searched."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec

import pytest

import fireworld as fw
from fireworld import envs
from tests.docs.pages import PAGES, ROOT

CHROMIUM = shutil.which("chromium")
SETTINGS = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("mkdocs") is None or find_spec("material") is None, reason="make site installs it"),
]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder]
    found = os.environ | {"PYTHONPATH": str(ROOT), "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(words, cwd=ROOT, env=found, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def test_every_page_is_in_it(site):
    names = {"index" if page.stem == "README" else page.stem for page in PAGES}
    assert {f"{name}.html" for name in names} | {"api.html", "404.html"} == {path.name for path in site.glob("*.html")}
    assert all(f": {name}.md\n" in SETTINGS for name in names), "in the navigation"


def test_all_of_the_front_door_is_in_the_reference(site):
    text = (site / "api.html").read_text(encoding="utf-8")
    for module, names in (("fireworld", fw.__all__), ("fireworld.envs", envs.__all__)):
        assert [name for name in names if not name.startswith("_") and f'id="{module}.{name}"' not in text] == []


def test_nothing_is_loaded_from_elsewhere(site):
    loads = re.compile(
        r'<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)="(?:https?:)?//|@import|url\(["\']?http'
    )
    pages = [path for ending in ("html", "css") for path in site.rglob(f"*.{ending}")]
    assert [path.name for path in pages if loads.search(path.read_text(encoding="utf-8"))] == []


@pytest.mark.skipif(CHROMIUM is None, reason="no browser here")
def test_a_search_finds_without_a_server(site):
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND"]
    words = [
        CHROMIUM,
        *options,
        "--virtual-time-budget=15000",
        "--dump-dom",
        f"file://{site}/index.html?q=counterfactual",
    ]
    shown = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60).stdout
    assert "environments.html" in shown.partition("md-search-result__list")[2].partition("</ol>")[0]
