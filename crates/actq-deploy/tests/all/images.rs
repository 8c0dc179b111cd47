//! Images of descriptions give the targets that the descriptions give.

use std::fs;

use actq::error::{Result, ensure};
use actq::runtime::{ImageBuffer, with_head};
use actq_deploy::description::Description;
use actq_deploy::{Bundle, DESCRIPTION, Deployment, Plan, Runner};
use tempfile::TempDir;

use crate::common::onnx::graph;

/// A network 4 -> 2 that ends in tanh, whose input is `obs`; then a description's own parts.
const HEAD: &str = r#"
schema = 1
name = "test"
rate_hz = 50
action = "net.out"
[[input]]
name = "x"
len = 2
[[network]]
name = "net"
file = "net.onnx"
inputs = { obs = "obs" }
"#;

/// Writes a description beside its networks.
fn written(text: &str) -> Result<TempDir> {
    let folder = TempDir::new()?;
    let weights = (0..8).map(|i| 0.6 * ((5 * i % 8) as f32 / 4.0 - 0.9)).collect();
    let nodes = [("MatMul", &["obs", "w"][..], "linear"), ("Tanh", &["linear"], "out")];
    let network = graph(&nodes, &[("w", &[4, 2], weights)], &[("obs", 4)], &[("out", 2)], &[]);
    fs::write(folder.path().join("net.onnx"), network)?;
    fs::write(folder.path().join(DESCRIPTION), [HEAD, text].concat())?;
    Ok(folder)
}

fn runner(folder: &TempDir) -> Result<Runner> {
    let bundle = Bundle::open(folder.path())?;
    Ok(Runner::new(Plan::new(&Description::parse(&bundle.text(DESCRIPTION)?)?, &bundle)?))
}

/// Returns the targets of the description, and of its image with operations in f32.
fn both(folder: &TempDir, raw: &[[f64; 2]]) -> Result<[Vec<f64>; 2]> {
    let raw: Vec<Vec<Vec<f64>>> = raw.iter().map(|raw| vec![raw.to_vec()]).collect();
    let mut runner = runner(folder)?;
    let described = raw.iter().map(|raw| Ok(runner.step(raw)?.targets)).collect::<Result<Vec<_>>>()?;
    let described = described.into_iter().flatten().flat_map(|(_, target)| target);
    let deployment = Deployment::load(folder.path())?;
    let image = deployment.in_f32(&raw)?.concat();
    Ok([described.collect(), image.into_iter().map(f64::from).collect()])
}

const WITH_MEAN: &str = r#"
[[state]]
name = "mean"
len = 2
next = "next_mean"
[[value]]
name = "obs"
from = ["x", "mean"]
[[value]]
name = "target"
from = "net.out"
do = [{ scale = 10.0 }]
[[value]]
name = "part"
from = "net.out"
do = [{ scale = 0.1 }]
[[value]]
name = "next_mean"
from = "mean"
do = [{ scale = 0.9 }, { add = "part" }]
[[target]]
kind = "position"
value = "target"
"#;

#[test]
fn states_with_operations_keep_the_targets() -> Result<()> {
    let folder = written(WITH_MEAN)?;
    let raw: Vec<[f64; 2]> = (0..20).map(|i| [f64::from(i).sin(), f64::from(i).cos()]).collect();
    let [described, image] = both(&folder, &raw)?;
    // Ten times a tanh: a running mean in its place is ten times smaller.
    ensure!(described.iter().any(|target| target.abs() > 3.0), "{described:?}");
    for (i, (image, described)) in image.iter().zip(&described).enumerate() {
        ensure!((image - described).abs() < 1e-4, "{i}: {image} in the image, {described} described");
    }
    let bytes = Deployment::load(folder.path())?.four_bits()?;
    let buffer = ImageBuffer::new(&bytes);
    with_head(buffer.image(folder.path())?, |head| {
        for (raw, described) in raw.iter().zip(described.chunks(2)) {
            let found = head.step(&raw.map(|x| x as f32))?;
            let off = found.iter().zip(described).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
            ensure!(off < 1.0, "{found:?} at 4 bits, {described:?} described");
        }
        Ok(())
    })
}

