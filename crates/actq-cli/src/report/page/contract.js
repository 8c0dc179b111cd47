
// g. The contract and the provenance.
{
  const rows = actionNames.map((name, i) => [name, ...facts.contract.map(([, values]) => (values[i] === null || Math.abs(values[i]) >= 3.4028234e38 ? "-" : value(values[i])))]);
  const contract = facts.contract.length ? table(["action", ...facts.contract.map(([name]) => name)], rows, facts.contract.map((_, i) => i + 1)) : el("p", {}, "The action has no scale and no limits.");
  const unlimited = data.warnings.filter((text) => text.includes("limits")).map(sentence);
  section("contract", "Contract", contract, ...unlimited.map((text) => el("p", { class: "warn" }, text)), el("p", {}, [`Control rate ${facts.rate_hz} Hz.`, ...facts.playback.map((text) => `${text[0].toUpperCase()}${text.slice(1)}.`), facts.self_test ? `A self-test of ${facts.self_test} steps is in the image.` : "No self-test is in the image."].join(" ")));
  section("provenance", "Provenance", table([], [["SHA-256 of the image", facts.sha256], ["CRC-32 in its header", facts.crc32], ["SHA-256 of its source", facts.source], ["features of the kernels", facts.features.join(" ")], ...facts.made, ["report by actq", facts.actq]].map(([name, text]) => el("tr", {}, el("th", { scope: "row" }, name), el("td", { class: "mono" }, text))), [], "Provenance"));
}

links();
start().catch((failure) => {
  bits.textContent = `The image cannot run here: ${failure.message}`;
  bits.className = "warn";
});
