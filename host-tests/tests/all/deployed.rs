//! Descriptions as images: every operation of the image in f32, with the network's weights as they were trained,
//! against the description's own execution and against published references. [`crate::on_target::deployed`] compares
//! the bits of host and target. Published bundles run where `ACTQ_SHARED` names their folder.

use std::path::{Path, PathBuf};

use actq::error::Error;
use actq::graph::ops::Linear;
use actq::graph::{Graph, WeightMatrix};
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::bits;
use actq_bench::descriptions::{Compared, compare};
use actq_deploy::description::{Description, Network};
use actq_deploy::{
    Answers, Array, Bundle, Compute, DESCRIPTION, Deployment, Part, Plan, Reference, Runner, Sources, read,
};
use actq_kernels::{PortKind, StepError};
use anyhow::{Context as _, Result, ensure};

use crate::slices::{in_polls, whole};

/// Published bundles with the answers that they need.
pub(crate) const PUBLISHED: [(&str, &str); 5] = [
    ("unitree_lab_g1_velocity", ""),
    ("limx_tron1_pf_isaaclab", ""),
    // Its code sends targets beyond the joints' ranges.
    ("kinfer_zbot_walking", "target.limits = \"none\""),
    ("falcon_g1", "action_scale = 0.25\nrate_hz = 50"),
    ("holosoma_t1_fastsac", include_str!("../../../crates/actq-deploy/tests/all/holosoma.toml")),
];

/// A published bundle: its plan, its compiled form and its reference. `None` without the shared folder.
pub(crate) fn published(name: &str, answers: &str) -> Result<Option<(Plan, Deployment, Reference)>> {
    let Some(shared) = std::env::var_os("ACTQ_SHARED") else {
        println!("not run: ACTQ_SHARED does not name the shared folder");
        return Ok(None);
    };
    let folder = PathBuf::from(shared).join("bundles").join(name);
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::parse(answers)?)?;
    let plan = Plan::new(&reading.description, &bundle)?;
    let deployment = Deployment::new(name, reading.description.rate_hz as f32, &plan)?;
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join("expect.npz"))?;
    Ok(Some((plan, deployment, reference)))
}

/// Requires that an image gives targets to 1e-5 of the largest.
fn gives(deployment: &Deployment, raw: &[Vec<Vec<f64>>], targets: &[f64]) -> Result<()> {
    let bytes = deployment.four_bits()?;
    let found = deployment.in_f32(raw)?.concat();
    let largest = targets.iter().fold(0f64, |most, x| most.max(x.abs()));
    ensure!(found.len() == targets.len() && deployment.columns.len() == deployment.policy.graph.obs_len);
    let differences = found.iter().zip(targets).map(|(found, expected)| (f64::from(*found) - expected).abs());
    let worst = differences.fold(0f64, f64::max) / largest;
    let policy = &deployment.policy;
    println!("{}: {} bytes, largest difference {worst:.1e} of the largest target", policy.name, bytes.len());
    ensure!(worst < 1e-5, "{}: {worst}", policy.name);
    Ok(())
}

#[test]
fn images_of_bundles_give_their_codes_targets() -> Result<()> {
    for (name, answers) in PUBLISHED {
        let Some((plan, deployment, reference)) = published(name, answers)? else { return Ok(()) };
        let targets = reference.array("target").context("no targets")?;
        gives(&deployment, &reference.raw().frames(plan.inputs())?, &targets.values)?;
    }
    Ok(())
}

/// A description with every operation, and its files.
pub(crate) struct Made;

pub(crate) const MADE: &str = include_str!("deployed.toml");

/// Networks with random weights, by the names of their files: one linear function for each output.
#[derive(Debug)]
struct Networks {
    inputs: Vec<(String, usize)>,
    lens: Vec<usize>,
    outputs: Vec<(Policy, Vec<usize>)>,
}

