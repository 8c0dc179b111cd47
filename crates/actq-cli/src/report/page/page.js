const data = JSON.parse(document.getElementById("data").textContent);
const { facts, runs, sweep, parts } = data;
const main = document.querySelector("main");

// Elements and text. Names come from files: they are set as text, never as markup.
function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== undefined && value !== false) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== undefined && child !== null));
  return element;
}
function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}
const integer = (n) => n.toString().replace(/\B(?=(\d{3})+$)/g, ",");
const fixed = (n, digits) => (n < 0 ? "\u2212" : "") + Math.abs(n).toFixed(digits);
const error = (n) => (n === null || n === undefined ? "-" : n === 0 ? "0" : n.toExponential(2));
const value = (n) => (n === null ? "-" : n === 0 ? "0" : Math.abs(n) >= 1e4 || Math.abs(n) < 1e-3 ? n.toExponential(2) : fixed(n, 4));
const percent = (share) => `${(100 * share).toFixed(1)} %`;
const milliseconds = (cycles, hertz) => `${((1e3 * cycles) / hertz).toFixed(3)} ms`;

const sections = [];
function section(id, title, ...children) {
  const element = el("section", { id, "aria-labelledby": `${id}-title` }, el("h2", { id: `${id}-title` }, title), ...children);
  main.append(element);
  sections.push([id, title]);
  return element;
}
function table(heads, rows, numeric = [], name = heads.filter(Boolean).join(", ")) {
  const cell = (tag) => (text, i) => el(tag, { class: numeric.includes(i) ? "n" : undefined, scope: tag === "th" ? "col" : undefined }, text);
  const body = rows.map((row) => (row instanceof Element ? row : el("tr", {}, ...row.map(cell("td")))));
  return el("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": name },
    el("table", {}, heads.length ? el("thead", {}, el("tr", {}, ...heads.map(cell("th")))) : null, el("tbody", {}, ...body)));
}
// An entry is a name, its colour, and a mark; without one, a square.
function legend(entries) {
  const drawnMark = (d, colour) => svg("svg", { viewBox: "-8 -8 16 16", width: 16, height: 16, "aria-hidden": "true" }, svg("path", { d, fill: colour }));
  return el("div", { class: "legend" }, ...entries.map(([name, colour, mark]) => (mark ? el("span", { class: "marked" }, drawnMark(mark, colour), name) : el("span", { style: `--c: ${colour}` }, name))));
}

// Names of the values of observation and action.
function names(ports, count, noun) {
  const all = ports.flatMap(({ name, names, len }) => Array.from({ length: len }, (_, i) => (names.length ? `${name}: ${names[i]}` : len > 1 ? `${name} ${i}` : name)));
  return Array.from({ length: count }, (_, i) => all[i] ?? `${noun} ${i}`);
}
const isInput = ({ kind }) => kind === "input";
const inputNames = names(facts.ports.filter(isInput), facts.observation, "observation");
const actionNames = names(facts.ports.filter((port) => !isInput(port)), facts.action, "action");

// a. What it is.
function figures(entries) {
  return el("dl", { class: "figures" }, ...entries.filter(Boolean).map(([name, text]) => el("div", {}, el("dt", {}, name), el("dd", {}, text))));
}
const [nmse, measured] = runs?.nmse ?? [null, runs?.compared];
function trust() {
  const sentences = [];
  if (runs) {
    const known = nmse ?? mean(runs.actions.map(([ratio]) => ratio));
    sentences.push(`On ${integer(measured)} of ${integer(runs.recorded)} recorded observations the image's ${nmse === null ? "actions differ" : "raw output differs"} from the f32 policy's by an NMSE of ${error(known)} (mean squared error over variance; 1 is no better than a constant).`);
  } else {
    sentences.push("No error is shown: the report was made without the policy and a recording.");
  }
  sentences.push(data.success ? "Success was measured in closed loop." : "An error on recordings does not replace a test in closed loop.");
  sentences.push(`Times are predicted by a model of ${facts.cores[facts.time[0]]?.title ?? facts.time[0]} with memory that never waits; nothing here was measured on hardware.`);
  return sentences.join(" ");
}
function mean(values) {
  const known = values.filter((v) => v !== null);
  return known.length ? known.reduce((a, b) => a + b, 0) / known.length : null;
}
document.getElementById("top").append(
  el("h1", {}, facts.name),
  el("p", { class: "soft" }, `${facts.kind}, ${facts.observation} values of observation, ${facts.action} of action, ${facts.rate_hz} Hz`),
  figures([
    ["image", `${integer(facts.bytes)} B`],
    ["bits per weight", facts.bits_per_weight.toFixed(3)],
    ["a step, predicted", milliseconds(...facts.time.slice(1))],
    ["scratch RAM", `${integer(facts.scratch)} B`],
    runs && [nmse === null ? "error of the actions (NMSE)" : "error of the raw output (NMSE)", error(nmse ?? mean(runs.actions.map(([ratio]) => ratio)))],
    data.own_path && ["error on its own path", error(data.own_path[0])],
    data.success && ["success", `${percent(data.success[0])} of ${data.success[1]}`],
    data.success && ["95 % interval", data.success[2].map(percent).join(" to ")],
  ]),
  el("p", { id: "trust" }, trust()),
  el("p", { class: "soft mono" }, `sha256 ${facts.sha256}`),
);

