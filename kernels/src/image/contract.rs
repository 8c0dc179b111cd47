//! The action contract: arrays of f32 bits, with a value for each value of an action. `docs/FORMAT.md` has the order in
//! which they apply.

use super::view::Image;

/// Arrays of the action contract.
pub const CONTRACT_ARRAYS: usize = 10;
/// First of the four binarization arrays, of which an image has all or none.
pub(super) const ARRAY_BINARISE: usize = 6;

impl<'a> Image<'a> {
    writer_methods! {
        /// Returns the arrays, in their order: scale, offset, low, high, max_step, smoothing, on, off, on_value,
        /// off_value. An array that the contract does not have is empty.
        fn contract_arrays(&self) -> [&'a [u32]; CONTRACT_ARRAYS] {
            let mut offset = self.header.contract();
            core::array::from_fn(|which| {
                let len = if self.has_contract(which) { self.act_len() } else { 0 };
                let array = self.section(offset, len);
                offset += array.len();
                array
            })
        }
    }

    /// Returns the lower and upper limit of action value `i`, if the contract has one of them; the other is infinite.
    /// (If it limits only other values, f32's largest number means no limit.)
    pub fn limits(&self, i: usize) -> Option<[f32; 2]> {
        if i >= self.act_len() {
            return None;
        }
        let [_, _, low, high, ..] = self.contract_of(i);
        let low = if low > f32::MIN { low } else { f32::NEG_INFINITY };
        let high = if high < f32::MAX { high } else { f32::INFINITY };
        (low.is_finite() || high.is_finite()).then_some([low, high])
    }

    /// Returns the contract of action value `i`, with neutral numbers for the arrays that the contract does not have.
    pub(crate) fn contract_of(&self, i: usize) -> [f32; CONTRACT_ARRAYS] {
        let mut numbers = [1.0, -0.0, f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY, 1.0, 0.0, 0.0, 0.0, 0.0];
        let (mut flags, len) = (self.header.contract_flags(), self.act_len());
        let mut at = self.header.contract().wrapping_add(i);
        for number in &mut numbers {
            if flags == 0 {
                break;
            }
            if flags & 1 == 1 {
                *number = f32::from_bits(self.word(at));
                at = at.wrapping_add(len);
            }
            flags >>= 1;
        }
        numbers
    }

    /// Returns the number of arrays.
    pub(super) fn contract_count(&self) -> usize {
        self.header.contract_flags().count_ones() as usize
    }

    /// Returns `true` if the contract has array `which`.
    pub(super) fn has_contract(&self, which: usize) -> bool {
        self.header.contract_flags() >> which & 1 == 1
    }
}
