//! Integer inputs.

use actq::measure::actions::actions;
use actq_onnx::Choice;
use anyhow::Result;

use super::file::{File, Value};
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
    let axes = file.ints(&[1]);
    let time = file.node("Unsqueeze", &["time", &axes], &[]);
    let time = file.node("Cast", &[&time], &[("to", Value::Int(1))]);
    let frequencies = file.drawn(&[1, 4]);
    let angles = file.node("Mul", &[&time, &frequencies], &[]);
    let (sin, cos) = (file.node("Sin", &[&angles], &[]), file.node("Cos", &[&angles], &[]));
    let x = file.node("Concat", &["sample", &sin, &cos], &[("axis", Value::Int(1))]);
    ended(file, &x, 14)
}

#[test]
fn a_cast_time_step_is_a_float() -> Result<()> {
    let (integers, policy) = imported(&denoiser(true), &Choice::default())?;
    assert_eq!((integers.inputs.len(), &integers.integers[..]), (2, &["time".to_owned()][..]));
    let (floats, _) = imported(&denoiser(false), &Choice::default())?;
    assert!(floats.integers.is_empty());
    let observations = drawn(&policy);
    compare(&by_tract(&denoiser(false), &floats, &observations)?, &actions(&policy, &observations))
}

#[test]
fn integer_computations_are_refused() {
    let refused = |build: fn(&mut File) -> String, expected: &str| {
        let mut file = File::default();
        file.integers("time", &[1, 4]);
        let x = build(&mut file);
        let error = imported(&ended(file, &x, 4), &Choice::default()).expect_err(expected);
        let error = format!("{error:#}");
        assert!(error.contains(expected), "{error} instead of {expected}");
    };
    let computed = "computed with the integers of the input \"time\"";
    refused(
        |file| {
            let two = file.ints(&[2]);
            let x = file.node("Div", &["time", &two], &[]);
            file.node("Cast", &[&x], &[("to", Value::Int(1))])
        },
        computed,
    );
    refused(|_| "time".to_owned(), computed);
    refused(|file| file.node("Cast", &["time"], &[("to", Value::Int(10))]), "rounds a value of the network to float16");
}
