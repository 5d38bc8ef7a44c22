// The city and the runs in it: what is asked of the columns by name.
import { css } from "./colour.js";

export class City {
  constructor(words, columns) {
    Object.assign(this, words);
    const list = (name) => (columns.has(`city.${name}`) ? columns.get(`city.${name}`).over() : []);
    for (const name of [
      "building_id", "floors", "material", "refuge_building", "outline_ptr", "outline_x_m", "outline_y_m",
      "center_x_m", "center_y_m", "node_x_m", "node_y_m", "street_from", "street_to", "hydrant_x_m", "hydrant_y_m",
      "civilian_x_m", "civilian_y_m", "civilian_building", "civilian_hp", "brigade_tank_litres", "ground_area_m2",
      "ignition_point",
    ]) this[name] = list(name);
    this.n = this.building_id.length;
    this.refuges = new Set(this.refuge_building);
    this.boxes = this.building_id.map((_, k) => this.box(k));
  }

  // West, south, east and north of a building.
  box(building) {
    const [from, to] = [this.outline_ptr[building], this.outline_ptr[building + 1]];
    const x = this.outline_x_m.slice(from, to);
    const y = this.outline_y_m.slice(from, to);
    return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
  }

  // Whether a place is within the outline of a building.
  holds(building, x, y) {
    const [west, south, east, north] = this.boxes[building];
    if (x < west || x > east || y < south || y > north) return false;
    const [from, to] = [this.outline_ptr[building], this.outline_ptr[building + 1]];
    let inside = false;
    for (let k = from, before = to - 1; k < to; before = k, k += 1) {
      const [x0, y0, x1, y1] = [
        this.outline_x_m[k], this.outline_y_m[k], this.outline_x_m[before], this.outline_y_m[before],
      ];
      if (y0 > y !== y1 > y && x < ((x1 - x0) * (y - y0)) / (y1 - y0) + x0) inside = !inside;
    }
    return inside;
  }
}

export class Run {
  constructor(index, words, columns, city, look) {
    Object.assign(this, words, { index, columns, city, look });
    this.letter = "AB"[index];
    this.steps = this.column("steps").over();
    this.codes = this.column("buildings.fieryness");
    this.nBrigades = this.column("brigades.x_m")?.width ?? 0;
    this.nCivilians = this.column("civilians.hp")?.width ?? 0;
    const [rows, kinds, who] = ["row", "kind", "entity"].map((name) => this.column(`events.${name}`).over());
    this.happened = this.events.map((text, k) => ({ row: rows[k], kind: kinds[k], entity: who[k], text }));
    this.eventsOf = this.steps.map(() => []);
    for (const one of this.happened) this.eventsOf[one.row].push(one);
  }

  column(name) {
    return this.columns.get(`${this.index}.${name}`);
  }

  // A number of a field; NaN where the log has none.
  value(name, row, entry = 0) {
    return this.column(name)?.at(row, entry) ?? NaN;
  }

  code(row, building) {
    return this.codes ? this.codes.at(row, building) : 0;
  }

  // Where a brigade is.
  brigadeAt(row, brigade) {
    return [this.value("brigades.x_m", row, brigade), this.value("brigades.y_m", row, brigade)];
  }

  civilianAt(row, civilian) {
    const x = this.value("civilians.x_m", row, civilian);
    if (!Number.isNaN(x)) return [x, this.value("civilians.y_m", row, civilian)];
    return [this.city.civilian_x_m[civilian], this.city.civilian_y_m[civilian]];
  }

  // The building that a brigade goes for; -1 none.
  target(row, brigade) {
    const found = this.value("decisions.target", row, brigade);
    return Number.isNaN(found) ? -1 : found;
  }

  // What a brigade does: [name, color]; null if the log does not have it.
  activity(row, brigade) {
    const code = this.value("brigades.activity", row, brigade);
    return Number.isNaN(code) ? null : this.look.activities[code] ?? [`activity ${code}`, this.look.unknownBrigade];
  }

  // The share of a tank that is full, 0 to 1; NaN if it is not known.
  tankShare(row, brigade) {
    const full = this.city.brigade_tank_litres[brigade];
    const share = this.value("brigades.tank_litres", row, brigade) / full;
    return full > 0 ? Math.min(1, Math.max(0, share)) : NaN;
  }

  // 0 well, 1 hurt, 2 dying, 3 dead: as the look orders the colors of health.
  health(row, civilian) {
    const hp = this.value("civilians.hp", row, civilian);
    const share = hp / Math.max(1, this.city.civilian_hp[civilian]);
    if (!(hp > 0)) return 3;
    return share >= 1 ? 0 : share >= 0.25 ? 1 : 2;
  }

  choiceWords(row, brigade) {
    return this.words ? this.words[this.value("decisions.words", row, brigade)] : "";
  }

  eventColor(kind) {
    return css(this.eventRgb[kind] ?? [128, 128, 128]);
  }

  eventName(kind) {
    return this.look.events[kind]?.[0] ?? `kind ${kind}`;
  }
}
