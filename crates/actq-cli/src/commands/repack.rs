//! `actq repack`

use actq::emit::repack;
use actq::runtime::ImageBuffer;
use anyhow::{Context as _, Result};

use crate::args::RepackArgs;
use crate::outputs::files::refuse_foreign;
use crate::terminal::{print, reserve};

/// Writes an image in the layouts of another core.
pub(crate) fn run(args: &RepackArgs) -> Result<()> {
    let outputs = reserve([&args.out], [&args.image])?;
    refuse_foreign(&args.out)?;
    let buffer = ImageBuffer::read(&args.image)?;
    buffer.image(&args.image)?;
    let packed = repack(buffer.bytes(), args.core).with_context(|| args.image.display().to_string())?;
    let same = if packed == buffer.bytes() { ", as before" } else { "" };
    let bytes = packed.len();
    outputs.write(&[packed])?;
    print(&format!("{}: {bytes} bytes{same}\n", args.out.display()))
}
