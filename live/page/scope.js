// The scope: what the bench has told lately, and the plots of it.

const HELD_S = 10; // what the scope holds
const MOST_EDGES = 12_000; // more than these are a band
const NAMES = ["off", "async", "sync 15", "sync 12", "mid 7", "mid 3", "square"];
export const modeName = code => NAMES[code] ?? "";
export const WINDOWS = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];

/** Rows and edges of the last seconds, in rings. */
export class Memory {
  constructor(columns, step) {
    this.columns = columns;
    this.step = step;
    this.size = Math.round(HELD_S / step);
    this.of = Object.fromEntries(columns.map(name => [name, new Float32Array(this.size)]));
    this.count = 0; // rows so far; row k is that of time k·step
    this.edgeTimes = [];
    this.edgeStates = []; // gates that are on behind each edge, a bit each
    this.state = 0;
  }
  get end() { return (this.count - 1) * this.step; }
  get begin() { return Math.max(0, this.count - this.size) * this.step; }
  put(from, rows, edges) {
    const width = this.columns.length, n = rows.length / width;
    if (n > 0) this.count = Math.max(this.count, Math.round(from / this.step));
    for (let k = 0; k < n; k++) {
      const at = this.count % this.size;
      for (let c = 0; c < width; c++) this.of[this.columns[c]][at] = rows[k * width + c];
      this.count += 1;
    }
    for (let k = 0; k < edges.length; k += 2) {
      const gate = edges[k + 1] & 7;
      this.state = edges[k + 1] & 8 ? this.state | 1 << gate : this.state & ~(1 << gate);
      this.edgeTimes.push(edges[k]);
      this.edgeStates.push(this.state);
    }
    if (this.edgeTimes.length > 250_000) {
      const gone = this.edgeAfter(this.begin);
      this.edgeTimes.splice(0, gone);
      this.edgeStates.splice(0, gone);
    }
  }
  value(name, row) { return this.of[name][((row % this.size) + this.size) % this.size]; }
  last(name) { return this.count ? this.value(name, this.count - 1) : 0; }
  /** Mean over the last seconds. */
  mean(name, seconds) {
    const n = Math.max(1, Math.min(this.count, Math.round(seconds / this.step)));
    let sum = 0;
    for (let k = this.count - n; k < this.count; k++) sum += this.value(name, k);
    return sum / n;
  }
  peak(name, seconds) {
    const n = Math.max(1, Math.min(this.count, Math.round(seconds / this.step)));
    let most = 0;
    for (let k = this.count - n; k < this.count; k++) most = Math.max(most, Math.abs(this.value(name, k)));
    return most;
  }
  edgeAfter(time) {
    let low = 0, high = this.edgeTimes.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.edgeTimes[middle] <= time) low = middle + 1; else high = middle;
    }
    return low;
  }
  /** Rows of a window for so many pixels: each, or the least and the most of each pixel. */
  window(names, from, to, pixels) {
    const first = Math.max(Math.ceil(from / this.step), this.count - this.size, 0);
    const last = Math.min(Math.floor(to / this.step), this.count - 1);
    const n = Math.max(0, last - first + 1), x = [], y = names.map(() => []);
    if (n <= 2 * pixels) {
      for (let k = first; k <= last; k++) {
        x.push(k * this.step);
        names.forEach((name, s) => y[s].push(this.value(name, k)));
      }
      return [x, ...y];
    }
    const rows = Math.ceil(n / pixels), origin = Math.floor(first / rows) * rows;
    for (let begin = origin; begin <= last; begin += rows) {
      const a = Math.max(begin, first), b = Math.min(begin + rows - 1, last);
      x.push(a * this.step, (a + 0.5 * (b - a)) * this.step);
      names.forEach((name, s) => {
        const ring = this.of[name], size = this.size;
        let low = Infinity, high = -Infinity, at = a % size;
        for (let k = a; k <= b; k++) {
          const value = ring[at];
          if (value < low) low = value;
          if (value > high) high = value;
          if (++at === size) at = 0;
        }
        y[s].push(low, high);
      });
    }
    return [x, ...y];
  }
  csv() {
    const first = Math.max(0, this.count - this.size), parts = [`t_s,${this.columns.join(",")}\n`];
    for (let begin = first; begin < this.count; begin += 5000) {
      let text = "";
      for (let k = begin; k < Math.min(begin + 5000, this.count); k++) {
        text += +(k * this.step).toFixed(9);
        for (const name of this.columns) text += "," + +this.value(name, k).toPrecision(7);
        text += "\n";
      }
      parts.push(text);
    }
    return new Blob(parts, { type: "text/csv" });
  }
}