impl Networks {
    fn new(inputs: &[(&str, usize)], outputs: &[(usize, &[usize])]) -> Result<Self> {
        let mut random = Random::new(3);
        let mut parts = Vec::new();
        for (n, (rows, reads)) in outputs.iter().enumerate() {
            let cols = reads.iter().map(|read| inputs[*read].1).sum();
            let mut graph = Graph::new(cols);
            let data = (0..rows * cols).map(|_| 0.3 * random.unit()).collect();
            let name = format!("{}.{n}", inputs[0].0);
            let matrix = graph.add_matrix(WeightMatrix { name, rows: *rows, cols, data })?;
            graph.add(Linear { matrix, bias: vec![0.1; *rows] }, &[0])?;
            parts.push((Policy::of("made", graph), reads.to_vec()));
        }
        let inputs = inputs.iter().map(|(name, len)| ((*name).to_owned(), *len)).collect();
        Ok(Self { inputs, lens: outputs.iter().map(|(rows, _)| *rows).collect(), outputs: parts })
    }
}

impl Compute for Networks {
    fn inputs(&self) -> &[(String, usize)] {
        &self.inputs
    }

    fn outputs(&self) -> &[usize] {
        &self.lens
    }

    fn part(&self, output: usize) -> Option<Part<'_>> {
        self.outputs.get(output).map(|(policy, reads)| Part { policy, inner: &policy.graph, reads })
    }

    fn reset(&mut self) {}

    fn step(&mut self, inputs: &[Vec<f32>]) -> Vec<Vec<f32>> {
        let compute = |(policy, reads): &(Policy, Vec<usize>)| {
            let x: Vec<f32> = reads.iter().flat_map(|read| inputs[*read].clone()).collect();
            let matrix = &policy.graph.matrices[0];
            let dot = |row: &[f32]| row.iter().zip(&x).map(|(w, x)| w * x).sum::<f32>() + 0.1;
            matrix.data.chunks_exact(matrix.cols).map(dot).collect()
        };
        self.outputs.iter().map(compute).collect()
    }
}

impl Sources for Made {
    fn network(&self, network: &Network, outputs: &[String]) -> actq::error::Result<Box<dyn Compute>> {
        let made = match &*network.file {
            "first" => Networks::new(&[("frames", 12)], &[(2, &[0])]),
            _ => {
                let all = [(3, &[0, 1][..]), (4, &[1, 0][..])];
                let asked: Vec<_> = outputs.iter().map(|name| all[usize::from(name == "state")]).collect();
                Networks::new(&[("read", 39), ("kept", 4)], &asked)
            }
        };
        Ok(Box::new(made.map_err(|error| Error::input(error.to_string()))?))
    }

    fn array(&self, _: &str, _: &str) -> actq::error::Result<Array> {
        let values = (0..15).map(|i| (f64::from(i) * 0.7).sin()).collect();
        Ok(Array { shape: vec![5, 3], values })
    }
}

impl Made {
    pub(crate) fn deployment() -> Result<(Plan, Deployment)> {
        Self::deployment_of(MADE)
    }

    /// Returns the plan and the compiled form of another description with the same networks.
    pub(crate) fn deployment_of(text: &str) -> Result<(Plan, Deployment)> {
        let plan = Plan::new(&Description::parse(text)?, &Self)?;
        let deployment = Deployment::new("every operation", 50.0, &plan)?;
        Ok((plan, deployment))
    }

    /// Returns raw values of some ticks: the robot stands in some of them.
    pub(crate) fn raw(ticks: usize) -> Vec<Vec<Vec<f64>>> {
        let mut random = Random::new(5);
        let mut values =
            |len: usize, scale: f32| -> Vec<f64> { (0..len).map(|_| f64::from(scale * random.unit())).collect() };
        (0..ticks)
            .map(|tick| {
                let command = if tick / 20 % 2 == 0 { 1.0 } else { 0.1 };
                vec![values(3, 1.0), scaled(&values(4, 1.0), 1.0), values(3, 1.5), values(2, command)]
            })
            .collect()
    }
}

#[test]
fn every_operation_matches_its_description() -> Result<()> {
    let (plan, deployment) = Made::deployment()?;
    let raw = Made::raw(150);
    let mut runner = Runner::new(plan);
    let targets: Vec<f64> = raw
        .iter()
        .map(|raw| Ok(runner.step(raw)?.targets))
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .flat_map(|(_, target)| target)
        .collect();
    gives(&deployment, &raw, &targets)
}

