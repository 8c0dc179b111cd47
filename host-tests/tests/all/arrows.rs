//! Dependencies between source files in every crate of the workspace: no dependency cycles between files, and, in a
//! library, only the arrows between folders that `docs/ARCHITECTURE.md` has in its tables.

mod uses;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use actq_bench::root;
use anyhow::{Context, Result, bail, ensure};

use uses::{Parts, Uses};

/// A module's path from the crate's root; the root is empty.
type Module = Vec<String>;

/// The modules of a crate, and the paths in their files.
type Sources = BTreeMap<Module, Vec<Parts>>;

/// Reads the files below `folder` by module. The file `root` is the crate's root; the other roots beside it, and the
/// folder `bin`, are crates of their own.
fn read(folder: &Path, root: &str) -> Result<Sources> {
    let (mut sources, mut tests) = (Sources::new(), Vec::new());
    let mut folders = vec![(folder.to_owned(), Module::new())];
    while let Some((folder, module)) = folders.pop() {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let is_root = module.is_empty() && name == root;
            if module.is_empty() && !is_root && ["lib", "main", "bin"].contains(&&*name) {
                continue;
            }
            let at = if name == "mod" || is_root { module.clone() } else { child(&module, &name) };
            if path.is_dir() {
                folders.push((path, at));
            } else if path.extension().is_some_and(|e| e == "rs") {
                let uses = Uses::of(&fs::read_to_string(&path)?).with_context(|| path.display().to_string())?;
                tests.extend(uses.test_modules.iter().map(|name| child(&at, name)));
                sources.insert(at, uses.paths);
            }
        }
    }
    sources.retain(|module, _| !tests.iter().any(|test| module.starts_with(test)));
    Ok(sources)
}

fn child(module: &Module, name: &str) -> Module {
    module.iter().cloned().chain([name.to_owned()]).collect()
}

/// Returns the file of this crate that `path`, in the file of `module`, refers to.
fn target(sources: &Sources, module: &Module, path: &[String]) -> Option<Module> {
    let (first, rest) = path.split_first()?;
    let (mut at, rest) = match first.as_str() {
        "crate" => (Module::new(), rest),
        "super" | "self" => (module.clone(), path),
        name => {
            sources.contains_key(&child(module, name)).then_some(())?;
            (module.clone(), path)
        }
    };
    for part in rest {
        if part == "super" {
            at.pop();
        } else if part != "self" {
            at.push(part.clone());
        }
    }
    while !sources.contains_key(&at) {
        at.pop()?;
    }
    (at != *module).then_some(at)
}

/// Returns for every file the files that it uses.
fn arrows(sources: &Sources) -> BTreeMap<&Module, BTreeSet<Module>> {
    sources.iter().map(|(module, paths)| (module, targets(sources, module, paths))).collect()
}

fn targets(sources: &Sources, module: &Module, paths: &[Parts]) -> BTreeSet<Module> {
    paths.iter().filter_map(|path| target(sources, module, path)).collect()
}

/// Returns a cycle of files, if there is one.
fn cycle(arrows: &BTreeMap<&Module, BTreeSet<Module>>) -> Option<String> {
    let mut left: BTreeSet<&Module> = arrows.keys().copied().collect();
    // A file that uses none of the remaining files is in no cycle.
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

/// Returns the folder of a file; a file beside `lib.rs` is a folder of its own.
fn folder(module: &Module) -> String {
    module.first().cloned().unwrap_or("lib".to_owned())
}

/// Returns for every folder the folders that it uses.
fn folders(arrows: &BTreeMap<&Module, BTreeSet<Module>>) -> BTreeMap<String, BTreeSet<String>> {
    let mut folders: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (from, to) in arrows {
        let own = folder(from);
        let others: Vec<String> = to.iter().map(folder).filter(|to| *to != own).collect();
        folders.entry(own).or_default().extend(others);
    }
    folders
}

/// Parses the table below the heading `### title` in `text`: folder and allowed uses.
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

/// Checks a crate against the allowed uses of its folders.
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
            wrong.push(format!("{from} -> {to} is in the table, but nothing needs it"));
        }
    }
    for from in found.keys().filter(|from| !allowed.contains_key(*from)) {
        wrong.push(format!("{from} has no row in the table"));
    }
    wrong.extend(cycle(&arrows).map(|cycle| format!("dependency cycle: {cycle}")));
    ensure!(wrong.is_empty(), "{}\n\nThe table should be:\n{}", wrong.join("\n"), rows(&found));
    Ok(())
}

