//! Isaac Lab's exports: env.yaml, IO_descriptors.yaml, and both.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::Runner;
use actq_deploy::description::Numbers;

use crate::common::isaaclab::{self, DESCRIPTORS, ENVIRONMENT, JOINTS, LEN};
use crate::common::made::{Files, Tick, message, refused};
use crate::common::onnx;

const NETWORK: &str = "exported/policy.onnx";

/// Adds the network: a linear function of `inputs` values.
fn with_network(files: &Files, inputs: usize, outputs: usize) -> Files {
    files.with_file(NETWORK, onnx::linear(inputs, outputs, &[]))
}

fn environment() -> Files {
    with_network(&Files::default().with_file("params/env.yaml", ENVIRONMENT), LEN + 2, 4)
}

/// Descriptors lack the term gait_phase, whose function has none.
fn descriptors() -> Files {
    with_network(&Files::default().with_file("io_descriptors/IO_descriptors.yaml", DESCRIPTORS), LEN, 4)
}

fn both() -> Files {
    environment().with_file("io_descriptors/IO_descriptors.yaml", DESCRIPTORS)
}

/// Runs 20 ticks; returns observations and targets.
fn run(files: &Files, answers: &str) -> Result<Vec<Tick>> {
    // Isaac Lab's code does not hold targets within the joints' ranges, which only descriptors have.
    let limits =
        if files.0.contains_key("io_descriptors/IO_descriptors.yaml") { "target.limits = \"none\"\n" } else { "" };
    files.run(&format!("{limits}{answers}"), 20, isaaclab::raw)
}

fn answers(joints: &[&str]) -> String {
    format!("joints = {joints:?}\nraw.gait_phase = 2\n")
}

/// Returns the first tick that differs from the reference.
fn differs(ticks: &[Tick], gait: bool) -> Option<String> {
    let reference = isaaclab::reference(gait, ticks.len());
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    let differ = |(own, other): (&Tick, &Tick)| !near(&own.0, &other.0) || !near(&own.1, &other.1);
    let tick = ticks.iter().zip(&reference).position(differ)?;
    Some(format!("tick {tick}: {:?}, not {:?}", ticks[tick], reference[tick]))
}

#[test]
fn an_environment_agrees_with_its_code() -> Result<()> {
    let files = environment();
    let differs = differs(&run(&files, &answers(&JOINTS))?, true);
    ensure!(differs.is_none(), "{differs:?}");
    let reading = files.reading(true, &answers(&JOINTS))?;
    ensure!(reading.unread.is_empty(), "{:?}", reading.unread);
    let description = reading.description;
    ensure!((description.rate_hz - 50.0).abs() < 1e-9, "{}", description.rate_hz);
    let gains = description.gains.context("gains")?;
    ensure!(gains.stiffness == [25.0, 25.0, 30.0, 30.0] && gains.damping == [0.5; 4], "{gains:?}");
    Ok(())
}

#[test]
fn descriptors_agree_with_the_code() -> Result<()> {
    let files = descriptors();
    let differs = differs(&run(&files, "")?, false);
    ensure!(differs.is_none(), "{differs:?}");
    let reading = files.reading(true, "")?;
    ensure!(reading.unread.is_empty(), "{:?}", reading.unread);
    ensure!(reading.description.joints["robot"] == JOINTS, "{:?}", reading.description.joints);
    Ok(())
}

#[test]
fn both_files_together_need_no_order() -> Result<()> {
    let files = both();
    let differs = differs(&run(&files, "raw.gait_phase = 2")?, true);
    ensure!(differs.is_none(), "{differs:?}");
    ensure!(files.reading(true, "raw.gait_phase = 2")?.unread.is_empty(), "unread keys");
    Ok(())
}

