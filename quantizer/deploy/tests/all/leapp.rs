//! LEAPP's exports against the arithmetic of its runtime, which this test writes out.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::description::{Description, Gains, Numbers, TargetKind};

use crate::common::leapp::{INITIAL, KD, KP, SMOOTH, YAML, initial, policy, reference, run, walker};
use crate::common::made::{Files, message, refused};

/// Returns the first tick that differs from the reference with these first values.
fn differs(ticks: &[Vec<f64>], last: f32, smooth: [f32; 4]) -> Option<String> {
    let reference = reference(vec![f64::from(last); 4], smooth.map(f64::from).to_vec(), ticks.len());
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    let tick = ticks.iter().zip(&reference).position(|(own, other)| !near(own, other))?;
    Some(format!("tick {tick}: {:?}, not {:?}", ticks[tick], reference[tick]))
}

/// The bundle without first values.
fn without_initial() -> Files {
    walker().with("  initial_values: walker_initial_values.safetensors\n", "")
}

#[test]
fn a_pipeline_agrees_with_its_runtime() -> Result<()> {
    let differs = differs(&run(&walker(), "")?, 0.0, SMOOTH);
    ensure!(differs.is_none(), "{differs:?}");
    Ok(())
}

#[test]
fn names_gains_and_states_are_described() -> Result<()> {
    let reading = walker().reading(false, "")?;
    ensure!(reading.questions.is_empty() && reading.unread.is_empty(), "{reading:#?}");
    let description = reading.description;
    let text = description.to_toml(&reading.sources)?;
    ensure!(Description::parse(&text)? == description, "deploy.toml does not keep the description: {text}");
    let inputs: Vec<_> = description.inputs.iter().map(|input| (&*input.name, input.joints.as_deref())).collect();
    let expected = [
        ("robot_joint_pos", Some("robot_joint_pos")),
        ("robot_joint_vel", Some("robot_joint_pos")),
        ("base_velocity", Some("base_velocity")),
    ];
    ensure!(inputs == expected, "{inputs:?}");
    ensure!(description.inputs[2].unit.as_deref() == Some("m/s"), "{:?}", description.inputs[2]);
    let [last, smooth] = &description.states[..] else { panic!("{:?}", description.states) };
    ensure!(last.next == "policy.last_action_out" && last.start == Numbers::All(0.0), "{last:?}");
    let start = Numbers::Each(SMOOTH.map(f64::from).to_vec());
    ensure!(smooth.next == "observe.smooth_out" && smooth.start == start, "{smooth:?}");
    let target = &description.targets[0];
    ensure!(target.kind == TargetKind::Position && target.value == "policy.joint_pos", "{target:?}");
    let order = target.joints.as_ref().context("an order")?;
    ensure!(description.joints[order] == ["FR_hip", "FR_knee", "FL_hip", "FL_knee"], "{:?}", description.joints);
    let gains = Gains {
        joints: Some(order.clone()),
        stiffness: KP.map(f64::from).to_vec(),
        damping: KD.map(f64::from).to_vec(),
    };
    ensure!(description.gains == Some(gains), "{:?}", description.gains);
    ensure!((description.rate_hz - 50.0).abs() < 1e-9, "{}", description.rate_hz);
    ensure!(
        reading.sources["robot_joint_pos"] == "walker/walker.yaml: models.observe.inputs.0 (state:robot:joint_pos)",
        "{:?}",
        reading.sources
    );
    Ok(())
}

#[test]
fn several_outputs_become_several_targets() -> Result<()> {
    let files = walker()
        .with(
            "    - name: last_action_out\n      dtype: float32\n",
            "    - name: last_action_out\n      dtype: float32\n      kind: target/joint/velocity\n",
        )
        .with("policy: [joint_pos, ", "policy: [last_action_out, joint_pos, ");
    let description = files.reading(true, "")?.description;
    let kinds: Vec<TargetKind> = description.targets.iter().map(|target| target.kind).collect();
    ensure!(kinds == [TargetKind::Velocity, TargetKind::Position], "{kinds:?}");
    ensure!(description.action == "action", "{}", description.action);
    let ticks = run(&files, "")?;
    ensure!(ticks.iter().all(|target| target.len() == 8), "{:?}", ticks[0]);
    let positions: Vec<Vec<f64>> = ticks.into_iter().map(|target| target[4..].to_vec()).collect();
    let differs = differs(&positions, 0.0, SMOOTH);
    ensure!(differs.is_none(), "{differs:?}");
    Ok(())
}