/// Returns the folders of the workspace's crates, with the name of the root file: of each package its library or
/// program, and its programs of several files.
fn crates() -> Result<Vec<(String, &'static str)>> {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).context("Cargo.toml")?;
    let members = manifest.split_once("members = [").and_then(|(_, rest)| Some(rest.split_once(']')?.0));
    let members =
        members.context("Cargo.toml has no workspace members")?.split(',').map(|name| name.trim().trim_matches('"'));
    let mut crates = Vec::new();
    for member in members.filter(|member| !member.is_empty()) {
        let source = format!("{member}/src");
        let root_file =
            ["lib", "main"].into_iter().find(|name| root().join(&source).join(name).with_extension("rs").is_file());
        crates.push((source.clone(), root_file.with_context(|| format!("{source} has no root file"))?));
        if let Ok(programs) = fs::read_dir(root().join(&source).join("bin")) {
            for program in programs {
                let program = program?;
                if program.path().is_dir() {
                    crates.push((format!("{source}/bin/{}", program.file_name().to_string_lossy()), "main"));
                }
            }
        }
    }
    Ok(crates)
}

/// Returns an error if files of a crate use each other.
fn no_cycle(sources: &Sources) -> Result<()> {
    match cycle(&arrows(sources)) {
        Some(cycle) => bail!("dependency cycle: {cycle}"),
        None => Ok(()),
    }
}

#[test]
fn crates_follow_the_tables_and_have_no_cycles() -> Result<()> {
    let text = fs::read_to_string(root().join("docs/ARCHITECTURE.md")).context("docs/ARCHITECTURE.md")?;
    let titles: BTreeSet<&str> =
        text.lines().filter_map(|line| line.strip_prefix("### `")?.strip_suffix('`')).collect();
    let (mut wrong, mut tables) = (Vec::new(), BTreeSet::new());
    let crates = crates()?;
    for (folder, root_file) in &crates {
        let sources = read(&root().join(folder), root_file)?;
        let allowed = table(&text, folder);
        // Two files leave no choice, and a program is its own only user.
        let is_small = sources.len() <= 2 || folders(&arrows(&sources)).values().all(BTreeSet::is_empty);
        let outcome = match &allowed {
            Some(allowed) => check(&sources, allowed),
            None if is_small || *root_file == "main" => no_cycle(&sources),
            None => check(&sources, &BTreeMap::new()).context("docs/ARCHITECTURE.md has no table of it"),
        };
        tables.extend(allowed.map(|_| folder.as_str()));
        wrong.extend(outcome.err().map(|error| format!("{folder}: {error:#}")));
    }
    wrong.extend(titles.difference(&tables).map(|title| format!("{title}: the table has no crate")));
    ensure!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    Ok(())
}

fn sources(files: &[(&str, &str)]) -> Sources {
    let module = |name: &str| name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    files.iter().map(|(name, text)| (module(name), Uses::of(text).expect("tokens").paths)).collect()
}

#[test]
fn paths_are_found_everywhere_in_a_file() {
    let files = sources(&[
        ("", "pub mod a; pub mod b; pub const X: u8 = 1;"),
        ("a", "mod c;\nmod d;\npub use c::{self, Name as Other};\nfn f() { d::g(); }\n"),
        ("a::c", "use crate::{b, X};\nuse super::d::{g, h};\n"),
        (
            "a::d",
            "fn g() -> crate::b::e::T { \"use crate::a::c;\" }\n// use crate::a::c;\n#[cfg(test)]\nmod tests {\n    const A: [u8; 1] = [\n    ];\n    use super::super::c;\n}\n#[cfg(test)]\nuse crate::a::c::{d, e};\n",
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
    assert_eq!(uses("a::d"), "b::e", "comments, strings and tests do not count");
    assert_eq!(uses("b"), "", "other crates' modules of the same name do not count");
    assert_eq!(uses("b::e"), "b");
}

#[test]
fn forbidden_arrows_cycles_and_stale_rows_are_found() {
    let checked = |files: &[(&str, &str)], table: &[(&str, &[&str])]| {
        let uses = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        let allowed = table.iter().map(|(folder, names)| ((*folder).to_owned(), uses(names))).collect();
        check(&sources(files), &allowed).map_err(|error| error.to_string())
    };
    let good = [("", "pub mod a;"), ("a", ""), ("a::x", "use crate::b::y;"), ("b::y", "use super::z;"), ("b::z", "")];
    let table: [(&str, &[&str]); 3] = [("lib", &[]), ("a", &["b"]), ("b", &[])];
    assert_eq!(checked(&good, &table), Ok(()));
    let mut back = good;
    back[4].1 = "use crate::a;";
    let error = checked(&back, &table).expect_err("b uses a");
    assert!(error.contains("b -> a is not in the table (b::z)"), "{error}");
    let mut round = good;
    round[4].1 = "fn f() { super::y::g() }";
    let error = checked(&round, &table).expect_err("z and y use each other");
    assert!(error.contains("dependency cycle: b::y -> b::z -> b::y"), "{error}");
    let error = checked(&good, &[("lib", &["a"]), ("a", &["b"]), ("b", &[])]).expect_err("lib uses nothing");
    assert!(error.contains("lib -> a is in the table, but nothing needs it"), "{error}");
    let error = checked(&good, &table[..2]).expect_err("b has no row");
    assert!(error.contains("b has no row"), "{error}");
}
