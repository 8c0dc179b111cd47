//! `docs/DEMO.md` against what prints it, without a run of the demo: its lines against the texts in the demo's sources,
//! its figures against those that the tree holds, and the policy by hand against the command.

use std::collections::BTreeMap;
use std::fs;

use actq::policy::Policy;
use actq_balancer::bundle;
use actq_bench::command::{actq, run, succeeded};
use actq_bench::uart::Disturbance;
use actq_bench::{root, ur3, ur3_flow};
use actq_deploy::Deployment;
use anyhow::{Context, Result, anyhow, bail, ensure};
use proc_macro2::{TokenStream, TokenTree};
use serde_json::Value;
use tempfile::TempDir;

/// Folder of the demo's sources, and those that print.
const FOLDER: &str = "tools/bench/src/bin/actq-bench";
const SOURCES: [&str; 5] = ["balancer", "demo", "faults", "kernels", "trials"];
/// Begins of lines that only a disturbed run prints.
const RARE: [&str; 3] = ["not judged, ", "not compared: ", "  {disturbance}: "];
/// The fewest letters of a `format!` that makes a whole line, and not a cell of a table.
const WHOLE_LINE: usize = 20;
/// Steps that learn the policy by hand here: nothing in its report but errors and time depends on them.
const STEPS: &str = "8";

fn read(path: &str) -> Result<String> {
    fs::read_to_string(root().join(path)).with_context(|| path.to_owned())
}

/// The texts in the sources.
#[derive(Default)]
struct Texts {
    /// Every string.
    strings: Vec<String>,
    /// Lines that are printed, with placeholders.
    lines: Vec<String>,
    /// Names of rows.
    rows: Vec<String>,
}

impl Texts {
    fn add(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        for (i, token) in tokens.iter().enumerate() {
            match (token, &tokens[i + 1..]) {
                (TokenTree::Literal(literal), _) => self.strings.extend(string(&literal.to_string())),
                (TokenTree::Group(group), _) => self.add(group.stream()),
                (TokenTree::Ident(name), rest) if name == "SIZES" || name == "ROWS" => {
                    let value = rest.iter().skip_while(|token| token.to_string() != "=").nth(1);
                    if let Some(TokenTree::Group(group)) = value {
                        self.rows.extend(group.stream().into_iter().filter_map(|row| string(&row.to_string())));
                    }
                }
                (TokenTree::Ident(name), [TokenTree::Punct(_), TokenTree::Group(group), ..]) => {
                    let least = if name == "println" { 1 } else { WHOLE_LINE };
                    if (name == "println" || name == "format")
                        && let Some(TokenTree::Literal(first)) = group.stream().into_iter().next()
                    {
                        let text = string(&first.to_string()).unwrap_or_default();
                        let lines = text.split('\n').filter(|line| letters(line) >= least);
                        self.lines.extend(lines.map(str::to_owned));
                    }
                }
                _ => {}
            }
        }
    }
}

/// Returns the value of a literal, if it is a string.
fn string(literal: &str) -> Option<String> {
    let quoted = literal.strip_prefix('"')?.strip_suffix('"')?;
    let mut lines = quoted.split("\\\n");
    let first = lines.next()?.to_owned();
    let whole = lines.fold(first, |whole, line| whole + line.trim_start());
    Some(whole.replace("\\n", "\n").replace("\\\"", "\""))
}

/// Returns the parts of a text around its placeholders.
fn parts(text: &str) -> Vec<&str> {
    text.split('{').map(|part| part.split_once('}').map_or(part, |(_, rest)| rest)).collect()
}

fn letters(text: &str) -> usize {
    parts(text).iter().flat_map(|part| part.chars()).filter(|c| c.is_alphabetic()).count()
}

/// Returns `true` if the line is the text with something in place of each placeholder.
fn fits(line: &str, text: &str) -> bool {
    let parts = parts(text);
    let [first, middle @ .., last] = &parts[..] else { return line == text };
    let Some(mut rest) = line.strip_prefix(first).and_then(|rest| rest.strip_suffix(last)) else { return false };
    middle.iter().all(|part| {
        let found = rest.get(1..).and_then(|rest| rest.split_once(part));
        rest = found.map_or(rest, |(_, after)| after);
        found.is_some()
    }) && !rest.is_empty()
}

