// The page: starts the simulation in its worker, hands it what is set, and draws what comes back.
import { KEYS, build, read, select, write } from "./controls.js";
import { mcap } from "./mcap.js";
import { Memory, Scope, WINDOWS, told } from "./scope.js";
import { SYSTEMS, chosen, machines } from "./systems.js";
import * as views from "./views.js";

const $ = id => document.getElementById(id);
const RATES = [["0.001", "1/1000"], ["0.01", "1/100"], ["0.1", "1/10"], ["1", "real time"], ["5", "5 ×"], ["Infinity", "fastest"]];
const LONGEST_RECORD_S = 120;

const worker = new Worker("worker.js", { type: "module" });
const tell = message => worker.postMessage(message);
const wanted = { on: true, coast: false, discharge: false };
let memory = null, scope = null, properties = null, state = {}, factor = { reached: 0, possible: 0 }, fresh = false, injected = "", bound = [];
let drive = null, settings = null, remote = null, motor = 0, record = null;

const words = () => new URLSearchParams(location.hash.slice(1));
const order = name => { const [what, k, values] = drive.controls.orders[name](settings); tell({ type: "set", name: what, motor: k, values }); };
const find = name => [...drive.controls.sliders, ...drive.controls.choices, ...drive.controls.checks].find(of => of.name === name);
const suffix = () => drive.system.motors[motor].suffix;
const step = () => 1e-3 / +settings.samples;

const runs = [];
/** Runs a scenario with the rig's words: what its verdicts are, and the SHA-256 of its trace.csv. */
const run = (name, words = []) => new Promise((done, refused) => {
  tell({ type: "scenario", id: runs.length, name, words: words.map(String) });
  runs.push({ done, refused });
});

function start() {
  const { orders } = drive.controls, held = `rotor${suffix()}`;
  const speed = settings[held] === "held" ? settings[`held${suffix()}`] : memory?.last(`speed${suffix()}`) || 0;
  memory = record = null;
  tell({ type: "start", system: drive.system.id, machine: drive.name, words: drive.controls.words(settings).map(String), speed, step: step(), want: wanted,
    // The line's voltage and what belongs to it stand in the words.
    set: Object.entries(orders).filter(([name]) => !["link", "uin", "scheme"].includes(name)).map(([, of]) => of(settings)) });
}

const act = {
  change(name) {
    const of = find(name);
    if (of.restart) start(); else order(of.order ?? name);
    remember();
  },
  press(id) {
    const want = () => tell({ type: "want", ...wanted });
    ({
      on: () => { wanted.on = !wanted.on; want(); },
      coast: () => { wanted.coast = !wanted.coast; want(); },
      acknowledge: () => tell({ type: "acknowledge" }),
      restart: start,
      free: start,
      // An interrupt that has stopped comes again with the processor's restart alone.
      mend: () => { if (injected === "commands-lost") start(); else { tell({ type: "mend" }); order("map"); } injected = ""; },
      run: () => { $("run").disabled = true; $("sum").textContent = "running …"; delete $("sum").dataset.sha256; run($("scenario").value).catch(({ message }) => { $("run").disabled = false; $("sum").textContent = message; }); },
    })[id]?.();
    buttons();
  },
  inject(name) { injected = name; tell({ type: "inject", value: name }); },
  arm(value) { tell({ type: "arm", value }); },
};
function remember() {
  const first = { window: "0.1", rate: "1", samples: "20" }, value = name => ($(name).value === first[name] ? "" : $(name).value);
  write(drive.controls, settings, {
    ...(remote ? {} : { system: drive.system.id === "pmasynrm" ? "" : drive.system.id, machine: drive.name === machines(drive.system.id)[0][0] ? "" : drive.name }),
    window: value("window"), trigger: $("trigger").value, rate: value("rate"), motor: motor ? String(motor + 1) : "",
  });
}
function buttons() {
  $("on").textContent = wanted.on ? "Stop" : "Start";
  $("coast").setAttribute("aria-pressed", wanted.coast);
  $("pause").setAttribute("aria-pressed", scope?.paused ?? false);
  $("pause").textContent = scope?.paused ? "Go on" : "Pause";
  $("record").setAttribute("aria-pressed", record?.runs ?? false);
  $("acknowledge").disabled = !state.trip;
}

