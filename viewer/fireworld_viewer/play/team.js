// What happens in the step: facts, what each brigade does and chose and why, and the events, in words.
import { css, inkOn } from "./colour.js";
import { shown, write } from "./numbers.js";

const EVENTS_SHOWN = 60;
const FACTS = [
  ["score", "score.score", 3],
  ["burning", "score.n_burning", 0],
  ["burnt out", "score.n_burnt_out", 0],
  ["water-damaged", "score.n_water_damaged", 0],
  ["alive", "score.n_civilians_alive", 0],
  ["water used, litres", "score.water_used_litres", 0],
];

function made(tag, name, text = "") {
  const element = document.createElement(tag);
  if (name) element.className = name;
  if (text) element.textContent = text;
  return element;
}

export class StepWords {
  // look: called with the thing that a reader wants to look at.
  constructor(run, alone, look) {
    Object.assign(this, { run, look });
    this.element = made("div", "words");
    if (!alone) this.element.append(made("h2", "", `${run.letter}: ${run.title}`));
    this.ended = made("p", "hint");
    const facts = made("dl", "facts");
    this.facts = FACTS.filter(([, field]) => run.column(`curve.${field}`)).map(([label, field, digits]) => {
      const box = made("div");
      const value = made("dd");
      box.append(made("dt", "", label), value);
      facts.append(box);
      return { field, digits, value };
    });
    this.events = made("ul", "events");
    this.element.append(this.ended, facts, made(alone ? "h2" : "h3", "", "Brigades"), this.team());
    this.element.append(made(alone ? "h2" : "h3", "", "Events of the step"), this.events);
  }

  team() {
    if (!this.run.nBrigades) return made("p", "hint", "There are none.");
    const list = made("ul", "team");
    this.rows = Array.from({ length: this.run.nBrigades }, (_, k) => {
      const row = made("li");
      const ball = made("button", "ball", String(k));
      ball.type = "button";
      ball.setAttribute("aria-label", `Look at brigade ${k}`);
      ball.addEventListener("click", () => this.look({ kind: "brigade", index: k }));
      const [does, tank, gauge, fill, chose] = [
        made("span", "does"), made("span", "tank"), made("span", "gauge"), made("span", "fill"), made("p", "chose"),
      ];
      gauge.append(fill);
      const head = made("div", "head");
      head.append(ball, does, gauge, tank);
      row.append(head, chose);
      list.append(row);
      return { ball, does, tank, gauge, fill, chose };
    });
    return list;
  }

  show(row, step) {
    const { run } = this;
    const last = run.steps.at(-1);
    write(this.ended, step > last ? `ended at step ${last}` : "");
    for (const { field, digits, value } of this.facts) write(value, shown(run.value(`curve.${field}`, row), digits));
    this.rows?.forEach((one, k) => this.showBrigade(one, row, k));
    this.showEvents(step > last ? [] : run.eventsOf[row]);
  }

  showBrigade({ ball, does, tank, gauge, fill, chose }, row, k) {
    const { run } = this;
    const activity = run.activity(row, k);
    const rgb = activity?.[1] ?? run.look.unknownBrigade;
    ball.style.background = css(rgb);
    ball.style.color = inkOn(rgb);
    write(does, activity ? activity[0] : "");
    const litres = run.value("brigades.tank_litres", row, k);
    write(tank, Number.isNaN(litres) ? "" : `${shown(litres)} l`);
    const share = run.tankShare(row, k);
    gauge.hidden = Number.isNaN(share);
    fill.style.width = `${100 * (share || 0)}%`;
    write(chose, run.words ? run.choiceWords(row, k) : "decisions: not recorded");
  }

  showEvents(events) {
    const lines = events.slice(0, EVENTS_SHOWN).map((one) => {
      const line = made("li");
      const mark = made("span", "mark");
      mark.style.background = this.run.eventColor(one.kind);
      const kind = this.run.look.events[one.kind]?.[1];
      if (!kind) line.append(mark, one.text);
      else {
        const button = made("button", "thing", one.text);
        button.type = "button";
        button.addEventListener("click", () => this.look({ kind, index: one.entity }));
        line.append(mark, button);
      }
      return line;
    });
    if (events.length > EVENTS_SHOWN) lines.push(made("li", "", `and ${events.length - EVENTS_SHOWN} more`));
    this.events.replaceChildren(...(lines.length ? lines : [made("li", "hint", "none")]));
  }
}
