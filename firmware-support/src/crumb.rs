//! A breadcrumb: what ended the program, in memory that a reset leaves as it is, for the start after it.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// What ended the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A panic; `at` is its line.
    Panic = 1,
    /// A hard fault; `at` is the instruction, `from` its link register.
    HardFault = 2,
    /// A non-maskable interrupt; `at` is what it interrupted, `from` its link register.
    Nmi = 3,
}

/// A breadcrumb.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crumb {
    /// What ended the program.
    pub kind: Kind,
    /// Where.
    pub at: u32,
    /// Where that was called from.
    pub from: u32,
}

/// Kind, where, where from, and a word by which memory that was never written is told.
type Words = [u32; 4];

struct Memory(UnsafeCell<MaybeUninit<Words>>);

// SAFETY: it is read and written whole, by `leave`, after which the program has ended, and by `take`, before it has begun.
unsafe impl Sync for Memory {}

#[unsafe(link_section = ".uninit.crumb")]
static MEMORY: Memory = Memory(UnsafeCell::new(MaybeUninit::uninit()));

const SALT: u32 = 0x6372_756d;

fn check([kind, at, from, _]: Words) -> u32 {
    SALT ^ kind ^ at.rotate_left(11) ^ from.rotate_left(22)
}

fn write(words: Words) {
    // SAFETY: words of this program's memory, which nobody else uses at this time; volatile, because nothing here reads them again.
    unsafe { MEMORY.0.get().cast::<Words>().write_volatile(words) }
}

/// Leaves a crumb. The caller ends the program.
pub fn leave(kind: Kind, at: u32, from: u32) {
    let words = [kind as u32, at, from, 0];
    write([kind as u32, at, from, check(words)]);
}

/// Takes the crumb that the program before the reset has left, if it has. To be called once, first of all.
pub fn take() -> Option<Crumb> {
    // SAFETY: words of this program's memory; any bits are words, and those that power-on leaves do not pass the check.
    let words = unsafe { MEMORY.0.get().cast::<Words>().read_volatile() };
    write([0; 4]);
    let [kind, at, from, sum] = words;
    if sum != check(words) {
        return None;
    }
    let kind = [Kind::Panic, Kind::HardFault, Kind::Nmi].into_iter().find(|known| *known as u32 == kind)?;
    Some(Crumb { kind, at, from })
}