/** What stands in the page for a system: its name, its choices, its views. */
function begin(told) {
  remote = told ?? null;
  drive = chosen(words(), remote);
  settings = read(drive.controls, words());
  if (remote) { wanted.on = false; settings.samples = String(1e-3 / remote.step); }
  const { system } = drive;
  $("what").textContent = remote ? `${system.title}: ${remote.source}` : system.title;
  $("choose").hidden = !!remote;
  const go = (name, of) => { const next = new URLSearchParams({ system: name, ...(of && { machine: of }) }); location.hash = next; };
  $("system").replaceWith(select("system", Object.values(SYSTEMS).map(({ id }) => [id, id === "zs9" ? "ZS9" : "PMaSynRM drive"]), system.id, { onchange: () => go($("system").value) }));
  $("machine").replaceWith(select("machine", machines(system.id), drive.name, { onchange: () => go(system.id, $("machine").value) }));
  $("motor-choice").hidden = system.motors.length < 2;
  motor = system.motors.length > 1 && words().get("motor") === "2" ? 1 : 0;
  $("motor").replaceChildren(...system.motors.map(({ text }, k) => new Option(text ?? "", k)));
  $("motor").value = motor;
  $("motor").onchange = () => { motor = +$("motor").value; bound = []; remember(); };
  $("trigger").append(...system.triggers.map(([value, text]) => new Option(text, value)));
  for (const figure of document.querySelectorAll("[data-system]")) figure.hidden = figure.dataset.system !== system.id;
  start();
}

worker.onmessage = ({ data }) => ({
  ready() { begin(data.remote); },
  started() {
    properties = data.properties;
    memory = remembered(data.columns, step());
    if (scope) { scope.reset(memory); scope.paused = false; }
    else {
      build($("controls"), { controls: drive.controls, settings, kinds: drive.system.faults, faults: properties.faults, scenarios: data.scenarios, remote }, act);
      scope = new Scope($("plots"), memory);
      scope.largest = properties.maxTorque;
      scope.onzoom = () => { if (!scope.held) scope.paused = false; fresh = true; buttons(); };
      toolbar();
      requestAnimationFrame(frame);
    }
    buttons();
  },
  rows() {
    if (memory) {
      memory.put(data.from, data.rows, data.edges);
      if (record?.runs) keep(data.from, data.rows);
    }
    [state, factor, fresh] = [data.state, data.factor, true];
    // Nothing to draw yet, which no frame would say: no row has come, or, of a drive elsewhere, no columns.
    if (!memory?.count) tell({ type: "drawn" });
  },
  bound() { bound = data.values; },
  ran() {
    memory = remembered(data.columns, data.step, data.rows.length / data.columns.length);
    memory.put(0, data.rows, data.edges);
    scope.reset(memory);
    scope.held = [0, memory.end];
    scope.paused = true;
    [state, factor, fresh] = [{ t: memory.end, trip: null, status: { state: data.name } }, { reached: memory.end / data.seconds, possible: memory.end / data.seconds }, true];
    $("run").disabled = false;
    runs[data.id].done({ sha256: data.sha256, verdicts: data.verdicts });
    $("sum").dataset.sha256 = data.sha256;
    $("sum").textContent = `trace.csv, ${data.bytes.toLocaleString("en")} bytes, in ${data.seconds.toFixed(1)} s: SHA-256 ${data.sha256}`;
    buttons();
  },
  refused() { runs[data.id].refused(new Error(data.message)); },
  error() { fault(`<b>The bench has stopped</b> <span>${data.message.replace(/[<&]/g, "")}</span> <span>Restart goes on.</span>`); },
})[data.type]();

