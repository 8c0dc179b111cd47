
// The head in the page.
const output = el("div");
const bits = el("p", { id: "bits", role: "status" }, "Starting\u2026");
const speed = el("p", { class: "soft", id: "speed" });
const moment = el("p", { id: "moment", role: "status" });
const sliders = el("div", { class: "sliders", tabindex: "0", role: "group", "aria-label": "Observation" });
const message = el("p", { class: "warn", role: "alert" });
section("live", "Run it", el("p", {}, "The image runs here, compiled to WebAssembly, with the bits of a microcontroller. A moved slider computes the step again, from the same state: only Step goes on to the next one.", facts.execute > 1 ? ` The network runs once in ${facts.execute} steps and gives a chunk; the other steps play it, and a slider goes back to the start of the chunk.` : ""), bits, speed,
  el("div", { class: "row" }, el("button", { type: "button", onclick: () => live.step?.() }, "Step"), el("button", { type: "button", onclick: () => live.reset?.() }, "Reset"), el("button", { type: "button", onclick: () => live.load?.(data.head.start) }, "First observation")),
  moment, message, el("div", { class: "two" }, el("div", {}, el("h3", {}, `Observation, ${counted(facts.observation, "value")}`), sliders), el("div", {}, el("h3", {}, "Action"), output)));

/** Runs the golden run, and returns the number of steps, those with the expected bits, and the actions' ranges. */
function golden(head) {
  const [observations, expected] = [floats(data.head.observations), words(data.head.actions, Uint32Array)];
  const steps = observations.length / facts.observation;
  const ranges = limits.map(() => [0, 0]);
  let equal = 0;
  for (let i = 0; i < steps; i++) {
    const action = head.step(observations.subarray(i * facts.observation, (i + 1) * facts.observation));
    const own = new Uint32Array(action.buffer);
    equal += own.every((word, j) => word === expected[i * facts.action + j]) ? 1 : 0;
    action.forEach((v, j) => (ranges[j] = [Math.min(ranges[j][0], v), Math.max(ranges[j][1], v)]));
  }
  head.reset();
  return { steps, equal, ranges };
}

/** The action table: image, f32 policy, difference, the actions in the episode, and a bar in the action's range. */
function actionTable(hasExact, seen) {
  const heads = ["action", "image", ...(hasExact ? ["f32", "difference"] : []), "in the episode: image", "f32", "in its range"];
  const all = el("tbody");
  const rows = actionNames.map((name, i) => {
    const cells = heads.slice(1, -1).map(() => el("td", { class: "n" }));
    const [mark, zero] = [el("i"), el("b")];
    const [low, high] = limits[i].every(Number.isFinite) ? limits[i] : seen[i];
    const at = (v) => Math.min(100, Math.max(0, (100 * (v - low)) / (high - low || 1)));
    zero.style.left = `${at(0)}%`;
    const bar = el("td", {}, el("div", { class: "bar", style: "--c: var(--image)", title: `${value(low)} to ${value(high)}` }, mark, zero));
    all.append(el("tr", {}, el("td", {}, name), ...cells, bar));
    return { own: cells[0], exact: cells[1], difference: cells[2], recorded: cells.slice(-2).reverse(), draw: (v) => Object.assign(mark.style, { left: `${Math.min(at(v), at(0))}%`, width: `${Math.abs(at(v) - at(0))}%` }) };
  });
  const shown = table(heads, [], heads.slice(1, -1).map((_, i) => i + 1), "Actions");
  shown.querySelector("tbody").replaceWith(all);
  return { shown, rows, columns: [...shown.querySelectorAll("th")].slice(-3, -1) };
}

