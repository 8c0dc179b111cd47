//! The maximum stack of the application, from the ELF file only: the frames of its functions, read from their
//! instructions, along the deepest path of the call graph, with every possible interrupt on top.
//!
//! Anything unknown is an error, not a guess: an instruction that changes the stack pointer by other than a constant,
//! paths that reach an instruction with different depths, unreachable code, recursion, also by a pointer. A call by a
//! pointer may reach every function whose address is taken anywhere. Frames of functions in assembler are read in the
//! same way.
//!
//! An exception may come at any instruction of lower priority. The processor stacks 8 words, or 26 if floats are in
//! use, and one more to align them (Arm DDI 0403E, section B1.5.6; no board here stacks the FPU's upper half, as
//! FPCCR.TS requests). The worst case is the deepest path of the program and, for every priority, that of its deepest
//! handler, each with such a frame.

mod depth;
mod flow;
mod narrow;
mod program;
pub(crate) mod step;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use actq_boards::root;
use anyhow::{Context as _, Result, ensure};

pub use self::depth::Call;
use self::depth::Depths;
use self::program::Program;

/// Words that the processor stacks, with and without those of the FPU, and the one that aligns them.
const FRAME_WORDS: u32 = 8 + 1;
const FPU_FRAME_WORDS: u32 = 26 + 1;

/// Bytes below the stack that may be a guard, and their alignment (`boards/src/target/mpu.rs`).
const GUARD: u32 = 4096;

/// Indices of the vector table.
const RESET: usize = 1;
const NMI: usize = 2;
const HARD_FAULT: usize = 3;

/// The maximum content of the stack.
#[derive(Clone, Debug)]
pub struct Worst {
    /// The program and its interrupts, the lowest priority first.
    pub levels: Vec<Level>,
    /// Bytes that the linker script reserves for the stack, without a guard.
    pub room: u32,
    /// The functions that call by a pointer.
    pub by_pointer: Vec<String>,
    /// The functions whose address is taken.
    pub pointed_to: Vec<String>,
    /// Functions that may run, and the bytes of their own frames.
    pub frames: Vec<(String, u32)>,
}

/// The code of one priority.
#[derive(Clone, Debug)]
pub struct Level {
    /// The priority.
    pub priority: Priority,
    /// Bytes that the processor stacks on entry.
    pub stacked: u32,
    /// The deepest path.
    pub path: Vec<Call>,
}

/// A priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Priority {
    /// The program, below every interrupt.
    Thread,
    /// A task of the application, the highest priority last.
    Task(u8),
    /// Faults, and every exception without a task: the priority after a reset, above all tasks.
    Fault,
    /// A hard fault.
    HardFault,
    /// The non-maskable interrupt.
    Nmi,
}

impl Level {
    /// Returns the bytes of stack.
    pub fn bytes(&self) -> u32 {
        self.stacked + self.path.iter().map(|call| call.frame).sum::<u32>()
    }
}

impl Worst {
    /// Returns the bytes of stack.
    pub fn bytes(&self) -> u32 {
        self.levels.iter().map(Level::bytes).sum()
    }
}

/// Computes the worst case of the application in an ELF file.
///
/// # Errors
///
/// The file cannot be read, or the analysis does not understand a part of it, for example recursion.
pub fn worst_case(elf: &Path) -> Result<Worst> {
    let program = Program::read(elf)?;
    worst(&program, &tasks()?).with_context(|| elf.display().to_string())
}

/// Computes the deepest path of a function and what it calls, without interrupts.
///
/// # Errors
///
/// Those of [`worst_case`], and if the file has no function of this name.
pub fn deepest_path(elf: &Path, function: &str) -> Result<Vec<Call>> {
    let program = Program::read(elf)?;
    let known = program.functions.values().find(|known| known.name == function);
    let address = known.with_context(|| format!("{}: no function {function}", elf.display()))?.address;
    Depths::new(&program).path(address).with_context(|| elf.display().to_string())
}

fn worst(program: &Program, tasks: &BTreeMap<String, u8>) -> Result<Worst> {
    let mut depths = Depths::new(program);
    let mut handlers: BTreeMap<Priority, Vec<u32>> = BTreeMap::new();
    // Function names of the handlers; several vectors may share one.
    for (place, vector) in program.vectors.iter().enumerate().skip(RESET).filter(|(_, vector)| **vector != 0) {
        let address = vector & !1;
        let task = tasks.get(&depths.name(address)?);
        let priority = match (place, task) {
            (RESET, _) => Priority::Thread,
            (NMI, _) => Priority::Nmi,
            (HARD_FAULT, _) => Priority::HardFault,
            (_, Some(priority)) => Priority::Task(*priority),
            (_, None) => Priority::Fault,
        };
        handlers.entry(priority).or_default().push(address);
    }
    let missing: Vec<_> =
        tasks.keys().filter(|task| !program.functions.values().any(|function| function.name == **task)).collect();
    ensure!(missing.is_empty(), "no functions match the tasks {missing:?}");
    let stacked = 4 * if program.has_fpu { FPU_FRAME_WORDS } else { FRAME_WORDS };
    let mut levels = Vec::new();
    for (priority, handlers) in handlers {
        let depth = handlers.into_iter().map(|handler| Ok((depths.of(handler)?, handler)));
        let deepest = depth.collect::<Result<Vec<_>>>()?.into_iter().max();
        let (_, handler) = deepest.context("a level has a handler")?;
        let stacked = if priority == Priority::Thread { 0 } else { stacked };
        levels.push(Level { priority, stacked, path: depths.path(handler)? });
    }
    let [end, start] = [program.symbol("_stack_end")?, program.symbol("_stack_start")?];
    let room = start.saturating_sub(end.next_multiple_of(GUARD) + GUARD);
    let [by_pointer, pointed_to] = depths.pointers()?;
    let frames = depths.frames().map(|(address, bytes)| Ok((depths.name(address)?, bytes))).collect::<Result<_>>()?;
    Ok(Worst { levels, room, by_pointer, pointed_to, frames })
}

/// Returns the priorities of the application's tasks, by their handlers, as its source declares them to RTIC.
fn tasks() -> Result<BTreeMap<String, u8>> {
    let path = root().join("firmware-demo/src/bin/controller/app.rs");
    let source = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    bound(&source).with_context(|| path.display().to_string())
}

/// Does the same as [`tasks`] for a source text. RTIC's default is priority 1.
fn bound(source: &str) -> Result<BTreeMap<String, u8>> {
    let mut tasks = BTreeMap::new();
    for attribute in source.split("#[task(").skip(1).filter_map(|rest| rest.split_once(")]")).map(|(text, _)| text) {
        let value = |key: &str| {
            let of_key =
                |part: &str| part.trim().strip_prefix(key)?.trim().strip_prefix('=').map(str::trim).map(str::to_owned);
            attribute.split(',').find_map(of_key)
        };
        let handler = value("binds").with_context(|| format!("#[task({attribute})] has no `binds = HANDLER`"))?;
        let priority = value("priority").map_or(Ok(1), |priority| priority.parse())?;
        tasks.insert(handler, priority);
    }
    ensure!(!tasks.is_empty(), "the source has no tasks");
    Ok(tasks)
}
