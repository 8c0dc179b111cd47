//! Files that fixtures cannot write: archives of K-Scale, and a deep file.

use actq::error::{Result, ensure};
use actq_deploy::Runner;
use actq_deploy::description::TargetKind;

use crate::common::made::{Files, refused};
use crate::common::onnx;

#[test]
fn deep_robots_and_other_archives_are_refused() -> Result<()> {
    let network = onnx::graph(&[], &[], &[("t", 1)], &[("actions", 1)], &[("kinfer_metadata", JSON_OF_GRAPH)]);
    let files = Files::default().with_file("policy.kinfer", network);
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(2000), "</body>".repeat(2000));
    refused("2000 levels", files.with_file("robot.xml", deep).reading(true, ""), "robot.xml")?;
    let tar = Files::default().with_file("policy.kinfer", b"\x1f\x8b\x08 a tar file");
    refused("a tar file", tar.reading(true, ""), "policy.kinfer")
}

const JSON_OF_GRAPH: &str = r#"{"sim_dt": 0.005, "sim_decimation": 4, "num_actions": 1}"#;

/// An archive of kinfer 0.6 with these files.
fn packed(files: &[(&str, &[u8])]) -> Result<Files> {
    let mut archive = tar::Builder::new(flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast()));
    for (name, content) in files {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_cksum();
        archive.append_data(&mut header, name, *content)?;
    }
    Ok(Files::default().with_file("walk.kinfer", archive.into_inner()?.finish()?))
}

const JSON: &str = r#"{"joint_names": ["a", "b"], "command_names": ["x", "y", "turn"], "carry_size": [2]}"#;

fn step_and_init() -> [Vec<u8>; 2] {
    let step = onnx::shaped(
        &[
            ("Add", &["joint_angles", "carry"], &["sum"], &[]),
            ("MatMul", &["sum", "weight"], &["product"], &[]),
            ("Add", &["product", "quarter"], &["action"], &[]),
            ("Mul", &["sum", "half"], &["next"], &[]),
        ],
        &[("half", &[1], vec![0.5]), ("quarter", &[2], vec![0.25; 2]), ("weight", &[2, 2], onnx::weights(2, 2))],
        &[("joint_angles", &[2]), ("command", &[3]), ("carry", &[2])],
        &[("action", &[2]), ("next", &[2])],
        &[],
    );
    let init = onnx::shaped(
        &[("Identity", &["start"], &["first"], &[])],
        &[("start", &[2], vec![1.0, -2.0])],
        &[],
        &[("first", &[2])],
        &[],
    );
    [step, init]
}

#[test]
fn archives_carry_what_they_begin_with() -> Result<()> {
    let [step, init] = step_and_init();
    let files = packed(&[("init_fn.onnx", &init), ("step_fn.onnx", &step), ("metadata.json", JSON.as_bytes())])?;
    let asked: Vec<String> = files.reading(true, "")?.questions.into_iter().map(|question| question.key).collect();
    assert_eq!(asked, ["packed.rate_hz", "packed.target"]);
    let description = files.reading(true, "packed.rate_hz = 50\npacked.target = \"torque\"\n")?.description;
    let mut runner = Runner::new(files.plan(&description)?);
    let lens: Vec<usize> = runner.plan().inputs().iter().map(|(_, len)| *len).collect();
    let mut carry = [1.0, -2.0];
    for tick in 0..5 {
        let raw: Vec<Vec<f64>> = lens.iter().map(|len| vec![0.1 * tick as f64; *len]).collect();
        let target = runner.step(&raw)?.targets.remove(0).1;
        let sum = carry.map(|value| value + 0.1 * tick as f64);
        let action = [0, 1].map(|j| 0.25 + 0.01 * (sum[0] * (1 + j) as f64 + sum[1] * (3 + j) as f64));
        let near = target.iter().zip(action).all(|(own, action)| (own - action).abs() < 1e-6);
        ensure!(near && target.len() == 2, "tick {tick}: {target:?}, not {action:?}");
        carry = sum.map(|value| 0.5 * value);
    }
    let target = &description.targets[0];
    ensure!(target.kind == TargetKind::Torque && target.joints.as_deref() == Some("robot"), "{target:?}");
    Ok(())
}

#[test]
fn unknown_keys_of_archives_are_questions() -> Result<()> {
    let [step, init] = step_and_init();
    // Keys that only the graphs of older files compute.
    let json = JSON.replacen('{', r#"{"action_scale": 0.5, "clip_actions": 1.0, "frame_stack": 3, "#, 1);
    let files = packed(&[("init_fn.onnx", &init), ("step_fn.onnx", &step), ("metadata.json", json.as_bytes())])?;
    let asked: Vec<String> = files.reading(true, "")?.questions.into_iter().map(|question| question.key).collect();
    let unread = ["unread.action_scale", "unread.clip_actions", "unread.frame_stack"];
    assert_eq!(asked, [&["packed.rate_hz", "packed.target"][..], &unread].concat());
    Ok(())
}

#[test]
fn archives_without_memory_have_no_state() -> Result<()> {
    let [_, init] = step_and_init();
    let step = onnx::shaped(
        &[("MatMul", &["joint_angles", "weight"], &["action"], &[]), ("Identity", &["carry"], &["next"], &[])],
        &[("weight", &[2, 2], onnx::weights(2, 2))],
        &[("joint_angles", &[2]), ("carry", &[2])],
        &[("action", &[2]), ("next", &[2])],
        &[],
    );
    let files = packed(&[("init_fn.onnx", &init), ("step_fn.onnx", &step), ("metadata.json", JSON.as_bytes())])?;
    let description = files.reading(true, "packed.rate_hz = 50\npacked.target = \"position\"\n")?.description;
    assert!(description.states.is_empty());
    let target = Runner::new(files.plan(&description)?).step(&[vec![1.0, 2.0]])?.targets.remove(0).1;
    assert!(target.iter().zip([0.07, 0.10]).all(|(own, expected)| (own - expected).abs() < 1e-6), "{target:?}");
    Ok(())
}

#[test]
fn damaged_archives_are_refused() -> Result<()> {
    let [step, init] = step_and_init();
    let with =
        |json: &str| packed(&[("init_fn.onnx", &init), ("step_fn.onnx", &step), ("metadata.json", json.as_bytes())]);
    let whole = with(JSON)?.0["walk.kinfer"].clone();
    let cases = [
        ("no metadata", packed(&[("init_fn.onnx", &init), ("step_fn.onnx", &step)])?, "metadata.json is missing"),
        ("a folder", packed(&[("a/step_fn.onnx", &step)])?, "is not a file by itself"),
        ("another file", with(JSON)?.with_file("walk.kinfer", whole[..whole.len() / 2].to_vec()), "walk.kinfer"),
        ("another joint", with(&JSON.replace(r#""b""#, r#""b", "c""#))?, "number of joints"),
        ("another carry", with(&JSON.replace("[2]", "[3]"))?, "length of the input \"carry\""),
        ("a command less", with(&JSON.replace(r#", "turn""#, ""))?, "length of the input \"command\""),
    ];
    for (name, files, expected) in cases {
        refused(name, files.reading(true, ""), expected)?;
    }
    Ok(())
}
