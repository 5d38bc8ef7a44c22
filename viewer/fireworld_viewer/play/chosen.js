// One thing looked at: its values at the step, of both runs, and its history as curves.
import { Panel } from "./curves.js";
import { HISTORIES, nameOf, valuesOf } from "./pick.js";

const HINT = "Click a building, a brigade or a civilian on the map, or give its number.";
const COLOR_OF = {
  "buildings.temperature": (look) => look.codes[2][1],
  "buildings.water_litres": (look) => look.water,
  "brigades.tank_litres": (look) => look.water,
  "brigades.sprayed_litres": (look) => look.water,
};

export class Chosen {
  constructor(runs, player, theme, onChoice) {
    Object.assign(this, { runs, player, theme, onChoice, thing: null, panels: [], city: runs[0].city });
    for (const id of ["find", "kind", "which", "hint", "values"]) this[`${id}_`] = document.getElementById(id);
    const counts = { building: this.city.n, brigade: runs[0].nBrigades, civilian: runs[0].nCivilians };
    this.counts = counts;
    for (const [kind, n] of Object.entries(counts)) if (n) this.kind_.append(new Option(kind, kind));
    this.hint_.textContent = HINT;
    this.find_.addEventListener("submit", (event) => {
      event.preventDefault();
      this.find(this.kind_.value, Number(this.which_.value));
    });
  }

  find(kind, number) {
    const index = kind === "building" ? this.city.building_id.indexOf(number) : number;
    if (Number.isInteger(index) && index >= 0 && index < this.counts[kind]) this.choose({ kind, index });
    else this.hint_.textContent = `There is no ${kind} ${this.which_.value}.`;
  }

  choose(thing) {
    this.thing = thing;
    this.panels = [];
    this.hint_.textContent = thing ? "" : HINT;
    this.values_.replaceChildren();
    if (thing) {
      this.kind_.value = thing.kind;
      this.which_.value = String(thing.kind === "building" ? this.city.building_id[thing.index] : thing.index);
      this.build(thing);
    }
    this.onChoice();
    if (thing) this.table.scrollIntoView({ block: "nearest" });
  }

  build(thing) {
    const head = document.createElement("h2");
    head.textContent = nameOf(thing, this.city);
    const close = Object.assign(document.createElement("button"), { type: "button", textContent: "Close" });
    close.addEventListener("click", () => this.choose(null));
    head.append(" ", close);
    this.table = document.createElement("table");
    const curves = document.createElement("div");
    curves.className = "panels";
    for (const [label, field, digits, factor] of HISTORIES[thing.kind]) {
      const shownRuns = this.runs.filter((run) => run.column(field));
      if (!shownRuns.length) continue;
      const panel = new Panel(label, shownRuns.map((run) => ({
        label: "", letter: this.runs.length > 1 ? run.letter : "", rgb: COLOR_OF[field]?.(run.look) ?? null, digits,
        second: run.index === 1, steps: run.steps,
        numbers: run.column(field).over(thing.index).map((one) => one * factor),
      })), this.player, this.theme, { height: 96 });
      curves.append(panel.element);
      this.panels.push(panel);
    }
    this.values_.append(head, this.table, curves);
    for (const panel of this.panels) panel.resize();
  }

  // Write the values at the rows of the runs.
  show(rows) {
    if (!this.thing) return;
    const columns = this.runs.map((run, k) => valuesOf(run, rows[k], this.thing));
    const lines = columns[0].map(([label]) => {
      const line = document.createElement("tr");
      line.append(Object.assign(document.createElement("th"), { scope: "row", textContent: label }));
      const texts = columns.map((values) => values.find(([one]) => one === label)?.[1] ?? "");
      for (const text of texts) {
        const cell = Object.assign(document.createElement("td"), { textContent: text });
        if (new Set(texts).size > 1) cell.className = "other";
        line.append(cell);
      }
      return line;
    });
    if (this.runs.length > 1) {
      const head = document.createElement("tr");
      head.append(document.createElement("td"));
      for (const { letter } of this.runs) {
        head.append(Object.assign(document.createElement("th"), { scope: "col", textContent: letter }));
      }
      lines.unshift(head);
    }
    this.table.replaceChildren(...lines);
    for (const panel of this.panels) panel.draw();
  }

  resize(theme) {
    this.theme = theme;
    for (const panel of this.panels) {
      panel.theme = theme;
      panel.resize();
    }
  }
}
