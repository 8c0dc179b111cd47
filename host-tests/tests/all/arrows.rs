//! Which source file uses which, against the tables in `docs/ARCHITECTURE.md`: between folders only the arrows that
//! stand there, and no circles between files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use actq_bench::root;
use anyhow::{Context, Result, ensure};

/// A module's path from the crate's root; the root is empty.
type Module = Vec<String>;

/// The modules of a crate with the text of their files.
type Sources = BTreeMap<Module, String>;

/// The files below `folder`, by module. Binaries are crates of their own.
fn read(folder: &Path) -> Result<Sources> {
    let mut sources = Sources::new();
    let mut folders = vec![(folder.to_owned(), Module::new())];
    while let Some((folder, module)) = folders.pop() {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let child = || module.iter().cloned().chain([name.clone()]).collect::<Module>();
            if path.is_dir() {
                if !(module.is_empty() && name == "bin") {
                    folders.push((path, child()));
                }
            } else if path.extension().is_some_and(|e| e == "rs") {
                let at = if name == "mod" || (module.is_empty() && name == "lib") { module.clone() } else { child() };
                sources.insert(at, fs::read_to_string(&path)?);
            }
        }
    }
    let tests: Vec<Module> = sources.iter().flat_map(|(module, text)| test_modules(module, text)).collect();
    sources.retain(|module, _| !tests.iter().any(|test| module.starts_with(test)));
    Ok(sources)
}

/// The modules that a file declares for tests alone.
fn test_modules(module: &Module, text: &str) -> Vec<Module> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let pairs = lines.windows(2).filter(|pair| pair[0].starts_with("#[cfg(") && pair[0].contains("test"));
    let name = |pair: &[&str]| Some(pair[1].strip_suffix(';')?.split_once("mod ")?.1.to_owned());
    pairs.filter_map(name).map(|name| module.iter().cloned().chain([name]).collect()).collect()
}

/// The code that is no test: without comments, and without the items behind `#[cfg(test)]`.
fn code(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let trimmed = line.trim();
        if trimmed.starts_with("#[cfg(") && trimmed.contains("test") && !trimmed.contains("not(test") {
            let indent = line.len() - line.trim_start().len();
            // A block ends with the brace that stands as far in as the attribute, anything else with a semicolon.
            let closes = |line: &&str| line.trim_start().starts_with('}') && line.find('}') == Some(indent);
            let first = lines.next().unwrap_or_default();
            if first.ends_with('{') {
                lines.by_ref().find(closes);
            } else if !first.ends_with([';', '}', ',']) {
                lines.by_ref().find(|line| line.ends_with(';') || closes(line));
            }
        } else {
            code += line.split_once("//").map_or(line, |(before, _)| before);
            code.push('\n');
        }
    }
    code
}

/// The paths that a `use` names: `a::{b, c::d}` gives `a::b` and `a::c::d`.
fn expand(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((front, rest)) = tree.split_once('{') else {
        return vec![tree.split(" as ").next().unwrap_or_default().trim().to_owned()];
    };
    let (inner, mut depth) = (rest.strip_suffix('}').unwrap_or(rest), 0);
    let parts = inner.split(|c| {
        depth += match c {
            '{' => 1,
            '}' => -1,
            _ => 0,
        };
        c == ',' && depth == 0
    });
    let parts = parts.filter(|part| !part.trim().is_empty());
    parts.flat_map(expand).map(|path| format!("{}{path}", front.trim())).collect()
}

/// Every path in the code that may lead to another file: those that a `use` names, and those that begin with `crate`,
/// `super` or a module of the file.
fn paths(code: &str) -> Vec<String> {
    let mut paths = Vec::new();
    let mut plain = String::new();
    // Statements end with a semicolon; braces of a `use` stay within it.
    for statement in code.split_inclusive(';') {
        let begin = statement.rfind("use ").filter(|&at| {
            let before = statement[..at].trim_end();
            let words = ["pub", ")", "}", "]", "{"];
            before.is_empty() || words.iter().any(|word| before.ends_with(word))
        });
        match begin {
            Some(at) => {
                plain += &statement[..at];
                paths.extend(expand(statement[at + 4..].trim_end_matches(';')));
            }
            None => plain += statement,
        }
    }
    let modules: Vec<&str> = code.lines().filter_map(declared).collect();
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for word in plain.split(|c| !is_word(c)) {
        let first = word.split("::").next().unwrap_or_default();
        if word.contains("::") && (["crate", "super", "self"].contains(&first) || modules.contains(&first)) {
            paths.push(word.to_owned());
        }
    }
    paths
}

