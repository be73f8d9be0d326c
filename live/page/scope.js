// The scope: what the bench has told lately, and the plots of it.

const HELD_S = 10; // what the scope holds
const MOST_EDGES = 12_000; // more than these are a band
export const WINDOWS = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];

/** Rows and edges of the last seconds, in rings. */
export class Memory {
  constructor(columns, step, system, size = Math.round(HELD_S / step)) {
    this.columns = columns;
    this.step = step;
    this.system = system;
    this.size = Math.max(size, 2);
    this.of = Object.fromEntries(columns.map(name => [name, new Float32Array(this.size)]));
    this.count = 0; // rows so far; row k is that of time k·step
    this.edgeTimes = [];
    this.edgeStates = []; // gates that are on behind each edge, a bit each
    this.state = 0;
    this.edgesFrom = 0; // edges before this are not known
  }
  has(name) { return name in this.of; }
  modeName(code) { return this.system.modes[code] ?? ""; }
  get end() { return (this.count - 1) * this.step; }
  get begin() { return Math.max(0, this.count - this.size) * this.step; }
  put(from, rows, edges) {
    const width = this.columns.length, n = rows.length / width;
    if (n > 0) this.count = Math.max(this.count, Math.round(from / this.step));
    this.columns.forEach((name, column) => {
      const ring = this.of[name];
      for (let from = column, at = this.count % this.size; from < rows.length; from += width) {
        ring[at] = rows[from];
        if (++at === this.size) at = 0;
      }
    });
    this.count += n;
    // A gap: what came before it says nothing of what comes after.
    if (edges.length && this.edgeTimes.length && edges[0] - this.edgeTimes[this.edgeTimes.length - 1] > 0.05 && this.system.cycle) {
      [this.edgeTimes, this.edgeStates, this.edgesFrom] = [[], [], edges[0]];
    }
    for (let k = 0; k < edges.length; k += 2) {
      const gate = edges[k + 1] & 15;
      this.state = edges[k + 1] & 16 ? this.state | 1 << gate : this.state & ~(1 << gate);
      this.edgeTimes.push(edges[k]);
      this.edgeStates.push(this.state);
    }
    if (this.edgeTimes.length > 250_000) {
      const gone = this.edgeAfter(this.begin);
      this.edgeTimes.splice(0, gone);
      this.edgeStates.splice(0, gone);
    }
  }
  value(name, row) { return this.of[name]?.[((row % this.size) + this.size) % this.size] ?? NaN; }
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
  /** All that is held, as a time and values. */
  * rows() {
    for (let k = Math.max(0, this.count - this.size); k < this.count; k++) yield [k * this.step, this.columns.map(name => this.value(name, k))];
  }
  /** Line voltage over the link in a window: each step, or the least and the most of each pixel. */
  lineVoltage(share, from, to, pixels) {
    const first = Math.max(this.edgeAfter(from), this.edgeAfter(to) - 60_000), last = this.edgeAfter(to), x = [], y = [], current = [0, 0, 0, 1];
    const largest = this.has("ia") ? Math.max(this.peak("ia", 0.02), 10) : 1;
    const volts = (state, t) => {
      const row = Math.min(Math.max(Math.round(t / this.step), 0), this.count - 1);
      if (this.has("ia")) ["ia", "ib", "ic"].forEach((name, k) => (current[k] = this.value(name, row)));
      current[3] = largest;
      const value = share(state, current) * this.value("udc", row);
      return Number.isNaN(value) ? null : value;
    };
    const width = (to - from) / pixels, dense = last - first > 2 * pixels;
    let now = volts(first > 0 ? this.edgeStates[first - 1] : 0, from), low = now, high = now, until = from + width;
    const put = (t, value) => { x.push(t); y.push(value); };
    put(Math.max(from, this.edgesFrom), now);
    // Of a leg whose gates are off the diodes decide, which needs no edge.
    const drift = (state, begin, end) => {
      if (!this.system.isFree(state)) return;
      for (let t = begin, step = Math.max(width, this.step); t < end; t += step) {
        const next = volts(state, t);
        if (next !== now) { put(t, now); put(t, next); now = low = high = next; }
      }
    };
    for (let k = first; k < last; k++) {
      const t = this.edgeTimes[k], next = volts(this.edgeStates[k], t);
      drift(k > 0 ? this.edgeStates[k - 1] : 0, k > first ? this.edgeTimes[k - 1] : from, t);
      if (dense) {
        low = Math.min(low ?? 0, next ?? 0); high = Math.max(high ?? 0, next ?? 0);
        if (t >= until) { put(t, low); put(t, high); low = high = next; until = t + width; }
      } else if (next !== now) { put(t, now); put(t, next); }
      now = next;
    }
    const end = Math.min(to, Math.max(this.end, from));
    drift(last > 0 ? this.edgeStates[last - 1] : 0, last > first ? this.edgeTimes[last - 1] : from, end);
    put(end, now);
    return [x, y];
  }
}

