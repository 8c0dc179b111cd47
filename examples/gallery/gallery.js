const ROBOTS = [
  { title: "Balancer", hertz: 100, push: 4, unit: "m/s", error: "speed error", goals: [["speed, m/s", -0.6, 0.6], ["turn rate, rad/s", -1.5, 1.5]], draw: drawBalancer,
    task: "An episode succeeds if the robot stays upright to its end and follows the speed and the turn rate at the end of each command." },
  { title: "UR3 arm", hertz: 50, push: 12, unit: "mm", error: "distance to the goal", goals: [["x, m", -0.45, -0.15], ["y, m", -0.3, 0.3], ["z, m", 0.05, 0.45]], draw: drawArm,
    task: "An episode succeeds if the tool is near both of its goals, in position and direction, in the last 0.4 s of each." },
];
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
const minus = (text) => text.replaceAll("-", "\u2212");
const integer = (n) => n.toString().replace(/\B(?=(\d{3})+$)/g, ",");

let heads;
let simulation;
let which = 0;
let level = 0;
let robot;
let head;
let seed = 1;
let isPaused = false;
/** Why the last step failed. */
let failed = "";
/** Why the page, or the last choice, does not work. */
let broken = "";
/** The goal that the reader has set; without one, the sliders show the task's. */
let aimed;
const opened = new Map();

/** Opens the head of a level, once: 0 is f32, the others are images. */
async function headOf(which, level) {
  const key = `${which} ${level}`;
  if (!opened.has(key)) {
    const { reference, images } = data[which];
    const made = level > 0 ? await Head.open(bytes(images[level - 1].image), heads) : await Head.open(await unpacked(reference.image), heads);
    if (level === 0) made.useWeights(weightsOf(reference));
    opened.set(key, made);
  }
  return opened.get(key);
}

/** The newest choice: an older one that is still loading is dropped. */
let newest = 0;
/** Starts a robot with a head. Frames run in between, so everything that belongs to it changes at once, at the end. Returns `true` if it is still the newest choice. */
async function enter(chosen, bits) {
  const own = ++newest;
  const { exports } = await WebAssembly.instantiate(simulation, {});
  exports.begin(data[chosen].robot, seed++);
  const next = await headOf(chosen, bits);
  if (own !== newest) return false;
  [which, level, robot, head, broken] = [chosen, bits, exports, next, ""];
  head.reset();
  return true;
}
/** Chooses a robot. */
async function begin(chosen) {
  if (!(await enter(chosen, Math.min(level, data[chosen].images.length)))) return;
  aimed = undefined;
  controls();
}
/** Switches the bits: the episodes that are counted begin again, as they are those of one head. A goal stays. */
async function change(bits) {
  if (!(await enter(which, bits))) return;
  if (aimed) robot.aim(...aimed);
  press("levels", level);
}
const array = (Type, address, length) => new Type(robot.memory.buffer, address, length);
function step() {
  try {
    const action = head.step(array(Float32Array, robot.observation(), robot.number(0)));
    array(Float32Array, robot.action(), robot.number(1)).set(action);
    failed = "";
  } catch (error) {
    failed = error.message;
    head.reset();
    array(Float32Array, robot.action(), robot.number(1)).fill(0);
  }
  if (robot.step()) head.reset();
}

// Controls.
function choice(id, names, current, choose) {
  byId(id).replaceChildren(...names.map((name, i) => {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: name, onclick: () => choose(i).catch(report) });
    return button;
  }));
  press(id, current);
}
/** Marks a choice. The buttons stay, and with them the focus of the keyboard. */
function press(id, current) {
  [...byId(id).children].forEach((button, i) => button.setAttribute("aria-pressed", i === current));
}
function report(error) {
  broken = error.message;
  write(byId("note"), broken);
}
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
const show = (i, goal) => write(byId(`goal${i}-value`), minus(goal.toFixed(2)));
/** Makes the controls of a robot that has just begun. */
function controls() {
  press("robots", which);
  choice("levels", ["f32", ...data[which].images.map(({ label }) => label)], level, change);
  const goals = ROBOTS[data[which].robot].goals;
  const inputs = goals.map(([, min, max], i) => Object.assign(document.createElement("input"), { type: "range", id: `goal${i}`, min, max, step: 0.01, oninput: aim }));
  function aim() {
    aimed = [0, 1, 2].map((i) => inputs[i]?.valueAsNumber ?? 0);
    robot.aim(...aimed);
    inputs.forEach(({ value }, i) => show(i, Number(value)));
  }
  byId("goal").replaceChildren(...goals.map(([name], i) => {
    const pair = document.createElement("span");
    pair.className = "pair";
    pair.append(Object.assign(document.createElement("label"), { htmlFor: `goal${i}`, textContent: name }), inputs[i], Object.assign(document.createElement("output"), { id: `goal${i}-value` }));
    return pair;
  }));
  byId("task").textContent = `${ROBOTS[data[which].robot].task} Your pushes and your goal are part of it.`;
}
byId("left").onclick = () => robot?.push(-ROBOTS[data[which].robot].push);
byId("right").onclick = () => robot?.push(ROBOTS[data[which].robot].push);
byId("pause").onclick = () => {
  isPaused = !isPaused;
  byId("pause").setAttribute("aria-pressed", isPaused);
};

