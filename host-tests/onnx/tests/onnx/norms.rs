//! Norms in every context, against tract: no factor, order, row or constant before or after them may hide one.

use anyhow::{Context as _, Result};

use super::cases::{Case, parse};
use super::file::File;
use super::same;
use super::styles::ended;

/// Values of the observation, and of the norm's input.
const LEN: usize = 12;

/// Nodes after a norm: none, factors, factors and offsets.
const AFFINES: [&str; 3] = ["x", "x * drawn(12)", "x * drawn(12) + drawn(12)"];

/// Returns the parts of networks in the sections whose titles begin with `section`.
fn parts(file: &'static str, section: &str) -> Vec<Case<'static>> {
    parse(file).into_iter().filter(|case| case.section.starts_with(section)).collect()
}

fn norms() -> Vec<Case<'static>> {
    parts(include_str!("cases/norms.txt"), "norms")
}

/// Returns the ops of a norm of rows of `len` after `front` of `axes`, and of the nodes of `texts` after it, before a
/// layer.
fn found(axes: &[i64], front: &str, norm: &Case<'_>, len: usize, texts: &[&str]) -> Result<String> {
    let mut file = File::default();
    file.input("obs", axes);
    let x = file.write(&[], front);
    let weights: Vec<String> = (0..len).map(|i| format!("{:.1}", 0.1 * i as f32)).collect();
    let text = norm.text.replace("drawn(n)", &format!("drawn({len})"));
    let x = file.write(&[&x], &text.replace("weights", &format!("[{}]", weights.join(", "))));
    let x = texts.iter().fold(x, |x, text| file.write(&[&x], text));
    let imported = same(&ended(file, &x, LEN)).with_context(|| format!("{front:?}, {:?}, {texts:?}", norm.text))?;
    Ok(imported.ops.join(" "))
}

/// Joins ops, of which some parts may be none.
fn joined(parts: &[&str]) -> String {
    parts.join(" ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The op of the offsets after a norm: an rmsnorm has no bias.
fn offset(name: &str, affine: &str) -> &'static str {
    if name == "rmsnorm" && affine == AFFINES[2] { "normalize" } else { "" }
}

#[test]
fn activations_after_norms_are_one_op() -> Result<()> {
    let activations = parts(include_str!("cases/activations.txt"), "in their parts");
    assert_eq!(activations.len(), 10);
    for norm in norms() {
        for affine in AFFINES {
            for activation in &activations {
                let found = found(&[1, 12], "gemm(obs, 12, 12)", &norm, LEN, &[affine, &activation.text])?;
                let offset = offset(norm.ops(), affine);
                let expected = joined(&["linear", norm.ops(), offset, activation.ops(), "linear"]);
                assert_eq!(found, expected, "{} {affine} {}", norm.text, activation.text);
            }
        }
    }
    Ok(())
}

#[test]
fn norms_after_any_values_are_one_op() -> Result<()> {
    let fronts = parts(include_str!("cases/norms.txt"), "before a norm");
    assert_eq!((fronts.len(), norms().len()), (15, 6));
    for front in fronts {
        for norm in norms() {
            let found = found(&[1, 12], &front.text, &norm, LEN, &[AFFINES[2], "Tanh(x)"])?;
            let offset = offset(norm.ops(), AFFINES[2]);
            let expected = joined(&[front.ops(), norm.ops(), offset, "tanh linear"]);
            assert_eq!(found, expected, "{} {}", front.text, norm.text);
        }
    }
    Ok(())
}

#[test]
fn constants_in_vectors_hide_no_norm() -> Result<()> {
    let masked = "obs * [0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0]";
    let beside_constants = "first, second := Split(Tanh(gemm(obs, 12, 12)), [6, 6], axis=1)
                            Concat(drawn(1, 6), second, axis=1)";
    for norm in norms() {
        let after = [AFFINES[2], "Tanh(x)"];
        // Zeros do not count in a mean of squares, but they do in a mean.
        let is_rms = norm.ops() == "rmsnorm";
        let expected = if is_rms { "rmsnorm normalize" } else { "linear layernorm" };
        let ops = found(&[1, 12], masked, &norm, LEN, &after)?;
        assert_eq!(ops, format!("{expected} tanh linear"), "masked, {}", norm.text);
        let expected = if is_rms { "rmsnorm normalize" } else { "layernorm" };
        let ops = found(&[1, 12], beside_constants, &norm, LEN, &after)?;
        assert_eq!(ops, format!("linear tanh linear {expected} tanh linear"), "beside constants, {}", norm.text);
    }
    Ok(())
}

#[test]
fn norms_of_rows_are_found_by_row() -> Result<()> {
    let whole = "Reshape(x, [1, 12])";
    for norm in norms() {
        let (name, rows) = (norm.ops(), format!("{0} {0} {0}", norm.ops()));
        // Of a layer's values, and of groups of them.
        let ops = found(&[1, 11], "gemm(obs, 12, 11)", &norm, LEN, &[])?;
        assert_eq!(ops, format!("linear {name} linear"), "{}", norm.text);
        let ops = found(&[1, 11], "Reshape(gemm(obs, 12, 11), [1, 3, 4])", &norm, 4, &[whole])?;
        assert_eq!(ops, format!("linear {rows} linear"), "{}", norm.text);
        // After a factor for each value, as in SimbaV2's L2 norms.
        let ops = found(&[1, 12], "obs * drawn(12)", &norm, LEN, &[])?;
        assert_eq!(ops, format!("normalize {name} linear"), "{}", norm.text);
        // Of the steps of a history.
        assert_eq!(found(&[1, 3, 4], "obs", &norm, 4, &[whole])?, format!("{rows} linear"), "{}", norm.text);
    }
    Ok(())
}