/** A number as the text of this project writes it: 1,500 or −20. */
export const told = value => FORMAT.format(value).replace("-", "−");
const FORMAT = new Intl.NumberFormat("en", { maximumSignificantDigits: 6 });
export const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

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
    this.largest = 1000;
    this.build();
    new ResizeObserver(() => this.resize()).observe(host);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.build());
  }
  reset(memory) { this.memory = memory; this.held = null; this.triggered = -1; this.build(); }
  width() { return Math.max(200, this.host.clientWidth); }
  /** Lower on a phone, so that controls are near. */
  height(plot) { return Math.round(plot.height * (this.width() < 500 && !plot.gates ? 0.78 : 1)); }
  resize() {
    const width = this.width();
    // Each by itself: a scroll bar may have come and gone while they were made.
    this.plots.forEach((plot, k) => { if (plot.width !== width) plot.setSize({ width, height: this.height(this.list[k]) }); });
  }
  /** The plots of what the memory has: those of gates where edges come, the others where a column is there. */
  build() {
    this.plots?.forEach(plot => plot.destroy());
    const { memory } = this, known = ([column]) => memory.has(column);
    this.list = memory.system.plots
      .filter(plot => (plot.lines ? memory.hasEdges : plot.gates ? memory.has("mode") : plot.series.some(known)))
      .map(plot => (plot.series ? { ...plot, series: plot.series.filter(known) } : { ...plot, series: plot.lines.map(([name, colour]) => ["", name, colour]) }))
      .map(plot => (plot.gates && !memory.hasEdges ? { ...plot, title: plot.title.replace("Gates and m", "M").replace("Gates and s", "S"), height: 70 } : plot));
    this.plots = this.list.map((plot, k) => this.plot(plot, k === this.list.length - 1));
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
      scales: { x: { time: false, range: () => this.shown }, y: plot.gates ? { range: () => [0, this.lanes() + 1] } : { range: (u, low, high) => range.of(low, high) } },
      axes: [
        { ...axis, size: isLast ? 30 : 6, values: isLast ? time : (u, ticks) => ticks.map(() => ""), space: 70 },
        { ...axis, size: 58, space: plot.height < 100 ? 18 : 26, values: (u, ticks) => ticks.map(told), ...(plot.gates ? { splits: () => Array.from({ length: this.lanes() + 1 }, (_, k) => k + 0.5), values: () => [...(this.lanes() ? [this.memory.system.id === "zs9" ? "scheme" : "mode", ...this.memory.system.lanes.map(lane => lane.name).reverse()] : [""])], space: 1 } : {}) },
      ],
      series: [
        { label: "t", value: (u, t) => (t == null ? "" : `${(t * 1e3).toFixed(2)} ms`) },
        ...plot.series.map(([, name, colour, dash]) => ({
          label: name, stroke: css(colour), width: 1.4, dash, points: { show: false },
          value: (u, value) => (value == null || Number.isNaN(value) ? "" : told(+value.toPrecision(4))),
        })),
        ...(plot.gates ? [{ show: true, stroke: "transparent", points: { show: false } }] : []),
      ],
      hooks: {
        setSelect: [u => this.select(u)],
        draw: plot.gates ? [u => this.gates(u)] : [],
      },
    };
    // Where title and names do not fit into one row, the names have one of their own.
    const narrow = innerWidth < 620, room = narrow ? 46 : 92; // of a name with its value, which a narrow window does not show
    const names = options.series.reduce((sum, { label = "" }, k) => sum + (k || !narrow ? 8 * label.length + room : 0), 0);
    if (!plot.gates && 7 * plot.title.length + 66 + names > this.width()) options.class = "two-rows";
    const made = new uPlot(options, [[], ...options.series.slice(1).map(() => [])], this.host);
    made.over.addEventListener("dblclick", () => { this.held = null; this.onzoom?.(); });
    return made;
  }
  lanes() { return this.memory.hasEdges ? this.memory.system.lanes.length : 0; }
  select(u) {
    if (u.select.width < 4) return;
    const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    this.hold(from, to);
  }
  /** Shows a part of what is held, and stands still. */
  hold(from, to) {
    if (to - from <= 2 * this.memory.step) return;
    this.held = [from, to];
    this.paused = true;
    this.onzoom?.();
  }
  /** Closer or wider about the middle, and earlier or later by a share of the window. */
  move(by, later = 0) {
    const [from, to] = this.shown, middle = 0.5 * (from + to) + later * (to - from), half = 0.5 * by * (to - from);
    this.hold(middle - half, middle + half);
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
    const stepped = 0.015 * this.largest;
    for (let k = newest; k >= oldest; k--) {
      const now = name => memory.value(name, k), before = name => memory.value(name, k - 1);
      const steps = name => memory.has(name) && Math.abs(now(name) - memory.value(name, k - 20)) > stepped && Math.abs(before(name) - memory.value(name, k - 21)) <= stepped;
      const hit = {
        te: () => steps("teRef") || steps("teRef1") || steps("teRef2"),
        mode: () => now("mode") !== before("mode"),
        fault: () => (memory.has("trip") ? now("trip") > before("trip") : now("mode") === 0 && before("mode") !== 0),
      }[trigger] ?? (() => before(trigger) < 0 && now(trigger) >= 0);
      if (hit()) return k * memory.step;
    }
    return -1;
  }
  draw() {
    const pixels = Math.round(0.75 * this.width());
    this.shown = this.view();
    const [from, to] = this.shown;
    this.list.forEach((plot, k) => {
      const names = plot.series.map(([column]) => column);
      this.plots[k].setData(plot.gates ? [[from, to], [0, 0]] : plot.lines ? this.voltages(plot.lines, from, to, pixels) : this.memory.window(names, from, to, pixels));
    });
  }
  voltages(lines, from, to, pixels) {
    return uPlot.join(lines.map(([, , share]) => this.memory.lineVoltage(share, from, to, pixels)).map(pathOnce));
  }
  /** Lanes of the gates, and the mode below. */
  gates(u) {
    const { ctx } = u, { memory } = this, ratio = devicePixelRatio || 1;
    const [from, to] = this.shown, x = t => u.valToPos(t, "x", true), y = v => u.valToPos(v, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    ctx.lineWidth = 1.3 * ratio;
    const most = this.lanes();
    if (most) lanes(ctx, memory, from, to, t => x(Math.min(Math.max(t, from), to)), (lane, level) => y(most + 0.15 - lane + 0.7 * level));
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
      const name = memory.modeName(mode), width = ctx.measureText(name).width;
      if (right - left > width + 8) ctx.fillText(name, Math.max(left, x(from)) + 5, y(0.48));
      begin = k + 1;
      even = !even;
    }
  }
}

