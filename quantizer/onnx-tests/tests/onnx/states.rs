//! Inputs that an output repeats or predicts, beside recurrent states.

use actq_onnx::Choice;
use anyhow::Result;

use super::file::File;
use super::{imported, refused};

/// A file with these inputs of four values, whose last two lines give the action and another output.
fn file(inputs: &[&str], output: &str, text: &str) -> Vec<u8> {
    let mut file = File::default();
    inputs.iter().for_each(|name| file.input(name, &[1, 4]));
    file.write(&[], text);
    file.output("action", &[1, 4]);
    file.output(output, &[1, 4]);
    file.bytes()
}

/// Returns the observed inputs and the cut outputs.
fn observed(bytes: &[u8], observed: &[&str]) -> Result<(Vec<String>, Vec<String>)> {
    let observed = observed.iter().map(|&name| name.to_owned()).collect();
    let choice = Choice { output: Some("action".to_owned()), observed, ..Choice::default() };
    let (imported, _) = imported(bytes, &choice)?;
    assert!(imported.states.is_empty());
    Ok((imported.inputs.into_iter().map(|(name, _)| name).collect(), imported.cut_outputs))
}

#[test]
fn repeated_and_predicted_observations_are_no_states() -> Result<()> {
    for (inputs, output, text) in [
        (&["obs"][..], "obs_out", "action := Identity(gemm(obs, 4, 4))\nobs_out := Identity(obs)"),
        (
            &["obs", "command"],
            "next_obs",
            "action := Identity(gemm(obs + command, 4, 4))\nnext_obs := Identity(gemm(obs, 4, 4))",
        ),
        (
            &["state", "command"],
            "next_state",
            "action := Identity(gemm(state + command, 4, 4))\nnext_state := Identity(state)",
        ),
        (&["state"], "next_state", "action := Identity(gemm(state, 4, 4))\nnext_state := Identity(gemm(state, 4, 4))"),
        (&["x_in"], "x_out", "action := Identity(gemm(x_in, 4, 4))\nx_out := Tanh(gemm(x_in, 4, 4))"),
    ] {
        let found = observed(&file(inputs, output, text), &[])?;
        assert_eq!(found, (inputs.iter().map(|&name| name.to_owned()).collect(), vec![output.to_owned()]), "{text}");
    }
    Ok(())
}

#[test]
fn a_state_that_the_action_never_reads_is_cut() -> Result<()> {
    let bytes = file(&["obs", "h"], "h_out", "action := Identity(gemm(obs, 4, 4))\nh_out := Tanh(h + obs)");
    assert_eq!(observed(&bytes, &[])?, (vec!["obs".to_owned()], vec!["h_out".to_owned()]));
    Ok(())
}

#[test]
fn a_state_of_later_actions_is_refused() {
    for (inputs, output, text) in [
        (
            &["obs", "state"][..],
            "next_state",
            "action := Identity(gemm(obs + state, 4, 4))\nnext_state := Tanh(obs + state)",
        ),
        // The action reads the observation one step later.
        (&["obs", "state"], "next_state", "action := Identity(gemm(state, 4, 4))\nnext_state := Tanh(obs)"),
        (&["obs", "x"], "x_next", "action := Identity(gemm(x, 4, 4))\nx_next := Identity(gemm(x + obs, 4, 4))"),
        (&["obs", "prev_obs"], "obs_out", "action := Identity(gemm(obs + prev_obs, 4, 4))\nobs_out := Identity(obs)"),
        (&["h_in"], "h_out", "action := Identity(gemm(h_in, 4, 4))\nh_out := Identity(h_in)"),
    ] {
        let input = inputs[inputs.len() - 1];
        refused(
            &file(inputs, output, text),
            &format!(
                "the input \"{input}\" and the output \"{output}\" look like a recurrent state, but no LSTM or GRU cell is between them; \
                 if it is measured anew in each step, pass --observe {input};"
            ),
        );
    }
}

#[test]
fn a_state_read_before_its_cell_is_refused() {
    let text = "cell = GRU(Unsqueeze(obs, [0]), drawn(1, 12, 4), drawn(1, 12, 4), drawn(1, 24), , Unsqueeze(memory, [0]), hidden_size=4, linear_before_reset=1)
                action := Identity(gemm(memory, 4, 4))
                updated := Reshape(cell, [1, 4])";
    refused(
        &file(&["obs", "memory"], "updated", text),
        "the action reads the input \"memory\" before the cell that has it as its state",
    );
}

#[test]
fn observe_settles_what_names_leave_open() -> Result<()> {
    let bytes = file(
        &["obs", "state"],
        "next_state",
        "action := Identity(gemm(obs + state, 4, 4))\nnext_state := Tanh(obs + state)",
    );
    assert_eq!(observed(&bytes, &["state"])?.0, ["obs", "state"]);
    let error = format!("{:#}", observed(&bytes, &["nothing"]).expect_err("no such input"));
    assert_eq!(error, "--observe nothing: the file has no input of this name; its inputs are obs, state");
    let unread = file(&["obs", "h"], "h_out", "action := Identity(gemm(obs, 4, 4))\nh_out := Tanh(h)");
    let error = format!("{:#}", observed(&unread, &["h"]).expect_err("not read"));
    assert_eq!(error, "--observe h: the action does not depend on it");
    Ok(())
}

#[test]
fn constants_that_are_inputs_are_questioned() -> Result<()> {
    // As Keras writes a Normalization layer by tf2onnx, and the same without a batch axis.
    for (rows, expected) in [
        (-1, "has no dynamic axis, unlike \"obs\" of the same length: exporters make the mean"),
        (1, "has the name of a constant of the network: exporters make the mean"),
    ] {
        let mut file = File::default();
        file.input("obs", &[rows, 4]);
        file.input("model/normalization_1/Sub/y:0", &[1, 4]);
        file.write(
            &["model/normalization_1/Sub/y:0"],
            "centred = Sub(obs, x)\naction := Identity(gemm(centred, 4, 4))",
        );
        file.output("action", &[rows, 4]);
        refused(&file.bytes(), expected);
    }
    Ok(())
}