/// Replaces placeholders by the values that they can have.
fn with_values(text: String, values: &BTreeMap<String, Vec<u64>>) -> Vec<String> {
    values.iter().fold(vec![text], |texts, (name, values)| {
        let placed = |text: String| match text.contains(&format!("{{{name}}}")) {
            true => values.iter().map(|value| text.replace(&format!("{{{name}}}"), &value.to_string())).collect(),
            false => vec![text],
        };
        texts.into_iter().flat_map(placed).collect()
    })
}

/// Returns the numbers after each occurrence of `front`.
fn numbers(text: &str, front: &str) -> Vec<u64> {
    let digits = |rest: &str| rest.chars().take_while(char::is_ascii_digit).collect::<String>().parse().ok();
    text.split(front).skip(1).filter_map(digits).collect()
}

/// Returns the parts of a document's indented lines, each without its indent, that blank lines divide.
fn blocks(document: &str) -> Vec<Vec<&str>> {
    let lines: Vec<&str> = document.lines().map(|line| line.strip_prefix("    ").unwrap_or_default()).collect();
    lines.split(|line| line.is_empty()).filter(|block| !block.is_empty()).map(<[&str]>::to_vec).collect()
}

/// Returns the cells of a table's line.
fn cells(line: &str) -> Vec<&str> {
    line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect()
}

/// Returns the lines that the demo can print, each with all values, and the texts of its sources.
fn printed() -> Result<(Vec<Vec<String>>, Texts)> {
    let (mut all, mut lines) = (Texts::default(), Vec::new());
    let defaults = numbers(&read(&format!("{FOLDER}/main.rs"))?, "default_value_t = ");
    let [episodes, qemu_episodes, ..] = defaults[..] else { bail!("main.rs has no numbers of episodes") };
    for name in SOURCES {
        let source = read(&format!("{FOLDER}/{name}.rs"))?;
        let mut texts = Texts::default();
        texts.add(source.parse().map_err(|error| anyhow!("{name}.rs: {error}"))?);
        let divisor = numbers(&read(&format!("{FOLDER}/demo.rs"))?, "EPISODES_DIVISOR: u64 = ");
        let divisor = divisor.first().context("no divisor of the episodes")?;
        let values = BTreeMap::from([
            ("RECORDED_EPISODES".to_owned(), numbers(&source, "const RECORDED_EPISODES: usize = ")),
            ("episodes".to_owned(), vec![episodes, episodes / divisor]),
            ("qemu_episodes".to_owned(), vec![qemu_episodes, qemu_episodes / divisor]),
        ]);
        lines.extend(std::mem::take(&mut texts.lines).into_iter().map(|line| with_values(line, &values)));
        all.strings.extend(texts.strings);
        all.rows.extend(texts.rows);
    }
    Ok((lines, all))
}

#[test]
fn the_transcript_is_what_the_demo_prints() -> Result<()> {
    let document = read("docs/DEMO.md")?;
    let (transcript, _) = document.split_once("\n## ").context("the document has one part")?;
    let (_, transcript) = transcript.split_once("` printed this").context("no transcript")?;
    let (lines, texts) = printed()?;
    let faults: Vec<String> =
        Disturbance::all(&[]).iter().filter(|d| d.is_for_demo()).map(ToString::to_string).collect();
    let is_known = |text: &&str| texts.strings.iter().chain(&faults).any(|known| known == text);
    let (mut shown, mut rows, mut kernels) = (Vec::new(), Vec::new(), Vec::new());
    for block in blocks(transcript) {
        if !block[0].starts_with(' ') {
            for line in block {
                ensure!(lines.iter().flatten().any(|text| fits(line, text)), "cargo demo does not print {line:?}");
                shown.push(line);
            }
            continue;
        }
        for (i, line) in block.into_iter().enumerate() {
            let cells = cells(line);
            if cells[0].starts_with("gemv") {
                kernels.push(cells);
                continue;
            }
            // All cells of a header are texts, and the first of a row.
            let names = if i == 0 { &cells[..] } else { &cells[..1] };
            ensure!(names.iter().all(is_known), "cargo demo does not print {line:?}");
            rows.push(cells);
        }
    }
    for texts in lines.iter().filter(|texts| !RARE.iter().any(|rare| texts[0].starts_with(rare))) {
        let is_shown = texts.iter().any(|text| shown.iter().any(|line| fits(line, text)));
        ensure!(is_shown, "docs/DEMO.md has no line {:?}", texts[0]);
    }
    for name in texts.rows.iter().chain(&faults) {
        ensure!(rows.iter().any(|row| row[0] == name), "docs/DEMO.md has no row {name:?}");
    }

    let policies = [Policy::load(&ur3())?, Policy::load(&ur3_flow())?, Deployment::load(bundle())?.policy];
    for Policy { name, parameters, .. } in policies {
        let sizes = format!("({parameters} parameters, {} bytes in f32)", 4 * parameters);
        ensure!(shown.iter().any(|line| line.ends_with(&sizes)), "docs/DEMO.md has another size of {name}");
    }
    let budgets: Value = serde_json::from_str(&read("budgets.json")?)?;
    let budgets = budgets["figures"].as_object().context("budgets.json has no figures")?;
    let of_kernels =
        budgets.iter().filter(|(name, _)| name.starts_with("instructions, gemv") && name.ends_with(", 256x256"));
    let mut counted: Vec<String> = of_kernels.map(|(name, count)| format!("{name}: {count}")).collect();
    let mut listed: Vec<String> = kernels
        .iter()
        .map(|k| format!("instructions, {} {} bits, scales {}, {}: {}", k[0], k[1], k[2], k[3], k[4]))
        .collect();
    listed.sort();
    counted.sort();
    assert_eq!(listed, counted, "docs/DEMO.md and budgets.json");
    Ok(())
}

