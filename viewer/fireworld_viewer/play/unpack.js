// The data of the page: words, and columns of numbers as columns.py packs them.

export async function unpack(base64) {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("This browser is too old to unpack the run; any of 2023 or later can.");
  }
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k += 1) packed[k] = text.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const words = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  return { words, columns: new Columns(words.columns, bytes.subarray(4 + length)) };
}

export class Columns {
  constructor(table, bytes) {
    this.table = table;
    this.bytes = bytes;
    this.known = new Map();
  }

  has(name) {
    return name in this.table;
  }

  // The column of a name; null if the log does not have it.
  get(name) {
    if (!this.has(name)) return null;
    if (!this.known.has(name)) this.known.set(name, new Column(this.table[name], this.bytes));
    return this.known.get(name);
  }
}

// The numbers of each entry, a building say, lie one after another: row by row.
export class Column {
  constructor([offset, rows, width, planes, digits, none], bytes) {
    Object.assign(this, { rows, width, digits, none, scale: 10 ** digits });
    const size = rows * width;
    this.whole = planes < 4 ? new Int32Array(size) : new Float64Array(size);
    const [low, high] = [0, 1].map((plane) => bytes.subarray(offset + plane * size, offset + (plane + 1) * size));
    let sum = 0;
    for (let k = 0; k < size; k += 1) {
      if (k % rows === 0) sum = 0;
      let folded = planes > 1 ? low[k] + 256 * high[k] : low[k];
      for (let plane = 2; plane < planes; plane += 1) folded += bytes[offset + plane * size + k] * 256 ** plane;
      if (folded) sum += folded % 2 ? -(folded + 1) / 2 : folded / 2;
      this.whole[k] = sum;
    }
  }

  // A number as a whole one of its last digit.
  wholeAt(row, entry = 0) {
    return this.whole[entry * this.rows + row];
  }

  // A number; NaN where there is none.
  at(row, entry = 0) {
    const value = this.wholeAt(row, entry);
    return value === this.none ? NaN : value / this.scale;
  }

  // The numbers of one entry over all rows.
  over(entry = 0) {
    return Array.from({ length: this.rows }, (_, row) => this.at(row, entry));
  }

  // The different whole numbers that there are, rising.
  occurring() {
    const found = new Set();
    const { whole } = this;
    for (let k = 0; k < whole.length; k += 1) if (k === 0 || whole[k] !== whole[k - 1]) found.add(whole[k]);
    return [...found].sort((a, b) => a - b);
  }
}
