
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
// Of an image with raw inputs, the operations around the network are those of the diagram.
const isNetwork = ({ matrix }) => matrix !== null;
const [first, last] = [facts.ops.findIndex(isNetwork), facts.ops.findLastIndex(isNetwork)];
const net = el("div", { class: "net" });
const scale = Math.min(1, 150 / Math.max(...facts.matrices.flatMap(({ shape }) => shape), 1));
facts.ops.forEach((op, i) => {
  if (facts.ports.length && (i < first || i > last)) return;
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
section("network", "Network", el("p", {}, facts.is_trained ? "Each block is a matrix, each line in it a row of the trained matrix, coloured by its bits; rows without bits were removed or give a constant." : "Each block is a matrix, each line in it a row of the image, coloured by its bits. The image's statistics (--stats) would add the removed rows.", facts.ports.length ? " The operations before the first matrix and after the last are in the diagram of raw inputs and targets." : ""),
  legend(widthsPresent.map(([, name, colour]) => [name, `var(${colour})`])), net, detail,
  el("details", {}, el("summary", {}, "As a table"), table(["op", "detail", "output", "bits of the rows", "bytes", "cycles"], facts.ops.map((op) => {
    const matrix = op.matrix === null ? null : facts.matrices[op.matrix];
    const counts = matrix && WIDTHS.map(([digit]) => [digit, [...matrix.widths].filter((d) => d === digit).length]).filter(([, n]) => n).map(([d, n]) => `${n}\u00d7${d}`).join(" ");
    return [op.name, op.detail, integer(op.output), counts ?? "", matrix ? integer(matrix.bytes) : "", integer(op.cycles)];
  }), [2, 4, 5])));
