// The systems that can be driven: their machines, what may be set, and what the scope shows of them.

const MACHINES = {
  "pmasynrm-180kw": { system: "pmasynrm", text: "180 kW PMaSynRM, 1,500 V", torque: 1235, speed: 4500, link: [900, 2100, 1500], inertia: [1, 50, 5], at: [600, 1000, 1500], noise: 3, dead: 10, least: 1 },
  "pmsm-48v-1kw": { system: "pmasynrm", text: "1 kW PMSM, 48 V", torque: 2.38, speed: 6000, link: [38, 60, 48], inertia: [0.0005, 0.02, 0.002], at: [1.2, 2000, 2500], noise: 0.5, dead: 1, least: 0.04 },
  "ipm-zs9": { system: "zs9", text: "two IPM motors, 12.6 kW each", torque: 120, speed: 1500, link: [300, 500, 400], inertia: [0.02, 1, 0.1], at: [60, 800, 800], noise: 1, dead: 2, least: 0.2 },
};
const SCHEMES = ["s", "rs", "rthd", "zvo", "rthd-central", "rthd-slide"];
const LINE = "Line and machine";
const step = value => { const decade = 10 ** Math.floor(Math.log10(value)); return decade * [1, 2, 5, 10].find(k => k * decade >= value); };

/** Command and rotor of a motor; `n` is its number where there are two. */
function motor(machine, n, k) {
  const command = n ? `Command, motor ${n}` : "Command", rotor = n ? `Rotor, motor ${n}` : "Rotor", [torque, held, speed] = machine.at, sign = k ? -1 : 1;
  const fine = step(machine.torque / 250), choice = `command${n}`, turning = `rotor${n}`;
  return {
    choices: [
      { name: choice, group: command, of: [["torque", "Torque"], ["speed", "Speed"]], first: "torque" },
      { name: turning, group: rotor, of: [["held", "Held"], ["free", "Free"]], first: "held" },
    ],
    sliders: [
      { name: `torque${n}`, group: command, text: "Torque", low: -machine.torque, high: machine.torque, step: fine, unit: "N·m", first: n ? sign * torque / (k + 1) : torque, when: s => s[choice] === "torque", order: choice },
      { name: `speed${n}`, group: command, text: "Speed", low: -machine.speed, high: machine.speed, step: 10, unit: "r/min", first: speed, when: s => s[choice] === "speed", order: choice },
      { name: `held${n}`, group: rotor, text: "Held at", low: -machine.speed, high: machine.speed, step: 10, unit: "r/min", first: held, when: s => s[turning] === "held", order: turning },
      { name: `inertia${n}`, group: rotor, text: "Inertia", low: machine.inertia[0], high: machine.inertia[1], step: machine.inertia[0] / 2, unit: "kg·m²", first: machine.inertia[2], when: s => s[turning] === "free", order: turning },
      { name: `load${n}`, group: rotor, text: "Load", low: -machine.torque, high: machine.torque, step: fine, unit: "N·m", first: 0, when: s => s[turning] === "free", order: turning },
    ],
    orders: {
      [choice]: s => (s[choice] === "torque" ? ["torque", k, [s[`torque${n}`]]] : ["speed", k, [s[`speed${n}`]]]),
      [turning]: s => (s[turning] === "held" ? ["hold", k, [s[`held${n}`]]] : ["release", k, [s[`inertia${n}`], s[`load${n}`]]]),
    },
  };
}

/** What both systems have of line and machine. */
const common = machine => [
  { name: "link", group: LINE, text: machine.system === "zs9" ? "Source voltage" : "Line voltage", low: machine.link[0], high: machine.link[1], step: step((machine.link[1] - machine.link[0]) / 250), unit: "V", first: machine.link[2], order: "link" },
  { name: "map", group: LINE, text: "True flux over the map", low: -20, high: 20, step: 0.5, unit: "%", first: 0, order: "map" },
  { name: "dead", group: LINE, text: "Dead time", low: 0, high: machine.dead, step: machine.dead / 20, unit: "µs", first: 0, restart: true },
  { name: "noise", group: LINE, text: "Current noise, rms", low: 0, high: machine.noise, step: machine.noise / 30, unit: "A", first: 0, restart: true },
];
const faults = (numbered, sensors) => [
  ["Current sensors", name => name.startsWith("current-")], ["Angle sensor", name => name.startsWith("angle-")],
  [sensors, name => /^(link|source|capacitors|network)-/.test(name)], ["Gates and devices", name => /^([uvw][hml]-|leg-|shoot-)/.test(name)],
  ["Interrupts and rotor", name => /^(control-late|commands-lost|demand-not-finite|overspeed)/.test(name)], ["Another machine", name => /^(flux|resistance)-/.test(name)],
];
const SAMPLES = { name: "samples", group: "Scope", of: [["20", "20 kHz"], ["50", "50 kHz"]], first: "20", restart: true };
const level3 = (state, leg) => (state >> (2 * leg) & 1 ? 1 : state >> (2 * leg + 1) & 1 ? 0 : 0.5);
const on = (state, gate) => state >> gate & 1;

