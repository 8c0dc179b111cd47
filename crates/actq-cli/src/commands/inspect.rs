//! `actq inspect`

use actq::pipeline::stats::Stats;
use actq::runtime::ImageBuffer;
use anyhow::Result;

use crate::args::InspectArgs;
use crate::report::widths::Widths;
use crate::report::{inspect, time};
use crate::terminal::print;

/// Prints the content of an image.
pub(crate) fn run(args: &InspectArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    if !args.widths {
        return print(&match args.json {
            true => serde_json::to_string(&time::of_image(&image, args.core, args.clock)?)? + "\n",
            false => format!("{}\n{}", inspect::report(&image), time::report(&image, args.core, args.clock)?),
        });
    }
    let stats = args.stats.as_deref().map(|path| Stats::read(path, &image)).transpose()?;
    print(&Widths::new(&image, stats.as_ref())?.report())
}