// Pictures.
function stage() {
  const canvas = byId("stage");
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  Object.assign(context, { lineCap: "round", lineJoin: "round", font: "13px system-ui, sans-serif" });
  return [context, width, height];
}
function line(context, points, stroke, width) {
  context.beginPath();
  points.forEach(([x, y]) => context.lineTo(x, y));
  Object.assign(context, { strokeStyle: stroke, lineWidth: width });
  context.stroke();
}
function disc(context, [x, y], radius, fill) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = fill;
  context.fill();
}
function drawBalancer([distance, lean, yaw, speed, , command], context, width, height) {
  const [scale, ground, middle] = [height * 1.6, height * 0.82, width / 2];
  line(context, [[0, ground], [width, ground]], colour("--soft"), 2);
  for (let mark = Math.ceil((distance - middle / scale) * 5) / 5; mark < distance + middle / scale; mark += 0.2) {
    const x = middle + (mark - distance) * scale;
    line(context, [[x, ground], [x, ground + 8]], colour("--soft"), 1);
  }
  const wheel = [middle, ground - 0.05 * scale];
  const top = [wheel[0] + 0.26 * scale * Math.sin(lean), wheel[1] - 0.26 * scale * Math.cos(lean)];
  line(context, [wheel, top], colour("--image"), 0.09 * scale);
  disc(context, wheel, 0.05 * scale, colour("--text"));
  const turn = distance / 0.05;
  line(context, [wheel, [wheel[0] + 0.045 * scale * Math.sin(turn), wheel[1] - 0.045 * scale * Math.cos(turn)]], colour("--page"), 3);
  context.fillStyle = colour("--text");
  context.fillText(minus(`speed ${speed.toFixed(2)} of ${command.toFixed(2)} m/s, heading ${((yaw * 180) / Math.PI).toFixed(0)}\u00b0`), 12, 22);
}
function drawArm(view, context, width, height) {
  const scale = Math.min(width, height * 1.4) * 0.85;
  const at = ([x, y, z]) => [width / 2 + (0.86 * y - 0.86 * x - 0.25) * scale * 0.8, height * 0.82 + (0.3 * (x + y) - z) * scale];
  const points = Array.from({ length: view.length / 3 }, (_, i) => view.slice(3 * i, 3 * i + 3));
  const goal = points.pop();
  for (let i = -3; i <= 3; i++) {
    line(context, [at([i / 6, -0.5, 0]), at([i / 6, 0.5, 0])], colour("--line"), 1);
    line(context, [at([-0.5, i / 6, 0]), at([0.5, i / 6, 0])], colour("--line"), 1);
  }
  line(context, points.map(at), colour("--image"), 12);
  points.forEach((point) => disc(context, at(point), 6, colour("--text")));
  line(context, [at(goal), at([goal[0], goal[1], 0])], colour("--soft"), 1);
  disc(context, at(goal), 9, colour("--b8"));
}
function figures(isDue) {
  const { title, unit, error, hertz } = ROBOTS[data[which].robot];
  const image = data[which].images[level - 1];
  const [now, episodes, successes] = [robot.number(3), robot.number(4), robot.number(5)];
  Object.assign(document.documentElement.dataset, { ready: "true", robot: title, episodes, successes, error: now });
  write(byId("note"), broken || failed || (image ? `Predicted on a Cortex-M4F at ${data[which].clock_hz / 1e6} MHz with memory that never waits, of ${1000 / hertz} ms between steps.` : "The policy before it was quantized."));
  if (!isDue) return;
  const entries = [
    ["image", image ? `${integer(image.bytes)} B` : `${integer(data[which].f32_bytes)} B in f32`],
    ["a step, predicted", image ? (image.milliseconds === null ? "-" : `${image.milliseconds.toFixed(3)} ms`) : "-"],
    [error, unit === "mm" ? `${(1000 * now).toFixed(1)} mm` : `${now.toFixed(3)} ${unit}`],
    ["successful episodes", `${successes} of ${episodes}`],
  ];
  const list = byId("figures");
  while (list.children.length < entries.length) {
    const div = document.createElement("div");
    div.append(...["dt", "dd"].map((tag) => document.createElement(tag)));
    list.append(div);
  }
  entries.forEach((texts, i) => texts.forEach((text, j) => write(list.children[i].children[j], text)));
}

/** The goal is at the end of what is drawn. */
const goal = (view) => view.slice(-ROBOTS[data[which].robot].goals.length);
let last = performance.now();
let owed = 0;
let written = -Infinity;
function frame(now) {
  // First, so that the failure of one frame does not end the others.
  requestAnimationFrame(frame);
  if (robot && head) {
    const { hertz, draw } = ROBOTS[data[which].robot];
    owed = isPaused ? 0 : Math.min(owed + ((now - last) / 1000) * hertz, 12);
    for (; owed >= 1; owed--) step();
    const view = [...array(Float64Array, robot.view(), robot.number(2))];
    draw(view, ...stage());
    if (!aimed) goal(view).forEach((value, i) => ((byId(`goal${i}`).value = value), show(i, value)));
    const isDue = now - written > 250;
    if (isDue) written = now;
    figures(isDue);
  }
  last = now;
}
try {
  heads = await compile(bytes(byId("heads").textContent));
  simulation = await WebAssembly.compile(await unpacked(byId("simulation").textContent));
  level = Math.max(0, data[0].images.findIndex(({ label }) => label === "2 bits") + 1);
  choice("robots", data.map(({ robot }) => ROBOTS[robot].title), which, begin);
  await begin(0);
  requestAnimationFrame(frame);
} catch (error) {
  report(new Error(`This page cannot run here: ${error.message}`));
}
