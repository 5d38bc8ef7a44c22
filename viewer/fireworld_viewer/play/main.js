// Puts the page together: unpacks the data, makes maps, curves and words, and draws them when the cursor moves.
import { Chosen } from "./chosen.js";
import { Panel } from "./curves.js";
import { followKeys } from "./keys.js";
import { Legend } from "./legend.js";
import { CityMap } from "./map.js";
import { nameOf, pick, valuesOf } from "./pick.js";
import { Player } from "./player.js";
import { City, Run } from "./run.js";
import { StepWords } from "./team.js";
import { Timeline, readTheme } from "./timeline.js";
import { unpack } from "./unpack.js";
import { View, boxOfEvents, followHands } from "./view.js";

const COMPARED = [
  ["buildings.temperature", 1], ["buildings.fuel_share", 1], ["buildings.water_litres", 1], ["buildings.fieryness", 2],
];

const byId = (id) => document.getElementById(id);

class Page {
  constructor({ words, columns }) {
    const city = new City(words.city, columns);
    this.runs = words.runs.map((one, k) => new Run(k, one, columns, city, words.look));
    this.alone = this.runs.length === 1;
    Object.assign(this, { city, columns, words, theme: readTheme("screen") });
    this.player = new Player(this.alone ? this.runs[0].steps : columns.get("both.steps").over());
    this.view = new View(boxOfEvents(this.runs, city));
    this.writeHead();
    byId("page").hidden = false;
    byId("page").className = this.alone ? "one" : "two";
    this.maps = this.runs.map((run) => this.addMap(run));
    this.timeline = new Timeline(this.runs, this.player, words.first, this.theme);
    const look = (thing) => this.chosen.choose(thing);
    this.stepWords = this.runs.map((run) => new StepWords(run, this.alone, look));
    byId("now").append(...this.stepWords.map((one) => one.element));
    this.panels = words.look.panels.map((panel) => this.addPanel(panel)).filter(Boolean);
    this.chosen = new Chosen(this.runs, this.player, this.theme, () => this.draw());
    this.legend = new Legend(this.runs, this.theme, () => this.draw());
    this.player.readAddress(words.start);
    this.listen();
    this.resize();
  }

  writeHead() {
    const titles = this.runs.map((run) => run.title);
    byId("title").textContent = titles.join(" against ");
    byId("outcome").append(...this.runs.map((run) => this.outcomeOf(run)));
    if (!this.alone) {
      const { first } = this.words;
      const text = first ? `first difference: ${first.sentence}` : "no difference was found";
      const line = Object.assign(document.createElement("p"), { textContent: text, className: "difference" });
      byId("outcome").append(line);
    }
    byId("credit").textContent = this.city.attribution ? `Map: ${this.city.attribution}` : "";
    byId("credit").hidden = !this.city.attribution;
  }

  outcomeOf(run) {
    const line = document.createElement("p");
    const letter = this.alone ? "" : `${run.letter}: `;
    line.textContent = `${letter}${run.name} — ${run.outcome.map(([label, text]) => `${label} ${text}`).join(" · ")}`;
    if (!run.damage) return line;
    const part = document.createElement("div");
    part.append(line, Object.assign(document.createElement("p"), {
      className: "caveat", textContent: `${run.name}: ${run.damage}; the page ends with the last good step`,
    }));
    return part;
  }

