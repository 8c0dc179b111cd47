//! The application on its board, from snapshot to outcome.

use std::io::{ErrorKind, Read as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use actq_boards::{Clock, Target};
use actq_controller::Axis;
use actq_kernels::Image;
use actq_link::code::{Parameter, State};
use actq_link::report::Status;
use actq_link::{Floats, Message, Receiver, Sender};
use actq_ur3::ACT_DIM;
use anyhow::{Context as _, Result, bail, ensure};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};
use tempfile::TempDir;

use super::gdb::{CORE, Gdb};
use super::{CYCLES, Detection, Flip, Judge, LONGEST, Outcome, PERIOD, PERIODS, Region, Sample, WINDOW};
use crate::controller::INSTRUCTION;
use crate::qemu::spawn;

/// Ticks per second of the application.
const TICK_HZ: f32 = 1000.0;
/// Time without a stop after which QEMU counts as hung: the watchdog stops it after a second of its own time.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Ticks from arming to the first snapshot, and most ticks of the start.
const SETTLE: u32 = 2 * PERIOD;
const START: u32 = 2000;

/// Indices of registers in [`Gdb::core`].
const R0: usize = 0;
const R1: usize = 1;
const SP: usize = 13;
const LR: usize = 14;
const PC: usize = 15;
const XPSR: usize = 16;
/// Bits of xPSR within an If-Then block.
const IF_THEN: u32 = 0x0600_fc00;
/// Numbers of the registers to flip, with their bytes (QEMU's `arm-m-profile.xml` and `arm-vfp.xml`): r0 to r15, xPSR,
/// d0 to d15 and FPSCR.
const REGISTERS: [(std::ops::Range<u32>, usize); 4] = [(0..16, 4), (25..26, 4), (26..42, 8), (42..43, 4)];

/// `str r1, [r0]` and `bx lr`.
const STORE: u16 = 0x6001;
const RETURN: u16 = 0x4770;

/// The count of the tick's timer, which a write restarts (Arm DDI 0403E, B3.3).
const TICK_COUNT: u32 = 0xe000_e018;
/// Interrupt control and state, with the bit that clears a due tick (Arm DDI 0403E, B3.2.4).
const PENDING: u32 = 0xe000_ed04;
const TICK_CLEAR: u32 = 1 << 25;

/// Registers of timer 0 (Arm DDI 0479C, section 4.3) and its interrupt; the interrupts' enable bits (Arm DDI 0403E,
/// B3.4.4).
const TIMER_CONTROL: u32 = 0x4000_0000;
const TIMER_VALUE: u32 = 0x4000_0004;
const TIMER_RELOAD: u32 = 0x4000_0008;
const TIMER_CLEAR: u32 = 0x4000_000c;
const TIMER_ON: u32 = 0b1001;
const TIMER_INTERRUPT: u32 = 8;
const ENABLE: u32 = 0xe000_e100;

/// Tag of [`actq_controller::Output::Drive`] in the program.
const DRIVE: u32 = 0;

/// Length of the serial port's queues.
const QUEUE: usize = 512;

/// Places of the program.
#[derive(Debug)]
struct Places {
    /// The function that takes the outputs of a tick.
    apply: u32,
    /// Handlers of exceptions, besides the watchdog's.
    faults: Vec<u32>,
    watchdog: u32,
    /// The handler of unused interrupts.
    unused: u32,
    /// The instructions [`STORE`] and [`RETURN`] somewhere.
    store: u32,
    ret: u32,
    /// Queue of received bytes: the index of the next byte to read, then that of the next to write, then the bytes.
    input: u32,
    image: u32,
    scratch: u32,
    /// The variables before and after the scratch memory.
    variables: [std::ops::Range<u32>; 2],
    stack: u32,
    /// The safety state machine, and its number of ticks.
    safety: (u32, usize),
    ticks: u32,
}

