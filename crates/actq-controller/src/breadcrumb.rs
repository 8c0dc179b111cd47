//! The record of a crash, in memory that a reset preserves, for the next start to report.
//!
//! That memory has arbitrary content after power-on, so a record has a checksum.

use actq_link::code::{Crash, ResetCause};
use actq_link::frame::CRC;
use actq_link::report::Breadcrumb;

/// Words of a record: reserve them as a static in a section that the start-up code does not initialize.
pub const WORDS: usize = 6;

/// A crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Kind of the crash.
    pub crash: Crash,
    /// Program counter; 0 if unknown.
    pub pc: u32,
    /// Detail: fault status, line of the panic, or [`crate::progress::Progress::missing`].
    pub detail: u32,
    /// Ticks since the start.
    pub ticks: u32,
    /// Crashes since power-on, including this one.
    pub count: u32,
}

impl Record {
    /// Encodes the record.
    pub fn to_words(self) -> [u32; WORDS] {
        let Self { crash, pc, detail, ticks, count } = self;
        let content = [crash.code().into(), pc, detail, ticks, count];
        let [a, b, c, d, e] = content;
        [a, b, c, d, e, checksum(&content)]
    }

    /// Decodes a record; `None` if [`Self::to_words`] did not make these words.
    pub fn from_words(words: &[u32; WORDS]) -> Option<Self> {
        let [crash, pc, detail, ticks, count, sum] = *words;
        let crash_code = Crash::from_code(crash.try_into().ok()?)?;
        (sum == checksum(&[crash, pc, detail, ticks, count])).then_some(Self {
            crash: crash_code,
            pc,
            detail,
            ticks,
            count,
        })
    }

    /// Returns the report of a start after `reset`, with the record found, if any.
    pub fn report(reset: ResetCause, found: Option<Self>) -> Breadcrumb {
        let [pc, detail, ticks, count] = found.map_or([0; 4], |r| [r.pc, r.detail, r.ticks, r.count]);
        Breadcrumb { reset, crash: found.map(|r| r.crash), pc, detail, ticks, count }
    }
}

fn checksum(words: &[u32; WORDS - 1]) -> u32 {
    let mut digest = CRC.digest();
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}
