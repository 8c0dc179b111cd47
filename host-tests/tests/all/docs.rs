//! The documents against the commands: `docs/CLI.md` holds every help text, and every command that is shown exists.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use actq_bench::command::{actq, run, succeeded};
use actq_bench::{root, skipped};
use actq_deploy::Answers;
use anyhow::{Context, Result, bail, ensure};
use tempfile::TempDir;

const GENERATED: &str = "<!-- Below, the help of every command. Do not edit; write it anew by\n     \
                         ACTQ_BLESS=1 cargo test --profile checks -p actq-host-tests docs:: -->\n";
/// Commands of cargo itself, of cargo-fuzz and of cargo-semver-checks.
const CARGO: &[&str] = &["+nightly", "build", "check", "install", "publish", "run", "semver-checks", "test"];

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

/// The commands in a document's indented lines, listings and code spans, as words.
fn commands(text: &str) -> impl Iterator<Item = Vec<&str>> {
    let spans = text.split('`').skip(1).step_by(2).flat_map(str::lines);
    let lines = text.lines().filter(|line| line.starts_with("    ")).chain(spans);
    let words = lines.map(|line| line.split_whitespace().skip_while(|word| *word == "$" || word.contains('=')));
    let programs = ["actq", "cargo", "sh"];
    words.map(Iterator::collect).filter(move |words: &Vec<&str>| words.len() > 1 && programs.contains(&words[0]))
}

/// Checks the subcommands and options of `actq` against `docs/CLI.md`.
fn check_actq(words: &[&str], reference: &str) -> Result<()> {
    let is_name =
        |word: &&&str| word.split('-').all(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase()));
    let path: Vec<&str> = words.iter().take_while(is_name).copied().collect();
    let (_, section) = reference.split_once(&format!("\n## {}\n", path.join(" "))).context("no such subcommand")?;
    let section = section.split("\n## ").next().unwrap_or(section);
    let options = words.iter().map(|word| word.trim_matches(['[', ']', ','])).filter(|word| word.starts_with("--"));
    let mut unknown = options.filter(|word| !section.split_whitespace().any(|w| w.trim_end_matches(',') == *word));
    ensure!(unknown.next().is_none(), "an option is not in its help");
    Ok(())
}

/// Checks the commands of cargo: aliases, those of xtask, and packages.
fn check_cargo(words: &[&str], aliases: &str, xtask: &str, manifests: &str) -> Result<()> {
    let is_known = match words[1] {
        "xtask" => words.get(2).is_none_or(|name| *name == "help" || xtask.contains(&format!("\n  {name} "))),
        name => CARGO.contains(&name) || aliases.contains(&format!("\n{name} = ")),
    };
    ensure!(is_known, "no such command");
    let packages = words.windows(2).filter(|pair| ["-p", "--package"].contains(&pair[0]));
    let mut unknown = packages.filter(|pair| !manifests.contains(&format!("\nname = \"{}\"\n", pair[1])));
    ensure!(unknown.next().is_none(), "a package is not in the workspace");
    Ok(())
}

fn check_script(path: &str) -> Result<()> {
    ensure!(path == "-c" || root().join(path).is_file(), "no such script");
    Ok(())
}

/// Adds the documents of a folder and of those in it. Records are of the tree of their dates.
fn add_documents(folder: &Path, to: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        let is_other = name.starts_with('.') || ["target", "records", "node_modules"].contains(&name.as_str());
        match entry.file_type()?.is_dir() {
            true if !is_other => add_documents(&path, to)?,
            false if name.ends_with(".md") && name != "CHANGELOG.md" => to.push(path),
            _ => {}
        }
    }
    Ok(())
}

#[test]
fn every_shown_command_is_known() -> Result<()> {
    let mut documents = Vec::new();
    add_documents(root(), &mut documents)?;
    for expected in ["README.md", "docs/families/lerobot.md", "capi/README.md", "quantizer/python/README.md"] {
        ensure!(documents.contains(&root().join(expected)), "{expected} was not found");
    }
    let (reference, aliases, xtask) =
        (read("docs/CLI.md")?, read(".cargo/config.toml")?, read("tools/xtask/src/main.rs")?);
    let members = read("Cargo.toml")?;
    let members = members.split('"').map(|member| root().join(member).join("Cargo.toml")).filter(|path| path.is_file());
    let manifests = members.map(fs::read_to_string).collect::<Result<String, _>>()?;
    let mut count = 0;
    for path in documents {
        let text = fs::read_to_string(&path)?;
        for words in commands(text.split(GENERATED).next().unwrap_or(&text)) {
            let checked = match words[0] {
                "actq" => check_actq(&words, &reference),
                "sh" => check_script(words[1]),
                _ => check_cargo(&words, &aliases, &xtask, &manifests),
            };
            checked.with_context(|| format!("{}: {}", path.display(), words.join(" ")))?;
            count += 1;
        }
    }
    ensure!(count > 50, "only {count} commands were found");
    Ok(())
}

/// Cargo packages the files in a crate's folder only.
#[test]
fn shipped_packages_hold_their_licences() -> Result<()> {
    let manifest = read("Cargo.toml")?;
    let members: Vec<&str> =
        manifest.split('"').filter(|part| root().join(part).join("Cargo.toml").is_file()).collect();
    let mut shipped = vec!["quantizer/python"];
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

/// The listings of a document in a language.
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
