//! The documents: `docs/CLI.md` holds every help text, and what is shown in C, Python and TOML parses.

use std::fs;
use std::process::Command;

use actq_bench::command::{actq, run, succeeded};
use actq_bench::{root, skipped};
use actq_deploy::Answers;
use anyhow::{Context, Result, bail, ensure};
use tempfile::TempDir;

const GENERATED: &str = "<!-- Below, the help of every command. Do not edit; write it anew by\n     \
                         ACTQ_BLESS=1 cargo test --profile checks -p actq-host-tests docs:: -->\n";

fn read(path: &str) -> Result<String> {
    fs::read_to_string(root().join(path)).with_context(|| path.to_owned())
}

/// The line with breaks before column 110; further lines have its indent.
fn wrap(line: &str) -> String {
    let indent = &line[..line.len() - line.trim_start().len()];
    let (mut text, mut column) = (indent.to_owned(), indent.len());
    for (i, word) in line.trim_start().split(' ').enumerate() {
        let is_first = i == 0;
        if !is_first && column + 1 + word.len() > 110 {
            text += &format!("\n{indent}{word}");
            column = indent.len() + word.len();
        } else {
            text += &format!("{}{word}", if is_first { "" } else { " " });
            column += word.len() + usize::from(!is_first);
        }
    }
    text
}

/// Appends the help of a command as Markdown, then that of its subcommands.
fn append_help(path: &[&str], to: &mut String) -> Result<()> {
    let mut command = actq(path);
    command.arg("--help").env_remove("ACTQ_POLICY");
    let help = succeeded(&run(command, b"")?)?;
    let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
    let wrapped: Vec<String> = lines.iter().map(|line| wrap(line)).collect();
    *to += &format!("\n## {}\n\n```text\n{}\n```\n", [&["actq"], path].concat().join(" "), wrapped.join("\n"));
    let listed = lines.iter().skip_while(|line| **line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !["", "help"].contains(name)).try_for_each(|name| append_help(&[path, &[name]].concat(), to))
}

#[test]
fn command_reference_is_the_help() -> Result<()> {
    let text = read("docs/CLI.md")?;
    let (by_hand, generated) = text.split_once(GENERATED).context("docs/CLI.md has no generated part")?;
    let mut wanted = String::new();
    append_help(&[], &mut wanted)?;
    if std::env::var_os("ACTQ_BLESS").is_some() {
        return Ok(fs::write(root().join("docs/CLI.md"), format!("{by_hand}{GENERATED}{wanted}"))?);
    }
    ensure!(generated == wanted, "docs/CLI.md differs from the help; run this test with ACTQ_BLESS=1");
    Ok(())
}

/// Cargo packages the files in a crate's folder only.
#[test]
fn shipped_packages_hold_their_licences() -> Result<()> {
    let manifest = read("Cargo.toml")?;
    let members: Vec<&str> =
        manifest.split('"').filter(|part| root().join(part).join("Cargo.toml").is_file()).collect();
    let mut shipped = vec!["python"];
    for member in members {
        if !read(&format!("{member}/Cargo.toml"))?.contains("publish = false") {
            shipped.push(member);
        }
    }
    ensure!(shipped.len() >= 12, "{shipped:?}");
    for (folder, name) in shipped.iter().flat_map(|folder| [(folder, "LICENSE-MIT"), (folder, "LICENSE-APACHE")]) {
        ensure!(read(&format!("{folder}/{name}"))? == read(name)?, "{folder}/{name} is not the project's");
    }
    Ok(())
}

pub(crate) fn listings<'a>(document: &'a str, language: &str) -> Vec<&'a str> {
    let parts = document.split(&format!("```{language}\n")).skip(1).collect::<Vec<_>>();
    parts.into_iter().filter_map(|rest| rest.split("```").next()).collect()
}

#[test]
fn shown_answers_are_read() -> Result<()> {
    let text = read("docs/DEPLOY.md")?;
    let answers = listings(&text, "toml");
    ensure!(answers.len() == 2, "docs/DEPLOY.md has {} listings of answers", answers.len());
    let family = read("docs/families/holosoma.md")?;
    for answers in answers.into_iter().chain(listings(&family, "toml")) {
        Answers::parse(answers)?;
    }
    Ok(())
}

/// The Python package's tests run the listings of PYTHON and IMPORT; this one needs lerobot.
#[test]
fn the_shown_export_of_lerobot_parses() -> Result<()> {
    let text = read("docs/families/lerobot.md")?;
    let [listing] = listings(&text, "python")[..] else { bail!("docs/families/lerobot.md has one listing in Python") };
    let mut python = Command::new("python3");
    python.args(["-c", "import ast, sys; ast.parse(sys.stdin.read())"]);
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("python3 is not installed");
        return Ok(());
    }
    succeeded(&run(python, listing.as_bytes())?)?;
    Ok(())
}

#[test]
fn shown_c_compiles() -> Result<()> {
    let text = read("docs/C.md")?;
    let &[listing] = &listings(&text, "c")[..] else { bail!("docs/C.md has one listing in C") };
    let dir = TempDir::new()?;
    let path = |name: &str| dir.path().join(name);
    fs::copy(root().join("kernels/tests/valid.actq"), path("policy.actq"))?;
    let [image, policy] = ["policy.actq", "policy"].map(|name| path(name).display().to_string());
    succeeded(&run(actq(&["export-c", &image, "--out", &policy]), b"")?)?;
    let program = format!(
        "#include \"actq.h\"\n#include \"policy.h\"\n\
         void act(const float *observation, float *action);\n\
         void act(const float *observation, float *action) {{\n{listing}\n}}\n"
    );
    fs::write(path("listing.c"), program)?;
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-fsyntax-only"]);
    compiler.arg("-I").arg(root().join("capi/include")).arg("-I").arg(&policy).arg(path("listing.c"));
    match compiler.output() {
        Err(_) => skipped("cc is not installed"),
        Ok(output) => ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
    }
    Ok(())
}