// Charts have the width of the page, so that their text keeps its size.
const drawn = [];
addEventListener("resize", () => drawn.forEach((draw) => draw()));
const fitting = (most) => Math.max(280, Math.min(most, main.clientWidth - 40));

// A chart of lines or points over two linear or logarithmic axes.
function chart({ label, width = 560, height = 300, x, y, draw }) {
  const [left, right, top, bottom] = [64, 16, 14, 44];
  const scale = ({ min, max, log }, from, to) => {
    const f = log ? Math.log10 : (v) => v;
    const [a, b] = [f(min), f(max)];
    return (v) => from + ((f(v) - a) / (b - a || 1)) * (to - from);
  };
  const [sx, sy] = [scale(x, left, width - right), scale(y, height - bottom, top)];
  const ticks = ({ min, max, log }) => {
    if (log) {
      const [a, b] = [Math.ceil(Math.log10(min) - 1e-9), Math.floor(Math.log10(max) + 1e-9)];
      return Array.from({ length: b - a + 1 }, (_, i) => 10 ** (a + i));
    }
    const step = 10 ** Math.floor(Math.log10((max - min) / 4 || 1));
    const s = [1, 2, 5, 10].map((m) => m * step).find((m) => (max - min) / m <= 6);
    return Array.from({ length: Math.floor(max / s + 1e-9) - Math.ceil(min / s - 1e-9) + 1 }, (_, i) => (Math.ceil(min / s - 1e-9) + i) * s);
  };
  const shown = (v, { log }) => (log ? v.toExponential(0) : String(Number(v.toPrecision(6))));
  const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": label });
  for (const v of ticks(x)) {
    root.append(svg("line", { x1: sx(v), x2: sx(v), y1: top, y2: height - bottom, class: "axis" }),
      svg("text", { x: sx(v), y: height - bottom + 18, "text-anchor": "middle", class: "soft" }, shown(v, x)));
  }
  for (const v of ticks(y)) {
    root.append(svg("line", { x1: left, x2: width - right, y1: sy(v), y2: sy(v), class: "axis" }),
      svg("text", { x: left - 8, y: sy(v) + 4, "text-anchor": "end", class: "soft" }, shown(v, y)));
  }
  root.append(svg("text", { x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle", class: "soft" }, x.name));
  draw(root, sx, sy);
  return root;
}
function range(values, log) {
  const [min, max] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
  if (log) return { min: 10 ** Math.floor(Math.log10(min)), max: 10 ** Math.ceil(Math.log10(max) + 1e-9), log };
  const margin = 0.06 * (max - min) || Math.abs(max) || 1;
  return { min: min - margin, max: max + margin };
}
const PALETTE = ["var(--image)", "var(--b8)", "var(--b3)", "var(--b4)", "#cc79a7"];

// b. The frontier.
if (sweep?.images.length) {
  const curves = [...new Set(sweep.images.map(({ curve }) => curve))];
  // Six marks beside five colours: the first thirty curves differ.
  const marks = ["M-5,0a5,5 0 1,0 10,0a5,5 0 1,0 -10,0", "M-5,-5h10v10h-10z", "M0,-6l6,10h-12z", "M0,-7l6,7l-6,7l-6,-7z", "M-6,-2h4v-4h4v4h4v4h-4v4h-4v-4h-4z", "M0,6l6,-10h-12z"];
  const markOf = (curve) => [PALETTE[curve % PALETTE.length], marks[curve % marks.length]];
  const errors = { name: "Error", of: (image) => Math.max(image.nmse, 1e-14), axis: range(sweep.images.map((image) => Math.max(image.nmse, 1e-14)), true), cost: (image) => image.nmse };
  const successes = { name: "Success in percent", of: (image) => 100 * image.success[0], axis: { min: 0, max: 105 }, cost: (image) => -image.success[0] };
  // Those that cost less than all others with at most as much of the axis.
  function frontier(images, key, cost) {
    let least = Infinity;
    return [...images].sort((a, b) => a[key] - b[key] || cost(a) - cost(b)).filter((image) => cost(image) < least && ((least = cost(image)), true));
  }
  const driven = sweep.images.filter((image) => image.success);
  const panel = (images, measure, key, name) => chart({
    width: fitting(560), label: `${measure.name} over ${name}`, x: { ...range(sweep.images.map((image) => image[key])), name }, y: measure.axis,
    draw(root, sx, sy) {
      const at = (image) => [sx(image[key]), sy(measure.of(image))];
      const line = frontier(images, key, measure.cost).map((image) => at(image).join(",")).join(" ");
      root.append(svg("polyline", { points: line, fill: "none", stroke: "var(--soft)", "stroke-width": 1.5 }));
      for (const image of images) {
        const [px, py] = at(image);
        const [fill, d] = markOf(curves.indexOf(image.curve));
        const mark = svg("path", { d, transform: `translate(${px},${py})`, fill });
        mark.append(svg("title", {}, `${image.curve}: ${integer(image.bytes)} B, ${image.milliseconds.toFixed(3)} ms, NMSE ${error(image.nmse)}${image.success ? `, success ${percent(image.success[0])}` : ""}`));
        root.append(mark);
        if (image.is_own) root.append(svg("circle", { cx: px, cy: py, r: 10, fill: "none", stroke: "var(--focus)", "stroke-width": 2.5 }), svg("text", { x: px + 14, y: py + 4 }, "this image"));
      }
    },
  });
  const place = el("div", { class: "two" });
  const both = (images, measure) => [panel(images, measure, "bytes", "bytes of flash"), panel(images, measure, "milliseconds", `predicted ms, Cortex-M4F at ${sweep.clock_hz / 1e6} MHz`)];
  const draw = () => place.replaceChildren(...both(sweep.images, errors), ...(driven.length ? both(driven, successes) : []));
  draw();
  drawn.push(draw);
  const rows = sweep.images.map((image) => [image.curve + (image.is_own ? " (this image)" : ""), integer(image.bytes), image.milliseconds.toFixed(3), error(image.nmse), image.success ? percent(image.success[0]) : "-"]);
  section("frontier", "Frontier", el("p", {}, "Each mark is an image of the sweep; each line joins those that no other image beats on both axes. The vertical axis is the NMSE of the network's raw output on held-out observations." + (driven.length ? " Below, it is the success in closed loop, in percent of the episodes." : "")),
    legend(curves.map((name, i) => [name, ...markOf(i)])),
    place,
    el("details", {}, el("summary", {}, "As a table"), table(["curve", "bytes", "ms", "NMSE", "success"], rows, [1, 2, 3, 4])));
}

// c. The network.
const WIDTHS = [["0", "no bits", "--b0"], ["2", "2 bits", "--b2"], ["3", "3 bits", "--b3"], ["4", "4 bits", "--b4"], ["8", "8 bits", "--b8"]];
const detail = el("div", { class: "detail", role: "status" }, "Choose a matrix for its name, shape, bits, scales, error and cycles.");
function describe(op, i) {
  const cycles = `${integer(op.cycles)} cycles predicted (${percent(op.cycles / facts.time[1])} of a step)`;
  if (op.matrix === null) return [el("strong", {}, `${op.name} ${op.detail}`), el("br"), `${op.output} values, ${cycles}`];
  const matrix = facts.matrices[op.matrix];
  const counts = WIDTHS.map(([digit, name]) => [[...matrix.widths].filter((d) => d === digit).length, name]).filter(([n]) => n > 0);
  const rounding = runs?.rounding[i];
  return [
    el("strong", {}, `${matrix.name}, ${matrix.shape.join(" \u00d7 ")}`), el("br"),
    counts.map(([n, name]) => `${n} rows of ${name}`).join(", "), ` \u00b7 ${integer(matrix.bytes)} B \u00b7 ${matrix.group ? `a scale for ${matrix.group} columns` : "a scale for each row"}, ${value(matrix.scales[0])} to ${value(matrix.scales[1])} \u00b7 activations to \u00b1${matrix.x_max}`, el("br"),
    `${cycles}`, matrix.error_share !== null ? ` \u00b7 ${percent(matrix.error_share)} of the error predicted from its weights` : "", rounding !== null && rounding !== undefined ? ` \u00b7 rounding its input adds an NMSE of ${error(rounding)}` : "",
  ];
}
const net = el("div", { class: "net" });
const scale = Math.min(1, 150 / Math.max(...facts.matrices.flatMap(({ shape }) => shape), 1));
facts.ops.forEach((op, i) => {
  const show = () => detail.replaceChildren(...describe(op, i));
  if (op.matrix === null) {
    net.append(el("button", { class: "op", type: "button", onmouseenter: show, onfocus: show, onclick: show }, op.name));
    return;
  }
  const matrix = facts.matrices[op.matrix];
  const [rows, cols] = matrix.shape;
  const canvas = el("canvas", { width: 1, height: rows, style: `width:${Math.max(12, cols * scale)}px;height:${Math.max(12, rows * scale)}px`, "aria-hidden": "true" });
  canvas.dataset.matrix = op.matrix;
  net.append(el("button", { type: "button", "aria-label": `${matrix.name}, ${rows} by ${cols}`, onmouseenter: show, onfocus: show, onclick: show }, canvas, el("span", { class: "label" }, `${matrix.name} ${rows}\u00d7${cols}`)));
});
function paint() {
  const style = getComputedStyle(document.documentElement);
  for (const canvas of net.querySelectorAll("canvas")) {
    const context = canvas.getContext("2d");
    [...facts.matrices[canvas.dataset.matrix].widths].forEach((digit, row) => {
      context.fillStyle = style.getPropertyValue(WIDTHS.find(([d]) => d === digit)[2]);
      context.fillRect(0, row, 1, 1);
    });
  }
}
paint();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
const widthsPresent = WIDTHS.filter(([digit]) => facts.matrices.some(({ widths }) => widths.includes(digit)));
section("network", "Network", el("p", {}, facts.is_trained ? "Each block is a matrix, each line in it a row of the trained matrix, coloured by its bits; rows without bits were removed or give a constant." : "Each block is a matrix, each line in it a row of the image, coloured by its bits. The image's statistics (--stats) would add the removed rows."),
  legend(widthsPresent.map(([, name, colour]) => [name, `var(${colour})`])), net, detail,
  el("details", {}, el("summary", {}, "As a table"), table(["op", "detail", "output", "bits of the rows", "bytes", "cycles"], facts.ops.map((op) => {
    const matrix = op.matrix === null ? null : facts.matrices[op.matrix];
    const counts = matrix && WIDTHS.map(([digit]) => [digit, [...matrix.widths].filter((d) => d === digit).length]).filter(([, n]) => n).map(([d, n]) => `${n}\u00d7${d}`).join(" ");
    return [op.name, op.detail, integer(op.output), counts ?? "", matrix ? integer(matrix.bytes) : "", integer(op.cycles)];
  }), [2, 4, 5])));

// d. Errors and traces.
const live = {};
if (runs) {
  const worstShare = Math.max(...runs.actions.map(([ratio]) => ratio ?? 0));
  const bar = (share) => el("div", { class: "bar", style: "--c: var(--image)" }, el("i", { style: `left:0;width:${100 * share}%` }));
  const actions = table(["action", "NMSE", "share of the largest NMSE", "largest error"], runs.actions.map(([ratio, max], i) => [actionNames[i], error(ratio), bar(worstShare ? (ratio ?? 0) / worstShare : 0), value(max)]), [1, 3]);
  const layers = facts.ops.map((op, i) => [op, i]).filter(([op]) => op.matrix !== null);
  const byLayer = table(["matrix", "weights", "rounding"], layers.map(([op, i]) => {
    const { name, error_share } = facts.matrices[op.matrix];
    return [name, error_share === null ? "-" : percent(error_share), error(runs.rounding[i])];
  }), [1, 2]);
  const select = el("select", { id: "dimension", onchange: () => trace() }, ...actionNames.map((name, i) => el("option", { value: i }, name)));
  const place = el("div");
  function trace() {
    const i = Number(select.value);
    const [exact, own] = [runs.trace[0][i], runs.trace[1][i]];
    const line = (values, sx, sy, stroke, dash) => svg("polyline", { points: values.map((v, t) => `${sx(t)},${sy(v)}`).join(" "), fill: "none", stroke, "stroke-width": 1.6, ...(dash && { "stroke-dasharray": dash }) });
    place.replaceChildren(chart({
      label: `${actionNames[i]} over an episode, f32 and image`, width: fitting(1100), height: 280, x: { min: 0, max: Math.max(1, exact.length - 1), name: "step of the first episode" }, y: { ...range([...exact, ...own]), name: "" },
      draw(root, sx, sy) {
        root.append(line(own, sx, sy, "var(--image)"), line(exact, sx, sy, "var(--exact)", "6 4"));
      },
    }));
  }
  trace();
  drawn.push(trace);
  const worst = table(["episode", "step", "error"], runs.worst.map((one) => {
    const load = () => live.load?.(one.observation, one.actions);
    const button = el("button", { type: "button", "aria-label": `episode ${one.at[0]}, step ${one.at[1]}: run this observation`, onclick: load }, String(one.at[0]));
    return el("tr", {}, ...[button, String(one.at[1]), error(one.error)].map((content) => el("td", { class: "n" }, content)));
  }), [0, 1, 2]);
  section("errors", "Errors", el("p", {}, `Actions of the image against the f32 policy on ${integer(runs.compared)} of ${integer(runs.recorded)} observations of ${runs.recording}, after the action contract.`, nmse === null ? "" : ` The NMSE of the network's raw output on ${integer(measured)} of them is ${error(nmse)}.`),
    el("div", { class: "two" }, el("div", {}, el("h3", {}, "By action"), actions), el("div", {}, el("h3", {}, "By layer"), byLayer, el("p", { class: "soft" }, "Weights: the matrix's share of the error that its weights were predicted to cause, from the statistics. Rounding: the NMSE that rounding its input adds to its output, measured on the recording."))),
    el("h3", {}, "An episode"), el("div", { class: "row" }, el("label", { for: "dimension" }, "Action"), select), legend([["image", "var(--image)"], ["f32 policy (dashed)", "var(--exact)"]]), place,
    el("h3", {}, `The worst 1 % of the observations${runs.worst.length < Math.ceil(runs.compared / 100) ? `, the first ${runs.worst.length}` : ""}`), el("p", { class: "soft" }, "Choose one to run it in the page, below."), worst);
}

// The head in the page.
const output = el("div");
const bits = el("p", { id: "bits", role: "status" }, "Starting\u2026");
const speed = el("p", { class: "soft", id: "speed" });
const sliders = el("div", { class: "sliders", tabindex: "0", role: "group", "aria-label": "Observation" });
const message = el("p", { class: "warn", role: "alert" });
section("live", "Run it", el("p", {}, "The image runs here, compiled to WebAssembly, with the bits of a microcontroller. Move a value of the observation and see the actions."), bits, speed,
  el("div", { class: "row" }, el("button", { type: "button", onclick: () => live.step?.() }, "Step"), el("button", { type: "button", onclick: () => live.reset?.() }, "Reset"), el("button", { type: "button", onclick: () => live.load?.(data.head.start) }, "First observation")),
  message, el("div", { class: "two" }, el("div", {}, el("h3", {}, "Observation"), sliders), el("div", {}, el("h3", {}, "Action"), output)));

async function start() {
  const module = await compile(bytes(document.getElementById("module").textContent));
  const head = await Head.open(bytes(data.head.image), module);
  let exact;
  if (data.head.reference) {
    exact = await Head.open(await unpacked(data.head.reference.image), module);
    exact.useWeights(weightsOf(data.head.reference));
  }
  // The golden run: this host's bits against those in the file.
  const [observations, expected] = [words(data.head.observations, Float32Array), words(data.head.actions, Uint32Array)];
  const steps = observations.length / facts.observation;
  let equal = 0;
  for (let i = 0; i < steps; i++) {
    const action = head.step(observations.subarray(i * facts.observation, (i + 1) * facts.observation));
    const own = new Uint32Array(action.buffer);
    equal += own.every((word, j) => word === expected[i * facts.action + j]) ? 1 : 0;
  }
  bits.textContent = equal === steps ? `All ${steps} steps of the golden run give the bits of the program that made this report.` : `Only ${equal} of ${steps} steps give the expected bits: do not trust this page on this browser.`;
  bits.className = equal === steps ? "" : "warn";
  bits.dataset.equal = equal === steps;
  head.reset();
  const current = Float32Array.from(data.head.start);
  const began = performance.now();
  let count = 0;
  do head.step(current); while (++count < 1000 && performance.now() - began < 300);
  const took = performance.now() - began;
  speed.textContent = `${integer(count)} steps took ${took.toFixed(0)} ms in this browser.`;
  speed.dataset.milliseconds = took;
  head.reset();

  const limits = Array.from({ length: facts.action }, () => [Infinity, -Infinity]);
  const rows = actionNames.map((name) => {
    const [own, other, difference] = [el("td", { class: "n" }), el("td", { class: "n" }), el("td", { class: "n" })];
    const mark = el("i");
    const row = el("tr", {}, el("td", {}, name), own, ...(exact ? [other, difference] : []), el("td", {}, el("div", { class: "bar", style: "--c: var(--image)" }, mark)));
    return { row, own, other, difference, mark };
  });
  output.replaceChildren(table(["action", "image", ...(exact ? ["f32", "difference"] : []), "size"], rows.map(({ row }) => row), exact ? [1, 2, 3] : [1]),
    exact && data.head.reference.bits === 16 ? el("p", { class: "soft" }, "For the size of this file, the weights of the f32 policy are rounded to 16 bits here; the errors above are of the exact ones.") : "",
    runs && !exact ? el("p", { class: "soft" }, "The f32 policy is too large for this file; the section on errors compares with it.") : "");
  live.step = () => {
    message.textContent = "";
    try {
      const action = head.step(current);
      const other = exact?.step(current);
      rows.forEach(({ own, other: cell, difference, mark }, i) => {
        own.textContent = fixed(action[i], 5);
        if (other) [cell.textContent, difference.textContent] = [fixed(other[i], 5), fixed(action[i] - other[i], 5)];
        limits[i] = [Math.min(limits[i][0], action[i]), Math.max(limits[i][1], action[i])];
        const most = Math.max(Math.abs(limits[i][0]), Math.abs(limits[i][1])) || 1;
        const end = 50 + (50 * action[i]) / most;
        mark.setAttribute("style", `left:${Math.min(50, end)}%;width:${Math.abs(end - 50)}%`);
      });
    } catch (failure) {
      message.textContent = failure.message;
    }
  };
  const inputs = inputNames.map((name, i) => {
    const [low, high] = data.head.ranges[i];
    const shown = el("output", { for: `s${i}` });
    const input = el("input", { type: "range", id: `s${i}`, min: low, max: high, step: (high - low) / 500, oninput: () => {
      current[i] = input.valueAsNumber;
      shown.textContent = value(current[i]);
      live.step();
    } });
    sliders.append(el("div", { class: "slider" }, el("label", { for: `s${i}` }, name), input, shown));
    return { input, shown };
  });
  // The listed error is of a step of an episode; this is the observation's first after a reset.
  live.load = (observation, recorded) => {
    current.set(observation);
    inputs.forEach(({ input, shown }, i) => {
      input.value = current[i];
      shown.textContent = value(current[i]);
    });
    live.reset();
    if (recorded) {
      const list = (actions) => actions.map((action) => fixed(action, 5)).join(", ");
      message.textContent = `In its episode the image gave ${list(recorded[1])}; the f32 policy ${list(recorded[0])}.`;
    }
    document.getElementById("live").scrollIntoView({ block: "nearest" });
  };
  live.reset = () => {
    head.reset();
    exact?.reset();
    live.step();
  };
  current.set(data.head.start);
  inputs.forEach(({ input, shown }, i) => {
    input.value = current[i];
    shown.textContent = value(current[i]);
  });
  live.step();
  document.documentElement.dataset.ready = "true";
}

// e. The flash map.
{
  const custom = { name: "custom", core: facts.time[0] in facts.cores ? facts.time[0] : "m4f" };
  const select = el("select", { id: "part", onchange: () => flash() }, ...parts.map(({ name, core }, i) => el("option", { value: i }, `${name} (${facts.cores[core].title.replace(/^an? /, "")})`)), el("option", { value: "custom" }, "another size"));
  const number = (id, initial) => el("input", { type: "number", id, value: initial, min: 1, oninput: () => flash(), style: "width: 96px" });
  const [flashSize, ramSize, clock] = [number("flash-size", 256), number("ram-size", 64), number("mhz", 64)];
  const size = (input) => input.valueAsNumber || 0;
  const own = el("span", { class: "row", hidden: "" }, el("label", { for: "flash-size" }, "flash, KB"), flashSize, el("label", { for: "ram-size" }, "RAM, KB"), ramSize, el("label", { for: "mhz" }, "MHz"), clock);
  const place = el("div");
  function flash() {
    const isCustom = select.value === "custom";
    own.hidden = !isCustom;
    const part = isCustom ? { ...custom, flash: 1024 * size(flashSize), ram: 1024 * size(ramSize), megahertz: size(clock) } : parts[Number(select.value)];
    const { title, bytes, scratch, cycles, runtime, is_modelled, is_own } = facts.cores[part.core];
    const free = part.flash - bytes - runtime;
    const block = (bytes, colour) => el("i", { style: `--c: var(${colour}); flex: ${Math.max(bytes, 0)} 0 0` });
    const fits = free >= 0 && scratch <= part.ram;
    const notes = [];
    if (free < 0) notes.push(`${integer(-free)} bytes of flash are missing.`);
    if (scratch > part.ram) notes.push(`${integer(scratch - part.ram)} bytes of RAM are missing.`);
    if (part.is_external) notes.push("The flash is a chip of its own; this is its usual size.");
    if (!is_own) notes.push(`These figures are those of the image in the layouts of ${title}, which actq repack --core ${part.core} writes.`);
    notes.push("Predicted for memory that never waits; flash with wait states takes longer.");
    const time = part.megahertz > 0 ? `${milliseconds(cycles, 1e6 * part.megahertz)} at ${part.megahertz} MHz, ${is_modelled ? "predicted" : "an estimate"}` : "no clock";
    place.replaceChildren(
      el("div", { class: "flash", role: "img", "aria-label": `image ${bytes} bytes, runtime ${runtime} bytes, free ${Math.max(0, free)} bytes` }, block(bytes, "--image"), block(runtime, "--b4"), block(Math.max(0, free), "--card")),
      legend([["image", "var(--image)"], ["runtime", "var(--b4)"], ["free", "var(--card)"]]),
      figures([["fits", fits ? "yes" : "no"], ["image", `${integer(bytes)} B`], ["runtime", `${integer(runtime)} B`], ["flash left", free < 0 ? "none" : `${integer(free)} B`], ["RAM left for stack and program", scratch > part.ram ? "none" : `${integer(part.ram - scratch)} B`], ["a step", time]]),
      el("p", {}, notes.join(" ")));
  }
  flash();
  section("flash", "Flash map", el("div", { class: "row" }, el("label", { for: "part" }, "Part"), select, own), place,
    el("p", { class: "soft" }, `The runtime is the code that checks and runs any image; a build for this image alone is smaller. The image has ${integer(facts.beside[0])} bytes of biases, ${integer(facts.beside[1])} of self-test and ${integer(facts.beside[2])} of header and tables.`));
}

// f. Raw inputs to targets: a graph of what each value comes from, in columns by its distance from the inputs.
function flow() {
  const inputs = facts.ports.filter(isInput);
  const targets = facts.ports.filter((port) => !isInput(port));
  const isNetwork = (op) => op.matrix !== null;
  const [first, last] = [facts.ops.findIndex(isNetwork), facts.ops.findLastIndex(isNetwork)];
  const length = (n) => `${n} value${n === 1 ? "" : "s"}`;
  const nodes = [];
  const node = (kind, lines, from) => nodes.push({ kind, lines, from: [...new Set(from)] }) - 1;
  // The nodes that have the values of each input and operation; copies have those of what they copy.
  const places = inputs.map(({ name, len, names }) => [node("port", [[name, length(len)], ...names.map((joint, i) => [`${i} ${joint}`])], [])]);
  let network;
  const text = ({ name, detail, output }) => {
    const clip = name === "normalize" ? detail.split(" ").slice(1, 3).filter((limit) => Number.isFinite(parseFloat(limit))) : [];
    return [name === "normalize" ? `normalize${clip.length ? `, clip \u00b1${parseFloat(clip[0])}` : ""}` : `${name} ${name === "history" || name === "function" ? detail : ""}`, length(output)];
  };
  facts.ops.forEach((op, i) => {
    const from = op.from.flatMap((n) => places[n] ?? []);
    if (first >= 0 && i >= first && i <= last) {
      network ??= node("network", [["network", `${facts.matrices.length} matrices`]], []);
      nodes[network].from = [...new Set([...nodes[network].from, ...from])].filter((n) => n !== network);
      places.push([network]);
    } else if (op.name === "copy" || op.name === "select" || op.detail.endsWith("by the quantizer")) {
      places.push(from);
    } else if (from.length === 1 && nodes[from[0]].last !== undefined && op.from.every((n) => n === nodes[from[0]].last)) {
      // The next operation on all values of a box is a line of the same box.
      nodes[from[0]].lines.push(text(op));
      nodes[from[0]].last = places.push(from) - 1;
    } else {
      const id = node("op", [text(op)], from);
      nodes[id].last = places.push([id]) - 1;
    }
  });
  targets.forEach(({ kind, name, len, names, from }) => node("port", [[`${name} (${kind})`, length(len)], ...names.map((joint, i) => [`${i} ${joint}`])], from.flatMap((n) => places[n] ?? [])));
  // Columns and rows.
  const depth = (n) => (nodes[n].depth ??= nodes[n].from.reduce((most, from) => Math.max(most, depth(from) + 1), 0));
  nodes.forEach((_, n) => depth(n));
  const columns = [];
  nodes.forEach((one) => (columns[one.depth] ??= []).push(one));
  const [line, pad, gap, wide, space] = [18, 8, 12, 176, 48];
  let bottom = 0;
  columns.filter(Boolean).forEach((column, c) => {
    const middle = (one) => (one.from.length ? one.from.reduce((sum, n) => sum + nodes[n].y + nodes[n].height / 2, 0) / one.from.length : 0);
    column.sort((a, b) => middle(a) - middle(b));
    let y = 0;
    for (const one of column) {
      [one.x, one.height] = [c * (wide + space), one.lines.length * line + 2 * pad];
      one.y = Math.max(y, c ? middle(one) - one.height / 2 : 0);
      y = one.y + one.height + gap;
    }
    bottom = Math.max(bottom, y);
  });
  const width = columns.filter(Boolean).length * (wide + space) - space;
  const root = svg("svg", { viewBox: `-1 -1 ${width + 2} ${bottom + 2}`, width: width + 2, height: bottom + 2, role: "img", "aria-label": "Raw inputs, operations around the network, and targets", style: "max-width:none" });
  for (const one of nodes) for (const n of one.from) {
    const from = nodes[n];
    const [x0, y0, x1, y1] = [from.x + wide, from.y + from.height / 2, one.x, one.y + one.height / 2];
    root.append(svg("path", { d: `M${x0},${y0}C${x0 + space / 2},${y0} ${x1 - space / 2},${y1} ${x1},${y1}`, fill: "none", stroke: "var(--soft)", "stroke-width": 1.2 }));
  }
  for (const { kind, lines, x, y, height } of nodes) {
    root.append(svg("rect", { x, y, width: wide, height, rx: 6, fill: "var(--card)", stroke: kind === "op" ? "var(--line)" : kind === "network" ? "var(--image)" : "var(--focus)", "stroke-width": 1.5 }));
    lines.forEach(([name, size], i) => {
      const shown = name.length > 26 ? `${name.slice(0, 25)}\u2026` : name;
      const label = svg("text", { x: x + 8, y: y + pad + 13 + i * line, class: i && kind !== "op" ? "soft" : "" }, shown.trim());
      label.append(svg("title", {}, size ? `${name}, ${size}` : name));
      root.append(label);
      if (size && shown.length < 20) root.append(svg("text", { x: x + wide - 8, y: y + pad + 13 + i * line, "text-anchor": "end", class: "soft" }, size.split(" ")[0]));
    });
  }
  return el("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Diagram" }, root);
}
if (facts.ports.length) {
  const list = ({ kind, name, len, names, range: [low, high] }) => [name, kind, integer(len), low !== null || high !== null ? `${low ?? "-"} to ${high ?? "-"}` : "-", names.join(", ")];
  section("around", "Raw inputs to targets", el("p", {}, "The values of the robot, the operations around the network and its targets, read from the image; a number is that of values. Copies are lines. What a history keeps from earlier steps is not drawn."), flow(),
    el("details", {}, el("summary", {}, "As tables"), table(["values", "kind", "count", "range", "names"], facts.ports.map(list), [2]), table(["operation", "detail", "values"], facts.ops.map((op) => [op.name, op.detail, integer(op.output)]), [2])));
}

// g. The contract and the provenance.
{
  const rows = actionNames.map((name, i) => [name, ...facts.contract.map(([, values]) => (Math.abs(values[i]) >= 3.4028234e38 ? "-" : value(values[i])))]);
  const contract = facts.contract.length ? table(["action", ...facts.contract.map(([name]) => name)], rows, facts.contract.map((_, i) => i + 1)) : el("p", {}, "No scales or limits of the action.");
  section("contract", "Contract", contract, el("p", {}, [`Control rate ${facts.rate_hz} Hz.`, ...facts.playback.map((text) => `${text[0].toUpperCase()}${text.slice(1)}.`), facts.self_test ? `A self-test of ${facts.self_test} steps is in the image.` : "No self-test is in the image."].join(" ")));
  section("provenance", "Provenance", table([], [["SHA-256 of the image", facts.sha256], ["CRC-32 in its header", facts.crc32], ["SHA-256 of its source", facts.source], ["features of the kernels", facts.features.join(" ")], ...facts.made, ["report by actq", facts.actq]].map(([name, text]) => el("tr", {}, el("th", { scope: "row" }, name), el("td", { class: "mono" }, text))), [], "Provenance"));
}

document.querySelector("nav").append(...sections.map(([id, title]) => el("a", { href: `#${id}` }, title)));
start().catch((failure) => {
  bits.textContent = `The image cannot run here: ${failure.message}`;
  bits.className = "warn";
});
