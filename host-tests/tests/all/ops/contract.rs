//! The action contract, against its meaning in f64: every part on its own, all of them, and chunks.

use actq::policy::Policy;
use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::reference::{Case, wide};
use super::{bound, deviation, on_head, recurrent, rtn};

/// Applies the contract (policy.json's `action`, or its default) to raw output `y`, and returns the limits that acted.
fn contract(action: &Value, raw: &[f64], last: Option<&[f64]>, met: &mut [usize; 3]) -> Vec<f64> {
    // The format's constants are f32.
    let at = |name: &str, i: usize| action[name][i].as_f64().map(|v| f64::from(v as f32));
    let mut limit = |which: usize, value: f64, limited: f64| {
        met[which] += usize::from(value != limited);
        limited
    };
    raw.iter()
        .enumerate()
        .map(|(i, &y)| {
            let wide = |name: &str| action[name][i].as_f64();
            let y = match (wide("mean"), wide("std"), wide("q01"), wide("q99")) {
                (Some(mean), Some(std), _, _) => y * std + mean,
                // As in RLDS and OpenVLA.
                (_, _, Some(q01), Some(q99)) => 0.5 * (y + 1.0) * (q99 - q01 + 1e-8) + q01,
                _ => y,
            };
            let a = y * at("scale", i).unwrap_or(1.0) + at("offset", i).unwrap_or(0.0);
            let a = limit(0, a, a.max(at("low", i).unwrap_or(f64::MIN)));
            let a = limit(1, a, a.min(at("high", i).unwrap_or(f64::MAX)));
            match (last, at("max_step", i)) {
                (Some(last), Some(step)) => limit(2, a, a.clamp(last[i] - step, last[i] + step)),
                _ => a,
            }
        })
        .collect()
}

/// Plays the policy through its contract, `execute` actions of each chunk, and counts how often low, high and max_step
/// acted.
fn check_actions(mut json: Value, action: &Value) -> Result<[usize; 3]> {
    let act = 2;
    let chunk = json["chunk"].as_u64().unwrap_or(1) as usize;
    let execute = json["execute"].as_u64().map_or(chunk, |n| n as usize);
    let out = chunk * act;
    json["name"] = json!("test");
    json["obs_dim"] = json!(6);
    json["act_dim"] = json!(act);
    json["ops"] = json!([
        recurrent("lstm", 32, 6, 8, "h"),
        {"op": "linear", "w": format!("w {out}x8"), "b": format!("b {out}")},
    ]);
    let case = Case::new(json)?;
    let policy = Policy::load(case.dir.path())?;
    let outcomes = rtn(&policy, 0)?;
    let mut reference = case.dequantized(&policy, &outcomes);
    let mut met = [0; 3];
    let (mut plan, mut played, mut last) = (Vec::new(), 0, None::<Vec<f64>>);
    let expected = |obs: &[f64], reset: bool| {
        if reset {
            reference.state.clear();
            (played, last) = (0, None);
        }
        if played == 0 {
            plan = reference.step(obs);
        }
        let raw = &plan[played * act..][..act];
        let a = contract(action, raw, last.as_deref(), &mut met);
        played = (played + 1) % execute;
        last = Some(a.clone());
        a
    };
    let off = on_head(&policy, &outcomes, |head| {
        let run = |obs: &[f32], reset: bool| {
            if reset {
                head.reset();
            }
            Ok(wide(head.step(obs)?))
        };
        deviation(&case.observations(), run, expected)
    })?;
    let limit = bound(&policy, &outcomes);
    ensure!(off < limit, "the error of the actions is {off:.2e}, limit {limit:.2e}");
    Ok(met)
}

#[test]
fn chunks_go_through_the_whole_contract() -> Result<()> {
    let action = json!({
        "scale": [1.7, -0.6], "offset": [0.1, 0.2], "low": [-0.8, -0.3], "high": [0.9, 0.35], "max_step": [0.5, 0.2],
    });
    // 3 executed of 4; the reset (step 25) falls inside a chunk.
    let met = check_actions(json!({"kind": "chunk", "chunk": 4, "execute": 3, "action": action}), &action)?;
    ensure!(met.iter().all(|&n| n > 2), "some limits did not act: {met:?}");
    Ok(())
}

#[test]
fn outputs_are_unnormalised_by_moments_or_quantiles() -> Result<()> {
    for action in [
        json!({"mean": [0.3, -0.2], "std": [0.5, 1.5]}),
        json!({"mean": [0.3, null], "std": [0.5, null], "scale": [2.0, -1.0], "offset": [0.1, 0.2]}),
        json!({"q01": [-0.4, 0.1], "q99": [0.9, 1.1], "low": [-0.3, 0.2], "high": [0.8, 1.0]}),
        json!({"q01": [null, 0.1], "q99": [null, 1.1], "scale": [0.5, 3.0]}),
    ] {
        check_actions(json!({"action": action}), &action).with_context(|| action.to_string())?;
    }
    Ok(())
}

#[test]
fn each_part_of_the_contract_works_alone() -> Result<()> {
    for (name, values) in [
        ("scale", [0.5, -3.0]),
        ("offset", [1.0, -2.0]),
        ("low", [-0.1, 0.1]),
        ("high", [0.1, -0.1]),
        ("max_step", [0.1, 0.0]),
    ] {
        let action = json!({name: values});
        let met = check_actions(json!({"action": action}), &action).context(name)?;
        let limits = usize::from(!matches!(name, "scale" | "offset"));
        ensure!(met.iter().filter(|&&n| n > 2).count() == limits, "{name}: limits met {met:?}");
    }
    Ok(())
}

#[test]
fn the_default_contract_limits_only_chunks() -> Result<()> {
    let one = json!({"low": [-1, -1], "high": [1, 1]});
    // Long chunks, so that enough of their values are beyond 1.
    let met = check_actions(json!({"kind": "chunk", "chunk": 20}), &one)?;
    ensure!(met[0] + met[1] > 2, "the limits did not act: {met:?}");
    check_actions(json!({"kind": "step"}), &Value::Null)?;
    Ok(())
}
