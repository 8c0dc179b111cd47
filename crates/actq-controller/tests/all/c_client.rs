//! The C host of `examples/c/link` against the controller's end of the link, at a socket.

use std::fs;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::{Axis, Check, Endpoint, Guard, SafeAction, Safety, Settings};
#[cfg(feature = "prefix")]
use actq_link::code::Refusal;
use actq_link::code::{Fault, ResetCause, State};
use actq_link::report::{BUILT_IN, Timing};
use actq_link::{Message, Receiver, frame};

use crate::receives::Receives;

const FRAME: usize = frame::bytes(512);
const ACTIONS: u32 = 20;
/// Frames of a client that does not end.
const MOST_FRAMES: usize = 100_000;

/// A folder with the program, deleted at the end.
struct Client(PathBuf);

impl Client {
    /// `None` without a C compiler.
    fn build(name: &str) -> Option<Self> {
        let folder = std::env::temp_dir().join(format!("actq-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/c/link");
        let sources = ["actq_link.c", "main.c"].map(|source| sources.join(source));
        let client = Self(folder);
        let strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-o"];
        match Command::new("cc").args(strict).arg(client.path("client")).args(sources).status() {
            Err(error) if error.kind() == ErrorKind::NotFound => return None,
            status => assert!(status.expect("cc runs").success()),
        }
        Some(client)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Runs the program on a controller in this state, which has a fault after `faults_after` actions.
    fn run(&self, state: State, faults_after: Option<u32>) -> (Output, Controller) {
        self.run_with(Controller::new(state, faults_after), &[])
    }

    /// Runs the program with more arguments.
    fn run_with(&self, mut controller: Controller, more: &[&str]) -> (Output, Controller) {
        let socket = self.path("socket");
        let _ = fs::remove_file(&socket);
        let listener = UnixListener::bind(&socket).expect("a socket");
        let mut client = Command::new(self.path("client"));
        client.arg(&socket).arg(ACTIONS.to_string()).args(more).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut client = client.spawn().expect("the client runs");
        let (mut line, _) = listener.accept().expect("the client connects");
        line.set_nonblocking(true).expect("the socket has options");
        while client.try_wait().expect("the client runs").is_none() {
            controller.turn(&mut line);
            assert!(controller.frames.len() < MOST_FRAMES, "the client does not end");
            sleep(Duration::from_millis(1));
        }
        (client.wait_with_output().expect("its output"), controller)
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

struct Controller {
    safety: Safety<1>,
    endpoint: Endpoint<'static, 3, FRAME>,
    begun: Instant,
    faults_after: Option<u32>,
    applied: u32,
    /// A second receiver of the host's frames.
    heard: Receiver<FRAME>,
    /// Number and time of each.
    frames: Vec<[u32; 2]>,
    /// Requests to arm.
    arms: u32,
    update: Receives,
}

impl Controller {
    fn new(state: State, faults_after: Option<u32>) -> Self {
        let axis = Axis::new(-1.0, 1.0, 1.0, 0.0, SafeAction::Hold).expect("the axis is valid");
        let mut safety = Safety::new([axis], 1..=30_000, 1);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        if state == State::Latched {
            safety.observed();
            safety.arm(safety.token()).expect("armed");
            safety.trip(Fault::Overrun);
        }
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 0xabcd, slot: BUILT_IN, timing: Timing::default(), breadcrumb };
        let settings = Settings { status_period: 100, flash_while_armed: false, quiet: 1000 };
        let endpoint = Endpoint::new(Guard::full(&[], u32::MAX), facts, settings);
        let (heard, frames, begun) = (Receiver::new(), Vec::new(), Instant::now());
        Self { safety, endpoint, begun, faults_after, applied: 0, heard, frames, arms: 0, update: Receives::default() }
    }

    fn turn(&mut self, line: &mut UnixStream) {
        let micros = self.begun.elapsed().as_micros() as u32;
        let (mut bytes, mut out, mut sent) = ([0; 4096], [0; 128], Vec::new());
        let len = line.read(&mut bytes).unwrap_or(0);
        for byte in &bytes[..len] {
            if let Some(received) = self.heard.push(*byte) {
                self.frames.push([received.sequence, received.micros]);
                self.arms += u32::from(matches!(received.message, Message::Arm { .. }));
            }
            let answer = self.endpoint.receive(*byte, micros, &mut self.safety, &mut self.update, &mut out);
            sent.extend(answer.unwrap_or_default());
        }
        sent.extend(self.endpoint.report(micros, &mut self.safety, &mut out).unwrap_or_default());
        #[cfg(feature = "prefix")]
        self.refresh();
        if let Some(of) = self.endpoint.step(&mut self.safety).map(|step| step.of) {
            let action = Ok::<_, ()>(&[0.5][..]);
            sent.extend(self.endpoint.acted(of, action, micros, &mut self.safety, &mut out).unwrap_or_default());
            self.applied += u32::from(self.safety.state() == State::Armed);
        }
        self.safety.tick();
        if self.faults_after == Some(self.applied) {
            self.safety.trip(Fault::Head);
        }
        // The client may have ended.
        let _ = line.write_all(&sent);
    }
}

#[cfg(feature = "prefix")]
impl Controller {
    /// Creates a controller of an image with a prefix of `len` bytes.
    fn with_prefix(len: usize) -> Self {
        let memory = Box::leak(vec![0; len].into_boxed_slice());
        let mut controller = Self::new(State::Disarmed, None);
        controller.safety.check(Check::Prefix, false);
        controller.update.transfer = Some(actq_controller::prefix::Transfer::new(memory, 0xabcd, 60_000));
        controller
    }

    /// Does what the firmware does, with a head that takes a prefix whose first byte is 0.
    fn refresh(&mut self) {
        let Some(transfer) = &mut self.update.transfer else { return };
        if let Some(prefix) = transfer.whole() {
            let outcome = if prefix.first() == Some(&0) { Ok(()) } else { Err(Refusal::Range) };
            transfer.installed(outcome);
        }
        let is_fresh = transfer.is_fresh(self.safety.ticks());
        self.safety.check(Check::Prefix, is_fresh);
    }
}

#[cfg(feature = "prefix")]
#[test]
fn the_c_client_sends_a_prefix_before_it_arms() {
    let Some(client) = Client::build("c-prefix") else { return };
    let file = client.path("prefix");
    let name = file.to_str().expect("a name");
    let bytes: Vec<u8> = (0..5000).map(|i| (i % 251) as u8).collect();
    fs::write(&file, &bytes).expect("a file");
    let (output, controller) = client.run_with(Controller::with_prefix(bytes.len()), &[name, "60000"]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!((controller.arms, controller.safety.state()), (1, State::Disarmed));
    assert!(controller.applied >= ACTIONS);
    let transfer = controller.update.transfer.expect("a transfer");
    assert_eq!(transfer.written() as usize, bytes.len());
    // A prefix of another length, and one that the head does not take.
    let (output, controller) = client.run_with(Controller::with_prefix(bytes.len() - 4), &[name, "60000"]);
    assert_eq!(error(&output), "the controller refuses the prefix: refusal 11\n");
    assert_eq!(controller.arms, 0);
    let (output, _) = client.run_with(Controller::with_prefix(bytes.len()), &[name, "60001"]);
    assert_eq!(error(&output), "the controller refuses the prefix: refusal 9\n");
    fs::write(&file, vec![1; bytes.len()]).expect("a file");
    let (output, _) = client.run_with(Controller::with_prefix(bytes.len()), &[name, "60000"]);
    assert_eq!(error(&output), "the controller refuses the prefix: refusal 9\n");
    // An image without a prefix.
    let (output, _) = client.run_with(Controller::new(State::Disarmed, None), &[name, "60000"]);
    assert_eq!(error(&output), "the controller refuses the prefix: refusal 18\n");
}

fn error(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    std::str::from_utf8(&output.stderr).expect("text")
}

/// It arms once: what has stopped a controller may still be there.
#[test]
fn the_c_client_never_arms_again() {
    let Some(client) = Client::build("c-arms") else { return };
    let (output, controller) = client.run(State::Disarmed, None);
    assert!(output.status.success(), "{output:?}");
    assert_eq!((controller.arms, controller.safety.state()), (1, State::Disarmed));
    assert!(controller.applied >= ACTIONS);
    let (output, controller) = client.run(State::Disarmed, Some(ACTIONS / 2));
    assert_eq!(error(&output), "the controller is not armed: state 2, fault 3\n");
    assert_eq!((controller.arms, controller.safety.state()), (1, State::Latched));
    let (output, controller) = client.run(State::Latched, None);
    assert_eq!(error(&output), "the controller is not armed: state 2, fault 9\n");
    assert_eq!((controller.arms, controller.safety.state()), (0, State::Latched));
}

/// Numbers in milliseconds and times in microseconds of the time of day: a later run repeats none.
#[test]
fn the_c_client_repeats_no_number_and_no_time() {
    let Some(client) = Client::build("c-numbers") else { return };
    let now = || {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("after 1970");
        [now.as_millis() as u32, now.as_micros() as u32]
    };
    let mut last = None::<u32>;
    for _ in 0..2 {
        let before = now();
        let (_, controller) = client.run(State::Disarmed, None);
        let (first, after) = (controller.frames[0], now());
        for i in 0..2 {
            assert!(
                first[i].wrapping_sub(before[i]) <= after[i].wrapping_sub(before[i]),
                "{before:?} {first:?} {after:?}"
            );
        }
        let number = first[0];
        assert!(last.is_none_or(|last| number.wrapping_sub(last).wrapping_sub(1) < 1 << 31), "{number} after {last:?}");
        last = controller.frames.last().map(|[number, _]| *number);
    }
}
