// What lies at a place of a map, and its values as words.
import { HEALTH } from "./glyphs.js";
import { NOT_RECORDED, shown } from "./numbers.js";
import { BRIGADE_RADIUS, CIVILIAN_RADIUS, brigadeSpots, civilianSpots } from "./spots.js";

// {kind, index} of what is at a place of the screen; null where nothing is.
export function pick(run, row, view, left, top) {
  const nearest = (spots, reach) => {
    const away = spots.map((at) => Math.hypot(at[0] - left, at[1] - top));
    const best = away.indexOf(Math.min(...away));
    return away[best] <= reach ? best : -1;
  };
  const brigade = nearest(brigadeSpots(run, row, view), BRIGADE_RADIUS + 3);
  if (brigade >= 0) return { kind: "brigade", index: brigade };
  const civilian = nearest(civilianSpots(run, row, view), CIVILIAN_RADIUS + 3);
  if (civilian >= 0) return { kind: "civilian", index: civilian };
  const [x, y] = view.toCity(left, top);
  for (let k = 0; k < run.city.n; k += 1) if (run.city.holds(k, x, y)) return { kind: "building", index: k };
  return null;
}

export function nameOf({ kind, index }, city) {
  return `${kind} ${kind === "building" ? city.building_id[index] : index}`;
}

// The curves of a thing's history: [label, field, digits, factor].
export const HISTORIES = {
  building: [
    ["temperature, ° above ambient", "buildings.temperature", 1, 1],
    ["fuel left, %", "buildings.fuel_share", 1, 100],
    ["water on it, litres", "buildings.water_litres", 0, 1],
  ],
  brigade: [
    ["water in the tank, litres", "brigades.tank_litres", 0, 1],
    ["sprayed in the step, litres", "brigades.sprayed_litres", 0, 1],
    ["health points", "brigades.hp", 0, 1],
  ],
  civilian: [["health points", "civilians.hp", 0, 1]],
};

// The values of a thing at a row: [label, text], those that change first.
export function valuesOf(run, row, thing) {
  return { building: ofBuilding, brigade: ofBrigade, civilian: ofCivilian }[thing.kind](run, row, thing.index);
}

function measured(run, row, kind, index) {
  return HISTORIES[kind].map(([label, field, digits, factor]) => {
    const value = run.value(field, row, index);
    return [label, Number.isNaN(value) ? NOT_RECORDED : shown(value * factor, digits)];
  });
}

function ofBuilding(run, row, index) {
  const { city, look } = run;
  const code = run.code(row, index);
  const state = run.codes ? [["state", `${look.codes[code]?.[0] ?? "code"} (${code})`]] : [];
  const still = [];
  if (city.floors.length) still.push(["floors", shown(city.floors[index])]);
  if (city.material.length) still.push(["built of", look.materials[city.material[index]] ?? NOT_RECORDED]);
  if (city.ground_area_m2.length) still.push(["ground, m²", shown(city.ground_area_m2[index])]);
  if (city.ignition_point.length) still.push(["ignites at, ° above ambient", shown(city.ignition_point[index])]);
  if (city.refuges.has(index)) still.push(["is", "a refuge"]);
  return [...state, ...measured(run, row, "building", index), ...still];
}

function ofBrigade(run, row, index) {
  const activity = run.activity(row, index);
  const full = run.city.brigade_tank_litres[index];
  return [
    ["does", activity ? activity[0] : NOT_RECORDED],
    ...measured(run, row, "brigade", index),
    ...(full > 0 ? [["full tank, litres", shown(full)]] : []),
    ...(run.words ? [["chose", run.choiceWords(row, index) || "nothing yet"]] : []),
  ];
}

function ofCivilian(run, row, index) {
  const { city } = run;
  const building = city.civilian_building[index];
  const buried = run.value("civilians.buriedness", row, index);
  return [
    ["is", HEALTH[run.health(row, index)]],
    ...measured(run, row, "civilian", index),
    ["at the start", shown(city.civilian_hp[index])],
    ...(Number.isNaN(buried) ? [] : [["buried", shown(buried)]]),
    ["started", building >= 0 ? `in building ${city.building_id[building]}` : "outdoors"],
  ];
}
