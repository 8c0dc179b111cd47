//! On-policy rounds: an image is rolled out, the f32 policy labels what the image observed, and the next image also
//! learns from that (DAgger: Ross, Gordon, Bagnell 2011, with the f32 policy as the expert).

use std::path::Path;
use std::time::Instant;

use actq_kernels::cost::Core;
use serde::Serialize;

use super::driven::{DriveOutcome, Driven};
use super::quantizer::{QuantizedPolicy, Quantizer};
use super::watch::Watch;
use crate::data::{Dataset, Learned, Part, Recording, Recordings, Share};
use crate::error::{Context as _, Result, ensure};
use crate::measure::eval;
use crate::measure::recorded::{self, Difference};
use crate::measure::time::{CLOCK, StepTime};
use crate::methods::{Method, Options};
use crate::policy::Policy;

/// Policy, recordings and options of a tuning.
#[derive(Debug)]
pub struct TunePlan<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// Recordings of the f32 policy, which all images learn from.
    pub calib: Vec<Dataset>,
    /// Recording for errors on the f32 policy's path; without it, a tenth of `calib` is held out.
    pub heldout: Option<Dataset>,
    /// Method and budget of every image.
    pub options: &'a Options,
    /// On-policy rounds after the first image.
    pub rounds: usize,
}

/// One image: its recordings, its error against the f32 policy, its rollout.
#[derive(Clone, Debug, Serialize)]
pub struct Round {
    /// Number of the round; 0 for the image that has learned from the f32 policy's recordings alone.
    pub round: usize,
    /// Recordings that it learned from.
    pub recordings: usize,
    /// Episodes in them.
    pub episodes: usize,
    /// Frames of them that were kept.
    pub frames: usize,
    /// Bits per weight of the matrices, with scales and padding; biases and header do not count.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// Predicted milliseconds of a step at the default [`CLOCK`].
    pub milliseconds: f64,
    /// Error (NMSE) on the f32 policy's path.
    pub nmse: f64,
    /// Error (NMSE) on the path of the image's own rollout; `None` if the f32 policy's actions never vary there, or if
    /// the image has none at an observation at which it did not plan.
    pub own_nmse: Option<f64>,
    /// Outcome of its rollout.
    pub driven: DriveOutcome,
    /// Seconds of learning and rollout.
    pub seconds: f64,
}

/// Result of a tuning.
#[derive(Debug)]
pub struct Tuned {
    /// The last image.
    pub quantized: QuantizedPolicy,
    /// One row per image.
    pub rounds: Vec<Round>,
    /// Recording for the errors on the f32 policy's path.
    pub measured_on: String,
    /// Recorded actions that are not the f32 policy's.
    pub differences: Vec<Difference>,
}

impl Tuned {
    /// Returns the round whose image was most successful, if it was not the last one.
    pub fn better(&self) -> Option<&Round> {
        let (last, earlier) = self.rounds.split_last()?;
        let driven = earlier.iter().filter_map(|round| Some((round, round.driven.success()?)));
        // Of equal ones, take the latest: it has learned from the most recordings.
        let (best, success) = driven.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (success > last.driven.success()?).then_some(best)
    }
}

/// Learns from the f32 policy's recordings, then `rounds` times from those and all rollouts before. `drive` receives
/// each image with its number from 0, and returns its rollout. `watch` receives the present work, with the last image's
/// success, and the share of it that is done.
///
/// # Errors
///
/// Without a recording to learn from; if a recording cannot be learned from or measured on; errors of `drive`, with the
/// round.
pub fn run(
    plan: TunePlan<'_>,
    mut drive: impl FnMut(usize, &[u8]) -> Result<Driven>,
    mut watch: impl Watch,
) -> Result<Tuned> {
    let TunePlan { policy, calib: mut parts, heldout, options, rounds } = plan;
    ensure!(!parts.is_empty(), "{}", Recording::Calib.missing("actq tune"));
    let mut differences: Vec<Difference> =
        parts.iter_mut().filter_map(|part| recorded::use_policy_of(part, &policy.graph)).collect();
    let mut f32_path = match heldout {
        Some(mut heldout) => {
            differences.extend(recorded::use_policy_of(&mut heldout, &policy.graph));
            heldout
        }
        None => hold_out(&mut parts, policy, &options.method)?,
    };
    f32_path.fill_actions(&policy.graph);
    let mut rows: Vec<Round> = Vec::new();
    loop {
        let round = rows.len();
        let started = Instant::now();
        let Learned { dataset, shares } = Learned::join(&mut parts, &policy.graph)?;
        let success = rows.last().and_then(|row| row.driven.success());
        let success = success.map_or_else(String::new, |success| format!(", success {success} before"));
        let quantized = learn(policy, dataset, options, |work: &str, share| {
            watch.progress(&format!("round {round}: {work}{success}"), share)
        })?;
        let buffer = quantized.buffer();
        let image = buffer.image(Path::new("the new image"))?;
        let report = eval::evaluate(image, &f32_path)?;
        let mut driven = drive(round, &quantized.image).with_context(|| format!("round {round}"))?;
        let mut own_path = Learned::join(&mut driven.recordings, &policy.graph)?.dataset;
        own_path.fill_actions(&policy.graph);
        let sum = |of: fn(&Share) -> usize| shares.iter().map(of).sum();
        rows.push(Round {
            round,
            recordings: shares.len(),
            episodes: sum(|share| share.episodes),
            frames: sum(|share| share.kept),
            bpw: report.bpw,
            bytes: report.bytes,
            milliseconds: StepTime::new(&image, Core::M4f, CLOCK).milliseconds,
            nmse: report.nmse,
            own_nmse: eval::evaluate(image, &own_path).ok().map(|report| report.nmse),
            driven: driven.outcome,
            seconds: started.elapsed().as_secs_f64(),
        });
        if round == rounds {
            let measured_on = f32_path.name().into_owned();
            return Ok(Tuned { quantized, rounds: rows, measured_on, differences });
        }
        parts.append(&mut driven.recordings);
    }
}

