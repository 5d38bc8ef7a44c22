"""The page that plays, in a real browser: what it shows is what the log says, and every control does what it says."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.play.page import FirstDifference, frame, play_page
from fireworld_viewer.story.narration import decision_lines
from fireworld_viewer.story.series import choices_of

from fireworld.records import ACTIVITIES, FIERYNESS, MemoryRecording
from tests.viewer.browser import Browser, browser, executable
from tests.viewer.conftest import make_recording
from tests.viewer.pixels import decoded, n_near

PATIENCE_SECONDS = 60.0

pytestmark = [
    pytest.mark.heavy,
    pytest.mark.skipif(
        executable() is None, reason="no browser here; on Debian: apt-get install chromium chromium-driver"
    ),
]

LEFT, RIGHT, HOME, END, TAB, PAGE_DOWN = "\ue012", "\ue014", "\ue011", "\ue010", "\ue004", "\ue00f"
TEXT = "return document.querySelector(arguments[0])?.textContent"
STEP = "return window.fireworldPage.player.step"
READY = "return document.documentElement.dataset.ready"
VALUES = """
document.getElementById("kind").value = arguments[0];
document.getElementById("which").value = arguments[1];
document.querySelector("#find button").click();
return Object.fromEntries([...document.querySelectorAll("#values table tr")].map(
  (row) => [row.cells[0].textContent, [...row.cells].slice(1).map((cell) => cell.textContent)]));
"""
CONTRASTS = """
const parse = (text) => text.match(/[\\d.]+/g).map(Number);
const weights = [0.2126, 0.7152, 0.0722];
const linear = (one) => one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4;
const light = (rgb) => weights.reduce((sum, weight, k) => sum + weight * linear(rgb[k] / 255), 0);
const ground = (element) => {
  for (let one = element; one; one = one.parentElement) {
    const found = parse(getComputedStyle(one).backgroundColor);
    if (found.length < 4 || found[3] > 0) return found;
  }
  return [255, 255, 255];
};
const low = [];
for (const element of document.querySelectorAll("body *")) {
  const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
  if (!own || !element.offsetParent || element.closest("script, style")) continue;
  const [a, b] = [light(parse(getComputedStyle(element).color)), light(ground(element))].sort((x, y) => y - x);
  if ((a + 0.05) / (b + 0.05) < 4.5) low.push([element.outerHTML.slice(0, 90), (a + 0.05) / (b + 0.05)]);
}
return low;
"""
UNNAMED = """
const named = (element) => element.getAttribute("aria-label") || element.title || element.textContent.trim()
  || (element.labels && element.labels.length);
return [...document.querySelectorAll("button, select, input, a, canvas, summary, iframe")].filter((element) =>
  !element.hidden && element.getAttribute("aria-hidden") !== "true"
  && !(named(element) && (element.tagName !== "CANVAS" || element.getAttribute("role") === "img"))
).map((element) => element.outerHTML.slice(0, 90));
"""
AXE = """
axe.run().then((found) => JSON.stringify({n_passed: found.passes.length, violations: found.violations.map(
  (one) => [one.id, one.help, one.nodes.map((node) => node.html.slice(0, 120))])}))