impl Places {
    fn of(elf: &Path) -> Result<Self> {
        let data = std::fs::read(elf).with_context(|| elf.display().to_string())?;
        let file = object::File::parse(&*data).with_context(|| elf.display().to_string())?;
        let find = |name: &str| {
            let is_it = |symbol: &object::Symbol<'_, '_>| {
                let found = symbol.name().unwrap_or_default();
                found == name
                    || found.len() > name.len() && format!("{:#}", rustc_demangle::demangle(found)).contains(name)
            };
            let exact = file.symbols().find(|symbol| symbol.name() == Ok(name));
            let symbol = exact.or_else(|| file.symbols().find(is_it));
            let symbol = symbol.with_context(|| format!("{}: symbol {name} is missing", elf.display()))?;
            Ok::<_, anyhow::Error>((symbol.address() as u32, symbol.size() as u32))
        };
        let text = file.section_by_name(".text").context("the ELF file has no section .text")?;
        let code = text.data()?;
        let instruction = |wanted: u16| {
            let at = code.as_chunks::<2>().0.iter().position(|half| u16::from_le_bytes(*half) == wanted);
            Ok::<_, anyhow::Error>(text.address() as u32 + 2 * at.context("an instruction is missing")? as u32)
        };
        let function = |name| Ok::<_, anyhow::Error>(find(name)?.0 & !1);
        let (scratch, len) = find("__rtic_internal_local_idle_scratch")?;
        Ok(Self {
            apply: function("Bridges<S>::apply")?,
            faults: ["HardFault", "MemoryManagement", "UsageFault", "Reset"]
                .map(function)
                .into_iter()
                .collect::<Result<_>>()?,
            watchdog: function("NonMaskableInt")?,
            unused: function("DefaultHandler_")?,
            store: instruction(STORE)?,
            ret: instruction(RETURN)?,
            input: find("__rtic_internal_local_init_buffers")?.0,
            image: find("start::BUILT_IN")?.0,
            scratch,
            variables: [find("__sbss")?.0..scratch, scratch + len..find("__euninit")?.0],
            stack: find("_stack_start")?.0,
            safety: find("__rtic_internal_shared_resource_safety").map(|(address, len)| (address, len as usize))?,
            ticks: find("faults::TICKS")?.0,
        })
    }
}

/// Observations to the board, and its frames.
#[derive(Debug)]
struct Link {
    serial: UnixStream,
    receiver: Box<Receiver<512>>,
    sender: Sender,
    /// Bytes of the last applied action.
    action: Option<Vec<u8>>,
}

/// The application on its board in QEMU, armed, with a snapshot of each of the first [`PERIODS`] periods.
#[derive(Debug)]
pub struct Board<'a> {
    child: Child,
    _folder: TempDir,
    gdb: Gdb,
    link: Link,
    places: Places,
    axes: [Axis; ACT_DIM],
    /// Bytes of the image, and of scratch memory that it uses.
    image: usize,
    scratch: usize,
    observations: &'a [Vec<f32>],
    /// Offsets of targets and outputs in the safety state machine.
    offsets: [usize; 2],
    /// The end of every period without a flip.
    reference: Vec<Sample>,
    /// Ticks, and the number of the next frame, at the start of each period.
    starts: Vec<(u32, u32)>,
    /// The counters of the status without a flip.
    refused: [u32; 2],
}

/// The reason of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    Tick,
    Timer,
    Exception,
    Watchdog,
}

