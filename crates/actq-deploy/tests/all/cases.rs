//! Cases of each family: a folder of a bundle, edits of it, and what reading it gives.
//!
//! `tests/cases/FAMILY/cases.toml` lists the cases and `expected.txt` has the results. `UPDATE_EXPECT=1` writes them.

use std::fs;
use std::path::{Path, PathBuf};

use actq::error::{Context as _, Error, Result, ensure};
use actq_deploy::{Deployment, Reading, Runner};
use expect_test::expect_file;
use serde::Deserialize;

use crate::common::difference::difference;
use crate::common::made::Files;

/// Ticks that a snapshot shows, and the last one.
const SHOWN: usize = 2;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cases {
    case: Vec<Case>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    /// Folder of the bundle.
    #[serde(default = "base")]
    base: String,
    /// A profile that the user gives, in the family's folder.
    profile: Option<String>,
    /// The values of the family's profile hold.
    #[serde(default = "yes")]
    accept: bool,
    #[serde(default)]
    answers: String,
    /// Ticks to run, with made values.
    #[serde(default)]
    ticks: usize,
    /// Files that are removed.
    #[serde(default)]
    remove: Vec<String>,
    /// File, text that occurs once in it, and its replacement.
    #[serde(default)]
    edit: Vec<[String; 3]>,
    /// Files that are added or replaced, and their texts.
    #[serde(default)]
    add: Vec<[String; 2]>,
}

fn base() -> String {
    "base".to_owned()
}

fn yes() -> bool {
    true
}

impl Case {
    fn files(&self, folder: &Path) -> Result<Files> {
        let mut files = Files::read(&folder.join(&self.base))?.0;
        for name in &self.remove {
            ensure!(files.remove(name).is_some(), "{}: there is no file {name}", self.name);
        }
        for [name, from, to] in &self.edit {
            let bytes = files.get_mut(name).with_context(|| format!("{}: there is no file {name}", self.name))?;
            let text = String::from_utf8_lossy(bytes).into_owned();
            ensure!(text.matches(from.as_str()).count() == 1, "{}: {from:?} must occur once in {name}", self.name);
            *bytes = text.replace(from, to).into_bytes();
        }
        files.extend(self.add.iter().map(|[name, text]| (name.clone(), text.clone().into_bytes())));
        Ok(Files(files))
    }

    /// Returns the lines of the result.
    fn result(&self, folder: &Path) -> Result<Vec<String>> {
        let files = self.files(folder)?;
        let profile = self.profile.as_ref().map(|name| fs::read_to_string(folder.join(name))).transpose()?;
        let reading = match files.reading_by(profile.as_deref(), self.accept, &self.answers) {
            Ok(reading) => reading,
            Err(error) => return Ok(format!("refused: {error:#}").lines().map(str::to_owned).collect()),
        };
        let mut lines = described(&reading)?;
        if self.ticks > 0 {
            lines.extend(run(&files, &reading, self.ticks)?);
        }
        Ok(lines)
    }
}

fn described(reading: &Reading) -> Result<Vec<String>> {
    let mut lines = vec![format!("family: {}", reading.family)];
    for question in &reading.questions {
        let profile = question.profile.as_ref().map_or_else(String::new, |(value, from)| format!(" [{value}: {from}]"));
        lines.push(format!("question {}: {}{profile}", question.key, question.meaning));
    }
    lines.extend(reading.unread.iter().map(|key| format!("unread: {key}")));
    let text = reading.description.to_toml(&reading.sources)?;
    lines.extend(text.lines().filter(|line| !line.is_empty()).map(str::to_owned));
    Ok(lines)
}

/// Runs ticks with made values, and makes an image.
fn run(files: &Files, reading: &Reading, ticks: usize) -> Result<Vec<String>> {
    ensure!(reading.questions.is_empty(), "{:#?}", reading.questions);
    let plan = files.plan(&reading.description)?;
    Deployment::new("policy", 50.0, &plan).context("an image of it")?;
    let mut runner = Runner::new(plan);
    let inputs = runner.plan().inputs().to_vec();
    let mut lines = Vec::new();
    for tick in 0..ticks {
        let given: Vec<Vec<f64>> = inputs.iter().map(|(name, len)| raw(name, *len, tick)).collect();
        let made = runner.step(&given)?;
        if tick < SHOWN || tick + 1 == ticks {
            lines.push(format!("tick {tick}: observation {}", numbers(&made.observation)));
            lines
                .extend(made.targets.iter().map(|(kind, values)| format!("tick {tick}: {kind:?} {}", numbers(values))));
        }
    }
    Ok(lines)
}

/// Makes raw values that reach limits; orientations have the length 1.
fn raw(name: &str, len: usize, tick: usize) -> Vec<f64> {
    let seed: f64 = name.bytes().map(f64::from).sum();
    let size = if name.contains("vel") { 8.0 } else { 1.5 };
    let values: Vec<f64> = (0..len).map(|i| size * (seed + 0.37 * tick as f64 + 1.3 * i as f64).sin()).collect();
    if len == 4 && ["quat", "orientation"].iter().any(|part| name.contains(part)) {
        let norm = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        return values.iter().map(|value| value / norm).collect();
    }
    values
}

fn numbers(values: &[f64]) -> String {
    let one = |value: &f64| if value.abs() < 1e4 { format!("{:.4}", value + 0.0) } else { format!("{value:.5e}") };
    let all = values.iter().map(|value| one(value).replace("-0.0000", "0.0000")).collect::<Vec<_>>();
    format!("[{}]", all.join(", "))
}

/// Compares all cases of a family with the file of their results. A result that is accepted is shown by its difference
/// from that of the folder's case with the fewest changes.
fn check(family: &str) -> Result<()> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/cases").join(family);
    let text = fs::read_to_string(folder.join("cases.toml"))?;
    let Cases { case: cases } = toml::from_str(&text).map_err(Error::other)?;
    let results = cases.iter().map(|case| case.result(&folder).with_context(|| case.name.clone()));
    let results: Vec<Vec<String>> = results.collect::<Result<_>>()?;
    let is_refused = |lines: &[String]| lines[0].starts_with("refused");
    let mut shown = String::new();
    for (case, lines) in cases.iter().zip(&results) {
        let same = cases.iter().zip(&results).filter(|(other, lines)| other.base == case.base && !is_refused(lines));
        let plain = same.min_by_key(|(other, _)| other.edit.len() + other.add.len() + other.remove.len());
        let body = match plain {
            Some((plain, own)) if plain.name != case.name && !is_refused(lines) => {
                format!("as {:?}, but\n{}", plain.name, difference(own, lines))
            }
            _ => lines.join("\n"),
        };
        shown += &format!("## {}\n{}\n\n", case.name, body.trim_end());
    }
    expect_file![folder.join("expected.txt")].assert_eq(&shown);
    Ok(())
}

macro_rules! families {
    ($($family:ident),*) => {
        $(
            #[test]
            fn $family() -> Result<()> {
                check(stringify!($family))
            }
        )*
    };
}

families!(
    holosoma,
    humanoidverse,
    isaaclab,
    kinfer,
    leapp,
    lerobot,
    limx,
    mine,
    mjlab,
    others,
    rl_sar,
    unitree_rl_lab,
    unread
);
