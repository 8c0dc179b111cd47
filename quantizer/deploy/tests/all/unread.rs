//! Keys that no reader knows, and bundles that are nearly of a family.

use std::fs;

use actq::error::{Context as _, Result, ensure};

use crate::common::isaaclab::{DESCRIPTORS, LEN};
use crate::common::made::{Files, message, shared};
use crate::common::{leapp, lerobot, onnx};
use crate::{humanoidverse, kinfer, rl_sar};

/// A published bundle's files of these names.
fn published(name: &str, files: &[&str]) -> Result<Option<Files>> {
    let Some(folder) = shared(name) else { return Ok(None) };
    let read = |made: Files, file: &&str| Ok(made.with_file(file, fs::read(folder.join("bundle").join(file))?));
    files.iter().try_fold(Files::default(), read).map(Some)
}

/// A key that nothing reads is a question, which names its value, until the user says that it is unused.
fn asks(family: &str, files: &Files, answers: &str) -> Result<()> {
    let reading = files.reading(true, answers)?;
    let question = reading.questions.iter().find(|question| question.key.ends_with("new_key"));
    let question = question.with_context(|| format!("{family}: {:?}", reading.questions))?;
    ensure!(reading.family == family && question.meaning.contains("new_key = 7"), "{family}: {}", question.meaning);
    let reading = files.reading(true, &format!("{answers}\n{} = \"unused\"\n", question.key))?;
    let open = reading.questions.iter().any(|question| question.key.ends_with("new_key"));
    ensure!(!open, "{family}: {:?}", reading.questions);
    let error = message(files.reading(true, &format!("{answers}\n{} = \"used\"\n", question.key)));
    ensure!(error.contains("give \"unused\""), "{family}: {error}");
    Ok(())
}

#[test]
fn unknown_keys_of_each_family_are_questions() -> Result<()> {
    let base = |metadata: &[(&str, &str)], outputs| onnx::linear(LEN, outputs, metadata);
    let isaaclab = Files::default()
        .with_file("IO_descriptors.yaml", DESCRIPTORS.replacen("clip: [-1.0, 1.0]", "new_key: 7, clip: [-1.0, 1.0]", 1))
        .with_file("policy.onnx", base(&[], 4));
    asks("isaaclab", &isaaclab, "")?;
    let mjlab = [
        ("joint_names", "a,b"),
        ("default_joint_pos", "0,0"),
        ("action_scale", "1"),
        ("observation_names", "joint_pos"),
        ("observation_new_key", "7"),
    ];
    let mjlab = Files::default().with_file("policy.onnx", onnx::linear(2, 2, &mjlab));
    asks("mjlab", &mjlab, "rate_hz = 50")?;
    let holosoma = [("dof_names", "[a, b]"), ("kp", "[1, 1]"), ("kd", "[1, 1]"), ("observation_new_key", "7")];
    asks("holosoma", &Files::default().with_file("policy.onnx", onnx::linear(19, 2, &holosoma)), "")?;
    asks("kinfer", &kinfer::files("", &kinfer::json("\"sim_dt\"", "\"new_key\": 7, \"sim_dt\"")), "")?;
    let yaml = format!("{}{}new_key: 7\n", humanoidverse::ROBOT, humanoidverse::FALCON);
    asks("humanoidverse", &humanoidverse::files(&yaml, &[("policy.onnx", onnx::linear(14, 2, &[]))]), "")?;
    asks("rl_sar", &rl_sar::robot(63).with("  rl_kp:", "  new_key: 7\n  rl_kp:"), "")?;
    asks("leapp", &leapp::walker().with("pipeline:\n", "pipeline:\n  new_key: 7\n"), "")?;
    let lerobot = lerobot::files().with_in("json", r#""norm_map": {"#, r#""new_key": 7, "norm_map": {"#);
    asks("lerobot", &lerobot, "")?;
    if let Some(files) = published("unitree_lab_g1_velocity", &["params/deploy.yaml", "exported/policy.onnx"])? {
        asks("unitree_rl_lab", &files.with("step_dt:", "new_key: 7\nstep_dt:"), "")?;
    }
    let (folder, encoder) = ("PF_TRON1A/policy/isaaclab", "PF_TRON1A/policy/isaaclab/encoder.onnx");
    let files = ["PF_TRON1A/params.yaml", encoder, &format!("{folder}/policy.onnx")];
    if let Some(files) = published("limx_tron1_pf_isaaclab", &files)? {
        asks("limx", &files.with("  loop_frequency:", "  new_key: 7\n  loop_frequency:"), "")?;
    }
    Ok(())
}

#[test]
fn files_of_a_later_version_are_questions() -> Result<()> {
    let later = leapp::walker().with("leapp config version: ", "leapp config version: '9.9' # ");
    assert_eq!(later.asked(true, "")?, ["version"]);
    assert!(later.asked(true, "version = \"holds\"")?.is_empty());
    Ok(())
}

#[test]
fn the_nearest_family_and_its_missing_key_are_named() -> Result<()> {
    let metadata = [("joint_names", "a"), ("default_joint_pos", "0"), ("action_scale", "1")];
    let mjlab = Files::default().with_file("p.onnx", onnx::linear(2, 2, &metadata));
    let yaml =
        Files::default().with_file("env.yaml", "decimation: 4\nscene: {}\nobservations: {}\nactions: {}\nsim: {}\n");
    let rl_sar = Files::default().with_file("a.yaml", "dog:\n  model_name: a\n  num_of_dofs: 2\n  clip_obs: 1\n");
    let none = Files::default().with_file("a.yaml", "robot: 1\n");
    for (files, expected) in [
        (
            mjlab,
            "nearest is mjlab: p.onnx metadata has joint_names, default_joint_pos, action_scale, and lacks observation_names",
        ),
        (yaml, "nearest is isaaclab: env.yaml has decimation, scene, observations, actions, and lacks sim.dt"),
        (rl_sar, "nearest is rl_sar: a.yaml has *.model_name, *.num_of_dofs, *.clip_obs, and lacks *.rl_kp"),
        (none, "no file has keys of one"),
    ] {
        let error = message(files.reading(true, ""));
        ensure!(error.contains("no known family") && error.contains(expected), "{expected}: {error}");
    }
    Ok(())
}