/** Line voltage u–v as a share of the link; a leg without a gate that is on has its diodes', which the current chooses. */
function share2(state, current) {
  const leg = k => { const level = level3(state, k); return level !== 0.5 ? level : Math.abs(current[k]) < 0.02 * current[3] ? NaN : current[k] > 0 ? 0 : 1; };
  return leg(0) - leg(1);
}
/** Of the ZS9: the upper motor's terminals are between upper and middle gates, the lower one's between middle and lower ones. */
const share9 = lower => state => {
  if (!state || [0, 1, 2].some(leg => on(state, leg) && on(state, leg + 3) && on(state, leg + 6))) return state ? 0 : NaN;
  const leg = k => (lower ? 1 - on(state, k + 6) : on(state, k));
  return leg(0) - leg(1);
};

const PMASYNRM = {
  id: "pmasynrm", title: "PMaSynRM, one motor on a two-level inverter", motors: [{ suffix: "" }],
  modes: ["off", "async", "sync 15", "sync 12", "mid 7", "mid 3", "square"],
  lanes: [0, 1, 2].map(leg => ({ name: "uvw"[leg], colour: ["--u", "--v", "--w"][leg], level: state => level3(state, leg) })),
  isFree: state => [0, 1, 2].some(leg => level3(state, leg) === 0.5),
  cycle: null, top: 3000, repeats: true, voltage: 2 / Math.PI,
  plots: [
    { title: "Phase currents, A", height: 196, least: 20, series: [["ia", "u", "--u"], ["ib", "v", "--v"], ["ic", "w", "--w"], ["peak", "peak", "--u"]] },
    { title: "Torque, N·m", height: 140, least: 50, series: [["te", "T", "--torque"], ["teRef", "T*", "--ref", [5, 4]]] },
    { title: "Speed, r/min", height: 92, least: 50, series: [["speed", "n", "--speed"]] },
    { title: "Link voltage, V", height: 92, least: 50, series: [["udc", "U", "--link"]] },
    { title: "Line voltage, V", height: 92, lines: [["u–v", "--u", share2]] },
    { title: "Gates and mode", height: 132, gates: true, series: [] },
  ],
  triggers: [["ia", "current u ↑"], ["te", "torque demand steps"], ["mode", "mode changes"], ["fault", "fault"]],
  numbers: ["Torque", "Speed", "Power", "Link", "Current, peak", "Frequency", "Of six-step", "Map error"],
  controls(machine) {
    const one = motor(machine, "", 0);
    return {
      sliders: [...one.sliders, ...common(machine)], choices: [...one.choices, SAMPLES],
      checks: [
        { name: "compensate", group: LINE, text: "dead time compensated", first: true, restart: true },
        { name: "filter", group: LINE, text: "line filter 3 mH, 30 mΩ", first: false, restart: true },
      ],
      orders: { ...one.orders, link: s => ["line", 0, [s.link]], map: s => ["map", 0, [s.map]] },
      words: s => ["--udc", s.link, "--dead-time-us", s.dead, "--noise-a", s.noise, ...(s.compensate ? [] : ["--uncompensated"]), ...(s.filter ? ["--line", "3,4,30"] : [])],
    };
  },
  faults: faults("", "Line"),
};

