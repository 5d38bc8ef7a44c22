// Where brigades and civilians are drawn: those on one spot side by side, in pixels.

const ABREAST = 8;

export const BRIGADE_RADIUS = 9;
export const CIVILIAN_RADIUS = 5;
const BRIGADE_APART = [28, 21];
const CIVILIAN_APART = [11, 11];

// Move to the right what would cover something of a lower number, into a row below where a row is full.
function sideBySide(places, [wide, high]) {
  const placed = [];
  for (const [left, top] of places) {
    let at = [left, top];
    for (let tries = 0; tries < 4 * places.length; tries += 1) {
      const [x, y] = at;
      const covers = placed.filter((one) => Math.abs(one[0] - x) < wide - 0.1 && Math.abs(one[1] - y) < high - 0.1);
      if (!covers.length) break;
      at = [Math.max(...covers.map((one) => one[0])) + wide, at[1]];
      if (at[0] > left + (ABREAST - 0.5) * wide) at = [left, at[1] + high];
    }
    placed.push(at);
  }
  return placed;
}

export function brigadeSpots(run, row, view) {
  const places = Array.from({ length: run.nBrigades }, (_, k) => view.toScreen(...run.brigadeAt(row, k)));
  return sideBySide(places, BRIGADE_APART);
}

export function civilianSpots(run, row, view) {
  const places = Array.from({ length: run.nCivilians }, (_, k) => view.toScreen(...run.civilianAt(row, k)));
  return sideBySide(places, CIVILIAN_APART);
}
