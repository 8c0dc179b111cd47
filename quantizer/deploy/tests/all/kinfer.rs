//! K-Scale's bundles. The published one runs where `ACTQ_SHARED` names the folder of the bundles.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::description::{Numbers, TargetKind};
use actq_deploy::{Answers, Bundle, read};

use crate::common::made::{Files, agrees, asked, message, refused, shared};
use crate::common::onnx;

const NAME: &str = "kinfer_zbot_walking";

#[test]
fn kinfer_agrees_with_its_deploy_code() -> Result<()> {
    agrees(NAME, "expect.npz", "")
}

/// The clock as a raw input gives the same.
#[test]
fn clock_may_be_a_raw_input() -> Result<()> {
    agrees(NAME, "expect.npz", "clock = \"raw\"\n")
}

#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    let Some(folder) = shared(NAME) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, false, Answers::default())?;
    let asked = asked(&reading);
    for key in [
        "clock",
        "default_pose",
        "dof_pos.relative",
        "gravity",
        "states.prev_actions",
        "states.buffer",
        "states.start",
        "target.output",
        "target.relative",
        "gains.places",
    ] {
        ensure!(asked.contains(&key), "{key} is not among {asked:?}");
    }
    let accepted = read(&bundle, true, Answers::default())?;
    ensure!(accepted.unread.is_empty(), "{:?}", accepted.unread);
    let (default, joints) = (&accepted.sources["default"], &accepted.description.joints["robot"]);
    ensure!(default.contains("keyframe") && default.contains("default_standing differs"), "{default}");
    ensure!(joints.first().is_some_and(|joint| joint == "L_Hip_Roll") && joints.len() == 10, "{joints:?}");
    let gains = accepted.description.gains.as_ref().context("gains")?;
    ensure!(gains.stiffness == [18.18; 10] && gains.damping == [1.46; 10], "{gains:?}");
    ensure!(accepted.description.targets[0].kind == TargetKind::Position, "{:?}", accepted.description.targets);
    Ok(())
}

const XML: &str = r#"<mujoco><worldbody><body><freejoint name="root"/>
  <body><joint name="a"/><body><joint name="b" type="slide"/></body></body><body><joint name="c"/></body>
</body></worldbody>
<keyframe><key name="default" qpos="0 0 0 1 0 0 0 0.1 0.2 0.3"/></keyframe></mujoco>"#;

/// Metadata of a robot with 3 joints, with a part replaced.
pub(crate) fn json(from: &str, to: &str) -> String {
    let text = r#"{"input_params": {"t": {}, "dof_pos": {}, "prev_actions": {}, "buffer": {}}, "sim_dt":0.005, "sim_decimation": 4,
        "num_actions": 3, "num_observations": 12, "robot_stiffness": {"c": 3, "b": 2, "a": 1}, "robot_damping": [4, 5, 6]}"#;
    assert!(text.contains(from), "{from}");
    if from.is_empty() { text.to_owned() } else { text.replace(from, to) }
}

pub(crate) fn files(xml: &str, json: &str) -> Files {
    let inputs = [("t.1", 1), ("dof_pos.1", 3), ("prev_actions.1", 3), ("buffer.1", 12)];
    let outputs = [("actions_raw", 3), ("actions", 3), ("x.5", 12)];
    let network = onnx::graph(&[], &[], &inputs, &outputs, &[("kinfer_metadata", json)]);
    let files = Files::default().with_file("policy.kinfer", network);
    if xml.is_empty() { files } else { files.with_file("robot.xml", xml) }
}

#[test]
fn other_robots_are_read_by_their_own_files() -> Result<()> {
    let reading = files(XML, &json("", "").replace("0.005", "0.0025")).reading(true, "")?;
    let description = &reading.description;
    ensure!(reading.questions.is_empty(), "{:?}", reading.questions);
    ensure!(description.rate_hz == 100.0, "{}", description.rate_hz);
    ensure!(description.joints["robot"] == ["a", "b", "c"], "{:?}", description.joints);
    ensure!(description.constants["default"] == [0.1, 0.2, 0.3], "{:?}", description.constants);
    let states = &description.networks[0].states;
    ensure!(states["buffer.1"] == "x.5" && states["prev_actions.1"] == "actions_raw", "{states:?}");
    ensure!(description.action == "policy.actions_raw", "{}", description.action);
    let gains = description.gains.as_ref().context("gains")?;
    ensure!(gains.stiffness == [1.0, 2.0, 3.0] && gains.damping == [4.0, 5.0, 6.0], "{gains:?}");
    Ok(())
}

