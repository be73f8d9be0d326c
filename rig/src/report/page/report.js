// The plots of a report: unpacks its columns, and draws of each the lowest and the highest value a pixel, or every value where there is room.
"use strict";
(() => {
  const FACTOR = 4; // blocks of a level in one of the next
  const MOST_CHIPS = 14; // marks with a button each; more are a list
  const AXIS = 58; // room of an axis, in px
  const FONT = "12px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
  /** A tick as the text writes numbers, 1,500 or −0.02, with as many decimals as the distance of two ticks has. */
  const written = (tick, apart) => {
    const decimals = (apart.toFixed(9).replace(/0+$/, "").split(".")[1] ?? "").length;
    return tick.toLocaleString("en", { minimumFractionDigits: 0, maximumFractionDigits: decimals }).replace("-", "−");
  };
  const css = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const make = (name, text, more = {}) => Object.assign(document.createElement(name), { textContent: text }, more);

  /** The stream of all columns. */
  async function unpacked() {
    const packed = Uint8Array.from(atob(document.getElementById("data").textContent), c => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** A column's values: zigzag numbers of seven bits a byte, summed as often as its differences' order says. */
  function values(bytes, { step, order, from, to }, rows) {
    const out = new Float64Array(rows);
    let count = 0, first = 0, second = 0;
    for (let at = from; at < to;) {
      let number = 0, weight = 1, byte;
      do { byte = bytes[at++]; number += (byte & 127) * weight; weight *= 128; } while (byte & 128);
      number = number % 2 ? -(number + 1) / 2 : number / 2;
      first += number;
      if (order === 2) second += first; else second = first;
      out[count++] = second * step;
    }
    return out;
  }

  /** Times of rows. */
  class Times {
    constructor(rows, first, every, at) { Object.assign(this, { rows, first, every, at }); }
    of(row) { return this.at ? this.at[row] : this.first + row * this.every; }
    /** The last row at or before a time, from 0. */
    row(time) {
      if (!this.at) return Math.min(Math.max(Math.floor((time - this.first) / this.every + 1e-6), 0), this.rows - 1);
      let low = 0, high = this.rows;
      while (low < high) { const middle = (low + high) >> 1; if (this.at[middle] <= time) low = middle + 1; else high = middle; }
      return Math.max(low - 1, 0);
    }
    get begin() { return this.of(0); }
    get end() { return this.of(this.rows - 1); }
  }

  /** A curve: values over times, and of blocks of 4, 16, 64 … rows the lowest and the highest. */
  class Curve {
    constructor(times, values) { this.times = times; this.values = values; this.levels = []; }
    level(number) {
      while (this.levels.length < number) {
        const below = this.levels[this.levels.length - 1], n = below ? below.low.length : this.values.length;
        const low = new Float64Array(Math.ceil(n / FACTOR)), high = new Float64Array(low.length);
        for (let block = 0; block < low.length; block++) {
          let least = Infinity, most = -Infinity;
          for (let k = block * FACTOR, end = Math.min(k + FACTOR, n); k < end; k++) {
            least = Math.min(least, below ? below.low[k] : this.values[k]);
            most = Math.max(most, below ? below.high[k] : this.values[k]);
          }
          low[block] = least; high[block] = most;
        }
        this.levels.push({ low, high });
      }
      return this.levels[number - 1];
    }
    at(time) { return this.values[this.times.row(time)]; }
    /** Rows from a time to another for so many pixels, with one more at each end: x and y. */
    sampled(from, to, pixels) {
      const { times, values } = this, x = [], y = [];
      if (times.at) return this.byPixel(from, to, pixels);
      const first = times.row(from), last = Math.min(times.row(to) + 1, times.rows - 1);
      const n = last - first + 1;
      if (n <= 4 * pixels) {
        for (let k = first; k <= last; k++) { x.push(times.of(k)); y.push(values[k]); }
        return [x, y];
      }
      let number = 1, size = FACTOR;
      while (n / size > 2 * pixels) { number += 1; size *= FACTOR; }
      const { low, high } = this.level(number);
      for (let block = Math.floor(first / size); block * size <= last; block++) {
        const begin = block * size, end = Math.min(begin + size, times.rows) - 1;
        const falls = values[begin] > values[end];
        x.push(times.of(begin), times.of((begin + end) >> 1));
        y.push(falls ? high[block] : low[block], falls ? low[block] : high[block]);
      }
      return [x, y];
    }
    /** The same of rows that lie here dense and there thin: in each pixel the first, the lowest, the highest and the last one. */
    byPixel(from, to, pixels) {
      const { times, values } = this, x = [], y = [], last = Math.min(times.row(to) + 1, times.rows - 1);
      const put = k => { x.push(times.at[k]); y.push(values[k]); };
      for (let k = times.row(from); k <= last;) {
        const end = times.at[k] + (to - from) / pixels, begin = k;
        let low = k, high = k;
        for (; k <= last && times.at[k] <= end; k++) {
          if (values[k] < values[low]) low = k;
          if (values[k] > values[high]) high = k;
        }
        const rows = k - begin <= 4 ? Array.from({ length: k - begin }, (_, n) => begin + n) : [begin, Math.min(low, high), Math.max(low, high), k - 1];
        rows.forEach(put);
      }
      return [x, y];
    }
  }

  /** All curves of the page, made when they are first looked at. */
  class Store {
    constructor(model, bytes) {
      this.bytes = bytes;
      this.tables = model.tables;
      this.made = new Map();
    }
    times(number) {
      const table = this.tables[number];
      table.made ??= new Times(table.rows, table.first, table.every, table.at && values(this.bytes, table.at, table.rows));
      return table.made;
    }
    curve({ place: [table, column], style, scale }) {
      const key = `${table} ${column} ${style === "edges"}`;
      if (!this.made.has(key)) {
        const plain = new Curve(this.times(table), values(this.bytes, this.tables[table].columns[column], this.tables[table].rows));
        this.made.set(key, style === "edges" ? this.edges(plain, this.curve({ place: scale })) : plain);
      }
      return this.made.get(key);
    }
    /** A level times another curve, with an edge where the level changes: two points each. */
    edges(level, scale) {
      const n = level.times.rows, end = scale.times.end, at = [], out = [];
      for (let k = 0; k < n; k++) {
        const time = level.times.of(k), size = scale.at(time);
        if (time > end) break;
        if (k > 0) { at.push(time); out.push(level.values[k - 1] * size); }
        at.push(time); out.push(level.values[k] * size);
      }
      at.push(Math.max(end, at[at.length - 1])); out.push(out[out.length - 1]);
      return new Curve(new Times(at.length, 0, 0, Float64Array.from(at)), Float64Array.from(out));
    }
  }

  /** Ends of an axis for values from one to another: with 0 where that is near; a curve that hardly moves fills its plot. */
  function fitted(low, high) {
    if (low == null || high == null) return [0, 1];
    const least = 2e-6 * Math.max(Math.abs(low), Math.abs(high)) || 1e-3;
    if (high === low) return low ? [low - 1e-3 * Math.abs(low), high + 1e-3 * Math.abs(high)] : [-1, 1];
    if (high - low < least) { low -= least; high += least; }
    const span = high - low, room = 0.06 * span;
    if (low > 0 && low <= span) return [0, high + room];
    if (high < 0 && -high <= span) return [low - room, 0];
    return [low - room, high + room];
  }

  /** A time in words: milliseconds where little is shown. */
  function told(time, span) {
    if (span < 0.5) return `${+(time * 1e3).toFixed(span < 0.002 ? 4 : span < 0.02 ? 3 : 2)} ms`;
    return `${+time.toFixed(span < 5 ? 3 : 2)} s`;
  }

  /** Panels over a common axis. */
  class Scope {
    constructor(section, plan, model, store) {
      Object.assign(this, { section, plan, model, store, axis: AXIS, plots: [] });
      this.curves = plan.panels.map(panel => panel.series.map(series => store.curve(series)));
      const all = this.curves.flat().filter(curve => curve.times.rows);
      this.full = [Math.min(...all.map(curve => curve.times.begin)), Math.max(...all.map(curve => curve.times.end))];
      if (!(this.full[1] > this.full[0])) this.full = [this.full[0] - 0.5 || 0, this.full[0] + 0.5 || 1];
      this.home = plan.span ?? this.full;
      this.shown = this.home;
      this.marks = plan.time ? model.marks : [];
      this.bands = plan.time ? model.bands : [];
      this.hosts = [...section.querySelectorAll(".plot")];
      if (plan.time && (this.marks.length || this.bands.length)) {
        this.lane = make("canvas", "");
        this.lane.setAttribute("aria-hidden", "true");
        section.querySelector(".bar").after(this.lane);
      }
      this.controls();
      this.build();
    }
    controls() {
      const bar = this.section.querySelector(".bar");
      const button = (text, title, act) => {
        const made = make("button", text, { type: "button", title, onclick: act });
        made.setAttribute("aria-label", title);
        bar.append(made);
        return made;
      };
      this.back = button(this.plan.span ? "as it was" : "all", "Show what was shown at first", () => this.show(...this.home));
      button("+", "Zoom in", () => this.scale(0.5));
      button("−", "Zoom out", () => this.scale(2));
      button("‹", "Earlier", () => this.move(-0.3));
      button("›", "Later", () => this.move(0.3));
      if (this.plan.time && !this.plan.span && this.marks.length) this.chips(bar, button);
      if (this.plan.time && !this.plan.span) bar.append(make("span", "drag to zoom, double-click to return; keys + − ← → 0", { className: "hint" }));
      this.section.tabIndex = 0;
      this.section.addEventListener("keydown", event => {
        const act = { "+": () => this.scale(0.5), "-": () => this.scale(2), ArrowLeft: () => this.move(-0.3), ArrowRight: () => this.move(0.3), 0: () => this.show(...this.home) }[event.key];
        if (act && event.target === this.section) { event.preventDefault(); act(); }
      });
    }
    chips(bar, button) {
      const go = mark => {
        const fine = this.curves.flat()[0].times.every || 1e-4, width = Math.max(0.04, 200 * fine);
        this.show(mark.at - 0.25 * width, mark.at + 0.75 * width);
      };
      const words = mark => `${mark.name} · ${+mark.at.toFixed(2)} s`;
      if (this.marks.length <= MOST_CHIPS && innerWidth > 620) {
        this.marks.forEach(mark => { button(words(mark), `Zoom to ${mark.name}`, () => go(mark)).className = mark.bad ? "bad" : "mark"; });
        return;
      }
      const list = make("select", "", { onchange: () => list.value && go(this.marks[list.value]) });
      list.setAttribute("aria-label", "Zoom to");
      list.append(make("option", "zoom to …", { value: "" }), ...this.marks.map((mark, k) => make("option", words(mark), { value: k })));
      bar.append(list);
    }
    /** Shows a part of the axis. */
    show(from, to) {
      const [begin, end] = this.full, least = (end - begin) * 1e-7;
      const width = Math.min(Math.max(to - from, least), end - begin);
      from = Math.min(Math.max(from, begin), end - width);
      this.shown = [from, from + width];
      if (!this.waits) this.waits = requestAnimationFrame(() => { this.waits = 0; this.draw(); });
    }
    scale(by, middle = (this.shown[0] + this.shown[1]) / 2) {
      const [from, to] = this.shown;
      this.show(middle - (middle - from) * by, middle + (to - middle) * by);
    }
    move(by) {
      const [from, to] = this.shown, step = by * (to - from);
      this.show(from + step, to + step);
    }
    build() {
      this.plots.forEach(plot => plot.destroy());
      this.width = this.hosts[0].clientWidth;
      this.plots = this.plan.panels.map((panel, k) => this.plot(panel, k));
      this.draw();
    }
    /** What is drawn of a panel: each series over the times of all. */
    data(k) {
      const pixels = Math.max(200, Math.round(this.width - this.axis)), [from, to] = this.shown;
      const parts = this.curves[k].map(curve => curve.sampled(from, to, pixels));
      const same = parts.every(([x]) => x.length === parts[0][0].length && x[0] === parts[0][0][0] && x[x.length - 1] === parts[0][0][x.length - 1]);
      return same ? [parts[0][0], ...parts.map(([, y]) => y)] : uPlot.join(parts);
    }
    draw() {
      this.plots.forEach((plot, k) => plot.setData(this.data(k)));
      if (this.lane) this.events();
      this.back.setAttribute("aria-pressed", this.shown[0] === this.home[0] && this.shown[1] === this.home[1]);
    }
    plot(panel, k) {
      const isLast = k === this.plan.panels.length - 1, narrow = this.width < 500;
      const height = Math.max(this.plan.panels.length === 1 ? 250 : k === 0 ? 190 : 150, 16 * panel.levels.length + 34) + (isLast ? 26 : 0) - (narrow ? 20 : 0);
      // The names stand below the title where both do not fit beside each other.
      const long = panel.series.reduce((sum, { name }) => sum + 100 + 8 * name.length, 0);
      const fits = narrow || this.axis + 8 * panel.label.length + long <= this.width, rows = fits ? 0 : Math.ceil(long / this.width);
      this.hosts[k].parentElement.classList.toggle("two", !fits);
      const line = { font: FONT, stroke: css("muted"), grid: { stroke: css("grid"), width: 1 }, ticks: { stroke: css("line"), width: 1, size: 4 } };
      const names = panel.levels, span = () => this.shown[1] - this.shown[0];
      const time = (u, ticks) => ticks.map(tick => (this.plan.time ? told(tick, span()) : +tick.toPrecision(8)));
      const options = {
        width: this.width, height: height + 17 * rows, pxAlign: 0, padding: [narrow ? 8 : 24 + 17 * rows, 28, 0, 0],
        cursor: { ...(this.plan.time ? { sync: { key: "time", scales: ["x", null] } } : {}), drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
        legend: { live: true, markers: { width: 0, fill: (u, s) => u.series[s].stroke?.(u, s) } },
        scales: {
          x: { time: false, range: () => this.shown },
          y: { range: names.length ? () => [-0.5, names.length - 0.5] : (u, low, high) => fitted(low, high) },
        },
        axes: [
          { ...line, size: isLast ? 28 : 6, values: isLast ? time : (u, ticks) => ticks.map(() => ""), space: this.plan.time ? 80 : 60 },
          {
            ...line, space: 28, size: (u, shown) => this.room(shown),
            values: (u, ticks, axis, space, apart) => ticks.map(tick => written(tick, apart)),
            ...(names.length ? { splits: () => names.map((_, level) => level), values: (u, ticks) => ticks.map(tick => names[tick]) } : {}),
          },
        ],
        series: [{}, ...panel.series.map((series, s) => this.series(panel, series, this.curves[k][s]))],
        hooks: { setSelect: [u => this.select(u)], drawClear: [u => this.shade(u)], draw: [u => this.lines(u)] },
      };
      const made = new uPlot(options, [[], ...panel.series.map(() => [])], this.hosts[k]);
      made.over.addEventListener("dblclick", () => this.show(...this.home));
      made.over.addEventListener("wheel", event => {
        if (!event.ctrlKey && !event.shiftKey) return;
        event.preventDefault();
        this.scale((event.deltaY || event.deltaX) > 0 ? 1.25 : 0.8, made.posToVal(event.offsetX, "x"));
      }, { passive: false });
      return made;
    }
    series(panel, { name, ink, style }, curve) {
      const dashed = style === "dashed";
      return {
        label: name, stroke: css(ink), spanGaps: true, points: { show: u => u.data[0].length === 1 },
        width: style === "ripple" ? 1 : dashed ? 1.6 : 1.4, dash: dashed ? [6, 4] : undefined,
        // The value itself, not what stands for it where many are drawn as one.
        value: (u, y, s, k) => (y == null ? "" : panel.levels.length ? panel.levels[Math.round(y)] ?? "" : String(+curve.at(u.data[0][k]).toPrecision(5))),
      };
    }
    /** Room for the numbers of an axis: the same for all panels. */
    room(shown) {
      const wanted = 16 + 6.9 * Math.max(0, ...(shown ?? []).map(text => String(text ?? "").length));
      if (wanted > this.axis + 1) {
        this.axis = Math.ceil(wanted);
        this.section.style.setProperty("--axis", `${this.axis}px`);
        requestAnimationFrame(() => { this.plots.forEach(plot => plot.redraw(false, true)); if (this.lane) this.events(); });
      }
      return this.axis;
    }
    select(u) {
      if (u.select.width < 4) return;
      const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
      u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      this.show(from, to);
    }
    inside(from, to) { return to >= this.shown[0] && from <= this.shown[1]; }
    shade(u) {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.fillStyle = css("band");
      this.bands.forEach((band, k) => {
        if (k % 2 || !this.inside(band.from, band.to)) return;
        const left = Math.max(u.valToPos(band.from, "x", true), bbox.left), right = Math.min(u.valToPos(band.to, "x", true), bbox.left + bbox.width);
        ctx.fillRect(left, bbox.top, right - left, bbox.height);
      });
      ctx.restore();
    }
    lines(u) {
      const { ctx, bbox } = u, ratio = devicePixelRatio || 1;
      ctx.save();
      ctx.setLineDash([3 * ratio, 3 * ratio]);
      ctx.lineWidth = ratio;
      this.marks.filter(mark => this.inside(mark.at, mark.at)).forEach(mark => {
        const x = u.valToPos(mark.at, "x", true);
        ctx.strokeStyle = css(mark.bad ? "bad" : "muted");
        ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
      });
      ctx.restore();
    }
    /** The lane above the panels: bands with their names, or marks with theirs. */
    events() {
      const ratio = devicePixelRatio || 1, { lane, width } = this, height = 22;
      Object.assign(lane, { width: width * ratio, height: height * ratio });
      Object.assign(lane.style, { width: `${width}px`, height: `${height}px`, display: "block" });
      const ctx = lane.getContext("2d"), [from, to] = this.shown, left = this.axis, room = width - left - 28;
      const x = time => left + Math.min(Math.max((time - from) / (to - from), 0), 1) * room;
      ctx.scale(ratio, ratio);
      ctx.font = FONT;
      ctx.textBaseline = "middle";
      this.bands.filter(band => this.inside(band.from, band.to)).forEach(band => {
        const begin = x(band.from), end = x(band.to);
        ctx.fillStyle = css(this.bands.indexOf(band) % 2 ? "press" : "line");
        ctx.fillRect(begin, 1, Math.max(end - begin - 1, 0.5), height - 4);
        ctx.fillStyle = css("text");
        if (end - begin > ctx.measureText(band.name).width + 8) ctx.fillText(band.name, begin + 5, height / 2 - 1);
      });
      let free = left;
      this.marks.filter(mark => (mark.bad || !this.bands.length) && this.inside(mark.at, mark.at)).forEach(mark => {
        const at = x(mark.at), long = ctx.measureText(mark.name).width;
        if (at + 4 < free || at + long + 4 > width) return;
        ctx.fillStyle = css("card");
        ctx.fillRect(at, 0, long + 8, height - 2);
        ctx.fillStyle = css(mark.bad ? "bad" : "text");
        ctx.fillText(mark.name, at + 4, height / 2 - 1);
        free = at + long + 12;
      });
    }
  }

  async function start() {
    const model = JSON.parse(document.getElementById("model").textContent);
    const store = new Store(model, await unpacked());
    const scopes = [];
    const build = section => {
      const number = +section.dataset.scope;
      scopes[number] ??= new Scope(section, model.scopes[number], model, store);
      return scopes[number];
    };
    const sections = [...document.querySelectorAll("[data-scope]")];
    const seen = new IntersectionObserver(entries => entries.filter(entry => entry.isIntersecting).forEach(entry => {
      seen.unobserve(entry.target);
      build(entry.target);
    }), { rootMargin: "400px" });
    if (sections.length) build(sections[0]);
    sections.slice(1).forEach(section => seen.observe(section));
    // What is not looked at yet is made in between, so that no place stays empty.
    const rest = () => {
      const next = sections.find(section => !scopes[+section.dataset.scope]);
      if (next) { build(next); setTimeout(rest, 30); }
    };
    setTimeout(rest, 300);
    const again = () => scopes.forEach(scope => scope?.build());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
    addEventListener("resize", () => scopes.forEach(scope => { if (scope && scope.hosts[0].clientWidth !== scope.width) scope.build(); }));
    addEventListener("beforeprint", () => sections.forEach(build));
    window.report = { scopes, font: FONT, all: () => sections.map(build) };
    document.body.dataset.drawn = Math.round(performance.now());
  }
  start();
})();
