//! What a crash leaves in memory that a reset keeps, for the next start to find.
//!
//! After power-on that memory holds anything, so that a record has a checksum.

use actq_link::code::{Crash, ResetCause};
use actq_link::frame::CRC;
use actq_link::report::Breadcrumb;

/// Words of a record: the memory to set aside, as a static in a section that the start-up code leaves alone.
pub const WORDS: usize = 6;

/// A crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// What it died of.
    pub crash: Crash,
    /// Program counter; 0 where it is not known.
    pub pc: u32,
    /// Fault status, line of the panic, or [`crate::progress::Progress::missing`].
    pub detail: u32,
    /// Ticks since the start.
    pub ticks: u32,
    /// Crashes since power-on, this one included.
    pub count: u32,
}

impl Record {
    /// The words to leave behind.
    pub fn to_words(self) -> [u32; WORDS] {
        let Self { crash, pc, detail, ticks, count } = self;
        let content = [crash.code().into(), pc, detail, ticks, count];
        let [a, b, c, d, e] = content;
        [a, b, c, d, e, checksum(&content)]
    }

    /// What was left behind; `None` where the words are none of [`Self::to_words`].
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

    /// The report of a start for `reset`, with what was found.
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
