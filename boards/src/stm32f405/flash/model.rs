//! A model of the STM32F405's flash controller for tests, with the rules of RM0090, section 3, and a supply that may
//! fail during any write. It panics when a driver violates a rule for which the part has no flag.

use core::cell::Cell;

use actq_testkit::{Change, Power, Random};

use super::{
    BSY, DCEN, DCRST, ICEN, ICRST, KEYS, LOCK, PG, PGAERR, PGPERR, PGSERR, Part, Register, SECTORS, SER, SNB, STRT,
    WORDS, WRPERR, longest_erase, sector,
};

/// Mask of PSIZE.
const PSIZE: u32 = 0b11 << 8;

/// A part with flash from a given sector on.
#[derive(Clone, Debug)]
pub struct Model {
    memory: Vec<Cell<u8>>,
    begin: u32,
    access: u32,
    status: Cell<u32>,
    control: u32,
    /// Number of correct keys so far; `None` after a wrong one, until a reset.
    keys: Option<usize>,
    /// Remaining reads of the status until the operation ends.
    left: Cell<u32>,
    /// Milliseconds of all operations so far: each read of the status during an operation takes one.
    now: Cell<u64>,
    /// Extended timeout of the watchdog in milliseconds, if one is set.
    timeout: Option<u16>,
    /// `true` if a cache has erased data.
    pub is_stale: bool,
    /// Duration of an operation in milliseconds.
    pub takes: u32,
    /// Write-protected sectors, one bit each.
    pub protected: u32,
    /// Error flags that the next operation raises instead of being done.
    pub raises: u32,
    /// `true` if the power stage is on.
    pub is_driving: bool,
    /// `true` if the supply voltage is sufficient.
    pub is_supplied: bool,
    /// The watchdog takes another time.
    pub accepts_timeout: bool,
    /// There is a controller: without one, as in QEMU, all its registers read as 0.
    pub exists: bool,
    /// The supply: each write to a register or to the memory is a change. After its failure nothing changes, and
    /// registers read as 0.
    pub power: Power,
    /// The watchdog was not fed, and has reset the part: as if the supply had failed.
    pub is_reset: bool,
}

impl Model {
    /// Creates the part after power-on: locked, both caches on, with `memory` as the flash from `begin` on.
    pub fn new(memory: Vec<u8>, begin: u32, seed: u64) -> Self {
        Self {
            memory: memory.into_iter().map(Cell::new).collect(),
            begin,
            access: ICEN | DCEN,
            status: Cell::new(0),
            control: LOCK,
            keys: Some(0),
            left: Cell::new(0),
            now: Cell::new(0),
            timeout: None,
            is_stale: false,
            takes: 2,
            protected: 0,
            raises: 0,
            is_driving: false,
            is_supplied: true,
            accepts_timeout: true,
            exists: true,
            power: Power::new(Random::new(seed)),
            is_reset: false,
        }
    }

    /// Returns the part after a power cycle.
    #[must_use]
    pub fn restarted(mut self) -> Self {
        self.power.restart(None);
        Self { memory: self.memory, power: self.power, ..Self::new(Vec::new(), self.begin, 0) }
    }

