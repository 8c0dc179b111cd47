//! A controller in a thread at the other end of a TCP socket. It uses the firmware's controller crate. Its clock counts
//! turns of its loop, each of which waits a millisecond for bytes.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use actq_boards::ram::Ram;
use actq_client::client::Client;
use actq_client::connection::Connection;
use actq_client::port::Address;
use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::slots::{Authority, Layout, Slots, Updater, Work};
use actq_controller::{Axis, Check, Endpoint, Guard, Output, SafeAction, Safety, Settings};
use actq_link::code::{Crash, Refusal, ResetCause};
use actq_link::frame;
use actq_link::report::{BUILT_IN, Timing};
use actq_testkit::Line;
use embedded_storage::nor_flash::ReadNorFlash as _;

pub(super) const OBSERVATION: usize = 4;
/// Ticks of 1 ms.
pub(super) const DEADLINE: u32 = 100;
/// Ticks after the last byte at which its clock stops, unless a test lets it run: a delayed host must not miss a
/// deadline, not even if some of its frames are lost in a row.
const QUIET: u32 = DEADLINE / 20;
/// Time without an answer after which a test fails; no result depends on it.
const HANG: Duration = Duration::from_secs(600);
const SECTOR: usize = 4096;
/// First bytes of an image that passes its self-test.
pub(super) const GOOD: &[u8] = b"good";

type End = Endpoint<'static, OBSERVATION, { frame::bytes(512) }>;

/// A test's control and view of the controller.
#[derive(Default)]
pub(super) struct Control {
    stop: AtomicBool,
    /// Ends the connection and accepts no other one while set.
    pub(super) cut: AtomicBool,
    /// Restarts the controller.
    pub(super) reset: AtomicBool,
    /// Holds the control tick.
    pub(super) hold: AtomicBool,
    /// Turns of a millisecond for which the loop does nothing, as on a machine that is busy.
    stall: AtomicU32,
    /// Number of next readings before which the token changes.
    pub(super) renew: AtomicU32,
    /// Lets the clock run although no bytes arrive.
    pub(super) silence: AtomicBool,
    /// Ticks of all starts.
    ticks: AtomicU32,
    /// Starts so far.
    pub(super) starts: AtomicU32,
    /// Outputs of the last tick.
    pub(super) outputs: Mutex<Vec<Output>>,
    /// The running image.
    pub(super) image: Mutex<Vec<u8>>,
}

impl Control {
    /// Stalls the controller for this many of its turns. It does nothing after this returns until they are over.
    pub(super) fn stall(&self, turns: u32) {
        self.stall.store(turns, Ordering::Relaxed);
        while self.stall.load(Ordering::Relaxed) == turns {
            std::thread::yield_now();
        }
    }

    /// Waits until the deadline passed without an observation and the following ramp ended. Calls `meanwhile` until
    /// then.
    pub(super) fn miss_the_deadline(&self, mut meanwhile: impl FnMut()) {
        let ticks = || self.ticks.load(Ordering::Relaxed);
        let (begun, ramp) = (ticks(), 100);
        self.silence.store(true, Ordering::Relaxed);
        while ticks() - begun <= DEADLINE + ramp {
            meanwhile();
        }
        self.silence.store(false, Ordering::Relaxed);
    }
}

/// A running controller.
pub(super) struct Simulated {
    pub(super) control: Arc<Control>,
    address: Address,
    thread: Option<JoinHandle<()>>,
}

