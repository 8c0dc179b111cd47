//! From the network's output to the targets.

use actq::error::{Result, bail};

use super::super::common::Parts;
use super::config::Config;
use super::joints::Joints;
use crate::description::{Op, Operand, TargetKind};
use crate::facts::Facts;
use crate::yaml::Node;

/// Adds the targets and gains; returns the value that the deploy code feeds back.
pub(super) fn act(config: &Config<'_>, joints: &Joints, parts: &mut Parts, facts: &mut Facts) -> Result<&'static str> {
    let n = joints.len();
    let wheels = config.places("wheel_indices")?;
    let mut ops = Vec::new();
    let mut sources = Vec::new();
    if let Some([low, high]) = clip(config)? {
        ops.push(Op::Clip([Operand::List(low), Operand::List(high)]));
        sources.push(config.location("clip_actions_lower"));
        sources.push(config.location("clip_actions_upper"));
    }
    if let Some(hips) = hips(config, n)? {
        ops.push(Op::Scale(Operand::List(hips)));
        sources.push(config.location("hip_scale_reduction"));
    }
    let action = if ops.is_empty() { "policy.ACTION" } else { "clipped_action" };
    if !ops.is_empty() {
        parts.value(action, "policy.ACTION", ops);
        facts.note(action, sources.join("; "));
    }

    // A wheel's position stays at the default, and the velocity of all other joints at 0.
    let scale = scale(config, &wheels, n)?;
    let only = |wheel: bool| Op::Scale(Operand::List(masked(&scale, |i| wheels.contains(&i) == wheel)));
    let default = Operand::Name("default".to_owned());
    joints.target(parts, TargetKind::Position, "target", action, vec![only(false), Op::Add(default)]);
    let source = config.location("action_scale");
    facts.note("target", format!("{source}; {}", config.location("default_dof_pos")));
    if !wheels.is_empty() {
        joints.target(parts, TargetKind::Velocity, "target_velocity", action, vec![only(true)]);
        facts.note("target_velocity", format!("{source}; {}", config.location("wheel_indices")));
    }
    joints.gains(parts, &config.of_joints("rl_kp")?, &config.of_joints("rl_kd")?);
    facts.note("gains", format!("{}; {}", config.location("rl_kp"), config.location("rl_kd")));
    Ok(action)
}

/// Returns numbers with 0 instead of those that `keep` does not name.
pub(super) fn masked(numbers: &[f64], keep: impl Fn(usize) -> bool) -> Vec<f64> {
    numbers.iter().enumerate().map(|(i, number)| if keep(i) { *number } else { 0.0 }).collect()
}

/// Returns the limits of the action, if there are some.
fn clip(config: &Config<'_>) -> Result<Option<[Vec<f64>; 2]>> {
    let keys = ["clip_actions_lower", "clip_actions_upper"];
    let (low, high) = match keys.map(|key| config.optional_of_joints(key)) {
        [Err(error), _] | [_, Err(error)] => return Err(error),
        [Ok(Some(low)), Ok(Some(high))] => (low, high),
        [Ok(None), Ok(None)] => return Ok(None),
        [Ok(low), Ok(_)] => {
            let (there, missing) = if low.is_some() { (keys[0], keys[1]) } else { (keys[1], keys[0]) };
            bail!("{} is there without {missing}; give both, or none", config.location(there));
        }
    };
    if let Some(i) = (0..low.len()).find(|&i| low[i] > high[i]) {
        return Err(Facts::contradiction(
            &format!("limits of action {i} (from 0)"),
            (&config.location(keys[0]), &low[i].to_string()),
            (&config.location(keys[1]), &high[i].to_string()),
        ));
    }
    Ok(Some([low, high]))
}

/// Returns the factors of the older layout's `hip_scale_reduction`, if they change something.
fn hips(config: &Config<'_>, n: usize) -> Result<Option<Vec<f64>>> {
    let hips = config.places("hip_scale_reduction_indices")?;
    let Some(by) = config.optional("hip_scale_reduction", "a finite number", Node::number)? else { return Ok(None) };
    let factors = (0..n).map(|i| if hips.contains(&i) { by } else { 1.0 }).collect();
    Ok((!hips.is_empty() && by != 1.0).then_some(factors))
}

/// Returns the scale of each joint's action: a list, or the older layout's numbers for joints and wheels.
fn scale(config: &Config<'_>, wheels: &[usize], n: usize) -> Result<Vec<f64>> {
    let key = "action_scale";
    let one = config.required(key, "a finite number, or one for each joint", |node| {
        node.number().map(Some).or_else(|| node.numbers().map(|_| None))
    })?;
    let Some(one) = one else { return config.of_joints(key) };
    let mut scale = vec![one; n];
    if !wheels.is_empty() {
        let by = config.number("action_scale_wheel")?;
        wheels.iter().for_each(|wheel| scale[*wheel] = by);
    }
    Ok(scale)
}