#[test]
fn gains_of_zero_in_descriptors_are_no_gains() -> Result<()> {
    let zero = |files: Files, both: bool| {
        let files = files
            .with("default_joint_stiffness: [25.0, 25.0, 30.0, 30.0]", "default_joint_stiffness: [0.0, 0.0, 0.0, 0.0]");
        let damping = if both { "[0.0, 0.0, 0.0, 0.0]" } else { "[0.5, 0.0, 0.0, 0.0]" };
        files.with("default_joint_damping: [0.5, 0.5, 0.5, 0.5]", &format!("default_joint_damping: {damping}"))
    };
    let description = zero(descriptors(), true).reading(true, "")?.description;
    ensure!(description.gains.is_none(), "{:?}", description.gains);
    let gains = zero(both(), true).reading(true, "raw.gait_phase = 2")?.description.gains.context("gains")?;
    ensure!(gains.stiffness == [25.0, 25.0, 30.0, 30.0] && gains.damping == [0.5; 4], "{gains:?}");
    // A joint with one gain of 0 has the other one.
    let error = message(zero(both(), false).reading(true, "raw.gait_phase = 2"));
    ensure!(error.contains("stiffness: the bundle contradicts itself"), "{error}");
    let some = both()
        .with("default_joint_stiffness: [25.0, 25.0, 30.0, 30.0]", "default_joint_stiffness: [0.0, 25.0, 30.0, 30.0]")
        .with("default_joint_damping: [0.5, 0.5, 0.5, 0.5]", "default_joint_damping: [0.0, 0.5, 0.5, 0.5]");
    let gains = some.reading(true, "raw.gait_phase = 2")?.description.gains.context("gains")?;
    ensure!(gains.stiffness == [25.0, 25.0, 30.0, 30.0], "{gains:?}");
    Ok(())
}

#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    assert_eq!(environment().asked(true, "")?, ["joints", "raw.gait_phase"]);
    assert!(descriptors().asked(true, "")?.is_empty());
    let mut all = environment().asked(false, "")?;
    all.sort();
    let expected = [
        "action.clip",
        "asset",
        "clamp_commands",
        "clip_first",
        "gravity",
        "group",
        "history.fill",
        "history.first",
        "history.layout",
        "joints",
        "last_action",
        "raw.gait_phase",
        "unmatched",
    ];
    assert_eq!(all, expected);
    Ok(())
}

#[test]
fn each_convention_changes_the_result() -> Result<()> {
    let own = answers(&JOINTS);
    let with = |rule: &str| run(&environment(), &format!("{own}{rule}\n"));
    for rule in [
        "clip_first = false",
        "history.first = \"newest\"",
        "history.fill = \"zero\"",
        "last_action = \"processed\"",
        "action.clip = \"action\"",
        "clamp_commands = true",
    ] {
        ensure!(differs(&with(rule)?, true).is_some(), "{rule}: nothing differs");
    }
    let [a, b, c, d] = JOINTS;
    ensure!(differs(&run(&environment(), &answers(&[b, a, c, d]))?, true).is_some(), "another order of joints");
    ensure!(differs(&with("gravity = \"rpy\"")?, true).is_some(), "gravity of an orientation");
    for (rule, expected) in [
        ("history.layout = \"frame\"", "different lengths"),
        ("unmatched = false", "no pattern matches joint \"FL_knee\""),
        ("asset = \"arm\"", "params/env.yaml: scene.arm.init_state is missing; answer asset"),
        (
            "group = \"actor\"",
            "params/env.yaml: observations.actor is missing; answer group with one of policy, critic",
        ),
    ] {
        refused(rule, environment().reading(true, &format!("{own}{rule}\n")), expected)?;
    }
    Ok(())
}

#[test]
fn the_agent_limits_the_action() -> Result<()> {
    let with = |clip: &str| {
        let agent = format!("seed: 42\nclip_actions: {clip}\npolicy:\n  activation: elu\n");
        environment().with_file("params/agent.yaml", agent)
    };
    let own = answers(&JOINTS);
    ensure!(differs(&run(&with("null"), &own)?, true).is_none(), "no limit");
    ensure!(differs(&run(&with("100.0"), &own)?, true).is_none(), "a limit that no action reaches");
    ensure!(
        differs(&run(&with("0.5"), &format!("{own}clip_actions = false\n"))?, true).is_none(),
        "the rule does not hold"
    );
    let ticks = run(&with("0.5"), &own)?;
    for (tick, (observation, target)) in ticks.iter().enumerate() {
        let action = isaaclab::network(observation, 4).into_iter().map(|action| action.clamp(-0.5, 0.5));
        let action: Vec<f64> = action.collect();
        // Scale and offset of FR_hip, whose limits are -2 and 0.3.
        let expected = (0.25 * action[0] - 0.1).clamp(-2.0, 0.3);
        ensure!((target[0] - expected).abs() < 1e-5, "tick {tick}: {target:?}, not {expected}");
        if let Some((next, _)) = ticks.get(tick + 1) {
            let fed_back = &next[next.len() - 6..next.len() - 2];
            let same = fed_back.iter().zip(&action).all(|(a, b)| (a - b).abs() < 1e-5);
            ensure!(same, "tick {tick}: {fed_back:?}, not {action:?}");
        }
    }
    ensure!(differs(&ticks, true).is_some(), "the limit changes nothing");
    let expected = "params/agent.yaml: clip_actions (line 2) must be a number above 0";
    refused("a limit below 0", with("-1").reading(true, &own), expected)
}

