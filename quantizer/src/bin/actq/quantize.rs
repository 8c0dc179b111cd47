//! `actq quantize`

use std::path::{Path, PathBuf};
use std::time::Instant;

use actq::dataset::Sizes;
use actq::dataset::recording::Recording;
use actq::graph::Graph;
use actq::inspect::{group_name, table};
use actq::policy::Policy;
use actq::quantize::actquant::Statistics;
use actq::quantize::prepared::Prepared;
use actq::quantize::{Activations, Budget, Method, Options, Outcome};
use actq::runtime::ImageBuffer;
use actq::search::{self, Measure};
use actq::stats::{Asked, Stats};
use actq::{check, files, policy, time, widths, writer};
use actq_kernels::Width;
use anyhow::Result;

use crate::args::{ActivationArg, QuantizeArgs};
use crate::{note, print, progress_bar, set_share, start_threads};

/// Quantizes a policy, writes the image and says what became of it.
pub(crate) fn run(args: &QuantizeArgs) -> Result<()> {
    let outputs: Vec<&Path> = [Some(&args.out), args.save_stats.as_ref()].into_iter().flatten().map(|p| &**p).collect();
    let inputs: Vec<PathBuf> = policy::files(&args.policy_dir).into_iter().chain(args.calib.clone()).collect();
    files::check_outputs(&outputs, &inputs)?;
    let source = Policy::load(&args.policy_dir)?;
    let (dir, sizes) = (Some(args.policy_dir.as_path()), Sizes::of(&source));
    let calib = Recording::Calib.load(dir, args.calib.as_deref(), sizes)?;
    let heldout = Recording::Heldout.load(dir, None, sizes)?;
    note(check::recording_notes(calib.as_ref(), heldout.as_ref()));
    let method = match args.method {
        Some(method) => method.into(),
        None if calib.is_none() => Method::Rtn,
        None => Method::Best,
    };
    let budget = match (args.bits, args.bpw, args.flash) {
        (_, Some(bpw), _) => Budget::BitsPerWeight(bpw),
        (.., Some(bytes)) => Budget::ImageBytes(bytes),
        (bits, ..) => Budget::Width(bits.unwrap_or(Width::W3)),
    };
    let protected = args.protect.iter().map(|name| (name.clone(), Width::W8));
    let options = Options {
        group: args.group.unwrap_or(method.default_group()),
        activations: match args.activations {
            Some(ActivationArg::Int8) => Activations::Int8,
            Some(ActivationArg::Int16) => Activations::Int16,
            None => Activations::Auto,
        },
        steps: args.steps,
        seed: args.run.seed,
        forced: args.width.iter().cloned().chain(protected).collect(),
        ..Options::new(method, budget)
    };
    let started = Instant::now();
    start_threads(args.run.threads)?;
    let measure = args.max_nmse.map(|_| Measure::new(&source, calib.as_ref(), heldout.as_ref())).transpose()?;
    let bar = progress_bar()?;
    bar.set_message("calibrating");
    let prepared = Prepared::with_recording(&source, method, calib.as_ref(), |share| set_share(&bar, share))?;
    bar.reset();
    bar.set_message("quantizing");
    let limit = args.ms.map(|milliseconds| time::Limit { milliseconds, clock_hz: args.clock });
    let (policy, outcomes, options, search) = match (args.max_nmse.zip(measure.as_ref()), limit) {
        (None, None) => {
            let (policy, outcomes) = prepared.quantize(&options, |share| set_share(&bar, share))?;
            (policy, outcomes, options, String::new())
        }
        (None, Some(limit)) => {
            let (policy, outcomes, options) = limit.quantize(&prepared, &options, |share| set_share(&bar, share))?;
            (policy, outcomes, options, String::new())
        }
        (Some((limit, measure)), _) => {
            let found = search::smallest(&source, &prepared, &options, limit, measure, |work, share| {
                bar.set_message(work.to_owned());
                set_share(&bar, share);
            })?;
            let note = format!("{}\n", found.report(limit, measure));
            (found.policy, found.outcomes, found.options, note)
        }
    };
    bar.finish_and_clear();
    let bytes = writer::image(&policy, &outcomes)?;
    let mut files = vec![(args.out.as_path(), bytes.clone())];
    if let Some(path) = &args.save_stats {
        let asked = match (args.max_nmse, limit) {
            (Some(nmse), _) => Asked::MaxNmse(nmse),
            (_, Some(time::Limit { milliseconds, clock_hz })) => Asked::Time { milliseconds, clock_hz },
            _ => budget.into(),
        };
        let buffer = ImageBuffer::new(&bytes);
        let (scores, steps) = (prepared.actquant.as_ref().map_or(&[][..], |s| &s.scores), prepared.steps(&options));
        let stats = Stats::new(&source, asked, &options, &outcomes, scores, steps, &buffer.image(&args.out)?);
        files.push((path, stats.json()?.into_bytes()));
    }
    files::write_all(&files)?;
    if let Some(statistics) = &prepared.actquant {
        print(&scores(&policy.graph, statistics, options.budget, &outcomes))?;
    }
    let time = limit.map_or(Ok(String::new()), |limit| limit.predict(&bytes).map(|step| step.sentence()))?;
    let parameters = source.graph.parameters();
    let f32_bytes = 4 * parameters;
    print(&format!(
        "{search}{}\n{}: {} bytes. The policy's {parameters} parameters take {f32_bytes} bytes in f32 ({:.1}x) and {} in bf16 \
         ({:.1}x).\n{time}Took {:.1} s.\n",
        summary(&policy, &outcomes),
        args.out.display(),
        bytes.len(),
        f32_bytes as f64 / bytes.len() as f64,
        f32_bytes / 2,
        f32_bytes as f64 / 2.0 / bytes.len() as f64,
        started.elapsed().as_secs_f64(),
    ))?;
    let Some(heldout) = heldout else { return Ok(()) };
    let buffer = ImageBuffer::new(&bytes);
    match check::check(&source, buffer.image(&args.out)?, calib.as_ref(), &heldout) {
        Ok(check) => {
            print(&format!("\n{}", check.summary()))?;
            note(check.overfit_warning());
        }
        // The image is written, and nothing is wrong with it.
        Err(error) => note([format!("the held-out error is not known: {error:#}")]),
    }
    Ok(())
}

