use actq_kernels::image::OpKind;
use ndarray::{Array2, s};

use crate::error::{Result, ensure};
use crate::graph::lowering::{BufferId, Lifetime, Lowering, Slice, StepData};
use crate::graph::operation::{Backward, Elements, Forward, NodeState, Operation, Saved};
use crate::graph::values::{ValueId, WeightMatrix};

/// A range of an input's elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// First element.
    pub from: usize,
    /// Elements.
    pub len: usize,
}

/// A part of each input, concatenated.
#[derive(Clone, Debug, PartialEq)]
pub struct Concat(pub Vec<Span>);

impl Operation for Concat {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let spans = &self.0;
        ensure!(spans.len() == inputs.len(), "it has {} parts for {} inputs", spans.len(), inputs.len());
        for (span, len) in spans.iter().zip(inputs) {
            let to = span.from + span.len;
            ensure!(span.len > 0 && to <= *len, "{}:{to} reaches beyond the input's {len} values", span.from);
        }
        Ok(spans.iter().map(|span| span.len).sum())
    }

    fn elements(&self) -> Elements {
        Elements::Parts(self.0.iter().map(|span| span.from..span.from + span.len).collect())
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        let mut joined = Array2::zeros((run.samples(), self.0.iter().map(|span| span.len).sum()));
        let mut at = 0;
        for (x, span) in run.inputs().zip(&self.0) {
            let part = x.slice(s![.., span.from..span.from + span.len]);
            joined.slice_mut(s![.., at..at + span.len]).assign(&part);
            at += span.len;
        }
        (joined, Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: Saved, dy: Array2<f32>, _: &mut NodeState) {
        let mut from = 0;
        for (i, span) in self.0.iter().enumerate() {
            let mut d = Array2::zeros(run.input(i).raw_dim());
            d.slice_mut(s![.., span.from..span.from + span.len]).assign(&dy.slice(s![.., from..from + span.len]));
            run.give(i, d);
            from += span.len;
        }
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        // The observation's buffer ends before its prefix.
        if self.0.iter().zip(inputs).all(|(span, &input)| input == 0 && span.from >= to.place(0).len) {
            return to.buffer(len, Lifetime::Outside);
        }
        let dst = to.buffer(len, Lifetime::Step);
        let mut offset = 0;
        for (span, &input) in self.0.iter().zip(inputs) {
            let part = Slice { buffer: dst, offset, len: span.len };
            let from = Slice { offset: span.from, len: span.len, ..to.place(input) };
            to.emit(OpKind::Copy, part, Some(from), None, StepData::None);
            offset += span.len;
        }
        dst
    }
}
