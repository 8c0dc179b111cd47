//! Random descriptions as images: a description's own execution in f64, its image in f32, and its image at 8 bits, whole,
//! in polls and restored.

mod draw;
mod network;

use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::task::Poll;

use actq::budget::Budget;
use actq::data::{NpzWriter, Recordings};
use actq::methods::{Activations, Method, Options};
use actq::pipeline::quantize;
use actq::random::Random;
use actq::runtime::{ImageBuffer, with_head};
use actq_deploy::description::Description;
use actq_deploy::{Bundle, DESCRIPTION, Deployment, Plan, ROUNDING, Runner};
use actq_kernels::Width;
use anyhow::{Context as _, Result, bail, ensure};
use draw::Draw;

use crate::bits;

/// Ticks of a run.
const TICKS: usize = 40;
/// Errors of values, and of outputs of a network at 8 bits.
const EIGHT_BITS: [f64; 2] = [ROUNDING[0], 0.05];
/// Reasons for which a description has no image; each error names the value.
pub const REFUSALS: [&str; 4] = [
    "cannot divide by a value",
    "lies between two networks",
    "do not repeat within",
    "the targets depend on no network with weights",
];

/// A description whose executions agree.
#[derive(Debug)]
pub enum Compared {
    /// Its image at 8 bits, and raw values of some ticks.
    Same(Vec<u8>, Vec<Vec<f32>>),
    /// It has no image, for one of [`REFUSALS`].
    Refused(&'static str),
}

/// Draws the description of a seed and compares its executions.
///
/// # Errors
///
/// If two of them differ, or the description is refused for another reason; the folder of the description is kept.
pub fn compare(seed: u64) -> Result<Compared> {
    let folder = tempfile::tempdir()?;
    let drawn = Draw::description(seed);
    let text = drawn.description.to_toml(&[].into())?;
    fs::write(folder.path().join(DESCRIPTION), &text)?;
    for (name, content) in &drawn.files {
        fs::write(folder.path().join(name), content)?;
    }
    compared(folder.path(), &drawn.description, seed).with_context(|| {
        let kept = folder.keep();
        format!("seed {seed}, {}", kept.display())
    })
}

fn compared(folder: &Path, drawn: &Description, seed: u64) -> Result<Compared> {
    let bundle = Bundle::open(folder)?;
    let description = Description::parse(&bundle.text(DESCRIPTION)?)?;
    ensure!(description == *drawn, "the text is of another description");
    let plan = Plan::new(&description, &bundle)?;
    let deployment = match Deployment::load(folder) {
        Ok(deployment) => deployment,
        Err(error) => {
            let error = format!("{error:#}");
            let reason = REFUSALS.into_iter().find(|reason| error.contains(reason));
            return Ok(Compared::Refused(reason.with_context(|| format!("refused: {error}"))?));
        }
    };
    let raw = deployment.draws(&plan, &mut Random::new(seed), TICKS);
    let mut runner = Runner::new(plan);
    let in_f32 = deployment.in_f32(&raw)?;
    if let Some(difference) = runner.difference(&raw, &in_f32, ROUNDING) {
        bail!("in f32: {difference}");
    }
    let activations = Activations::Int16;
    let options = Options { activations, ..Options::new(Method::Rtn, Budget::Width(Width::W8)) };
    let image = quantize(&deployment.policy, &Recordings::default(), &options, ())?.whole_image()?;
    let singles: Vec<Vec<f32>> = raw.iter().map(|raw| raw.iter().flatten().map(|x| *x as f32).collect()).collect();
    let found = on_host(&image, &singles)?;
    if let Some(difference) = runner.difference(&raw, &found, EIGHT_BITS) {
        bail!("at 8 bits: {difference}");
    }
    Ok(Compared::Same(image, singles))
}

/// Returns the actions of an image; in polls, and from a saved state, they have the same bits.
fn on_host(bytes: &[u8], raw: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
    let buffer = ImageBuffer::new(bytes);
    with_head(buffer.image(Path::new("drawn"))?, |head| {
        let whole = raw.iter().map(|raw| Ok(head.step(raw)?.to_vec())).collect::<Result<Vec<_>>>()?;
        head.reset();
        let (least, mut saved) = (head.least_budget(), vec![0; head.saved_len()]);
        for (tick, (raw, expected)) in raw.iter().zip(&whole).enumerate() {
            if tick == TICKS / 2 {
                head.save(&mut saved)?;
                head.reset();
                head.step(raw)?;
                head.restore(&saved)?;
            }
            head.begin(raw)?;
            let action = loop {
                if let Poll::Ready(action) = head.poll(least)? {
                    break bits(action);
                }
            };
            ensure!(action == bits(expected), "tick {tick}: other bits in polls");
        }
        Ok(whole)
    })
}

/// Returns an .npz file of one array.
fn npz(name: &str, shape: &[usize], values: &[f32]) -> Result<Vec<u8>> {
    let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
    npz.array(name, shape, values.iter().copied())?;
    Ok(npz.finish()?.into_inner())
}