/// A network with a normalizer, a hidden layer of 5 values and an activation, as a learner makes it.
fn trained(activation: &str) -> Files {
    let nodes = [
        ("Sub", &["obs", "mean"][..], "centered"),
        ("Div", &["centered", "deviation"], "normalized"),
        ("Gemm", &["normalized", "w0", "b0"], "first"),
        (activation, &["first"], "hidden"),
        ("Gemm", &["hidden", "w1", "b1"], "actions"),
    ];
    let len = LEN + 2;
    let tensors = [
        ("mean", &[1, len][..], vec![0.1; len]),
        ("deviation", &[1, len], vec![2.0; len]),
        ("w0", &[len, 5], onnx::weights(len, 5)),
        ("b0", &[5], vec![0.5; 5]),
        ("w1", &[5, 4], onnx::weights(5, 4)),
        ("b1", &[4], vec![0.5; 4]),
    ];
    environment().with_file(NETWORK, onnx::graph(&nodes, &tensors, &[("obs", len)], &[("actions", 4)], &[]))
}

#[test]
fn the_agent_must_have_the_graphs_network() -> Result<()> {
    let own = answers(&JOINTS);
    let files = trained("Elu");
    let with = |agent: &str| files.with_file("params/agent.yaml", agent);
    let said = [
        "actor: {obs_normalization: true, activation: elu, hidden_dims: [5]}",
        "empirical_normalization: true\npolicy: {activation: ELU, actor_hidden_dims: [5]}",
        "params: {config: {normalize_input: True}, network: {mlp: {units: [5], activation: elu}}}",
        "agent: {state_preprocessor: RunningStandardScaler}\nmodels: {policy: {network: [{layers: [5], activations: elu}]}}",
        "normalize_input: true\npolicy_kwargs: {activation_fn: nn.ELU, net_arch: [5]}",
        "actor: {activation: {}, hidden_dims: [5]}\nempirical_normalization: {}",
    ];
    for agent in said {
        let reading = with(agent).reading(true, &own)?;
        ensure!(reading.questions.is_empty() && reading.unread.is_empty(), "{agent}: {reading:?}");
    }
    let cases = [
        (
            "actor: {obs_normalization: false}",
            "normalizer of the observation",
            "actor.obs_normalization says no normalizer",
        ),
        (
            "actor: {hidden_dims: [5, 5], activation: elu, obs_normalization: true}",
            "lengths of the hidden layers",
            "actor.hidden_dims says [5, 5]",
        ),
        ("policy: {actor_hidden_dims: [6]}", "lengths of the hidden layers", "policy.actor_hidden_dims says [6]"),
        ("actor: {activation: relu}", "activation of the hidden layers", "actor.activation says relu"),
        ("policy: {rnn_type: lstm, rnn_hidden_dim: 8}", "recurrent cells", "policy.rnn_type says 1 lstm of 8 values"),
    ];
    for (agent, what, said) in cases {
        let error = message(with(agent).reading(true, &own));
        let both = error.contains(&format!("params/agent.yaml: {said}")) && error.contains("exported/policy.onnx says");
        ensure!(error.contains(what) && both, "{agent}: {error}");
        let reading = with(agent).reading(true, &format!("{own}agent.network = \"graph\"\n"))?;
        ensure!(reading.questions.is_empty(), "{agent}: {:?}", reading.questions);
    }
    let plain = environment().with_file("params/agent.yaml", "policy: {actor_obs_normalization: true}\n");
    let expected = "params/agent.yaml: policy.actor_obs_normalization says a normalizer, and exported/policy.onnx says no normalizer";
    refused("no normalizer in the graph", plain.reading(true, &own), expected)?;
    let unread = with("actor: {hidden_dims: [5]}\nother: 3\n").reading(true, &own)?.unread;
    ensure!(unread == ["params/agent.yaml: other"], "{unread:?}");
    Ok(())
}

