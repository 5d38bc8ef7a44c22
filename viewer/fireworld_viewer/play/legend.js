// The legend: only what occurs in the runs; a click on a state of buildings outlines those that are in it.
import { css, seenOn } from "./colour.js";
import { HEALTH, drawBall, drawJet, drawPerson, drawTank, drawWay } from "./glyphs.js";
import { shadeFill } from "./map.js";

const SIZE = 20;
const LINE = [[2, 16], [18, 4]];

export class Legend {
  constructor(runs, theme, onChoice) {
    Object.assign(this, { runs, theme, onChoice, kinds: new Set() });
    this.element = document.getElementById("legend");
    this.build();
  }

  build() {
    const [run] = this.runs;
    const { look, city } = run;
    const list = document.createElement("ul");
    const item = (text, draw, code = null) => {
      const line = document.createElement("li");
      const swatch = this.swatch(draw);
      if (code === null) line.append(swatch, text);
      else {
        const title = "outline these on the map";
        const button = Object.assign(document.createElement("button"), { type: "button", title });
        button.setAttribute("aria-pressed", String(this.kinds.has(code)));
        button.append(swatch, text);
        button.addEventListener("click", () => this.toggle(code, button));
        line.append(button);
      }
      list.append(line);
    };
    for (const code of this.occurring("buildings.fieryness")) {
      const [name, rgb] = look.codes[code] ?? [`code ${code}`, look.codes[0][1]];
      item(name, (pen) => box(pen, css(rgb), this.theme), code);
    }
    if (this.runs.some((one) => one.column("buildings.temperature"))) {
      item("the hotter, the darker its middle", (pen) => heat(pen, look, this.theme));
    }
    if (city.refuge_building.length) item("refuge", (pen) => box(pen, css(look.refuge), this.theme, "R"));
    if (city.hydrant_x_m.length) item("hydrant", (pen) => box(pen, css(look.hydrant), this.theme, "", 8));
    this.people(item, look);
    if (this.runs.length > 1) {
      const [inside, edge] = [css(this.theme.ground), css(seenOn(look.differs, this.theme.ground))];
      item("differs in state", (pen) => box(pen, inside, this.theme, "", 14, [edge, 3]));
      item("differs in a number", (pen) => box(pen, inside, this.theme, "", 14, [edge, 1.4]));
    }
    this.element.replaceChildren(Object.assign(document.createElement("h2"), { textContent: "Legend" }), list);
  }

  people(item, look) {
    const activities = this.occurring("brigades.activity");
    for (const code of activities) {
      const [name, rgb] = look.activities[code] ?? [`activity ${code}`, look.unknownBrigade];
      item(`brigade, ${name}`, (pen) => drawBall(pen, SIZE / 2, SIZE / 2, 8, rgb, ""));
    }
    if (!activities.length && this.runs[0].nBrigades) {
      item("brigade", (pen) => drawBall(pen, SIZE / 2, SIZE / 2, 8, look.unknownBrigade, ""));
    }
    if (this.runs.some((run) => run.nBrigades && run.city.brigade_tank_litres.some((full) => full > 0))) {
      item("its tank", (pen) => drawTank(pen, 7, 1, [6, 18], 0.6, look));
    }
    if (activities.includes(2)) item("water, to its target", (pen) => drawJet(pen, ...LINE, look, this.theme));
    if (activities.includes(1)) item("driving, to its target", (pen) => drawWay(pen, ...LINE, this.theme));
    for (const health of this.healths()) {
      item(`civilian, ${HEALTH[health]}`, (pen) => drawPerson(pen, SIZE / 2, SIZE / 2, look, health));
    }
  }

  // The codes of a field that occur in any run at any step.
  occurring(field) {
    const found = this.runs.flatMap((run) => run.column(field)?.occurring() ?? []);
    return [...new Set(found)].sort((a, b) => a - b);
  }

  healths() {
    const found = new Set();
    for (const run of this.runs) {
      for (let row = 0; row < run.steps.length; row += 1) {
        for (let k = 0; k < run.nCivilians; k += 1) found.add(run.health(row, k));
      }
    }
    return [...found].sort();
  }

  swatch(draw) {
    const canvas = Object.assign(document.createElement("canvas"), { width: 2 * SIZE, height: 2 * SIZE });
    canvas.setAttribute("aria-hidden", "true");
    const pen = canvas.getContext("2d");
    pen.scale(2, 2);
    draw(pen);
    return canvas;
  }

  toggle(code, button) {
    if (!this.kinds.delete(code)) this.kinds.add(code);
    button.setAttribute("aria-pressed", String(this.kinds.has(code)));
    this.onChoice();
  }
}

function box(pen, fill, theme, letter = "", size = 14, [edge, width] = [theme.edge, 1]) {
  const from = (SIZE - size) / 2;
  pen.fillStyle = fill;
  pen.fillRect(from, from, size, size);
  pen.strokeStyle = edge;
  pen.lineWidth = width;
  pen.strokeRect(from, from, size, size);
  if (!letter) return;
  pen.font = "bold 11px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = "#000";
  pen.fillText(letter, SIZE / 2, SIZE / 2 + 0.5);
}

function heat(pen, look, theme) {
  box(pen, css(look.codes[2][1]), theme, "", 16);
  [1, 3, 5].forEach((shade, k) => {
    pen.fillStyle = shadeFill(shade);
    pen.fillRect(4 + 4 * k, 5, 4, 10);
  });
}
