
// Charts have the width of the page, so that their text keeps its size.
const drawn = [];
addEventListener("resize", () => drawn.forEach((draw) => draw()));
const fitting = (most) => Math.max(280, Math.min(most, main.clientWidth - 40));

// A chart of lines or points over two linear or logarithmic axes; the name of y is above its axis.
function chart({ label, width = 560, height = 300, x, y, draw }) {
  const [left, right, top, bottom] = [64, 16, 32, 44];
  const scale = ({ min, max, log }, from, to) => {
    const f = log ? Math.log10 : (v) => v;
    const [a, b] = [f(min), f(max)];
    return Object.assign((v) => from + ((f(v) - a) / (b - a || 1)) * (to - from), { end: to });
  };
  const [sx, sy] = [scale(x, left, width - right), scale(y, height - bottom, top)];
  const ticks = ({ min, max, log }) => {
    if (log) {
      const [a, b] = [Math.ceil(Math.log10(min) - 1e-9), Math.floor(Math.log10(max) + 1e-9)];
      return Array.from({ length: b - a + 1 }, (_, i) => 10 ** (a + i));
    }
    const step = 10 ** Math.floor(Math.log10((max - min) / 4 || 1));
    const s = [1, 2, 5, 10].map((m) => m * step).find((m) => (max - min) / m <= (width < 400 ? 4 : 6));
    return Array.from({ length: Math.floor(max / s + 1e-9) - Math.ceil(min / s - 1e-9) + 1 }, (_, i) => (Math.ceil(min / s - 1e-9) + i) * s);
  };
  const shown = (v, { log }) => (log ? minus(v.toExponential(0)) : Math.abs(v) >= 1e3 ? integer(v) : minus(String(Number(v.toPrecision(6)))));
  const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": label });
  for (const v of ticks(x)) {
    root.append(svg("line", { x1: sx(v), x2: sx(v), y1: top, y2: height - bottom, class: "axis" }),
      svg("text", { x: sx(v), y: height - bottom + 18, "text-anchor": "middle", class: "soft" }, shown(v, x)));
  }
  for (const v of ticks(y)) {
    root.append(svg("line", { x1: left, x2: width - right, y1: sy(v), y2: sy(v), class: "axis" }),
      svg("text", { x: left - 8, y: sy(v) + 4, "text-anchor": "end", class: "soft" }, shown(v, y)));
  }
  root.append(svg("text", { x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle", class: "soft" }, x.name), svg("text", { x: 4, y: 16, class: "soft" }, y.name));
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
  const all = [...sweep.images, ...(sweep.outside ? [sweep.outside] : [])];
  const isKnown = all.some((image) => image.is_own);
  // Six marks beside five colours: the first thirty curves differ.
  const marks = ["M-5,0a5,5 0 1,0 10,0a5,5 0 1,0 -10,0", "M-5,-5h10v10h-10z", "M0,-6l6,10h-12z", "M0,-7l6,7l-6,7l-6,-7z", "M-6,-2h4v-4h4v4h4v4h-4v4h-4v-4h-4z", "M0,6l6,-10h-12z"];
  const markOf = (curve) => [PALETTE[curve % PALETTE.length], marks[curve % marks.length]];
  const errors = { name: "NMSE of the raw output", of: (image) => Math.max(image.nmse, 1e-14), axis: range(all.map((image) => Math.max(image.nmse, 1e-14)), true), cost: (image) => image.nmse };
  const successes = { name: "Success in percent", of: (image) => 100 * image.success[0], axis: { min: 0, max: 105 }, cost: (image) => -image.success[0] };
  // Those that cost less than all others with at most as much of the axis.
  function frontier(images, key, cost) {
    let least = Infinity;
    return [...images].sort((a, b) => a[key] - b[key] || cost(a) - cost(b)).filter((image) => cost(image) < least && ((least = cost(image)), true));
  }
  const driven = sweep.images.filter((image) => image.success);
  const panel = (images, measure, key, name) => chart({
    width: fitting(560), label: `${measure.name} over ${name}`, x: { ...range(all.map((image) => image[key])), name }, y: { ...measure.axis, name: measure.name },
    draw(root, sx, sy) {
      const at = (image) => [sx(image[key]), sy(measure.of(image))];
      const line = frontier(images, key, measure.cost).map((image) => at(image).join(",")).join(" ");
      root.append(svg("polyline", { points: line, fill: "none", stroke: "var(--soft)", "stroke-width": 1.5 }));
      for (const image of measure === errors ? all : images) {
        const [px, py] = at(image);
        const [fill, d] = image === sweep.outside ? ["var(--text)", marks[0]] : markOf(curves.indexOf(image.curve));
        const mark = svg("path", { d, transform: `translate(${px},${py})`, fill });
        mark.append(svg("title", {}, `${image.curve}: ${integer(image.bytes)} B, ${image.milliseconds.toFixed(3)} ms, NMSE ${error(image.nmse)}${image.success ? `, success ${percent(image.success[0])}` : ""}`));
        root.append(mark);
        if (image.is_own) root.append(svg("circle", { cx: px, cy: py, r: 10, fill: "none", stroke: "var(--focus)", "stroke-width": 2.5 }), svg("text", px > sx.end - 90 ? { x: px - 14, y: py + 4, "text-anchor": "end" } : { x: px + 14, y: py + 4 }, "this image"));
      }
    },
  });
  const place = el("div", { class: "two" });
  const both = (images, measure) => [panel(images, measure, "bytes", "bytes of flash"), panel(images, measure, "milliseconds", `predicted ms, Cortex-M4F at ${sweep.clock_hz / 1e6} MHz`)];
  const draw = () => place.replaceChildren(...both(sweep.images, errors), ...(driven.length ? both(driven, successes) : []));
  draw();
  drawn.push(draw);
  const rows = all.map((image) => [image.curve + (image.is_own && image !== sweep.outside ? " (this image)" : ""), integer(image.bytes), fixed(image.milliseconds, 3), error(image.nmse), image.success ? percent(image.success[0]) : "-"]);
  const outside = sweep.outside ? ` This image is not of the sweep: its mark has its own bytes and time, and its error on ${runs.recording}.` : isKnown ? "" : " This image is not of the sweep, and is not marked: its error was not measured.";
  section("frontier", "Frontier", el("p", {}, "Each mark is an image of the sweep; each line joins those that no other image beats on both axes. The vertical axis is the NMSE of the network's raw output on held-out observations." + (driven.length ? " Below, it is the success in closed loop, in percent of the episodes." : "") + outside),
    legend(curves.map((name, i) => [name, ...markOf(i)])),
    place,
    el("details", {}, el("summary", {}, "As a table"), table(["curve", "bytes", "ms", "NMSE", "success"], rows, [1, 2, 3, 4])));
}