#[test]
fn recurrent_policies_carry_their_state() -> Result<()> {
    const HIDDEN: usize = 2;
    let shape = [1, 1, HIDDEN];
    let network = onnx::shaped(
        &[
            ("LSTM", &["obs", "w", "r", "b", "", "h_in", "c_in"], &["y", "h_out", "c_out"], &[("hidden_size", HIDDEN)]),
            ("MatMul", &["h_out", "head"], &["actions"], &[]),
        ],
        &[
            ("w", &[1, 4 * HIDDEN, LEN], onnx::weights(4 * HIDDEN, LEN)),
            ("r", &[1, 4 * HIDDEN, HIDDEN], onnx::weights(4 * HIDDEN, HIDDEN)),
            ("b", &[1, 8 * HIDDEN], vec![0.1; 8 * HIDDEN]),
            ("head", &[HIDDEN, 4], onnx::weights(HIDDEN, 4)),
        ],
        &[("obs", &[1, 1, LEN]), ("h_in", &shape), ("c_in", &shape)],
        &[("actions", &[1, 1, 4]), ("h_out", &shape), ("c_out", &shape)],
        &[],
    );
    let files = descriptors().with_file(NETWORK, network);
    let mut cell = onnx::Lstm::new(LEN, HIDDEN);
    let mut before = vec![0.0; 4];
    for (tick, (observation, target)) in run(&files, "")?.into_iter().enumerate() {
        ensure!(observation.len() == LEN, "tick {tick}: {} values", observation.len());
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        ensure!(near(&observation[LEN - 4..], &before), "tick {tick}: {observation:?}, not {before:?}");
        let (h, head) = (cell.step(&observation), onnx::weights(HIDDEN, 4));
        before = (0..4).map(|j| (0..HIDDEN).map(|k| h[k] * f64::from(head[4 * k + j])).sum()).collect();
        let (scale, offset) = ([0.25, 0.5, 0.25, 0.5], [-0.1, -1.5, 0.1, 0.0]);
        let expected: Vec<f64> = (0..4).map(|i| (before[i] * scale[i] + offset[i]).clamp(-2.0, 0.3)).collect();
        ensure!(near(&target, &expected), "tick {tick}: {target:?}, not {expected:?}");
    }
    Ok(())
}

/// The environment as release 3.0.0 stores it, with a history of all terms of the group.
fn of_release_3(order: &str) -> Files {
    let group = "history_length: null\n    flatten_history_dim: true\n    base_lin_vel";
    let new = format!("history_length: 2\n    flatten_history_dim: true\n    history_order: {order}\n    base_lin_vel");
    let files = environment().with(group, &new).with("soft_joint_pos_limit_factor: 0.9", "joint_ordering: null");
    with_network(&files, 2 * (3 + 3 + 3 + 4 + 3 + 4 + 2), 4)
}

#[test]
fn the_order_of_histories_is_read() -> Result<()> {
    let own = answers(&JOINTS);
    let [term, time] = ["term", "time"].map(|order| run(&of_release_3(order), &own));
    let (term, time) = (term?, time?);
    // The second frame of both has the same terms one after the other.
    let frame = |observation: &[f64], by_term: bool, newest: usize| -> Vec<f64> {
        let lens = [3, 3, 3, 4, 3, 4, 2];
        let all: usize = lens.iter().sum();
        let starts = lens.iter().scan(0, |start, len| Some(std::mem::replace(start, *start + len)));
        let places = starts.zip(lens).flat_map(|(start, len)| {
            let from = if by_term { 2 * start + newest * len } else { newest * all + start };
            from..from + len
        });
        places.map(|place| observation[place]).collect()
    };
    for frame_number in [0, 1] {
        let (by_term, by_time) = (frame(&term[0].0, true, frame_number), frame(&time[0].0, false, frame_number));
        ensure!(by_term == by_time, "frame {frame_number}: {by_term:?}, not {by_time:?}");
    }
    ensure!(term[1].0 != time[1].0, "the order changes nothing");
    // Without a length of the group the order does nothing.
    let alone = environment().with("concatenate_dim: -1\n", "concatenate_dim: -1\n    history_order: time\n");
    ensure!(differs(&run(&alone, &own)?, true).is_none(), "histories of terms alone");
    refused("another order", of_release_3("space").reading(true, &own), "history_order (line")
}

