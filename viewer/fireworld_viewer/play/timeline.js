// The controls, the cursor, and lanes of marks above it: a lane for each kind of event that occurs.
import { css, parsed, seenOn } from "./colour.js";
import { counted, write } from "./numbers.js";
import { SPEEDS } from "./player.js";

const LANE = 14;
const HALF_LANE = 10;
const THUMB = 8;

export class Timeline {
  constructor(runs, player, first, theme) {
    Object.assign(this, { runs, player, first, theme });
    for (const id of [
      "first", "back", "play", "next", "last", "speed", "step", "link", "lanes", "cursor", "difference",
    ]) this[`${id}_`] = document.getElementById(id);
    this.lanes = this.countLanes();
    this.listen();
    player.onChange(() => this.show());
  }

  // For each kind of event of each run: how many there are at each place of the cursor.
  countLanes() {
    const kinds = [...new Set(this.runs.flatMap((run) => run.happened.map((one) => one.kind)))].sort((a, b) => a - b);
    return kinds.map((kind) => ({ kind, counts: this.runs.map((run) => this.count(run, kind)) }));
  }

  count(run, kind) {
    const counts = new Map();
    for (const one of run.happened) {
      if (one.kind !== kind) continue;
      const step = run.steps[one.row];
      counts.set(step, (counts.get(step) ?? 0) + 1);
    }
    return counts;
  }

  listen() {
    const { player } = this;
    const does = {
      first: () => player.go(0), back: () => player.go(player.place - 1), play: () => player.toggle(),
      next: () => player.go(player.place + 1), last: () => player.go(player.last),
      difference: () => player.goToStep(this.first.step),
    };
    for (const [id, act] of Object.entries(does)) {
      this[`${id}_`].addEventListener("click", () => {
        if (id !== "play") player.pause();
        act();
      });
    }
    for (const speed of SPEEDS) this.speed_.append(new Option(String(speed), String(speed)));
    this.speed_.addEventListener("change", () => player.setSpeed(Number(this.speed_.value)));
    this.cursor_.max = String(player.last);
    this.cursor_.addEventListener("input", () => {
      player.pause();
      player.go(Number(this.cursor_.value));
    });
    this.lanes_.addEventListener("click", (event) => this.goTo(event));
    if (this.first) {
      this.difference_.hidden = false;
      this.difference_.textContent = `◆ first difference: step ${this.first.step}`;
    }
  }

  // Go to the mark next to a click in the lanes, if one is near.
  goTo(event) {
    const box = this.lanes_.getBoundingClientRect();
    const [left, top] = [event.clientX - box.left, event.clientY - box.top];
    if (left < this.label) return;
    const place = ((left - this.from) / (this.to - this.from)) * this.player.last;
    const lane = this.lanes[Math.floor((top - this.top) / this.laneHeight)];
    const near = lane ? lane.counts.flatMap((counts) => [...counts.keys()].map((step) => this.placeOf(step))) : [];
    const best = near.reduce((a, b) => (Math.abs(b - place) < Math.abs(a - place) ? b : a), Infinity);
    const pixels = (Math.abs(best - place) / Math.max(1, this.player.last)) * (this.to - this.from);
    this.player.pause();
    this.player.go(pixels < 12 ? best : place);
  }

  placeOf(step) {
    const after = this.player.steps.findIndex((one) => one > step);
    return after < 0 ? this.player.last : Math.max(0, after - 1);
  }

  // The steps, rising, in which anything happens in any run.
  eventPlaces() {
    const steps = this.runs.flatMap((run) => run.happened.map((one) => run.steps[one.row]));
    return [...new Set(steps.map((step) => this.placeOf(step)))].sort((a, b) => a - b);
  }

