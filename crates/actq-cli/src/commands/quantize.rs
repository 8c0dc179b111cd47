//! `actq quantize`

use std::path::PathBuf;
use std::time::Instant;

use actq::budget::Budget;
use actq::data::{Recording, Recordings, Share, Sizes, driven_by, files_of};
use actq::emit::repack;
use actq::graph::Graph;
use actq::measure::size::{Beside, file_bits_per_weight};
use actq::measure::time::CLOCK;
use actq::measure::{check, own, recorded};
use actq::methods::{Activations, Method, Options};
use actq::pipeline::stats::Stats;
use actq::pipeline::{HeldOut, QuantizedPolicy, Quantizer, check_budget, minutes_of_image};
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_kernels::Width;
use anyhow::{Context as _, Result, bail};

use crate::args::{ActivationArg, QuantizeArgs};
use crate::importers::{self, learned as learned_from, load, policy_files};
use crate::outputs::files::refuse_foreign;
use crate::report::learned::learned;
use crate::report::{notes, quantized, time};
use crate::terminal::{Progress, note, print, reserve};
use crate::threads::start_threads;

/// Quantizes a policy, writes the image and prints a report. Without a method, a calibration recording decides it.
/// `describe` returns the report's part on a method of the caller's own, empty for others.
pub fn run(
    args: &QuantizeArgs,
    method: Option<Method>,
    describe: impl FnOnce(&Quantizer<'_>, &QuantizedPolicy) -> String,
) -> Result<()> {
    let calib = files_of(&args.calib)?;
    let inputs = policy_files(&args.policy_dir).into_iter().chain(calib.iter().chain(&args.heldout).cloned());
    let outputs = reserve([&args.out].into_iter().chain(&args.save_stats), inputs)?;
    refuse_foreign(&args.out)?;
    let progress = Progress::new(args.run.quiet, "reading")?;
    let source = load(&args.policy_dir)?;
    print(&source.ports)?;
    let has_calib = !calib.is_empty() || Recording::Calib.find(&args.policy_dir)?.is_some();
    if args.policy_dir.is_file() && !has_calib && method != Some(Method::Rtn) {
        bail!("{}: {}", args.policy_dir.display(), notes::how_to_record(&source));
    }
    let mut options =
        options(args, &source.graph, method.unwrap_or(if has_calib { Method::Distill } else { Method::Rtn }));
    options.check()?;
    options.check_length()?;
    check_budget(&source, &options)?;
    let (calib, shares) = learned_from(&source, &calib)?.map(|l| (l.dataset, l.shares)).unzip();
    let shares = shares.unwrap_or_default();
    let heldout = match &args.heldout {
        Some(file) => Some(importers::recorded(&source, file)?),
        None => Recording::Heldout.load(Some(&args.policy_dir), None, Sizes::of(&source))?,
    };
    let mut recordings = Recordings { calib, heldout };
    note(notes::of_recordings(&recordings));
    note(recorded::use_policy(&mut recordings, &source.graph).iter().map(ToString::to_string));
    options.minutes = minutes_of_image(&source, &recordings, &options);
    note(notes::of_policy(&source).into_iter().chain(notes::one_width(&options)));
    let started = Instant::now();
    start_threads(args.run.threads)?;
    progress.begin("calibrating");
    let quantizer = Quantizer::new(&source, &recordings, options.method.clone(), options.minutes, |share| {
        progress.set("calibrating", share);
    })?;
    note(notes::mixed_units(quantizer.method().mixed_units()));
    progress.begin("choosing codes");
    let mut found = quantizer.quantize(&options, |work: &str, share: f64| progress.set(work, share))?;
    // The error is that of the network, on its own inputs.
    let network = found.buffer();
    found.image = found.whole_image()?;
    let packed = args.core.map(|core| repack(&found.image, core)).transpose();
    if let Ok(Some(packed)) = &packed {
        let limit = if let Budget::ImageBytes(bytes) = options.budget { bytes } else { usize::MAX };
        let (now, before) = (packed.len(), found.image.len());
        if now > limit {
            note([format!("the layouts of this core take {now} bytes, above the budget: {before} without --core")]);
        }
        found.image.clone_from(packed);
    }
    let mut contents = vec![found.image.clone()];
    if args.save_stats.is_some() {
        contents.push(Stats::new(&quantizer, &options, &found)?.json()?.into_bytes());
    }
    outputs.write(&contents)?;
    // Hours of learning are not lost.
    packed.with_context(|| format!("--core: {} has the default layouts", args.out.display()))?;
    progress.begin("measuring the error");
    print(&learned(&shares))?;
    print(&describe(&quantizer, &found))?;
    report(args, &source, &quantizer, &found, started)?;
    note(notes::unused_budget(&found, &options));
    let measuring = |share: f64| progress.set("measuring the error on held-out parts", share);
    let held_out = match found.held_out.take() {
        Some(held_out) => Ok(Some(held_out)),
        None => quantizer.held_out_error(&found, &options, measuring),
    };
    // The image is written and correct.
    let held_out = held_out.unwrap_or_else(|error| {
        note([format!("the error on held-out parts was not measured: {error:#}")]);
        None
    });
    measure(args, &source, &recordings, &options, &network, held_out)?;
    own_path(args, &source, &network, shares)
}

/// Prints the widths, the learning, the size and the time of an image.
fn report(
    args: &QuantizeArgs,
    source: &Policy,
    quantizer: &Quantizer<'_>,
    found: &QuantizedPolicy,
    started: Instant,
) -> Result<()> {
    let buffer = found.buffer();
    let image = buffer.image(&args.out)?;
    let search = found.search.as_ref().map_or(String::new(), |search| quantized::search(search) + "\n");
    let sampled = quantizer.method().sampled().map_or(String::new(), quantized::sampled);
    let imagined =
        quantizer.method().imagined().filter(|_| found.steps() > 0).map_or(String::new(), quantized::imagined);
    let learned = sampled + &imagined + &found.learning.as_ref().map_or(String::new(), quantized::learning);
    let time = match &found.time {
        Some(step) => time::sentence(&image, step),
        None => time::sentence(&image, &time::of_image(&image, args.core, CLOCK)?),
    };
    let (parameters, bytes) = (source.parameters, found.image.len());
    let f32_bytes = 4 * parameters;
    print(&format!(
        "{search}{}{learned}\n{}: {bytes} bytes, {:.3} bits per weight: also {}. The policy's {parameters} parameters take \
         {f32_bytes} bytes in f32 ({:.1}x) and {} in bf16 ({:.1}x).\n{time}Took {:.1} s.\n",
        quantized::matrices(found),
        args.out.display(),
        file_bits_per_weight(&image),
        Beside::of(&image),
        f32_bytes as f64 / bytes as f64,
        f32_bytes / 2,
        f32_bytes as f64 / 2.0 / bytes as f64,
        started.elapsed().as_secs_f64(),
    ))
}

/// Measures the errors of the network's image on the recordings, and prints them.
fn measure(
    args: &QuantizeArgs,
    source: &Policy,
    recordings: &Recordings,
    options: &Options,
    network: &ImageBuffer,
    held_out: Option<HeldOut>,
) -> Result<()> {
    match check::check(source, network.image(&args.out)?, recordings, &options.method, held_out) {
        Ok(Some(check)) => {
            print(&format!("\n{}", notes::errors(&check)))?;
            note(notes::of_check(&check, options));
        }
        Ok(None) => note(["the error was not measured, as there is no recording; pass one by --calib FILE".to_owned()]),
        // The image is written and correct.
        Err(error) => note([format!("the error was not measured: {error:#}")]),
    }
    Ok(())
}

/// Measures the error of the network's image on recordings of its own rollouts, if there are any, and prints it.
fn own_path(args: &QuantizeArgs, source: &Policy, network: &ImageBuffer, shares: Vec<Share>) -> Result<()> {
    let image = network.image(&args.out)?;
    let of_image = |path: &PathBuf| driven_by(path).is_ok_and(|crc| crc == Some(image.crc()));
    let driven: Vec<PathBuf> = shares.into_iter().map(|share| share.path).filter(of_image).collect();
    if !driven.is_empty() {
        print(&notes::own_path(&own::own_path(image, &driven, Some(source))?))?;
    }
    Ok(())
}

/// Returns the options of the command line.
fn options(args: &QuantizeArgs, graph: &Graph, method: Method) -> Options {
    let group = args.group.unwrap_or(method.default_group());
    let protected = args.protect.iter().map(|name| (name.clone(), Width::W8));
    let forced: Vec<_> = args.width.iter().cloned().chain(protected).collect();
    let budget = args.max_nmse.map(Budget::MaxNmse).or_else(|| args.budget.budget(args.core));
    let budget = budget.unwrap_or_else(|| method.default_budget(graph, group, !forced.is_empty()));
    Options {
        group,
        activations: match args.activations {
            Some(ActivationArg::Int8) => Activations::Int8,
            Some(ActivationArg::Int16) => Activations::Int16,
            None => Activations::Auto,
        },
        steps: args.learn.distill.steps,
        effort: args.learn.distill.effort,
        minutes: args.learn.minutes,
        relative: args.learn.distill.relative,
        seed: args.run.seed,
        forced,
        ..Options::new(method, budget)
    }
}