  addMap(run) {
    const figure = document.createElement("figure");
    figure.className = "map";
    const canvas = document.createElement("canvas");
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    const buttons = document.createElement("div");
    buttons.className = "zoom";
    for (const [text, label, act] of [
      ["+", "Zoom in", () => this.view.zoom(1.5)], ["−", "Zoom out", () => this.view.zoom(1 / 1.5)],
      ["⤢", "Show all that happens", () => this.view.fit()],
    ]) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: text, title: label });
      button.setAttribute("aria-label", label);
      button.addEventListener("click", act);
      buttons.append(button);
    }
    const caption = document.createElement("figcaption");
    caption.textContent = this.alone ? "" : `${run.letter}: ${run.policy}`;
    caption.hidden = this.alone;
    caption.style.borderLeft = `6px solid rgb(${this.words.look.pair[run.index]})`;
    figure.append(canvas, caption, buttons);
    byId("maps").append(figure);
    followHands(canvas, this.view, (left, top) => {
      this.chosen.choose(pick(run, this.rowOf(run), this.view, left, top));
    });
    canvas.addEventListener("pointermove", (event) => this.hover(event, run, canvas));
    canvas.addEventListener("pointerleave", () => { byId("tip").hidden = true; });
    return new CityMap(canvas, run, this.view, this.theme);
  }

  hover(event, run, canvas) {
    const tip = byId("tip");
    const box = canvas.getBoundingClientRect();
    const row = this.rowOf(run);
    const thing = event.buttons || event.pointerType === "touch"
      ? null : pick(run, row, this.view, event.clientX - box.left, event.clientY - box.top);
    tip.hidden = !thing;
    if (!thing) return;
    const lines = valuesOf(run, row, thing).filter(([label]) => label !== "chose").slice(0, 4);
    tip.textContent = [nameOf(thing, this.city), ...lines.map(([label, text]) => `${label}: ${text}`)].join("\n");
    const right = event.clientX + 16 + tip.offsetWidth > innerWidth;
    tip.style.left = `${right ? Math.max(0, event.clientX - 12 - tip.offsetWidth) : event.clientX + 14}px`;
    tip.style.top = `${Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 4)}px`;
  }

  addPanel({ title, curves, fromZero }) {
    const drawn = curves.flatMap((curve) => this.runs.filter((run) => run.column(`curve.${curve.field}`)).map((run) => {
      const column = run.column(`curve.${curve.field}`);
      const letter = this.alone ? "" : run.letter;
      const { digits } = column;
      return { ...curve, letter, digits, second: run.index === 1, steps: run.steps, numbers: column.over() };
    }));
    if (!drawn.length) return null;
    const panel = new Panel(title, drawn, this.player, this.theme, { fromZero });
    byId("curves").append(panel.element);
    return panel;
  }

  // The row of a run at the cursor; of one that has ended, its last.
  rowOf(run) {
    if (this.alone) return this.player.place;
    return this.columns.get(run.index ? "both.rowB" : "both.rowA").at(this.player.place);
  }

  listen() {
    this.player.onChange(() => this.draw());
    this.view.onChange(() => this.drawMaps());
    followKeys(this.player, this.timeline);
    addEventListener("hashchange", () => this.player.readAddress());
    new ResizeObserver(() => this.resize()).observe(byId("page"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.changeTheme("screen"));
    addEventListener("beforeprint", () => {
      document.documentElement.classList.add("paper");
      this.changeTheme("paper");
    });
    addEventListener("afterprint", () => {
      document.documentElement.classList.remove("paper");
      this.changeTheme("screen");
    });
  }

  changeTheme(name) {
    this.theme = { ...readTheme(name), name: `${name} ${Math.random()}` };
    for (const one of [...this.maps, ...this.panels, this.timeline, this.legend]) one.theme = this.theme;
    this.legend.build();
    this.resize();
  }

  resize() {
    const { canvas } = this.maps[0];
    for (const panel of this.panels) panel.resize();
    this.chosen.resize(this.theme);
    this.timeline.resize();
    this.view.resize(canvas.clientWidth, canvas.clientHeight);
    this.draw();
  }

  draw() {
    this.drawMaps();
    for (const panel of this.panels) panel.draw();
    this.stepWords.forEach((one, k) => one.show(this.rowOf(this.runs[k]), this.player.step));
    this.chosen.show(this.runs.map((run) => this.rowOf(run)));
    byId("tip").hidden = true;
    if (!this.player.playing) byId("status").textContent = this.summary();
  }

  drawMaps() {
    const differs = this.alone ? null : this.differences();
    this.maps.forEach((map, k) => {
      const run = this.runs[k];
      map.draw({
        row: this.rowOf(run), selected: this.chosen.thing, kinds: this.legend.kinds.size ? this.legend.kinds : null,
        differs,
      });
      if (!this.player.playing) map.canvas.setAttribute("aria-label", `Map of ${run.title} at ${this.summaryOf(run)}`);
    });
  }

  // How each building differs between the runs in what is shown of it: 2 in its state, 1 in a number, 0 not at all.
  differences() {
    const [a, b] = this.runs.map((run) => this.rowOf(run));
    const found = new Uint8Array(this.city.n);
    for (const [name, much] of COMPARED) {
      const [one, two] = this.runs.map((run) => run.column(name));
      if (!one || !two) continue;
      for (let k = 0; k < found.length; k += 1) {
        if (one.wholeAt(a, k) !== two.wholeAt(b, k)) found[k] = much;
      }
    }
    return found;
  }

  summary() {
    return this.runs.map((run) => `${this.alone ? "" : `${run.letter}: `}${this.summaryOf(run)}`).join("; ");
  }

  summaryOf(run) {
    const row = this.rowOf(run);
    const facts = Object.entries({
      score: "score", n_burning: "burning", n_burnt_out: "burnt out", n_civilians_alive: "civilians alive",
    });
    const parts = facts.map(([field, label]) => [run.value(`curve.score.${field}`, row), label])
      .filter(([value]) => !Number.isNaN(value)).map(([value, label]) => `${label} ${value}`);
    return [`step ${this.player.step}`, ...parts].join(", ");
  }
}

async function start() {
  try {
    const page = new Page(await unpack(byId("data").textContent));
    performance.mark("ready");
    document.documentElement.dataset.ready = "yes";
    window.fireworldPage = page;
  } catch (fault) {
    byId("failure").textContent = fault.message;
    byId("failure").hidden = false;
    throw fault;
  }
}

start();
