//! Published bundles against the references of their deploy code. They run where `ACTQ_SHARED` names the folder of the
//! bundles.

use actq::error::{Result, ensure};
use actq_deploy::{Answers, Bundle, Plan, Reference, Variant, explain, read, variants};
use expect_test::expect_file;

use crate::common::made::{agrees, message, shared};

/// Bundles with their references and answers.
const PUBLISHED: [(&str, &str, &str); 8] = [
    ("unitree_lab_g1_velocity", "expect.npz", ""),
    ("limx_tron1_pf_isaaclab", "expect.npz", ""),
    ("holosoma_t1_fastsac", "expect.npz", include_str!("holosoma.toml")),
    ("falcon_g1", "expect.npz", "action_scale = 0.25\nrate_hz = 50\n"),
    ("kinfer_zbot_walking", "expect.npz", ""),
    // The clock as a raw input gives the same.
    ("kinfer_zbot_walking", "expect.npz", "clock = \"raw\"\n"),
    ("bitbots_walk_mjlab", "expect.npz", "joints.order = \"file\"\n"),
    ("bitbots_walk_mjlab", "expect_metadata_order.npz", "joints.order = \"metadata\"\n"),
];

#[test]
fn bundles_agree_with_their_deploy_code() -> Result<()> {
    PUBLISHED.iter().try_for_each(|(name, expect, answers)| agrees(name, expect, answers))
}

/// What each bundle asks without the values of the family's profile, and with them.
#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    let mut shown = String::new();
    for (name, expect, answers) in PUBLISHED {
        let Some(folder) = shared(name) else { return Ok(()) };
        let bundle = Bundle::open(&folder.join("bundle"))?;
        for (accepted, answers) in [(false, answers), (true, answers), (true, "")] {
            shown += &format!("## {name}, {expect}, accepted {accepted}, {} answers\n", answers.lines().count());
            match read(&bundle, accepted, Answers::parse(answers)?) {
                Ok(reading) => {
                    reading.questions.iter().for_each(|question| shown += &format!("question {}\n", question.key));
                    if accepted && expect == "expect.npz" && reading.questions.is_empty() {
                        shown += &reading.description.to_toml(&reading.sources)?;
                    }
                }
                error => shown += &format!("refused: {}\n", message(error)),
            }
        }
    }
    expect_file!["../cases/published.txt"].assert_eq(&shown);
    Ok(())
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
