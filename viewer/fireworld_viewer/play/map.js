// The map of a run on a canvas: streets and hydrants are drawn once for a view, the rest at each step.
import { css, inkOn, seenOn } from "./colour.js";
import { drawBall, drawJet, drawPerson, drawTank, drawWay } from "./glyphs.js";
import { BRIGADE_RADIUS, CIVILIAN_RADIUS, brigadeSpots, civilianSpots } from "./spots.js";

const SHADES = 6;
const DARKEST = 0.6;
const CORE = 0.55;
const STREET_M = 4;
const MANY = 6000; // buildings in sight above which they are drawn as boxes, without edges and heat
const BATCH = 500; // outlines or lines of one path: browsers take far too long for paths of many thousands
const LENGTHS_M = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000];

// How dark the middle of a building is, by its heat: its edge keeps the color of its code, which every eye can tell.
export function shadeOf(temperature, look) {
  const share = Math.sqrt(Math.max(0, Math.min(1, temperature / look.heatMax)));
  return Number.isNaN(share) ? 0 : Math.round(share * (SHADES - 1));
}

export function shadeFill(shade) {
  return `rgba(0, 0, 0, ${(DARKEST * shade) / (SHADES - 1)})`;
}

// Call `add` for each of some things, and `finish` after every batch; each batch is a path of its own.
function inBatches(pen, things, add, finish) {
  for (let from = 0; from < things.length; from += BATCH) {
    pen.beginPath();
    for (const thing of things.slice(from, from + BATCH)) add(thing);
    finish();
  }
}

export class CityMap {
  constructor(canvas, run, view, theme) {
    Object.assign(this, { canvas, run, view, theme, city: run.city });
    this.ground = document.createElement("canvas");
    this.drawnFor = "";
  }

