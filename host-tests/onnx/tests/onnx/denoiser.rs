//! Networks of flow and diffusion policies, with the steps of a sampler.

use actq::graph::Node;
use actq::import::Sampler;
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_onnx::{ImportOptions, Imported};
use anyhow::{Context as _, Result, ensure};

use super::file::File;
use super::{compare, drawn, imported};

const OBS: usize = 3;
const VALUES: usize = 8;

/// Writes a network that gives four actions of two values: attention over their tokens, after a layer norm that the time
/// and the observation shift, and a layer that reads both.
pub(super) fn network() -> Vec<u8> {
    let mut file = File::default();
    file.input("noisy", &[1, 4, 2]);
    file.input("timestep", &[1]);
    file.input("state", &[1, OBS as i64]);
    file.write(
        &[],
        "t = Reshape(timestep, [1, 1]) * drawn(1, 30)
         features = Concat(Sin(t), Cos(t), state, axis=1)
         shift = Reshape(gemm(Tanh(features), 6, 63), [1, 1, 6])
         h = LayerNormalization(MatMul(noisy, drawn(2, 6)) + drawn(4, 6), full(1.0, 6), full(0.0, 6), axis=-1) * shift
         q = MatMul(h, drawn(6, 6))
         k = MatMul(h, drawn(6, 6))
         v = MatMul(h, drawn(6, 6))
         a = MatMul(Softmax(MatMul(q, Transpose(k, perm=[0, 2, 1])) * 0.4, axis=-1), v)
         velocity := MatMul(Tanh(a + h + shift), drawn(6, 2))",
    );
    file.output("velocity", &[1, 4, 2]);
    file.bytes()
}

fn with(sampler: &str) -> Result<ImportOptions> {
    Ok(ImportOptions { sampler: Some(Sampler::parse(sampler.as_bytes())?), ..ImportOptions::default() })
}

