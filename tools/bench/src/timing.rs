//! Cycles of instructions on a core, for memory without wait states.

use crate::Target;
use crate::instruction::{Class, Instruction, Kind};

/// A core whose instructions have published timings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// Cortex-M4 Technical Reference Manual, tables 3-1 and 7-1.
    M4,
    /// Cortex-M3 Technical Reference Manual, table 18-1: as the M4, with slower multiplication.
    M3,
    /// Cortex-M0+ Technical Reference Manual, table 3-1, with the multiplier of one cycle.
    M0,
    /// Hazard3 as in the RP2350 (its documentation, "Instruction Timings"), with multiplication in one cycle: an estimate for
    /// other RV32 cores.
    Hazard3,
    /// Cortex-M55, an estimate: a vector takes two cycles, as a core that computes half of one at a time does when nothing
    /// overlaps; everything else is as on the M4.
    M55,
}

/// Cycles to refill the pipeline of a Cortex-M3 or M4 after a taken branch; the manuals give 1 to 3.
const REFILL: u64 = 2;

impl Timing {
    /// Returns the timing of a target's core.
    pub fn of(target: Target) -> Self {
        match target {
            Target::NoDsp => Self::M3,
            Target::Small | Target::V6m => Self::M0,
            Target::Riscv | Target::RiscvZb => Self::Hazard3,
            Target::M55 => Self::M55,
            Target::Fpu | Target::NoFpu | Target::M33 | Target::M7 | Target::F405 => Self::M4,
        }
    }

    /// Returns the cycles after a jump, except for a taken conditional branch.
    pub fn cycles(self, instruction: &Instruction) -> u64 {
        match (self, instruction.class) {
            // A long product has two results.
            (Self::M3, Class::Multiply) if instruction.writes.count_ones() == 2 => 4,
            (Self::M4 | Self::M3 | Self::M55, class) => of_m4(class),
            (Self::M0, Class::Branch) if instruction.size == 4 => 3,
            (Self::M0, Class::Branch) => 2,
            (Self::M0, Class::Load | Class::Store | Class::StoreIndexed) => 2,
            (Self::M0, Class::Return(n)) => 3 + u64::from(n),
            (Self::M0, class) => of_m4(class),
            (Self::Hazard3, Class::Branch) => 2,
            (Self::Hazard3, Class::Divide) => 19,
            (Self::Hazard3, _) => 1,
        }
    }

    /// Returns the cycles that a conditional branch takes more if it is taken.
    pub fn taken(self, instruction: &Instruction) -> u64 {
        match (self, instruction.class) {
            (Self::M4 | Self::M3 | Self::M55, Class::Conditional) => REFILL,
            (Self::M0 | Self::Hazard3, Class::Conditional) => 1,
            _ => 0,
        }
    }

    /// Returns the cycles after `before`.
    pub fn cycles_after(self, instruction: &Instruction, before: &Instruction) -> u64 {
        let memory = matches!(instruction.class.kind(), Kind::Load | Kind::Store);
        let address_comes_late = before.writes & instruction.address != 0;
        let mut cycles = self.cycles(instruction);
        if self == Self::M0 {
            return cycles;
        }
        if self == Self::Hazard3 {
            return cycles + u64::from(before.class == Class::Load && address_comes_late);
        }
        let computed = matches!(before.class.kind(), Kind::Alu | Kind::Multiply) || before.class == Class::FloatMove;
        let single = matches!(instruction.class, Class::Load | Class::StoreIndexed);
        if single && before.class == Class::Load && !address_comes_late {
            cycles -= 1; // pipelined
        }
        if memory && computed && address_comes_late {
            cycles += 1;
        }
        if before.class == Class::Float && before.float_writes & instruction.float_reads != 0 {
            cycles += 1;
        }
        cycles
    }
}

fn of_m4(class: Class) -> u64 {
    match class {
        Class::Alu | Class::Multiply | Class::IfThen | Class::Float | Class::FloatMove => 1,
        Class::Store | Class::Conditional => 1,
        Class::MultiplyAccumulate | Class::Load | Class::StoreIndexed | Class::Vector => 2,
        Class::LoadDouble | Class::StoreDouble | Class::FloatAccumulate => 3,
        Class::Divide => 7,
        Class::FloatDivide => 14,
        Class::LoadMultiple(n) | Class::StoreMultiple(n) => 1 + u64::from(n),
        Class::Return(n) => 1 + u64::from(n) + REFILL,
        Class::Branch => 1 + REFILL,
    }
}