const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** The plots, one below the other, with their series: column, name, colour, dashes. */
const PLOTS = [
  { title: "Phase currents, A", height: 196, least: 20, series: [["ia", "u", "--u"], ["ib", "v", "--v"], ["ic", "w", "--w"]] },
  { title: "Torque, N·m", height: 140, least: 50, series: [["te", "T", "--torque"], ["teRef", "T*", "--ref", [5, 4]]] },
  { title: "Speed, r/min", height: 92, least: 50, series: [["speed", "n", "--speed"]] },
  { title: "Link voltage, V", height: 92, least: 50, series: [["udc", "U", "--link"]] },
  { title: "Gates and mode", height: 132, gates: true, series: [] },
];

/** Ends of an axis that hold still: they move when they must. */
class Range {
  constructor(least) { this.least = least; this.low = 0; this.high = 0; this.since = 0; }
  of(low, high) {
    if (!Number.isFinite(low)) [low, high] = [0, 0];
    const room = Math.max(0.06 * (high - low), 0.25 * this.least);
    const now = performance.now(), fits = low >= this.low && high <= this.high && this.high > this.low;
    const loose = high - low + 2 * room < 0.6 * (this.high - this.low);
    if (!loose) this.since = now;
    if (!fits || now - this.since > 700) {
      const step = nice(Math.max(high - low, this.least) / 8);
      this.low = Math.floor((low - room) / step) * step;
      this.high = Math.ceil((high + room) / step) * step;
      this.since = now;
    }
    return [this.low, this.high];
  }
}
function nice(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  return decade * ([1, 2, 5, 10].find(step => step * decade >= value) ?? 10);
}

