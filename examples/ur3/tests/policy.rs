//! The shipped policy: closed-loop success, and the recorded outputs that a quantizer relies on.

use actq::data::arrays;
use actq::import::values::Values;
use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::task::run_episode;
use actq_ur3::{OBS_DIM, flow_folder, policy_folder};

#[test]
fn shipped_policies_solve_the_task() {
    for folder in [policy_folder(), flow_folder()] {
        let mut policy = PolicyF32::load(folder).unwrap();
        let solved = (1000..1100)
            .filter(|&seed| {
                policy.reset();
                run_episode(seed, |obs| policy.act(obs)).success
            })
            .count();
        assert!(solved >= 95, "{}: {solved} of 100 episodes", folder.display());
    }
}

#[test]
fn recorded_outputs_match_the_policy() {
    let mut policy = PolicyF32::load(policy_folder()).unwrap();
    for name in ["calib.npz", "heldout.npz"] {
        let recording = arrays(&policy_folder().join(name)).unwrap();
        let [episodes, steps, OBS_DIM] = recording["obs"].shape[..] else { panic!("{:?}", recording["obs"].shape) };
        let Values::I64(length) = &recording["length"].values else { panic!("length must be int64") };
        assert_eq!((length.len(), &recording["seed"].shape[..]), (episodes, &[episodes][..]));
        assert!(length.iter().all(|&length| length == steps as i64));

        let [obs, action] = ["obs", "action"].map(|name| recording[name].values.to_f32().unwrap());
        let width = action.len() / (episodes * steps);
        for (obs, action) in obs.chunks_exact(OBS_DIM).zip(action.chunks_exact(width)) {
            let raw = policy.raw(obs);
            assert_eq!(raw.len(), action.len());
            // Tolerance for another order of summation only.
            let worst = raw.iter().zip(action).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "{name}: outputs differ by {worst}");
        }
    }
}