fn scores(graph: &Graph, statistics: &Statistics, budget: Budget, outcomes: &[Outcome]) -> String {
    let (_, equal) = statistics.effective_scores();
    let mut rows = table(&["matrix", "HSIC score", "bits"]);
    for ((matrix, score), outcome) in graph.matrices.iter().zip(&statistics.scores).zip(outcomes) {
        let bits = outcome.quantized.width_counts();
        rows.add_row([matrix.name.clone(), format!("{:.4}", score.sens()), bits]);
    }
    let note = match budget {
        Budget::Width(_) => "One width for all: the scores are not used.",
        _ if equal => "No score is above 0: every matrix counts the same.",
        _ => "Scores below 0 count as 0.",
    };
    format!("{rows}\n{note}\n\n")
}

fn summary(policy: &Policy, outcomes: &[Outcome]) -> String {
    let mut rows = table(&["matrix", "shape", "bits", "group", "bytes", "x max", "error"]);
    let mut total = 0;
    for (matrix, outcome) in policy.graph.matrices.iter().zip(outcomes) {
        let quantized = &outcome.quantized;
        let bytes = outcome.bytes();
        total += bytes;
        rows.add_row([
            matrix.name.clone(),
            format!("{}x{}", matrix.rows, matrix.cols),
            quantized.width_counts(),
            group_name(quantized.group),
            bytes.to_string(),
            outcome.x_max.to_string(),
            outcome.error.map_or("-".to_owned(), |e| format!("{e:.2e}")),
        ]);
    }
    let bits = 8.0 * total as f64 / policy.weights.max(1) as f64;
    let by_row = outcomes.iter().any(|outcome| outcome.allocation.is_some());
    let widths = if by_row { widths::line(policy, outcomes) + "\n" } else { String::new() };
    format!("{rows}\n\n{total} bytes of weights, {bits:.3} bits each, everything counted\n{widths}")
}
