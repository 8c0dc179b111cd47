//! Integer inputs.

use actq::measure::actions::actions;
use actq_onnx::ImportOptions;
use anyhow::Result;

use super::file::File;
use super::styles::ended;
use super::{by_tract, compare, drawn, imported};

/// A denoiser whose time step is an integer or a float in the file.
fn denoiser(integers: bool) -> Vec<u8> {
    let mut file = File::default();
    file.input("sample", &[1, 6]);
    if integers {
        file.integers("time", &[1]);
    } else {
        file.input("time", &[1]);
    }
    let x = file.write(
        &[],
        "angles = Cast(Unsqueeze(time, [1]), to=1) * drawn(1, 4)
         Concat(sample, Sin(angles), Cos(angles), axis=1)",
    );
    ended(file, &x, 14)
}

#[test]
fn a_cast_time_step_is_a_float() -> Result<()> {
    let (integers, policy) = imported(&denoiser(true), &ImportOptions::default())?;
    assert_eq!((integers.inputs.len(), &integers.integers[..]), (2, &["time".to_owned()][..]));
    let (floats, _) = imported(&denoiser(false), &ImportOptions::default())?;
    assert!(floats.integers.is_empty());
    let observations = drawn(&policy);
    compare(&by_tract(&denoiser(false), &floats, &observations)?, &actions(&policy, &observations))
}
