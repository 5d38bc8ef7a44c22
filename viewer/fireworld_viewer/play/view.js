// What part of the city the maps show: one for all maps of the page, which have the same size.

const CLOSEST = 40;

export class View {
  constructor(box) {
    Object.assign(this, { box, x: 0, y: 0, scale: 1, width: 1, height: 1, version: 0, fitted: true, listeners: [] });
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  changed() {
    this.version += 1;
    for (const listener of this.listeners) listener();
  }

  resize(width, height) {
    Object.assign(this, { width, height });
    if (this.fitted) this.fit();
    else this.changed();
  }

  // Show all that happens, with a margin.
  fit() {
    const [west, south, east, north] = this.box;
    this.fitted = true;
    this.x = (west + east) / 2;
    this.y = (south + north) / 2;
    this.scale = Math.min(this.width / (east - west), this.height / (north - south));
    this.least = this.scale / 8;
    this.changed();
  }

  toScreen(x, y) {
    return [(x - this.x) * this.scale + this.width / 2, (this.y - y) * this.scale + this.height / 2];
  }

  toCity(left, top) {
    return [(left - this.width / 2) / this.scale + this.x, (this.height / 2 - top) / this.scale + this.y];
  }

  // Zoom so that what is at a place of the screen stays there.
  zoom(factor, left = this.width / 2, top = this.height / 2) {
    const [x, y] = this.toCity(left, top);
    this.scale = Math.max(this.least, Math.min(CLOSEST, this.scale * factor));
    this.x = x - (left - this.width / 2) / this.scale;
    this.y = y - (this.height / 2 - top) / this.scale;
    this.fitted = false;
    this.changed();
  }

  pan(right, down) {
    this.x -= right / this.scale;
    this.y += down / this.scale;
    this.fitted = false;
    this.changed();
  }
}

// Wheel, drag, pinch and keys on the canvas of a map.
export function followHands(canvas, view, onClick) {
  const held = new Map();
  let moved = 0;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...place(event));
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    held.set(event.pointerId, place(event));
    moved = held.size > 1 ? Infinity : 0;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) return;
    const [before, now] = [held.get(event.pointerId), place(event)];
    const others = [...held.entries()].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    const [right, down] = [now[0] - before[0], now[1] - before[1]];
    moved += Math.hypot(right, down);
    held.set(event.pointerId, now);
    if (others.length) {
      const apart = (at) => Math.max(10, Math.hypot(at[0] - others[0][0], at[1] - others[0][1]));
      view.zoom(apart(now) / apart(before), (now[0] + others[0][0]) / 2, (now[1] + others[0][1]) / 2);
      view.pan(right / 2, down / 2);
    } else if (moved > 4) {
      view.pan(right, down);
    }
  });
  const release = (event) => {
    if (held.delete(event.pointerId) && event.type === "pointerup" && moved <= 4) onClick(...place(event));
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const pans = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
    const zooms = { "+": 1.3, "=": 1.3, "-": 1 / 1.3 };
    if (event.key in pans) view.pan(...pans[event.key]);
    else if (event.key in zooms) view.zoom(zooms[event.key]);
    else if (event.key === "0") view.fit();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
}

// The box of all that happens in the runs: what burns at any step, and the team, with a margin.
export function boxOfEvents(runs, city) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const take = (west, south, east, north) => {
    box[0] = Math.min(box[0], west);
    box[1] = Math.min(box[1], south);
    box[2] = Math.max(box[2], east);
    box[3] = Math.max(box[3], north);
  };
  const burns = new Set();
  for (const run of runs) {
    run.codes?.whole.forEach((code, k) => code > 0 && burns.add(Math.floor(k / run.codes.rows)));
    for (let row = 0; row < run.steps.length; row += 1) {
      for (let brigade = 0; brigade < run.nBrigades; brigade += 1) {
        const [x, y] = run.brigadeAt(row, brigade);
        if (!Number.isNaN(x + y)) take(x, y, x, y);
      }
    }
  }
  for (const building of burns) take(...city.boxes[building]);
  if (box[0] === Infinity) city.boxes.forEach((one) => take(...one));
  if (box[0] === Infinity) return [0, 0, 100, 100];
  const margin = Math.max(25, 0.08 * Math.max(box[2] - box[0], box[3] - box[1]));
  return [box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin];
}
