//! The output that is the action.

use actq::error::{Context as _, Error, Result, bail};
use actq::text::printable;

use super::options::ImportOptions;
use crate::file::model::{Model, Port};
use crate::states::{Cells, Output, is_state};
use crate::values::expr::Exprs;

/// Chooses the action output: the one of `--output`, or the only candidate, or the only one named action.
pub(super) fn choose(
    exprs: &Exprs,
    cells: &Cells,
    outputs: &[Output],
    mut errors: Vec<(String, Error)>,
    options: &ImportOptions,
) -> Result<usize> {
    if let Some(name) = &options.output {
        return outputs.iter().position(|output| output.name == *name).context("the chosen output is missing");
    }
    let mut can: Vec<usize> = (0..outputs.len()).filter(|&i| !outputs[i].value.is_known()).collect();
    if can.is_empty() {
        let (name, error) = refused(errors)
            .context("no output depends on an input; export the policy with its observation as input")?;
        return Err(error.context(format!("output {:?} cannot be imported", printable(&name))));
    }
    let is_paired = |i: &usize| cells.caches.carries(*i) || is_state(cells, exprs, &outputs[*i].value);
    let named = |i: &usize| options.states.iter().any(|(_, to)| *to == outputs[*i].name);
    for keep in [
        &(|i: &usize| !is_paired(i) && !named(i)) as &dyn Fn(&usize) -> bool,
        &|i: &usize| is_action(&outputs[*i].name),
        &|i: &usize| outputs[*i].name.to_lowercase().contains("deterministic"),
    ] {
        if can.len() > 1 && can.iter().any(keep) {
            can.retain(|i| keep(i));
        }
    }
    // An action that cannot be imported, or is constant, must not be replaced by a critic's value or a hidden state.
    let constant = outputs.iter().filter(|output| output.value.is_known() && is_action(&output.name));
    errors.extend(constant.map(|output| (output.name.clone(), Error::input("it depends on no input"))));
    let is_called = can.iter().any(|&i| is_action(&outputs[i].name));
    if !is_called && let Some((lost, error)) = refused(errors) {
        can.retain(|i| !is_paired(i) && !named(i));
        let others = match &can[..] {
            [] => "all other outputs are states".to_owned(),
            _ => format!(
                "no other output is named action; choose one by actq import --output NAME: {}",
                sizes(outputs, &can)
            ),
        };
        return Err(error.context(format!("output {:?} cannot be imported, and {others}", printable(&lost))));
    }
    match can[..] {
        [one] => Ok(one),
        _ => bail!(
            "several outputs can be the action: {}; choose one by actq import --output NAME",
            sizes(outputs, &can)
        ),
    }
}

/// Names the outputs named action that cannot be imported, with the reasons.
pub(super) fn refused_actions(errors: &[(String, Error)]) -> Vec<(String, String)> {
    let named = errors.iter().filter(|(name, _)| is_action(name));
    named.map(|(name, error)| (printable(name).into_owned(), format!("{error:#}"))).collect()
}

/// Returns the refused output named action, or else the first refused one.
fn refused(errors: Vec<(String, Error)>) -> Option<(String, Error)> {
    let at = errors.iter().position(|(name, _)| is_action(name)).unwrap_or(0);
    errors.into_iter().nth(at)
}

/// Lists outputs with their lengths, for a message.
fn sizes(outputs: &[Output], which: &[usize]) -> String {
    let one = |&i: &usize| format!("{} ({} values)", printable(&outputs[i].name), outputs[i].value.len());
    which.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Returns `true` if a name is an action's, and not that of something about actions.
fn is_action(name: &str) -> bool {
    const ABOUT: [&str; 28] = [
        "shape",
        "std",
        "logstd",
        "stddev",
        "sigma",
        "var",
        "variance",
        "logvar",
        "cov",
        "scale",
        "noise",
        "log",
        "prob",
        "probs",
        "logp",
        "logprob",
        "value",
        "values",
        "q",
        "critic",
        "advantage",
        "entropy",
        "mask",
        "prev",
        "previous",
        "last",
        "reward",
        "features",
    ];
    // Words begin at capitals, too, as in actionStd.
    let mut words = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && words.ends_with(|before: char| before.is_ascii_lowercase()) {
            words.push('_');
        }
        words.push(c);
    }
    let words = words.to_ascii_lowercase();
    let words: Vec<&str> = words.split(|c: char| !c.is_ascii_alphanumeric()).collect();
    words.iter().any(|word| word.starts_with("action")) && !words.iter().any(|word| ABOUT.contains(word))
}

/// Refuses a batch of several observations, whose actions would look like a chunk.
pub(super) fn refuse_batch(model: &Model, read: &[usize], act_shape: &[usize]) -> Result<()> {
    let &[batch, _, ..] = act_shape else { return Ok(()) };
    // A vector has no rows. One input with rows is enough, as other inputs may be the same for all rows.
    let in_rows = |i: &&usize| match model.graph.inputs[**i].shape.as_deref() {
        Some(&[first, _, ..]) => first == Some(batch),
        _ => false,
    };
    if batch > 1
        && let Some(&i) = read.iter().find(in_rows)
    {
        bail!(
            "the action and the input {:?} have {batch} rows, which is a batch, and a step has one observation; export with a batch of \
             1, and a history with a chunk of its length as [1, {batch}, n]",
            printable(&model.graph.inputs[i].name)
        );
    }
    Ok(())
}

/// Refuses a column in a file that declares a row for each observation: skl2onnx 1.20 writes the values of one action so,
/// which would look like a chunk.
pub(super) fn refuse_column(model: &Model, read: &[usize], output: &Output) -> Result<()> {
    let &[rows, 1] = &output.value.shape[..] else { return Ok(()) };
    let has_free_rows = |port: &Port| port.shape.as_deref().is_some_and(|axes| axes.first() == Some(&None));
    let declared = model.graph.outputs.iter().find(|port| port.name == output.name);
    if rows > 1 && declared.is_some_and(has_free_rows) && read.iter().any(|&i| has_free_rows(&model.graph.inputs[i])) {
        bail!(
            "the action is a column of {rows} values for one observation, and the file declares a row for each observation; export \
             [1, {rows}] for an action of {rows} values (in skl2onnx by MultiOutputRegressor), or [1, {rows}, 1] for a chunk of \
             {rows} actions"
        );
    }
    Ok(())
}

/// Returns the number of actions in the output, and the length of each.
pub(super) fn actions(shape: &[usize], n: usize) -> Result<(usize, usize)> {
    let ones = shape.iter().take_while(|&&n| n == 1).count();
    match &shape[ones..] {
        [] => Ok((1, n)),
        [n] => Ok((1, *n)),
        [chunk, n] => Ok((*chunk, *n)),
        _ => bail!(
            "the action has the shape {shape:?}; export it as [value] or [action, value], after any axes of length 1"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::is_action;

    #[test]
    fn names_about_actions_are_not_actions() {
        for name in
            ["action", "actions", "Action_Mean", "deterministic_action", "masked_actions", "elastic_action", "action0"]
        {
            assert!(is_action(name), "{name}");
        }
        for name in [
            "mu",
            "action_log_std",
            "action_value",
            "action_log_prob",
            "last_action",
            "action_mask",
            "action_shape",
            "actionStd",
            "ActionLogProb",
            "action.sigma",
            "q_action",
            "reaction_force",
            "transaction_id",
            "fractions",
        ] {
            assert!(!is_action(name), "{name}");
        }
    }
}
