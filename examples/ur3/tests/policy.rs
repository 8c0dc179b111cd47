//! The shipped policy: closed-loop success, and the recorded outputs that a quantizer relies on.

use std::fs::File;

use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::task::run_episode;
use actq_ur3::{OBS_DIM, flow_folder, policy_folder};
use ndarray::{Array1, Array3, Axis};
use ndarray_npy::NpzReader;

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
        let mut npz = NpzReader::new(File::open(policy_folder().join(name)).unwrap()).unwrap();
        let obs: Array3<f32> = npz.by_name("obs").unwrap();
        let action: Array3<f32> = npz.by_name("action").unwrap();
        let length: Array1<i64> = npz.by_name("length").unwrap();
        let seed: Array1<i64> = npz.by_name("seed").unwrap();
        assert_eq!((length.len(), seed.len()), (obs.len_of(Axis(0)), obs.len_of(Axis(0))));
        assert!(length.iter().all(|&length| length == obs.len_of(Axis(1)) as i64));

        let steps = obs.rows().into_iter().zip(action.rows());
        for (obs, action) in steps {
            assert_eq!(obs.len(), OBS_DIM);
            let raw = policy.raw(&obs.to_vec());
            assert_eq!(raw.len(), action.len());
            // Tolerance for another order of summation only.
            let worst = raw.iter().zip(action).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "{name}: outputs differ by {worst}");
        }
    }
}
