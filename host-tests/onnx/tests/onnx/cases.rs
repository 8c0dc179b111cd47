//! Networks as text, each with what the import makes of it: the files in `cases/`.
//!
//! `== ` begins a section. Its first lines describe the file: `input NAME AXES` and `integers NAME AXES` (without one,
//! the input `obs` of 1 by 11), `output NAME AXES`, `choose OUTPUT`, `observe INPUT`; `layer N` ends the network in a
//! layer of its last value, which has N elements; `between` puts it between two layers of 16 values, where `x` is the
//! output of the first. Then networks follow in the notation of [`super::notation`], each with its expectations:
//! `> ops: ..`, `> some: 2 add` (so many ops of this name), `> same`, `> refused: ..` and the other keys of
//! [`Case::found`]. The first three require the actions of tract.

use actq_cli::report::imported::summary;
use actq_cli::report::notes;
use actq_onnx::{ImportOptions, Imported};
use anyhow::{Context as _, Result, bail, ensure};

use super::file::File;
use super::styles::{OBS, ended};
use super::{imported, same};

/// A network and its expectations.
#[derive(Default)]
pub(super) struct Case<'t> {
    pub(super) section: &'t str,
    header: Vec<(&'t str, &'t str)>,
    pub(super) text: String,
    expected: Vec<(&'t str, &'t str)>,
}

/// First words of the lines that describe a file.
const HEADER: [&str; 7] = ["input", "integers", "output", "choose", "observe", "layer", "between"];

pub(super) fn parse(file: &str) -> Vec<Case<'_>> {
    let mut cases: Vec<Case<'_>> = Vec::new();
    for line in file.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let is_new = cases.last().is_none_or(|case| !case.expected.is_empty());
        if word == "==" {
            cases.push(Case { section: rest, ..Case::default() });
            continue;
        }
        if word != ">"
            && is_new
            && let Some(Case { section, header, .. }) = cases.last()
        {
            let case = Case { section, header: header.clone(), ..Case::default() };
            cases.push(case);
        }
        let case = cases.last_mut().expect("a section");
        match word {
            ">" => case.expected.push(rest.split_once(':').map_or((rest, ""), |(key, value)| (key, value.trim()))),
            _ if HEADER.contains(&word) && case.text.is_empty() => case.header.push((word, rest)),
            _ => case.text += &format!("{line}\n"),
        }
    }
    cases
}

/// Checks all cases of a file.
pub(super) fn check(file: &str) -> Result<()> {
    let fault = |case: &Case<'_>| {
        let error = case.check().err()?;
        Some(format!("{}:\n{}{error:#}\n", case.section, case.text))
    };
    let faults: Vec<String> = parse(file).iter().filter_map(fault).collect();
    ensure!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}

