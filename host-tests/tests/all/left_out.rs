//! Builds of the kernels without a feature: `include_image!` of an image that needs it does not compile, and names it.
//! `kernels/tests/left_out.rs` has the refusal at run time, `kernels/src/image/features.rs` every feature's.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use actq::emit;
use actq::graph::ops::Pointwise;
use actq::methods::Activations;
use actq::runtime::ImageBuffer;
use actq_bench::networks::{Builder, Draw};
use actq_bench::root;
use actq_kernels::Width;
use actq_kernels::math::Function;
use actq_testkit::Random;
use anyhow::{Context as _, Result, ensure};
use tempfile::TempDir;

use crate::attention::Attention;
use crate::denoising;
use crate::deployed::Made;
use crate::draft::Draft;

/// Compiles a program that includes `policy.actq` of its folder, with these features of the kernels.
fn compile(folder: &Path, features: &BTreeSet<&str>) -> Result<Output> {
    let features: Vec<_> = features.iter().collect();
    let manifest = format!(
        "[package]\nname = \"includes\"\nedition = \"2024\"\n[workspace]\n[dependencies.actq-kernels]\npath = {:?}\n\
         default-features = false\nfeatures = {features:?}\n",
        root().join("kernels")
    );
    fs::write(folder.join("Cargo.toml"), manifest)?;
    let mut command = Command::new("cargo");
    command.args(["check", "--offline", "--quiet", "--manifest-path"]).arg(folder.join("Cargo.toml"));
    Ok(command.env("CARGO_TARGET_DIR", folder.join("target")).output()?)
}

#[test]
fn images_without_their_features_do_not_compile() -> Result<()> {
    let dir = TempDir::new()?;
    let folder = dir.path();
    fs::create_dir(folder.join("src"))?;
    fs::write(
        folder.join("src/lib.rs"),
        "pub static POLICY: &[u8] = actq_kernels::include_image!(\"../policy.actq\");\n",
    )?;
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock"))?;
    let (policy, outcomes) = Draw::new(1).network(37)?;
    let mut silu = Builder::new(8);
    let last = silu.linear((8, 8), Activations::Int8, |_| Some(Width::W2), 0, true)?;
    silu.node(Pointwise(Function::Silu), &[last])?;
    let mut images = vec![
        silu.image("silu")?,
        fs::read(root().join("kernels/tests/valid.actq"))?,
        emit::image(&policy, &outcomes)?,
        Made::deployment()?.1.four_bits()?,
        Draft(Attention::draw(&mut Random::new(1)).image()).bytes().to_vec(),
    ];
    images.extend(denoising::images()?.first().map(|image| image.bytes().to_vec()));
    let (mut tried, mut all) = (BTreeSet::new(), BTreeSet::new());
    for bytes in images {
        let buffer = ImageBuffer::new(&bytes);
        let needed: BTreeSet<&str> = buffer.image(Path::new("policy"))?.features().collect();
        fs::write(folder.join("policy.actq"), &bytes)?;
        let output = compile(folder, &needed)?;
        ensure!(output.status.success(), "{needed:?}: {}", String::from_utf8_lossy(&output.stderr));
        all.extend(needed.iter().map(|feature| feature.to_string()));
        // Each build takes two seconds: without one that no image before was compiled without.
        let feature = needed.iter().rev().find(|feature| !tried.contains(**feature)).context("all are tried")?;
        tried.insert(feature.to_string());
        let less = needed.iter().copied().filter(|other| other != feature).collect();
        let output = compile(folder, &less)?;
        let message = String::from_utf8_lossy(&output.stderr);
        let is_named = message.contains(&format!("the image needs the feature `{feature}` of actq-kernels"));
        ensure!(!output.status.success() && is_named, "without {feature}: {message}");
    }
    let known = "w2 w3 w4 w8 single paired groups elu silu functions norm recurrent flow chunks around attention";
    ensure!(all.iter().map(String::as_str).eq(known.split(' ').collect::<BTreeSet<_>>()), "the images need {all:?}");
    Ok(())
}