#[test]
fn the_order_of_joints_is_read_or_asked() -> Result<()> {
    let files = of_release_3("term");
    let asked = files.reading(true, "raw.gait_phase = 2")?.questions;
    ensure!(asked.len() == 1 && asked[0].key == "joints", "{asked:?}");
    for part in ["scene.robot.joint_ordering = null", "breadth-first", "depth-first"] {
        ensure!(asked[0].meaning.contains(part), "{part}: {}", asked[0].meaning);
    }
    let listed = files.with("joint_ordering: null", &format!("joint_ordering: {JOINTS:?}"));
    let reading = listed.reading(true, "raw.gait_phase = 2")?;
    ensure!(reading.questions.is_empty() && reading.description.joints["robot"] == JOINTS, "{reading:?}");
    Ok(())
}

#[test]
fn terms_of_later_releases_are_read_or_asked() -> Result<()> {
    let own = answers(&JOINTS);
    let of = |function: &str| environment().with("observations:projected_gravity", &format!("observations:{function}"));
    let reading = of("pva_projected_gravity").reading(true, &own)?;
    ensure!(reading.questions.is_empty(), "{:?}", reading.questions);
    ensure!(reading.description.inputs.iter().any(|input| input.name == "pva_projected_gravity"), "no input");

    let quaternion = with_network(&of("root_quat_w"), LEN + 3, 4);
    assert_eq!(quaternion.asked(true, &own)?, ["quaternion"]);
    let description = quaternion.reading(true, &format!("{own}quaternion = \"xyzw\""))?.description;
    let input = description.inputs.iter().find(|input| input.name == "root_quat_w").context("an input")?;
    ensure!(input.len == Some(4) && input.unit.as_deref() == Some("x, y, z, w"), "{input:?}");

    let delayed = |most: usize| {
        let term = "params: {}\n      modifiers: null\n      noise: null\n      clip: null\n      scale: null\n      history_length: 3\n";
        environment().with(term, &format!("{term}      delay_max_lag: {most}\n"))
    };
    ensure!(delayed(0).asked(true, &own)?.is_empty(), "no delay");
    assert_eq!(delayed(2).asked(true, &own)?, ["unread.delay_max_lag"]);
    // Descriptors of these releases leave out the order of histories.
    let overloads = "history_length: 3, scale: 0.25}";
    let descriptors = descriptors().with(overloads, "history_length: 3, scale: 0.25, delay_max_lag: 0}");
    assert_eq!(descriptors.asked(true, "")?, ["history.layout"]);
    Ok(())
}

#[test]
fn the_joints_ranges_limit_the_targets() -> Result<()> {
    let description = descriptors().reading(true, "")?.description;
    // FR_hip, FR_knee, FL_hip, FL_knee.
    let expected = [vec![-1.0, -3.0, -1.0, -3.0], vec![1.0, 0.0, 1.0, 0.0]].map(Numbers::Each);
    ensure!(description.targets[0].limits == Some(expected), "{:?}", description.targets);
    // Without ranges, the clip at the end of the target.
    let none = environment().reading(true, &answers(&JOINTS))?.description;
    let clip = [Numbers::All(-2.0), Numbers::All(0.3)];
    ensure!(none.targets[0].limits == Some(clip), "{:?}", none.targets);
    Ok(())
}

#[test]
fn the_agent_names_the_group_of_observations() -> Result<()> {
    let with = |groups: &str| {
        environment()
            .with("observations:\n  policy:\n", "observations:\n  proprio:\n")
            .with_file("params/agent.yaml", format!("clip_actions: null\nobs_groups: {groups}\n"))
    };
    let own = answers(&JOINTS);
    for groups in ["{policy: [proprio], critic: [critic]}", "{actor: [proprio]}"] {
        ensure!(differs(&run(&with(groups), &own)?, true).is_none(), "{groups}");
    }
    let asked = with("{}").asked(true, &format!("{own}group = \"proprio\"\n"))?;
    ensure!(asked.is_empty(), "{asked:?}");
    for (groups, expected) in [
        ("{}", "params/env.yaml: observations.policy is missing; answer group"),
        (
            "{policy: [proprio, critic]}",
            "obs_groups.policy: the policy reads 2 groups of observations (proprio, critic)",
        ),
        ("{policy: []}", "obs_groups.policy: the policy reads 0 groups"),
        ("{policy: 3}", "obs_groups.policy (line 2) must be a list of texts"),
    ] {
        refused(groups, with(groups).reading(true, &own), expected)?;
    }
    Ok(())
}