#[test]
fn clips_raise_first_and_then_lower() -> Result<()> {
    let folder = written(
        r#"
[[value]]
name = "obs"
from = ["x", "x"]
[[value]]
name = "limited"
from = "net.out"
do = [{ select = [0, 0, 0] }, { scale = 0.0 }, { add = [-3.0, 0.5, 3.0] }, { clip = ["first", "second"] }]
[[value]]
name = "first"
from = "x"
do = [{ select = [0, 0, 0] }]
[[value]]
name = "second"
from = "x"
do = [{ select = [1, 1, 1] }]
[[target]]
kind = "position"
value = "limited"
"#,
    )?;
    // As numpy.clip: with limits in the wrong order, all values are the upper limit.
    let [described, image] = both(&folder, &[[-1.0, 1.0], [1.0, -1.0], [0.25, 0.25]])?;
    ensure!(described == [-1.0, 0.5, 1.0, -1.0, -1.0, -1.0, 0.25, 0.25, 0.25], "{described:?}");
    ensure!(image == described, "{image:?}");
    Ok(())
}

#[test]
fn inputs_far_from_zero_and_shared_limits_fit_images() -> Result<()> {
    let folder = written(
        r#"
[[input]]
name = "height"
len = 2
range = [2.0, 3.0]
[[value]]
name = "obs"
from = ["x", "height"]
[[value]]
name = "limited"
from = "x"
do = [{ clip = ["height", "height"] }]
[[target]]
kind = "position"
value = "limited"
[[target]]
kind = "torque"
value = "net.out"
"#,
    )?;
    let deployment = Deployment::load(folder.path())?;
    let image = deployment.in_f32(&[vec![vec![0.5, 4.0], vec![2.25, 3.0]]])?;
    ensure!(image[0][..2] == [2.25, 3.0], "{image:?}");
    Ok(())
}

/// [`HEAD`] with an encoder before the network.
const ENCODED: &str = r#"
[[network]]
name = "encoder"
file = "net.onnx"
inputs = { obs = "both" }
[[value]]
name = "both"
from = ["x", "x"]
[[value]]
name = "obs"
from = ["encoder.out", "x"]
[[target]]
kind = "position"
value = "net.out"
"#;

#[test]
fn encoders_that_end_in_tanh_feed_networks() -> Result<()> {
    let folder = written(ENCODED)?;
    let [described, image] = both(&folder, &[[0.5, -0.25], [1.0, 2.0]])?;
    for (image, described) in image.iter().zip(&described) {
        ensure!((image - described).abs() < 1e-6, "{image} in the image, {described} described");
    }
    ensure!(described.iter().any(|target| target.abs() > 0.05), "{described:?}");
    Ok(())
}

#[test]
fn operations_between_networks_are_refused_by_name() -> Result<()> {
    let folder =
        written(&ENCODED.replace("[\"encoder.out\", \"x\"]", "[\"encoder.out\", \"x\"]\ndo = [{ scale = 2.0 }]"))?;
    let error = Deployment::load(folder.path()).map_or_else(|error| format!("{error:#}"), |_| "accepted".to_owned());
    ensure!(error.contains("value \"obs\" lies between two networks"), "{error}");
    Ok(())
}

#[test]
fn images_of_other_descriptions_are_refused() -> Result<()> {
    let (folder, other) = (written(WITH_MEAN)?, written(&WITH_MEAN.replace("0.9", "0.8"))?);
    let deployment = Deployment::load(folder.path())?;
    let raw: Vec<Vec<Vec<f64>>> = (0..20).map(|i| vec![vec![f64::from(i).sin(), 1.0]]).collect();
    deployment.verify(&mut runner(&folder)?, &raw)?;
    let error = deployment.verify(&mut runner(&other)?, &raw).expect_err("another description").to_string();
    // The mean of the first action begins to decay in the third tick.
    ensure!(error.starts_with("tick 2: target[") && error.contains("by the description"), "{error}");
    Ok(())
}
