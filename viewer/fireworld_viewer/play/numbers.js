// Numbers as text, and text in its place.

export const NOT_RECORDED = "not recorded";

const FORMATS = [];

export function shown(value, digits = 0) {
  if (value === null || value === undefined || Number.isNaN(value)) return "none";
  FORMATS[digits] ??= new Intl.NumberFormat("en-US", { minimumFractionDigits: digits, maximumFractionDigits: digits });
  const text = FORMATS[digits].format(value);
  return /^-[0.,]*$/.test(text) ? text.slice(1) : text;
}

// Set the text of an element, if it is another than before: what does not change is not laid out again.
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function counted(n, noun) {
  return `${shown(n)} ${noun}${n === 1 ? "" : "s"}`;
}

// Round numbers from low to high, about as many as there is room for.
export function ticks(low, high, room) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const rough = span / Math.max(1, room);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= rough * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) found.push(k * step);
  return found;
}

export function brief(value) {
  const size = Math.abs(value);
  if (size >= 1e6) return `${+(value / 1e6).toPrecision(3)}M`;
  if (size >= 1e4) return `${+(value / 1e3).toPrecision(3)}k`;
  return `${+value.toPrecision(6)}`;
}
