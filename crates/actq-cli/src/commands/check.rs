//! `actq check`

use actq::error::Error;
use actq::runtime::{ImageBuffer, with_head};
use actq::text::count;
use actq_deploy::{Array, Reference};
use actq_kernels::{Image, Port, PortKind};
use anyhow::{Context as _, Result, bail, ensure};

use crate::args::CheckArgs;
use crate::report::deployment::{Target, targets};
use crate::report::notes::{USELESS, useless};
use crate::terminal::{note, print};

/// Runs an image on the raw inputs of a reference, and compares its targets with the expected ones.
pub(crate) fn run(args: &CheckArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let shown = args.image.display();
    let ports: Vec<Port<'_>> = image.ports().collect();
    ensure!(
        !ports.is_empty(),
        "{shown}: it has no raw inputs; make an image of a bundle by `actq import BUNDLE` and `actq quantize`"
    );
    let (raw, expect) = &args.reference;
    let reference = Reference::read(raw, expect)?;
    let is_input = |port: &&Port<'_>| port.kind == PortKind::Input;
    let inputs: Vec<(String, usize)> =
        ports.iter().filter(is_input).map(|port| (port.name.to_owned(), port.len)).collect();
    let frames = reference.raw().frames(&inputs)?;
    let expected =
        reference.array("target").with_context(|| format!("{}: it has no array \"target\"", expect.display()))?;
    let (rows, len) = expected.rows()?;
    ensure!(
        rows == frames.len() && len == image.act_len(),
        "{}: \"target\" has {} of {}; the image gives {} of {}",
        expect.display(),
        count(rows, "tick"),
        count(len, "value"),
        frames.len(),
        image.act_len()
    );
    let expected = &held(expected, &image);
    let step = |head: &mut actq_kernels::Head<'_, '_>, frame: &Vec<Vec<f64>>| -> actq::error::Result<Vec<f32>> {
        let raw: Vec<f32> = frame.iter().flatten().map(|value| *value as f32).collect();
        Ok(head.step(&raw)?.to_vec())
    };
    let found: Vec<Vec<f32>> = with_head(image, |head| {
        let ticks = frames.iter().enumerate();
        ticks.map(|(tick, frame)| step(head, frame).map_err(|e| Error::input(format!("tick {tick}: {e}")))).collect()
    })?;
    let found: Vec<Target> = ports
        .iter()
        .filter(|port| !is_input(port))
        .scan(0, |from, port| {
            let place = *from..*from + port.len;
            *from = place.end;
            Some(Target::new(port.name, place, &found, expected))
        })
        .collect();
    print(&targets(&found, frames.len()))?;
    let worst = found.iter().map(|target| target.nmse).fold(0.0, f64::max);
    let limit = args.max_nmse.unwrap_or(USELESS);
    let warning = useless(worst);
    if found.iter().any(|target| target.nmse.is_nan() || target.nmse > limit) {
        let hint = ", or compare the description by actq import --reference: ";
        let warning = warning.map_or(String::new(), |warning| format!("{hint}{warning}"));
        bail!("{shown}: the targets' NMSE is {worst:.3e}, above {limit:e}; quantize at more bits{warning}");
    }
    note(warning);
    Ok(())
}

/// Returns expected targets within an image's limits, which hold those beyond.
fn held(expected: &Array, image: &Image<'_>) -> Array {
    let mut held = expected.clone();
    for (i, value) in held.values.iter_mut().enumerate() {
        if let Some([low, high]) = image.limits(i % image.act_len()) {
            *value = value.clamp(low.into(), high.into());
        }
    }
    let moved = held.values.iter().zip(&expected.values).filter(|(held, given)| held != given).count();
    note((moved > 0).then(|| {
        format!("{} of the reference are beyond the image's limits, which hold them there", count(moved, "target"))
    }));
    held
}