/// A flow of five steps, with more keys.
fn flow(more: &str) -> String {
    format!(r#"{{"kind": "flow", "steps": 5, "time": {{"from": 0, "to": 1}}{more}}}"#)
}

/// Imports the network alone.
fn alone() -> Result<Policy> {
    let options = ImportOptions { observed: vec!["noisy".to_owned()], ..ImportOptions::default() };
    let (found, policy) = imported(&network(), &options)?;
    let inputs = [("noisy", VALUES), ("timestep", 1), ("state", OBS)].map(|(name, len)| (name.to_owned(), len));
    ensure!(found.inputs == inputs, "{:?}", found.inputs);
    Ok(policy)
}

/// Returns its output for an iterate, a time and an observation.
fn velocity(alone: &Policy, iterate: &[f32], time: f64, observation: &[f32]) -> Vec<f64> {
    let row = [iterate, &[time as f32], observation].concat();
    actions(alone, &[row])[0].iter().map(|v| f64::from(*v)).collect()
}

#[test]
fn a_flow_adds_the_networks_outputs() -> Result<()> {
    let alone = alone()?;
    for (solver, steps, from, to) in [("euler", 5, 0.0, 1.0), ("midpoint", 5, 1.0, 0.0), ("euler", 20, 0.0, 1.0)] {
        let sampler = format!(
            r#"{{"kind": "flow", "steps": {steps}, "solver": "{solver}", "execute": 2, "overlap": 1, "time": {{"from": {from}, "to": {to}}}}}"#
        );
        let (found, policy) = imported(&network(), &with(&sampler)?)?;
        ensure!(found.inputs == [("state".to_owned(), OBS)] && found.cut_inputs.is_empty(), "{found:?}");
        let playback = (policy.chunk, policy.execute, policy.contract.playback.overlap);
        ensure!((playback, policy.act_len) == ((4, 2, 1), 2), "{policy:?}");
        let rows = drawn(&policy);
        let expected = rows.iter().map(|row| {
            let (observation, noise) = row.split_at(OBS);
            let h = (to - from) / f64::from(steps);
            let mut x: Vec<f64> = noise.iter().map(|v| f64::from(*v)).collect();
            let at = |x: &[f64], time: f64| {
                velocity(&alone, &x.iter().map(|v| *v as f32).collect::<Vec<_>>(), time, observation)
            };
            let moved = |x: &[f64], v: &[f64], by: f64| x.iter().zip(v).map(|(x, v)| x + by * v).collect::<Vec<_>>();
            for step in 0..steps {
                let time = from + h * f64::from(step);
                let mut v = at(&x, time);
                if solver == "midpoint" {
                    v = at(&moved(&x, &v, h / 2.0), time + h / 2.0);
                }
                x = moved(&x, &v, h);
            }
            x.into_iter().map(|v| v as f32).collect()
        });
        compare(&expected.collect::<Vec<Vec<f32>>>(), &actions(&policy, &rows))?;
    }
    Ok(())
}

/// Packages keep the scales of actions beside the network.
#[test]
fn a_sampler_states_the_scales_of_actions() -> Result<()> {
    let import = |action: &str| imported(&network(), &with(&flow(action))?);
    let (found, _) = import(r#", "action": {"low": [-5, -6], "high": [5, 6]}"#)?;
    ensure!(found.ports().contains("actions as the network has them"), "{}", found.ports());
    let (found, policy) = import("")?;
    ensure!(found.ports().contains("actions as the network has them"), "{}", found.ports());
    ensure!(policy.contract.scale.is_none() && policy.contract.low.is_none(), "{:?}", policy.contract);
    let (found, policy) = import(r#", "action": {"mean": [1, 2], "std": [3, 4], "low": [-5, -6], "high": [5, 6]}"#)?;
    ensure!(!found.ports().contains("actions as the network has them"), "{}", found.ports());
    let contract = policy.contract;
    ensure!(contract.scale == Some(vec![3.0, 4.0]) && contract.offset == Some(vec![1.0, 2.0]), "{contract:?}");
    ensure!(contract.low == Some(vec![-5.0, -6.0]) && contract.high == Some(vec![5.0, 6.0]), "{contract:?}");
    Ok(())
}

/// With few steps, the layer over a function of time and observation is a table, and a layer of the observation that runs
/// once. With many, the table would be longer than the layer's weights.
#[test]
fn what_does_not_change_in_a_chunk_is_computed_once() -> Result<()> {
    let (_, policy) = imported(&network(), &with(&flow(""))?)?;
    let first = policy.graph.denoising.as_ref().context("no steps")?.first;
    let reads_observation = |node: &Node| node.inputs.contains(&0);
    ensure!(policy.graph.nodes[..first].iter().any(reads_observation), "{:?}", policy.graph.nodes);
    ensure!(!policy.graph.nodes[first..].iter().any(reads_observation), "{:?}", policy.graph.nodes);
    let columns = |policy: &Policy| policy.graph.matrices.iter().map(|matrix| matrix.cols).collect::<Vec<_>>();
    ensure!(columns(&policy).contains(&OBS) && !columns(&policy).contains(&(60 + OBS)), "{:?}", columns(&policy));
    let (_, policy) = imported(&network(), &with(r#"{"kind": "flow", "steps": 6, "time": {"from": 0, "to": 1}}"#)?)?;
    ensure!(columns(&policy).contains(&(60 + OBS)), "{:?}", columns(&policy));
    Ok(())
}

#[test]
fn a_diffusion_policy_reads_the_training_step() -> Result<()> {
    let sampler = r#"{"kind": "diffusion", "train_steps": 10, "steps": 2, "schedule": "cosine", "solver": "ddim", "prediction": "epsilon",
        "clip_sample": null, "time_input": "timestep"}"#;
    let (found, policy) = imported(&network(), &with(sampler)?)?;
    ensure!(found.denoiser.as_ref().is_some_and(|denoiser| denoiser.times == [5.0, 0.0]), "{:?}", found.denoiser);
    let steps = policy.graph.denoising.as_ref().context("no steps")?.steps.clone();
    let alone = alone()?;
    let rows = drawn(&policy);
    let expected = rows.iter().map(|row| {
        let (observation, noise) = row.split_at(OBS);
        let mut x = noise.to_vec();
        for (time, by) in [5.0, 0.0].into_iter().zip(&steps) {
            let v = velocity(&alone, &x, time, observation);
            let next = |(x, v): (&f32, &f64)| f64::from(by.keep) * f64::from(*x) + f64::from(by.direct) * v;
            x = x.iter().zip(&v).map(next).map(|v| v as f32).collect();
        }
        x
    });
    compare(&expected.collect::<Vec<_>>(), &actions(&policy, &rows))
}

#[test]
fn what_a_sampler_does_not_fit_is_refused_by_name() -> Result<()> {
    let import = |sampler: &str| -> Result<Imported> { Ok(imported(&network(), &with(sampler)?)?.0) };
    for (sampler, expected) in [
        (r#"{"kind": "step"}"#, r#"kind is "step"; it must be flow or diffusion"#),
        (r#"{"kind": "flow", "steps": 5, "step": 5}"#, r#"the key "step" is not known; the keys are kind, execute"#),
        (r#"{"kind": "flow", "time": {}}"#, r#"the key "steps" is missing"#),
        (r#"{"kind": "flow", "steps": 5, "time": {"to": 1}}"#, "time needs from and to"),
        (r#"{"kind": "flow", "steps": 5, "time": {"from": 0, "to": 1, "freq": "f"}}"#, "time takes from and to alone"),
        (
            r#"{"kind": "diffusion", "train_steps": 9, "schedule": "linear", "solver": "ddim", "prediction": "v"}"#,
            r#"the key "clip_sample" is missing"#,
        ),
        (
            &flow(r#", "execute": 5"#),
            "execute is 5, and an output of shape [1, 4, 2] has 4: a chunk is [1, actions, values]",
        ),
        (&flow(r#", "action": {"mean": [1], "std": [1]}"#), "action.mean has 1 values, but act_dim is 2"),
        (&flow(r#", "time_input": "t""#), r#"the sampler's time_input names "t", which is none of them"#),
        (&flow(r#", "time_input": "state""#), r#"time_input "state" has the shape"#),
    ] {
        let error = format!("{:#}", import(sampler).expect_err(expected));
        ensure!(error.contains(expected), "{error} instead of {expected}");
    }
    let mut file = File::default();
    file.input("a", &[1, 2]);
    file.input("b", &[1, 2]);
    file.input("time", &[1, 1]);
    file.write(&[], "velocity := MatMul(Tanh(Concat(a, b, time, axis=1)), drawn(5, 2))");
    file.output("velocity", &[1, 2]);
    let error = format!("{:#}", imported(&file.bytes(), &with(&flow(""))?).expect_err("two"));
    ensure!(error.contains("the sampler's iterate_input is missing, and may be a, b"), "{error}");
    let named = with(&flow(r#", "iterate_input": "b""#))?;
    let (found, _) = imported(&file.bytes(), &named)?;
    ensure!(found.inputs == [("a".to_owned(), 2)], "{:?}", found.inputs);
    Ok(())
}
