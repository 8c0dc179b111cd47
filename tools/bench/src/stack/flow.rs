//! The depth of a function's own stack, in total and at its calls, found by following its instructions on all paths.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context as _, Result, bail, ensure};

use super::program::{Function, Half, Program};
use super::step::{LR, Step, zero_after};
use crate::instruction::{Class, Instruction};

/// Registers that a call may change: r0 to r3, r12 and the link register (AAPCS).
const CALLER_SAVED: u32 = 0x500f;

/// The fillers of an assembler for words, unless they are 0; the second one is MOV of r8 to itself, of Armv6-M.
const NOPS: [u16; 2] = [0xbf00, 0x46c0];

/// Bytes before a computed branch in which the address of the branches is taken.
pub(super) const ADDRESS_WINDOW: u32 = 32;

/// Returns the register and the address of ADR.
pub(super) fn address_of(at: u32, first: u16, second: u16) -> Option<(u32, u32)> {
    let pc = at.wrapping_add(4) & !3;
    let [first, second] = [first, second].map(u32::from);
    match first {
        _ if first >> 11 == 0b10100 => Some((first >> 8 & 7, pc + 4 * (first & 0xff))),
        _ if first & 0xfbff == 0xf20f && second & 0x8000 == 0 => {
            Some((second >> 8 & 0xf, pc + ((first & 0x400) << 1 | (second & 0x7000) >> 4 | second & 0xff)))
        }
        _ => None,
    }
}

/// The target of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Callee {
    /// The function at an address.
    Function(u32),
    /// Anything that a pointer points to.
    Pointer,
}

/// A function's stack.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Frame {
    /// Maximum, bytes.
    pub(super) bytes: u32,
    /// Maximum bytes at the calls of each function.
    pub(super) calls: BTreeMap<Callee, u32>,
}

/// The known state before an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct State {
    /// Depth of the stack, bytes.
    pub(super) depth: i32,
    /// The registers that hold the return address.
    link: u32,
    /// The flag Z, if known.
    zero: Option<bool>,
}

/// Follows a function from its begin. An error names the unknown instruction, or the two paths that contradict each
/// other.
pub(super) fn frame(program: &Program, function: &Function) -> Result<Frame> {
    let mut walk = Walk {
        program,
        function,
        frame: Frame::default(),
        known: BTreeMap::new(),
        left: Vec::new(),
        reached: BTreeSet::new(),
    };
    walk.meet(function.address, State { depth: 0, link: 1 << LR, zero: None })?;
    while let Some(place @ (at, _)) = walk.left.pop() {
        let state = walk.known[&place];
        for (next, state) in walk.step(at, state)? {
            walk.meet(next, state)?;
        }
    }
    walk.all_is_reached()?;
    Ok(walk.frame)
}

pub(super) struct Walk<'p> {
    pub(super) program: &'p Program,
    function: &'p Function,
    frame: Frame,
    /// The known state at each place. A kernel may have more on its stack when the flag Z is set: these are two places.
    pub(super) known: BTreeMap<(u32, Option<bool>), State>,
    /// Places whose successors are still to be followed.
    left: Vec<(u32, Option<bool>)>,
    /// Addresses of the visited instructions.
    pub(super) reached: BTreeSet<u32>,
}