impl Case<'_> {
    /// Returns the values of a key in the header.
    fn all(&self, key: &str) -> impl Iterator<Item = &str> {
        self.header.iter().filter(move |(of, _)| *of == key).map(|(_, value)| *value)
    }

    /// Returns the ops that are expected of the network alone.
    pub(super) fn ops(&self) -> &str {
        self.expected.iter().find(|(key, _)| *key == "ops").map_or("", |(_, ops)| ops)
    }

    fn is_between(&self) -> bool {
        self.all("between").next().is_some()
    }

    fn bytes(&self) -> Vec<u8> {
        let port = |text: &str| {
            let mut words = text.split(' ').map(str::to_owned);
            let name = words.next().expect("a name");
            (name, words.map(|axis| axis.parse().expect("an axis")).collect::<Vec<i64>>())
        };
        let mut file = File::default();
        for (kind, text) in self.header.iter().filter(|(kind, _)| *kind == "input" || *kind == "integers") {
            let (name, axes) = port(text);
            if *kind == "input" { file.input(&name, &axes) } else { file.integers(&name, &axes) }
        }
        if self.all("input").chain(self.all("integers")).next().is_none() {
            file.input("obs", &[1, OBS as i64]);
        }
        for (name, axes) in self.all("output").map(port) {
            file.output(&name, &axes);
        }
        if self.is_between() {
            let last = file.write(&[], &format!("x = gemm(obs, 16, 11)\n{}", self.text));
            return ended(file, &last, 16);
        }
        let last = file.write(&[], &self.text);
        match self.all("layer").next() {
            Some(len) => ended(file, &last, len.parse().expect("a length")),
            None => file.bytes(),
        }
    }

    fn check(&self) -> Result<()> {
        let bytes = self.bytes();
        let options = ImportOptions {
            output: self.all("choose").next().map(str::to_owned),
            observed: self.all("observe").map(str::to_owned).collect(),
            ..ImportOptions::default()
        };
        ensure!(!self.expected.is_empty(), "nothing is expected");
        let is_refused = self.expected.iter().any(|(key, _)| *key == "refused");
        let result = imported(&bytes, &options);
        if is_refused {
            let error = result.err().map(|error| format!("{error:#}")).context("it is imported")?;
            for (key, text) in &self.expected {
                ensure!(error.contains(text) == (*key == "refused"), "{key} {text}: {error}");
            }
            return Ok(());
        }
        let (imported, policy) = result?;
        let report = summary(&imported, &policy);
        let refusal =
            "a step with NaN or infinity in its observation is refused, and the application must replace such values";
        ensure!(report.contains(refusal) != imported.guards.is_empty(), "{report}");
        ensure!(imported.guards.iter().all(|guard| report.matches(guard).count() == 1), "{report}");
        // `quantize` and Python take the file without this summary.
        let notes = notes::of_policy(&policy).join("\n");
        ensure!(imported.guards.iter().all(|guard| notes.contains(guard)), "{notes}");
        if self.expected.iter().any(|(key, _)| ["ops", "some", "same"].contains(key)) {
            same(&bytes)?;
        }
        for (key, value) in &self.expected {
            let found = self.found(&imported, key, value)?;
            ensure!(found == *value, "{key}: {found} instead of {value}");
        }
        Ok(())
    }

    /// Returns the value of a key of the expectations.
    fn found(&self, imported: &Imported, key: &str, value: &str) -> Result<String> {
        let ops = || imported.ops.join(" ");
        Ok(match key {
            "same" => String::new(),
            "ops" if self.is_between() => {
                let ops = ops();
                ops.strip_prefix("linear ").and_then(|ops| ops.strip_suffix(" linear")).unwrap_or(&ops).to_owned()
            }
            "ops" => ops(),
            "some" => {
                let name = value.rsplit(' ').next().unwrap_or_default();
                format!("{} {name}", imported.ops.iter().filter(|op| *op == name).count())
            }
            "contract" => imported.contract.join(" "),
            "inputs" => {
                imported.inputs.iter().map(|(name, len)| format!("{name} {len}")).collect::<Vec<_>>().join(", ")
            }
            "states" => {
                let one = |(from, to, len): &(String, String, usize)| format!("{from} {to} {len}");
                imported.states.iter().map(one).collect::<Vec<_>>().join(", ")
            }
            "output" => format!("{} {}", imported.output.0, imported.output.1),
            "cut inputs" => imported.cut_inputs.join(" "),
            "cut outputs" => imported.cut_outputs.join(" "),
            "guards" => imported.guards.join("; "),
            "faults" => imported.faults.join("; "),
            _ => bail!("no expectation {key:?}"),
        })
    }
}

macro_rules! files {
    ($($test:ident: $file:literal,)*) => {
        $(#[test]
        fn $test() -> Result<()> {
            check(include_str!(concat!("cases/", $file, ".txt")))
        })*
    };
}

files! {
    layers: "layers",
    activations: "activations",
    recurrent_cells_and_states: "states",
    attention: "attention",
    inputs_and_outputs: "ports",
    rows_and_positions: "rows",
    values_that_are_not_finite: "guards",
    refusals: "refusals",
}
