//! The executor: runs an image's operations on an observation, keeps the recurrent state and the chunk queue, and applies the
//! action contract.

use crate::activations::NotFinite;
use crate::error::{HeadError, StepError};
use crate::image::{Image, Op, Region};
use crate::math::clamp;
use crate::{norm, recurrent};

/// A head: an image and the scratch memory that it runs in.
#[derive(Debug)]
pub struct Head<'a, 's> {
    image: Image<'a>,
    arena: &'s mut [u32],
    /// Actions of the current chunk that have been played; 0 = the network must run.
    played: usize,
    /// Whether an action has been given since the reset, so that the step limit has something to hold on to.
    started: bool,
}

impl<'a, 's> Head<'a, 's> {
    /// Takes `scratch`, of at least [`Image::scratch_words`] words, and resets.
    pub fn new(image: Image<'a>, scratch: &'s mut [u32]) -> Result<Self, HeadError> {
        let (needed, given) = (image.scratch_words(), scratch.len());
        let arena = scratch.get_mut(..needed).ok_or(HeadError::ScratchTooSmall { needed, given })?;
        // Nothing depends on what the memory held.
        arena.fill(0);
        let mut head = Self { image, arena, played: 0, started: false };
        head.reset();
        Ok(head)
    }

    /// Forgets the recurrent state, the rest of a chunk and the last action.
    pub fn reset(&mut self) {
        if let Some(state) = self.arena.get_mut(self.image.state().range()) {
            state.fill(0);
        }
        self.played = 0;
        self.started = false;
    }

    /// The recurrent state, to read or to set: of each operation in order an LSTM's hidden, then cell state, or a GRU's state.
    /// A reset zeroes it.
    pub fn state_mut(&mut self) -> &mut [f32] {
        self.floats_mut(self.image.state())
    }

    /// The image.
    pub fn image(&self) -> &Image<'a> {
        &self.image
    }

    /// The action for `observation`: of the next chunk position where the image is chunked, after the action contract.
    ///
    /// On an error the head resets itself, so that no part of a failed evaluation reaches a later action.
    pub fn step(&mut self, observation: &[f32]) -> Result<&[f32], StepError> {
        self.try_step(observation).inspect_err(|_| self.reset())?;
        Ok(self.floats(self.image.action()))
    }

    fn try_step(&mut self, observation: &[f32]) -> Result<(), StepError> {
        self.load(observation)?;
        self.advance()
    }

    /// One step on the observation that the arena holds.
    fn advance(&mut self) -> Result<(), StepError> {
        if self.played == 0 {
            self.evaluate()?;
        }
        self.act()?;
        self.played += 1;
        if self.played == self.image.execute() {
            self.played = 0;
        }
        Ok(())
    }

    /// The network's raw output for `observation` (`chunk * act_len` values), before the action contract. Advances the
    /// recurrent state, and drops what was left of a chunk.
    pub fn infer(&mut self, observation: &[f32]) -> Result<&[f32], StepError> {
        self.played = 0;
        let outcome = self.load(observation).and_then(|()| self.evaluate());
        outcome.inspect_err(|_| self.reset())?;
        Ok(self.floats(self.image.output()))
    }

    /// Plays the image's self-test vector from a reset and compares every action bit for bit; resets again at the end.
    pub fn self_test(&mut self) -> Result<(), StepError> {
        self.reset();
        let outcome = self.play_self_test();
        self.reset();
        outcome
    }

    fn play_self_test(&mut self) -> Result<(), StepError> {
        let mut step = 0;
        while let Some((observation, expected)) = self.image.self_test(step) {
            for (to, from) in self.floats_mut(self.image.observation()).iter_mut().zip(observation) {
                *to = f32::from_bits(u32::from_le(*from));
            }
            self.advance()?;
            let action = self.floats(self.image.action());
            if !action.iter().map(|a| a.to_bits()).eq(expected.iter().map(|w| u32::from_le(*w))) {
                return Err(StepError::SelfTest { step });
            }
            step += 1;
        }
        Ok(())
    }

    /// Checks the observation and puts it into the arena.
    fn load(&mut self, observation: &[f32]) -> Result<(), StepError> {
        let (expected, given) = (self.image.obs_len(), observation.len());
        if expected != given {
            return Err(StepError::ObservationLength { expected, given });
        }
        if let Some(index) = observation.iter().position(|v| !v.is_finite()) {
            return Err(StepError::ObservationNotFinite { index });
        }
        for (to, from) in self.floats_mut(self.image.observation()).iter_mut().zip(observation) {
            *to = *from;
        }
        Ok(())
    }

    fn evaluate(&mut self) -> Result<(), StepError> {
        let work = self.image.work();
        for op in self.image.ops() {
            run(&op, self.arena, work).map_err(|NotFinite| StepError::NotFinite)?;
        }
        Ok(())
    }

    /// Takes the chunk's current action through the contract.
    fn act(&mut self) -> Result<(), StepError> {
        let contract = self.image.contract();
        let (output, action) = (self.image.output(), self.image.action());
        let position = self.played * action.len;
        let step_limits = if self.started { contract.max_step } else { &[] };
        let Ok([output, action]) = self.arena.get_disjoint_mut([output.range(), action.range()]) else {
            return Err(StepError::NotFinite);
        };
        let at = |array: &[u32], i: usize| array.get(i).map(|w| f32::from_bits(u32::from_le(*w)));
        for (i, (action, raw)) in action.iter_mut().zip(output.iter().skip(position)).enumerate() {
            let mut a = f32::from_bits(*raw);
            if let Some(scale) = at(contract.scale, i) {
                a *= scale;
            }
            if let Some(offset) = at(contract.offset, i) {
                a += offset;
            }
            if !a.is_finite() {
                return Err(StepError::NotFinite);
            }
            if let Some(low) = at(contract.low, i) {
                a = clamp(a, low, f32::MAX);
            }
            if let Some(high) = at(contract.high, i) {
                a = clamp(a, f32::MIN, high);
            }
            if let Some(step) = at(step_limits, i) {
                let last = f32::from_bits(*action);
                a = clamp(a, last - step, last + step);
            }
            *action = a.to_bits();
        }
        self.started = true;
        Ok(())
    }

    fn floats(&self, region: Region) -> &[f32] {
        bytemuck::cast_slice(self.arena.get(region.range()).unwrap_or(&[]))
    }

    fn floats_mut(&mut self, region: Region) -> &mut [f32] {
        bytemuck::cast_slice_mut(self.arena.get_mut(region.range()).unwrap_or(&mut []))
    }
}

