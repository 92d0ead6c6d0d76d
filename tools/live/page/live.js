// The page: what comes over the socket is shown, what is changed goes over it. The run decides; every page that is open
// shows the same.
"use strict";

const element = (id) => document.getElementById(id);
const QUANTITIES = ["speed", "density", "pressure", "region", "score"];
const UNITS = { speed: "m/s", density: "kg/m³", pressure: "Pa", region: "", score: "|error| / tolerance" };

// For tests and for the console: what this page has seen.
const live = { drawn: 0, scene: null, status: null, scores: null, picture: null };

let held = 0;  // where the cup that is dragged was
const view = new View(element("canvas"), (container, degrees, first) => {
  if (first) held = live.status?.degrees?.[container.name] ?? 0;
  tilt(container, held + degrees);
});
const past = new PictureHistory(element("time"), element("now"), element("shown"), (picture, quantity) => {
  view.show(picture, quantity === "score" && !live.scores ? "unknown" : quantity);
  legend(picture, quantity);
});
const curves = new Curves(element);
let socket, undrawn = 0;
live.warned = new Set();

function connect() {
  const address = new URL("socket", location.href);
  address.protocol = address.protocol.replace("http", "ws");
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => document.querySelectorAll("#messages .lost").forEach((one) => one.remove());
  socket.onmessage = ({ data }) => (typeof data === "string" ? told(JSON.parse(data)) : pictured(data));
  socket.onclose = () => {
    if (!document.querySelector("#messages .lost"))
      say("The run has ended, or the connection is lost. This page tries again every second; a new run has a new address.", "error lost", 0);
    setTimeout(connect, 1000);
  };
}

function ask(what, more = {}) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ do: what, ...more }));
}

function pictured(buffer) {
  const picture = readPicture(buffer);
  live.picture = picture;
  past.add(buffer, picture, QUANTITIES[picture.quantity]);
  ++undrawn;
}

function frame() {
  view.draw();
  // Said after drawing: whoever is slow, or hidden, gets no more pictures than it draws.
  if (undrawn) {
    live.drawn += undrawn;
    for (; undrawn > 0; --undrawn) if (socket.readyState === WebSocket.OPEN) socket.send("drawn");
  }
  requestAnimationFrame(frame);
}

const tell = {
  scene: showScene,
  status: showStatus,
  scores(message) {
    live.scores = message;
    const largest = message.largest === undefined ? "not finite" : message.largest.toPrecision(3);
    element("scores").textContent = message.field
      ? `at ${message.time.toFixed(4)} s: largest ${largest}, ${message.field} of particle ${message.particle}` : "";
  },
  note: (message) => say(message.text),
  error(message) {
    say(message.text, "error", 20);
    judging(false);
    // What was refused does not stay in its field.
    if (live.scene) fillFields(live.scene);
  },
  kept(message) {
    say(`kept: ${message.file}`);
    judging(message.judged);
    element("verdict").replaceChildren(text("p", "judge it again with"), text("code", message.command));
    if (message.objection) element("verdict").append(text("p", message.objection, "fail"));
    if (message.judged) element("verdict").append(text("p", "the backend is judged …"));
  },
  verdict: showVerdict,
};

function told(message) {
  tell[message.type]?.(message);
}

function text(tag, content, className = "") {
  const one = document.createElement(tag);
  one.textContent = content;
  one.className = className;
  return one;
}

function say(content, className = "", seconds = 8) {
  const one = text("div", content, className);
  element("messages").append(one);
  while (element("messages").children.length > 5) element("messages").firstChild.remove();
  if (seconds) setTimeout(() => one.remove(), 1000 * seconds);
}

// What is being typed is not overwritten.
function put(input, value) {
  if (document.activeElement !== input) input.value = value;
}

function judging(under_way) {
  for (const id of ["keep", "judge"]) element(id).disabled = under_way;
}

function showScene(message) {
  if (live.scene && live.scene.particles !== message.particles) {
    past.clear();
    live.scores = null;
  }
  live.scene = message;
  element("name").textContent = message.name;
  document.title = `${message.name} · decant live`;
  view.setScene(message);
  if (past.pictures.length) past.present();
  fillFields(message);
  put(element("text"), message.text);
  element("backends").replaceChildren(...message.backends.map((one) => Object.assign(document.createElement("option"), { value: one })));
  element("device").textContent = `${message.backend} on ${message.device} (${message.executor}, ${message.precision}); `
    + `${message.particles.toLocaleString("en")} fluid and ${message.wall_particles.toLocaleString("en")} wall particles`;
  showTilts(message);
  for (const warning of message.warnings) if (!live.warned.has(warning)) say(warning, "warning");
  live.warned = new Set(message.warnings);
}