impl<'a> Board<'a> {
    /// Starts the application `elf` with `image` built in, arms it, and takes the snapshots. It gets `observations` in a
    /// cycle.
    pub fn start(elf: &Path, image: &Image<'_>, observations: &'a [Vec<f32>]) -> Result<Self> {
        let folder = TempDir::new()?;
        let path = |name: &str| folder.path().join(name);
        let listen = |path: PathBuf| format!("unix:{},server=on,wait=off", path.display());
        let mut command = Target::Fpu.run_with_serial(elf, &listen(path("serial")), Clock::Free(INSTRUCTION));
        command.arg("-S").arg("-gdb").arg(listen(path("gdb")));
        // QEMU keeps snapshots in a temporary overlay of an empty disk.
        command.args(["-drive", "if=none,id=snapshots,file=null-co://,format=raw,snapshot=on"]);
        let child = spawn(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()))?;
        let mut child = Guard(Some(child));
        let (gdb, serial) = (Gdb::new(connect(&path("gdb"))?, TIMEOUT)?, connect(&path("serial"))?);
        serial.set_nonblocking(true)?;
        let places = Places::of(elf)?;
        let mut board = Self {
            child: child.0.take().context("QEMU runs")?,
            _folder: folder,
            gdb,
            link: Link { serial, receiver: Box::new(Receiver::new()), sender: Sender::new(0), action: None },
            places,
            axes: actq_firmware_demo::image::axes(Some(image), &[], TICK_HZ),
            image: image.bytes(),
            scratch: 4 * image.scratch_words(),
            observations,
            offsets: [0; 2],
            reference: Vec::new(),
            starts: Vec::new(),
            refused: [0; 2],
        };
        board.arm()?;
        board.record()?;
        Ok(board)
    }

    /// Starts the program and arms it.
    fn arm(&mut self) -> Result<()> {
        let Places { apply, ref faults, watchdog, unused, .. } = self.places;
        let [faults @ .., reset] = &faults[..] else { bail!("no handlers") };
        let (faults, reset) = (faults.to_vec(), *reset);
        for address in [&faults[..], &[apply, watchdog, unused]].concat() {
            self.gdb.set_breakpoint(address)?;
        }
        let (mut armed_at, mut set) = (None, false);
        for tick in 0..START {
            let (stop, core) = self.resume()?;
            ensure!(stop == Stop::Tick, "the program failed at its start: {stop:?}");
            let outputs = self.gdb.read(core[R1], 8 * ACT_DIM)?;
            if tick == 0 {
                self.gdb.set_breakpoint(reset)?;
                self.poke(&core, &[(ENABLE, 1 << TIMER_INTERRUPT), (TIMER_RELOAD, 0)])?;
            }
            self.restart_tick(&core)?;
            if tick % PERIOD == 0 {
                self.observe(tick / PERIOD, tick)?;
            }
            for status in self.statuses()? {
                let token = status.token;
                match status.state {
                    State::Armed => armed_at = armed_at.or(Some(tick)),
                    _ if !set => {
                        set = true;
                        let (parameter, value) = (Parameter::StatusPeriod, PERIOD as f32);
                        self.send(&Message::Set { token, parameter, axis: 0, value }, tick)?;
                    }
                    _ if status.refusal.is_none() => self.send(&Message::Arm { token }, tick)?,
                    _ => {}
                }
            }
            if armed_at.is_some_and(|armed| tick > armed + SETTLE) && tick % PERIOD == PERIOD - 1 {
                self.offsets = self.find_offsets(&outputs)?;
                return self.gdb.clear_breakpoint(apply);
            }
        }
        bail!("the application did not arm in {START} ticks");
    }

    /// Finds the last action and the outputs of this tick in the safety state machine.
    fn find_offsets(&mut self, outputs: &[u8]) -> Result<[usize; 2]> {
        let action = self.link.action.take().context("the application sent no action")?;
        let safety = self.gdb.read(self.places.safety.0, self.places.safety.1)?;
        let find = |bytes: &[u8]| safety.windows(bytes.len()).position(|window| window == bytes);
        let offsets =
            find(&action).zip(find(outputs)).context("the last action or the outputs are not in the state")?;
        Ok(offsets.into())
    }

    /// Takes the snapshots, and records the periods without a flip.
    fn record(&mut self) -> Result<()> {
        let now = self.gdb.core()?;
        self.poke(&now, &[(TIMER_VALUE, CYCLES / 2), (TIMER_CONTROL, TIMER_ON)])?;
        let (stop, mut core) = self.resume()?;
        ensure!(stop == Stop::Timer, "the program failed without a flip: {stop:?}");
        for period in 0..PERIODS + LONGEST + 1 {
            self.restart_tick(&core)?;
            self.poke(&core, &[(TIMER_CLEAR, 1), (TIMER_CONTROL, 0)])?;
            self.back(&core)?;
            self.starts.push((self.gdb.word(self.places.ticks)?, self.link.sender.next()));
            if period < PERIODS {
                self.gdb.monitor(&format!("savevm period{period}"))?;
            }
            self.observe_period(period)?;
            let now = self.gdb.core()?;
            self.poke(&now, &[(TIMER_VALUE, PERIOD * CYCLES + CYCLES / 2), (TIMER_CONTROL, TIMER_ON)])?;
            let next = self.resume()?;
            ensure!(next.0 == Stop::Timer, "the program failed without a flip: {:?}", next.0);
            core = next.1;
            let sample = self.sample()?;
            self.reference.push(sample);
            for status in self.statuses()? {
                ensure!(status.state == State::Armed, "period {period}: {status:?}");
                self.refused = refused(&status);
            }
        }
        Ok(())
    }

    /// Returns from the timer's interrupt, whose state is `core`.
    fn back(&mut self, core: &[u32; CORE]) -> Result<()> {
        let mut core = *core;
        core[PC] = self.places.ret;
        self.gdb.set_core(&core)?;
        self.gdb.step()
    }

    /// Returns the bytes of a region; of the stack, those in use now.
    pub fn bytes(&mut self, region: Region) -> Result<usize> {
        Ok(match region {
            Region::Image => self.image,
            Region::Scratch => self.scratch,
            Region::Variables => self.places.variables.iter().map(std::ops::Range::len).sum(),
            Region::Stack => self.places.stack.saturating_sub(self.gdb.core()?[SP]) as usize,
            Region::Registers => REGISTERS.iter().map(|(numbers, bytes)| numbers.len() * bytes).sum(),
        })
    }

    /// Injects a flip into a fresh run, and returns its outcome.
    ///
    /// # Errors
    ///
    /// If QEMU fails: then this board is of no further use.
    pub fn run(&mut self, flip: &Flip) -> Result<Outcome> {
        // QEMU would take a number for an index.
        self.gdb.monitor(&format!("loadvm period{}", flip.period))?;
        self.drain()?;
        *self.link.receiver = Receiver::new();
        self.link.sender = Sender::new(self.starts[flip.period].1);
        self.observe_period(flip.period)?;
        let core = self.gdb.core()?;
        self.poke(&core, &[(TIMER_VALUE, flip.cycle), (TIMER_CONTROL, TIMER_ON)])?;
        let (stop, core) = self.resume()?;
        ensure!(stop == Stop::Timer, "{flip:?}: {stop:?} before the timer");
        self.restart_tick(&core)?;
        self.poke(&core, &[(TIMER_CLEAR, 1), (TIMER_CONTROL, 0)])?;
        self.back(&core)?;
        self.flip(flip)?;
        let reference = std::mem::take(&mut self.reference);
        let axes = self.axes;
        let mut judge = Judge::new(&reference, &axes);
        let detected = match self.watch(flip, &mut judge) {
            // QEMU ends if an exception comes that the core cannot take (lockup); the watchdog resets a real core.
            Err(_) if self.has_ended()? => Ok(Some((Detection::Watchdog, PERIOD))),
            other => other,
        };
        let outcome = detected.map(|detected| judge.outcome(detected));
        self.reference = reference;
        outcome
    }

    /// Runs on after a flip to its detection, or to the trial's end.
    fn watch(&mut self, flip: &Flip, judge: &mut Judge<'_>) -> Result<Option<(Detection, u32)>> {
        let start = self.starts[flip.period].0;
        let flipped = start + flip.cycle / CYCLES;
        // The next tick's outputs, which may be of a flip in the tick itself.
        self.gdb.set_breakpoint(self.places.apply)?;
        let (stop, core) = self.resume()?;
        self.gdb.clear_breakpoint(self.places.apply)?;
        if let Some(by) = detection(stop == Stop::Tick, stop) {
            return Ok(Some((by, self.since(flipped)?)));
        }
        self.restart_tick(&core)?;
        let outputs = self.gdb.read(core[R1], 8 * ACT_DIM)?;
        if !judge.is_within(&drives(&outputs)) {
            // The power stage may refuse them.
            let back = core[LR] & !1;
            self.gdb.set_breakpoint(back)?;
            self.gdb.resume()?;
            let core = self.gdb.core()?;
            self.gdb.clear_breakpoint(back)?;
            if core[PC] != back {
                let stop = self.stop(&core)?;
                return Ok(Some((detection(false, stop).unwrap_or(Detection::Exception), self.since(flipped)?)));
            }
            judge.is_outside |= core[R0] & 1 == 1;
        }
        let passed = (self.gdb.word(self.places.ticks)? + 1).saturating_sub(start).clamp(1, PERIOD);
        let mut cycles = (PERIOD - passed) * CYCLES + CYCLES / 2;
        for period in flip.period..flip.period + LONGEST {
            let now = self.gdb.core()?;
            self.poke(&now, &[(TIMER_VALUE, cycles), (TIMER_CONTROL, TIMER_ON)])?;
            let (stop, core) = self.resume()?;
            if let Some(by) = detection(stop == Stop::Timer, stop) {
                return Ok(Some((by, self.since(flipped)?)));
            }
            self.restart_tick(&core)?;
            self.poke(&core, &[(TIMER_CLEAR, 1), (TIMER_CONTROL, 0)])?;
            self.back(&core)?;
            let sample = self.sample()?;
            for status in self.statuses()? {
                let by = match status.fault {
                    Some(fault) if status.state != State::Armed => Some(Detection::Latch(fault)),
                    _ => (refused(&status) != self.refused).then_some(Detection::Frame),
                };
                if let Some(by) = by {
                    return Ok(Some((by, status.ticks.saturating_sub(flipped))));
                }
            }
            judge.take(period, &sample);
            if flip.region != Region::Image && period + 1 >= flip.period + WINDOW && judge.is_right(period) {
                break;
            }
            self.observe_period(period + 1)?;
            cycles = PERIOD * CYCLES + CYCLES / 2;
        }
        Ok(None)
    }

    fn since(&mut self, flipped: u32) -> Result<u32> {
        Ok(self.gdb.word(self.places.ticks)?.saturating_sub(flipped))
    }

    /// Reads targets and outputs.
    fn sample(&mut self) -> Result<Sample> {
        let (address, len) = self.places.safety;
        let safety = self.gdb.read(address, len)?;
        let [targets, outputs] = self.offsets;
        Ok(Sample {
            targets: words(&safety[targets..targets + 4 * ACT_DIM]),
            outputs: drives(&safety[outputs..outputs + 8 * ACT_DIM]),
        })
    }

    /// Returns `true` if a flip has ended QEMU: then only a new board can be used.
    pub fn has_ended(&mut self) -> Result<bool> {
        // It closes its sockets a moment before its end.
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(500) && self.child.try_wait()?.is_none() {
            if self.gdb.core().is_ok() {
                return Ok(false);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(true)
    }

    fn flip(&mut self, flip: &Flip) -> Result<()> {
        let len = self.bytes(flip.region)?;
        let byte = flip.byte(len);
        let address = match flip.region {
            Region::Image => self.places.image + byte as u32,
            Region::Scratch => self.places.scratch + byte as u32,
            Region::Variables => {
                let [before, after] = &self.places.variables;
                if byte < before.len() {
                    before.start + byte as u32
                } else {
                    after.start + (byte - before.len()) as u32
                }
            }
            Region::Stack => self.gdb.core()?[SP] + byte as u32,
            Region::Registers => return self.flip_register(byte, flip.bit),
        };
        let old = self.gdb.read(address, 1)?;
        self.gdb.write(address, &[old[0] ^ (1 << flip.bit)])
    }

    fn flip_register(&mut self, byte: usize, bit: u32) -> Result<()> {
        let mut at = byte;
        for (numbers, len) in REGISTERS {
            for number in numbers {
                if at < len {
                    let mut bytes = self.gdb.register_bytes(number)?;
                    bytes[at] ^= 1 << bit;
                    return self.gdb.set_register_bytes(number, &bytes);
                }
                at -= len;
            }
        }
        bail!("no register has byte {byte}")
    }

    /// Writes words to peripherals, which only the core can do. `core` is its state.
    fn poke(&mut self, core: &[u32; CORE], words: &[(u32, u32)]) -> Result<()> {
        for (address, value) in words {
            let mut changed = *core;
            [changed[0], changed[R1], changed[PC]] = [*address, *value, self.places.store];
            // Within an If-Then block the store would be conditional.
            changed[XPSR] &= !IF_THEN;
            self.gdb.set_core(&changed)?;
            self.gdb.step()?;
        }
        self.gdb.set_core(core)
    }

    /// Starts a period of the tick's timer. QEMU's clock advances by a random time at each stop, which the first
    /// instruction after it adds: so this comes before all else, and clears a tick that is due by that time.
    fn restart_tick(&mut self, core: &[u32; CORE]) -> Result<()> {
        self.poke(core, &[(TICK_COUNT, 0), (PENDING, TICK_CLEAR)])
    }

    /// Runs to the next stop, and returns its reason and the registers.
    fn resume(&mut self) -> Result<(Stop, [u32; CORE])> {
        self.gdb.resume()?;
        let core = self.gdb.core()?;
        Ok((self.stop(&core)?, core))
    }

    fn stop(&mut self, core: &[u32; CORE]) -> Result<Stop> {
        let (pc, places) = (core[PC], &self.places);
        match pc {
            _ if pc == places.apply => Ok(Stop::Tick),
            _ if pc == places.watchdog => Ok(Stop::Watchdog),
            _ if places.faults.contains(&pc) => Ok(Stop::Exception),
            _ if pc == places.unused => {
                let is_timer = core[XPSR] & 0x1ff == 16 + TIMER_INTERRUPT;
                Ok(if is_timer { Stop::Timer } else { Stop::Exception })
            }
            _ => bail!("the board stopped at {pc:#x}"),
        }
    }

    fn observe_period(&mut self, period: usize) -> Result<()> {
        let ticks = self.gdb.word(self.places.ticks)?;
        self.observe(period as u32, ticks)
    }

    fn observe(&mut self, number: u32, ticks: u32) -> Result<()> {
        let observation = &self.observations[number as usize % self.observations.len()];
        self.send(&Message::Observation(Floats::Values(observation)), ticks)
    }

    /// Places a message in the queue of received bytes, as the serial port's interrupt does.
    fn send(&mut self, message: &Message<'_>, ticks: u32) -> Result<()> {
        let mut buffer = [0; QUEUE];
        let frame =
            self.link.sender.frame(message, ticks.wrapping_mul(1000), &mut buffer).context("the frame is too long")?;
        let input = self.places.input;
        let tail = self.gdb.word(input + 4)? as usize % QUEUE;
        let bytes = input + 8;
        let (first, rest) = frame.split_at(frame.len().min(QUEUE - tail));
        self.gdb.write(bytes + tail as u32, first)?;
        if !rest.is_empty() {
            self.gdb.write(bytes, rest)?;
        }
        self.gdb.write(input + 4, &(((tail + frame.len()) % QUEUE) as u32).to_le_bytes())
    }

    /// Returns the statuses that the board has sent since the last call.
    fn statuses(&mut self) -> Result<Vec<Status>> {
        let bytes = self.drain()?;
        let mut statuses = Vec::new();
        for byte in bytes {
            match self.link.receiver.push(byte).map(|received| received.message) {
                Some(Message::Status(status)) => statuses.push(status),
                Some(Message::Action { applied: true, values, .. }) => {
                    self.link.action = Some(values.iter().flat_map(f32::to_le_bytes).collect());
                }
                _ => {}
            }
        }
        Ok(statuses)
    }

    fn drain(&mut self) -> Result<Vec<u8>> {
        let mut all = Vec::new();
        loop {
            let mut bytes = [0; 4096];
            match self.link.serial.read(&mut bytes) {
                Ok(0) => return Ok(all),
                Ok(count) => all.extend(&bytes[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(all),
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Returns the detection of a stop that is not the `expected` one.
fn detection(expected: bool, stop: Stop) -> Option<Detection> {
    match stop {
        _ if expected => None,
        Stop::Watchdog => Some(Detection::Watchdog),
        _ => Some(Detection::Exception),
    }
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// Reads outputs: `None` for an axis that is not driven.
fn drives(bytes: &[u8]) -> Vec<Option<f32>> {
    let drive = |pair: &[u32]| (pair[0] == DRIVE).then(|| f32::from_bits(pair[1]));
    words(bytes).chunks_exact(2).map(drive).collect()
}

/// Frames and observations that the controller has refused.
fn refused(status: &Status) -> [u32; 2] {
    let counters = &status.counters;
    [counters.damaged + counters.malformed + counters.repeated + counters.lost, status.refused]
}

fn connect(path: &Path) -> Result<UnixStream> {
    let begun = Instant::now();
    loop {
        match UnixStream::connect(path) {
            Ok(stream) => return Ok(stream),
            Err(error) if begun.elapsed() > TIMEOUT => return Err(error).context("QEMU did not open its sockets"),
            Err(_) => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// Ends a QEMU whose board was not made.
struct Guard(Option<Child>);

impl Drop for Guard {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            // Nothing to do if it has ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Drop for Board<'_> {
    fn drop(&mut self) {
        // As above.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