#[test]
fn several_actions_become_several_targets() -> Result<()> {
    let legs = "  joint_pos:\n    class_type: isaaclab.envs.mdp.actions.joint_actions:JointPositionAction";
    let wheels = "  wheels:\n    class_type: isaaclab.envs.mdp.actions.joint_actions:JointVelocityAction\n    asset_name: robot\n    \
        joint_names: .*_knee\n    scale: 5.0\n    offset: 0.0\n    use_default_offset: true\n    clip: null\n";
    let files = with_network(&environment(), LEN + 2 + 2, 6).with(legs, &format!("{wheels}{legs}"));
    let description = files.reading(true, &answers(&JOINTS))?.description;
    let kinds: Vec<String> = description.targets.iter().map(|target| format!("{:?}", target.kind)).collect();
    ensure!(kinds == ["Velocity", "Position"], "{kinds:?}");
    ensure!(description.joints["action_0"] == ["FL_knee", "FR_knee"], "{:?}", description.joints);
    let mut runner = Runner::new(files.plan(&description)?);
    let raw: Vec<Vec<f64>> = runner.plan().inputs().iter().map(|(name, len)| isaaclab::raw(name, *len, 3)).collect();
    let tick = runner.step(&raw)?;
    let expected: Vec<f64> = tick.action[..2].iter().map(|action| 5.0 * action).collect();
    ensure!(tick.targets[0].1.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", tick.targets);
    Ok(())
}

#[test]
fn relative_actions_are_asked() -> Result<()> {
    let files = environment()
        .with("joint_actions:JointPositionAction", "joint_actions:RelativeJointPositionAction")
        .with("use_default_offset: true", "use_zero_offset: true");
    assert_eq!(files.asked(true, &answers(&JOINTS))?, ["relative.once"]);
    let ticks = run(&files, &format!("{}relative.once = true\n", answers(&JOINTS)))?;
    let network = isaaclab::network(&ticks[0].0, 4);
    // The first joint of the action is FR_hip, whose scale is 0.25 and whose limits are -2 and 0.3.
    let expected = (0.25 * network[0]).clamp(-2.0, 0.3) + isaaclab::raw("joint_pos", 4, 0)[1];
    ensure!((ticks[0].1[0] - expected).abs() < 1e-5, "{} is not {expected}", ticks[0].1[0]);
    Ok(())
}

#[test]
fn metadata_of_the_network_is_used_and_checked() -> Result<()> {
    let metadata = |names: &'static str, default: &'static str| {
        [
            ("joint_names", names),
            ("default_joint_pos", default),
            ("joint_stiffness", "25,25,30,30"),
            ("action_scale", "0.25,0.5,0.25,0.5"),
        ]
    };
    let with = |metadata: &[(&str, &str)], files: Files| files.with_file(NETWORK, onnx::linear(LEN + 2, 4, metadata));
    let own = "FL_hip,FR_hip,FL_knee,FR_knee";
    let good = metadata(own, "0.1,-0.1,0.0,-1.5");
    ensure!(differs(&run(&with(&good, environment()), "raw.gait_phase = 2")?, true).is_none(), "differs");
    for (metadata, other, expected) in [
        (metadata(own, "0.1,-0.1,0.2,-1.5"), environment(), "default positions: the bundle contradicts itself"),
        (metadata("FR_hip,FL_hip,FL_knee,FR_knee", "0.1,-0.1,0,-1.5"), both(), "order of the joints"),
        (metadata("FL_hip,FR_hip,FL_knee", "0.1,-0.1,0"), both(), "3 joints"),
    ] {
        let error = message(with(&metadata, other).reading(true, "raw.gait_phase = 2"));
        ensure!(error.contains(expected) && error.contains("policy.onnx metadata"), "{expected}: {error}");
    }
    Ok(())
}

#[test]
fn bad_environments_are_refused() -> Result<()> {
    let own = answers(&JOINTS);
    let scaled = "scale: 0.25\n      history_length: 3";
    let cases = [
        ("dt: 0.005", "dt: .nan", "params/env.yaml: sim.dt (line 9) must be a finite number"),
        ("dt: 0.005", "dt: 0", "params/env.yaml: sim.dt = 0"),
        ("decimation: 4", "decimation: -4", "decimation = -4"),
        (".*L_hip: 0.1", ".*L_hip: .nan", "must be a finite number, or finite numbers by patterns of joints"),
        (".*L_hip: 0.1", "L_hip: 0.1", "init_state.joint_pos: \"L_hip\" matches none of the joints FL_hip"),
        (".*L_hip: 0.1", ".*_hip: 0.1", "\".*_hip\" and \".*R_hip\" match both joint \"FR_hip\""),
        (".*L_hip: 0.1", "'[': 0.1", "\"[\" is not a regular expression that this reader knows"),
        (".*L_hip: 0.1", "'(?=FL).*': 0.1", "is not a regular expression that this reader knows"),
        ("joint_names_expr:\n        - .*_hip\n        - .*_knee", "joint_names_expr: []", "joint_names_expr is empty"),
        ("asset_name: robot\n    debug", "asset_name: arm\n    debug", "actions.joint_pos.asset_name = \"arm\""),
        ("joint_actions:JointPosition", "joint_actions_to_limits:JointPositionToLimits", "this action is not known"),
        ("use_default_offset: true", "use_default_offset: 3", "use_default_offset (line"),
        ("- FR_.*\n    - FL_.*", "- FR_.*", "length of the action: the bundle contradicts itself"),
        ("- -2.0\n      - 0.3", "- 2.0\n      - 0.3", "actions.joint_pos.clip (line"),
        ("concatenate_terms: true\n    enable", "concatenate_terms: false\n    enable", "concatenate_terms = false"),
        (scaled, "scale: [1, 2]\n      history_length: 3", "scale has 2 values, and the term 3"),
        (scaled, "scale: 0.25\n      history_length: 1e4", "at most 1000 frames"),
        (
            "history_length: 3\n      flatten_history_dim: true",
            "history_length: 3\n      flatten_history_dim: false",
            "an axis of its own",
        ),
        ("history_length: null\n    flatten", "history_length: 2\n    flatten", "length of the observation"),
        ("gait_phase:\n", "\"gait\\e\":\n", "\"gait\\\\u{1b}\" is not a name of letters, digits and _"),
        ("func: isaaclab.envs.mdp.observations:base_ang_vel\n", "func: null\n", "base_ang_vel.func is missing"),
        ("- .*_knee\n          - FR_hip", "- .*_ankle", "\".*_ankle\" matches none of the joints"),
        ("scene:\n", "scene:\n  robot: 1\n", "occurs twice"),
    ];
    for (from, to, expected) in cases {
        refused(to, environment().with(from, to).reading(true, &own), expected)?;
    }
    for (answers, expected) in [
        (answers(&["FL_hip", "FL_hip", "FL_knee", "FR_knee"]), "answer joints: \"FL_hip\" occurs twice"),
        (answers(&[]), "answer joints: 0 joints"),
        (own.replace("FR_knee", r"FR\u001b"), "is not a name"),
        (answers(&["FL_hip", "FR_hip", "FL_knee"]), "matches none of the joints"),
        (own.replace("phase = 2", "phase = 3"), "length of the observation"),
        (format!("{own}joint = 1\n"), "nothing asks for joint"),
    ] {
        refused(&answers, environment().reading(true, &answers), expected)?;
    }
    Ok(())
}

#[test]
fn bad_descriptors_are_refused() -> Result<()> {
    let names = "joint_names: [FR_hip, FR_knee, FL_hip, FL_knee]";
    let cases = [
        ("  dt: 0.02\n", "  dt: 0.01\n", "time of a tick: the bundle contradicts itself"),
        (
            "  - 0.1\n    - -0.1\n    - 0.0\n    - -1.5\n    default_joint_vel",
            "  - 0.1\n    default_joint_vel",
            "default_joint_pos has 1 values, but joint_names 4",
        ),
        ("scale: [0.25, 0.5, 0.25, 0.5]", "scale: [0.25, .nan, 0.25, 0.5]", "actions.0.scale (line"),
        ("scale: [0.25, 0.5, 0.25, 0.5]", "scale: [0.25, 0.5]", "actions.0.scale has 2 values; 4 joints are named"),
        (names, "joint_names: [FR_hip, FR_hip, FL_hip, FL_knee]", "\"FR_hip\" occurs twice"),
        (names, "joint_names: [FR_hip, arm, FL_hip, FL_knee]", "\"arm\" is none of the joints"),
        (
            "joint_pos_offsets: [0.1, -0.1, 0.0, -1.5]",
            "joint_pos_offsets: [0.1]",
            "joint_pos_offsets has 1 values, but joint_names 4",
        ),
        ("name: base_ang_vel", "name: \"base\\e\"", "\"base\\\\u{1b}\" is not a name"),
        (
            "full_path: isaaclab.envs.mdp.actions.joint_actions.JointPositionAction",
            "full_path: mine.Action",
            "this action is not known",
        ),
        ("shape: [3] # of base_ang_vel", "shape: []", "must be the number of values, as a list"),
        (
            "articulations:\n  robot:",
            "articulations:\n  arm:",
            "articulations.robot is missing; answer asset with one of arm",
        ),
    ];
    for (from, to, expected) in cases {
        refused(to, descriptors().with(from, to).reading(true, ""), expected)?;
    }
    // The exporter left out a term.
    let error = message(with_network(&descriptors(), LEN + 2, 4).reading(true, ""));
    ensure!(error.contains("add env.yaml, which has all") && error.contains(&format!("{LEN} values")), "{error}");
    Ok(())
}

#[test]
fn files_that_contradict_each_other_are_refused() -> Result<()> {
    let scaled = "scale: 0.25\n      history_length: 3";
    let cases = [
        ("dt: 0.005\n  render", "dt: 0.01\n  render", "ticks a second"),
        (".*L_hip: 0.1", ".*L_hip: 0.2", "default positions"),
        (".*_knee: 30.0", ".*_knee: 31.0", "stiffness"),
        ("damping: 0.5", "damping: 0.6", "damping"),
        (".*_knee: 0.5", ".*_knee: 0.6", "scale of \"joint_pos\""),
        ("- FR_.*\n    - FL_.*", "- FL_.*\n    - FR_.*", "joints of \"joint_pos\""),
        ("- -2.0\n      - 0.3", "- -2.0\n      - 0.4", "limits of \"joint_pos\""),
        (scaled, "scale: 0.5\n      history_length: 3", "scale of \"base_ang_vel\""),
        (scaled, "scale: 0.25\n      history_length: 2", "number of frames of \"base_ang_vel\""),
        (
            "- -1.0\n      - 1.0\n      scale: 0.25",
            "- -1.0\n      - 2.0\n      scale: 0.25",
            "limits of \"base_ang_vel\"",
        ),
        ("- .*_knee\n          - FR_hip", "- FR_hip\n          - .*_knee", "joints of \"joint_vel\""),
        (
            "func: isaaclab.envs.mdp.observations:joint_vel_rel",
            "func: isaaclab.envs.mdp.observations:joint_vel",
            "terms of the observation",
        ),
    ];
    for (from, to, expected) in cases {
        let error = message(both().with(from, to).reading(true, "raw.gait_phase = 2"));
        let sources = error.contains("params/env.yaml") && error.contains("io_descriptors/IO_descriptors.yaml");
        ensure!(error.contains(expected) && error.contains("contradicts itself") && sources, "{to}: {error}");
    }
    Ok(())
}

#[test]
fn bundles_of_no_policy_several_or_another_family_are_refused() -> Result<()> {
    let files = environment();
    let none = files.without(NETWORK);
    let two = none.with_file("a.onnx", files.0[NETWORK].clone()).with_file("b.onnx", files.0[NETWORK].clone());
    let several = files.with_file("other/env.yaml", ENVIRONMENT);
    // A bundle of unitree_rl_lab has the training's env.yaml, too.
    let deploy = "joint_ids_map: [0, 1, 2, 3]\nstep_dt: 0.02\nactions: {}\nobservations: {}\n";
    let other_family = files.with_file("params/deploy.yaml", deploy);
    for (name, files, expected) in [
        ("no policy", none, "params/env.yaml: there is no ONNX file with it"),
        ("two policies", two, "which of a.onnx, b.onnx is its policy?"),
        ("two environments", several, "several policies of this family"),
        ("another family", other_family, "unitree_rl_lab bundle"),
    ] {
        refused(name, files.reading(true, ""), expected)?;
    }
    Ok(())
}
