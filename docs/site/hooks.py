"""Hooks of `make site`: pages from outside docs/, the page of the Python API, and links that lead out of the site."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import fireworld
from fireworld import envs

ROOT = Path(__file__).parents[2]
OF_THE_PROJECT = ("CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "CODE_OF_CONDUCT.md")
SHIM = re.compile(r'<script src="https://[^"]*iframe-worker/shim"></script>')
"""What the plugin `offline` would load from another host, to search in pages that are opened as files."""
ELSEWHERE = re.compile(r'<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)="(?:https?:)?//[^"]*"')
LINK = re.compile(r"\[(?P<text>[^\]\[]+)\]\((?P<target>[^()\s]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not in docs/."""
    pages = {"index.md": from_root("README.md"), "api.md": api(), **{name: from_root(name) for name in OF_THE_PROJECT}}
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links to pages from outside docs/ lead to their copies, and take others out that leave docs/."""
    del page, config, files
    return LINK.sub(_inside, markdown)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Let the page load nothing from another host; PluginError if it would."""
    del config
    depth = "../" * page.url.count("/")
    here = SHIM.sub(f'<script src="{depth}site/worker.js"></script>', output)
    found = ELSEWHERE.search(here)
    if found:
        raise PluginError(f"{page.url}: a page of the site loads nothing from elsewhere, got {found[0]}")
    return here


def on_post_template(output_content: str, template_name: str, config: MkDocsConfig) -> str:
    """Let the page of links that lead nowhere load nothing from another host either."""
    del template_name, config
    return SHIM.sub("", output_content)


def from_root(name: str) -> str:
    """Return a page of the project's folder with links as they are from docs/."""
    text = (ROOT / name).read_text(encoding="utf-8")
    return LINK.sub(lambda link: f"[{link['text']}]({_moved(link['target'])})", text)


def api() -> str:
    """Return the page of the Python API: what each module offers to its users, out of the docstrings."""
    offered: dict[str, Any] = {"fireworld": fireworld.__all__, "fireworld.envs": envs.__all__}
    parts = ["# Python API\n\nOut of the docstrings; [from Python](python.md) shows how it is used.\n"]
    for module, names in offered.items():
        parts.append(f"## {module}\n")
        parts += [f"::: {module}.{name}\n" for name in sorted(names, key=str.lower) if not name.startswith("_")]
    parts += ["## fireworld.testing\n", "::: fireworld.testing.PolicyConformance\n"]
    return "\n".join(parts)


def _moved(target: str) -> str:
    if target.startswith(("https:", "#")):
        return target
    return target.removeprefix("docs/") if target.startswith("docs/") else f"../{target}"


def _inside(link: re.Match[str]) -> str:
    text, target = link["text"], link["target"]
    if not target.startswith("../"):
        return link[0]
    path, mark, anchor = target.removeprefix("../").partition("#")
    if path == "README.md":
        return f"[{text}](index.md{mark}{anchor})"
    return f"[{text}]({path}{mark}{anchor})" if path in OF_THE_PROJECT else text