/// The module that a line declares.
fn declared(line: &str) -> Option<&str> {
    let line = line.trim().strip_suffix(';')?;
    let (visibility, name) = line.split_once("mod ")?;
    (visibility.is_empty() || visibility.starts_with("pub")).then_some(name)
}

/// The file that `path`, in the file of `module`, leads to, where it is one of the crate.
fn target(sources: &Sources, module: &Module, path: &str) -> Option<Module> {
    let mut parts = path.split("::").filter(|part| !part.is_empty()).peekable();
    let mut at = match *parts.peek()? {
        "crate" => {
            parts.next();
            Module::new()
        }
        "super" | "self" => module.clone(),
        child => {
            let own: Module = module.iter().cloned().chain([child.to_owned()]).collect();
            sources.contains_key(&own).then_some(())?;
            module.clone()
        }
    };
    for part in parts {
        if part == "super" {
            at.pop();
        } else if part != "self" {
            at.push(part.to_owned());
        }
    }
    while !sources.contains_key(&at) {
        at.pop()?;
    }
    (at != *module).then_some(at)
}

/// From every file the files that it uses.
fn arrows(sources: &Sources) -> BTreeMap<&Module, BTreeSet<Module>> {
    let of = |(module, text): (&Module, &String)| -> BTreeSet<Module> {
        paths(&code(text)).iter().filter_map(|path| target(sources, module, path)).collect()
    };
    sources.iter().map(|(module, text)| (module, of((module, text)))).collect()
}

/// A circle of files, where there is one.
fn circle(arrows: &BTreeMap<&Module, BTreeSet<Module>>) -> Option<String> {
    let mut left: BTreeSet<&Module> = arrows.keys().copied().collect();
    // Files that use none of those that are left are in no circle.
    while let Some(leaf) = left.iter().copied().find(|module| !arrows[module].iter().any(|to| left.contains(to))) {
        left.remove(leaf);
    }
    let mut way: Vec<&Module> = vec![left.first().copied()?];
    loop {
        let next = arrows[way[way.len() - 1]].iter().find(|to| left.contains(to))?;
        if let Some(from) = way.iter().position(|module| *module == next) {
            let names: Vec<String> = way[from..].iter().chain([&next]).map(|module| name(module)).collect();
            return Some(names.join(" -> "));
        }
        way.push(next);
    }
}

fn name(module: &Module) -> String {
    if module.is_empty() { "lib".to_owned() } else { module.join("::") }
}

/// The folder that a file stands in; a file beside `lib.rs` is a folder of its own.
fn folder(module: &Module) -> String {
    module.first().cloned().unwrap_or("lib".to_owned())
}

/// From every folder the folders that it uses.
fn folders(arrows: &BTreeMap<&Module, BTreeSet<Module>>) -> BTreeMap<String, BTreeSet<String>> {
    let mut folders: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (from, to) in arrows {
        let own = folder(from);
        let others: Vec<String> = to.iter().map(folder).filter(|to| *to != own).collect();
        folders.entry(own).or_default().extend(others);
    }
    folders
}

/// The table below the heading `### title` in `text`: folder and what it may use.
fn table(text: &str, title: &str) -> Option<BTreeMap<String, BTreeSet<String>>> {
    let (_, section) = text.split_once(&format!("\n### `{title}`\n"))?;
    let rows = section.lines().take_while(|line| !line.starts_with('#')).filter(|line| line.starts_with("| `"));
    let row = |line: &str| -> Option<(String, BTreeSet<String>)> {
        let mut cells = line.trim_matches('|').split('|');
        let folder = cells.next()?.trim().trim_matches('`').to_owned();
        let uses = cells.next()?.split(',').map(|name| name.trim().trim_matches('`').to_owned());
        Some((folder, uses.filter(|name| !name.is_empty() && name != "-").collect()))
    };
    rows.map(row).collect()
}

fn rows(folders: &BTreeMap<String, BTreeSet<String>>) -> String {
    let list = |uses: &BTreeSet<String>| uses.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    folders.iter().map(|(folder, uses)| format!("| `{folder}` | {} |\n", list(uses))).collect()
}

