//! Attention to the tokens of earlier steps: inputs that hold their keys and values, whose next values are outputs.

use std::collections::HashMap;

use crate::states::Output;
use crate::values::elements::{needed, value};
use crate::values::expr::{Attention, Expr, Exprs, Id};
use crate::values::tensor::Element;

/// Attentions with a window of tokens in inputs.
#[derive(Default)]
pub(crate) struct Caches {
    /// Attention that keeps the window itself, for each in the file.
    pub(crate) instead: HashMap<Id, Id>,
    /// Indices of the inputs and of the outputs with their next values, by the attention that keeps them.
    pub(crate) pairs: HashMap<Id, Vec<(usize, usize)>>,
    /// Reasons why the attention that reads an input, by its index, cannot keep it.
    pub(crate) reasons: HashMap<usize, &'static str>,
}

const SEVERAL: &str = "an evaluation reads several tokens after them; export a step of one token";
const UNMASKED: &str = "attention sees all of them after a reset, when they are zeros and no tokens; export a mask \
                        of the window as an input, too, with its next value as an output: zeros at first, and 1 for \
                        every token";
const LOST: &str = "no output is its next value: the same tokens without the first, then the new one; export it as \
                    an output of the same shape";

/// The first elements of a vector that are those of a graph input.
struct Past {
    /// Index of the input.
    input: usize,
    len: usize,
    /// Element of the input for each of the first elements.
    at: Vec<usize>,
}

impl Caches {
    /// Finds the attentions that the outputs need.
    pub(crate) fn find(exprs: &mut Exprs, outputs: &[Output]) -> Self {
        let mut found = Self::default();
        for id in needed(exprs, outputs.iter().flat_map(|output| output.value.elements())) {
            if let Expr::Attention(of) = exprs.get(id) {
                let of = Attention::clone(of);
                found.keep(exprs, outputs, id, of);
            }
        }
        found
    }

    /// Replaces an attention to earlier tokens, or notes why it cannot be.
    fn keep(&mut self, exprs: &mut Exprs, outputs: &[Output], id: Id, of: Attention) {
        let width = of.kv_heads * of.dim;
        let tokens = exprs.len_of(of.keys) / width;
        let [keys, values] = [of.keys, of.values].map(|id| exprs.elements(id));
        let before = (tokens - 1) * width;
        let (Some(of_keys), Some(of_values)) = (past(exprs, &keys[..before]), past(exprs, &values[..before])) else {
            return;
        };
        let mut note = |reason| [&of_keys, &of_values].map(|past| self.reasons.insert(past.input, reason));
        if exprs.len_of(of.queries) != of.heads * of.dim {
            note(SEVERAL);
            return;
        }
        let valid: Vec<Element> = of.valid.iter().flatten().map(|&(id, i)| Element::Of(id, i)).collect();
        let is_masked = of.valid.len() == tokens && valid.len() + 1 == tokens && of.valid[tokens - 1].is_none();
        let Some(of_valid) = past(exprs, &valid).filter(|_| is_masked) else {
            note(UNMASKED);
            return;
        };
        let next_valid = [&valid[..], &[Element::Known(1.0)]].concat();
        let states = [(&of_keys, &keys, width), (&of_values, &values, width), (&of_valid, &next_valid, 1)];
        let pair = |(past, all, width): (&Past, &Vec<Element>, usize)| {
            Some((past.input, outputs.iter().position(|output| past.is_followed(output, &all[width..]))?))
        };
        let Some(pairs) = states.into_iter().map(pair).collect::<Option<Vec<_>>>() else {
            note(LOST);
            return;
        };
        let mut last = |all: &[Element]| {
            let elements: Vec<(Id, usize)> = all[before..].iter().filter_map(value).collect();
            exprs.vector(&elements)
        };
        let (keys, values) = (last(&keys), last(&values));
        let kept = Attention { keys, values, causal: false, valid: Vec::new(), context: tokens, ..of };
        let len = exprs.len_of(id);
        let kept = exprs.put(Expr::Attention(Box::new(kept)), len);
        exprs.keep_origin(id, kept);
        self.instead.insert(id, kept);
        self.pairs.insert(kept, pairs);
    }

    /// Returns `true` if this output is the next value of a window.
    pub(crate) fn carries(&self, output: usize) -> bool {
        self.pairs.values().flatten().any(|(_, next)| *next == output)
    }
}

/// Returns the elements of one graph input that these are.
fn past(exprs: &Exprs, elements: &[Element]) -> Option<Past> {
    let (of, _) = value(elements.first()?)?;
    let &Expr::Input(input) = exprs.get(of) else { return None };
    let at = |element: &Element| value(element).filter(|(id, _)| *id == of).map(|(_, i)| i);
    Some(Past { input, len: exprs.len_of(of), at: elements.iter().map(at).collect::<Option<_>>()? })
}

impl Past {
    /// Returns `true` if the output holds `next` where the input holds these elements.
    fn is_followed(&self, output: &Output, next: &[Element]) -> bool {
        let elements = output.value.elements();
        elements.len() == self.len && self.at.iter().zip(next).all(|(&at, next)| elements[at] == *next)
    }
}