/// The regions of an operation as slices; `None` where they overlap or lie outside, which the image's check has excluded.
fn regions<const N: usize>(arena: &mut [u32], regions: [Region; N]) -> Option<[&mut [u32]; N]> {
    arena.get_disjoint_mut(regions.map(Region::range)).ok()
}

fn run(op: &Op<'_>, arena: &mut [u32], work: Region) -> Result<(), NotFinite> {
    let f = bytemuck::cast_slice_mut::<u32, f32>;
    match *op {
        Op::Normalize { src, dst, mean, scale, pre_clip, clip } => {
            if let Some([src, dst]) = regions(arena, [src, dst]) {
                norm::normalize(f(src), mean, scale, pre_clip, clip, f(dst));
            }
        }
        Op::Linear { src, dst, matrix, accumulate } => {
            if let Some([src, dst, work]) = regions(arena, [src, dst, work]) {
                matrix.apply(f(src), work, f(dst), accumulate)?;
            }
        }
        Op::Function { dst, function } => {
            if let Some([dst]) = regions(arena, [dst]) {
                function.apply(f(dst));
            }
        }
        Op::LayerNorm { dst, weight, bias, eps } => {
            if let Some([dst]) = regions(arena, [dst]) {
                norm::layer_norm(f(dst), weight, bias, eps);
            }
        }
        Op::RmsNorm { dst, weight, eps } => {
            if let Some([dst]) = regions(arena, [dst]) {
                norm::rms_norm(f(dst), weight, eps);
            }
        }
        Op::Add { src, dst } => {
            if let Some([src, dst]) = regions(arena, [src, dst]) {
                for (to, from) in f(dst).iter_mut().zip(f(src)) {
                    *to += *from;
                }
            }
        }
        Op::Copy { src, dst } => {
            if let Some([src, dst]) = regions(arena, [src, dst]) {
                for (to, from) in dst.iter_mut().zip(src) {
                    *to = *from;
                }
            }
        }
        Op::LstmCell { src, dst, cell } => {
            if let Some([src, dst, cell]) = regions(arena, [src, dst, cell]) {
                recurrent::lstm_cell(f(src), f(cell), f(dst));
            }
        }
        Op::GruCell { src, dst, hidden } => {
            if let Some([src, dst, hidden]) = regions(arena, [src, dst, hidden]) {
                recurrent::gru_cell(f(src), f(hidden), f(dst));
            }
        }
    }
    Ok(())
}