fn scaled(vector: &[f64], length: f64) -> Vec<f64> {
    let norm = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    vector.iter().map(|x| x / norm * length).collect()
}

/// A quaternion whose length is not near 1 gives no action, in a whole step, in polls, and in the description's own
/// execution. Then the head starts anew.
#[test]
fn quaternions_far_from_unit_give_no_action() -> Result<()> {
    const QUATERNION: usize = 1;
    for order in ["xyzw", "wxyz"] {
        let description = MADE.replace("gravity = \"xyzw\"", &format!("gravity = \"{order}\""));
        let (plan, deployment) = Made::deployment_of(&description)?;
        let bytes = deployment.four_bits()?;
        let buffer = ImageBuffer::new(&bytes);
        let raw = Made::raw(10);
        let mut runner = Runner::new(plan);
        let single = |raw: &[Vec<f64>]| raw.concat().iter().map(|x| *x as f32).collect::<Vec<_>>();
        let later: Vec<_> = raw[5..].iter().map(|raw| single(raw)).collect();
        let expected = with_head(buffer.image(Path::new("new"))?, |head| whole(head, &later))?;
        with_head(buffer.image(Path::new("new"))?, |head| {
            for length in [0.0, 1e-30, 0.5, 0.9, 0.95, 1.0, 1.05, 1.1, 2.0, 100.0, 1e30] {
                for quaternion in
                    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.5, -0.5, 0.5, -0.5], [0.1, 0.7, -0.6, 0.4]]
                {
                    let mut raw = raw[..5].to_vec();
                    raw[4][QUATERNION] = scaled(&quaternion, length);
                    let (before, far) = (single(&raw[3]), single(&raw[4]));
                    let is_far = !(0.92..=1.08).contains(&length);
                    head.reset();
                    head.step(&before)?;
                    let stepped = head.step(&far).map(bits);
                    ensure!(stepped.is_err() == is_far, "{order}, length {length}: {stepped:?}");
                    ensure!(
                        runner.step(&raw[4]).is_err() == is_far,
                        "{order}, length {length}: the description differs"
                    );
                    if !is_far {
                        continue;
                    }
                    ensure!(stepped == Err(StepError::Orientation), "{stepped:?}");
                    ensure!(whole(head, &later)? == expected, "{order}, length {length}: the head does not start anew");
                    let budget = head.least_budget();
                    let polled = in_polls(head, &far, || budget).expect_err("no action of polls");
                    ensure!(polled.downcast_ref() == Some(&StepError::Orientation), "{polled}");
                    let polled =
                        later.iter().map(|raw| Ok(in_polls(head, raw, || budget)?.0)).collect::<Result<Vec<_>>>()?;
                    ensure!(polled == expected, "{order}, length {length}: polls do not start anew");
                }
            }
            Ok(())
        })?;
        let mut zero = raw[0].clone();
        zero[QUATERNION].fill(0.0);
        let error = format!("{:#}", runner.step(&zero).expect_err("no orientation"));
        ensure!(error.contains("gravity") && error.contains("length 0.000"), "{error}");
    }
    Ok(())
}

/// A self-test has orientations, also where their inputs are in another unit, order or range.
#[test]
fn self_tests_have_orientations_within_ranges() -> Result<()> {
    let input = "name = \"quaternion\"\nlen = 4";
    for (range, scale) in [("[-1.01, 1.01]", "1.0"), ("[0.0, 16384.0]", "0.00006103515625"), ("[5.0, 7.5]", "1.0")] {
        let read = if range == "[5.0, 7.5]" { "{ subtract = 6.0 }" } else { "{ select = [2, 0, 3, 1] }" };
        let description = MADE
            .replace(input, &format!("{input}\nrange = {range}"))
            .replace("{ gravity = \"xyzw\" }", &format!("{read}, {{ scale = {scale} }}, {{ gravity = \"xyzw\" }}"));
        ensure!(description.contains(range) && description.contains(read), "the fixture has changed");
        let bytes = Made::deployment_of(&description)?.1.four_bits()?;
        with_head(ImageBuffer::new(&bytes).image(Path::new("new"))?, |head| Ok::<_, anyhow::Error>(head.self_test()?))?;
    }
    Ok(())
}

