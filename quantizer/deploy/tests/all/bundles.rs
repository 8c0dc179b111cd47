//! Published bundles against the references of their deploy code. They run where `ACTQ_SHARED` names the folder of the
//! bundles.

use actq::error::{Result, ensure};
use actq_deploy::{Answers, Bundle, Plan, Reference, Variant, explain, read, variants};

use crate::common::made::{agrees, shared};

#[test]
fn unitree_rl_lab_agrees_with_its_deploy_code() -> Result<()> {
    agrees("unitree_lab_g1_velocity", "expect.npz", "")
}

#[test]
fn limx_agrees_with_its_deploy_code() -> Result<()> {
    agrees("limx_tron1_pf_isaaclab", "expect.npz", "")
}

/// Every convention, changed alone, is detected, and changing it back explains the difference.
fn every_convention_is_explained(name: &str, without_effect: &[&str]) -> Result<()> {
    let Some(folder) = shared(name) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::default())?;
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join("expect.npz"))?;
    let mut found = 0;
    for Variant { convention, description, lacks } in variants(&reading.description) {
        let Ok(plan) = Plan::new(&description, &bundle) else { continue };
        let same = reference.compare(plan)?.first.is_none();
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
