"""The frame of the project's HTML pages: one file each, with its style and every image in it."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

_STYLE: Final = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fbfaf8; max-width: 74rem; margin: 2rem auto;
  padding: 0 1.5rem; }
h1 { margin-bottom: .2rem; } h2 { margin-top: 2.6rem; border-bottom: 1px solid #d8d4cc; } h3 { margin-bottom: .4rem; }
table { border-collapse: collapse; margin: .8rem 0; font-size: 14px; }
th, td { padding: .3rem .7rem; text-align: right; border-bottom: 1px solid #e5e1d9; white-space: nowrap; }
th { background: #f0ede6; font-weight: 600; } td.text, th.text { text-align: left; white-space: normal; }
.interval { color: #777; font-size: 12.5px; }
.mark { border-radius: 3px; padding: .05rem .45rem; font-size: 12.5px; white-space: nowrap; }
.good { background: #d8efd9; color: #17561d; } .fair { background: #fbeec3; color: #6a4d00; }
.bad { background: #f8d9d5; color: #86201a; } .open { background: #e6e6ea; color: #444; }
.caveat { background: #fbeec3; padding: .6rem 1rem; border-radius: 4px; }
.table { overflow-x: auto; } td.text { overflow-wrap: anywhere; min-width: 9rem; }
.maps { display: grid; grid-template-columns: repeat(3, 1fr); gap: .6rem; } img { max-width: 100%; }
.credit { font-size: 12.5px; color: #555; margin-top: 2.6rem; }
figure { margin: 0; overflow-x: auto; }
@media (max-width: 700px) { body { padding: 0 .8rem; } figure img { max-width: none; width: 54rem; } }
figcaption { font-size: 13px; color: #555; }
"""
"""Marks are good, fair, bad or open."""


def html_page(title: str, body: Iterable[str], *, style: str = "") -> str:
    """Write a page.

    Args:
        title: of the window.
        body: HTML, part by part.
        style: rules besides those that all pages share.
    """
    head = (
        '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{escape(title)}</title><style>{_STYLE}{style}</style>"
    )
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n' + "\n".join(body) + "\n</body></html>\n"


def html_frame(page: str) -> str:
    """Return a whole page as a part of another one, in a frame of its own: for notebooks."""
    return f'<iframe srcdoc="{escape(page)}" style="width: 100%; height: 40rem; border: 0"></iframe>'


def html_table(heads: Sequence[str], rows: Iterable[Sequence[str]], *, n_text: int = 1) -> str:
    """Write a table; cells are HTML, to the right unless made by `text_cell`. The first `n_text` headings are words."""
    head = "".join(f"<th{' class=text' if k < n_text else ''}>{name}</th>" for k, name in enumerate(heads))
    body = "\n".join("<tr>" + "".join(_cell(cell) for cell in row) + "</tr>" for row in rows)
    return f'<div class="table"><table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def text_cell(html: str) -> str:
    """Mark a cell as words, for `html_table`."""
    return f"\0{html}"


def _cell(html: str) -> str:
    return f'<td class="text">{html[1:]}</td>' if html.startswith("\0") else f"<td>{html}</td>"


def compared_row(label: str, values: Sequence[str]) -> list[str]:
    """Return the cells of a row for `html_table`: text, bold where it is not the same in all columns."""
    cells = [escape(value) for value in values]
    return [text_cell(label), *(f"<b>{cell}</b>" if len(set(cells)) > 1 else cell for cell in cells)]


def html_mark(text: str, kind: str) -> str:
    """Write a word on a colored ground: good, fair, bad or open."""
    return f'<span class="mark {kind}">{escape(text)}</span>'


def html_credit(attributions: Iterable[str]) -> list[str]:
    """Write whom the maps on a page are by, each once; nothing for maps that are by nobody else."""
    named = dict.fromkeys(one for one in attributions if one)
    return [f'<p class="credit">Map: {escape("; ".join(named))}</p>'] if named else []


def html_figure(png: bytes, caption: str) -> str:
    """Write a picture, held in the page itself."""
    data = base64.b64encode(png).decode()
    picture = f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"
