
// d. Errors and traces.
const live = {};
const floats = (base64) => words(base64, Float32Array);
if (runs) {
  const worstShare = Math.max(...runs.actions.map(([ratio]) => ratio ?? 0));
  const bar = (share) => el("div", { class: "bar", style: "--c: var(--image)" }, el("i", { style: `left:0;width:${100 * share}%` }));
  const actions = table(["action", "NMSE", "largest error", "share of the largest NMSE"], runs.actions.map(([ratio, max], i) => [actionNames[i], error(ratio), value(max), bar(worstShare ? (ratio ?? 0) / worstShare : 0)]), [1, 2]);
  const layers = facts.ops.map((op, i) => [op, i]).filter(([op]) => isNetwork(op));
  const byLayer = table(["matrix", "weights", "rounding"], layers.map(([op, i]) => {
    const { name, error_share } = facts.matrices[op.matrix];
    return [name, error_share === null ? "-" : percent(error_share), error(runs.rounding[i])];
  }), [1, 2]);

  // An action over a part of an episode, with the steps of the largest errors.
  const option = (name, i) => el("option", { value: i }, name);
  const choice = (id, all) => el("select", { id, onchange: () => trace() }, ...all.map(option));
  const episode = choice("episode", runs.traces.map(({ at }) => `${at[0]}`));
  const dimension = choice("dimension", actionNames);
  const place = el("div");
  const LINES = [["image", "var(--image)", 3.5], ["f32 policy", "var(--text)", 1.3]];
  function trace() {
    const i = Number(dimension.value);
    const { at: [number, start], actions: [exact, own] } = runs.traces[episode.value];
    const of = (base64) => floats(base64).filter((_, j) => j % facts.action === i);
    const [f32, image] = [of(exact), of(own)];
    const time = (step) => step / facts.rate_hz;
    const end = start + Math.max(1, f32.length - 1);
    place.replaceChildren(chart({
      label: `${actionNames[i]} in episode ${number}, f32 policy and image`, width: fitting(1100), height: 300,
      x: { min: time(start), max: time(end), name: `seconds from the start of episode ${number}` }, y: { ...range([...f32, ...image]), name: `${actionNames[i]}, in the policy's units` },
      draw(root, sx, sy) {
        for (const [values, [, stroke, width]] of [[image, LINES[0]], [f32, LINES[1]]]) {
          root.append(svg("polyline", { points: [...values].map((v, t) => `${sx(time(start + t))},${sy(v)}`).join(" "), fill: "none", stroke, "stroke-width": width, "stroke-linejoin": "round" }));
        }
        for (const { at: [listed, step], error: size } of runs.worst) {
          if (listed !== number || step < start || step > end) continue;
          root.append(svg("circle", { cx: sx(time(step)), cy: sy(image[step - start]), r: 5, fill: "none", stroke: "var(--focus)", "stroke-width": 2 }, svg("title", {}, `step ${step}, error ${error(size)}`)));
        }
      },
    }));
  }
  trace();
  drawn.push(trace);

  const worst = table(["episode", "step", "error"], runs.worst.map((one) => {
    const load = () => live.load?.(floats(one.observation), one);
    const button = el("button", { type: "button", "aria-label": `episode ${one.at[0]}, step ${one.at[1]}: run this observation`, onclick: load }, String(one.at[0]));
    return el("tr", {}, ...[button, String(one.at[1]), error(one.error)].map((content) => el("td", { class: "n" }, content)));
  }), [0, 1, 2]);
  const ran = facts.execute > 1 ? " on which the network ran" : "";
  section("errors", "Errors", el("p", {}, `Actions of the image against the f32 policy on ${integer(runs.compared)} of ${counted(runs.recorded, "observation")} of ${runs.recording}, after the action contract.`, runs.nmse ? ` The NMSE of the network's raw output on ${integer(runs.nmse[1])} of them is ${error(runs.nmse[0])}.` : ""),
    el("div", { class: "two" }, el("div", {}, el("h3", {}, "By action"), actions), el("div", {}, el("h3", {}, "By layer"), byLayer, el("p", { class: "soft" }, "Weights: the matrix's share of the error that its weights were predicted to cause, from the statistics. Rounding: the NMSE that rounding its input adds to its output, measured on the recording."))),
    el("h3", {}, "Episodes"), el("p", { class: "soft" }, "The first episode, and those of the largest errors."),
    el("div", { class: "row" }, el("label", { for: "episode" }, "Episode"), episode, el("label", { for: "dimension" }, "Action"), dimension),
    legend([...LINES.map(([name, colour, width]) => [name, colour, `M-8,${-width / 2}h16v${width}h-16z`]), ["listed below", "var(--focus)", "M-5,0a5,5 0 1,0 10,0a5,5 0 1,0 -10,0M-3,0a3,3 0 1,1 6,0a3,3 0 1,1 -6,0z"]]), place,
    el("h3", {}, `The worst 1 % of the observations${ran}${runs.worst.length < runs.percent ? `, the first ${runs.worst.length}` : ""}`), el("p", { class: "soft" }, "The error is the squared difference of the actions over their variance, a mean over the actions. Choose one to run it in the page, below, from the state that the heads had in the episode."), worst);
}
