// What is seen of the operating point: numbers, pulses of one turn, current plane, voltage and flux, spectrum.
import { css, lanes } from "./scope.js";

const FONT = "12px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
const TAU = 2 * Math.PI;

/** A canvas of this height, cleared, in CSS pixels. */
function canvas(id, height) {
  const element = document.getElementById(id), ratio = devicePixelRatio || 1, width = element.clientWidth;
  if (element.width !== Math.round(width * ratio) || element.height !== Math.round(height * ratio)) {
    element.style.height = `${height}px`;
    element.width = Math.round(width * ratio);
    element.height = Math.round(height * ratio);
  }
  const ctx = element.getContext("2d");
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, width, height);
  ctx.font = FONT;
  ctx.lineJoin = "round";
  return { element, ctx, width, height };
}
function line(ctx, colour, width, points, dash = []) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.beginPath();
  points.forEach(([x, y], k) => (k ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
  ctx.stroke();
  ctx.setLineDash([]);
}
function dot(ctx, colour, x, y, radius, filled = true) {
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, TAU);
  ctx.lineWidth = 2;
  ctx.strokeStyle = ctx.fillStyle = colour;
  if (filled) ctx.fill(); else ctx.stroke();
}
/** What is remembered of one motor: columns and means of it have its number behind their names. */
export function motorOf(memory, suffix, properties) {
  const own = name => (suffix && memory.has(name + suffix) ? name + suffix : name);
  const value = (name, row) => (name === "f1" && !memory.has("f1") ? value("speed", row) * properties.polePairs / 60 : memory.value(own(name), row));
  return {
    memory, value, step: memory.step, count: memory.count, end: memory.end, has: name => memory.has(own(name)),
    last: name => (memory.count ? value(name, memory.count - 1) : 0), mean: (name, seconds) => memory.mean(own(name), seconds), peak: (name, seconds) => memory.peak(own(name), seconds),
  };
}
/** Length of a turn that is looked at, in s. */
const turn = memory => Math.min(Math.max(1 / Math.max(Math.abs(memory.last("f1")), 2), 0.005), 0.2);

export function numbers(memory, state, properties, factor, system) {
  const last = name => memory.last(name), seconds = Math.max(turn(memory), 0.01), told = memory.has("te") ? "te" : "teRef";
  const torque = memory.mean(told, seconds), speed = last("speed"), udc = memory.mean("udc", seconds);
  const share = last("u") / (system.voltage * Math.max(udc, 1));
  const power = (torque * speed * TAU) / 60, watts = Math.abs(power) < 2000 ? [power.toFixed(0), "W"] : [(power / 1e3).toFixed(1), "kW"];
  const digits = properties.maxTorque < 20 ? 2 : properties.maxTorque < 200 ? 1 : 0;
  const known = {
    Torque: [torque.toFixed(digits), "N·m"], Speed: [speed.toFixed(0), "r/min"], Power: watts, Link: [udc.toFixed(digits ? 1 : 0), "V"],
    "Current, peak": [(memory.has("ia") ? memory.peak("ia", seconds) : last("peak")).toFixed(digits), "A"], Frequency: [last("f1").toFixed(1), "Hz"],
    "Of six-step": [(100 * share).toFixed(1), "%"], "Of its share": [(100 * share).toFixed(1), "%"], "Map error": [(100 * last("mapError")).toFixed(1), "%"],
    Capacitors: [last("capacitor").toFixed(0), "V"], "Shoot-through": [memory.mean("duty", seconds).toFixed(1), "%"],
  };
  const rows = system.numbers.filter(name => !known[name][0].startsWith("NaN")).map(name => [name, ...known[name]]);
  if (factor) rows.push(["Real time ×", factor.reached.toFixed(factor.reached < 10 ? 2 : 0), `of ${factor.possible.toFixed(0)}`]);
  const host = document.getElementById("numbers");
  if (host.children.length !== rows.length) host.innerHTML = rows.map(([name, , unit]) => `<div><span>${name}</span><b><i style="font-style:normal"></i> <small>${unit}</small></b></div>`).join("");
  rows.forEach(([, value, unit], k) => {
    host.children[k].querySelector("i").textContent = value.replace(/^-(?=[0.]+$)/, "").replace("-", "−");
    host.children[k].querySelector("small").textContent = unit;
  });
}

