//! Action limits that follow from the last operation.

use actq::measure::actions::actions;
use actq_cli::report::imported::summary;
use actq_onnx::Choice;
use anyhow::{Context as _, Result, ensure};

use super::file::{File, Value};
use super::styles::{OBS, begun};
use super::{drawn, imported};

const LEN: usize = 4;

/// A layer, the nodes of `end` after it, and the action of this shape.
fn file(shape: &[i64], end: impl Fn(&mut File, &str) -> String) -> File {
    let mut file = begun();
    let x = file.gemm("obs", LEN, OBS);
    let y = end(&mut file, &x);
    file.nodes("Identity", &[&y], &["actions"], &[]);
    file.output("actions", shape);
    file
}

/// `scale op(x) + offset`
fn scaled(file: &mut File, op: &str, x: &str, [scale, offset]: [f32; 2]) -> String {
    let [scale, offset] = [scale, offset].map(|v| file.reals(&[], &[v]));
    let x = file.node(op, &[x], &[]);
    let x = file.node("Mul", &[&x, &scale], &[]);
    file.node("Add", &[&x, &offset], &[])
}

/// Imports the file, requires that its limits contain all actions and that actions come close to them, and returns
/// them.
fn limits(file: &File) -> Result<Vec<Option<[f32; 2]>>> {
    let (imported, mut policy) = imported(&file.bytes(), &Choice::default())?;
    let limits: Vec<Option<[f32; 2]>> = (0..policy.act_len).map(|i| policy.contract.limits(i)).collect();
    let are_clipped = imported.contract.contains(&"low");
    assert_eq!(imported.bounded, if are_clipped { 0 } else { limits.iter().flatten().count() });
    let is_told = summary(&imported, &policy).contains(&format!("\nlimits    low and high of {}", imported.bounded));
    assert_eq!(is_told, imported.bounded > 0);
    if !are_clipped {
        [policy.contract.low, policy.contract.high] = [None, None];
    }
    let observations: Vec<Vec<f32>> = drawn(&policy)
        .into_iter()
        .flat_map(|obs| [1.0, 1e4, -1e4].map(|factor| obs.iter().map(|v| factor * v).collect()))
        .collect();
    let all = actions(&policy, &observations).concat();
    for (i, limits) in limits.iter().enumerate() {
        let Some([low, high]) = *limits else { continue };
        let values = || all.iter().copied().skip(i).step_by(policy.act_len);
        ensure!(values().all(|value| (low..=high).contains(&value)), "action {i} leaves {low}:{high}");
        let (least, most) = (values().fold(f32::MAX, f32::min), values().fold(f32::MIN, f32::max));
        ensure!(
            least - low <= 1e-5 && high - most <= 1e-5,
            "action {i} is within {least}:{most}, limited to {low}:{high}"
        );
    }
    Ok(limits)
}

#[test]
fn bounds_of_the_last_operation_become_limits() -> Result<()> {
    let ends: [(&str, [f32; 2], [f32; 2]); 6] = [
        ("Tanh", [1.0, 0.0], [-1.0, 1.0]),
        ("Sigmoid", [1.0, 0.0], [0.0, 1.0]),
        ("Tanh", [2.3, 0.1], [-2.3 + 0.1, 2.3 + 0.1]),
        ("Tanh", [-0.7, 0.0], [-0.7, 0.7]),
        ("Sigmoid", [-0.3, -0.1], [-0.3 - 0.1, -0.1]),
        ("Tanh", [1e-3, 1e3], [1e3 - 1e-3, 1e3 + 1e-3]),
    ];
    for (op, by, expected) in ends {
        let found = limits(&file(&[1, LEN as i64], |file, x| scaled(file, op, x, by)))?;
        assert_eq!(found, [Some(expected); LEN], "{op} {by:?}");
    }
    Ok(())
}

#[test]
fn limits_of_several_ends_and_chunks_combine() -> Result<()> {
    // A hand's pose and its grip: the factors stay in the network, so the limits include its rounding.
    let both = file(&[1, 2 * LEN as i64], |file, x| {
        let (pose, grip) = (scaled(file, "Tanh", x, [1.7, 0.3]), file.node("Sigmoid", &[x], &[]));
        file.node("Concat", &[&pose, &grip], &[("axis", Value::Int(1))])
    });
    let found = limits(&both)?;
    assert_eq!(found[LEN..], [Some([0.0, 1.0]); LEN]);
    for limits in &found[..LEN] {
        let [low, high] = limits.context("the pose is bounded")?;
        assert!((-1.400_01..=-1.4).contains(&low) && (2.0..2.000_01).contains(&high), "{low}:{high}");
    }
    // The two actions have different factors, but share their limits.
    let chunk = file(&[1, 2, LEN as i64 / 2], |file, x| {
        let (factors, shape) = (file.reals(&[2, 1], &[1.0, 3.0]), file.ints(&[2, LEN as i64 / 2]));
        let x = file.node("Tanh", &[x], &[]);
        let x = file.node("Reshape", &[&x, &shape], &[]);
        file.node("Mul", &[&x, &factors], &[])
    });
    for limits in limits(&chunk)? {
        let [low, high] = limits.context("the chunk is bounded")?;
        assert!((-3.000_01..=-3.0).contains(&low) && (3.0..3.000_01).contains(&high), "{low}:{high}");
    }
    Ok(())
}

#[test]
fn clip_keeps_limits_and_layers_have_none() -> Result<()> {
    let clipped = |file: &mut File, x: &str| {
        let [low, high] = [-0.5, 0.25].map(|v| file.reals(&[], &[v]));
        file.node("Clip", &[x, &low, &high], &[])
    };
    assert_eq!(limits(&file(&[1, LEN as i64], clipped))?, [Some([-0.5, 0.25]); LEN]);
    assert_eq!(limits(&file(&[1, LEN as i64], |_, x| x.to_owned()))?, [None; LEN]);
    // A constant action has limits equal to its value.
    let held = file(&[1, LEN as i64 + 1], |file, x| {
        let held = file.reals(&[1, 1], &[0.7]);
        file.node("Concat", &[x, &held], &[("axis", Value::Int(1))])
    });
    let found = limits(&held)?;
    assert_eq!((found[..LEN].to_vec(), found[LEN]), (vec![None; LEN], Some([0.7; 2])));
    Ok(())
}
