"""Every block of every page runs, in order, in one empty folder, and prints what it says; or the page says why not."""

from __future__ import annotations

import re

import pytest

from tests.docs import blocks
from tests.docs.blocks import Reader, empty_folder, renewed
from tests.docs.pages import PAGES, page_name

WITH_BLOCKS = [page for page in PAGES if any(not one.reason and one.language != "text" for one in blocks.blocks(page))]


@pytest.fixture(autouse=True)
def _plain(monkeypatch):
    monkeypatch.setattr("sys.dont_write_bytecode", True)


@pytest.mark.heavy
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("page", WITH_BLOCKS, ids=page_name)
def test_a_page_does_what_it_says(page):
    assert renewed(page) == page.read_text(encoding="utf-8"), "run `make docs`"


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_no_block_is_left_out_silently(page):
    for block in blocks.blocks(page):
        assert block.language in {"sh", "console", "python", "text"} or block.file or block.reason, block.where
        assert not (block.file and block.reason), block.where
        assert len(block.reason.split()) != 1, f"{block.where}: a reason is a sentence"
    n_fences = len(re.findall(r"^```\w*$", page.read_text(encoding="utf-8"), re.MULTILINE))
    assert n_fences == 2 * sum(block.fenced for block in blocks.blocks(page)), "a fence that no block was found at"


PAGE = """\
<!-- given: printf 1 > one -->
<!-- in two.txt -->
```text
2
```

```console
$ cat one
$ cat two.txt
2
```

    false

```python
from pathlib import Path
```

<!-- not run: it would fail -->
```sh
exit 9
```

```python
assert Path("two.txt").read_text() == "2\\n"
```
"""


@pytest.fixture
def page(tmp_path, monkeypatch):
    monkeypatch.setattr(blocks, "ROOT", tmp_path)
    monkeypatch.setattr("tests.docs.pages.ROOT", tmp_path)
    return tmp_path / "page.md"


def test_what_a_page_prints_is_renewed(page):
    page.write_text(PAGE)
    assert renewed(page) == PAGE.replace("$ cat one\n", "$ cat one\n1")


@pytest.mark.parametrize(
    ("block", "wrong"),
    [
        ("```sh\nfireworld info none.mcap\n```\n", "none.mcap: cannot be read"),
        ("    exit 2\n", "exit 2"),
        ("```python\nassert False, 'no'\n```\n", "no"),
        ("```yaml\na: 1\n```\n", "a block of yaml: say in which file it is"),
        ("```\na\n```\n", "a block of no language"),
    ],
)
def test_a_block_that_fails_is_named(page, block, wrong):
    page.write_text(f"# Title\n\n{block}")
    with empty_folder(), pytest.raises(Exception, match=re.escape(wrong)) as failed:
        Reader().tries(blocks.blocks(page)[0])
    assert failed.value.__notes__ == ["in the block at page.md:3"]


def test_windows_stay_closed_and_long_commands_are_shortened():
    assert blocks.windowless(["view", "a.mcap", "--web"]) == ["view", "a.mcap", "--save", "shown.rrd", "--force"]
    assert blocks.windowless(["run", "--view-url", "rerun+http://x", "--seed", "1"]) == ["run", "--seed", "1"]
    assert blocks.shorter(["compare", "a", "b"])[-2:] == ["--seeds", "2"]
    assert blocks.shorter(["compare", "a", "b", "--seeds", "9"])[-1] == "9"
    assert blocks.shorter(["train", "--set", "n_x=1"]) == ["train", "--set", "n_x=1"]