impl Walk<'_> {
    /// Adds a path that reaches an instruction.
    fn meet(&mut self, at: u32, state: State) -> Result<()> {
        let place = (at, state.zero);
        let before = self.known.get(&place).copied();
        let depth = before.map_or(state.depth, |before| before.depth);
        ensure!(depth == state.depth, "{at:#x} is reached with {depth} and with {} bytes of stack", state.depth);
        let met = State { link: state.link & before.map_or(u32::MAX, |before| before.link), ..state };
        if before != Some(met) {
            self.known.insert(place, met);
            self.left.push(place);
        }
        Ok(())
    }

    fn halves(&self, at: u32) -> Result<[u16; 2]> {
        let halves = self.program.halves(at).filter(|_| self.holds(at));
        halves.with_context(|| format!("{at:#x} is reached, where no code of the function is"))
    }

    pub(super) fn holds(&self, at: u32) -> bool {
        at.wrapping_sub(self.function.address) < self.function.size && self.program.is_code(at)
    }

    /// Returns the successors of an instruction, and the state at each.
    fn step(&mut self, at: u32, state: State) -> Result<Vec<(u32, State)>> {
        let [first, second] = self.halves(at)?;
        let instruction = Instruction::decode(first, second);
        let step = self.resolved(at, Step::decode(at, first, second), state.depth)?;
        let next = at + instruction.size as u32;
        self.reached.insert(at);
        let mut after = State {
            link: state.link & !(instruction.writes | instruction.address),
            zero: zero_after(state.zero, first, second),
            ..state
        };
        Ok(match step {
            Step::Next => {
                // MOV of registers: a copy of the return address.
                let (from, to) = (u32::from(first >> 3 & 0xf), u32::from(first >> 4 & 8 | first & 7));
                if first >> 8 == 0x46 && state.link >> from & 1 == 1 {
                    after.link |= 1 << to;
                }
                vec![(next, after)]
            }
            Step::Stack(bytes) => {
                after.depth += bytes;
                ensure!(after.depth >= 0, "{at:#x} pops what the function has not pushed");
                // A function pushes the caller's return address from the link register, and so pops it to that
                // register.
                if bytes < 0 && instruction.writes >> LR & 1 == 1 {
                    after.link |= 1 << LR;
                }
                self.frame.bytes = self.frame.bytes.max(after.depth as u32);
                vec![(next, after)]
            }
            Step::SetStack(register) => {
                // Code that ends the program resets the stack. Treat it as if it continued at its depth, which is not
                // less.
                let begin = self.program.symbol("_stack_start")?;
                let set = self.constant_before(at, register).or_else(|| self.literal_before(at, register));
                ensure!(set == Some(begin), "{at:#x} sets the stack pointer, not to the stack's begin");
                vec![(next, after)]
            }
            Step::If { mask, condition } => self.conditional(next, state, mask, condition)?,
            Step::Conditional { to, zero } => {
                let may_be = |flag: Option<bool>| flag.is_none_or(|flag| state.zero.is_none_or(|zero| zero == flag));
                let mut ways = Vec::new();
                if may_be(zero) {
                    ways = self.jump(to, State { zero: zero.or(state.zero), ..state });
                }
                let other = zero.map(|zero| !zero);
                if may_be(other) {
                    ways.push((next, State { zero: other.or(state.zero), ..state }));
                }
                ways
            }
            Step::Branch(to) => self.jump(to, state),
            Step::BranchRegister(register) if state.link >> register & 1 == 1 => self.end(at, state)?,
            Step::BranchRegister(_) => {
                self.call(Callee::Pointer, state);
                Vec::new()
            }
            Step::Table(size) => self.table(at, at + 4, at + 4, size)?.into_iter().map(|to| (to, after)).collect(),
            Step::Offset(register) => self.offsets(at, register)?.into_iter().map(|to| (to, after)).collect(),
            Step::Branches => {
                let register = u32::from(first >> 3 & 0xf);
                let to = match self.addresses(at, register) {
                    Some(addresses) => addresses?.into_iter().collect(),
                    None => self.branches(at, register, next.next_multiple_of(4))?,
                };
                to.into_iter().map(|to| (to, after)).collect()
            }
            Step::Steps => self.steps(at, next.next_multiple_of(4))?.map(|to| (to, after)).collect(),
            // A far branch of Armv6-M, whose B does not reach as far as its BL.
            Step::Call(to) if to != self.function.address && self.holds(to) => vec![(to, after)],
            Step::Call(_) | Step::CallRegister => {
                let callee = if let Step::Call(to) = step { Callee::Function(to) } else { Callee::Pointer };
                self.call(callee, state);
                after = State { link: after.link & !CALLER_SAVED, zero: None, ..after };
                // If no code follows, except a filler, the callee does not return.
                let is_filler = self.program.halves(next).is_some_and(|[half, _]| NOPS.contains(&half));
                let place = if is_filler { next + 2 } else { next };
                if self.holds(place) { vec![(next, after)] } else { Vec::new() }
            }
            Step::Return(bytes) => self.end(at, State { depth: state.depth - bytes, ..state })?,
            Step::Trap => Vec::new(),
            Step::AddToStack(_) | Step::RestoreStack(_) | Step::Unknown => {
                bail!("{at:#x}: {first:04x} {second:04x} is not understood")
            }
        })
    }

    fn call(&mut self, callee: Callee, state: State) {
        let depth = self.frame.calls.entry(callee).or_default();
        *depth = (*depth).max(state.depth as u32);
    }

    /// Handles a branch: inside the function, or a tail call.
    fn jump(&mut self, to: u32, state: State) -> Vec<(u32, State)> {
        if to.wrapping_sub(self.function.address) < self.function.size {
            return vec![(to, state)];
        }
        self.call(Callee::Function(to), state);
        Vec::new()
    }

    fn end(&self, at: u32, state: State) -> Result<Vec<(u32, State)>> {
        ensure!(state.depth == 0, "{at:#x} returns with {} bytes of stack left", state.depth);
        Ok(Vec::new())
    }

    /// Follows the paths through the instructions after IT: with the condition true, and with it false.
    fn conditional(&mut self, begin: u32, state: State, mask: u32, condition: u32) -> Result<Vec<(u32, State)>> {
        let count = 4 - mask.trailing_zeros();
        let mut ways = Vec::new();
        'ways: for holds in [true, false] {
            // Only here MOVS and others do not set the flags.
            let (mut at, mut state, mut compared) = (begin, State { zero: None, ..state }, false);
            for i in 0..count {
                let [first, second] = self.halves(at)?;
                let instruction = Instruction::decode(first, second);
                // The first is executed if the condition is true, each other one if its bit of the mask equals the
                // condition's.
                let executed = (i == 0 || mask >> (4 - i) & 1 == condition) == holds;
                let step = Step::decode(at, first, second);
                ensure!(!compared || step == Step::Next, "{at:#x} depends on flags that are set after IT");
                let sets_flags = instruction.writes & 0x7fff == 0 || instruction.size == 4 && first & 0x10 != 0;
                compared |= matches!(instruction.class, Class::Alu | Class::FloatMove) && sets_flags;
                let next = at + instruction.size as u32;
                if executed {
                    let mut after = self.step(at, state)?;
                    after.iter_mut().for_each(|(_, after)| after.zero = None);
                    match after[..] {
                        [(to, after)] if to == next => state = after,
                        _ => {
                            ways.extend(after);
                            continue 'ways;
                        }
                    }
                }
                at = next;
            }
            ways.push((at, state));
        }
        Ok(ways)
    }

    /// Returns the targets of a table at `begin` with halves of the distances from `base`, as of TBB and TBH: it ends where
    /// code begins, and before its first target.
    pub(super) fn table(&self, at: u32, begin: u32, base: u32, size: u32) -> Result<BTreeSet<u32>> {
        let end = self.program.data_end(begin).filter(|_| !self.program.is_code(begin));
        let mut end = end.with_context(|| format!("{at:#x} branches by a table that is not marked as data"))?;
        let mut targets = BTreeSet::new();
        let mut entry = begin;
        while entry + size <= end {
            let half = self.program.halves(entry).unwrap_or_default()[0];
            let offset = if size == 1 { half & 0xff } else { half };
            // These fill the last word.
            if offset != 0 && !NOPS.contains(&offset) {
                let target = base + 2 * u32::from(offset);
                targets.insert(target);
                end = end.min(target);
            }
            entry += size;
        }
        ensure!(!targets.is_empty(), "{at:#x} branches by an empty table");
        Ok(targets)
    }

    /// Returns the addresses of the branches, four bytes each, from `begin` on, at a word boundary, one of whose
    /// addresses `register` holds. The last of them may be followed by an unrelated branch; its path exists, too.
    fn branches(&self, at: u32, register: u32, begin: u32) -> Result<Vec<u32>> {
        let before: Vec<(u32, [u16; 2])> = (self.reached.range(at.saturating_sub(ADDRESS_WINDOW)..at))
            .filter_map(|&before| Some((before, self.program.halves(before)?)))
            .collect();
        // ADD of a register, shifted by 2, to the address from ADR.
        let is_addressed = before.iter().any(|&(place, [first, second])| {
            address_of(place, first, second).is_some_and(|(to, address)| {
                let added = [0xeb00 | to, register << 8 | 0x80];
                address == begin
                    && before.iter().any(|&(_, [first, second])| added == [first, second & 0xfff0].map(u32::from))
            })
        });
        ensure!(is_addressed, "{at:#x} sets the program counter to what is not followed here");
        let is_branch = |entry: &u32| {
            let halves = self.program.halves(*entry).filter(|_| self.holds(*entry));
            halves.is_some_and(|[first, second]| {
                first & 0xf800 == 0xf000 && matches!(Step::decode(*entry, first, second), Step::Branch(_))
            })
        };
        let entries: Vec<u32> = (begin..).step_by(4).take_while(is_branch).collect();
        ensure!(!entries.is_empty(), "{at:#x} chooses from branches that are not there");
        Ok(entries)
    }

    /// Returns the eight steps of equal size from `begin` on. A kernel of Helium (`row_eight` in
    /// `kernels/src/arch/helium/gemv.s`) enters its loop at one of them: AND of r4 with 7, ADR of `begin`, ADDS of the
    /// Thumb bit, MOV of the size, MLA, and STR of the address.
    fn steps(&self, at: u32, begin: u32) -> Result<impl Iterator<Item = u32> + use<>> {
        let code = |before| {
            let place = at.checked_sub(before).filter(|place| self.reached.contains(place));
            place.and_then(|place| self.program.halves(place)).unwrap_or_default()
        };
        let fixed = [(38, [0xf004, 0x0407]), (30, [0xf118, 0x0801]), (22, [0xfb04, 0x880a]), (12, [0xf8cd, 0x8008])];
        let [[first, second], [_, size]] = [34, 26].map(code);
        let is_computed = fixed.into_iter().all(|(before, halves)| code(before) == halves)
            && address_of(at.wrapping_sub(34), first, second) == Some((8, begin))
            && [code(26)[0], size & 0xff00] == [0xf04f, 0x0a00];
        ensure!(is_computed, "{at:#x} loads the program counter with what is not followed here");
        Ok((0..8).map(move |step| begin + step * u32::from(size & 0xff)))
    }

    /// Returns the constant that MOVW and MOVT have put into a register, right before an instruction.
    fn constant_before(&self, at: u32, register: u32) -> Option<u32> {
        let half = |before| self.program.halves(at - before).and_then(Half::decode);
        let (low, high) = (half(8)?, half(4)?);
        let fit = !low.is_high && high.is_high && [low.register, high.register] == [register as usize; 2];
        fit.then_some(high.value << 16 | low.value)
    }

    /// Checks that all code of the function was visited, except word fillers.
    fn all_is_reached(&self) -> Result<()> {
        // Branches that a known flag excludes, as compilers for Armv6-M make them for far places.
        let mut excluded = BTreeSet::new();
        for &at in &self.reached {
            if let Some(Step::Conditional { to, .. }) = self.program.halves(at).map(|[a, b]| Step::decode(at, a, b)) {
                excluded.extend([to, at + 2]);
            }
        }
        let mut at = self.function.address;
        while at < self.function.address + self.function.size {
            let size = match self.program.halves(at) {
                Some([first, second]) if self.program.is_code(at) => {
                    let step = Step::decode(at, first, second);
                    let is_excluded = matches!(step, Step::Branch(_)) && excluded.contains(&at);
                    // The compiler puts UDF after a call that does not return.
                    let fills = first == 0 || NOPS.contains(&first) || step == Step::Trap || is_excluded;
                    ensure!(self.reached.contains(&at) || fills, "{at:#x} is not reached: a way into it is missing");
                    Instruction::decode(first, second).size as u32
                }
                _ => 2,
            };
            at += size;
        }
        Ok(())
    }
}
