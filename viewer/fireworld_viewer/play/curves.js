// Curves over the steps: drawn once for their size, with the cursor as a line above; a click goes to a step.
import { css, seenOn } from "./colour.js";
import { brief, shown, ticks, write } from "./numbers.js";

const ROOM = { left: 52, right: 10, top: 8, bottom: 20 };
const DASHES = { dotted: [2, 3], second: [7, 4] };

// A panel: curves of the same quantity, each {label, letter, rgb, digits, dotted, second, steps, numbers}.
export class Panel {
  constructor(title, curves, player, theme, { fromZero = true, height = 150 } = {}) {
    Object.assign(this, { title, curves, player, theme, fromZero, height, keys: new Map() });
    this.element = document.createElement("figure");
    this.element.className = "panel";
    const head = document.createElement("figcaption");
    head.append(Object.assign(document.createElement("h3"), { textContent: title }));
    this.labels = curves.map((curve) => this.label(curve));
    head.append(...this.keys.values());
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.style.height = `${height}px`;
    this.cursor = Object.assign(document.createElement("div"), { className: "cursor" });
    const plot = Object.assign(document.createElement("div"), { className: "plot" });
    plot.append(this.canvas, this.cursor);
    this.element.append(head, plot);
    this.canvas.addEventListener("click", (event) => this.goTo(event));
    this.canvas.addEventListener("pointermove", (event) => event.buttons && this.goTo(event));
  }

  // Add what a curve is called, and where its value is written; curves of one label stand together.
  label(curve) {
    if (!this.keys.has(curve.label)) {
      const key = Object.assign(document.createElement("span"), { className: "key", textContent: curve.label });
      this.keys.set(curve.label, key);
    }
    const swatch = document.createElement("canvas");
    Object.assign(swatch, { width: 44, height: 8 });
    swatch.setAttribute("aria-hidden", "true");
    const value = document.createElement("b");
    this.keys.get(curve.label).append(" ", swatch, curve.letter ? ` ${curve.letter} ` : " ", value);
    return { swatch, value };
  }

  goTo(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left - ROOM.left) / (box.width - ROOM.left - ROOM.right);
    const { steps } = this.player;
    const step = steps[0] + Math.max(0, Math.min(1, share)) * (steps.at(-1) - steps[0]);
    this.player.pause();
    this.player.goToStep(Math.round(step));
  }

  color(curve) {
    return css(curve.rgb ? seenOn(curve.rgb, this.theme.paper) : this.theme.inkRgb);
  }

  dress(pen, curve) {
    pen.strokeStyle = this.color(curve);
    pen.lineWidth = curve.second ? 1.6 : 2;
    pen.lineJoin = "round";
    pen.setLineDash(curve.second ? DASHES.second : curve.dotted ? DASHES.dotted : []);
  }

  // Set the size and draw everything anew.
  resize() {
    const dots = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    if (!this.width) return;
    Object.assign(this.canvas, { width: Math.round(this.width * dots), height: Math.round(this.height * dots) });
    this.scale();
    const pen = this.canvas.getContext("2d");
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    this.drawAxes(pen);
    for (const curve of this.curves) this.drawCurve(pen, curve);
    this.curves.forEach((curve, k) => {
      const small = this.labels[k].swatch.getContext("2d");
      small.setTransform(2, 0, 0, 2, 0, 0);
      small.clearRect(0, 0, 22, 4);
      this.dress(small, curve);
      small.beginPath();
      small.moveTo(0, 2);
      small.lineTo(22, 2);
      small.stroke();
    });
    this.draw();
  }

  scale() {
    const known = this.curves.flatMap((curve) => curve.numbers).filter((value) => !Number.isNaN(value));
    let low = known.reduce((a, b) => Math.min(a, b), this.fromZero ? 0 : Infinity);
    let high = known.reduce((a, b) => Math.max(a, b), this.fromZero ? 0 : -Infinity);
    if (!(high > low)) [low, high] = [Number.isFinite(low) ? low : 0, (Number.isFinite(low) ? low : 0) + 1];
    const { steps } = this.player;
    const [from, span] = [steps[0], Math.max(1, steps.at(-1) - steps[0])];
    const wide = this.width - ROOM.left - ROOM.right;
    const high_ = this.height - ROOM.top - ROOM.bottom;
    this.x = (step) => ROOM.left + ((step - from) / span) * wide;
    this.y = (value) => ROOM.top + (1 - (value - low) / (high - low)) * high_;
    this.range = [low, high];
  }

  drawAxes(pen) {
    const { theme, player, width, height } = this;
    pen.clearRect(0, 0, width, height);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = theme.faint;
    pen.strokeStyle = theme.line;
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    for (const value of ticks(...this.range, 4)) {
      const y = Math.round(this.y(value)) + 0.5;
      pen.beginPath();
      pen.moveTo(ROOM.left, y);
      pen.lineTo(width - ROOM.right, y);
      pen.stroke();
      pen.fillText(brief(value), ROOM.left - 5, y);
    }
    pen.textBaseline = "alphabetic";
    pen.textAlign = "center";
    const whole = ticks(player.steps[0], player.steps.at(-1), width / 90).filter(Number.isInteger);
    for (const step of whole) pen.fillText(String(step), this.x(step), height - 5);
  }

  drawCurve(pen, curve) {
    this.dress(pen, curve);
    pen.beginPath();
    let gap = true;
    curve.numbers.forEach((value, k) => {
      if (Number.isNaN(value)) {
        gap = true;
        return;
      }
      const at = [this.x(curve.steps[k]), this.y(value)];
      if (gap) pen.moveTo(...at);
      else pen.lineTo(...at);
      gap = false;
    });
    pen.stroke();
    pen.setLineDash([]);
  }

  // Move the cursor, and write the values there.
  draw() {
    if (!this.width) return;
    this.cursor.style.transform = `translateX(${this.x(this.player.step)}px)`;
    const said = this.curves.map((curve, k) => {
      const value = valueAt(curve, this.player.step);
      const text = Number.isNaN(value) ? "–" : shown(value, curve.digits);
      write(this.labels[k].value, text);
      return `${curve.letter} ${curve.label} ${text}`.trim();
    });
    if (this.player.playing) return;
    this.canvas.setAttribute("aria-label", `${this.title} at step ${this.player.step}: ${said.join(", ")}`);
  }
}

// The number of a curve at a step, or at the last one before it.
function valueAt(curve, step) {
  let [low, high] = [0, curve.steps.length - 1];
  if (curve.steps[0] > step) return NaN;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (curve.steps[middle] <= step) low = middle;
    else high = middle - 1;
  }
  return curve.numbers[low];
}
