//! The items that the kernels export to firmware, without the feature `writer`.

use std::fs;
use std::process::Command;

use actq_bench::{root, target_dir};
use anyhow::{Context, Result, ensure};

/// Rustdoc's pages of the items. (Those of private modules have none.)
const ITEMS: &[&str] = &[
    "constant.BACKEND",
    "enum.Backend",
    "enum.Error",
    "enum.HeadError",
    "enum.ImageError",
    "enum.Kind",
    "enum.PortKind",
    "enum.PrefixError",
    "enum.SavedError",
    "enum.StepError",
    "macro.include_image",
    "struct.Cache",
    "struct.Cost",
    "struct.Head",
    "struct.Image",
    "struct.ImageInfo",
    "struct.Port",
];

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
    let all = fs::read_to_string(folder.join("doc/actq_kernels/all.html"))?;
    let links = all.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()?.strip_suffix(".html"));
    let mut items: Vec<&str> = links.filter(|link| !link.starts_with("..")).collect();
    items.sort_unstable();
    items.dedup();
    items.retain(|item| !["all", "index"].contains(item));
    assert_eq!(items, ITEMS, "a public item is a promise: add it here on purpose");
    Ok(())
}
