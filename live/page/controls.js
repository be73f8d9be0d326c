// The controls: what may be set, where it stands in the page and in the address.

/** Settings: name, words, least, most, step, unit, value at first; `restart` where the drive has to be configured anew. */
export const SLIDERS = [
  { name: "torque", group: "Command", text: "Torque", low: -1235, high: 1235, step: 5, unit: "N·m", first: 600, when: s => s.command === "torque" },
  { name: "speed", group: "Command", text: "Speed", low: -4000, high: 4000, step: 10, unit: "r/min", first: 1500, when: s => s.command === "speed" },
  { name: "held", group: "Rotor", text: "Held at", low: -4500, high: 4500, step: 10, unit: "r/min", first: 1000, when: s => s.rotor === "held" },
  { name: "inertia", group: "Rotor", text: "Inertia", low: 1, high: 50, step: 0.5, unit: "kg·m²", first: 5, when: s => s.rotor === "free" },
  { name: "load", group: "Rotor", text: "Load", low: -1200, high: 1200, step: 5, unit: "N·m", first: 0, when: s => s.rotor === "free" },
  { name: "link", group: "Line and machine", text: "Line voltage", low: 900, high: 2100, step: 5, unit: "V", first: 1500 },
  { name: "map", group: "Line and machine", text: "True flux over the map", low: -20, high: 20, step: 0.5, unit: "%", first: 0 },
  { name: "dead", group: "Line and machine", text: "Dead time", low: 0, high: 10, step: 0.5, unit: "µs", first: 0, restart: true },
  { name: "noise", group: "Line and machine", text: "Current noise, rms", low: 0, high: 3, step: 0.1, unit: "A", first: 0, restart: true },
];
export const CHOICES = [
  { name: "command", group: "Command", of: [["torque", "Torque"], ["speed", "Speed"]], first: "torque" },
  { name: "rotor", group: "Rotor", of: [["held", "Held"], ["free", "Free"]], first: "held" },
];
export const CHECKS = [
  { name: "compensate", group: "Line and machine", text: "dead time compensated", first: true, restart: true },
  { name: "filter", group: "Line and machine", text: "line filter 3 mH, 30 mΩ", first: false, restart: true },
];
/** Faults by their kinds; the names are those of the campaign. */
const KINDS = [
  ["Current sensors", name => name.startsWith("current-")], ["Angle sensor", name => name.startsWith("angle-") && !name.endsWith("at-rest")],
  ["Line", name => name.startsWith("link-")], ["Gates and devices", name => /^([uvw][hl]-|leg-)/.test(name)],
  ["Interrupts and rotor", name => ["control-late", "commands-lost", "demand-not-finite", "overspeed"].includes(name)],
  ["Another machine", name => name.startsWith("flux-")],
];

const all = [...SLIDERS, ...CHOICES, ...CHECKS];

/** Settings out of the address, the others as at first. */
export function read() {
  const words = new URLSearchParams(location.hash.slice(1)), settings = {};
  for (const { name, first, low, high, of } of all) {
    const word = words.get(name);
    settings[name] = first;
    if (word === null) continue;
    if (typeof first === "number" && Number.isFinite(+word)) settings[name] = Math.min(Math.max(+word, low), high);
    if (typeof first === "boolean") settings[name] = word === "1";
    if (of?.some(([value]) => value === word)) settings[name] = word;
  }
  return settings;
}
/** Settings into the address; those that are as at first are left out. */
export function write(settings, more) {
  const words = new URLSearchParams();
  for (const { name, first } of all) {
    const value = settings[name];
    if (value !== first) words.set(name, value === true ? "1" : value === false ? "0" : value);
  }
  for (const [name, value] of Object.entries(more)) if (value) words.set(name, value);
  history.replaceState(null, "", words.size ? `#${words}` : location.pathname + location.search);
}

const element = (tag, attributes = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
};