#[test]
fn schema_1_4_says_the_same() -> Result<()> {
    let joints = |names: &str| {
        (
            format!("element_names: [[{names}]]"),
            format!("axes: [{{kind: robot, names: [robot0]}}, {{kind: element, names: [{names}]}}]"),
        )
    };
    let mut text = YAML.to_owned();
    let orders =
        ["FL_hip, FR_hip, FL_knee, FR_knee", "FR_hip, FR_knee, FL_hip, FL_knee", "lin_vel_x, lin_vel_y, ang_vel_z"];
    let directions = ["state/", "target/", "command/"].map(|direction| (direction.to_owned(), String::new()));
    for (from, to) in orders.map(joints).into_iter().chain(directions) {
        ensure!(text.contains(&from), "{from}");
        text = text.replace(&from, &to);
    }
    let newer = walker().with_file("walker/walker.yaml", text).reading(false, "")?;
    let older = walker().reading(false, "")?;
    ensure!(newer.unread.is_empty(), "{:?}", newer.unread);
    ensure!(newer.description == older.description, "{:#?}", newer.description);
    Ok(())
}

#[test]
fn what_the_file_omits_is_asked() -> Result<()> {
    let files = without_initial().with("  configs:\n    frequency: 50\n", "");
    assert_eq!(files.asked(false, "")?, ["rate_hz", "state.start"]);
    assert_eq!(files.asked(true, "")?, ["rate_hz"]);
    let files = walker().with("kind: target/joint/position", "kind: target/body/position");
    assert_eq!(files.asked(true, "")?, ["target.joint_pos"]);
    let reading = files.reading(true, "target.joint_pos = \"velocity\"")?;
    ensure!(reading.description.targets[0].kind == TargetKind::Velocity, "{:?}", reading.description.targets);
    for (answer, expected) in [
        ("target.joint_pos = \"none\"", "no output is a target of joints"),
        ("target.joint_pos = \"pose\"", "answer target.joint_pos = \"pose\": give \"position\""),
    ] {
        refused(answer, files.reading(true, answer), expected)?;
    }
    Ok(())
}

#[test]
fn each_convention_changes_the_result() -> Result<()> {
    let files = without_initial();
    let zero = differs(&run(&files, "")?, 0.0, [0.0; 4]);
    ensure!(zero.is_none(), "the profile's start: {zero:?}");
    let one = run(&files, "state.start = 1.0")?;
    ensure!(differs(&one, 1.0, [1.0; 4]).is_none(), "an answer for the start");
    ensure!(differs(&one, 0.0, [0.0; 4]).is_some(), "the start changes nothing");
    // The values of the file, and those of the profile.
    ensure!(differs(&run(&walker(), "")?, 0.0, [0.0; 4]).is_some(), "first values change nothing");
    let partial = walker().with_file(INITIAL, initial(&[("observe/smooth_in", SMOOTH)]));
    let partial = differs(&run(&partial, "state.start = 0.5")?, 0.5, SMOOTH);
    ensure!(partial.is_none(), "first values of one input: {partial:?}");
    // Another connection.
    let crossed = walker()
        .with("observe/smooth_out: [observe/smooth_in]", "observe/smooth_out: [observe/last_action_in]")
        .with("policy/last_action_out: [observe/last_action_in]", "policy/last_action_out: [observe/smooth_in]");
    ensure!(differs(&run(&crossed, "")?, 0.0, SMOOTH).is_some(), "the feedback changes nothing");
    let crossed = walker()
        .with("observe/last: [policy/last]", "observe/last: [policy/position]")
        .with("observe/position: [policy/position]", "observe/position: [policy/last]");
    ensure!(differs(&run(&crossed, "")?, 0.0, SMOOTH).is_some(), "the flow changes nothing");
    Ok(())
}

#[test]
fn equal_names_get_their_models_as_prefix() -> Result<()> {
    // The policy's last input gets the name of an input of the other model; LEAPP's runtime finds ports by their places.
    let files = walker()
        .with(
            "    - name: base_velocity\n      dtype: float32\n      shape: [1, 3]",
            "    - name: robot_joint_vel\n      dtype: float32\n      shape: [1, 3]",
        )
        .with("policy: [base_velocity]", "policy: [robot_joint_vel]");
    let names: Vec<String> = files.reading(true, "")?.description.inputs.into_iter().map(|input| input.name).collect();
    ensure!(names == ["robot_joint_pos", "observe_robot_joint_vel", "policy_robot_joint_vel"], "{names:?}");
    Ok(())
}

