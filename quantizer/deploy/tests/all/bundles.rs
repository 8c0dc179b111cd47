//! Published bundles against the references of their deploy code. They run where `ACTQ_SHARED` names the folder of the
//! bundles.

use std::fs;

use actq::error::{Context as _, Result, ensure};
use actq_deploy::description::{Op, Order};
use actq_deploy::{Answers, Bundle, Plan, Reference, Variant, explain, read, variants};

use crate::common::made::{Files, agrees, refused, shared};

#[test]
fn unitree_rl_lab_agrees_with_its_deploy_code() -> Result<()> {
    agrees("unitree_lab_g1_velocity", "expect.npz", "")
}

#[test]
fn limx_agrees_with_its_deploy_code() -> Result<()> {
    agrees("limx_tron1_pf_isaaclab", "expect.npz", "")
}

/// Upstream selects the joints that a term names, also in another order.
#[test]
fn terms_of_unitree_rl_lab_may_choose_joints() -> Result<()> {
    let Some(folder) = shared("unitree_lab_g1_velocity") else { return Ok(()) };
    let bundle = folder.join("bundle");
    let (yaml, policy) = ("params/deploy.yaml", "exported/policy.onnx");
    let files = Files::default()
        .with_file(yaml, fs::read(bundle.join(yaml))?)
        .with_file(policy, fs::read(bundle.join(policy))?);
    let with = |term: &str, joint_ids: &str| {
        let chosen = format!("{term}:\n    params: {{asset_cfg: {{joint_ids: {joint_ids}}}}}\n");
        files.with(&format!("{term}:\n    params: {{}}\n"), &chosen)
    };
    let plain = read(&Bundle::open(&bundle)?, true, Answers::default())?.description;
    let reversed: Vec<usize> = (0..29).rev().collect();
    for (term, at) in [("joint_pos_rel", 2), ("joint_vel_rel", 1)] {
        for all in ["null", "slice(None, None, None)", "[]"] {
            ensure!(with(term, all).reading(true, "")?.description == plain, "{term}: {all}");
        }
        let mut expected = plain.clone();
        let value = expected.values.iter_mut().find(|value| value.name == term).context("the term")?;
        value.ops.insert(at, Op::Select(Order::Places(reversed.clone())));
        ensure!(with(term, &format!("{reversed:?}")).reading(true, "")?.description == expected, "{term}");
        for wrong in ["[0, 29]", "[0, -1]", "[0.5]"] {
            refused(term, with(term, wrong).reading(true, ""), "must be numbers of joints below 29")?;
        }
    }
    Ok(())
}

#[test]
fn answers_to_a_described_bundle_are_refused() -> Result<()> {
    let files = Files::default().with_file("deploy.toml", "");
    refused(
        "an answer",
        files.reading(true, "rate_hz = 100"),
        "answers: nothing asks for rate_hz: deploy.toml describes",
    )
}

#[test]
fn a_missing_key_of_unitree_rl_lab_is_named() -> Result<()> {
    let yaml = "joint_ids_map: [0]\nactions: {}\nobservations: {}\n";
    let files = Files::default().with_file("params/deploy.yaml", yaml);
    refused("no step_dt", files.reading(true, ""), "deploy.yaml: step_dt: it looks like a file of unitree_rl_lab")
}

/// Every convention, changed alone, is detected, and changing it back explains the difference.
fn every_convention_is_explained(name: &str, without_effect: &[&str]) -> Result<()> {
    let Some(folder) = shared(name) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::default())?;
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join("expect.npz"))?;
    let mut found = 0;
    for Variant { convention, description, lacks } in variants(&reading.description) {
        if Plan::new(&description, &bundle).is_err() {
            continue;
        }
        let same = reference.compare(&description, &bundle)?.first.is_none();
        println!("{convention}: {}", if same { "the same" } else { "differs" });
        ensure!(
            same == without_effect.contains(&convention.as_str()),
            "{name}: {convention}: {}",
            if same { "no difference" } else { "a difference" }
        );
        if !same && !lacks {
            let reasons = explain(&description, &bundle, &reference)?;
            ensure!(!reasons.is_empty(), "{name}: nothing explains that {convention}");
        }
        found += usize::from(!same);
    }
    ensure!(found > 5, "{name}: only {found} conventions have an effect");
    Ok(())
}

#[test]
fn every_convention_of_unitree_rl_lab_is_explained() -> Result<()> {
    every_convention_is_explained("unitree_lab_g1_velocity", &[])
}

#[test]
fn every_convention_of_limx_is_explained() -> Result<()> {
    // Its observation and its action stay below the limit of 100, and the torque below that of the motors.
    let unreached = [
        r#""ordered" is not clipped"#,
        r#""clipped_frame" is not clipped"#,
        r#""lowest" is not scaled"#,
        r#""highest" is not scaled"#,
        r#""limited" is not clipped"#,
        r#""last_action" keeps "ordered""#,
    ];
    every_convention_is_explained("limx_tron1_pf_isaaclab", &unreached)
}
