//! `actq link` with the application in QEMU, through the socket of its serial port: the commands that no other test
//! runs, and their messages about a faulty line.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpListener;
use std::process::{Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::command::{actq, answered, failed, run, succeeded};
use actq_bench::controller::{Controller, HANG_TIMEOUT, act};
use actq_bench::firmware;
use actq_bench::qemu::{self, step_request};
use actq_boards::Clock;
use actq_client::port::Port;
use actq_firmware_demo::timeouts::TIMEOUTS;
use actq_link::code::{Report, ResetCause, State};
use actq_link::report::Counters;
use actq_link::{Message, NO_ACTION, RESET, Receiver, Sender, frame};
use anyhow::{Context as _, Result, ensure};
use tempfile::NamedTempFile;

use super::application::{self_test, small_with_limits};

/// Starts the application with a small image in the slot, as fast as the host: a byte takes 40 µs.
fn start() -> Result<(Controller, NamedTempFile)> {
    let slot = qemu::slot(&small_with_limits()?)?;
    let elf = firmware::controller(Target::Fpu, "")?;
    Ok((Controller::start_by(Target::Fpu, &elf, Some(slot.path()), Clock::Host)?, slot))
}

fn link(controller: &Controller, words: &[&str], input: &[u8]) -> Result<Output> {
    let port = controller.address().to_string();
    let [command, more @ ..] = words else { anyhow::bail!("the command line is empty") };
    // QEMU may not run for seconds on a busy machine.
    let patience: &[&str] = if more.contains(&"--timeout") { &[] } else { &["--timeout", "600"] };
    run(actq(&[&["link", command, &port], more, patience].concat()), input)
}

/// The first observation of the image's self-test, and the bits of its action.
fn observation(slot: &NamedTempFile) -> Result<(Vec<f32>, Vec<u32>)> {
    self_test(&ImageBuffer::read(slot.path())?.image(slot.path())?, 0)
}

#[test]
fn arm_and_disarm_change_the_state() -> Result<()> {
    let (controller, slot) = start()?;
    let (observation, _) = observation(&slot)?;
    failed(&link(&controller, &["arm"], b"")?, 1, &["not armed", "send observations before arming"])?;
    // An observation is fresh for half a second, in which the command must start.
    let begun = Instant::now();
    loop {
        act(&mut controller.client()?, &observation)?;
        let output = link(&controller, &["arm"], b"")?;
        if output.status.success() {
            break;
        }
        failed(&output, 1, &["not armed", "send observations before arming"])?;
        ensure!(begun.elapsed() < HANG_TIMEOUT, "the command never ran within the deadline");
    }
    // Latched if the deadline has passed since.
    assert_ne!(controller.client()?.status()?.state, State::Disarmed);
    failed(&link(&controller, &["set", "deadline", "100"], b"")?, 1, &["cannot set deadline", "to 100"])?;
    succeeded(&link(&controller, &["disarm"], b"")?)?;
    assert_eq!(controller.client()?.status()?.state, State::Disarmed);
    succeeded(&link(&controller, &["set", "deadline", "100"], b"")?)?;
    assert_eq!(succeeded(&link(&controller, &["get", "deadline"], b"")?)?, "100\n");
    let printed = succeeded(&link(&controller, &["watch", "--once"], b"")?)?;
    assert!(printed.contains("state                 disarmed"), "{printed}");
    Ok(())
}

#[test]
fn serve_answers_a_simulator_then_disarms() -> Result<()> {
    let (controller, slot) = start()?;
    let (observation, bits) = observation(&slot)?;
    let input = [&[RESET][..], &step_request(&observation), &[RESET], &step_request(&observation)].concat();
    let expected: Vec<u8> = bits.iter().flat_map(|bits| bits.to_le_bytes()).collect();
    // While armed, the answers are the targets of the outputs: within the limits, the same values.
    for (arm, input, expected) in
        [(&[][..], &input, &expected.repeat(2)), (&["--arm"][..], &step_request(&observation), &expected)]
    {
        let begun = Instant::now();
        loop {
            let output = link(&controller, &[&["serve"], arm].concat(), input)?;
            // On a machine so busy that half a second has passed in between, or that observations were too old.
            if !output.status.success() && !arm.is_empty() {
                failed(&output, 1, &["within the deadline"])?;
            } else if !answered(&output)?.as_chunks().0.contains(&NO_ACTION.to_le_bytes()) {
                assert_eq!(&output.stdout, expected);
                break;
            }
            ensure!(begun.elapsed() < HANG_TIMEOUT, "the command was never in time");
        }
    }
    assert_eq!(controller.client()?.status()?.state, State::Disarmed);
    failed(&link(&controller, &["serve"], b"x")?, 1, &["unknown command byte 0x78"])?;
    failed(&link(&controller, &["serve"], &step_request(&observation)[..9])?, 1, &["ended inside an observation"])
}

/// It sends requests until QEMU's socket and the port's queue are full, and is silent. The board drops answers for
/// longer than the watchdog timeout of its own time: QEMU may run slowly, so the host is silent for longer and longer.
#[test]
fn a_host_that_never_reads_causes_no_reset() -> Result<()> {
    let (controller, _slot) = start()?;
    let mut host = controller.address().open()?;
    let (mut sender, mut buffer) = (Sender::new(0), [0; 64]);
    let (mut answers, mut last, mut dropping) = (Receiver::<{ frame::bytes(64) }>::new(), None, 0);
    // The host may have connected in the middle of a frame.
    let (mut aligned, mut silence, begun) = (false, Duration::from_secs(2), Instant::now());
    while dropping <= TIMEOUTS.turn.into() {
        ensure!(begun.elapsed() < HANG_TIMEOUT, "answers were dropped for at most {dropping} ticks: {last:?}");
        let mut requests = Vec::new();
        for _ in 0..200 {
            requests.extend(sender.frame(&Message::Ask(Report::Status), 0, &mut buffer).context("room for a request")?);
        }
        host.write_all(&requests)?;
        thread::sleep(silence);
        silence *= 2;
        for byte in arrived(&mut *host)? {
            aligned |= byte == 0;
            let received = if aligned { answers.push(byte).map(|r| (r.sequence, r.message)) } else { None };
            let Some((sequence, Message::Status(status))) = received else { continue };
            assert_eq!(status.reset, ResetCause::Unknown);
            // The dropped answers are missing before the first one after them.
            if let Some((before, ticks)) = last.replace((sequence, status.ticks))
                && sequence - before > 1
            {
                dropping = dropping.max(status.ticks - ticks);
            }
        }
        let Counters { damaged, malformed, repeated, .. } = answers.counters();
        assert_eq!([damaged, malformed, repeated], [0; 3]);
    }
    Ok(())
}

/// Reads until no bytes come for a moment.
fn arrived(port: &mut dyn Port) -> Result<Vec<u8>> {
    let (mut bytes, mut buffer) = (Vec::new(), [0; 4096]);
    loop {
        match port.read(&mut buffer) {
            Ok(count) => bytes.extend_from_slice(&buffer[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => return Ok(bytes),
            Err(error) => return Err(error.into()),
        }
    }
}

/// The board goes away while it serves a simulator: the command reports it after its timeout. QEMU may not answer
/// within that before, and refuses an observation that arrives late, so the timeout grows until it does.
#[test]
fn a_cut_line_is_reported() -> Result<()> {
    let (controller, slot) = start()?;
    let (observation, bits) = observation(&slot)?;
    let port = controller.address().to_string();
    let (mut timeout, mut answer) = (3, vec![0; 4 * bits.len()]);
    let (child, mut stdin) = loop {
        let mut command = actq(&["link", "serve", &port, "--timeout", &timeout.to_string()]);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
        let mut stdin = child.stdin.take().context("the command has no standard input")?;
        // The command may have ended.
        drop(stdin.write_all(&step_request(&observation)));
        let stdout = child.stdout.as_mut().context("the command has no standard output")?;
        if stdout.read_exact(&mut answer).is_ok() {
            break (child, stdin);
        }
        failed(&child.wait_with_output()?, 1, &["no answer for"])?;
        ensure!(timeout < HANG_TIMEOUT.as_secs(), "no answer within the timeout");
        timeout += 1;
    };
    drop(controller);
    stdin.write_all(&step_request(&observation))?;
    let output = child.wait_with_output()?;
    failed(&output, 1, &[&port, "lost", &format!("not reopened within {timeout}")])
}

/// Two connections: QEMU's port, a socket that accepts one, leaves the second without an answer.
#[test]
fn a_port_in_use_is_reported() -> Result<()> {
    let (controller, _slot) = start()?;
    let mut first = controller.client()?;
    first.status()?;
    failed(
        &link(&controller, &["disarm", "--timeout", "1"], b"")?,
        1,
        &["no bytes received", "no other program has the port open"],
    )?;
    drop(first);
    succeeded(&link(&controller, &["disarm", "--timeout", "600"], b"")?)?;
    Ok(())
}

/// The other end is no controller, or runs at another speed.
#[test]
fn a_foreign_answer_is_reported() -> Result<()> {
    loop {
        let (port, output) = watch_what_chatters()?;
        // On a busy machine the command may give up before the thread has written anything.
        if !String::from_utf8_lossy(&output.stderr).contains("no bytes received") {
            return failed(&output, 1, &[&port, "no valid frame received", "speed"]);
        }
    }
}

/// Opens a port at which a thread writes foreign bytes, and returns the message of `actq link watch`.
fn watch_what_chatters() -> Result<(String, Output)> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let port = format!("tcp:{}", listener.local_addr()?);
    let chatter = thread::spawn(move || -> Result<()> {
        let (mut stream, _) = listener.accept()?;
        // Until the command closes the connection.
        while stream.write_all(b"login: \0").is_ok() {
            thread::sleep(std::time::Duration::from_millis(10));
        }
        Ok(())
    });
    let output = run(actq(&["link", "watch", &port, "--once", "--timeout", "0.5"]), b"")?;
    chatter.join().map_err(|_| anyhow::anyhow!("the writing thread panicked"))??;
    Ok((port, output))
}