/// Takes a tenth of every recording, which no image learns from; all of them if too few frames would stay.
fn hold_out(parts: &mut [Dataset], policy: &Policy, method: &Method) -> Result<Dataset> {
    let tenths: Vec<Part> = parts.iter().map(|part| part.part(&policy.graph, 5, 10)).collect();
    let frames: usize = tenths.iter().map(|tenth| tenth.learned.frames()).sum();
    if frames < method.least_frames() {
        return Ok(Learned::join(parts, &policy.graph)?.dataset);
    }
    let (learned, mut held_out): (Vec<_>, Vec<_>) =
        tenths.into_iter().map(|Part { learned, held_out }| (learned, held_out)).unzip();
    parts.iter_mut().zip(learned).for_each(|(part, learned)| *part = learned);
    held_out.retain(|part| part.frames() > 0);
    Ok(Learned::join(&mut held_out, &policy.graph)?.dataset)
}

fn learn(policy: &Policy, calib: Dataset, options: &Options, mut watch: impl Watch) -> Result<QuantizedPolicy> {
    let recordings = Recordings { calib: Some(calib), heldout: None };
    let quantizer = Quantizer::new(policy, &recordings, options.method.clone(), options.minutes, |share| {
        watch.progress("calibrating", share)
    })?;
    quantizer.quantize(options, watch)
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;
    use crate::budget::Budget;
    use crate::random::Random;
    use crate::testing::{dataset, lstm};

    fn policy() -> Policy {
        Policy { dir: "policy".into(), digest: [7; 32], ..Policy::of("tiny", lstm()) }
    }

    fn said(success: f64) -> DriveOutcome {
        DriveOutcome::parse(&format!("{{\"success\": {success}}}")).expect("an object")
    }

    /// Makes observations that no earlier recording holds.
    fn elsewhere(round: usize) -> Dataset {
        let mut random = Random::new(100 + round as u64);
        let obs = Array3::from_shape_simple_fn((3, 20, 2), || 1.0 + random.unit());
        Dataset { path: format!("drive-{round}.npz").into(), obs, action: None, length: vec![20; 3], state: None }
    }

    #[test]
    fn rounds_learn_from_all_earlier_rollouts() {
        let (policy, options) =
            (policy(), Options { steps: Some(4), ..Options::new(Method::Distill, Budget::BitsPerWeight(14.0)) });
        let plan = || TunePlan {
            policy: &policy,
            calib: vec![dataset(&policy.graph, 5, 50)],
            heldout: None,
            options: &options,
            rounds: 2,
        };
        let (mut images, mut works) = (Vec::new(), Vec::new());
        let successes = [0.5, 0.75, 0.625];
        let tuned = run(
            plan(),
            |round, image| {
                assert_eq!(round, images.len());
                images.push(image.to_vec());
                Ok(Driven { recordings: vec![elsewhere(round)], outcome: said(successes[round]) })
            },
            |work: &str, _| works.push(work.to_owned()),
        )
        .expect("tuned");
        let learned: Vec<_> = tuned.rounds.iter().map(|r| (r.round, r.recordings, r.episodes, r.frames)).collect();
        // A tenth of the first recording is held out.
        assert_eq!(learned, [(0, 1, 5, 225), (1, 2, 8, 285), (2, 3, 11, 345)]);
        assert_eq!(images[2], tuned.quantized.image, "the last image is rolled out and returned");
        assert!(images[0] != images[1] && images[1] != images[2]);
        assert!(tuned.rounds.iter().all(|r| r.nmse > 0.0 && r.own_nmse.is_some_and(|n| n > 0.0)));
        assert_eq!(tuned.better().map(|r| r.round), Some(1));
        assert!(works.iter().any(|work| work.starts_with("round 2: ") && work.ends_with(", success 0.75 before")));
        assert!(works.iter().all(|work| !work.starts_with("round 0: ") || !work.contains("success")));

        let broken = |round: usize, _: &[u8]| -> Result<Driven> {
            ensure!(round == 0, "the robot fell over");
            Ok(Driven { recordings: vec![elsewhere(0)], outcome: DriveOutcome::default() })
        };
        let error = run(plan(), broken, ()).expect_err("it fell");
        assert_eq!(format!("{error:#}"), "round 1: the robot fell over");
        let nothing = TunePlan { calib: Vec::new(), ..plan() };
        let error = run(nothing, broken, ()).expect_err("nothing to learn from").to_string();
        assert!(error.starts_with("actq tune needs recorded observations: put calib.npz"), "{error}");
    }
}
