//! Liveness of an image's scratch words, operation by operation.

use actq_kernels::Image;
use actq_kernels::image::{OpKind, Region};

/// The operation of a step that needs the most memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peak {
    /// Index of the operation.
    pub op: usize,
    /// Words that this operation or a later one needs: the lower bound of any placement.
    pub words: usize,
    /// Words that the image reserves for the outputs of operations.
    pub placed: usize,
}

/// Finds the first operation at which the most words are live. A word is live from its write to its last read. A word
/// that every denoising step reads is live through all of them.
pub fn peak(image: &Image<'_>) -> Peak {
    let (first, end) = (image.observation().range().end, image.action().offset);
    let words = |region: Region| region.range().filter(|word| (first..end).contains(word)).map(|word| word - first);
    let ops: Vec<_> = image.ops().collect();
    let mut live = vec![false; end.saturating_sub(first)];
    // A chunk is played over several steps.
    words(image.output()).for_each(|word| live[word] = true);
    let mut peak = Peak { op: 0, words: 0, placed: live.len() };
    let order = |from: usize| (from..ops.len()).rev();
    // Denoising steps run twice: the first operation of a step reads values from the step before.
    let rounds = if image.denoising_steps() > 1 {
        order(image.first_denoising_op()).chain(order(0))
    } else {
        order(0).chain(order(ops.len()))
    };
    for i in rounds {
        let op = &ops[i];
        for region in [op.dst(), op.src(), op.third()] {
            words(region).for_each(|word| live[word] = true);
        }
        let needed = live.iter().filter(|word| **word).count();
        if needed >= peak.words {
            (peak.op, peak.words) = (i, needed);
        }
        if !op.reads_dst() {
            words(op.dst()).for_each(|word| live[word] = false);
        }
        if op.kind == OpKind::Denoise {
            words(op.third()).for_each(|word| live[word] = false);
        }
        words(op.src()).for_each(|word| live[word] = true);
    }
    peak
}
