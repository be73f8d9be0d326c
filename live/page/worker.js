// The simulation: steps the bench in real time, or as fast as it goes, and hands over what it saw.
import init, { Bench, Ran, scenarios } from "./tractive_live.js";

const SLICE_S = 0.002; // simulated at once
const BUSY_MS = 7; // computed at once
const LONGEST_LAG_S = 0.1; // what is later than this is let go
const LONGEST_AHEAD_S = 1; // further ahead of the page the bench waits for it, as where nobody looks
const FRAME_MS = 20; // between two frames as fast as it goes, at least: with what is computed at once, every second one of a screen’s sixty a second

let bench = null;
let rate = 1;
let last = 0; // wall time of the last turn, ms
let owed = 0; // simulated time that is due, s
let answered = true; // the page has drawn what it got
let began = 0;
let handed = { at: 0, wall: 0 }; // when rows were last handed over, in both times
const pace = { wall: 0, simulated: 0, busy: 0 };

const handlers = {
  start({ system, machine, words, speed, step, set, want }) {
    bench?.free();
    bench = null;
    bench = new Bench(system, machine, words, speed, step);
    bench.want(want.on, want.coast, want.discharge);
    for (const [name, motor, values] of set) bench.set(name, motor, Float64Array.from(values));
    began = handed.at = 0;
    owed = 0;
    last = performance.now();
    answered = true;
    postMessage({ type: "started", properties: JSON.parse(bench.properties()), columns: bench.columns(), scenarios: scenarios(system) });
  },
  set({ name, motor, values }) { bench?.set(name, motor, Float64Array.from(values)); },
  want({ on, coast, discharge }) { bench?.want(on, coast, discharge); },
  acknowledge() { bench?.acknowledge(); },
  inject({ value }) { bench?.inject(value); },
  mend() { bench?.mend(); },
  bound({ motor }) { if (bench) postMessage({ type: "bound", values: bench.bound(motor) }); },
  rate({ value }) { rate = value; owed = 0; },
  drawn() { answered = true; },
  scenario({ id, name, words }) {
    const from = performance.now();
    let ran;
    try {
      ran = new Ran(name, words);
    } catch (error) {
      postMessage({ type: "refused", id, message: String(error?.message ?? error) });
      return;
    }
    bench?.free();
    bench = null;
    const about = JSON.parse(ran.about()), rows = ran.rows(), edges = ran.edges();
    ran.free();
    postMessage({ type: "ran", id, name, ...about, rows, edges, seconds: (performance.now() - from) / 1e3 }, [rows.buffer, edges.buffer]);
  },
};

onmessage = ({ data }) => {
  try {
    handlers[data.type](data);
  } catch (error) {
    postMessage({ type: "error", message: String(error?.message ?? error) });
  }
};

function turn() {
  const now = performance.now();
  const passed = (now - last) / 1e3;
  last = now;
  if (bench) {
    try {
      advance(now, passed);
    } catch (error) {
      bench = null;
      postMessage({ type: "error", message: String(error?.message ?? error) });
    }
  }
  channel.port2.postMessage(null);
}

function advance(now, passed) {
  owed = rate === Infinity ? Infinity : Math.min(owed + rate * passed, Math.max(LONGEST_LAG_S, LONGEST_LAG_S * rate));
  let time = began;
  while (owed > 1e-6 && performance.now() - now < BUSY_MS && (answered || time - handed.at < LONGEST_AHEAD_S)) {
    const step = Math.min(owed, SLICE_S);
    time = bench.run(step);
    owed -= step;
  }
  pace.wall += passed;
  pace.simulated += time - began;
  pace.busy += (performance.now() - now) / 1e3;
  began = time;
  if (answered && (rate !== Infinity || performance.now() - handed.wall > FRAME_MS)) hand();
}

let factor = { reached: 0, possible: 0 };
function hand() {
  if (pace.wall > 0.5) {
    factor = { reached: pace.simulated / pace.wall, possible: pace.simulated / pace.busy };
    pace.wall = pace.simulated = pace.busy = 0;
  }
  handed = { at: began, wall: performance.now() };
  const from = bench.take();
  const rows = bench.rows(), edges = bench.edges();
  answered = false;
  postMessage({ type: "rows", from, rows, edges, state: JSON.parse(bench.state()), factor }, [rows.buffer, edges.buffer]);
}

// A message to itself comes sooner than a timer does; without work a timer gives the processor away.
const channel = new MessageChannel();
channel.port1.onmessage = () => {
  const idle = !bench || owed < 1e-6 || (!answered && began - handed.at >= LONGEST_AHEAD_S);
  if (idle) setTimeout(turn, 4); else turn();
};

await init({ module_or_path: new URL("tractive_live_bg.wasm", import.meta.url) });
postMessage({ type: "ready" });
last = performance.now();
turn();