export function pulses(motor, memory, system) {
  const count = system.lanes.length, each = count > 3 ? 18 : 34;
  const { element, ctx, width, height } = canvas("pulses", 30 + count * each);
  const span = system.cycle ?? turn(motor), to = memory.end, from = to - span, mode = memory.modeName(memory.last("mode"));
  document.getElementById("mode-name").textContent = mode;
  const left = count > 3 ? 26 : 18, right = width - 6, bottom = height - 20;
  ctx.fillStyle = css("--muted");
  ctx.textBaseline = "middle";
  system.lanes.forEach(({ name }, lane) => ctx.fillText(name, 4, 4 + each * (lane + 0.5)));
  const locked = !system.cycle && Math.abs(motor.last("f1")) >= 2;
  for (let k = 0; k <= 4; k++) {
    const x = left + (k / 4) * (right - left);
    line(ctx, css("--grid"), 1, [[x, 4], [x, bottom]]);
    ctx.textAlign = k === 4 ? "right" : k ? "center" : "left";
    // The unit stands at the last one alone: there is no room for five.
    const [scale, unit] = locked ? [360 / span, "°"] : span < 1e-3 ? [1e6, " µs"] : [1e3, " ms"];
    ctx.fillText(`${((k / 4) * span * scale).toFixed(0)}${locked || k === 4 ? unit : ""}`, x, height - 8);
  }
  ctx.textAlign = "left";
  ctx.lineWidth = 1.6;
  const x = t => left + ((Math.max(t, from) - from) / span) * (right - left);
  lanes(ctx, memory, from, to, x, (lane, level) => 4 + each * (lane + 0.85 - 0.7 * level));
  element.setAttribute("aria-label", `Gate pulses of the last ${system.cycle ? "two carrier periods" : "turn"}, ${mode}`);
}

/** Flux linkages at a current, by the map's nodes. */
function flux(properties, id, iq) {
  const { step, side, d, q } = properties.flux, sign = iq < 0 ? -1 : 1;
  const place = value => Math.min(Math.max(value, 0), side - 1.001);
  const x = place(id / step + (side - 1)), y = place(Math.abs(iq) / step), i = Math.floor(x), j = Math.floor(y), a = x - i, b = y - j;
  const at = of => (of[i * side + j] * (1 - b) + of[i * side + j + 1] * b) * (1 - a) + (of[(i + 1) * side + j] * (1 - b) + of[(i + 1) * side + j + 1] * b) * a;
  return [at(d), sign * at(q)];
}