#[test]
fn damaged_files_are_refused() -> Result<()> {
    let cases = [
        (
            "model_path: policy.onnx\n      md5sum: 0",
            "model_path: ../policy.onnx\n      md5sum: 0",
            "is not a file of the bundle",
        ),
        ("model_path: observe.onnx", "model_path: other.onnx", "there is no \"walker/other.onnx\" in the bundle"),
        ("sha256sum: HASH walker/policy.onnx", "sha256sum: 0123", "the file has changed since its export"),
        ("frequency: 50", "frequency: .nan", "pipeline.configs.frequency (line"),
        ("frequency: 50", "frequency: 0", "must be a number above 0"),
        (
            "    - name: smooth_in\n      dtype: float32",
            "    - name: smooth_in\n      dtype: int64",
            "models.observe.inputs.3.dtype = \"int64\"",
        ),
        ("    - name: smooth_in\n", "    - name: \"a\\e\"\n", "\"a\\\\u{1b}\" is not a name"),
        ("    - name: smooth_in\n", "    - name: last_action_in\n", "\"last_action_in\" occurs twice"),
        ("    - name: smooth_in\n", "    - title: smooth_in\n", "models.observe.inputs.3.name is missing"),
        ("shape: [1, 3]", "shape: [1, 0]", "models.policy.inputs.3.shape (line"),
        ("shape: [1, 3]", "shape: [90000, 3]", "more than 65535 values"),
        ("[[lin_vel_x, lin_vel_y, ang_vel_z]]", "[[lin_vel_x, lin_vel_x, ang_vel_z]]", "\"lin_vel_x\" occurs twice"),
        ("[[lin_vel_x, lin_vel_y, ang_vel_z]]", "[[a, b, c], [1, [2]]]", "must be lists of names"),
        (
            "policy: [base_velocity]",
            "policy: [speed]",
            "there is no port \"policy/speed\"; there are observe/robot_joint_pos",
        ),
        ("observe/last: [policy/last]", "observe/first: [policy/last]", "there is no port \"observe/first\""),
        ("observe/last: [policy/last]", "observe: [policy/last]", "there is no port \"observe\""),
        ("observe/last: [policy/last]", "observe/last: 3", "must be a list of texts"),
        ("policy: [base_velocity]", "policy: []", "models.policy.inputs.3: nothing gives this input"),
        (
            "policy: [joint_pos, joint_pos_kp_gains, joint_pos_kd_gains]",
            "policy: []",
            "no output is a target of joints",
        ),
        ("initial_values: walker_initial", "initial_values: ../../initial", "is not a file of the bundle"),
        ("initial_values: walker_initial", "initial_values: other", "walker/other_values.safetensors"),
        ("pipeline:\n  configs", "models: {}\npipeline:\n  configs", "key \"models\" occurs twice"),
    ];
    for (from, to, expected) in cases {
        refused(to, walker().with(from, to).reading(true, ""), expected)?;
    }
    let elsewhere = initial(&[("policy/last", SMOOTH)]);
    for (file, bytes, expected) in [
        (INITIAL, initial(&[("observe/smooth_in", [f32::NAN; 4])]), "value 0 (from 0) is NaN"),
        (INITIAL, elsewhere, "\"policy/last\" is not an input that pipeline.feedback_flow names"),
        (INITIAL, b"{}".to_vec(), "not a .safetensors file"),
        ("walker/policy.onnx", b"onnx".to_vec(), "walker/policy.onnx"),
        ("walker/policy.onnx", policy("smooth"), "the policy computes this gain"),
    ] {
        refused(expected, walker().with_file(file, bytes).reading(true, ""), expected)?;
    }
    Ok(())
}