function fillFields(message) {
  message.gravity.forEach((g, k) => put(element(["gx", "gy", "gz"][k]), g));
  put(element("viscosity"), message.viscosity);
  put(element("sound"), message.sound_speed);
  put(element("spacing"), Number(message.spacing.toPrecision(6)));
  put(element("particles"), message.particles);
  const [name, ...options] = message.backend.split(":");
  const listed = Object.fromEntries(options.map((one) => one.split("=")));
  const plugin = name === "plugin" || name === "python";
  const others = plugin ? options : options.filter((one) => !/^(rebuild|skin)=/.test(one));
  put(element("backend"), [name, ...others].join(":"));
  put(element("rebuild"), plugin ? "" : listed.rebuild ?? "");
  put(element("skin"), plugin ? "" : listed.skin ?? "");
  element("lists").hidden = name !== "list";
  element("levels").replaceChildren(...message.levels.map(({ fill, container, level }) => {
    const label = text("label", `level in ${container}, m `);
    const input = Object.assign(document.createElement("input"), { value: level, size: 9, id: `level-${fill}` });
    input.addEventListener("change", () => set(`/fill/${fill}/level`, input));
    label.append(input);
    return label;
  }));
}

function showTilts(message) {
  const tilting = message.containers.filter((one) => one.tilts);
  const now = JSON.stringify(tilting.map((one) => [one.name, one.degrees, one.hand_degrees_per_second]));
  element("tilts").hidden = tilting.length === 0;
  if (now === live.tilting) return;
  live.tilting = now;
  element("tilts").replaceChildren(text("h2", "Tilt"), ...tilting.map((container) => {
    const block = document.createElement("div");
    const label = text("label", `${container.name} `);
    const slider = Object.assign(document.createElement("input"),
      { type: "range", min: container.degrees[0], max: container.degrees[1], step: 0.5, id: `tilt-${container.name}` });
    const angle = text("span", "");
    const schedule = Object.assign(text("button", "as scheduled"), { id: `schedule-${container.name}` });
    slider.addEventListener("input", () => tilt(container, Number(slider.value)));
    schedule.addEventListener("click", () => {
      ask("schedule", { container: container.name });
    });
    label.append(slider, angle);
    block.append(label, schedule, text("p", `or drag it; turns at ${container.hand_degrees_per_second.toPrecision(2)}°/s of the scene's time`));
    container.slider = slider;
    container.angle = angle;
    container.schedule = schedule;
    return block;
  }));
  live.tilts = tilting;
}

let asked = 0, latest = null;
/** Not more often than the run can follow. */
function tilt(container, degrees) {
  const [least, largest] = container.degrees;
  latest = { container: container.name, degrees: Math.min(largest, Math.max(least, degrees)) };
  if (asked) return;
  const send = () => {
    asked = 0;
    if (latest === null) return;
    ask("tilt", latest);
    latest = null;
    asked = setTimeout(send, 60);
  };
  send();
}

function showStatus(message) {
  live.status = message;
  const rate = (x) => (x >= 1000 ? Math.round(x).toLocaleString("en") : x.toPrecision(3));
  element("clock").textContent = `${message.time.toFixed(4)} s, substep ${message.substep.toLocaleString("en")}`;
  element("rates").textContent = message.failed ? `stopped: ${message.failed}` : message.paused ? "paused"
    : `${rate(message.substeps_per_second)} substeps/s, ${message.scene_per_second.toPrecision(2)} × real time, `
      + `${message.pictures_per_second.toFixed(0)} pictures/s; fastest ${message.max_speed.toPrecision(3)} m/s`
      + (message.mean_neighbors > 0 ? `, ${message.mean_neighbors.toFixed(0)} neighbors` : "");
  if (message.beyond && !live.beyond) say(`beyond its limits: ${message.beyond}`, "warning", 20);
  live.beyond = message.beyond;
  element("pause").textContent = message.paused ? "go on" : "pause";
  put(element("speed"), String(message.speed));
  for (const container of live.tilts ?? []) {
    const degrees = message.degrees[container.name], target = message.by_hand[container.name];
    if (document.activeElement !== container.slider) container.slider.value = target ?? degrees;
    container.angle.textContent = `${degrees.toFixed(1)}°` + (target !== undefined && Math.abs(target - degrees) > 0.1 ? ` → ${target.toFixed(0)}°` : "");
    container.schedule.disabled = target === undefined;
  }
  curves.add(message);
}