export function plane(memory, properties, system) {
  const size = Math.min(document.getElementById("plane").clientWidth, 300);
  const { element, ctx, width, height } = canvas("plane", Math.round(size * 0.92));
  const most = properties.maxCurrent, negative = memory.has("iqRef") ? memory.last("iqRef") < -0.005 * most || (Math.abs(memory.last("iqRef")) <= 0.005 * most && memory.last("iq") < 0) : memory.mean("iq", 0.01) < -0.02 * most;
  // d from the trip level to a little beyond zero, q the way that torque goes.
  const scale = (height - 34) / (1.32 * most), ox = width / 2 + 0.44 * most * scale, oy = negative ? 12 + 0.1 * most * scale : height - 24 - 0.06 * most * scale;
  const x = id => ox + id * scale, y = iq => oy - iq * scale;
  const decade = 10 ** Math.floor(Math.log10(most / 2)), step = decade * (most / 2 / decade >= 5 ? 5 : most / 2 / decade >= 2 ? 2 : 1), muted = css("--muted"), grid = css("--grid");
  ctx.fillStyle = muted;
  for (let k = -8; k <= 8; k++) {
    const a = k * step;
    if (x(a) > 8 && x(a) < width - 8) { line(ctx, grid, 1, [[x(a), 0], [x(a), height - 18]]); ctx.textAlign = "center"; ctx.fillText(String(a).replace("-", "−"), x(a), height - 5); }
    if (y(a) > 8 && y(a) < height - 20) { line(ctx, grid, 1, [[0, y(a)], [width, y(a)]]); if (a) { ctx.textAlign = "left"; ctx.fillText(String(a).replace("-", "−"), 2, y(a) - 4); } }
  }
  line(ctx, muted, 1, [[x(0), 0], [x(0), height - 18]]);
  line(ctx, muted, 1, [[0, y(0)], [width, y(0)]]);
  ctx.textAlign = "right";
  ctx.fillText("d", width - 3, y(0) + (negative ? -5 : -5));
  ctx.fillText("q", x(0) - 4, negative ? height - 24 : 11);
  ctx.save();
  ctx.beginPath(); ctx.rect(0, 0, width, height - 18); ctx.clip();
  const circle = radius => Array.from({ length: 97 }, (_, k) => [x(radius * Math.cos(TAU * k / 96)), y(radius * Math.sin(TAU * k / 96))]);
  line(ctx, css("--ref"), 1.5, circle(most));
  line(ctx, css("--ref"), 1, circle(properties.tripCurrent), [2, 4]);
  for (const sign of [1, -1]) line(ctx, css("--v"), 2, properties.mtpa.map(([id, iq]) => [x(id), y(sign * iq)]));
  voltageLimit(ctx, memory, properties, system, x, y);
  const rows = Math.min(memory.count, Math.round(turn(memory) / memory.step)), trail = [];
  for (let k = memory.count - rows; k < memory.count; k += Math.max(1, Math.floor(rows / 400))) trail.push([x(memory.value("id", k)), y(memory.value("iq", k))]);
  line(ctx, css("--u"), 1.2, trail);
  if (memory.has("idRef")) dot(ctx, css("--w"), x(memory.last("idRef")), y(memory.last("iqRef")), 5, false);
  dot(ctx, css("--u"), x(memory.last("id")), y(memory.last("iq")), 4);
  ctx.restore();
  element.setAttribute("aria-label", `Current d ${memory.last("id").toFixed(0)} A, q ${memory.last("iq").toFixed(0)} A, largest ${most} A`);
}

/** The currents whose voltage is six-step's at this speed: a contour over the map's nodes. */
function voltageLimit(ctx, memory, properties, system, x, y) {
  const omega = (memory.last("speed") * TAU * properties.polePairs) / 60, limit = system.voltage * memory.last("udc") / (system.motors.length > 1 ? 2 : 1);
  if (Math.abs(omega) < 20) return;
  const { step, side, d, q } = properties.flux, r = properties.resistance, cells = [];
  ctx.strokeStyle = css("--speed");
  ctx.lineWidth = 1.5;
  ctx.setLineDash([6, 3]);
  ctx.beginPath();
  for (const sign of [1, -1]) {
    const over = (i, j) => {
      const id = (i - side + 1) * step, iq = sign * j * step, k = i * side + j;
      return Math.hypot(r * id - omega * sign * q[k], r * iq + omega * d[k]) - limit;
    };
    for (let i = 0; i < side - 1; i++) for (let j = 0; j < side - 1; j++) {
      const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]], values = corners.map(([a, b]) => over(a, b)), cut = [];
      for (let k = 0; k < 4; k++) {
        const [a, b] = [values[k], values[(k + 1) % 4]], [p, s] = [corners[k], corners[(k + 1) % 4]];
        if (a < 0 !== b < 0) { const w = a / (a - b); cut.push([p[0] + w * (s[0] - p[0]), p[1] + w * (s[1] - p[1])]); }
      }
      if (cut.length === 2) cut.forEach(([a, b], k) => ctx[k ? "lineTo" : "moveTo"](x((a - side + 1) * step), y(sign * b * step)));
    }
  }
  ctx.stroke();
  ctx.setLineDash([]);
}

