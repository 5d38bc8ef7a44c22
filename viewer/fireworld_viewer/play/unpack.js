// The data of the page: words, and columns of numbers as columns.py packs them.

export async function unpack(base64) {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("This browser is too old to unpack the run: it has no DecompressionStream. Any of 2023 or later has.");
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

export class Column {
  constructor([offset, rows, width, planes, digits, none], bytes) {
    Object.assign(this, { rows, width, digits, none, scale: 10 ** digits });
    this.whole = planes < 4 ? new Int32Array(rows * width) : new Float64Array(rows * width);
    const size = rows * width;
    for (let entry = 0; entry < width; entry += 1) {
      let sum = 0;
      for (let row = 0; row < rows; row += 1) {
        let folded = 0;
        for (let plane = planes - 1; plane >= 0; plane -= 1) {
          folded = folded * 256 + bytes[offset + plane * size + entry * rows + row];
        }
        sum += folded % 2 ? -(folded + 1) / 2 : folded / 2;
        this.whole[row * width + entry] = sum;
      }
    }
  }

  // A number; NaN where there is none.
  at(row, entry = 0) {
    const value = this.whole[row * this.width + entry];
    return value === this.none ? NaN : value / this.scale;
  }

  // The numbers of one entry over all rows.
  over(entry = 0) {
    return Array.from({ length: this.rows }, (_, row) => this.at(row, entry));
  }

  // The numbers of one row.
  row(row) {
    return Array.from({ length: this.width }, (_, entry) => this.at(row, entry));
  }
}
