// MCAP, the log format of PlotJuggler and Foxglove: rows as JSON messages on /trace. https://mcap.dev/spec

const text = new TextEncoder();
const MAGIC = Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a);

/** Little-endian numbers, strings and bytes, one behind the other. */
function bytes(...parts) {
  const pieces = parts.map(part => {
    if (typeof part === "string") { const word = text.encode(part); return bytes([4, word.length], word); }
    if (part instanceof Uint8Array) return part;
    const [width, value] = part, view = new DataView(new ArrayBuffer(width));
    if (width === 8) view.setBigUint64(0, BigInt(value), true);
    if (width === 4) view.setUint32(0, value, true);
    if (width === 2) view.setUint16(0, value, true);
    return new Uint8Array(view.buffer);
  });
  const all = new Uint8Array(pieces.reduce((sum, piece) => sum + piece.length, 0));
  pieces.reduce((at, piece) => (all.set(piece, at), at + piece.length), 0);
  return all;
}
const record = (code, ...parts) => { const content = bytes(...parts); return bytes(Uint8Array.of(code), [8, content.length], content); };

/** A file of so many rows, each a time in s and values by the columns' names. */
export function mcap(columns, rows) {
  const schema = { type: "object", properties: Object.fromEntries(columns.map(name => [name, { type: "number" }])) };
  const parts = [MAGIC, record(1, "", "tractive live"), record(3, [2, 1], "tractive.Row", "jsonschema", bytes([4, JSON.stringify(schema).length], text.encode(JSON.stringify(schema)))),
    record(4, [2, 0], [2, 1], "/trace", "json", [4, 0])];
  let number = 0;
  for (const [t, values] of rows) {
    const ns = Math.round(t * 1e9), row = Object.fromEntries(columns.map((name, k) => [name, +values[k].toPrecision(7)]));
    parts.push(record(5, [2, 0], [4, number++], [8, ns], [8, ns], text.encode(JSON.stringify(row))));
  }
  parts.push(record(15, [4, 0]), record(2, [8, 0], [8, 0], [4, 0]), MAGIC);
  return new Blob(parts, { type: "application/octet-stream" });
}
