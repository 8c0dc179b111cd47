//! Drive, record, learn again: an image is driven, the f32 policy says what it would have done where that has led, and
//! the next image learns from that as well (DAgger: Ross, Gordon, Bagnell 2011, with the f32 policy as the expert).

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::driven::{DriveOutcome, Driven};
use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::data::{Dataset, Learned, Recording, Recordings, Share};
use crate::error::{Context as _, Result, ensure};
use crate::measure::eval;
use crate::methods::Options;
use crate::policy::Policy;

/// What is tuned, and from what.
#[derive(Debug)]
pub struct TunePlan<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// What the first image learns from, and all others too: recordings of the f32 policy.
    pub calib: Vec<Dataset>,
    /// What the errors on the f32 policy's path are measured on; without it, on `calib`.
    pub heldout: Option<Dataset>,
    /// Method and budget of every image.
    pub options: &'a Options,
    /// How often is learned again.
    pub rounds: usize,
}

/// One image: what it learned from, how far it is from the f32 policy, how it drove.
#[derive(Clone, Debug, Serialize)]
pub struct Round {
    /// 0 for the image that has learned from the f32 policy's recordings alone.
    pub round: usize,
    /// Recordings that it learned from.
    pub recordings: usize,
    /// Their episodes.
    pub episodes: usize,
    /// Their frames, as many of them as were kept.
    pub frames: usize,
    /// Bits per weight, everything counted.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// Error (NMSE) on the f32 policy's path.
    pub nmse: f64,
    /// Error (NMSE) on the path on which the image itself has led the robot; `None` where the f32 policy's actions
    /// never vary there, or the image has none at an observation that it did not plan at.
    pub own_nmse: Option<f64>,
    /// How it drove.
    pub driven: DriveOutcome,
    /// Seconds that learning and driving took.
    pub seconds: f64,
}

/// What became of it.
#[derive(Debug)]
pub struct Tuned {
    /// The last image.
    pub quantized: QuantizedPolicy,
    /// A row for every image.
    pub rounds: Vec<Round>,
    /// The recording of the errors on the f32 policy's path.
    pub measured_on: String,
}

impl Tuned {
    /// The round whose image drove best, where it was not the last one.
    pub fn better(&self) -> Option<&Round> {
        let (last, earlier) = self.rounds.split_last()?;
        let driven = earlier.iter().filter_map(|round| Some((round, round.driven.success()?)));
        // Of equal ones the latest: it has learned from most.
        let (best, success) = driven.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (success > last.driven.success()?).then_some(best)
    }
}

/// Learns once from the f32 policy's recordings, then `rounds` times from those and from all that was driven before.
/// `drive` gets each image, counted from 0, and gives what the image was shown. `progress` gets what is being done and
/// the share of it that is done.
///
/// # Errors
///
/// Without a recording to learn from; where a recording cannot be learned from or measured on; those of `drive`, with
/// the round.
pub fn run(
    plan: TunePlan<'_>,
    mut drive: impl FnMut(usize, &[u8]) -> Result<Driven>,
    mut progress: impl FnMut(&str, f64),
) -> Result<Tuned> {
    let TunePlan { policy, calib: mut parts, heldout, options, rounds } = plan;
    ensure!(!parts.is_empty(), "{}", Recording::Calib.missing("actq tune"));
    let mut f32_path = match heldout {
        Some(heldout) => heldout,
        None => Learned::join(&mut parts, &policy.graph)?.dataset,
    };
    f32_path.fill_actions(&policy.graph);
    let mut rows: Vec<Round> = Vec::new();
    loop {
        let round = rows.len();
        let started = Instant::now();
        let Learned { dataset, shares } = Learned::join(&mut parts, &policy.graph)?;
        let quantized =
            learn(policy, dataset, options, |work, share| progress(&format!("round {round}: {work}"), share))?;
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
            nmse: report.nmse,
            own_nmse: eval::evaluate(image, &own_path).ok().map(|report| report.nmse),
            driven: driven.outcome,
            seconds: started.elapsed().as_secs_f64(),
        });
        if round == rounds {
            return Ok(Tuned { quantized, rounds: rows, measured_on: f32_path.name().into_owned() });
        }
        parts.append(&mut driven.recordings);
    }
}

fn learn(
    policy: &Policy,
    calib: Dataset,
    options: &Options,
    mut progress: impl FnMut(&str, f64),
) -> Result<QuantizedPolicy> {
    let recordings = Recordings { calib: Some(calib), heldout: None };
    let quantizer =
        Quantizer::new(policy, &recordings, options.method, options.minutes, |share| progress("calibrating", share))?;
    quantizer.quantize(options, |work, share| progress(work, share))
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;
    use crate::budget::Budget;
    use crate::methods::Method;
    use crate::methods::actquant::testing::{dataset, lstm};
    use crate::random::Random;

    fn policy() -> Policy {
        Policy { dir: "policy".into(), digest: [7; 32], ..Policy::of("tiny", lstm()) }
    }

    fn said(success: f64) -> DriveOutcome {
        DriveOutcome::parse(&format!("{{\"success\": {success}}}")).expect("an object")
    }

    /// Observations that no recording before has shown.
    fn elsewhere(round: usize) -> Dataset {
        let mut random = Random::new(100 + round as u64);
        let obs = Array3::from_shape_simple_fn((3, 20, 2), || 1.0 + random.unit());
        Dataset { path: format!("drive-{round}.npz").into(), obs, action: None, length: vec![20; 3], state: None }
    }

    #[test]
    fn every_round_learns_from_all_that_was_driven_before() {
        let (policy, options) =
            (policy(), Options { steps: Some(4), ..Options::new(Method::Distill, Budget::BitsPerWeight(14.0)) });
        let plan = || TunePlan {
            policy: &policy,
            calib: vec![dataset(&policy.graph, 5, 50)],
            heldout: None,
            options: &options,
            rounds: 2,
        };
        let mut images = Vec::new();
        let successes = [0.5, 0.75, 0.625];
        let tuned = run(
            plan(),
            |round, image| {
                assert_eq!(round, images.len());
                images.push(image.to_vec());
                Ok(Driven { recordings: vec![elsewhere(round)], outcome: said(successes[round]) })
            },
            |_, _| {},
        )
        .expect("tuned");
        let learned: Vec<_> = tuned.rounds.iter().map(|r| (r.round, r.recordings, r.episodes, r.frames)).collect();
        assert_eq!(learned, [(0, 1, 5, 250), (1, 2, 8, 310), (2, 3, 11, 370)]);
        assert_eq!(images[2], tuned.quantized.image, "the last image is driven, and given");
        assert!(images[0] != images[1] && images[1] != images[2]);
        assert!(tuned.rounds.iter().all(|r| r.nmse > 0.0 && r.own_nmse.is_some_and(|n| n > 0.0)));
        assert_eq!(tuned.better().map(|r| r.round), Some(1));

        let broken = |round: usize, _: &[u8]| -> Result<Driven> {
            ensure!(round == 0, "the robot fell over");
            Ok(Driven { recordings: vec![elsewhere(0)], outcome: DriveOutcome::default() })
        };
        let error = run(plan(), broken, |_, _| {}).expect_err("it fell");
        assert_eq!(format!("{error:#}"), "round 1: the robot fell over");
        let nothing = TunePlan { calib: Vec::new(), ..plan() };
        let error = run(nothing, broken, |_, _| {}).expect_err("nothing to learn from").to_string();
        assert!(error.starts_with("actq tune needs recorded observations: put calib.npz"), "{error}");
    }
}
