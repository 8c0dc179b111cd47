// Elements, text and tables.
const data = JSON.parse(document.getElementById("data").textContent);
const { facts, runs, sweep, parts } = data;
const main = document.querySelector("main");

// Names come from files: they are set as text, never as markup.
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

// Numbers, all with a minus sign.
const minus = (text) => text.replaceAll("-", "\u2212");
const integer = (n) => minus(n.toFixed(0)).replace(/\B(?=(\d{3})+$)/g, ",");
const fixed = (n, digits) => minus(n.toFixed(digits)).replace(/^\u2212(?=[0.]+$)/, "");
const error = (n) => (n === null || n === undefined ? "-" : n === 0 ? "0" : minus(n.toExponential(2)));
/** Four decimals; of small numbers, three digits. */
function value(n) {
  if (n === null) return "-";
  const most = Math.abs(n);
  if (most >= 1e7 || (most > 0 && most < 1e-5)) return minus(n.toExponential(2));
  if (most >= 1e4) return integer(n);
  return fixed(n, most > 0 && most < 1e-2 ? 2 - Math.floor(Math.log10(most)) : 4);
}
const percent = (share) => `${fixed(100 * share, 1)} %`;
const milliseconds = (cycles, hertz) => `${fixed((1e3 * cycles) / hertz, 3)} ms`;
const counted = (n, noun) => `${integer(n)} ${noun}${n === 1 ? "" : "s"}`;
const sentence = (text) => text[0].toUpperCase() + text.slice(1) + ".";

const sections = [];
function section(id, title, ...children) {
  const element = el("section", { id, "aria-labelledby": `${id}-title` }, el("h2", { id: `${id}-title`, tabindex: "-1" }, title), ...children);
  main.append(element);
  sections.push([id, title]);
  return element;
}
/** Makes links to the sections. In a notebook the page has no address of its own, and a link would replace it. */
function links() {
  const link = ([id, title]) => el("a", { href: `#${id}`, onclick: (event) => {
    event.preventDefault();
    document.getElementById(id).scrollIntoView();
    document.getElementById(`${id}-title`).focus({ preventScroll: true });
  } }, title);
  document.querySelector("nav").append(...sections.map(link));
}
function table(heads, rows, numeric = [], name = heads.filter(Boolean).join(", ")) {
  const cell = (tag) => (text, i) => el(tag, { class: numeric.includes(i) ? "n" : undefined, scope: tag === "th" ? "col" : undefined }, text);
  const body = rows.map((row) => (row instanceof Element ? row : el("tr", {}, ...row.map(cell("td")))));
  return el("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": name },
    el("table", {}, heads.length ? el("thead", {}, el("tr", {}, ...heads.map(cell("th")))) : null, el("tbody", {}, ...body)));
}
function figures(entries) {
  return el("dl", { class: "figures" }, ...entries.filter(Boolean).map(([name, text]) => el("div", {}, el("dt", {}, name), el("dd", {}, text))));
}
// An entry is a name, its colour, and a mark; without one, a square.
function legend(entries) {
  const drawnMark = (d, colour) => svg("svg", { viewBox: "-8 -8 16 16", width: 16, height: 16, "aria-hidden": "true" }, svg("path", { d, fill: colour, stroke: colour }));
  return el("div", { class: "legend" }, ...entries.map(([name, colour, mark]) => (mark ? el("span", { class: "marked" }, drawnMark(mark, colour), name) : el("span", { style: `--c: ${colour}` }, name))));
}

// Names of the values of observation and action.
function names(ports, count, noun) {
  const all = ports.flatMap(({ name, names, len }) => Array.from({ length: len }, (_, i) => (names.length ? `${name}: ${names[i]}` : len > 1 ? `${name}\u00a0${i}` : name)));
  return Array.from({ length: count }, (_, i) => all[i] ?? `${noun}\u00a0${i}`);
}
const isInput = ({ kind }) => kind === "input";
const targets = facts.ports.filter((port) => !isInput(port));
const inputNames = names(facts.ports.filter(isInput), facts.observation, "observation");
const actionNames = names(targets, facts.action, "action");
/** Lowest and highest value of an action by the contract; infinite without limits. */
const limits = actionNames.map((_, i) => ["low", "high"].map((end, j) => {
  const limit = facts.contract.find(([name]) => name === end)?.[1][i];
  return limit === undefined || limit === null || Math.abs(limit) >= 3.4028234e38 ? [-Infinity, Infinity][j] : limit;
}));