/** Builds them; `act` is told of what is done. */
export function build(host, settings, faults, act) {
  const groups = new Map(), shown = [];
  host.replaceChildren();
  const group = name => {
    if (!groups.has(name)) {
      const set = element("fieldset", {}, element("legend", { textContent: name }));
      groups.set(name, set);
      host.append(set);
    }
    return groups.get(name);
  };
  const button = (id, text, title, className = "") => element("button", { id, textContent: text, title, className, type: "button", onclick: () => act.press(id) });
  group("Drive").append(element("div", { className: "buttons" },
    button("on", "Stop", "Key E", "main"), button("coast", "Coast", "Key C: gates off, caught again"), button("acknowledge", "Acknowledge", "Key A: the fault was seen", "bad"),
    button("restart", "Restart", "Key R: switched off and on again")));
  const sync = () => shown.forEach(([row, when]) => (row.hidden = !when(settings)));
  for (const { name, group: of, of: values } of CHOICES) {
    const row = element("div", { className: "choice", role: "radiogroup" });
    row.setAttribute("aria-label", of);
    for (const [value, text] of values) {
      const input = element("input", { type: "radio", name, value, checked: settings[name] === value, onchange: () => { settings[name] = value; sync(); act.change(name); } });
      row.append(element("label", {}, input, text));
    }
    group(of).append(row);
  }
  for (const slider of SLIDERS) {
    const { name, text, low, high, step, unit, when } = slider, id = `s-${name}`;
    const output = element("output", { htmlFor: id });
    const tell = () => (output.textContent = `${String(settings[name]).replace("-", "−")} ${unit}`);
    const input = element("input", { id, type: "range", min: low, max: high, step, value: settings[name] });
    input.oninput = () => { settings[name] = +input.value; tell(); if (!slider.restart) act.change(name); };
    input.onchange = () => { if (slider.restart) act.change(name); };
    const row = element("div", { className: "row" }, element("label", { htmlFor: id, textContent: text }), output, input);
    slider.set = value => { input.value = value; settings[name] = +input.value; tell(); act.change(name); };
    tell();
    if (when) shown.push([row, when]);
    group(slider.group).append(row);
  }
  for (const { name, group: of, text } of CHECKS) {
    const input = element("input", { type: "checkbox", checked: settings[name], onchange: () => { settings[name] = input.checked; act.change(name); } });
    group(of).append(element("label", { className: "check" }, input, text), " ");
  }
  const wrong = group("Faults");
  wrong.classList.add("faults");
  wrong.append(element("div", { className: "buttons" }, button("mend", "Mend all", "Key M: what was injected is mended")));
  for (const [k, [kind, is]] of KINDS.entries()) {
    const buttons = faults.filter(is).map(name => element("button", { type: "button", textContent: name, onclick: () => act.inject(name) }));
    buttons.forEach(made => (made.dataset.fault = made.textContent));
    wrong.append(element("details", { open: k === 2 }, element("summary", { textContent: kind }), element("div", { className: "buttons" }, ...buttons)));
  }
  group("Figure 9’s sweep").append(
    element("p", { className: "hint", textContent: "The scenario `sweep` in this page, on its ordinary bench: the SHA-256 of its trace.csv is that of `cargo rig run sweep`." }),
    element("div", { className: "buttons" }, button("sweep", "Run the sweep", "9 s of simulated time")), element("p", { className: "sum", id: "sum" }));
  document.getElementById("sum").setAttribute("role", "status");
  sync();
}

export const KEYS = [
  ["↑ ↓", "command up, down (with Shift ten times as far)"], ["← →", "held speed, or load, down, up"], ["0", "command to zero"],
  ["E", "start, stop"], ["C", "coast, catch"], ["A", "acknowledge the fault"], ["R", "restart"], ["M", "mend what was injected"],
  ["Space", "pause the scope"], ["[ ]", "shorter, longer window"], ["?", "this list"],
];
