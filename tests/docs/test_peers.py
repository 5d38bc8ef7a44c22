"""docs/peers.md: it has every environment that is measured, with numbers, and the measurement runs."""

from __future__ import annotations

import re

import pytest

from benchmarks import peers
from tests.docs.pages import ROOT
from tests.envs.extra import needs_extra

TEXT = (ROOT / "docs" / "peers.md").read_text(encoding="utf-8")
MEASURED = TEXT.partition("<!-- measured by")[2].partition("<!-- end of")[0]


def test_it_has_every_environment_with_a_version_and_a_rate():
    rows = dict(re.findall(r"^\| ([^|]+) \| (.+) \|$", MEASURED, re.MULTILINE))
    for contender in peers.CONTENDERS:
        version, what, rate, times = (cell.strip() for cell in rows[contender.name].split("|"))
        assert re.fullmatch(rf"{contender.package} \d\S*", version)
        assert what == contender.what
        assert int(rate.replace(",", "")) > 100
        assert re.match(r"[\d.]+ x \([\d.]+ to [\d.]+\)", times)


@pytest.mark.slow
@needs_extra()
def test_it_is_measured_so(monkeypatch):
    monkeypatch.setattr(peers, "TURN_SECONDS", 0.01)
    monkeypatch.setattr(peers, "N_WORLDS", 2)
    monkeypatch.setattr(peers, "SCENARIO", "quick")

    def missing():
        raise ImportError

    absent = peers.Contender("absent", "no-such-package", "nothing", missing)
    found = peers.measure([*peers.CONTENDERS[:4], absent], seconds=0.0)
    assert all(one.rate > 0 for one in found[:4])
    assert found[0].slower == (1.0, 1.0, 1.0)
    assert found[1].slower[0] <= found[1].slower[1] <= found[1].slower[2]
    assert (found[4].rate, found[4].version) == (None, "no-such-package, not installed")
    lines = peers.as_markdown(found).splitlines()
    assert lines[-1] == "| absent | no-such-package, not installed | nothing |  |  |"
    assert lines[2].startswith("| worlds | fireworld ")