/** A line per check: its largest score, or how many of its rows fail. */
function showVerdict(message) {
  const checks = new Map();
  for (const row of message.rows) {
    const of = checks.get(row.check) ?? { rows: 0, failing: 0, worst: row };
    ++of.rows;
    const fails = row.verdict !== "pass", worse = fails - (of.worst.verdict !== "pass") || (row.score ?? 0) - (of.worst.score ?? 0);
    of.failing += fails;
    if (worse > 0) of.worst = row;
    checks.set(row.check, of);
  }
  const table = document.createElement("table");
  const ordered = [...checks].sort(([, one], [, other]) => (other.failing > 0) - (one.failing > 0));
  for (const [check, { rows, failing, worst }] of ordered) {
    const line = document.createElement("tr"), verdict = failing ? "fail" : "pass";
    line.append(text("td", check), text("td", failing ? `${failing} of ${rows} fail` : "pass", verdict),
      text("td", worst.score === undefined ? "" : worst.score.toPrecision(3)));
    table.append(line);
    if (!failing) continue;
    const why = document.createElement("tr");
    why.append(Object.assign(text("td", `${worst.field}: ${worst.reason ?? ""}`, "why"), { colSpan: 3 }));
    table.append(why);
  }
  judging(false);
  element("verdict").lastChild.remove();
  element("verdict").append(text("p", `${message.rows.length} rows: ${message.verdict}`, message.verdict), table);
  element("verdict").dataset.verdict = message.verdict;
  say(`${message.file}: ${message.verdict}`, message.verdict === "pass" ? "" : "error");
}

function legend(picture, quantity) {
  const key = `${quantity} ${picture.least} ${picture.largest}`;
  if (key === live.legend) return;
  live.legend = key;
  put(element("color"), quantity);
  const swatches = element("legend");
  swatches.querySelectorAll(".swatch, .region").forEach((one) => one.remove());
  const regions = quantity === "region";
  element("scale").hidden = regions;
  element("least").textContent = regions ? "" : picture.least.toPrecision(3);
  element("largest").textContent = regions ? "" : quantity === "score" ? "1 or more" : picture.largest.toPrecision(4);
  element("unit").textContent = UNITS[quantity];
  if (regions) {
    ["source", "in flight", "receiver", "spilled", "lost"].forEach((name, k) => {
      const swatch = text("span", "", "swatch");
      swatch.style.background = REGION_COLORS[k];
      swatches.append(swatch, text("span", name, "region"));
    });
    return;
  }
  const scale = element("scale"), context = scale.getContext("2d");
  const gradient = context.createLinearGradient(0, 0, scale.width, 0);
  GRADIENTS[quantity].forEach((color, k, all) => gradient.addColorStop(k / (all.length - 1), color));
  context.fillStyle = gradient;
  context.fillRect(0, 0, scale.width, scale.height);
}

/** A value of the scene file. What is no number is told here; what is out of range by the scene's own rules. */
function number(input) {
  const value = Number(input.value.trim());
  if (input.value.trim() !== "" && Number.isFinite(value)) return value;
  tell.error({ text: `${input.closest("label").firstChild.textContent.trim()}: ${JSON.stringify(input.value)} is no number` });
  return null;
}

function set(pointer, input) {
  const value = number(input);
  if (value !== null) ask("set", { pointer, value });
}

function on(id, event, action) {
  element(id).addEventListener(event, action);
}

on("pause", "click", () => ask(live.status?.paused ? "go_on" : "pause"));
on("step", "click", () => ask("step"));
on("reset", "click", () => {
  curves.clear();
  past.clear();
  ask("reset");
});
on("speed", "change", () => {
  ask("speed", { value: Number(element("speed").value) });
  element("speed").blur();
});
on("color", "change", () => {
  ask("color", { by: element("color").value });
  element("color").blur();
});
for (const id of ["gx", "gy", "gz"])
  on(id, "change", () => {
    const value = ["gx", "gy", "gz"].map((one) => number(element(one)));
    if (!value.includes(null)) ask("set", { pointer: "/gravity", value });
  });
on("viscosity", "change", () => set("/fluid/viscosity", element("viscosity")));
on("sound", "change", () => set("/fluid/sound_speed", element("sound")));
on("spacing", "change", () => set("/particle_spacing", element("spacing")));
on("particles", "change", () => {
  const value = number(element("particles"));
  if (value !== null) ask("particles", { value: Math.round(value) });
});
for (const id of ["backend", "rebuild", "skin"])
  on(id, "change", () => {
    const name = element("backend").value.trim();
    const options = name.split(":")[0] === "list"
      ? ["rebuild", "skin"].filter((key) => element(key).value.trim()).map((key) => `:${key}=${element(key).value.trim()}`) : [];
    ask("backend", { choice: name + options.join("") });
  });
on("apply", "click", () => ask("scene", { text: element("text").value }));
for (const what of ["keep", "judge"])
  on(what, "click", () => {
    delete element("verdict").dataset.verdict;
    element("verdict").replaceChildren(text("p", "the oracle evaluates the instant …"));
    judging(true);
    ask(what);
  });
// What has been typed is done with: its field shows the run's value again.
document.querySelector("aside").addEventListener("change", (event) => event.target.tagName === "INPUT" && event.target.blur());
document.addEventListener("keydown", (event) => {
  if (/^(INPUT|TEXTAREA|SELECT|BUTTON)$/.test(event.target.tagName) || event.ctrlKey || event.metaKey) return;
  if (event.key === " ") {
    event.preventDefault();
    element("pause").click();
  } else if (event.key === "s") element("step").click();
});

connect();
requestAnimationFrame(frame);
