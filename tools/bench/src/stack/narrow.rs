//! The forms of Armv6-M, whose compiled code keeps large frames' sizes and addresses of code in data (Arm DDI 0419E,
//! chapter A6).

use std::collections::BTreeSet;

use anyhow::{Context as _, Result, ensure};

use super::flow::{ADDRESS_WINDOW, Walk, address_of};
use super::step::Step;

/// The register that holds the address of a frame of variable depth.
const FRAME_POINTER: u16 = 7;

impl Walk<'_> {
    /// Returns the effect of an instruction at depth `depth`: the bytes of those that set the stack pointer by a register.
    pub(super) fn resolved(&self, at: u32, step: Step, depth: i32) -> Result<Step> {
        Ok(match step {
            Step::AddToStack(register) => {
                let size = self.literal_before(at, register);
                Step::Stack(
                    (size.with_context(|| format!("{at:#x} adds what is not followed here"))? as i32).wrapping_neg(),
                )
            }
            Step::RestoreStack(register) => Step::Stack(self.restored_depth(at, register)? - depth),
            other => other,
        })
    }

    fn half_before(&self, at: u32, before: u32) -> Option<u16> {
        let place = at.checked_sub(before).filter(|place| self.reached.contains(place))?;
        Some(self.program.halves(place)?[0])
    }

    /// Returns the constant that the instruction before `at` loads to a register.
    pub(super) fn literal_before(&self, at: u32, register: u32) -> Option<u32> {
        let half = self.half_before(at, 2).filter(|half| u32::from(half >> 8) == 0x48 | register)?;
        let address = ((at - 2 + 4) & !3) + 4 * u32::from(half & 0xff);
        Some(u32::from_le_bytes(self.program.bytes(address)?))
    }

    /// Returns the depth that a constant below the frame pointer has: SUBS of the frame pointer, and perhaps of a constant.
    fn restored_depth(&self, at: u32, register: u32) -> Result<i32> {
        let of_pointer = |half: u16| {
            let is_known = half & 0xfe3f == 0x1e00 | FRAME_POINTER << 3 | register as u16;
            is_known.then_some(i32::from(half >> 6 & 7))
        };
        let of_itself =
            |half: u16| (half & 0xff00 == 0x3800 | (register as u16) << 8).then_some(i32::from(half & 0xff));
        let [last, before] = [2, 4].map(|before| self.half_before(at, before));
        let below =
            last.and_then(of_pointer).or_else(|| Some(last.and_then(of_itself)? + before.and_then(of_pointer)?));
        // ADD of a constant to the stack pointer.
        let mut set = self.known.iter().filter_map(|((place, _), state)| {
            let half = self.program.halves(*place)?[0];
            (half >> 8 == 0xa8 | FRAME_POINTER).then_some(state.depth - 4 * i32::from(half & 0xff))
        });
        let depth = below.zip(set.next()).map(|(below, depth)| depth + below);
        let is_unique = set.next().is_none();
        depth
            .filter(|_| is_unique)
            .with_context(|| format!("{at:#x} sets the stack pointer to what is not followed here"))
    }

    /// Returns the targets of ADD to the program counter, by a table of halfwords or bytes.
    pub(super) fn offsets(&self, at: u32, register: u32) -> Result<BTreeSet<u32>> {
        let r = register as u16;
        let is_doubled = self.half_before(at, 2) == Some(0x0040 | r << 3 | r);
        let load = self.half_before(at, 4).filter(|_| is_doubled).unwrap_or_default();
        let is_in_register = self.half_before(at, 6) == Some(0x4478 | r);
        // LDRH and LDRB by a constant after ADD of the program counter, and by a register after ADR.
        let (begin, size) = match load {
            _ if load == 0x8880 | r << 3 | r && is_in_register => (Some(at + 2), 2),
            _ if load == 0x7900 | r << 3 | r && is_in_register => (Some(at + 2), 1),
            _ if load & 0xfe07 == 0x5a00 | r => (self.address_before(at, load), 2),
            _ if load & 0xfe07 == 0x5c00 | r => (self.address_before(at, load), 1),
            _ => (None, 0),
        };
        let begin = begin.with_context(|| format!("{at:#x} adds to the program counter what is not followed here"))?;
        let targets = self.table(at, begin, at + 4, size)?;
        // The data after the table may be other constants.
        Ok(targets.into_iter().filter(|target| self.holds(*target)).collect())
    }

    /// Returns the targets of MOV to the program counter, by a table of words; `None` without a load from one before it.
    pub(super) fn addresses(&self, at: u32, register: u32) -> Option<Result<BTreeSet<u32>>> {
        let is_load = |half: &u16| half & 0xfe07 == 0x5800 | register as u16;
        let load = (2..=ADDRESS_WINDOW).step_by(2).find_map(|before| self.half_before(at, before).filter(is_load))?;
        let begin = self.address_before(at, load)?;
        let end = self.program.data_end(begin).filter(|_| !self.program.is_code(begin))?;
        let words = (begin..end).step_by(4).filter_map(|place| Some(u32::from_le_bytes(self.program.bytes(place)?)));
        let targets: BTreeSet<u32> =
            words.filter(|word| word & 1 == 1 && self.holds(word - 1)).map(|word| word - 1).collect();
        let check = || {
            ensure!(!targets.is_empty(), "{at:#x} branches by an empty table");
            Ok(targets)
        };
        Some(check())
    }

    /// Returns the address from ADR to one of the registers of a load's address.
    fn address_before(&self, at: u32, load: u16) -> Option<u32> {
        let registers = [load >> 3 & 7, load >> 6 & 7].map(u32::from);
        (2..=ADDRESS_WINDOW).step_by(2).find_map(|before| {
            let half = self.half_before(at, before)?;
            let (register, address) = address_of(at - before, half, 0)?;
            registers.contains(&register).then_some(address)
        })
    }
}
