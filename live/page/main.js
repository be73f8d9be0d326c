// The page: starts the simulation in its worker, hands it what is set, and draws what comes back.
import { CHECKS, KEYS, SLIDERS, build, read, write } from "./controls.js";
import { Memory, Scope, WINDOWS } from "./scope.js";
import * as views from "./views.js";

const $ = id => document.getElementById(id);
const STEP_S = 50e-6;
const RATES = [["0.001", "1/1000"], ["0.01", "1/100"], ["0.1", "1/10"], ["1", "real time"], ["5", "5 ×"], ["Infinity", "fastest"]];

const worker = new Worker("worker.js", { type: "module" });
const tell = message => worker.postMessage(message);
const set = (name, value) => tell({ type: "set", name, value });
const settings = read();
const wanted = { on: true, coast: false, discharge: false };
let memory = null, scope = null, properties = null, state = {}, factor = { reached: 0, possible: 0 }, fresh = false, injected = "";

/** Everything that stands in the page, as the bench is told it. */
const orders = {
  command: () => (settings.command === "torque" ? set("torque", settings.torque) : set("speed", settings.speed)),
  rotor: () => (settings.rotor === "held" ? set("hold", settings.held) : set("release", [settings.inertia, settings.load])),
  link: () => set("line", settings.link),
  map: () => set("mapError", settings.map),
};
const order = { torque: orders.command, speed: orders.command, command: orders.command, held: orders.rotor, inertia: orders.rotor, load: orders.rotor, rotor: orders.rotor, link: orders.link, map: orders.map };

function start() {
  const words = ["--udc", settings.link, "--dead-time-us", settings.dead, "--noise-a", settings.noise].map(String);
  if (!settings.compensate) words.push("--uncompensated");
  if (settings.filter) words.push("--line", "3,4,30");
  const speed = settings.rotor === "held" ? settings.held : memory?.last("speed") ?? 0;
  memory = null;
  tell({ type: "start", words, speed, step: STEP_S, set: [
    ["want", wanted],
    settings.rotor === "held" ? ["hold", settings.held] : ["release", [settings.inertia, settings.load]],
    settings.command === "torque" ? ["torque", settings.torque] : ["speed", settings.speed],
    ["mapError", settings.map],
  ] });
}

const act = {
  change(name) {
    const restarts = [...SLIDERS, ...CHECKS].find(of => of.name === name)?.restart;
    if (restarts) start(); else order[name]();
    remember();
  },
  press(id) {
    ({
      on: () => { wanted.on = !wanted.on; set("want", wanted); },
      coast: () => { wanted.coast = !wanted.coast; set("want", wanted); },
      acknowledge: () => set("acknowledge"),
      restart: start,
      // An interrupt that has stopped comes again with the processor's restart alone.
      mend: () => { if (injected === "commands-lost") start(); else { set("mend"); orders.map(); } injected = ""; },
      sweep: () => { $("sweep").disabled = true; $("sum").textContent = "running …"; tell({ type: "sweep" }); },
    })[id]();
    buttons();
  },
  inject(name) { injected = name; set("inject", name); },
};
function remember() {
  write(settings, { window: $("window").value === "0.1" ? "" : $("window").value, trigger: $("trigger").value, rate: $("rate").value === "1" ? "" : $("rate").value });
}
function buttons() {
  $("on").textContent = wanted.on ? "Stop" : "Start";
  $("coast").setAttribute("aria-pressed", wanted.coast);
  $("pause").setAttribute("aria-pressed", scope?.paused ?? false);
  $("pause").textContent = scope?.paused ? "Go on" : "Pause";
  $("acknowledge").disabled = !state.trip;
}

worker.onmessage = ({ data }) => ({
  ready: start,
  started() {
    properties = data.properties;
    memory = new Memory(data.columns, STEP_S);
    if (scope) scope.reset(memory);
    else {
      build($("controls"), settings, properties.faults, act);
      scope = new Scope($("plots"), memory);
      scope.onzoom = () => { if (!scope.held) scope.paused = false; buttons(); };
      toolbar();
      requestAnimationFrame(frame);
    }
    buttons();
  },
  rows() {
    if (memory) memory.put(data.from, data.rows, data.edges);
    [state, factor, fresh] = [data.state, data.factor, true];
  },
  sweep() {
    $("sweep").disabled = false;
    $("sum").dataset.sha256 = data.sha256;
    $("sum").textContent = `trace.csv, ${data.bytes.toLocaleString("en")} bytes, in ${data.seconds.toFixed(1)} s: SHA-256 ${data.sha256}`;
  },
  error() { fault(`<b>The bench has stopped</b> <span>${data.message.replace(/[<&]/g, "")}</span> <span>Restart goes on.</span>`); },
})[data.type]();