export class Scope {
  constructor(host, memory) {
    this.host = host;
    this.memory = memory;
    this.window = 0.1;
    this.paused = false;
    this.trigger = "";
    this.shown = [0, 0.1];
    this.held = null; // a window that was zoomed to
    this.triggered = -1;
    this.build();
    new ResizeObserver(() => this.resize()).observe(host);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.build());
  }
  reset(memory) { this.memory = memory; this.held = null; this.triggered = -1; }
  width() { return Math.max(200, this.host.clientWidth); }
  /** Lower on a phone, so that controls are near. */
  height(plot) { return Math.round(plot.height * (this.width() < 500 && !plot.gates ? 0.78 : 1)); }
  resize() {
    if (this.plots[0].width !== this.width()) this.plots.forEach((plot, k) => plot.setSize({ width: this.width(), height: this.height(PLOTS[k]) }));
  }
  build() {
    this.plots?.forEach(plot => plot.destroy());
    this.plots = PLOTS.map((plot, k) => this.plot(plot, k === PLOTS.length - 1));
  }
  plot(plot, isLast) {
    const font = "12px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
    const axis = { stroke: css("--muted"), font, grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--line"), width: 1, size: 4 } };
    const range = new Range(plot.least ?? 1);
    const time = (u, ticks) => ticks.map(t => label(t, this.shown[1] - this.shown[0]));
    const options = {
      title: plot.title, width: this.width(), height: this.height(plot), pxAlign: 0,
      padding: [8, 8, 0, 0],
      cursor: { sync: { key: "scope" }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
      legend: { show: !plot.gates, live: true },
      scales: { x: { time: false, range: () => this.shown }, y: plot.gates ? { range: () => [0, 4] } : { range: (u, low, high) => range.of(low, high) } },
      axes: [
        { ...axis, size: isLast ? 30 : 6, values: isLast ? time : (u, ticks) => ticks.map(() => ""), space: 70 },
        { ...axis, size: 54, space: 26, ...(plot.gates ? { splits: () => [0.5, 1.5, 2.5, 3.5], values: () => ["mode", "w", "v", "u"] } : {}) },
      ],
      series: [
        { label: "t", value: (u, t) => (t == null ? "" : `${(t * 1e3).toFixed(2)} ms`) },
        ...plot.series.map(([, name, colour, dash]) => ({
          label: name, stroke: css(colour), width: 1.4, dash, points: { show: false },
          value: (u, value) => (value == null ? "" : value.toPrecision(4)),
        })),
        ...(plot.gates ? [{ show: true, stroke: "transparent", points: { show: false } }] : []),
      ],
      hooks: {
        setSelect: [u => this.select(u)],
        draw: plot.gates ? [u => this.gates(u)] : [],
      },
    };
    const made = new uPlot(options, [[], ...options.series.slice(1).map(() => [])], this.host);
    made.over.addEventListener("dblclick", () => { this.held = null; this.onzoom?.(); });
    return made;
  }
  select(u) {
    if (u.select.width < 4) return;
    const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    if (to - from > 2 * this.memory.step) {
      this.held = [from, to];
      this.paused = true;
      this.onzoom?.();
    }
  }
  /** The window that is shown now. */
  view() {
    const { memory } = this;
    if (this.held) return this.held;
    if (this.paused && this.shown[1] <= memory.end) return [this.shown[1] - this.window, this.shown[1]];
    if (this.trigger) {
      const at = this.find();
      if (at >= 0) this.triggered = at;
      if (this.triggered >= memory.begin) return [this.triggered - 0.2 * this.window, this.triggered + 0.8 * this.window];
    }
    return [memory.end - this.window, memory.end];
  }
  /** Time of the newest event of the trigger whose window is complete; −1 where there is none. */
  find() {
    const { memory, trigger } = this;
    const newest = memory.count - 1 - Math.ceil(0.8 * this.window / memory.step);
    const oldest = Math.max(memory.count - memory.size + 2, newest - Math.ceil((2 * this.window + 0.2) / memory.step), 1);
    for (let k = newest; k >= oldest; k--) {
      const now = name => memory.value(name, k), before = name => memory.value(name, k - 1);
      const hit = {
        ia: () => before("ia") < 0 && now("ia") >= 0,
        te: () => Math.abs(now("teRef") - memory.value("teRef", k - 20)) > 20 && Math.abs(before("teRef") - memory.value("teRef", k - 21)) <= 20,
        mode: () => now("mode") !== before("mode"),
        fault: () => now("mode") === 0 && before("mode") !== 0,
      }[trigger];
      if (hit()) return k * memory.step;
    }
    return -1;
  }
  draw() {
    const pixels = Math.round(0.75 * this.width());
    this.shown = this.view();
    const [from, to] = this.shown;
    PLOTS.forEach((plot, k) => {
      const names = plot.series.map(([column]) => column);
      this.plots[k].setData(plot.gates ? [[from, to], [0, 0]] : this.memory.window(names, from, to, pixels));
    });
  }
  /** Lanes of the three legs, and the mode below. */
  gates(u) {
    const { ctx } = u, { memory } = this, ratio = devicePixelRatio || 1;
    const [from, to] = this.shown, x = t => u.valToPos(t, "x", true), y = v => u.valToPos(v, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    ctx.lineWidth = 1.3 * ratio;
    lanes(ctx, memory, from, to, t => x(Math.min(Math.max(t, from), to)), (leg, level) => y(3.15 - leg + 0.7 * level), ["--u", "--v", "--w"].map(css));
    this.modes(ctx, from, to, x, y, ratio);
    ctx.restore();
  }
  modes(ctx, from, to, x, y, ratio) {
    const { memory } = this;
    const first = Math.max(Math.ceil(from / memory.step), memory.count - memory.size, 0), last = Math.min(Math.floor(to / memory.step), memory.count - 1);
    ctx.font = `${12 * ratio}px system-ui, 'DejaVu Sans', sans-serif`;
    ctx.textBaseline = "middle";
    ctx.textAlign = "left";
    let begin = first, even = false;
    for (let k = first; k <= last; k++) {
      const mode = memory.value("mode", k);
      if (k < last && memory.value("mode", k + 1) === mode) continue;
      const left = x(begin * memory.step), right = x((k + 1) * memory.step);
      ctx.fillStyle = css(even ? "--press" : "--line");
      ctx.fillRect(left, y(0.9), right - left, y(0.1) - y(0.9));
      ctx.fillStyle = css("--text");
      const name = modeName(mode), width = ctx.measureText(name).width;
      if (right - left > width + 8) ctx.fillText(name, Math.max(left, x(from)) + 5, y(0.48));
      begin = k + 1;
      even = !even;
    }
  }
}

/** The legs' levels as steps: 1 upper device on, 0 lower, ½ none. */
export function lanes(ctx, memory, from, to, x, y, colours) {
  const first = memory.edgeAfter(from), last = memory.edgeAfter(to);
  const level = (state, leg) => (state >> (2 * leg) & 1 ? 1 : state >> (2 * leg + 1) & 1 ? 0 : 0.5);
  for (let leg = 0; leg < 3; leg++) {
    ctx.strokeStyle = ctx.fillStyle = colours[leg];
    if (last - first > MOST_EDGES) {
      ctx.globalAlpha = 0.4;
      ctx.fillRect(x(from), y(leg, 1), x(memory.end) - x(from), y(leg, 0) - y(leg, 1));
      ctx.globalAlpha = 1;
      continue;
    }
    ctx.beginPath();
    let now = level(first > 0 ? memory.edgeStates[first - 1] : 0, leg);
    ctx.moveTo(x(from), y(leg, now));
    for (let k = first; k < last; k++) {
      const next = level(memory.edgeStates[k], leg);
      if (next === now) continue;
      const px = x(memory.edgeTimes[k]);
      ctx.lineTo(px, y(leg, now));
      ctx.lineTo(px, y(leg, next));
      now = next;
    }
    ctx.lineTo(x(Math.min(to, Math.max(from, memory.end))), y(leg, now));
    ctx.stroke();
  }
}

function label(t, span) {
  if (span < 0.5) return `${+(t * 1e3).toFixed(span < 0.01 ? 2 : 1)} ms`;
  return `${+t.toFixed(2)} s`;
}
