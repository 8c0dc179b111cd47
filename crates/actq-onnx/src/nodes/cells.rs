//! ONNX's LSTM and GRU operators: one layer, one direction, one step.

use std::sync::Arc;

use actq::error::{Context as _, Result, bail, ensure};

use crate::nodes::call::Call;
use crate::values::elements::open_vector;
use crate::values::expr::{Cell, Expr, Exprs, Id, Matrix, Run};
use crate::values::tensor::{Element, Tensor};

/// Returns the outputs, if the node is such an operator.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Vec<Tensor>>> {
    // Place of each of our gates in ONNX's order, [i o f c] and [z r h].
    let (lstm, order): (bool, &[usize]) = match call.op() {
        "LSTM" => (true, &[0, 2, 3, 1]),
        "GRU" => (false, &[1, 0, 2]),
        "RNN" => bail!("plain recurrent cells have no kernel; use an LSTM or a GRU"),
        _ => return Ok(None),
    };
    let direction = call.text("direction").unwrap_or_else(|| "forward".to_owned());
    ensure!(direction == "forward", "runs {direction}, and a policy cannot read later steps; use forward");
    for name in ["activations", "clip", "input_forget"] {
        let given = call.node.attributes.get(name);
        let plain = match name {
            "activations" => given.is_none_or(|a| {
                let usual: &[&[u8]] = if lstm { &[b"Sigmoid", b"Tanh", b"Tanh"] } else { &[b"Sigmoid", b"Tanh"] };
                a.strings.is_empty() || a.strings.iter().map(|s| &s[..]).eq(usual.iter().copied())
            }),
            _ => given.is_none_or(|a| a.i.unwrap_or(0) == 0 && a.f.is_none_or(|f| f == 0.0)),
        };
        ensure!(plain, "sets {name}; use the plain cell");
    }
    ensure!(!lstm || call.optional(7).is_none(), "has peepholes; use the plain cell");
    let reset = "computes the reset gate before the matrix (linear_before_reset = 0, as Keras with reset_after=False); train with \
                 torch's form, or Keras' reset_after=True";
    ensure!(lstm || call.int("linear_before_reset").unwrap_or(0) != 0, "{reset}");
    let x = call.input(0)?;
    let (w, r) = (call.input(1)?, call.input(2)?);
    let (&[1, rows, cols], &[1, _, hidden]) = (&w.shape[..], &r.shape[..]) else {
        bail!("has weights of {:?} and {:?}; use one direction", w.shape, r.shape)
    };
    ensure!(
        rows == order.len() * hidden,
        "has {rows} rows of weights for {hidden} values of state; {} are needed",
        order.len() * hidden
    );
    ensure!(x.shape.len() == 3, "reads the shape {:?}, not [step, batch, value]", x.shape);
    ensure!(
        x.len() == cols,
        "reads the shape {:?}, several steps or a batch; export one step with a batch of 1",
        x.shape
    );
    if let Some(lengths) = call.optional(4) {
        ensure!(
            lengths.integers() == Some(&[1]),
            "takes the length of its sequence from sequence_lens; export one step, without that input or with a constant 1"
        );
    }
    let gated = |values: &[f64], width: usize| -> Vec<f64> {
        order.iter().flat_map(|&gate| &values[gate * hidden * width..(gate + 1) * hidden * width]).copied().collect()
    };
    let matrix = |tensor: &Tensor, i: usize, cols: usize| -> Result<Arc<Matrix>> {
        let data = call.reals(i, "a weight")?;
        ensure!(data.len() == rows * cols, "has weights of {:?}, not {rows} x {cols}", tensor.shape);
        Ok(Arc::new(Matrix { name: tensor.name.clone(), rows, cols, data: gated(&data, cols) }))
    };
    let (w_ih, w_hh) = (matrix(w, 1, cols)?, matrix(r, 2, hidden)?);
    let (b_ih, b_hh) = if call.optional(3).is_some() {
        let b = call.reals(3, "a bias")?;
        ensure!(b.len() == 2 * rows, "has {} biases; {} are needed", b.len(), 2 * rows);
        (gated(&b[..rows], 1), gated(&b[rows..], 1))
    } else {
        (vec![0.0; rows], vec![0.0; rows])
    };
    let inputs: &[(usize, &str)] = if lstm { &[(5, "hidden"), (6, "cell")] } else { &[(5, "hidden")] };
    let states = inputs.iter().map(|&(i, what)| state(call, exprs, i, what, hidden)).collect::<Result<Vec<_>>>()?;
    let x = open_vector(exprs, &x.elements())?;
    let h = exprs.put(Expr::Cell(Box::new(Cell { lstm, x, w_ih, w_hh, b_ih, b_hh, states })), hidden);
    let output = |exprs: &Exprs, id: Id, shape: Vec<usize>| Tensor::of_elements(shape, exprs.elements(id));
    let all = vec![output(exprs, h, vec![1, 1, 1, hidden]), output(exprs, h, vec![1, 1, hidden])];
    if !lstm {
        return Ok(Some(all));
    }
    let c = exprs.put(Expr::CellState(h), hidden);
    Ok(Some([all, vec![output(exprs, c, vec![1, 1, hidden])]].concat()))
}

/// Finds the run of a graph input that holds a cell's state before the step.
fn state(call: &Call<'_>, exprs: &Exprs, i: usize, what: &str, hidden: usize) -> Result<Run> {
    let carried = "export it as an input of the graph, and its next value as an output";
    let tensor =
        call.optional(i).with_context(|| format!("state {what} is not carried to the next step; {carried}"))?;
    run_of_input(exprs, &tensor.elements()).filter(|run| run.len == hidden).with_context(|| {
        format!(
            "state {what} is a constant, or an input that other nodes change first; {carried}, without the nodes that reset it, as a \
             reset clears the whole policy"
        )
    })
}

/// Returns the run of one graph input that these elements are.
pub(crate) fn run_of_input(exprs: &Exprs, elements: &[Element]) -> Option<Run> {
    let &Element::Of(of, from) = elements.first()? else { return None };
    let in_order = elements.iter().enumerate().all(|(k, e)| *e == Element::Of(of, from + k));
    (in_order && matches!(exprs.get(of), Expr::Input(_))).then_some(Run { of, from, len: elements.len() })
}
