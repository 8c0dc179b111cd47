
// f. Raw inputs to targets: a graph of what each value comes from, in columns by its distance from the inputs.
const SIZE = { line: 18, pad: 8, gap: 12, space: 28, least: 92, most: 190, font: "12px system-ui, sans-serif" };
/** Returns the nodes: lines of name and count, and the nodes that their values come from. */
function graph() {
  const nodes = [];
  const node = (kind, lines, from) => nodes.push({ kind, lines, from: [...new Set(from)] }) - 1;
  const port = (title, { len, names }, from) => node("port", [[title, len], ...names.map((joint, i) => [`${i} ${joint}`])], from);
  // The nodes that have the values of each input and operation; copies have those of what they copy.
  const places = facts.ports.filter(isInput).map((input) => [port(input.name, input, [])]);
  let network;
  const text = ({ name, detail, output }) => {
    const clip = name === "normalize" ? detail.split(" ").slice(1, 3).filter((limit) => Number.isFinite(parseFloat(limit))) : [];
    return [name === "normalize" ? `normalize${clip.length ? `, clip \u00b1${parseFloat(clip[0])}` : ""}` : `${name} ${name === "history" || name === "function" ? detail : ""}`.trim(), output];
  };
  facts.ops.forEach((op, i) => {
    const from = op.from.flatMap((n) => places[n] ?? []);
    if (first >= 0 && i >= first && i <= last) {
      network ??= node("network", [[`network, ${facts.matrices.length} matrices`, facts.ops[last].output]], []);
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
  targets.forEach((target) => port(`${target.name} (${target.kind})`, target, target.from.flatMap((n) => places[n] ?? [])));
  return nodes;
}
/** Sets the columns. A value that a later column reads passes those between in a lane of its own, clear of boxes. */
function ordered(nodes) {
  const depth = (n) => (nodes[n].depth ??= nodes[n].from.reduce((most, from) => Math.max(most, depth(from) + 1), 0));
  nodes.forEach((_, n) => depth(n));
  const readers = (n) => nodes.filter(({ from }) => from.includes(n));
  nodes.forEach((one, n) => {
    // A constant is beside its first reader.
    if (one.kind === "op" && !one.from.length && readers(n).length) one.depth = Math.min(...readers(n).map((reader) => reader.depth)) - 1;
  });
  nodes.slice().forEach((one, n) => {
    const later = readers(n);
    const end = Math.max(0, ...later.map((reader) => reader.depth));
    for (let [lane, d] = [n, one.depth + 1]; d < end; d++) {
      lane = nodes.push({ kind: "lane", lines: [], from: [lane], depth: d }) - 1;
      for (const reader of later) if (reader.depth === d + 1) reader.from = reader.from.map((from) => (from === n ? lane : from));
    }
  });
  const columns = [];
  nodes.forEach((one) => (columns[one.depth] ??= []).push(one));
  return columns.filter(Boolean);
}
/** Returns the width of a box for a line. */
function widthOf(text, count) {
  const context = document.createElement("canvas").getContext("2d");
  context.font = SIZE.font;
  return Math.ceil(context.measureText(text + (count === undefined ? "" : `   ${integer(count)}`)).width) + 2 * SIZE.pad;
}
/** Returns the widths of the columns: those of their lines, the widest cut to fit the page. */
function widths(columns) {
  const { least, most, space } = SIZE;
  const lines = (column) => column.flatMap(({ lines }) => lines);
  const natural = columns.map((column) => Math.max(least, ...lines(column).map(([name, count]) => widthOf(name, count))));
  const room = fitting(1140) - (columns.length - 1) * space - 2;
  const cut = (limit) => natural.map((width) => Math.min(width, limit));
  const fits = (limit) => cut(limit).reduce((sum, width) => sum + width, 0) <= room;
  let limit = most;
  while (limit >= least && !fits(limit)) limit--;
  // A diagram that the reader has to scroll has whole names.
  return cut(limit < least ? most : limit);
}
/** Breaks a box's lines at words, or cuts them, to the width of the box. */
function broken(lines, wide) {
  const fits = (text, count) => widthOf(text, count) <= wide;
  const cut = (text, count) => {
    let short = text;
    while (short.length > 1 && !fits(short === text ? text : `${short}\u2026`, count)) short = short.slice(0, -1);
    return short === text ? text : `${short}\u2026`;
  };
  return lines.flatMap(([name, count]) => {
    const title = count === undefined ? name : `${name}, ${counted(count, "value")}`;
    const soft = count === undefined;
    if (soft || fits(name, count)) return [{ text: cut(name, count), count, title, soft }];
    const rows = [""];
    for (const word of name.split(" ")) {
      const more = `${rows.at(-1)} ${word}`.trim();
      if (fits(more, rows.length === 1 ? count : undefined)) rows[rows.length - 1] = more;
      else if (rows.at(-1)) rows.push(word);
      else rows[rows.length - 1] = word;
    }
    return rows.map((text, i) => ({ text: cut(text, i ? undefined : count), count: i ? undefined : count, title, soft }));
  });
}
function flow() {
  const { line, pad, gap, space } = SIZE;
  const nodes = graph();
  const columns = ordered(nodes);
  const wides = widths(columns);
  let [bottom, x] = [0, 0];
  columns.forEach((column, c) => {
    const middle = (one) => (one.from.length ? one.from.reduce((sum, n) => sum + nodes[n].y + nodes[n].height / 2, 0) / one.from.length : bottom);
    column.sort((a, b) => (c ? middle(a) - middle(b) : 0));
    let y = 0;
    for (const one of column) {
      one.rows = broken(one.lines, wides[c]);
      [one.x, one.wide, one.height] = [x, wides[c], one.kind === "lane" ? 4 : one.rows.length * line + 2 * pad];
      one.y = Math.max(y, c && one.from.length ? middle(one) - one.height / 2 : 0);
      y = one.y + one.height + gap;
    }
    bottom = Math.max(bottom, y);
    x += wides[c] + space;
  });
  const width = x - space;
  const root = svg("svg", { viewBox: `-1 -1 ${width + 2} ${bottom + 2}`, width: width + 2, height: bottom + 2, role: "img", "aria-label": "Raw inputs, operations around the network, and targets", style: "max-width:none" });
  const stroke = { fill: "none", stroke: "var(--soft)", "stroke-width": 1.2 };
  for (const one of nodes) {
    const y1 = one.y + one.height / 2;
    for (const n of one.from) {
      const from = nodes[n];
      const [x0, y0] = [from.x + from.wide, from.y + from.height / 2];
      root.append(svg("path", { d: `M${x0},${y0}C${x0 + space / 2},${y0} ${one.x - space / 2},${y1} ${one.x},${y1}`, ...stroke }));
    }
    if (one.kind === "lane") root.append(svg("path", { d: `M${one.x},${y1}h${one.wide}`, class: "lane", ...stroke }));
  }
  for (const { kind, rows, x, y, wide, height } of nodes) {
    if (kind === "lane") continue;
    root.append(svg("rect", { x, y, width: wide, height, rx: 6, fill: "var(--card)", stroke: kind === "op" ? "var(--line)" : kind === "network" ? "var(--image)" : "var(--focus)", "stroke-width": 1.5 }));
    rows.forEach(({ text, count, title, soft }, i) => {
      const at = y + pad + 13 + i * line;
      root.append(svg("text", { x: x + pad, y: at, class: `small ${soft ? "soft" : ""}` }, text, svg("title", {}, title)));
      if (count !== undefined) root.append(svg("text", { x: x + wide - pad, y: at, "text-anchor": "end", class: "small soft" }, integer(count)));
    });
  }
  return root;
}
if (facts.ports.length) {
  const list = ({ kind, name, len, names, range: [low, high] }) => [name, kind, integer(len), low !== null || high !== null ? `${low === null ? "-" : value(low)} to ${high === null ? "-" : value(high)}` : "-", names.join(", ")];
  const place = el("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Diagram" });
  const draw = () => place.replaceChildren(flow());
  draw();
  drawn.push(draw);
  section("around", "Raw inputs to targets", el("p", {}, "The values of the robot, the operations around the network and its targets, read from the image; a number is that of values. Copies are lines. What a history keeps from earlier steps is not drawn."), place,
    el("details", {}, el("summary", {}, "As tables"), table(["values", "kind", "count", "range", "names"], facts.ports.map(list), [2]), table(["operation", "detail", "values"], facts.ops.map((op) => [op.name, op.detail, integer(op.output)]), [2])));
}
