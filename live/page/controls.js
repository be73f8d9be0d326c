// The controls: what may be set, where it stands in the page and in the address.

const all = ({ sliders, choices, checks }) => [...sliders, ...choices, ...checks];

/** Settings out of the address, the others as at first. */
export function read(controls, words) {
  const settings = {};
  for (const { name, first, low, high, of } of all(controls)) {
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
export function write(controls, settings, more) {
  const words = new URLSearchParams();
  for (const [name, value] of Object.entries(more)) if (value) words.set(name, value);
  for (const { name, first } of all(controls)) {
    const value = settings[name];
    if (value !== first) words.set(name, value === true ? "1" : value === false ? "0" : value);
  }
  history.replaceState(null, "", words.size ? `#${words}` : location.pathname + location.search);
}

export const element = (tag, attributes = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
};
export const select = (id, list, value, attributes = {}) => {
  const made = element("select", { id, ...attributes }, ...list.map(([of, text]) => new Option(text, of)));
  if (list.some(([of]) => of === value)) made.value = value;
  return made;
};

/** Builds them; `act` is told of what is done. */
export function build(host, { controls, settings, kinds, faults, scenarios, remote }, act) {
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
    button("on", remote ? "Start" : "Stop", "Key E", "main"), button("coast", "Coast", "Key C: gates off, caught again"), button("acknowledge", "Acknowledge", "Key A: the fault was seen", "bad"),
    ...(remote ? [] : [button("restart", "Restart", "Key R: switched off and on again")])));
  if (remote) {
    const arm = element("input", { type: "checkbox", id: "arm", disabled: !remote.commands, onchange: () => act.arm(arm.checked) });
    group("Drive").append(element("label", { className: "check" }, arm, "commands are sent"),
      element("p", { className: "hint", textContent: remote.commands ? "Nothing is sent to the drive until this is ticked." : "This page only looks: `cargo rig live --commands` permits commands." }));
  }
  const sync = () => shown.forEach(([row, when]) => (row.hidden = !when(settings)));
  const wanted = of => !remote || of.group.startsWith("Command");
  for (const { name, group: of, of: values, text, select: chooses } of controls.choices.filter(wanted)) {
    const change = value => { settings[name] = value; sync(); act.change(name); };
    if (chooses) {
      const box = select(`s-${name}`, values, settings[name], { onchange: () => change(box.value) });
      group(of).append(element("label", { className: "check" }, text, box));
      continue;
    }
    const row = element("div", { className: "choice", role: "radiogroup" });
    row.setAttribute("aria-label", text ?? of);
    for (const [value, label] of values) {
      const input = element("input", { type: "radio", name, value, checked: settings[name] === value, onchange: () => change(value) });
      row.append(element("label", {}, input, label));
    }
    group(of).append(row);
  }
  for (const slider of controls.sliders.filter(wanted)) {
    const { name, text, low, high, step, unit, when } = slider, id = `s-${name}`;
    const output = element("output", { htmlFor: id });
    const tell = () => (output.textContent = `${String(+settings[name].toPrecision(6)).replace("-", "−")} ${unit}`);
    const input = element("input", { id, type: "range", min: low, max: high, step, value: settings[name] });
    input.oninput = () => { settings[name] = +input.value; tell(); if (!slider.restart) act.change(name); };
    input.onchange = () => { if (slider.restart) act.change(name); };
    const row = element("div", { className: "row" }, element("label", { htmlFor: id, textContent: text }), output, input);
    slider.set = value => { input.value = value; settings[name] = +input.value; tell(); act.change(name); };
    tell();
    if (when) shown.push([row, when]);
    group(slider.group).append(row);
  }
  for (const { name, group: of, text } of controls.checks.filter(wanted)) {
    const input = element("input", { type: "checkbox", checked: settings[name], onchange: () => { settings[name] = input.checked; act.change(name); } });
    group(of).append(element("label", { className: "check" }, input, text), " ");
  }
  sync();
  if (remote) return;
  const wrong = group("Faults");
  wrong.classList.add("faults");
  wrong.append(element("div", { className: "buttons" }, button("mend", "Mend all", "Key M: what was injected is mended")));
  for (const [k, [kind, is]] of kinds.entries()) {
    const buttons = faults.filter(is).map(name => element("button", { type: "button", textContent: name, onclick: () => act.inject(name) }));
    buttons.forEach(made => (made.dataset.fault = made.textContent));
    wrong.append(element("details", { open: k === 2 }, element("summary", { textContent: kind }), element("div", { className: "buttons" }, ...buttons)));
  }
  group("Scenario").append(
    element("p", { className: "hint", textContent: "One of the rig’s scenarios in this page, on its ordinary bench, shown in the scope, with the SHA-256 of its trace.csv." }),
    element("div", { className: "buttons" }, select("scenario", scenarios.map(name => [name, name]), scenarios[0], { ariaLabel: "Scenario" }), button("run", "Run", "From its beginning to its end"),
      button("free", "Drive on", "Back to free driving")),
    element("p", { className: "sum", id: "sum", role: "status" }));
}

export const KEYS = [
  ["↑ ↓", "command up, down (with Shift ten times as far)"], ["← →", "held speed, or load, down, up"], ["0", "command to zero"], ["1 2", "the motor that keys and views are about"],
  ["V D F", "line voltage, dead time, true flux over the map up (with Shift down)"],
  ["E", "start, stop"], ["C", "coast, catch"], ["A", "acknowledge the fault"], ["R", "restart"], ["M", "mend what was injected"],
  ["Space", "pause the scope, go on"], ["[ ]", "shorter, longer window"], ["+ - , .", "the paused scope closer, wider, earlier, later"], ["?", "this list"],
];