/** The gates' levels as steps: 1 on, 0 off; of a leg 1 the upper device on, 0 the lower, ½ none. */
export function lanes(ctx, memory, from, to, x, y) {
  const known = Math.max(from, memory.edgesFrom), first = memory.edgeAfter(known), last = memory.edgeAfter(to);
  memory.system.lanes.forEach(({ colour, level }, lane) => {
    ctx.strokeStyle = ctx.fillStyle = css(colour);
    if (last - first > MOST_EDGES) {
      ctx.globalAlpha = 0.4;
      ctx.fillRect(x(known), y(lane, 1), x(Math.min(to, memory.end)) - x(known), y(lane, 0) - y(lane, 1));
      ctx.globalAlpha = 1;
      return;
    }
    ctx.beginPath();
    let now = level(first > 0 ? memory.edgeStates[first - 1] : 0, lane);
    ctx.moveTo(x(known), y(lane, now));
    for (let k = first; k < last; k++) {
      const next = level(memory.edgeStates[k], lane);
      if (next === now) continue;
      const px = x(memory.edgeTimes[k]);
      ctx.lineTo(px, y(lane, now));
      ctx.lineTo(px, y(lane, next));
      now = next;
    }
    ctx.lineTo(x(Math.min(to, Math.max(known, memory.end))), y(lane, now));
    ctx.stroke();
  });
}

/** The same path with times that differ, so that two of them have one axis. */
function pathOnce([x, y]) {
  for (let k = 1; k < x.length; k++) if (x[k] <= x[k - 1]) x[k] = x[k - 1] + 1e-9;
  return [x, y];
}

function label(t, span) {
  if (span < 0.5) return `${+(t * 1e3).toFixed(span < 0.01 ? 2 : 1)} ms`;
  return `${+t.toFixed(2)} s`;
}
