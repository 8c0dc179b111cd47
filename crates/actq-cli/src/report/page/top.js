
// a. What it is.
const period = 1 / facts.rate_hz;
/** A step's share of the time that it has: of a period, or of several if the rest of a chunk plays meanwhile. */
const share = (cycles, hertz) => cycles / hertz / period / facts.periods;
const periods = facts.periods > 1 ? `${facts.periods} periods of ${fixed(1e3 * period, 1)} ms` : `the period of ${fixed(1e3 * period, 1)} ms`;
const tooSlow = (cycles, hertz) => share(cycles, hertz) > 1 && `A step takes longer than ${periods}: its action is late. Take a faster part, a smaller image, or a lower rate.`;
const [, cycles, hertz] = facts.time;
const coreTitle = facts.cores[facts.time[0]]?.title ?? facts.time[0];
function trust() {
  const sentences = [];
  if (runs) {
    const [count, of] = [runs.nmse?.[1] ?? runs.compared, runs.nmse ? "raw output differs" : "actions differ"];
    sentences.push(`On ${integer(count)} of ${counted(runs.recorded, "recorded observation")} the image's ${of} from the f32 policy's by an NMSE of ${error(runs.error)} (mean squared error over variance; 1 is no better than a constant).`);
  } else {
    const absent = data.has_policy ? "recordings (--recordings)" : "the policy (--policy) and recordings (--recordings)";
    sentences.push(`No error is shown: the report was made without ${absent}.`);
  }
  sentences.push(data.success ? "Success was measured in closed loop." : "An error on recordings does not replace a test in closed loop.");
  sentences.push(`Times are predicted by a model of ${coreTitle} with memory that never waits; nothing here was measured on hardware.`);
  return sentences.join(" ");
}
{
  const warnings = [tooSlow(cycles, hertz) && `${tooSlow(cycles, hertz)} (At ${hertz / 1e6} MHz.)`, ...data.warnings.map(sentence)].filter(Boolean);
  document.getElementById("top").append(
    el("h1", {}, facts.name),
    el("p", { class: "soft" }, `${facts.kind}, ${facts.observation} values of observation, ${facts.action} of action, ${facts.rate_hz} Hz`),
    el("ul", { id: "warnings", class: "warn", hidden: warnings.length ? undefined : "" }, ...warnings.map((text) => el("li", {}, text))),
    figures([
      ["image", `${integer(facts.bytes)} B`],
      ["bits per weight", fixed(facts.bits_per_weight, 3)],
      [`a step, predicted at ${hertz / 1e6} MHz`, milliseconds(cycles, hertz)],
      [`share of ${periods}`, percent(share(cycles, hertz))],
      ["scratch RAM", `${integer(facts.scratch)} B`],
      runs && [runs.nmse ? "error of the raw output (NMSE)" : "error of the actions (NMSE)", error(runs.error)],
      data.own_path && ["error on its own path", error(data.own_path[0])],
      data.success && ["success", `${percent(data.success[0])} of ${data.success[1]}`],
      data.success && ["95 % interval", data.success[2].map(percent).join(" to ")],
    ]),
    el("p", { id: "trust" }, trust()),
    el("p", { class: "soft mono" }, `sha256 ${facts.sha256}`),
  );
}
