// A drive elsewhere, in place of the simulation: what it tells over CAN is asked of `cargo rig live`, which serves this as worker.js.

const PAUSE_MS = 30;
const LINES = { torque: "torque", speed: "speed" };
let armed = false, next = 0, answered = true, about = null, wanted = null;
const demands = [];
const AGAIN_MS = 700; // time after which an order that was not followed is given again
let ordered = 0, enabled = false;

const ask = async (path, options) => {
  const answer = await fetch(path, options);
  if (!answer.ok) throw new Error(`${path}: ${await answer.text()}`);
  return answer.json();
};
const say = async line => {
  if (armed) await ask("/line", { method: "POST", headers: { "X-Tractive": "line" }, body: line });
};
/** Both motors' demands in one line where there are two. */
const demand = name => `${LINES[name]} ${(about.system === "zs9" ? [0, 1] : [0]).map(k => demands[k]?.[0] === name ? demands[k][1] : 0).join(" ")}`;

const handlers = {
  async start({ set, want }) {
    for (const [name, motor, values] of set) if (name in LINES) demands[motor] = [name, values[0]];
    wanted = want;
    postMessage({ type: "started", properties: about.properties, columns: about.columns, scenarios: [] });
  },
  async set({ name, motor, values }) {
    if (!(name in LINES)) return;
    demands[motor] = [name, values[0]];
    await say(demand(name));
  },
  async want(now) {
    const was = wanted;
    wanted = now;
    ordered = 0;
    if (!now.on && was.on) await say("disable");
    if (now.coast !== was.coast) await say(`coast ${now.coast ? "on" : "off"}`);
  },
  async acknowledge() { await say("acknowledge"); },
  async arm({ value }) {
    armed = value;
    await ask("/arm", { method: "POST", headers: { "X-Tractive": "arm" }, body: value ? "on" : "off" });
    if (armed && demands[0]) await say(demand(demands[0][0]));
  },
  drawn() { answered = true; },
  rate() {}, bound() {}, mend() {}, inject() {},
};
onmessage = async ({ data }) => {
  try {
    await handlers[data.type](data);
  } catch (error) {
    postMessage({ type: "error", message: String(error?.message ?? error) });
  }
};

/** Charges and enables, one after the other, as the drive's state lets it. */
async function pursue(state) {
  if (!armed || !wanted?.on || performance.now() - ordered < AGAIN_MS) return;
  if (state === "ready") await say("charge");
  // Its rising edge counts.
  else if (state === "charged") { enabled = !enabled; await say(enabled ? "enable with-torque" : "disable"); }
  else return;
  ordered = performance.now();
}

async function look() {
  try {
    if (answered) {
      const told = await ask(`/rows?from=${next}`);
      if (told.rows.length) {
        next = told.from + told.rows.length / about.columns.length;
        answered = false;
        await pursue(told.state?.status?.state);
        postMessage({ type: "rows", from: told.from * about.step, rows: Float32Array.from(told.rows, value => value ?? NaN), edges: new Float64Array(), state: told.state ?? {}, factor: null });
      }
    }
  } catch (error) {
    postMessage({ type: "error", message: String(error?.message ?? error) });
    return;
  }
  setTimeout(look, PAUSE_MS);
}

about = await ask("/about");
postMessage({ type: "ready", remote: about });
look();