async function start() {
  const module = await compile(bytes(document.getElementById("module").textContent));
  const head = await Head.open(bytes(data.head.image), module);
  let exact;
  if (data.head.reference) {
    exact = await Head.open(await unpacked(data.head.reference.image), module);
    exact.useWeights(weightsOf(data.head.reference));
  }
  const { steps, equal, ranges } = golden(head);
  bits.textContent = equal === steps ? `All ${steps} steps of the golden run give the bits of the program that made this report.` : `Only ${equal} of ${steps} steps give the expected bits: do not trust this page on this browser.`;
  bits.className = equal === steps ? "" : "warn";
  bits.dataset.equal = equal === steps;
  const current = Float32Array.from(data.head.start);
  const began = performance.now();
  let count = 0;
  do head.step(current); while (++count < 1000 && performance.now() - began < 300);
  const each = (performance.now() - began) / count;
  speed.textContent = `A step took ${value(each)} ms in this browser, the mean of ${integer(count)}.`;
  speed.dataset.milliseconds = each * 1000;
  head.reset();

  const { shown, rows, columns } = actionTable(exact !== undefined, ranges);
  output.replaceChildren(shown, el("p", { class: "soft" }, "A bar starts at zero; its box is the action's range: the limits of the contract, or else the values of the golden run."),
    exact && data.head.reference.bits === 16 ? el("p", { class: "soft" }, "For the size of this file, the weights of the f32 policy are rounded to 16 bits here; the errors above, and the columns of the episode, are of the exact ones.") : "",
    runs && !exact ? el("p", { class: "soft" }, "The f32 policy is too large for this file; the section on errors compares with it.") : "");

  // The states before the step at which the network ran last, and the steps since then: a slider goes back there.
  let [before, since, taken, origin, failed] = [[], 0, 0, undefined, false];
  const keep = () => ([before, since] = [[head.save(), exact?.save()], 0]);
  function run() {
    message.textContent = "";
    const place = facts.execute > 1 ? `: action ${since + 1} of ${facts.execute} of a chunk` : "";
    const at = origin && `step ${origin.at[1]} of episode ${origin.at[0]}`;
    moment.textContent = (!origin ? `Step ${taken} after the reset` : taken === 1 ? `S${at.slice(1)}, from its state there` : `${sentence(counted(taken - 1, "step")).slice(0, -1)} after ${at}`) + `${place}.`;
    failed = false;
    try {
      const action = head.step(current);
      const other = exact?.step(current);
      rows.forEach(({ own, exact: cell, difference, draw }, i) => {
        own.textContent = fixed(action[i], 5);
        if (other) [cell.textContent, difference.textContent] = [fixed(other[i], 5), fixed(action[i] - other[i], 5)];
        draw(action[i]);
      });
    } catch (failure) {
      message.textContent = failure.message;
      failed = true;
    }
  }
  /** Shows an episode's actions beside those of the page, or none. */
  function record(one) {
    const recorded = one?.actions.map(floats);
    columns.forEach((column) => (column.hidden = !recorded));
    rows.forEach((row, i) => row.recorded.forEach((cell, which) => {
      cell.hidden = !recorded;
      if (recorded) cell.textContent = fixed(recorded[which][i], 5);
    }));
  }
  function again() {
    record();
    head.restore(before[0]);
    exact?.restore(before[1]);
    [taken, since] = [taken - since, 0];
    run();
  }
  live.step = () => {
    record();
    // An error drops the chunk.
    if (++since >= facts.execute || failed) keep();
    taken++;
    run();
  };
  const inputs = inputNames.map((name, i) => {
    const [low, high] = data.head.ranges[i];
    const shown = el("output", { for: `s${i}` });
    const input = el("input", { type: "range", id: `s${i}`, min: low, max: high, step: (high - low) / 500, oninput: () => {
      current[i] = input.valueAsNumber;
      shown.textContent = value(current[i]);
      again();
    } });
    sliders.append(el("div", { class: "slider" }, el("label", { for: `s${i}` }, name), input, shown));
    return { input, shown };
  });
  /** Sets the observation and the state: those of a reset, or those of a listed step of an episode. */
  function begin(observation, listed) {
    current.set(observation);
    inputs.forEach(({ input, shown }, i) => {
      input.value = current[i];
      shown.textContent = value(current[i]);
    });
    head.reset();
    exact?.reset();
    if (listed) {
      exact?.restore(bytes(listed.states[0]));
      head.restore(bytes(listed.states[1]));
    }
    record(listed);
    [taken, origin] = [1, listed];
    keep();
    run();
  }
  live.reset = () => begin(current);
  live.load = (observation, listed) => {
    begin(observation, listed);
    document.getElementById("live").scrollIntoView({ block: "nearest" });
  };
  begin(data.head.start);
  document.documentElement.dataset.ready = "true";
}