/// What is wrong with a crate whose folders may use what `allowed` says.
fn check(sources: &Sources, allowed: &BTreeMap<String, BTreeSet<String>>) -> Result<()> {
    let arrows = arrows(sources);
    let found = folders(&arrows);
    let mut wrong = Vec::new();
    let missing = BTreeSet::new();
    for (from, uses) in &found {
        for to in uses.difference(allowed.get(from).unwrap_or(&missing)) {
            let files: Vec<String> = arrows
                .iter()
                .filter(|(file, others)| folder(file) == *from && others.iter().any(|other| folder(other) == *to))
                .map(|(file, _)| name(file))
                .collect();
            wrong.push(format!("{from} -> {to} is not in the table ({})", files.join(", ")));
        }
    }
    for (from, uses) in allowed {
        for to in uses.difference(found.get(from).unwrap_or(&missing)) {
            wrong.push(format!("{from} -> {to} stands in the table, and nothing needs it"));
        }
    }
    for from in found.keys().filter(|from| !allowed.contains_key(*from)) {
        wrong.push(format!("{from} has no row"));
    }
    wrong.extend(circle(&arrows).map(|circle| format!("a circle of files: {circle}")));
    ensure!(wrong.is_empty(), "{}\n\nAs it is:\n{}", wrong.join("\n"), rows(&found));
    Ok(())
}

#[test]
fn crates_have_the_arrows_of_the_architecture_and_no_circles() -> Result<()> {
    let text = fs::read_to_string(root().join("docs/ARCHITECTURE.md")).context("docs/ARCHITECTURE.md")?;
    let mut tried = 0;
    for title in text.lines().filter_map(|line| line.strip_prefix("### `")?.strip_suffix('`')) {
        let allowed = table(&text, title).with_context(|| format!("{title} has no table"))?;
        check(&read(&root().join(title))?, &allowed).with_context(|| title.to_owned())?;
        tried += 1;
    }
    ensure!(tried > 0, "no crate has a table");
    Ok(())
}

fn sources(files: &[(&str, &str)]) -> Sources {
    let module = |name: &str| name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    files.iter().map(|(name, text)| (module(name), (*text).to_owned())).collect()
}

#[test]
fn paths_are_found_wherever_they_stand() {
    let files = sources(&[
        ("", "pub mod a; pub mod b; pub const X: u8 = 1;"),
        ("a", "mod c;\nmod d;\npub use c::{self, Name as Other};\nfn f() { d::g(); }\n"),
        ("a::c", "use crate::{b, X};\nuse super::d::{g, h};\n"),
        (
            "a::d",
            "fn g() -> crate::b::e::T { 0 }\n// use crate::a::c;\n#[cfg(test)]\nmod tests {\n    const A: [u8; 1] = [\n    ];\n    use super::super::c;\n}\n",
        ),
        ("b", "use std::fmt;\nuse anyhow::{a, b};\n"),
        ("b::e", "pub(crate) use super::super::b::{\n    One,\n    self::two::{Three},\n};\n"),
    ]);
    let arrows = arrows(&files);
    let uses = |of: &str| {
        let module: Module = of.split("::").map(str::to_owned).collect();
        arrows[&module].iter().map(name).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(uses("a"), "a::c a::d");
    assert_eq!(uses("a::c"), "lib a::d b");
    assert_eq!(uses("a::d"), "b::e", "neither comments nor tests count");
    assert_eq!(uses("b"), "", "other crates' modules of the same name do not count");
    assert_eq!(uses("b::e"), "b");
}

#[test]
fn forbidden_arrows_circles_and_stale_rows_are_told() {
    let said = |files: &[(&str, &str)], table: &[(&str, &[&str])]| {
        let uses = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        let allowed = table.iter().map(|(folder, names)| ((*folder).to_owned(), uses(names))).collect();
        check(&sources(files), &allowed).map_err(|error| error.to_string())
    };
    let good = [("", "pub mod a;"), ("a", ""), ("a::x", "use crate::b::y;"), ("b::y", "use super::z;"), ("b::z", "")];
    let table: [(&str, &[&str]); 3] = [("lib", &[]), ("a", &["b"]), ("b", &[])];
    assert_eq!(said(&good, &table), Ok(()));
    let mut back = good;
    back[4].1 = "use crate::a;";
    let error = said(&back, &table).expect_err("b uses a");
    assert!(error.contains("b -> a is not in the table (b::z)"), "{error}");
    let mut round = good;
    round[4].1 = "fn f() { super::y::g() }";
    let error = said(&round, &table).expect_err("z and y use each other");
    assert!(error.contains("a circle of files: b::y -> b::z -> b::y"), "{error}");
    let error = said(&good, &[("lib", &["a"]), ("a", &["b"]), ("b", &[])]).expect_err("lib uses nothing");
    assert!(error.contains("lib -> a stands in the table, and nothing needs it"), "{error}");
    let error = said(&good, &table[..2]).expect_err("b has no row");
    assert!(error.contains("b has no row"), "{error}");
}