/// Replaces each number by #, and each list of numbers by one #; spaces do not count.
fn blanked(line: &str) -> String {
    let mut text = String::new();
    for word in line.split_whitespace() {
        let is_number = |c: char| c.is_ascii_digit() || ".-".contains(c);
        let mut rest = word;
        while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
            let after = rest[at..].trim_start_matches(|c| is_number(c) || c == 'e');
            text += &format!("{}#", &rest[..at]);
            rest = after;
        }
        text += &format!("{rest} ");
    }
    while text.contains("#, #") {
        text = text.replace("#, #", "#");
    }
    text
}

#[test]
fn the_policy_by_hand_matches_the_command() -> Result<()> {
    let document = read("docs/DEMO.md")?;
    let (_, by_hand) = document.split_once("\n## One policy by hand\n").context("no policy by hand")?;
    let dir = TempDir::new()?;
    let mut commands: Vec<(Vec<String>, Vec<&str>)> = Vec::new();
    for block in blocks(by_hand) {
        for line in &block {
            if let Some(arguments) = line.strip_prefix("actq ") {
                let policy = ur3().display().to_string();
                let words = arguments.split_whitespace();
                let words =
                    words.map(|word| if word == "examples/ur3/policy" { policy.clone() } else { word.to_owned() });
                commands.push((words.collect(), Vec::new()));
            }
        }
        let is_command = |line: &str| line.starts_with("actq ") || line.starts_with("cargo ");
        // Few steps are not tried in several ways.
        let is_of_trials = block[0].trim_start().starts_with("setting ");
        if let Some((_, lines)) = commands.last_mut().filter(|_| !is_of_trials) {
            lines.extend(block.into_iter().filter(|line| !is_command(line)));
        }
    }
    ensure!(commands.len() == 2, "{} commands of actq", commands.len());
    for (mut words, expected) in commands {
        if words[0] == "quantize" {
            words.extend(["--quiet", "--steps", STEPS].map(str::to_owned));
        }
        let mut command = actq(&words.iter().map(String::as_str).collect::<Vec<_>>());
        command.current_dir(dir.path());
        let printed = succeeded(&run(command, b"")?)?;
        let printed: Vec<&str> = printed.lines().filter(|line| !line.is_empty()).collect();
        ensure!(printed.len() == expected.len(), "{} prints\n{}", words.join(" "), printed.join("\n"));
        for (line, expected) in printed.into_iter().zip(expected) {
            // Bytes and widths are chosen before learning.
            let is_exact =
                ["bytes", "rows:"].iter().any(|word| line.split(' ').any(|w| w.trim_end_matches('.') == *word));
            let same = match is_exact {
                true => line.split_whitespace().eq(expected.split_whitespace()),
                false => blanked(line) == blanked(expected),
            };
            ensure!(same, "{} prints\n{line}\nbut docs/DEMO.md has\n{expected}", words.join(" "));
        }
    }
    Ok(())
}