function toolbar() {
  const words = new URLSearchParams(location.hash.slice(1));
  const options = (id, list, value) => {
    $(id).replaceChildren(...list.map(([value, text]) => new Option(text, value)));
    $(id).value = list.some(([of]) => of === value) ? value : id === "window" ? "0.1" : "1";
  };
  options("window", WINDOWS.map(s => [String(s), s < 1 ? `${+(s * 1e3).toFixed(0)} ms` : `${s} s`]), words.get("window"));
  options("rate", RATES, words.get("rate"));
  if ([...$("trigger").options].some(({ value }) => value === words.get("trigger"))) $("trigger").value = words.get("trigger");
  const apply = () => {
    scope.window = +$("window").value;
    scope.trigger = $("trigger").value;
    scope.held = null;
    scope.paused = false;
    scope.triggered = -1;
    buttons();
  };
  const pace = () => tell({ type: "rate", value: +$("rate").value });
  $("window").onchange = $("trigger").onchange = () => { apply(); remember(); };
  $("rate").onchange = () => { pace(); remember(); };
  $("pause").onclick = () => { scope.paused = !scope.paused; if (!scope.paused) scope.held = null; buttons(); };
  $("csv").onclick = () => {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(memory.csv()), download: "tractive-live.csv" });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  };
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
const figure = value => (typeof value === "number" ? +value.toPrecision(4) : value);
const STATES = { running: "good", enabled: "good", fault: "bad" };
function report() {
  const name = state.status?.state ?? "init", trip = state.trip;
  const text = trip ? `fault: ${trip.fault}` : name.replace("_", " ");
  if ($("state-name").textContent !== text) $("state-name").textContent = text;
  $("state").dataset.kind = trip ? "bad" : STATES[name] ?? "";
  if (trip) {
    const safe = { GatesOff: "gates off", ShortCircuit: "lower devices on", UpperShortCircuit: "upper devices on" }[trip.safe] ?? trip.safe;
    const refusal = state.status?.refusal ? ` <span>refused: ${state.status.refusal}</span>` : "";
    fault(`<b>${trip.fault}</b> <span>value ${figure(trip.value)}, limit ${figure(trip.limit)}</span> <span>${safe}</span>${refusal} <span>Mend the cause, then acknowledge.</span>`);
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
  if (frames % 3 === 0) views.numbers(memory, state, properties, factor);
  if (frames % 3 === 1) { views.plane(memory, properties); views.pulses(memory); }
  if (frames % 3 === 2) views.hexagon(memory, properties);
  if (frames % 20 === 5) views.spectrum(memory);
  if (frames === 1) document.body.dataset.painted = performance.now().toFixed(0);
}

const slider = name => SLIDERS.find(of => of.name === name);
const nudge = (name, steps) => slider(name).set(settings[name] + steps * slider(name).step);
addEventListener("keydown", event => {
  const inControl = event.target.closest?.("input, select, textarea, dialog, summary");
  if (event.ctrlKey || event.metaKey || event.altKey || !scope) return;
  const far = event.shiftKey ? 100 : 10, big = settings.command === "torque" ? "torque" : "speed", turning = settings.rotor === "held" ? "held" : "load";
  const windows = by => { const at = WINDOWS.indexOf(+$("window").value) + by; if (WINDOWS[at]) { $("window").value = String(WINDOWS[at]); $("window").onchange(); } };
  const arrows = { ArrowUp: () => nudge(big, far), ArrowDown: () => nudge(big, -far), ArrowRight: () => nudge(turning, far), ArrowLeft: () => nudge(turning, -far), " ": () => $("pause").click() };
  const letters = {
    e: () => act.press("on"), c: () => act.press("coast"), a: () => act.press("acknowledge"), r: () => act.press("restart"), m: () => act.press("mend"),
    0: () => slider(big).set(0), "[": () => windows(-1), "]": () => windows(1), "?": () => $("help").showModal(),
  };
  const inButton = event.key === " " && event.target.closest?.("button");
  const does = inControl || inButton ? (inControl?.type === "range" && letters[event.key.toLowerCase()]) : arrows[event.key] ?? letters[event.key.toLowerCase()];
  if (does) { event.preventDefault(); does(); }
});
addEventListener("hashchange", () => location.reload());