/** Rotor angle at a row, in rad: that between the currents in both frames. */
function angle(memory, row) {
  const v = name => memory.value(name, row);
  return Math.atan2((v("ib") - v("ic")) / Math.sqrt(3), v("ia")) - Math.atan2(v("iq"), v("id"));
}

export function hexagon(memory, properties, system) {
  const side = Math.min(document.getElementById("hexagon").clientWidth, 300);
  const { element, ctx, width, height } = canvas("hexagon", Math.round(side * 0.88));
  const udc = Math.max(memory.last("udc"), 1), ox = width / 2, oy = height / 2, scale = (height / 2 - 6) / ((2 / 3) * (system.motors.length > 1 ? 840 : properties.tripLink[1]));
  const ring = radius => Array.from({ length: 97 }, (_, k) => [ox + radius * Math.cos(TAU * k / 96), oy - radius * Math.sin(TAU * k / 96)]);
  for (let k = 0; k < 3; k++) line(ctx, css("--grid"), 1, [0, Math.PI].map(a => [ox + 2e3 * scale * Math.cos(a + k * Math.PI / 3), oy - 2e3 * scale * Math.sin(a + k * Math.PI / 3)]));
  const corner = (2 / 3) * udc * scale;
  line(ctx, css("--ref"), 1.8, Array.from({ length: 7 }, (_, k) => [ox + corner * Math.cos(k * Math.PI / 3), oy - corner * Math.sin(k * Math.PI / 3)]));
  line(ctx, css("--ref"), 1, ring((udc / Math.sqrt(3)) * scale), [2, 4]);
  if (system.motors.length === 1) line(ctx, css("--speed"), 1.5, ring((2 / Math.PI) * udc * scale), [6, 3]);
  const r = properties.resistance, id = memory.last("id"), iq = memory.last("iq"), least = 0.013 * properties.maxCurrent, flowing = Math.hypot(id, iq) > least;
  const rows = Math.min(memory.count, Math.round(turn(memory) / memory.step)), trail = [], full = (height / 2 - 10) / (1.25 * Math.hypot(...flux(properties, 0, properties.maxCurrent)));
  for (let k = memory.count - rows; k < memory.count; k += Math.max(1, Math.floor(rows / 300))) {
    const [d, q] = [memory.value("id", k), memory.value("iq", k)];
    if (Math.hypot(d, q) < least) continue;
    const [fd, fq] = flux(properties, d, q), at = angle(memory, k), a = Math.atan2(fq, fd) + at, m = Math.hypot(fd, fq) * full;
    trail.push([ox + m * Math.cos(a), oy - m * Math.sin(a)]);
  }
  line(ctx, css("--flux"), 1.6, trail);
  if (flowing && memory.last("mode") > 0) {
    const omega = (memory.last("speed") * TAU * properties.polePairs) / 60, [fd, fq] = flux(properties, id, iq);
    const a = Math.atan2(r * iq + omega * fd, r * id - omega * fq) + angle(memory, memory.count - 1), u = memory.last("u") * scale;
    line(ctx, css("--u"), 2, [[ox, oy], [ox + u * Math.cos(a), oy - u * Math.sin(a)]]);
    dot(ctx, css("--u"), ox + u * Math.cos(a), oy - u * Math.sin(a), 4);
  }
  element.setAttribute("aria-label", `Voltage ${memory.last("u").toFixed(0)} V of a hexagon of ${((2 / 3) * udc).toFixed(0)} V`);
}

