//! The most stack that the application can take, from the ELF file alone: its functions' frames, read from their
//! instructions, along the deepest way through their calls, with everything that may interrupt it on top.
//!
//! What is not understood is an error, not a guess: an instruction that changes the stack pointer in another way than
//! by a constant, ways that come to an instruction with different depths, code that no way leads to, a function that
//! calls itself, by a pointer, too. A call by a pointer may reach every function whose address is taken anywhere. The
//! frames of the functions in assembler are read as all others.
//!
//! An exception may come at any instruction of what has a lower priority. The processor stacks 8 words, or 26 where
//! floats are in use, and one more to align them (Arm DDI 0403E, section B1.5.6; no board here stacks the FPU's upper
//! half, as FPCCR.TS asks for). So the worst case is the deepest way of the program and, for every priority, that of
//! its deepest handler, each with such a frame.

mod depth;
mod flow;
mod program;
mod step;
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

/// Words that the processor stacks, with and without the FPU's, and the one that aligns them.
const FRAME_WORDS: u32 = 8 + 1;
const FPU_FRAME_WORDS: u32 = 26 + 1;

/// Bytes below the stack that may be a guard, and that begin at a multiple of them (`boards/src/target/mpu.rs`).
const GUARD: u32 = 4096;

/// Places of the vector table.
const RESET: usize = 1;
const NMI: usize = 2;
const HARD_FAULT: usize = 3;

/// The most that the stack can hold.
#[derive(Clone, Debug)]
pub struct Worst {
    /// The program and, the lowest priority first, what may interrupt it.
    pub levels: Vec<Level>,
    /// Bytes that the linker's script leaves for the stack, without a guard.
    pub room: u32,
    /// The functions that call by a pointer.
    pub by_pointer: Vec<String>,
    /// The functions that a pointer may point to.
    pub pointed_to: Vec<String>,
    /// Functions that may run, and the bytes of their own frames.
    pub frames: Vec<(String, u32)>,
}

/// What runs at one priority.
#[derive(Clone, Debug)]
pub struct Level {
    /// The priority.
    pub priority: Priority,
    /// Bytes that the processor stacks when it begins.
    pub stacked: u32,
    /// The deepest way.
    pub path: Vec<Call>,
}

/// When something runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Priority {
    /// Where nothing else does.
    Thread,
    /// A task's in the application, the highest one last.
    Task(u8),
    /// Of faults, and of all that no task is bound to: what a reset gives, above all tasks.
    Fault,
    /// Of a hard fault.
    HardFault,
    /// Of the non-maskable interrupt.
    Nmi,
}

impl Level {
    /// Bytes of stack.
    pub fn bytes(&self) -> u32 {
        self.stacked + self.path.iter().map(|call| call.frame).sum::<u32>()
    }
}

impl Worst {
    /// Bytes of stack.
    pub fn bytes(&self) -> u32 {
        self.levels.iter().map(Level::bytes).sum()
    }
}

/// The worst case of the application in an ELF file.
///
/// # Errors
///
/// The file cannot be read, or something in it is not understood, as a function that calls itself.
pub fn worst_case(elf: &Path) -> Result<Worst> {
    let program = Program::read(elf)?;
    worst(&program, &tasks()?).with_context(|| elf.display().to_string())
}

fn worst(program: &Program, tasks: &BTreeMap<String, u8>) -> Result<Worst> {
    let mut depths = Depths::new(program);
    let mut handlers: BTreeMap<Priority, Vec<u32>> = BTreeMap::new();
    // The handlers have names of functions; several vectors may have one.
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
    ensure!(missing.is_empty(), "no functions are the tasks {missing:?}");
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

/// The priorities of the application's tasks, by the handlers that they are bound to, as its source gives them to RTIC.
fn tasks() -> Result<BTreeMap<String, u8>> {
    let path = root().join("firmware-demo/src/bin/controller/main.rs");
    let source = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    bound(&source).with_context(|| path.display().to_string())
}

/// As [`tasks`], of a source. RTIC's own default is priority 1.
fn bound(source: &str) -> Result<BTreeMap<String, u8>> {
    let mut tasks = BTreeMap::new();
    for attribute in source.split("#[task(").skip(1).filter_map(|rest| rest.split_once(")]")).map(|(text, _)| text) {
        let value = |key: &str| {
            let of_key =
                |part: &str| part.trim().strip_prefix(key)?.trim().strip_prefix('=').map(str::trim).map(str::to_owned);
            attribute.split(',').find_map(of_key)
        };
        let handler = value("binds").with_context(|| format!("#[task({attribute})] is bound to no handler"))?;
        let priority = value("priority").map_or(Ok(1), |priority| priority.parse())?;
        tasks.insert(handler, priority);
    }
    ensure!(!tasks.is_empty(), "there are no tasks");
    Ok(tasks)
}
