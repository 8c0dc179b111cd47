//! The gallery: one page in which the example robots are driven by images of few bits.

use std::fs;
use std::path::Path;

use actq::budget::Budget;
use actq::data::{NpzWriter, Recordings};
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::{Effort, Method, Options};
use actq::pipeline;
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::ur3;
use actq_cli::commands::report;
use actq_cli::outputs::files;
use actq_cli::report::page::runs::{HeadData, Reference, ReferenceData};
use actq_cli::report::page::{CSS, UNPACK, encoded, filled, packed};
use actq_deploy::Deployment;
use actq_kernels::Width;
use actq_kernels::cost::Core;
use actq_testkit::{Dtype, safetensors};
use actq_ur3::policy_f32::PolicyF32;
use anyhow::{Context as _, Result};
use serde::Serialize;

use crate::{balancer, demo};

const HTML: &str = include_str!("../../../../../examples/gallery/gallery.html");
const SCRIPT: &str = include_str!("../../../../../examples/gallery/gallery.js");
/// Budgets in bits per weight below 8 bits.
const BITS: [f64; 4] = [3.0, 2.0, 1.0, 0.5];
/// Distillation steps of a quick gallery.
const QUICK_STEPS: usize = 150;

/// A robot's policy: in f32, and as images.
#[derive(Serialize)]
struct Shown {
    /// 0 the balancer, 1 the arm.
    robot: u32,
    /// Bytes of the policy in f32.
    f32_bytes: usize,
    /// Clock of the predicted times.
    clock_hz: f64,
    reference: ReferenceData,
    images: Vec<ShownImage>,
}

/// An image.
#[derive(Serialize)]
struct ShownImage {
    label: String,
    bytes: usize,
    milliseconds: f64,
    image: String,
}

/// Builds the gallery in a folder, with the robots of a compiled module.
pub(crate) fn build(folder: &Path, robots: &Path, quick: bool) -> Result<()> {
    let module = fs::read(robots).with_context(|| format!("{}: cannot read the file", robots.display()))?;
    let bundle = Deployment::load(actq_balancer::bundle())?.policy;
    let (_, recordings) = balancer::recordings(actq_balancer::bundle())?;
    let mut all = vec![shown(0, &bundle, &recordings, quick)?];
    if !quick {
        let policy = Policy::load(&ur3())?;
        let calib = Some(demo::record(&mut PolicyF32::load(&ur3())?)?);
        all.push(shown(1, &policy, &Recordings { calib, heldout: None }, quick)?);
    }
    let data = serde_json::to_string(&all)?.replace('<', "\\u003c");
    let parts = [
        ("CSS", CSS.to_owned()),
        ("DATA", data),
        ("MODULE", encoded(actq_wasm::MODULE)),
        ("ROBOTS", packed(&module)?),
        ("FACE", actq_wasm::FACE.to_owned()),
        ("UNPACK", UNPACK.to_owned()),
        ("SCRIPT", SCRIPT.to_owned()),
    ];
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot create the folder", folder.display()))?;
    let path = folder.join("index.html");
    files::write(&path, filled(HTML, &parts).as_bytes())?;
    println!("{}: open it in a browser", path.display());
    if quick { reports(folder, &bundle) } else { Ok(()) }
}

/// A name that a page must show as it is.
const MARKUP: &str = "</script><img src=x onerror=alert(1)>";

