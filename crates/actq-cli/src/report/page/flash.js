
// e. The flash map.
{
  const short = (core) => facts.cores[core].title.replace(/^an? /, "");
  const select = el("select", { id: "part", onchange: () => flash() }, ...parts.map(({ name, core }, i) => el("option", { value: i }, `${name} (${short(core)})`)), el("option", { value: "custom" }, "another size"));
  const core = el("select", { id: "core", onchange: () => flash() }, ...Object.keys(facts.cores).map((name) => el("option", { value: name, selected: name === facts.time[0] && "" }, short(name))));
  const number = (id, initial) => el("input", { type: "number", id, value: initial, min: 1, oninput: () => flash(), style: "width: 96px" });
  const [flashSize, ramSize, clock] = [number("flash-size", 256), number("ram-size", 64), number("mhz", 64)];
  const size = (input) => input.valueAsNumber || 0;
  const labelled = (text, input) => el("span", { class: "pair" }, el("label", { for: input.id }, text), input);
  const own = el("span", { class: "row", hidden: "" }, labelled("core", core), labelled("flash, KB", flashSize), labelled("RAM, KB", ramSize), labelled("MHz", clock));
  const place = el("div");
  function flash() {
    const isCustom = select.value === "custom";
    own.hidden = !isCustom;
    const part = isCustom ? { core: core.value, flash: 1024 * size(flashSize), ram: 1024 * size(ramSize), megahertz: size(clock) } : parts[Number(select.value)];
    const { title, bytes, scratch, cycles, runtime, is_modelled, is_own } = facts.cores[part.core];
    const free = part.flash - bytes - runtime;
    const hertz = 1e6 * part.megahertz;
    const late = hertz > 0 && tooSlow(cycles, hertz);
    const notes = [];
    if (free < 0) notes.push(`${integer(-free)} bytes of flash are missing.`);
    if (scratch > part.ram) notes.push(`${integer(scratch - part.ram)} bytes of RAM are missing.`);
    if (late) notes.push(late);
    const reasons = [...notes];
    if (isCustom) notes.push(`The core is ${title}.`);
    if (part.is_external) notes.push("The flash is a chip of its own; this is its usual size.");
    if (!is_own) notes.push(`These figures are those of the image in the layouts of ${title}, which actq repack --core ${part.core} writes.`);
    if (facts.periods > 1) notes.push(`A step may take ${facts.periods} periods, as the rest of a chunk plays meanwhile, if it runs in slices.`);
    notes.push("Predicted for memory that never waits; flash with wait states takes longer.");
    const time = hertz > 0 ? `${milliseconds(cycles, hertz)} at ${part.megahertz} MHz, ${is_modelled ? "predicted" : "an estimate"}` : "no clock";
    // The part that does not fit is drawn after the end of the flash.
    const all = Math.max(part.flash, bytes + runtime);
    const block = (bytes, colour) => el("i", { style: `--c: var(${colour}); flex: ${Math.max(bytes, 0)} 0 0` });
    const end = el("b", { style: `left: ${(100 * part.flash) / all}%`, hidden: free < 0 ? undefined : "" });
    place.replaceChildren(
      el("div", { class: "flash", role: "img", "aria-label": `image ${bytes} bytes, runtime ${runtime} bytes, free ${Math.max(0, free)} bytes${free < 0 ? `, beyond the end of the flash ${-free} bytes` : ""}` }, block(bytes, "--image"), block(runtime, "--b4"), ...(free > 0 ? [block(free, "--card")] : []), end),
      legend([["image", "var(--image)"], ["runtime", "var(--b4)"], ...(free < 0 ? [["end of the flash", "var(--warn)", "M-2,-8h4v16h-4z"]] : [["free", "var(--card)"]])]),
      figures([["fits", reasons.length ? "no" : hertz > 0 ? "yes" : "unknown"], ["image", `${integer(bytes)} B`], ["runtime", `${integer(runtime)} B`], ["flash left", free < 0 ? "none" : `${integer(free)} B`], ["RAM left for stack and program", scratch > part.ram ? "none" : `${integer(part.ram - scratch)} B`], ["a step", time], [`share of ${periods}`, hertz > 0 ? percent(share(cycles, hertz)) : "no clock"]]),
      el("p", { class: reasons.length ? "warn" : undefined }, notes.join(" ")));
  }
  flash();
  section("flash", "Flash map", el("div", { class: "row" }, labelled("Part", select), own), place,
    el("p", { class: "soft" }, `The runtime is the code that checks and runs any image; a build for this image alone is smaller. The image has ${integer(facts.beside[0])} bytes of biases, ${integer(facts.beside[1])} of self-test and ${integer(facts.beside[2])} of header and tables.`));
}