#[test]
fn contradictions_name_both_sources() -> Result<()> {
    let cases = [
        ("shape: [1, 3]", "shape: [1, 5]", "length of an axis", "models.policy.inputs.3.element_names"),
        (
            "- name: smooth_in\n      dtype: float32\n      shape: [1, 4]",
            "- name: smooth_in\n      dtype: float32\n      shape: [1, 3]",
            "length of \"smooth_in\"",
            "walker/observe.onnx",
        ),
        (
            "- name: smooth\n      dtype: float32\n      shape: [1, 4]",
            "- name: smooth\n      dtype: float32\n      shape: [4]",
            "shape of \"smooth\"",
            "models.observe.outputs.2",
        ),
        (
            "    - name: smooth_in\n",
            "    - name: robot_joint_pos2\n    - name: smooth_in\n",
            "number of inputs",
            "walker/observe.onnx",
        ),
        (
            "observe/last: [policy/last]",
            "observe/last: [policy/last, policy/smooth]",
            "source of \"smooth\"",
            "pipeline.data_flow.observe/smooth_out",
        ),
        ("policy: [base_velocity]", "policy: [base_velocity, last]", "source of \"last\"", "pipeline.inputs.policy"),
        (
            "kind: kd\n      element_names: [[FR_hip, FR_knee, ",
            "kind: kd\n      element_names: [[FR_knee, FR_hip, ",
            "joints of the gains",
            "models.policy.outputs.2",
        ),
    ];
    for (from, to, what, other) in cases {
        let to = to.replace("robot_joint_pos2\n", "robot_joint_pos2\n      dtype: float32\n      shape: [1, 4]\n");
        let error = message(walker().with(from, &to).reading(true, ""));
        ensure!(error.contains(what) && error.contains("contradicts itself") && error.contains(other), "{to}: {error}");
    }
    let swapped = walker()
        .with(
            "    - name: last\n      dtype: float32\n      shape: [1, 4]\n      type: tensor\n    - name: base",
            "    - name: position\n      dtype: float32\n      shape: [1, 4]\n      type: tensor\n    - name: base",
        )
        .with("    inputs:\n    - name: position\n", "    inputs:\n    - name: last\n");
    let error = message(swapped.reading(true, ""));
    ensure!(error.contains("order of inputs") && error.contains("walker/policy.onnx"), "{error}");
    let mut shape = initial(&[("observe/smooth_in", SMOOTH)]);
    let at = shape.windows(5).position(|text| text == b"[1,4]").context("a shape")?;
    shape[at..at + 5].copy_from_slice(b"[4,1]");
    let error = message(walker().with_file(INITIAL, shape).reading(true, ""));
    ensure!(error.contains("shape of \"smooth_in\"") && error.contains("safetensors: observe/smooth_in"), "{error}");
    Ok(())
}

#[test]
fn what_an_image_cannot_do_is_refused() -> Result<()> {
    let (backend, jit) = ("backend: onnx\n      model_path: policy.onnx", "backend: jit\n      model_path: policy.pt");
    let names = "kind: target/joint/position\n      element_names: [[FR_hip, FR_knee, FL_hip, FL_knee]]";
    let cases = [
        (backend, jit, "models.policy.parameters.backend = \"jit\": an image is made of ONNX files only"),
        (backend, jit, "export_with=\"onnx\""),
        (backend, "backend: null\n      model_path: policy.onnx", "models.policy.parameters.backend is missing"),
        (
            names,
            "kind: target/joint/position\n      element_names: [__temporal_axis__, [a, b, c, d]]\n      temporal_period_ms: 20",
            "it gives values of several times",
        ),
        (
            names,
            "kind: target/joint/position\n      axes: [{kind: time, period_ms: 20}, {kind: element, names: [a, b, c, d]}]",
            "it gives values of several times",
        ),
    ];
    for (from, to, expected) in cases {
        refused(to, walker().with(from, to).reading(true, ""), expected)?;
    }
    // The order of the models says which tick a value is of.
    for (flow, to, expected, section) in [
        (
            "policy/last_action_out: [observe/last_action_in]",
            "  data_flow:",
            "runs before the model that gives its value",
            "pipeline.feedback_flow",
        ),
        (
            "observe/last: [policy/last]",
            "  feedback_flow:",
            "runs after the model that gives its value",
            "pipeline.data_flow",
        ),
    ] {
        let moved = walker().with(&format!("    {flow}\n"), "").with(to, &format!("{to}\n    {flow}"));
        let error = message(moved.reading(true, ""));
        ensure!(error.contains(expected) && error.contains(section), "{flow}: {error}");
    }
    Ok(())
}

#[test]
fn several_policies_are_refused() -> Result<()> {
    let files = walker().with_file("walker/other.yaml", YAML);
    let expected = "several policies of this family: walker/other.yaml and walker/walker.yaml";
    refused("two policies", files.reading(true, ""), expected)
}
