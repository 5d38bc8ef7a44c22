"""The table of the model's page is that of the code."""

from __future__ import annotations

import re

from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.ranking_words import WEIGHTS
from tests.docs.pages import ROOT


def test_the_weights_are_those_of_the_code():
    page = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    section = page.partition("\n## 7. Ranking, an extension\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)` \| (.+) \|$", section, re.MULTILINE)
    assert rows == [(weight.name, weight.meaning) for weight in WEIGHTS]
    assert f"of the kind `{RankingTeam.kind}`" in section