export const POINTS = 4096;
/** Magnitudes of a real signal's spectrum with Hann's window, in its unit. */
function magnitudes(signal) {
  const re = new Float64Array(POINTS), im = new Float64Array(POINTS);
  for (let k = 0, bits = Math.log2(POINTS); k < POINTS; k++) {
    let reversed = 0;
    for (let b = 0; b < bits; b++) reversed |= (k >> b & 1) << (bits - 1 - b);
    re[reversed] = signal[k] * (1 - Math.cos(TAU * k / POINTS));
  }
  for (let size = 2; size <= POINTS; size *= 2) {
    const half = size / 2;
    for (let k = 0; k < half; k++) {
      const c = Math.cos(-TAU * k / size), s = Math.sin(-TAU * k / size);
      for (let a = k; a < POINTS; a += size) {
        const b = a + half, x = re[b] * c - im[b] * s, y = re[b] * s + im[b] * c;
        re[b] = re[a] - x; im[b] = im[a] - y; re[a] += x; im[a] += y;
      }
    }
  }
  return Float64Array.from({ length: POINTS / 2 }, (_, k) => (2 * Math.hypot(re[k], im[k])) / POINTS);
}

export function spectrum(memory, properties, system, bound) {
  const { element, ctx, width, height } = canvas("spectrum", 170);
  if (memory.count < POINTS) return;
  const signal = Float64Array.from({ length: POINTS }, (_, k) => memory.value("ia", memory.count - POINTS + k));
  const amplitudes = magnitudes(signal), step = 1 / (POINTS * memory.step), most = Math.min(system.top, 0.5 / memory.step);
  const alone = system.repeats || bound.length !== POINTS ? null : magnitudes(bound);
  const most10 = Math.log10(properties.maxCurrent), left = 32, right = width - 6, top = 6, bottom = height - 20, [low, high] = [most10 - (system.repeats ? 3.4 : 4.2), most10 + 0.25];
  const x = hz => left + (hz / most) * (right - left), y = a => bottom - ((Math.max(Math.log10(a + 1e-9), low) - low) / (high - low)) * (bottom - top);
  ctx.fillStyle = css("--muted");
  ctx.textBaseline = "middle";
  ctx.textAlign = "right";
  for (const a of [0.001, 0.01, 0.1, 1, 10, 100].filter(a => Math.log10(a) > low && Math.log10(a) < high)) { line(ctx, css("--grid"), 1, [[left, y(a)], [right, y(a)]]); ctx.fillText(a, left - 5, y(a)); }
  for (let hz = 0; hz <= most; hz += most > 8000 ? 5000 : most > 5000 ? 2000 : 1000) { line(ctx, css("--grid"), 1, [[x(hz), top], [x(hz), bottom]]); ctx.textAlign = hz ? (hz === most ? "right" : "center") : "left"; ctx.fillText(hz ? `${hz / 1000} kHz` : "0", x(hz), height - 8); }
  ctx.textAlign = "left";
  const curve = of => Array.from({ length: Math.floor(most / step) }, (_, k) => [x(k * step), y(of[k])]);
  if (alone) line(ctx, css("--speed"), 3, curve(alone));
  line(ctx, css("--u"), 1.2, curve(amplitudes));
  ctx.fillStyle = css("--speed");
  let lines = 0;
  for (let k = 0; system.repeats && k < bound.length; k += 2) {
    const [hz, a] = [bound[k], bound[k + 1]];
    if (hz >= most || a <= 10 ** low) continue;
    ctx.fillRect(x(hz) - 4, y(a) - 1, 8, 2);
    lines += 1;
  }
  // The largest lines of the bound that are harmonics of the pulses, and what is measured there over them.
  if (alone) {
    const peaks = Array.from(alone.keys()).filter(k => k * step > 0.3 * most && alone[k] > 10 ** low && alone[k] > alone[k - 1] && alone[k] >= (alone[k + 1] ?? 0));
    lines = peaks.length;
    const k = peaks.sort((a, b) => alone[b] - alone[a])[0];
    element.dataset.over = k ? amplitudes[k] / alone[k] : "";
  }
  element.dataset.bound = lines;
  element.setAttribute("aria-label", `Spectrum of the current of phase u over the last ${(POINTS * memory.step * 1e3).toFixed(0)} ms, 0 to ${most / 1e3} kHz; ${lines} lines of the pulses’ bound`);
}