#[test]
fn ranges_of_joints_limit_the_targets() -> Result<()> {
    let limits = |xml: &str, answers: &str| -> Result<Option<[Numbers; 2]>> {
        let reading = files(xml, &json("", "")).reading(true, answers)?;
        ensure!(reading.questions.is_empty(), "{:?}", reading.questions);
        Ok(reading.description.targets[0].limits.clone())
    };
    let ranged = XML
        .replace(r#"name="a""#, r#"name="a" range="-90 180""#)
        .replace(r#"name="b""#, r#"name="b" range="-2 3""#)
        .replace(r#"name="c""#, r#"name="c" range="-1 1" limited="false""#);
    let pi = std::f64::consts::PI;
    let most = f64::from(f32::MAX);
    let degrees = [vec![-pi / 2.0, -2.0, -most], vec![pi, 3.0, most]].map(Numbers::Each);
    ensure!(limits(&ranged, "")? == Some(degrees), "degrees");
    let radians = ranged.replace("<mujoco>", r#"<mujoco><compiler angle="radian"/>"#);
    let expected = [vec![-90.0, -2.0, -most], vec![180.0, 3.0, most]].map(Numbers::Each);
    ensure!(limits(&radians, "")? == Some(expected), "radians");
    ensure!(limits(&ranged, "target.limits = \"none\"")?.is_none() && limits(XML, "")?.is_none(), "no limits");
    refused("a range", files(&ranged.replace("-2 3", "3 -2"), &json("", "")).reading(true, ""), "the lowest first")
}

#[test]
fn missing_files_become_questions() -> Result<()> {
    let files = files("", &json("", ""));
    assert_eq!(files.asked(true, "")?, ["joints.names", "default_pose"]);
    let answers = "joints.names = [\"a\", \"b\", \"c\"]\ndefault_pose = [1, 2, 3]\n";
    let reading = files.reading(true, answers)?;
    ensure!(reading.questions.is_empty(), "{:?}", reading.questions);
    ensure!(reading.description.constants["default"] == [1.0, 2.0, 3.0], "{:?}", reading.description.constants);
    Ok(())
}

#[test]
fn bad_bundles_are_refused() -> Result<()> {
    let dtd = format!("<!DOCTYPE mujoco [<!ENTITY a \"b\">]>{XML}");
    let cases = [
        ("two joint counts", XML.replace(r#"<joint name="c"/>"#, ""), json("", ""), "2 joints"),
        ("a keyframe of another length", XML.replace("0.2 0.3", "0.2"), json("", ""), "length of qpos"),
        ("a number that is not one", XML.replace("0.2 0.3", "0.2 nan"), json("", ""), "finite"),
        ("a document type", dtd, json("", ""), "not XML"),
        ("another element", "<mujoco_of/><!-- <mujoco -->".to_owned(), json("", ""), "robot.xml"),
        ("an include", XML.replace("<worldbody>", "<include file='a'/><worldbody>"), json("", ""), "include"),
        ("a joint without a name", XML.replace(r#"name="b""#, ""), json("", ""), "has no name"),
        ("a ball joint", XML.replace("slide", "ball"), json("", ""), "not supported"),
        ("no decimation", XML.to_owned(), json("sim_decimation", "other"), "sim_decimation is missing"),
        ("no time step", XML.to_owned(), json("0.005", "0"), "sim_dt"),
        ("NaN", XML.to_owned(), json("0.005", "NaN"), "finite number"),
        ("another number of actions", XML.to_owned(), json("\"num_actions\": 3", "\"num_actions\": 4"), "contradicts"),
        ("another buffer", XML.to_owned(), json("12", "13"), "contradicts"),
        ("other inputs", XML.to_owned(), json("\"t\": {}, ", ""), "contradicts"),
        (
            "another order",
            XML.to_owned(),
            json("{\"input", "{\"joint_names\": [\"a\", \"c\", \"b\"], \"input"),
            "joint 1 is",
        ),
        ("no JSON", XML.to_owned(), "{".to_owned(), "kinfer_metadata"),
        ("a number", XML.to_owned(), "3".to_owned(), "JSON object"),
    ];
    for (name, xml, json, expected) in cases {
        refused(name, files(&xml, &json).reading(true, ""), expected)?;
    }
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(2000), "</body>".repeat(2000));
    let error = message(files(&deep, &json("", "")).reading(true, ""));
    ensure!(error.contains("levels") || error.contains("not XML"), "{error}");
    let tar = Files::default().with_file("policy.kinfer", b"\x1f\x8b\x08 a tar file");
    refused("a tar file", tar.reading(true, ""), "policy.kinfer")
}

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
    assert_eq!(files.asked(true, "")?, ["packed.rate_hz", "packed.target"]);
    let answers = "packed.rate_hz = 50\npacked.target = \"torque\"\n";
    let mut carry = [1.0, -2.0];
    for (tick, (_, target)) in
        files.run(answers, 5, |_, len, tick| vec![0.1 * tick as f64; len])?.into_iter().enumerate()
    {
        let sum = carry.map(|value| value + 0.1 * tick as f64);
        let action = [0, 1].map(|j| 0.25 + 0.01 * (sum[0] * (1 + j) as f64 + sum[1] * (3 + j) as f64));
        let near = target.iter().zip(action).all(|(own, action)| (own - action).abs() < 1e-6);
        ensure!(near && target.len() == 2, "tick {tick}: {target:?}, not {action:?}");
        carry = sum.map(|value| 0.5 * value);
    }
    let target = &files.reading(true, answers)?.description.targets[0];
    ensure!(target.kind == TargetKind::Torque && target.joints.as_deref() == Some("robot"), "{target:?}");
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