"""


class Shown:
    """A page in the browser."""

    def __init__(self, page: Browser, folder: Path) -> None:
        self.page, self.folder, self.number = page, folder, 0

    def show(self, text: str, *, at: str = "", size: tuple[int, int] = (1400, 900), dark: bool = False) -> None:
        """Open a page; wait until it is drawn."""
        self.number += 1
        path = self.folder / f"{self.number}.html"
        path.write_text(text, encoding="utf-8")
        wide, high = size
        self.page.devtools(
            "Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=False
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.page.devtools("Emulation.setEmulatedMedia", features=[scheme])
        self.page.open(path.as_uri() + at)
        self.wait(lambda: self.run(READY) == "yes")

    def run(self, script: str, *arguments: Any) -> Any:
        return self.page.execute(script, *arguments)

    def step(self) -> int:
        found: int = self.run(STEP)
        return found

    def go(self, step: int) -> None:
        self.run("window.fireworldPage.player.goToStep(arguments[0])", step)

    def text(self, selector: str) -> str:
        found: str = self.run(TEXT, selector)
        return found

    def values(self, kind: str, number: int) -> dict[str, list[str]]:
        found: dict[str, list[str]] = self.run(VALUES, kind, number)
        return found

    def press(self, key: str) -> None:
        self.page.press(key)

    def click(self, selector: str) -> None:
        self.run("document.querySelector(arguments[0]).click()", selector)

    def middle(self, selector: str, *, right: float = 0.5, down: float = 0.5) -> tuple[int, int]:
        """Return a place within an element, in pixels, once it is in sight."""
        left, top, wide, high = self.run(
            "const one = document.querySelector(arguments[0]); one.scrollIntoView({block: 'center'});"
            "const box = one.getBoundingClientRect(); return [box.left, box.top, box.width, box.height];",
            selector,
        )
        return int(left + right * wide), int(top + down * high)

    def wait(self, what: Callable[[], bool]) -> None:
        late = time.monotonic() + PATIENCE_SECONDS
        while time.monotonic() < late:
            if what():
                return
            time.sleep(0.05)
        raise AssertionError("it did not come to be")


@pytest.fixture(scope="module")
def opened(tmp_path_factory) -> Iterator[Shown]:
    folder = tmp_path_factory.mktemp("pages")
    with browser(folder / "profile") as page:
        yield Shown(page, folder)


@pytest.fixture
def shown(opened) -> Iterator[Shown]:
    """A page; in the end nothing was complained of, and nothing was asked of a network."""
    opened.page.complaints()
    yield opened
    assert opened.page.complaints() == []
    assert opened.run("return performance.getEntriesByType('resource').map((one) => one.name)") == []


@pytest.fixture(scope="module")
def one(small) -> str:
    return play_page([small], names=["a.mcap"])


@pytest.fixture(scope="module")
def two(small, slower) -> str:
    return play_page([small, slower], names=["a.mcap", "b.mcap"], first=FirstDifference(step=2, sentence="step 2"))


def number(text: str) -> float:
    return float(text.replace(",", ""))


@pytest.mark.parametrize("step", [0, 1, 17, 40])
def test_values_are_those_of_the_log(shown, one, small, step):
    shown.show(one, at=f"#{step}")
    assert shown.step() == step
    record = small.step(step)
    for index in (0, 7, 21, 35):
        values, state = shown.values("building", 100 + index), record.buildings
        code = int(state.fieryness[index])
        assert values["state"] == [f"{FIERYNESS[code].replace('-', ' ')} ({code})"]
        assert abs(number(values["temperature, ° above ambient"][0]) - state.temperature[index]) <= 0.0501
        assert abs(number(values["fuel left, %"][0]) - 100 * state.fuel_share[index]) <= 0.0501
        assert number(values["water on it, litres"][0]) == state.water_litres[index]
    for index in range(3):
        values, team = shown.values("brigade", index), record.brigades
        assert values["does"] == [ACTIVITIES[team.activity[index]].replace("-", " ")]
        assert number(values["water in the tank, litres"][0]) == team.tank_litres[index]
        assert number(values["sprayed in the step, litres"][0]) == team.sprayed_litres[index]
    assert number(shown.values("civilian", 2)["health points"][0]) == record.civilians.hp[2]
    facts = shown.run(
        "return Object.fromEntries([...document.querySelectorAll('.facts div')]"
        ".map((one) => [...one.children].map((part) => part.textContent)))"
    )
    assert facts["score"] == f"{record.score.score:.3f}"
    assert number(facts["burning"]) == record.score.n_burning
    assert number(facts["burnt out"]) == record.score.n_burnt_out
    assert number(facts["alive"]) == record.score.n_civilians_alive
    assert number(facts["water used, litres"]) == record.score.water_used_litres


def test_choices_are_in_the_words_of_the_narration(shown, one, small):
    asked = np.ones((len(small.steps), 3), bool)
    asked[0] = False
    lines = [line.text.split(": ", 1)[1] for line in decision_lines(small, choices_of(small), asked)]
    shown.show(one, at="#12")
    found = shown.run("return [...document.querySelectorAll('.chose')].map((one) => one.textContent)")
    assert found == lines[3 * 11 : 3 * 12]


def test_every_control_moves_the_cursor(shown, one):
    shown.show(one)
    for selector, step in (("#next", 1), ("#next", 2), ("#back", 1), ("#last", 40), ("#first", 0)):
        shown.click(selector)
        assert shown.step() == step, selector
    shown.run("const one = document.getElementById('cursor'); one.value = 23; one.dispatchEvent(new Event('input'))")
    assert shown.step() == 23
    assert shown.text("#step") == "step 23 of 40"
    assert shown.run("return [location.hash, document.getElementById('link').hash]") == ["#23", "#23"]
    shown.run("location.hash = '#31'")
    shown.wait(lambda: shown.step() == 31)
    for key, step in ((LEFT, 30), (RIGHT, 31), (HOME, 0), (PAGE_DOWN, 10), (END, 40)):
        shown.press(key)
        assert shown.step() == step, repr(key)
    shown.press(HOME)
    shown.press(".")
    after = shown.step()
    assert after > 0
    assert shown.run("return document.querySelectorAll('.events li:not(.hint)').length") > 0
    shown.press(RIGHT)
    shown.press(",")
    assert shown.step() == after


def test_it_plays_to_the_end_at_the_speed_that_is_chosen(shown, one):
    shown.show(one)
    shown.run("const one = document.getElementById('speed'); one.value = 50; one.dispatchEvent(new Event('change'))")
    shown.press("-")
    assert shown.run("return document.getElementById('speed').value") == "20"
    shown.press("+")
    shown.press(" ")
    assert "Pause" in shown.text("#play")
    shown.wait(lambda: shown.step() == 40)
    assert "Play" in shown.text("#play")
    shown.click("#play")  # from the start again
    shown.wait(lambda: 0 < shown.step() < 40)
    shown.click("#play")
    stopped = shown.step()
    time.sleep(0.2)
    assert shown.step() == stopped


def test_a_click_in_a_curve_goes_to_the_step(shown, one):
    shown.show(one)
    x, y = shown.middle("#curves .plot canvas")
    shown.page.click(x, y)
    assert 18 <= shown.step() <= 24
    wide = shown.run("return document.getElementById('lanes').clientWidth")
    x, y = shown.middle("#lanes", right=(128 + 0.3 * (wide - 128)) / wide)
    shown.page.click(x, y)
    assert shown.step() in range(10, 15)


def test_a_click_on_the_map_says_what_is_there(shown, one, small):
    shown.show(one, at="#5")
    left, top = shown.run(
        "const {view, maps} = window.fireworldPage; const box = maps[0].canvas.getBoundingClientRect();"
        "const [x, y] = view.toScreen(arguments[0], arguments[1]); return [box.left + x, box.top + y];",
        float(small.city.center_x_m[22]), float(small.city.center_y_m[22]),
    )  # fmt: skip
    hover = [{"type": "pointerMove", "x": int(left), "y": int(top)}]
    shown.page.send("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": hover}]})
    shown.wait(lambda: shown.text("#tip").startswith("building 122\nstate: "))
    shown.page.click(int(left), int(top))
    assert shown.text("#values h2").startswith("building 122")
    assert shown.run("return document.querySelectorAll('#values .panel').length") == 3
    shown.click("#values button")
    assert shown.text("#values") == ""
    shown.click(".team .ball")
    assert shown.text("#values h2").startswith("brigade 0")
    shown.values("building", 999)
    assert shown.text("#hint") == "There is no building 999."


def test_the_map_zooms_and_moves(shown, one):
    view = "const {x, y, scale} = window.fireworldPage.view; return [x, y, scale];"
    shown.show(one)
    x, y, scale = shown.run(view)
    shown.click("[aria-label='Zoom in']")
    assert shown.run(view)[2] == pytest.approx(1.5 * scale)
    shown.click("[aria-label='Zoom out']")
    shown.run("document.querySelector('.map canvas').focus()")
    shown.press("+")
    shown.press(LEFT)
    assert shown.run(view)[2] > scale
    assert shown.run(view)[0] < x
    assert shown.step() == 0, "keys on the map are the map's"
    shown.press("0")
    assert shown.run(view) == pytest.approx([x, y, scale])
    shown.run(
        "document.querySelector('.map canvas').dispatchEvent("
        "new WheelEvent('wheel', {deltaY: -300, clientX: 300, clientY: 300, cancelable: true}))"
    )
    assert shown.run(view)[2] > scale
    shown.click("[aria-label='Show all that happens']")
    left, top = shown.middle(".map canvas")
    moves = [
        {"type": "pointerMove", "x": left, "y": top},
        {"type": "pointerDown", "button": 0},
        {"type": "pointerMove", "x": left + 80, "y": top, "duration": 50},
        {"type": "pointerUp", "button": 0},
    ]
    shown.page.send("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": moves}]})
    assert shown.run(view)[0] < x
    assert shown.text("#values") == "", "a drag is no click"


def test_all_that_happens_fits_the_opening_view(shown, one, small):
    shown.show(one)
    places = shown.run(
        "const {view, runs: [run]} = window.fireworldPage; const found = [];"
        "for (let row = 0; row < run.steps.length; row += 1) for (let k = 0; k < run.nBrigades; k += 1)"
        " found.push(view.toScreen(...run.brigadeAt(row, k)));"
        "return [found, view.width, view.height];"
    )
    (xy, wide, high) = np.array(places[0]), places[1], places[2]
    assert (xy > 0).all()
    assert (xy < [wide, high]).all()


def test_colors_on_the_map_are_those_of_the_table(shown, one):
    shown.show(one, at="#0")
    canvas = "return document.querySelector('.map canvas').getBoundingClientRect().toJSON()"
    box = shown.run(canvas)
    rows, columns = (slice(int(box[a]), int(box[b])) for a, b in (("top", "bottom"), ("left", "right")))

    def on_map(rgb: colors.Rgb) -> int:
        return n_near(decoded(shown.page.screenshot())[rows, columns], rgb)

    shown.wait(lambda: on_map(colors.FIERYNESS_RGB[0]) > 5_000)
    assert on_map(colors.FIERYNESS_RGB[8]) < 1_000  # edges and numbers
    assert on_map(colors.WATER_RGB) > 0
    shown.go(40)
    shown.wait(lambda: on_map(colors.FIERYNESS_RGB[8]) > 5_000)
    assert on_map(colors.FIERYNESS_RGB[0]) < 5_000


def test_the_legend_has_what_occurs_and_outlines_it(shown, one, small):
    shown.show(one)
    found = shown.run("return [...document.querySelectorAll('#legend li')].map((one) => one.textContent)")
    codes = np.unique(small.column("/buildings", "fieryness"))
    assert found[: len(codes)] == [FIERYNESS[code].replace("-", " ") for code in codes]
    assert "brigade, dead" not in found
    shown.click("#legend button")
    assert shown.run("return document.querySelector('#legend button').ariaPressed") == "true"
    assert shown.run("return window.fireworldPage.legend.kinds.size") == 1


def test_two_runs_have_one_cursor(shown, two, small, slower):
    shown.show(two, at="#12")
    assert shown.run("return document.querySelectorAll('.map canvas').length") == 2
    values = shown.values("building", 121)
    codes = [int(run.step(12).buildings.fieryness[21]) for run in (small, slower)]
    assert values["state"] == [f"{FIERYNESS[code].replace('-', ' ')} ({code})" for code in codes]
    differs = shown.run("return [...window.fireworldPage.differences()]")
    a, b = (run.step(12).buildings for run in (small, slower))
    assert [much == 2 for much in differs] == (a.fieryness != b.fieryness).tolist()
    assert [much > 0 for much in differs] == (
        (a.fieryness != b.fieryness) | (a.temperature != b.temperature) | (a.water_litres != b.water_litres)
    ).tolist()
    shown.click("#difference")
    assert shown.step() == 2
    shown.press(END)
    assert shown.step() == 40
    assert "ended at step 30" in shown.text("#now")
    assert number(shown.values("brigade", 1)["water in the tank, litres"][1]) == slower.step(30).brigades.tank_litres[1]


def test_names_are_shown_as_text(shown, small):
    evil = "</script><script>document.title = 'mine'</script><img src=x onerror=alert(1)>"
    recording = MemoryRecording(
        replace(small.header, scenario=evil, policy=evil), replace(small.city, attribution=evil, name=evil), list(small)
    )
    shown.show(play_page([recording], names=[evil]))
    for selector in ("#title", "#outcome", "#credit"):
        assert evil in shown.text(selector)
    assert shown.run("return document.querySelectorAll('img').length") == 0
    assert shown.run("return document.title") != "mine"


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", [(1400, 900), (420, 800)])
def test_everybody_can_read_and_use_it(shown, one, two, size, dark):
    for page in (one, two):
        shown.show(page, at="#20", size=size, dark=dark)
        shown.values("building", 121)
        shown.run("document.getElementById('keys').open = true")
        assert shown.run(UNNAMED) == []
        assert shown.run(CONTRASTS) == []
        assert shown.run("return document.documentElement.scrollWidth <= innerWidth")
        assert "step 20, score" in shown.text("#status")
        assert "at step 20" in shown.run("return document.querySelector('.plot canvas').getAttribute('aria-label')")


def test_tab_reaches_every_control(shown, one):
    shown.show(one)
    wanted = shown.run(
        "const all = [...document.querySelectorAll('button, select, input, a, summary, [tabindex=\"0\"]')]"
        ".filter((one) => one.offsetParent); all.forEach((one, k) => { one.dataset.place = k; }); return all.length;"
    )
    reached = set()
    for _ in range(wanted + 3):
        shown.press(TAB)
        reached.add(shown.run("return document.activeElement.dataset.place ?? null"))
    assert len(reached - {None}) == wanted


def test_it_lives_in_a_frame(shown, one):
    path = shown.folder / "outer.html"
    path.write_text(f"<!doctype html><title>outer</title>{frame(one)}", encoding="utf-8")
    shown.page.open(path.as_uri())
    ready = "return document.querySelector('iframe').contentDocument.documentElement.dataset.ready"
    shown.wait(lambda: shown.run(ready) == "yes")
    shown.run("document.querySelector('iframe').contentDocument.getElementById('last').click()")
    assert shown.run("return document.querySelector('iframe').contentWindow.fireworldPage.player.step") == 40


def test_it_prints_in_the_colors_of_paper(shown, one):
    shown.show(one, at="#20", dark=True)
    printed = shown.page.devtools("Page.printToPDF", printBackground=True)
    assert len(printed["data"]) > 20_000
    assert shown.run("return document.documentElement.className") == ""


def test_a_browser_without_the_means_says_so(shown, one):
    shown.folder.joinpath("old.html").write_text(one, encoding="utf-8")
    script = shown.page.devtools("Page.addScriptToEvaluateOnNewDocument", source="delete window.DecompressionStream")
    shown.page.open(shown.folder.joinpath("old.html").as_uri())
    shown.wait(lambda: "too old" in shown.text("#failure"))
    assert not shown.run("return document.getElementById('failure').hidden")
    shown.page.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])
    assert len(shown.page.complaints()) == 1


def test_it_is_fast(shown, big):
    page = play_page([big], names=["big.mcap"])
    shown.show(page)
    drawn_ms = shown.run("return performance.getEntriesByName('ready')[0].startTime")
    frames_ms = shown.run(
        "const {player} = window.fireworldPage; const found = []; player.playing = true;"
        "for (let k = 1; k < 25; k += 1) { const begin = performance.now(); player.go(k); player.playing = true;"
        " found.push(performance.now() - begin); } player.playing = false; return found;"
    )
    assert drawn_ms < 500 * 6, "machines that do other work too have time"
    assert np.median(frames_ms) < 8 * 3


def test_it_opens_where_it_is_told_to(shown, small):
    page = play_page([small], names=["small.mcap"], start=17)
    shown.show(page)
    assert shown.step() == 17
    shown.show(page, at="#5")
    assert shown.step() == 5, "the address goes before"


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", [(1400, 900), (420, 800)])
def test_axe_has_nothing_to_say(shown, one, two, size, dark):
    """The rules of axe-core, for people who read the page with the ears or the keyboard."""
    axe = pytest.importorskip("axe_core_python")
    source = (Path(axe.__file__).parent / "axe.min.js").read_text(encoding="utf-8")
    for page in (one, two):
        shown.show(page, size=size, dark=dark)
        shown.page.devtools("Runtime.evaluate", expression=source)
        found = shown.page.devtools("Runtime.evaluate", expression=AXE, awaitPromise=True, returnByValue=True)
        result = json.loads(found["result"]["value"])
        assert result["violations"] == []
        assert result["n_passed"] > 15


def test_a_large_city_is_drawn_in_few_paths(shown):
    """Of a city of 40,000 buildings none has an edge, and each state is filled in paths of hundreds."""
    large = make_recording(250, 160, 3)
    shown.show(play_page([large], names=["large.mcap"]))
    shown.run("const {view} = window.fireworldPage; view.zoom(0.02); return null")
    seen = shown.run("return window.fireworldPage.maps[0].inSight().length")
    assert seen > 6000
    counted = shown.run(
        "const kind = CanvasRenderingContext2D.prototype, n = {};"
        "for (const name of ['fill', 'stroke', 'fillRect', 'strokeRect']) {"
        "  const own = kind[name]; n[name] = 0;"
        "  kind[name] = function (...given) { n[name] += 1; return own.apply(this, given); };"
        "} window.fireworldPage.draw(); return n;"
    )
    assert 0 < sum(counted.values()) < seen / 20, counted
    box = shown.run("return document.querySelector('.map canvas').getBoundingClientRect().toJSON()")
    rows, columns = (slice(int(box[a]), int(box[b])) for a, b in (("top", "bottom"), ("left", "right")))
    assert n_near(decoded(shown.page.screenshot())[rows, columns], colors.FIERYNESS_RGB[0]) > 2_000