  resize() {
    const dots = window.devicePixelRatio || 1;
    const width = this.lanes_.clientWidth;
    this.label = width < 520 ? 96 : 128;
    this.top = this.runs.length > 1 ? 14 : 0;
    const height = this.top + this.laneHeight * this.lanes.length + 2;
    this.lanes_.style.height = `${height}px`;
    Object.assign(this.lanes_, { width: Math.round(width * dots), height: Math.round(height * dots) });
    this.cursor_.style.marginLeft = `${this.label}px`;
    this.cursor_.style.width = `${width - this.label}px`;
    [this.from, this.to] = [this.label + THUMB, width - THUMB];
    const pen = this.lanes_.getContext("2d");
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    this.lanes.forEach((lane, k) => this.drawLane(pen, lane, this.top + k * this.laneHeight));
    if (this.runs.length > 1) this.write(pen, "A above B", 6);
    if (this.first) this.drawFirst(pen, height);
    const said = this.lanes.map(({ kind, counts }) => {
      const times = counts.map((one) => counted([...one.values()].reduce((a, b) => a + b, 0), "time"));
      return `${this.runs[0].eventName(kind)} ${times.join(" and ")}`;
    });
    this.lanes_.setAttribute("aria-label", `Events over the steps: ${said.join(", ") || "none"}`);
    this.show();
  }

  get laneHeight() {
    return this.runs.length > 1 ? 2 * HALF_LANE : LANE;
  }

  x(place) {
    return this.from + (place / Math.max(1, this.player.last)) * (this.to - this.from);
  }

  write(pen, text, middle) {
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = this.theme.faint;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.fillText(text, this.label - 4, middle);
  }

  // Marks of one kind of event, the higher the more: of a second run below the line.
  drawLane(pen, { kind, counts }, top) {
    const room = this.runs.length > 1 ? HALF_LANE : LANE - 1;
    this.write(pen, this.runs[0].eventName(kind), top + this.laneHeight / 2);
    pen.fillStyle = this.theme.line;
    pen.fillRect(this.from, top + room, this.to - this.from, 1);
    const rgb = this.runs.map((run) => run.eventRgb[kind]).find(Boolean) ?? [128, 128, 128];
    pen.fillStyle = css(seenOn(rgb, this.theme.paper));
    counts.forEach((one, k) => {
      for (const [step, n] of one) {
        const high = Math.min(room - 1, 4 + 2 * Math.log2(n));
        pen.fillRect(this.x(this.placeOf(step)) - 1.25, k ? top + room + 1 : top + room - high, 2.5, high);
      }
    });
  }

  drawFirst(pen, height) {
    const x = this.x(this.placeOf(this.first.step));
    pen.fillStyle = pen.strokeStyle = css(seenOn(this.runs[0].look.differs, this.theme.paper));
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, 10);
    pen.lineTo(x, height);
    pen.stroke();
    pen.beginPath();
    for (const [right, down] of [[0, -5], [5, 0], [0, 5], [-5, 0]]) pen.lineTo(x + right, 6 + down);
    pen.fill();
  }

  show() {
    const { player } = this;
    this.cursor_.value = String(player.place);
    this.cursor_.setAttribute("aria-valuetext", `step ${player.step} of ${player.steps.at(-1)}`);
    write(this.play_, player.playing ? "❚❚ Pause" : "▶ Play");
    this.play_.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    this.speed_.value = String(player.speed);
    write(this.step_, `step ${player.step} of ${player.steps.at(-1)}`);
    this.link_.href = `#${player.step}`;
  }
}

// The colors of the page as CSS has them, for what is drawn on canvases.
export function readTheme(name) {
  const style = getComputedStyle(document.documentElement);
  const value = (key) => style.getPropertyValue(`--${key}`).trim();
  return {
    name, paper: parsed(value("paper")), ground: parsed(value("ground")), inkRgb: parsed(value("ink")),
    ink: value("ink"), faint: value("faint"), line: value("line"), street: value("street"), edge: value("edge"),
    casing: value("casing"), jetEdge: value("jet-edge"),
  };
}