    /// Returns the memory's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.memory.iter().map(Cell::get).collect()
    }

    fn change(&mut self) -> Change {
        if self.is_reset { Change::Nothing } else { self.power.change() }
    }

    fn is_off(&self) -> bool {
        !self.exists || self.is_reset || self.power.is_off()
    }

    fn raise(&self, flags: u32) {
        self.status.set(self.status.get() | flags);
    }

    fn begins(&self) {
        self.raise(BSY);
        self.left.set(self.takes);
    }

    fn erase(&mut self, change: Change) {
        let number = self.control >> SNB & 0xf;
        assert!(number < SECTORS && self.control & PG == 0, "no such erase: {:#x}", self.control);
        assert!(!self.is_driving && self.is_supplied, "an erase that must not begin");
        assert!(self.timeout >= Some(longest_erase(number)), "the watchdog would end an erase");
        let protected = if self.protected & 1 << number == 0 { 0 } else { WRPERR };
        if self.raises | protected != 0 {
            return self.raise(self.raises | protected);
        }
        let addresses = sector(number);
        let sector = &self.memory[(addresses.start - self.begin) as usize..(addresses.end - self.begin) as usize];
        match change {
            Change::Whole => sector.iter().for_each(|byte| byte.set(0xff)),
            _ => sector.iter().zip(self.power.erased()).for_each(|(byte, ones)| byte.set(byte.get() | ones)),
        }
        self.is_stale |= self.access & (ICEN | DCEN) != 0;
        self.begins();
    }

    fn control(&mut self, value: u32, change: Change) {
        // The bus stalls until the end.
        self.now.set(self.now.get() + u64::from(self.left.take()));
        self.status.set(self.status.get() & !BSY);
        if self.control & LOCK != 0 {
            return;
        }
        self.control = value & !STRT;
        if value & LOCK != 0 {
            self.keys = self.keys.map(|_| 0);
        } else if value & (SER | STRT) == SER | STRT {
            self.erase(change);
        }
    }

    fn key(&mut self, value: u32) {
        let place = self.keys.filter(|place| self.control & LOCK != 0 && KEYS.get(*place) == Some(&value));
        self.keys = place.map(|place| place + 1);
        match self.keys {
            Some(2) => self.control &= !LOCK,
            Some(_) => {}
            None => self.control |= LOCK,
        }
    }
}

impl Part for Model {
    fn read(&self, register: Register) -> u32 {
        if self.is_off() {
            return 0;
        }
        match register {
            Register::Access => self.access,
            Register::Key => 0,
            Register::Control => self.control,
            Register::Status => {
                let status = self.status.get();
                match self.left.get() {
                    0 => self.status.set(status & !BSY),
                    left => {
                        self.left.set(left - 1);
                        self.now.set(self.now.get() + 1);
                    }
                }
                self.status.get()
            }
        }
    }

    fn write(&mut self, register: Register, value: u32) {
        let change = self.change();
        // A register is set or not.
        let is_start = register == Register::Control && value & STRT != 0;
        if !self.exists || change == Change::Nothing || change == Change::Part && !is_start {
            return;
        }
        match register {
            Register::Access => {
                assert!(value & (ICRST | DCRST) == 0 || value & (ICEN | DCEN) == 0, "a cache that is on is flushed");
                self.is_stale &= value & (ICRST | DCRST) != ICRST | DCRST;
                self.access = value;
            }
            Register::Key => self.key(value),
            Register::Status => self.status.set(self.status.get() & !(value & !BSY)),
            Register::Control => self.control(value, change),
        }
    }

    fn memory(&self) -> &[Cell<u8>] {
        &self.memory
    }

    fn program(&mut self, at: u32, word: u32) {
        let change = self.change();
        if !self.exists || change == Change::Nothing {
            return;
        }
        assert!(self.status.get() & BSY == 0 && !self.is_driving && self.is_supplied, "a write that must not begin");
        let number = (0..SECTORS).find(|number| sector(*number).contains(&(self.begin + at)));
        if self.raises != 0 {
            self.raise(self.raises);
        } else if self.control & (LOCK | PG) != PG {
            self.raise(PGSERR);
        } else if !at.is_multiple_of(4) && at % 16 > 12 {
            self.raise(PGAERR);
        } else if self.control & PSIZE != WORDS {
            self.raise(PGPERR);
        } else if number.is_none_or(|number| self.protected & 1 << number != 0) {
            self.raise(WRPERR);
        } else {
            for (at, byte) in (at as usize..).zip(word.to_le_bytes()) {
                let kept = if change == Change::Part { self.power.kept() } else { 0 };
                self.memory[at].set(self.memory[at].get() & (byte | kept));
            }
            self.begins();
        }
    }

    fn is_driving(&self) -> bool {
        self.is_driving
    }

    fn is_supplied(&self) -> bool {
        self.is_supplied
    }

    fn with_watchdog_timeout<R>(&mut self, milliseconds: u16, work: impl FnOnce(&mut Self) -> R) -> Option<R> {
        if !self.accepts_timeout {
            return None;
        }
        self.timeout = Some(milliseconds);
        let begun = self.now.get();
        let outcome = work(self);
        self.timeout = None;
        self.is_reset |= self.now.get() - begun > milliseconds.into();
        (!self.is_reset).then_some(outcome)
    }
}
