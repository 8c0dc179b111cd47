//! Flow and diffusion policies: their steps against the textbook formulas in f64, with hoisted weights and tables that
//! are computed when the image is built; noise; and the same bits in any slicing of a step, on the host.
//! `on_target::denoising` has the target.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use actq::budget::Budget;
use actq::data::Recordings;
use actq::graph::Evaluator;
use actq::methods::{Activations, Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::{bits, rtn};
use actq_kernels::cost::Rates;
use actq_kernels::image::{OpKind, header as h, op};
use actq_kernels::ops::noise::normal;
use actq_kernels::{Head, ImageError, StepError, Width};
use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use crate::draft::Draft;
use crate::ops::{Case, wide};
use crate::slices;

const OBS: usize = 5;
const CHUNK: usize = 3;
const ACT: usize = 2;
const LEN: usize = CHUNK * ACT;
const FREQUENCIES: usize = 3;

/// A residual network of time, observation and iterate, whose first layer reads all three and whose second norm reads a
/// time code.
fn policy(kind: &str, more: Value) -> Value {
    let mut json = json!({
        "name": "denoiser", "kind": kind, "chunk": CHUNK, "execute": 2, "obs_dim": OBS, "act_dim": ACT,
        "time": {"freq": format!("freq {FREQUENCIES}")},
        "action": {},
        "ops": [
            {"op": "linear", "w": "t 8x6", "b": "tb 8", "input": "tfeat"},
            {"op": "silu", "save": "code"},
            {"op": "linear", "w": "c 7x5", "b": "cb 7", "input": "obs"},
            {"op": "tanh", "save": "condition"},
            {"op": "linear", "w": "in 12x21", "b": "inb 12", "input": ["code", "x", "condition"], "save": "h"},
            {"op": "layernorm", "w_ln": "g 12", "b_ln": "gb 12"},
            {"op": "identity", "save": "n"},
            {"op": "linear", "w": "up 16x20", "b": "ub 16", "input": ["n", "code"]},
            {"op": "gelu"},
            {"op": "linear", "w": "down 12x16", "b": "db 12"},
            {"op": "add", "with": "h"},
            {"op": "linear", "w": "out 6x12", "b": "ob 6"},
        ],
    });
    if let (Some(json), Value::Object(more)) = (json.as_object_mut(), more) {
        for (key, value) in more {
            match (json.get_mut(&key), value) {
                (Some(Value::Object(old)), Value::Object(new)) => old.extend(new),
                (_, value) => drop(json.insert(key, value)),
            }
        }
    }
    json
}

/// The policies of these tests, and the solver of their steps.
fn policies() -> Vec<(Value, Solver)> {
    let diffusion = |schedule: &str, more: Value| {
        let mut all = json!({"train_steps": 12, "schedule": schedule, "time": {"turns": false, "order": "sin,cos"}});
        if let (Some(all), Value::Object(more)) = (all.as_object_mut(), more) {
            all.extend(more);
        }
        policy("diffusion", all)
    };
    let ddpm = |prediction, clip, large| Solver::Ddpm { prediction, clip, large };
    vec![
        (policy("flow", json!({"euler_steps": 5})), Solver::Euler { from: 0.0, to: 1.0 }),
        (policy("flow", json!({"steps": 4, "time": {"from": 1.0, "to": 0.0}})), Solver::Euler { from: 1.0, to: 0.0 }),
        (policy("flow", json!({"steps": 3, "solver": "midpoint"})), Solver::Midpoint),
        (diffusion("cosine", json!({"prediction": "epsilon", "clip_sample": 1.5})), ddpm("epsilon", 1.5, false)),
        (
            diffusion("linear", json!({"prediction": "sample", "beta": [0.01, 0.4]})),
            ddpm("sample", f64::INFINITY, false),
        ),
        (
            diffusion("cosine", json!({"prediction": "v", "steps": 4, "variance": "large"})),
            ddpm("v", f64::INFINITY, true),
        ),
        (
            diffusion("cosine", json!({"prediction": "epsilon", "clip_sample": 2.0, "solver": "ddim", "steps": 6})),
            Solver::Ddim { prediction: "epsilon", clip: 2.0 },
        ),
        (
            diffusion("cosine", json!({"prediction": "epsilon", "clip_iterate": 0.8, "variance": "large"})),
            ddpm("epsilon", f64::INFINITY, true),
        ),
        (
            diffusion("cosine", json!({"prediction": "v", "solver": "ddim", "steps": 4, "clip_iterate": 0.6})),
            Solver::Ddim { prediction: "v", clip: f64::INFINITY },
        ),
        (
            diffusion("cosine", json!({"prediction": "sample", "solver": "ddim", "steps": 3})),
            Solver::Ddim { prediction: "sample", clip: f64::INFINITY },
        ),
        (
            diffusion("linear", json!({"prediction": "v", "solver": "ddim", "beta": [0.02, 0.3], "clip_sample": 1.0})),
            Solver::Ddim { prediction: "v", clip: 1.0 },
        ),
    ]
}

enum Solver {
    Euler { from: f64, to: f64 },
    Midpoint,
    Ddpm { prediction: &'static str, clip: f64, large: bool },
    Ddim { prediction: &'static str, clip: f64 },
}

/// Computes the output for an observation and noise, by the formulas of the papers in f64.
fn reference(case: &Case, json: &Value, solver: &Solver, obs: &[f64], noise: &[f64]) -> Vec<f64> {
    let mut network = case.reference();
    let freq = network.tensors[json["time"]["freq"].as_str().unwrap_or("")].clone();
    let diffusion = json["kind"] == "diffusion";
    let mut at = |x: &[f64], time: f64| {
        let angle = |f: &f64| if diffusion { time * f } else { TAU * time * f };
        let (sin, cos) = (freq.iter().map(|f| angle(f).sin()), freq.iter().map(|f| angle(f).cos()));
        let tfeat = if diffusion { sin.chain(cos).collect() } else { cos.chain(sin).collect() };
        network.run(BTreeMap::from([("obs", obs.to_vec()), ("tfeat", tfeat), ("x", x.to_vec())]))
    };
    let along = |x: &[f64], v: &[f64], h: f64| -> Vec<f64> { x.iter().zip(v).map(|(x, v)| x + h * v).collect() };
    let mut x = noise[..LEN].to_vec();
    let steps = json["steps"].as_u64().or(json["euler_steps"].as_u64()).or(json["train_steps"].as_u64()).unwrap_or(0);
    let (prediction, clip) = match solver {
        Solver::Euler { from, to } => {
            let h = (to - from) / steps as f64;
            for k in 0..steps {
                let v = at(&x, from + h * k as f64);
                x = along(&x, &v, h);
            }
            return x;
        }
        Solver::Midpoint => {
            let h = 1.0 / steps as f64;
            for k in 0..steps {
                let half = along(&x, &at(&x, h * k as f64), 0.5 * h);
                x = along(&x, &at(&half, h * (k as f64 + 0.5)), h);
            }
            return x;
        }
        Solver::Ddpm { prediction, clip, .. } | Solver::Ddim { prediction, clip } => (*prediction, *clip),
    };
    let train = json["train_steps"].as_u64().unwrap_or(0);
    let bar = |i: u64| ((i as f64 / train as f64 + 0.008) / 1.008 * FRAC_PI_2).cos().powi(2);
    let beta = |i: u64| match json["beta"].as_array() {
        Some(ends) => {
            let [first, last] = [0, 1].map(|i: usize| ends[i].as_f64().unwrap_or(0.0));
            first + (last - first) * i as f64 / (train - 1) as f64
        }
        None => (1.0 - bar(i + 1) / bar(i)).min(0.999),
    };
    let signal = |i: u64| (0..=i).map(|i| 1.0 - beta(i)).product::<f64>();
    let limit = json["clip_iterate"].as_f64().unwrap_or(f64::INFINITY);
    for k in (0..steps).rev() {
        x = x.iter().map(|x| x.clamp(-limit, limit)).collect();
        let t = k * (train / steps);
        let (now, before) = (signal(t), if k > 0 { signal((k - 1) * (train / steps)) } else { 1.0 });
        let out = at(&x, t as f64);
        let draw = (1 + steps - 1 - k) as usize * LEN;
        for i in 0..LEN {
            let (sample, eps) = match prediction {
                "epsilon" => ((x[i] - (1.0 - now).sqrt() * out[i]) / now.sqrt(), out[i]),
                "sample" => (out[i], (x[i] - now.sqrt() * out[i]) / (1.0 - now).sqrt()),
                _ => (now.sqrt() * x[i] - (1.0 - now).sqrt() * out[i], now.sqrt() * out[i] + (1.0 - now).sqrt() * x[i]),
            };
            let sample = sample.clamp(-clip, clip);
            x[i] = if let Solver::Ddpm { large, .. } = solver {
                // Equation 7 of the paper: the mean and the variance of the previous iterate, given the sample.
                let alpha = now / before;
                let mean = before.sqrt() * (1.0 - alpha) / (1.0 - now) * sample
                    + alpha.sqrt() * (1.0 - before) / (1.0 - now) * x[i];
                let variance = if *large { 1.0 - alpha } else { (1.0 - before) / (1.0 - now) * (1.0 - alpha) };
                mean + if k > 0 { variance.sqrt() * noise[draw + i] } else { 0.0 }
            } else {
                before.sqrt() * sample + (1.0 - before).sqrt() * eps
            };
        }
    }
    x
}

pub(crate) fn drawn(random: &mut Random, len: usize, reach: f32) -> Vec<f32> {
    (0..len).map(|_| reach * random.unit()).collect()
}

#[test]
fn steps_match_the_textbook_formulas() -> Result<()> {
    for (json, solver) in policies() {
        let case = Case::new(json.clone())?;
        let policy = Policy::load(case.dir.path())?;
        let graph = &policy.graph;
        let mut evaluator = Evaluator::new(graph);
        let mut random = Random::new(3);
        // The part that depends on time is a table; the part that depends on the observation runs once.
        ensure!(graph.matrices.iter().all(|m| !m.name.starts_with("t ") && m.name != "in 12x21"), "{json}");
        ensure!(graph.denoising.as_ref().is_some_and(|d| d.first >= 3), "{json}");
        let options =
            Options { activations: Activations::Int16, ..Options::new(Method::Rtn, Budget::Width(Width::W8)) };
        let quantized = quantize(&policy, &Recordings::default(), &options, ())?;
        assert_eq!(quantized.outcomes.len(), graph.matrices.len());
        let buffer = quantized.buffer();
        let image = buffer.image(case.dir.path())?;
        assert_eq!((image.noise_len(), image.obs_len()), (graph.noise_len(), OBS), "{json}");
        with_head::<_, anyhow::Error>(image, |head| {
            for _ in 0..20 {
                let (obs, noise) = (drawn(&mut random, OBS, 2.0), drawn(&mut random, graph.noise_len(), 2.0));
                let expected = reference(&case, &json, &solver, &wide(&obs), &wide(&noise));
                let rms = (expected.iter().map(|v| v * v).sum::<f64>() / LEN as f64).sqrt();
                let off = |given: &[f32]| {
                    let errors = given.iter().zip(&expected).map(|(a, b)| (f64::from(*a) - b).abs());
                    errors.fold(0.0, f64::max) / rms
                };
                let of_f32 = off(&evaluator.step(&[obs.clone(), noise.clone()].concat(), &mut |_, _| {}));
                assert!(of_f32 < 1e-4, "the error of f32 is {of_f32:.1e}: {json}");
                let of_image = off(head.infer_with_noise(&obs, &noise)?);
                // 8-bit weights over many steps, each based on the one before; a wrong coefficient causes tens of
                // percent.
                assert!(of_image < 0.08, "the error of the image is {of_image:.1e}: {json}");
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Returns an image of each policy of these tests.
pub(crate) fn images() -> Result<Vec<ImageBuffer>> {
    policies().into_iter().map(|(json, _)| quantized(json)).collect()
}

fn quantized(json: Value) -> Result<ImageBuffer> {
    let case = Case::new(json)?;
    let policy = Policy::load(case.dir.path())?;
    Ok(ImageBuffer::new(&rtn(&policy, Width::W3, 0, Activations::Auto)?))
}

#[test]
fn a_reset_restarts_generated_noise() -> Result<()> {
    for (json, _) in policies() {
        let buffer = quantized(json.clone())?;
        let image = buffer.image("memory".as_ref())?;
        with_head::<_, anyhow::Error>(image, |head| {
            let obs = [0.3; OBS];
            let play = |head: &mut Head<'_, '_>| -> Result<Vec<Vec<u32>>> {
                (0..6).map(|_| Ok(bits(head.step(&obs)?))).collect()
            };
            let first = play(head)?;
            // Two actions of a chunk, then new noise.
            assert_ne!(first[0], first[2], "{json}");
            head.reset();
            assert_eq!(play(head)?, first, "{json}");
            head.seed(7);
            let other = play(head)?;
            assert_ne!(other, first, "{json}");
            head.self_test()?;
            assert_eq!(play(head)?, other, "the self-test changes the seed: {json}");
            // The same noise, supplied by the caller.
            head.seed(7);
            let noise: Vec<f32> = (0..image.noise_len() as u32).map(|i| normal(7, 0, i)).collect();
            let drawn = bits(head.infer(&obs)?);
            assert_eq!(bits(head.infer_with_noise(&obs, &noise)?), drawn, "{json}");
            let short = head.infer_with_noise(&obs, &noise[1..]).map(|_| ());
            assert_eq!(short, Err(StepError::NoiseLength { expected: noise.len(), given: noise.len() - 1 }));
            let mut nan = noise.clone();
            nan[1] = f32::NAN;
            assert_eq!(head.infer_with_noise(&obs, &nan).map(|_| ()), Err(StepError::NoiseNotFinite { index: 1 }));
            Ok(())
        })?;
    }
    Ok(())
}

#[test]
fn any_slicing_gives_the_same_bits() -> Result<()> {
    for (json, _) in policies() {
        let buffer = quantized(json.clone())?;
        let image = buffer.image("memory".as_ref())?;
        let mut random = Random::new(5);
        let observations: Vec<Vec<f32>> = (0..6).map(|_| drawn(&mut random, OBS, 2.0)).collect();
        let whole = with_head(image, |head| slices::whole(head, &observations))?;
        let (cut, polls) = with_head::<_, anyhow::Error>(image, |head| {
            let least = head.least_budget();
            let steps = observations.iter().map(|obs| slices::in_polls(head, obs, || least));
            steps.collect::<Result<(Vec<_>, Vec<_>)>>()
        })?;
        assert_eq!(cut, whole, "{json}");
        let polls: usize = polls.iter().sum();
        assert!(polls > 3 * 3 * 3, "{polls} polls: {json}");
    }
    Ok(())
}

#[test]
fn impossible_policies_are_refused() -> Result<()> {
    let flow = |more: Value| policy("flow", more);
    let diffusion = |more: Value| policy("diffusion", more);
    for (json, expected) in [
        (flow(json!({})), "needs the key steps"),
        (flow(json!({"steps": 0})), "steps is 0"),
        (flow(json!({"steps": 1001})), "steps is 1001"),
        (flow(json!({"steps": 2, "euler_steps": 2})), "are synonyms"),
        (flow(json!({"steps": 2, "solver": "ddim"})), "solver is \"ddim\""),
        (flow(json!({"steps": 2, "schedule": "cosine"})), "is for kind diffusion"),
        (flow(json!({"steps": 2, "time": {"from": 1.0}})), "time runs from 1 to 1"),
        (flow(json!({"steps": 2, "time": {"order": "tan"}})), "time.order is \"tan\""),
        (
            flow(json!({"steps": 2, "ops": [{"op": "linear", "w": "a 4x6", "input": "x"}]})),
            "the last op gives 4 values",
        ),
        (
            flow(json!({"steps": 2, "ops": [{"op": "linear", "w": "a 6x5", "input": "obs"}]})),
            "does not depend on the iterate",
        ),
        (
            flow(
                json!({"steps": 2, "ops": [{"op": "lstm", "hidden": 6, "w_ih": "a 24x6", "w_hh": "b 24x6", "input": "x"}]}),
            ),
            "a recurrent network",
        ),
        (diffusion(json!({"schedule": "cosine"})), "needs the key train_steps"),
        (diffusion(json!({"train_steps": 4})), "needs the key schedule"),
        (diffusion(json!({"train_steps": 4, "schedule": "square"})), "schedule is \"square\""),
        (
            diffusion(json!({"train_steps": 4, "schedule": "cosine", "steps": 5})),
            "steps is 5, but train_steps is only 4",
        ),
        (
            diffusion(json!({"train_steps": 4, "schedule": "linear", "beta": [0.1, 1.5]})),
            "betas must lie between 0 and 1",
        ),
        (
            diffusion(json!({"train_steps": 4, "schedule": "linear", "beta": [-0.1, 0.5]})),
            "betas must lie between 0 and 1",
        ),
        (diffusion(json!({"train_steps": 4, "schedule": "cosine", "prediction": "mean"})), "prediction is \"mean\""),
        (diffusion(json!({"train_steps": 4, "schedule": "cosine", "solver": "euler"})), "solver is \"euler\""),
        (diffusion(json!({"train_steps": 4, "schedule": "cosine", "clip_sample": 0.0})), "clip_sample is 0.0"),
        (
            diffusion(json!({"train_steps": 4, "schedule": "cosine", "clip_sample": 1.0, "clip_iterate": 1.0})),
            "remove one of them",
        ),
        (flow(json!({"steps": 2, "clip_iterate": 1.0})), "is for kind diffusion"),
        (diffusion(json!({"train_steps": 4, "schedule": "cosine", "variance": "none"})), "variance is \"none\""),
    ] {
        let case = Case::new(json.clone())?;
        let error = Policy::load(case.dir.path()).err().with_context(|| format!("accepted: {json}"))?;
        let text = format!("{error:#}");
        assert!(text.contains(expected), "{text:?} for {expected:?}");
    }
    Ok(())
}

#[test]
fn impossible_images_are_refused() -> Result<()> {
    let image = Draft::of(quantized(policies().swap_remove(3).0)?.bytes());
    let (table, denoise) = (image.op((op::TABLE, 0)), image.op((op::DENOISE, 0)));
    let (constants, first) = (image.offset(denoise + 3), image.offset(h::W_OPS));
    let (nan, huge) = (f32::NAN.to_bits(), 1 << 20);
    let (kind, denoising) = (image.get(h::W_KIND), image.get(h::W_DENOISING));
    let iterate = image.check()?.ops().find(|op| op.kind == OpKind::Denoise).context("denoising")?.dst().offset as u32;
    let cases: [(&str, usize, u32, ImageError); 17] = [
        ("noise that is added, without noise", constants + 1, 0, ImageError::Denoising),
        ("noise in place of the iterate", constants + 1, iterate, ImageError::Denoising),
        ("noise in every step", h::W_DENOISING, denoising & !0xffff, ImageError::Denoising),
        ("no steps", h::W_DENOISING, image.low(h::W_DENOISING), ImageError::Denoising),
        ("more steps than tables", h::W_DENOISING, denoising | 0xffff << 16, ImageError::Section),
        ("nothing to repeat", h::W_DENOISING, denoising & !0xffff | image.high(h::W_KIND), ImageError::Denoising),
        ("a table before the steps", h::W_DENOISING, denoising + 20, ImageError::Denoising),
        ("a chunk with steps", h::W_KIND, kind & !0xff | 1, ImageError::Denoising),
        ("a kind beyond", h::W_KIND, kind & !0xff | 4, ImageError::Kind),
        (
            "noise after the first operation",
            first + h::OP_WORDS,
            image.get(first + h::OP_WORDS) & !0xff | u32::from(op::NOISE),
            ImageError::Reserved,
        ),
        ("a limit of 0", constants, 0, ImageError::Constant),
        ("a limit NaN", constants, nan, ImageError::Constant),
        ("a coefficient NaN", constants + h::DENOISE_WORDS + 5, nan, ImageError::Constant),
        ("noise outside", constants + 1, huge, ImageError::Denoising),
        ("truncated noise", constants + 1, image.get(constants + 1) + 1, ImageError::Denoising),
        ("a table NaN", image.offset(table + 3), nan, ImageError::Constant),
        ("coefficients outside", denoise + 3, image.0.len() as u32 - 1, ImageError::Section),
    ];
    for (name, at, word, expected) in cases {
        let mut changed = image.clone();
        changed.set(at, word);
        changed.seal();
        assert_eq!(changed.check().err(), Some(expected), "{name}");
    }
    Ok(())
}

/// A flow of K steps costs K times its per-step part, and the rest once.
#[test]
fn steps_cost_what_they_repeat() -> Result<()> {
    let of = |steps: usize| -> Result<u64> {
        let buffer = quantized(policy("flow", json!({"steps": steps})))?;
        Ok(Rates::M4F.of_step(&buffer.image("memory".as_ref())?).instructions)
    };
    let [one, two, ten] = [of(1)?, of(2)?, of(10)?];
    assert!(ten.abs_diff(one + 9 * (two - one)) <= 9, "{one}, {two}, {ten}");
    Ok(())
}
