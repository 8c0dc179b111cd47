use ndarray::Array2;

use crate::error::Result;
use crate::graph::arrays::sum_rows;
use crate::graph::lowering::{BufferId, Lifetime, Lowering};
use crate::graph::operation::{
    Backward, Forward, NodeState, Operand, Operation, Product, Saved, expect_len, expect_shape, only,
};
use crate::graph::syntax::{Keys, Syntax};
use crate::graph::values::{ValueId, WeightMatrix};

/// `W x + b`
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Matrix W.
    pub matrix: usize,
    /// Biases b, one value per row.
    pub bias: Vec<f32>,
}

impl Operation for Linear {
    fn output_len(&self, matrices: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let rows = expect_shape(matrices, self.matrix, None, only(inputs)?)?;
        expect_len("bias", &self.bias, rows)?;
        Ok(rows)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let (matrix, rows) = op.matrix("w", None, op.input_len())?;
            Ok(Self { matrix, bias: op.bias("b", rows)? })
        };
        vec![Syntax { name: "linear", keys: &["w", "b"], read }]
    }

    fn products(&self) -> Vec<Product> {
        vec![Product { matrix: self.matrix, bias: 0, operand: Operand::Input }]
    }

    fn matrices_mut(&mut self) -> Vec<&mut usize> {
        vec![&mut self.matrix]
    }

    learned! { bias }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        let x = run.operand(self.matrix, run.input(0).view());
        let y = run.affine(self.matrix, &x, 0);
        (y, Saved { operands: vec![x], ..Saved::default() })
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, _: &mut NodeState) {
        let Ok([x]) = <[_; 1]>::try_from(saved.operands) else { return };
        sum_rows(&dy, &mut run.d_vectors[0]);
        run.give_through(0, self.matrix, &dy);
        run.product(self.matrix, x, dy);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        let dst = to.buffer(len, Lifetime::Step);
        to.product((self.matrix, &self.bias), to.place(inputs[0]), dst, false);
        dst
    }
}