impl Simulated {
    /// Starts a controller whose line has `faults` in a thousand frames, each way.
    pub(super) fn start<A>(faults: usize, authority: impl Fn() -> A + Send + 'static) -> Self
    where
        A: Authority,
    {
        let axis = Axis::new(-1.0, 1.0, 0.05, 0.0, SafeAction::Ramp { step: 0.01 }).expect("the axis is valid");
        Self::start_with([axis; 2], faults, authority)
    }

    /// Starts a controller as [`Self::start`] does, with other axes.
    pub(super) fn start_with<A>(axes: [Axis; 2], faults: usize, authority: impl Fn() -> A + Send + 'static) -> Self
    where
        A: Authority,
    {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = Address::Tcp(listener.local_addr().expect("the socket is bound").to_string());
        let control = Arc::new(Control::default());
        let shared = control.clone();
        let thread = std::thread::spawn(move || {
            let mut flash = vec![0x5a; 4 * SECTOR];
            while !shared.stop.load(Ordering::Relaxed) {
                shared.reset.store(false, Ordering::Relaxed);
                let starts = shared.starts.fetch_add(1, Ordering::Relaxed);
                run(&shared, &listener, &mut flash, authority(), axes, faults, starts);
            }
        });
        Self { control, address, thread: Some(thread) }
    }

    pub(super) fn client(&self) -> Client {
        let connection = Connection::open(self.address.clone(), HANG).expect("the controller listens");
        Client::new(connection, HANG)
    }

    pub(super) fn outputs(&self) -> Vec<Output> {
        self.control.outputs.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn image(&self) -> Vec<u8> {
        self.control.image.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Simulated {
    fn drop(&mut self) {
        self.control.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
            && !std::thread::panicking()
        {
            panic!("the controller has panicked");
        }
    }
}

fn test(image: &[u8]) -> Result<(), Refusal> {
    if image.starts_with(GOOD) { Ok(()) } else { Err(Refusal::SelfTest) }
}

/// Does the firmware's work from a start to a reset.
fn run<A: Authority>(
    control: &Control,
    listener: &TcpListener,
    flash: &mut [u8],
    authority: A,
    axes: [Axis; 2],
    faults: usize,
    starts: u32,
) {
    listener.set_nonblocking(true).expect("the socket has options");
    let flash = Ram::<4, SECTOR>::new(flash);
    let layout = Layout::new(&flash, 0..8192, 8192..16384).expect("the slots are valid");
    let mut slots = Slots::new(flash, layout, authority, 0);
    let running = slots.select(|| ()).filter(|candidate| !candidate.trial).map(|candidate| candidate.slot);
    let mut updater = Updater::new(slots, running);

    let mut safety = Safety::new(axes, 1..=DEADLINE, starts);
    Check::ALL.into_iter().for_each(|check| safety.check(check, true));
    let crash = Record { crash: Crash::Panic, pc: 0x0800_0100, detail: 17, ticks: 5, count: starts };
    let breadcrumb = Record::report(ResetCause::Watchdog, (starts > 0).then_some(crash));
    let facts =
        Facts { image: 0x1234, slot: BUILT_IN, timing: Timing { period: 1_000_000, ..Timing::default() }, breadcrumb };
    let guard = Guard::new(OBSERVATION, &[], 1_000_000).expect("the guard has room");
    let mut endpoint = End::new(guard, facts, Settings { status_period: 20, flash_while_armed: false, quiet: 1000 });

    let (mut inward, mut outward) = (Line::new(1, faults), Line::new(2, faults));
    let (mut stream, mut ticks, mut quiet) = (None::<TcpStream>, 0, 0);
    while !control.stop.load(Ordering::Relaxed) && !control.reset.load(Ordering::Relaxed) {
        if control.stall.load(Ordering::Relaxed) > 0 {
            std::thread::sleep(Duration::from_millis(1));
            control.stall.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        if control.cut.load(Ordering::Relaxed) {
            stream = None;
        } else if stream.is_none()
            && let Ok((accepted, _)) = listener.accept()
        {
            accepted.set_nonblocking(false).expect("the socket has options");
            accepted.set_read_timeout(Some(Duration::from_millis(1))).expect("the socket has options");
            accepted.set_nodelay(true).expect("the socket has options");
            stream = Some(accepted);
        }
        let micros = 1000 * ticks;
        let (mut out, mut sent) = ([0; 1024], Vec::new());
        let mut bytes = [0; 4096];
        let count = match stream.as_mut().map(|stream| stream.read(&mut bytes)) {
            Some(Ok(0)) => {
                stream = None;
                0
            }
            Some(Ok(count)) => count,
            Some(Err(e)) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => 0,
            Some(Err(_)) => {
                stream = None;
                0
            }
            None => {
                std::thread::sleep(Duration::from_millis(1));
                0
            }
        };
        if count > 0 && control.renew.load(Ordering::Relaxed) > 0 {
            control.renew.fetch_sub(1, Ordering::Relaxed);
            safety.renew();
        }
        for byte in inward.carry(&bytes[..count]) {
            sent.extend(endpoint.receive(byte, micros, &mut safety, &mut updater, &mut out).unwrap_or_default());
            // The head: half of the first two values. It takes each observation, however many frames have arrived.
            if let Some(step) = endpoint.step(&mut safety) {
                let (of, action) = (step.of, [0.5 * step.observation[0], 0.5 * step.observation[1]]);
                let sent_frame = endpoint.acted(of, Ok::<_, ()>(&action[..]), micros, &mut safety, &mut out);
                sent.extend(sent_frame.unwrap_or_default());
            }
        }
        quiet = if count > 0 { 0 } else { quiet + 1 };
        let passes = quiet <= QUIET || control.silence.load(Ordering::Relaxed);
        if passes && !control.hold.load(Ordering::Relaxed) {
            ticks += 1;
            control.ticks.fetch_add(1, Ordering::Relaxed);
            *control.outputs.lock().unwrap_or_else(PoisonError::into_inner) = safety.tick().to_vec();
            sent.extend(endpoint.report(micros, &mut safety, &mut out).unwrap_or_default());
        }
        if let Work::Test(candidate) = updater.work() {
            let mut image = vec![0; candidate.length as usize];
            updater.slots().flash().read(candidate.address, &mut image).expect("the image is within the flash");
            if updater.tested(test(&image)) {
                endpoint.facts.slot = candidate.slot as u8;
                *control.image.lock().unwrap_or_else(PoisonError::into_inner) = image;
            }
        }
        if let Some(open) = &mut stream
            && open.write_all(&outward.carry(&sent)).is_err()
        {
            stream = None;
        }
    }
}
