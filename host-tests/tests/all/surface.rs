//! The items that the kernels export to firmware, counted on rustdoc's pages.

use std::fs;
use std::process::Command;

use actq_bench::{root, target_dir};
use anyhow::{Context, Result, ensure};

/// Most exported items, with their methods and associated constants, without the feature `writer`. (Variants and fields
/// do not count.)
const MOST: usize = 90;

/// Returns the pages of all items. Items of private modules have none.
fn pages(all: &str) -> Vec<&str> {
    let links = all.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next());
    let mut pages: Vec<&str> = links.filter(|link| link.ends_with(".html") && !link.starts_with("..")).collect();
    pages.sort_unstable();
    pages.dedup();
    pages
}

/// Counts the methods and associated constants on an item's page, without those of traits that it implements.
fn methods(page: &str) -> usize {
    let sections = page.split("<section id=\"").skip(1).filter_map(|rest| rest.split('>').next());
    let kinds = ["method.", "tymethod.", "associatedconstant."];
    sections.filter(|tag| kinds.iter().any(|kind| tag.starts_with(kind)) && !tag.contains("trait-impl")).count()
}

#[test]
fn firmware_sees_few_items_and_all_are_documented() -> Result<()> {
    let folder = target_dir().join("surface");
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(root())
        .args(["rustdoc", "--quiet", "--package", "actq-kernels", "--target-dir"])
        .arg(&folder)
        .args(["--", "-D", "missing_docs"])
        .output()
        .context("cannot start cargo")?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let folder = folder.join("doc/actq_kernels");
    let read = |page: &str| fs::read_to_string(folder.join(page)).with_context(|| page.to_owned());
    let all = read("all.html")?;
    let pages = pages(&all);
    let mut count = pages.len();
    for page in &pages {
        count += methods(&read(page)?);
    }
    ensure!(pages.contains(&"struct.Head.html") && count > 2 * pages.len(), "rustdoc's pages have another form");
    println!("{count} items, methods and constants");
    ensure!(count <= MOST, "firmware sees {count} items, but at most {MOST} are allowed; hide what it does not need");
    Ok(())
}

#[test]
fn items_and_methods_are_counted() {
    let all =
        "<a href=\"../x/index.html\"></a><a href=\"struct.A.html\"></a><a href=\"x/fn.b.html\"></a><a href=\"#x\">";
    assert_eq!(pages(all), ["struct.A.html", "x/fn.b.html"]);
    let section = |id: &str, class: &str| format!("<section id=\"{id}\" class=\"{class}\"></section>");
    let page = [
        section("method.new", "method"),
        section("associatedconstant.ALL", "associatedconstant"),
        section("method.fmt", "method trait-impl"),
        section("variant.One", "variant"),
    ];
    assert_eq!(methods(&page.concat()), 2);
}