const two = (title, height, least, ...series) => ({ title, height, least, series });
const ZS9 = {
  id: "zs9", title: "ZS9: two motors on a Z-source nine-switch inverter", motors: [{ suffix: "1", text: "motor 1" }, { suffix: "2", text: "motor 2" }],
  modes: ["off", ...SCHEMES],
  lanes: ["uH", "vH", "wH", "uM", "vM", "wM", "uL", "vL", "wL"].map((name, gate) => ({ name, colour: ["--u", "--v", "--w"][gate % 3], level: state => on(state, gate) })),
  isFree: () => false,
  cycle: 2e-4, top: 25_000, repeats: false, voltage: 1 / Math.sqrt(3),
  plots: [
    two("Currents of motor 1, A", 140, 8, ["ia1", "u", "--u"], ["ib1", "v", "--v"], ["ic1", "w", "--w"], ["peak1", "peak", "--u"]),
    two("Currents of motor 2, A", 140, 8, ["ia2", "u", "--u"], ["ib2", "v", "--v"], ["ic2", "w", "--w"], ["peak2", "peak", "--w"]),
    two("Torques, N·m", 140, 8, ["te1", "T1", "--torque"], ["teRef1", "T1*", "--ref", [5, 4]], ["te2", "T2", "--link"], ["teRef2", "T2*", "--ref", [2, 3]]),
    two("Speeds, r/min", 92, 20, ["speed1", "n1", "--speed"], ["speed2", "n2", "--link"]),
    two("Z-source, V", 110, 20, ["udc", "link", "--link"], ["capacitor", "capacitors", "--flux"], ["source", "source", "--speed"]),
    two("Inductor current, A; shoot-through, %", 92, 10, ["inductor", "A", "--w"], ["duty", "%", "--v"]),
    { title: "Line voltage of motor 1, V", height: 84, lines: [["u–v", "--u", share9(false)]] },
    { title: "Line voltage of motor 2, V", height: 84, lines: [["u–v", "--w", share9(true)]] },
    { title: "Gates and scheme", height: 190, gates: true, series: [] },
  ],
  triggers: [["ia1", "current u of motor 1 ↑"], ["ia2", "current u of motor 2 ↑"], ["te", "torque demand steps"], ["mode", "scheme changes"], ["fault", "fault"]],
  numbers: ["Torque", "Speed", "Power", "Link", "Current, peak", "Frequency", "Of its share", "Capacitors", "Shoot-through"],
  controls(machine) {
    const [one, other] = [motor(machine, "1", 0), motor(machine, "2", 1)];
    return {
      sliders: [...one.sliders, ...other.sliders,
        { name: "uin", group: LINE, text: "Link voltage wanted", low: 500, high: 800, step: 5, unit: "V", first: 667, order: "uin" }, ...common(machine)],
      choices: [...one.choices, ...other.choices,
        { name: "scheme", group: LINE, text: "Zero vectors", select: true, of: SCHEMES.map(name => [name, name]), first: "rthd", order: "scheme" },
        { name: "carrier", group: LINE, of: [["10000", "10 kHz"], ["20000", "20 kHz"]], first: "10000", restart: true }, SAMPLES],
      checks: [],
      orders: {
        ...one.orders, ...other.orders, link: s => ["line", 0, [s.link]], map: s => ["map", 0, [s.map]], uin: s => ["link", 0, [s.uin]],
        scheme: s => ["scheme", 0, [SCHEMES.indexOf(s.scheme)]],
      },
      words: s => ["--udc", s.link, "--uin", Math.max(s.uin, s.link), "--scheme", s.scheme, "--carrier-hz", s.carrier, "--dead-time-us", s.dead, "--noise-a", s.noise],
    };
  },
  faults: faults("1", "Source and network"),
};

export const SYSTEMS = { pmasynrm: PMASYNRM, zs9: ZS9 };
export const machines = system => Object.entries(MACHINES).filter(([, machine]) => machine.system === system).map(([name, { text }]) => [name, text]);

/** The system and machine that the address names, or the first ones; `fixed` where a drive elsewhere says which it is. */
export function chosen(words, fixed) {
  const system = SYSTEMS[fixed?.system ?? words.get("system")] ?? PMASYNRM;
  const named = MACHINES[fixed?.machine ?? words.get("machine")], name = named?.system === system.id ? fixed?.machine ?? words.get("machine") : machines(system.id)[0][0];
  return { system, name, machine: MACHINES[name], controls: system.controls(MACHINES[name]) };
}
