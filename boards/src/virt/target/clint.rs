//! The core-local interrupts: the timer and the software interrupt of hart 0.

use riscv::interrupt::Interrupt;
use riscv::register::mie;

use super::register;
use crate::hal::Ticker;

/// Cycles of the timer per second.
pub(super) const HZ: u32 = 10_000_000;

const SOFTWARE: usize = 0x0200_0000;
/// The halves of the time to compare with, and of the time.
const COMPARE: [usize; 2] = [0x0200_4000, 0x0200_4004];
const TIME: [usize; 2] = [0x0200_bff8, 0x0200_bffc];

pub(super) fn set_software_interrupt(is_pending: bool) {
    // SAFETY: the interrupt has a handler.
    unsafe { register::<u32>(SOFTWARE).write(is_pending.into()) };
}

/// The machine's timer.
#[derive(Debug, Default)]
pub struct Timer {
    /// End of the period.
    end: u64,
    period: u32,
}

fn time() -> u64 {
    let [low, high] = TIME.map(register::<u32>);
    loop {
        let before = high.read();
        let time = u64::from(before) << 32 | u64::from(low.read());
        if high.read() == before {
            return time;
        }
    }
}

impl Timer {
    fn set_end(&mut self, end: u64) {
        self.end = end;
        let [low, high] = COMPARE.map(register::<u32>);
        // SAFETY: the timer's interrupt has a handler. In this order no time between is earlier.
        unsafe {
            high.write(u32::MAX);
            low.write(end as u32);
            high.write((end >> 32) as u32);
        }
    }
}

impl Ticker for Timer {
    fn start(&mut self, period: u32) {
        self.period = period;
        self.set_end(time() + u64::from(period));
        // SAFETY: the timer's interrupt has a handler.
        unsafe { mie::enable(Interrupt::MachineTimer) };
    }

    fn count(&self) -> u32 {
        let (now, period) = (time(), u64::from(self.period));
        // At the end the next period begins.
        let end = if now < self.end { self.end } else { self.end + period };
        end.saturating_sub(1 + now) as u32
    }

    fn has_ended(&mut self) -> bool {
        let now = time();
        let ended = now >= self.end;
        if ended {
            let next = self.end + u64::from(self.period);
            // Periods that have passed without a tick are not made up for.
            self.set_end(if now < next { next } else { now + u64::from(self.period) });
        }
        ended
    }
}
