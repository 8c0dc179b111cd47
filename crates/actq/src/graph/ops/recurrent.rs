use crate::error::{Result, ensure};
use crate::graph::syntax::{Keys, required};

/// Keys of a recurrent cell in policy.json.
pub(super) const KEYS: &[&str] = &["hidden", "gates", "w_ih", "w_hh", "b_ih", "b_hh"];

/// The parts of a recurrent cell, by torch's names.
pub(super) struct Parts {
    pub(super) hidden: usize,
    pub(super) w_ih: usize,
    pub(super) w_hh: usize,
    pub(super) b_ih: Vec<f32>,
    pub(super) b_hh: Vec<f32>,
}

impl Parts {
    /// Reads a cell with gates in this order.
    pub(super) fn read(op: &mut dyn Keys, order: &str) -> Result<Self> {
        let hidden = required(op.count("hidden")?, "hidden")?;
        ensure!((1..=usize::from(u16::MAX)).contains(&hidden), "hidden is {hidden}; it must be 1 to 65535");
        if let Some(gates) = op.text("gates")? {
            ensure!(gates == order, "gates are {gates:?}; only torch's order {order:?} is supported");
        }
        let rows = order.split(',').count() * hidden;
        let (w_ih, _) = op.matrix("w_ih", Some(rows), op.input_len())?;
        let (w_hh, _) = op.matrix("w_hh", Some(rows), hidden)?;
        Ok(Self { hidden, w_ih, w_hh, b_ih: op.bias("b_ih", rows)?, b_hh: op.bias("b_hh", rows)? })
    }
}