function remembered(columns, step, size) {
  const made = new Memory(columns, step, drive.system, size);
  made.hasEdges = !remote;
  return made;
}

/** The recording's rows; it ends by itself when it is long. */
function keep(from, rows) {
  record.chunks.push([from, rows]);
  record.seconds += (rows.length / memory.columns.length) * memory.step;
  if (record.seconds > LONGEST_RECORD_S) record.runs = false;
  $("record").textContent = `Record ${record.seconds.toFixed(0)} s`;
}
/** What is saved: the recording where there is one, else what the scope holds. */
function * saved() {
  if (!record) { yield * memory.rows(); return; }
  const width = memory.columns.length;
  for (const [from, rows] of record.chunks) for (let k = 0; k < rows.length / width; k++) yield [from + k * memory.step, rows.subarray(k * width, (k + 1) * width)];
}
function csv() {
  const parts = [`t_s,${memory.columns.join(",")}\n`];
  for (const [t, values] of saved()) parts.push(`${+t.toFixed(9)},${Array.from(values, value => +value.toPrecision(7)).join(",")}\n`);
  return new Blob(parts, { type: "text/csv" });
}
function save(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `tractive-${drive.system.id}.${name}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

function toolbar() {
  const named = words();
  const options = (id, list, value) => {
    $(id).replaceChildren(...list.map(([value, text]) => new Option(text, value)));
    $(id).value = list.some(([of]) => of === value) ? value : id === "window" ? "0.1" : "1";
  };
  options("window", WINDOWS.map(s => [String(s), s < 1 ? `${+(s * 1e3).toFixed(0)} ms` : `${s} s`]), named.get("window"));
  options("rate", RATES, named.get("rate"));
  if ([...$("trigger").options].some(({ value }) => value === named.get("trigger"))) $("trigger").value = named.get("trigger");
  const apply = () => {
    scope.window = +$("window").value;
    scope.trigger = $("trigger").value;
    scope.held = null;
    scope.paused = false;
    scope.triggered = -1;
    fresh = true;
    buttons();
  };
  const pace = () => tell({ type: "rate", value: +$("rate").value });
  $("window").onchange = $("trigger").onchange = () => { apply(); remember(); };
  $("rate").onchange = () => { pace(); remember(); };
  $("pause").onclick = () => { scope.paused = !scope.paused; if (!scope.paused) scope.held = null; buttons(); };
  $("record").onclick = () => {
    if (record?.runs) record.runs = false; else record = { runs: true, chunks: [], seconds: 0 };
    $("record").textContent = "Record";
    buttons();
  };
  $("csv").onclick = () => save(csv(), "csv");
  $("mcap").onclick = () => save(mcap(memory.columns, saved()), "mcap");
  globalThis.tractive = { run, csv, mcap: () => mcap(memory.columns, saved()), faults: properties.faults };
  if (remote) for (const id of ["rate-choice"]) $(id).hidden = true;
  $("help").innerHTML = `<h2>Keys</h2><table>${KEYS.map(([keys, text]) => `<tr><td>${keys.split(" ").map(key => `<kbd>${key}</kbd>`).join(" ")}</td><td>${text}</td></tr>`).join("")}</table><form method="dialog"><p><button>Close</button></p></form>`;
  apply();
  pace();
}

function fault(html) {
  if ($("fault").dataset.text === html) return;
  $("fault").dataset.text = html;
  $("fault").innerHTML = html;
  $("fault").hidden = !html;
}
const figure = value => (typeof value === "number" ? told(+value.toPrecision(4)) : value);
const STATES = { running: "good", enabled: "good", fault: "bad" };
function report() {
  const name = state.status?.state ?? "init", trip = state.trip;
  const text = trip ? `fault: ${trip.fault}` : name.replace("_", " ");
  if ($("state-name").textContent !== text) $("state-name").textContent = text;
  $("state").dataset.kind = trip ? "bad" : STATES[name] ?? "";
  if (trip) {
    const safe = { GatesOff: "gates off", ShortCircuit: "lower devices on", UpperShortCircuit: "upper devices on" }[trip.safe];
    const unit = properties.units[trip.fault], of = value => `${figure(value)}${unit ? ` ${unit}` : ""}`, refusal = state.status?.refusal ? ` <span>refused: ${state.status.refusal}</span>` : "";
    fault(`<b>${trip.fault}</b> <span>value ${of(trip.value)}, limit ${of(trip.limit)}</span> ${safe ? `<span>${safe}</span>` : ""}${refusal} <span>Mend the cause, then acknowledge.</span>`);
  } else if (memory) fault("");
  if ($("acknowledge").disabled !== !trip) buttons();
}

let frames = 0;
function frame() {
  requestAnimationFrame(frame);
  if (!fresh || !memory || memory.count === 0) return;
  fresh = false;
  tell({ type: "drawn" });
  scope.draw();
  report();
  // The small views by turns; the spectrum rarely.
  frames += 1;
  const { system } = drive, own = views.motorOf(memory, suffix(), properties);
  if (frames % 3 === 0) views.numbers(own, state, properties, factor, system);
  if (frames % 3 === 1) { if (own.has("id")) views.plane(own, properties, system); if (memory.hasEdges) views.pulses(own, memory, system); }
  if (frames % 3 === 2 && own.has("ia")) views.hexagon(own, properties, system);
  if (frames % 20 === 5 && own.has("ia")) { views.spectrum(own, properties, system, bound); tell({ type: "bound", motor }); }
  for (const figure of document.querySelectorAll("figure[data-needs]")) figure.hidden = !own.has(figure.dataset.needs);
  document.body.dataset.frames = frames;
  if (frames === 1) document.body.dataset.painted = performance.now().toFixed(0);
}

const nudge = (name, steps) => find(name).set?.(settings[name] + steps * find(name).step);
const view = k => { if (drive.system.motors[k]) { $("motor").value = k; $("motor").onchange(); } };
addEventListener("keydown", event => {
  const inControl = event.target.closest?.("input, select, textarea, dialog, summary");
  if (event.ctrlKey || event.metaKey || event.altKey || !scope) return;
  const far = event.shiftKey ? 100 : 10, up = event.shiftKey ? -1 : 1, n = suffix(), big = `${settings[`command${n}`]}${n}`, turning = settings[`rotor${n}`] === "held" ? `held${n}` : `load${n}`;
  const windows = by => { const at = WINDOWS.indexOf(+$("window").value) + by; if (WINDOWS[at]) { $("window").value = String(WINDOWS[at]); $("window").onchange(); } };
  const arrows = { ArrowUp: () => nudge(big, far), ArrowDown: () => nudge(big, -far), ArrowRight: () => nudge(turning, far), ArrowLeft: () => nudge(turning, -far), " ": () => $("pause").click() };
  const letters = {
    v: () => nudge("link", 10 * up), d: () => nudge("dead", up), f: () => nudge("map", 2 * up),
    "+": () => scope.move(0.5), "-": () => scope.move(2), ",": () => scope.move(1, -0.3), ".": () => scope.move(1, 0.3),
    e: () => act.press("on"), c: () => act.press("coast"), a: () => act.press("acknowledge"), r: () => act.press("restart"), m: () => act.press("mend"),
    0: () => find(big).set(0), 1: () => view(0), 2: () => view(1), "[": () => windows(-1), "]": () => windows(1), "?": () => $("help").showModal(),
  };
  const inButton = event.key === " " && event.target.closest?.("button");
  const does = inControl || inButton ? (inControl?.type === "range" && letters[event.key.toLowerCase()]) : arrows[event.key] ?? letters[event.key.toLowerCase()];
  if (does) { event.preventDefault(); does(); }
});
addEventListener("hashchange", () => location.reload());