/// Writes four reports, for the tests in a browser: of the arm's policy at 2 bits, of one whose name is markup, of a
/// bundle, and of a recurrent policy.
fn reports(folder: &Path, bundle: &Policy) -> Result<()> {
    let policy = Policy::load(&ur3())?;
    let options = Options::new(Method::Rtn, Budget::Width(Width::W2));
    let write = |name: &str, policy: &Policy, source: Option<&Policy>| -> Result<()> {
        let quantized = pipeline::quantize(policy, &Recordings::default(), &options, ())?;
        let buffer = ImageBuffer::new(&quantized.whole_image()?);
        let page = report::of_image(&buffer, Path::new(name), source, &[])?;
        files::write(&folder.join(name), page.as_bytes())
    };
    write("report.html", &policy, Some(&policy))?;
    write("bundle.html", bundle, Some(bundle))?;
    let scratch = tempfile::tempdir()?;
    let recurrent = recurrent(scratch.path())?;
    write("recurrent.html", &recurrent, Some(&recurrent))?;
    write("markup.html", &Policy { name: MARKUP.to_owned(), ..policy.clone() }, None)
}

/// Writes a recurrent policy of random weights with a recording into a folder, and reads it.
fn recurrent(folder: &Path) -> Result<Policy> {
    const OBS: usize = 12;
    const HIDDEN: usize = 16;
    const ACT: usize = 3;
    const STEPS: usize = 100;
    let json = serde_json::json!({"name": "recurrent", "obs_dim": OBS, "act_dim": ACT, "control_hz": 50, "ops": [
        {"op": "lstm", "hidden": HIDDEN, "w_ih": "ih", "w_hh": "hh"}, {"op": "linear", "w": "out"}]});
    fs::write(folder.join("policy.json"), json.to_string())?;
    let mut random = Random::new(7);
    let mut tensor = |name: &'static str, rows: usize, cols: usize| {
        let values = (0..rows * cols).flat_map(|_| random.unit().to_le_bytes()).collect();
        (name, Dtype::F32, vec![rows, cols], values)
    };
    let (ih, hh) = (tensor("ih", 4 * HIDDEN, OBS), tensor("hh", 4 * HIDDEN, HIDDEN));
    fs::write(folder.join("policy.safetensors"), safetensors([ih, hh, tensor("out", ACT, HIDDEN)]))?;
    let mut npz = NpzWriter::new(fs::File::create(folder.join("heldout.npz"))?);
    npz.array("obs", &[2, STEPS, OBS], (0..2 * STEPS * OBS).map(|_| random.unit()))?;
    npz.finish()?;
    Ok(Policy::load(folder)?)
}

/// Makes the images of a policy.
fn shown(robot: u32, policy: &Policy, recordings: &Recordings, quick: bool) -> Result<Shown> {
    let distill = |bits| Options {
        effort: Effort::Quick,
        steps: quick.then_some(QUICK_STEPS),
        ..Options::new(Method::Distill, Budget::BitsPerWeight(bits))
    };
    let eight = Options::new(Method::Gptq, Budget::Width(Width::W8));
    let budgets = [(8.0, eight)].into_iter().chain(BITS.map(|bits| (bits, distill(bits))));
    let reference = Reference::of(policy)?;
    let mut data = None;
    let mut images = Vec::new();
    for (bits, options) in budgets.filter(|(bits, _)| !quick || *bits == 2.0) {
        println!("{}: {bits} bits", policy.name);
        let quantized = match pipeline::quantize(policy, recordings, &options, ()) {
            Ok(quantized) => quantized,
            Err(error) if error.budget().is_some() => {
                println!("{}: {bits} bits are too few: {error}", policy.name);
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        let buffer = ImageBuffer::new(&quantized.whole_image()?);
        let image = buffer.image(Path::new("the image"))?;
        let head = HeadData::new(image, buffer.bytes(), None, data.is_none().then_some(&reference))?;
        data = data.or(head.reference);
        let milliseconds = StepTime::new(&image, Core::M4f, CLOCK).milliseconds;
        images.push(ShownImage {
            label: format!("{bits} bit{}", if bits == 1.0 { "" } else { "s" }),
            bytes: image.bytes(),
            milliseconds,
            image: head.image,
        });
    }
    let reference = data.context("no image is possible")?;
    Ok(Shown { robot, f32_bytes: 4 * policy.parameters, clock_hz: CLOCK, reference, images })
}