/// `cargo xtask descriptions` compares 10,000 others.
#[test]
fn random_descriptions_agree_in_all_executions() -> Result<()> {
    const SEEDS: std::ops::Range<u64> = 1_000_000..1_000_300;
    let mut same = 0;
    for seed in SEEDS {
        same += usize::from(matches!(compare(seed)?, Compared::Same(..)));
    }
    ensure!(same >= 270, "{same} of {} have an image", SEEDS.count());
    Ok(())
}

#[test]
fn images_name_inputs_targets_and_joints() -> Result<()> {
    let bytes = Made::deployment()?.1.four_bits()?;
    let buffer = ImageBuffer::new(&bytes);
    let found: Vec<_> = buffer.image(Path::new("new"))?.ports().map(|p| (p.kind, p.name, p.len, p.names)).collect();
    let expected = [
        (PortKind::Input, "q", 3, "a\nb\nc"),
        (PortKind::Input, "quaternion", 4, ""),
        (PortKind::Input, "angles", 3, ""),
        (PortKind::Input, "command", 2, ""),
        (PortKind::Position, "target", 3, ""),
        (PortKind::Velocity, "mixed", 3, "c\na\nb"),
    ];
    ensure!(found == expected, "{found:?}");
    Ok(())
}

/// Counts the episodes that a policy succeeds in; without raw values, `step` resets it.
fn balanced(episodes: u64, mut step: impl FnMut(Option<&[f32]>) -> Result<Vec<f32>>) -> Result<u64> {
    let mut successes = 0;
    for seed in 0..episodes {
        step(None)?;
        let torques = |raw: &[f32]| step(Some(raw))?.as_slice().try_into().context("two torques");
        successes += u64::from(actq_balancer::run_episode(seed, torques)?.success);
    }
    Ok(successes)
}

/// The bundle of the repository keeps the robot up: as it is described, and as an image.
#[test]
fn description_and_image_balance_the_robot() -> Result<()> {
    const EPISODES: u64 = 10;
    let folder = actq_balancer::bundle();
    let bundle = Bundle::open(folder)?;
    let plan = Plan::new(&Description::parse(&bundle.text(DESCRIPTION)?)?, &bundle)?;
    let mut runner = Runner::new(plan);
    let described = balanced(EPISODES, |raw| {
        let Some(raw) = raw else {
            runner.reset();
            return Ok(Vec::new());
        };
        let inputs = runner.plan().split(raw);
        Ok(runner.step(&inputs)?.targets[0].1.iter().map(|x| *x as f32).collect())
    })?;
    let bytes = Deployment::load(folder)?.four_bits()?;
    let buffer = ImageBuffer::new(&bytes);
    let of_image = with_head(buffer.image(folder)?, |head| {
        balanced(EPISODES, |raw| {
            let Some(raw) = raw else {
                head.reset();
                return Ok(Vec::new());
            };
            Ok(head.step(raw)?.to_vec())
        })
    })?;
    ensure!([described, of_image] == [EPISODES; 2], "{described} and {of_image} of {EPISODES}");
    Ok(())
}

#[test]
fn sliced_and_restored_descriptions_have_the_same_bits() -> Result<()> {
    let bytes = Made::deployment()?.1.four_bits()?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(Path::new("new"))?;
    let raw: Vec<Vec<f32>> = Made::raw(60).iter().map(|raw| raw.concat().iter().map(|x| *x as f32).collect()).collect();
    let expected = with_head(image, |head| whole(head, &raw))?;
    with_head(image, |head| {
        let mut saved = vec![0; head.saved_len()];
        for (tick, (raw, expected)) in raw.iter().zip(&expected).enumerate() {
            if tick == 30 {
                // A head that was reset continues from the saved state.
                head.save(&mut saved)?;
                head.reset();
                head.step(raw)?;
                head.restore(&saved)?;
            }
            let budget = head.least_budget();
            let (action, polls) = in_polls(head, raw, || budget)?;
            ensure!(polls > 10 && action == *expected, "tick {tick}: {polls} polls");
        }
        head.reset();
        ensure!(bits(head.step(&raw[0])?) == expected[0], "after a reset");
        Ok(())
    })
}
