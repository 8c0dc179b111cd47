//! Action limits that follow from the last operation.

use actq::measure::actions::actions;
use actq_cli::report::imported::summary;
use actq_onnx::ImportOptions;
use anyhow::{Context as _, Result, ensure};

use super::file::File;
use super::styles::begun;
use super::{drawn, imported};

const LEN: usize = 4;

/// The action of this shape, which the text computes from the output `x` of a layer.
fn file(shape: &[i64], text: &str) -> File {
    let mut file = begun();
    file.write(&[], &format!("x = gemm(obs, 4, 11)\n{text}"));
    file.output("actions", shape);
    file
}

/// Imports the file, requires that its limits contain all actions and that actions come close to them, and returns
/// them.
fn limits(file: &File) -> Result<Vec<Option<[f32; 2]>>> {
    let (imported, mut policy) = imported(&file.bytes(), &ImportOptions::default())?;
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
    for (op, [scale, offset], expected) in ends {
        let text = format!("actions := {op}(x) * {scale:?} + {offset:?}");
        assert_eq!(limits(&file(&[1, LEN as i64], &text))?, [Some(expected); LEN], "{text}");
    }
    Ok(())
}

#[test]
fn limits_of_several_ends_and_chunks_combine() -> Result<()> {
    // A hand's pose and its grip: the factors stay in the network, so the limits include its rounding.
    let both = file(&[1, 2 * LEN as i64], "actions := Concat(Tanh(x) * 1.7 + 0.3, Sigmoid(x), axis=1)");
    let found = limits(&both)?;
    assert_eq!(found[LEN..], [Some([0.0, 1.0]); LEN]);
    for limits in &found[..LEN] {
        let [low, high] = limits.context("the pose is bounded")?;
        assert!((-1.400_01..=-1.4).contains(&low) && (2.0..2.000_01).contains(&high), "{low}:{high}");
    }
    // The two actions have different factors, but share their limits.
    let factors = "Reshape([1.0, 3.0], [2, 1])";
    let chunk = file(&[1, 2, LEN as i64 / 2], &format!("actions := Reshape(Tanh(x), [2, 2]) * {factors}"));
    for limits in limits(&chunk)? {
        let [low, high] = limits.context("the chunk is bounded")?;
        assert!((-3.000_01..=-3.0).contains(&low) && (3.0..3.000_01).contains(&high), "{low}:{high}");
    }
    Ok(())
}

#[test]
fn clip_keeps_limits_and_layers_have_none() -> Result<()> {
    let row = [1, LEN as i64];
    assert_eq!(limits(&file(&row, "actions := Clip(x, -0.5, 0.25)"))?, [Some([-0.5, 0.25]); LEN]);
    assert_eq!(limits(&file(&row, "actions := Identity(x)"))?, [None; LEN]);
    // A tensor of limits on each side, as of torch.clamp, in either order, and after a factor and an offset.
    let (low, high) = ("[-0.5, -0.1, 0.25, -2.0]", "[0.25, 0.1, 0.375, 2.0]");
    let each = [[-0.5, 0.25], [-0.1, 0.1], [0.25, 0.375], [-2.0, 2.0]];
    for text in [format!("Min(Max(x, {low}), {high})"), format!("Max(Min(x, {high}), {low})")] {
        assert_eq!(limits(&file(&row, &format!("actions := {text}")))?, each.map(Some), "{text}");
        let scaled = limits(&file(&row, &format!("actions := {text} * 2.0 + 1.0")))?;
        assert_eq!(scaled, each.map(|limits| Some(limits.map(|limit| 2.0 * limit + 1.0))), "{text}");
    }
    // A constant action has limits equal to its value.
    let held = file(&[1, LEN as i64 + 1], "actions := Concat(x, full(0.7, 1, 1), axis=1)");
    let found = limits(&held)?;
    assert_eq!((found[..LEN].to_vec(), found[LEN]), (vec![None; LEN], Some([0.7; 2])));
    Ok(())
}
