//! `actq constants`

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_deploy::description::Description;
use anyhow::{Context as _, Result, bail, ensure};

use crate::args::ConstantsArgs;
use crate::outputs::files::refuse_unlike;
use crate::report::constants::{Language, source};
use crate::report::inspect::may_be_default;
use crate::terminal::{note, print, reserve};

/// Writes an image's constants as source code.
pub(crate) fn run(args: &ConstantsArgs) -> Result<()> {
    let shown = args.out.display();
    let language = match args.out.extension().and_then(OsStr::to_str) {
        Some("rs") => Language::Rust,
        Some("h") => Language::C,
        _ => bail!("{shown}: give a name that ends in .rs for Rust, or in .h for C and C++"),
    };
    let prefix = args.out.file_stem().and_then(OsStr::to_str).with_context(|| format!("{shown}: no name of a file"))?;
    ensure!(
        prefix.is_ascii() && prefix.starts_with(|c: char| c.is_ascii_alphabetic()),
        "{shown}: the names of the constants begin with that of the file: use ASCII, a letter first"
    );
    let outputs = reserve([&args.out], [&args.image].into_iter().chain(&args.gains))?;
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let description = args.gains.as_deref().map(described).transpose()?;
    let gains = description.as_ref().and_then(|description| {
        let gains = description.gains.as_ref()?;
        let joints = gains.joints.as_ref().and_then(|order| description.joints.get(order));
        Some((gains, joints.map_or(&[][..], Vec::as_slice)))
    });
    let source = source(language, &image, prefix, gains)?;
    refuse_unlike(&args.out, &source, args.force)?;
    outputs.write(&[source])?;
    if may_be_default(&image) {
        note([format!(
            "the rate is {} Hz, also the default of policies without a rate; check that it is the rate of your policy",
            image.rate_hz()
        )]);
    }
    print(&format!("{shown}: constants of {}\n", args.image.display()))
}

/// Reads a description that has gains.
fn described(path: &Path) -> Result<Description> {
    let name = path.display();
    let form = "pass the deploy.toml of the policy to --gains";
    let text = fs::read_to_string(path).with_context(|| format!("{name}: cannot read the gains; {form}"))?;
    let description = Description::parse(&text).with_context(|| format!("{name}: is not a description; {form}"))?;
    let gains = description.gains.as_ref();
    let gains = gains.with_context(|| format!("{name}: it has no table [gains]; add it, or remove --gains"))?;
    let mut all = gains.stiffness.iter().chain(&gains.damping);
    ensure!(all.all(|gain| (*gain as f32).is_finite()), "{name}: [gains]: a gain is outside f32; correct it");
    Ok(description)
}