  // Draw a step. marks: {row, selected, kinds, differs}.
  draw(marks) {
    const { canvas, view } = this;
    const dots = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(view.width * dots), Math.round(view.height * dots)];
    if (!width || !height) return; // the page is not laid out
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.drawGround(width, height, dots);
    const pen = canvas.getContext("2d", { alpha: false });
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this.ground, 0, 0);
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    pen.lineJoin = "round";
    pen.lineCap = "round";
    this.drawBuildings(pen, marks);
    const spots = brigadeSpots(this.run, marks.row, view);
    this.drawWays(pen, marks.row, spots);
    this.drawCivilians(pen, marks.row);
    this.drawBrigades(pen, marks.row, spots);
    this.drawSelected(pen, marks);
    this.drawBar(pen);
  }

  drawGround(width, height, dots) {
    const key = `${this.view.version} ${width} ${height} ${this.theme.name}`;
    if (key === this.drawnFor) return;
    this.drawnFor = key;
    Object.assign(this.ground, { width, height });
    const { city, view, theme } = this;
    const pen = this.ground.getContext("2d");
    pen.fillStyle = css(theme.ground);
    pen.fillRect(0, 0, width, height);
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    pen.lineCap = "round";
    pen.strokeStyle = theme.street;
    pen.lineWidth = Math.max(1, Math.min(14, STREET_M * view.scale));
    inBatches(pen, this.streetsInSight(), ([from, to]) => {
      pen.moveTo(...from);
      pen.lineTo(...to);
    }, () => pen.stroke());
  }

  // The ends of the streets that can be seen, on the screen.
  streetsInSight() {
    const { city, view } = this;
    const place = (node) => view.toScreen(city.node_x_m[node], city.node_y_m[node]);
    const found = city.street_from.map((node, k) => [place(node), place(city.street_to[k])]);
    return found.filter(([[x0, y0], [x1, y1]]) => Math.max(x0, x1) >= 0 && Math.min(x0, x1) <= view.width
      && Math.max(y0, y1) >= 0 && Math.min(y0, y1) <= view.height);
  }

  // Add the box of a building to a path.
  box(pen, building) {
    const { view } = this;
    const [west, south, east, north] = this.city.boxes[building];
    pen.rect(...view.toScreen(west, north), (east - west) * view.scale, (north - south) * view.scale);
  }

  // Add the outline of a building to a path, or its middle: the same, smaller.
  outline(pen, building, size = 1) {
    const { city, view } = this;
    const [left, top] = [view.width / 2 - view.x * view.scale, view.height / 2 + view.y * view.scale];
    const [x0, y0] = [city.center_x_m[building] * (1 - size), city.center_y_m[building] * (1 - size)];
    const end = city.outline_ptr[building + 1];
    for (let k = city.outline_ptr[building]; k < end; k += 1) {
      const x = (x0 + city.outline_x_m[k] * size) * view.scale + left;
      const y = top - (y0 + city.outline_y_m[k] * size) * view.scale;
      if (k === city.outline_ptr[building]) pen.moveTo(x, y);
      else pen.lineTo(x, y);
    }
    pen.closePath();
  }

  // The buildings that can be seen; `edges` are their outlines, in batches. Both are worked out once for a view.
  inSight() {
    const { view } = this;
    if (this.seenAt === view.version) return this.seen;
    const [west, north] = view.toCity(0, 0);
    const [east, south] = view.toCity(view.width, view.height);
    const found = [];
    this.city.boxes.forEach(([w, s, e, n], k) => {
      if (e >= west && w <= east && n >= south && s <= north) found.push(k);
    });
    this.edges = [];
    for (let from = 0; from < found.length && found.length <= MANY; from += BATCH) {
      const path = new Path2D();
      for (const building of found.slice(from, from + BATCH)) this.outline(path, building);
      this.edges.push(path);
    }
    Object.assign(this, { seenAt: view.version, seen: found });
    return found;
  }

  fill(row, building) {
    const { run, city } = this;
    const code = run.code(row, building);
    if (code === 0 && city.refuges.has(building)) return css(run.look.refuge);
    return css((run.look.codes[code] ?? run.look.codes[0])[1]);
  }

  // Fill buildings, those of one color at once.
  paint(pen, buildings, fillOf, size) {
    const byFill = new Map();
    for (const building of buildings) {
      const fill = fillOf(building);
      if (!byFill.has(fill)) byFill.set(fill, []);
      byFill.get(fill).push(building);
    }
    for (const [fill, those] of byFill) {
      pen.fillStyle = fill;
      const add = this.seen.length > MANY ? (one) => this.box(pen, one) : (one) => this.outline(pen, one, size);
      inBatches(pen, those, add, () => pen.fill());
    }
  }

  drawBuildings(pen, { row, kinds, differs }) {
    const { run, city, view, theme } = this;
    const sight = this.inSight();
    this.paint(pen, sight, (building) => this.fill(row, building));
    const many = sight.length > MANY;
    const heat = (building) => shadeOf(run.value("buildings.temperature", row, building), run.look);
    if (!many) this.paint(pen, sight.filter((one) => heat(one) > 0), (building) => shadeFill(heat(building)), CORE);
    const edge = (chosen, color, width) => {
      if (!chosen.length) return;
      pen.strokeStyle = color;
      pen.lineWidth = width;
      inBatches(pen, chosen, (building) => this.outline(pen, building), () => pen.stroke());
    };
    pen.strokeStyle = theme.edge;
    pen.lineWidth = Math.max(0.4, Math.min(1, view.scale * 0.3));
    for (const path of this.edges) pen.stroke(path);
    if (differs) {
      const color = css(seenOn(run.look.differs, theme.ground));
      const [numbers, codes] = [1, 2].map((much) => sight.filter((k) => differs[k] === much));
      const wide = Math.max(0.4, Math.min(1, view.scale / 1.6));
      if (!many) edge(numbers, color, 1.4 * wide);
      edge(codes, theme.casing, 5 * wide);
      edge(codes, color, 3 * wide);
    }
    if (kinds) {
      const chosen = sight.filter((k) => kinds.has(run.code(row, k)));
      edge(chosen, theme.casing, 4.5);
      edge(chosen, theme.ink, 2);
    }
    this.letter(pen, sight.filter((k) => city.refuges.has(k)));
    this.hydrants(pen);
  }

  letter(pen, refuges) {
    pen.font = "bold 12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    for (const building of refuges) {
      const at = this.view.toScreen(this.city.center_x_m[building], this.city.center_y_m[building]);
      pen.fillStyle = inkOn(this.run.look.refuge);
      pen.fillText("R", ...at);
    }
  }

  hydrants(pen) {
    const { city, view, theme } = this;
    const size = Math.max(4, Math.min(9, 3 * view.scale));
    pen.fillStyle = css(this.run.look.hydrant);
    pen.strokeStyle = theme.edge;
    pen.lineWidth = 0.8;
    city.hydrant_x_m.forEach((x, k) => {
      const [left, top] = view.toScreen(x, city.hydrant_y_m[k]);
      pen.fillRect(left - size / 2, top - size / 2, size, size);
      pen.strokeRect(left - size / 2, top - size / 2, size, size);
    });
  }

  // Jets of water to what is sprayed, dashed lines to where a brigade drives, a ring around each target.
  drawWays(pen, row, spots) {
    const { run, city, view, theme } = this;
    for (let k = 0; k < run.nBrigades; k += 1) {
      const target = run.target(row, k);
      if (target < 0) continue;
      const at = view.toScreen(city.center_x_m[target], city.center_y_m[target]);
      const name = run.activity(row, k)?.[0];
      if (name === "spraying") {
        drawJet(pen, spots[k], at, run.look, theme);
      } else if (name === "driving") {
        drawWay(pen, spots[k], at, theme);
      } else continue;
      this.ring(pen, at);
    }
  }

  ring(pen, [left, top]) {
    for (const [color, width] of [[this.theme.casing, 3.5], [this.theme.ink, 1.5]]) {
      pen.strokeStyle = color;
      pen.lineWidth = width;
      pen.beginPath();
      pen.arc(left, top, 5, 0, 2 * Math.PI);
      pen.stroke();
    }
  }

  drawCivilians(pen, row) {
    const { run, view } = this;
    civilianSpots(run, row, view).forEach(([left, top], k) => drawPerson(pen, left, top, run.look, run.health(row, k)));
  }

  drawBrigades(pen, row, spots) {
    const { run } = this;
    spots.forEach(([left, top], k) => {
      const rgb = run.activity(row, k)?.[1] ?? run.look.unknownBrigade;
      drawBall(pen, left, top, BRIGADE_RADIUS, rgb, String(k));
      const share = run.tankShare(row, k);
      if (Number.isNaN(share)) return;
      drawTank(pen, left + BRIGADE_RADIUS + 2, top - 9, [5, 18], share, run.look);
    });
  }

  drawSelected(pen, { row, selected }) {
    if (!selected) return;
    const { run, view, theme } = this;
    const path = () => {
      pen.beginPath();
      if (selected.kind === "building") this.outline(pen, selected.index);
      else {
        const spots = selected.kind === "brigade" ? brigadeSpots : civilianSpots;
        const radius = selected.kind === "brigade" ? BRIGADE_RADIUS + 4 : CIVILIAN_RADIUS + 4;
        const at = spots(run, row, view)[selected.index];
        if (at) pen.arc(...at, radius, 0, 2 * Math.PI);
      }
    };
    for (const [color, width] of [[theme.casing, 6], [theme.ink, 3]]) {
      path();
      pen.strokeStyle = color;
      pen.lineWidth = width;
      pen.stroke();
    }
  }

  // A bar of a round length, at the lower left.
  drawBar(pen) {
    const { view, theme } = this;
    const length = LENGTHS_M.findLast((one) => one * view.scale <= 140) ?? 1;
    const [x, y, wide] = [12, view.height - 12, length * view.scale];
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.textBaseline = "alphabetic";
    for (const [color, width] of [[theme.casing, 6], [theme.ink, 3]]) {
      pen.strokeStyle = color;
      pen.lineWidth = width;
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(x + wide, y);
      pen.stroke();
    }
    const text = length < 1000 ? `${length} m` : `${length / 1000} km`;
    pen.strokeStyle = theme.casing;
    pen.lineWidth = 4;
    pen.strokeText(text, x, y - 8);
    pen.fillStyle = theme.ink;
    pen.fillText(text, x, y - 8);
  }
}
