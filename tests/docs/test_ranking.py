"""What the model's page says of rankings and networks is what the code has."""

from __future__ import annotations

import re

from fireworld.policy.teams.network_layers import ACTIVATIONS, N_LAYERS_MAX, NUMBER_MAX, WIDTH_MAX
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.ranking_words import AROUND, OF_ACTION, WEIGHTS
from tests.docs.pages import ROOT


def test_the_weights_are_those_of_the_code():
    page = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    section = page.partition("\n## 7. Ranking, an extension\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)` \| (.+) \|$", section, re.MULTILINE)
    assert rows == [(weight.name, weight.meaning) for weight in (*WEIGHTS, *AROUND)]
    assert f"of the kind `{RankingTeam.kind}`" in section


def test_the_limits_of_networks_are_those_of_the_code():
    page = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    section = page.partition("\n## 8. Network, an extension\n")[2].partition("\n## ")[0]
    assert f"1 to {N_LAYERS_MAX} layers of at most {WIDTH_MAX} outputs" in section
    assert all(f"`{name}`" in section for name in (*ACTIVATIONS, *(one.name for one in OF_ACTION)))
    assert f"of the kind `{NetworkTeam.kind}`" in section
    assert f"numbers above {NUMBER_MAX:.0e}".replace("+0", "") in (ROOT / "docs" / "training.md").read_text(
        encoding="utf-8"
    )
