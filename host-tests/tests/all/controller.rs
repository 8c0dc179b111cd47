//! A whole controller with a real image: the firmware's work in a thread behind a socket, and the command `actq` at the
//! other end.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Poll;
use std::thread::JoinHandle;
use std::time::Duration;
use std::{fs, thread};

use actq::data::arrays;
use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::command::{actq, failed, run, succeeded};
use actq_bench::golden::Random;
use actq_bench::networks::{Builder, with_wrong_self_test};
use actq_bench::{bits, rtn};
use actq_boards::ram::Ram;
use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::slots::{Candidate, Key, Layout, Slots, Updater, Work};
use actq_controller::{Axis, Check, Endpoint, Guard, SafeAction, Safety, Settings};
use actq_kernels::{Head, Image, Width};
use actq_link::code::{Refusal, ResetCause, State};
use actq_link::frame;
use actq_link::report::{BUILT_IN, Timing};
use anyhow::{Context, Result, ensure};
use embedded_storage::nor_flash::ReadNorFlash as _;
use ndarray::Array3;
use serde_json::json;
use tempfile::TempDir;

use crate::folder::{write_observations, write_policy};

const OBS: usize = 24;
const ACT: usize = 3;
const SECTOR: usize = 16 << 10;
/// Pieces of a step between two polls of the line, each of which waits a millisecond for bytes.
const SLICES_PER_TURN: usize = 100;
/// Bytes read in a turn: fewer than an observation has, so that none is superseded before its step begins.
const BYTES_PER_TURN: usize = 64;
/// Ticks without an observation.
const DEADLINE: u32 = 500;

fn image(name: &str, seed: u64) -> Result<Vec<u8>> {
    let mut builder = Builder::new(OBS);
    // The seed changes the weights.
    builder.values(seed as usize);
    builder.linear((ACT, OBS), Activations::Int8, |_| Some(Width::W3), 0, true)?;
    builder.image(name)
}

/// The image of a flow that makes chunks of two actions, with random weights.
fn flow() -> Result<Vec<u8>> {
    let folder = TempDir::new()?;
    let json = json!({
        "name": "flow", "kind": "flow", "steps": 2, "chunk": 2, "execute": 2, "obs_dim": OBS, "act_dim": ACT,
        "time": {"freq": "frequencies"},
        "ops": [{"op": "linear", "w": "weights", "input": ["obs", "tfeat", "x"]}],
    });
    let (rows, cols, mut random) = (2 * ACT, OBS + 2 + 2 * ACT, Random::new(6));
    let weights = (0..rows * cols).map(|_| 0.2 * random.unit()).collect();
    let tensors = [("weights", vec![rows, cols], weights), ("frequencies", vec![1], vec![0.5])];
    write_policy(folder.path(), &json, tensors)?;
    rtn(&Policy::load(folder.path())?, Width::W8, 0, Activations::Int8)
}

struct Controller {
    port: String,
    /// `true` while it is armed.
    armed: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<()>>>,
}

impl Controller {
    fn start(built_in: Vec<u8>, key: [u8; 32]) -> Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let (port, stop) = (format!("tcp:{}", listener.local_addr()?), Arc::new(AtomicBool::new(false)));
        let armed = Arc::new(AtomicBool::new(false));
        let (stopped, is_armed) = (stop.clone(), armed.clone());
        let thread = thread::spawn(move || firmware(&listener, &stopped, &is_armed, &built_in, &key));
        Ok(Self { port, armed, stop, thread: Some(thread) })
    }

    /// Runs a command of `actq link`.
    fn actq(&self, command: &str, more: &[&str]) -> Result<std::process::Output> {
        run(actq(&[&["link", command, &self.port], more, &["--timeout", "600"]].concat()), &[])
    }

    fn end(mut self) -> Result<()> {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().context("the controller does not run")?.join();
        ended.map_err(|_| anyhow::anyhow!("the controller panicked"))?
    }
}

/// Returns `true` if an image may run here: the kernels accept it, its lengths fit, and its self-test passes.
fn test(buffer: &ImageBuffer) -> Result<(), Refusal> {
    let image = Image::new_checked(buffer.bytes()).map_err(|_| Refusal::Unfit)?;
    if (image.obs_len(), image.act_len()) != (OBS, ACT) {
        return Err(Refusal::Unfit);
    }
    let mut scratch = vec![0; image.scratch_words()];
    let mut head = Head::new(image, &mut scratch).map_err(|_| Refusal::Unfit)?;
    head.self_test().map_err(|_| Refusal::SelfTest)
}

/// The firmware's main, with a socket for a UART. It counts its time in turns of its loop, each of which waits a
/// millisecond for bytes. The time stops some turns after the last byte, so that a machine that delays the host lets no
/// deadline pass.
fn firmware(
    listener: &TcpListener,
    stop: &AtomicBool,
    armed: &AtomicBool,
    built_in: &[u8],
    key: &[u8; 32],
) -> Result<()> {
    let mut memory = vec![0; 4 * SECTOR];
    let flash = Ram::<4, SECTOR>::new(&mut memory);
    let sector = SECTOR as u32;
    let layout = Layout::new(&flash, 0..2 * sector, 2 * sector..4 * sector)?;
    let mut updater = Updater::new(Slots::new(flash, layout, Key::new(key)?, 0), None);

    let axis = Axis::new(-100.0, 100.0, f32::INFINITY, 0.0, SafeAction::Coast)?;
    let mut safety = Safety::new([axis; ACT], 1..=DEADLINE, 1);
    [Check::Clock, Check::Watchdog, Check::Hardware].into_iter().for_each(|check| safety.check(check, true));
    let breadcrumb = Record::report(ResetCause::Power, None);
    let facts = Facts { image: 0, slot: BUILT_IN, timing: Timing::default(), breadcrumb };
    let guard = Guard::<OBS>::new(OBS, &[], 500_000).context("there is room")?;
    let settings = Settings { status_period: 50, flash_while_armed: false, quiet: 1000 };
    let mut endpoint = Endpoint::<OBS, { frame::bytes(256) }>::new(guard, facts, settings);

    let (mut ticks, mut quiet, mut port) = (0, 0, None);
    let mut buffer = ImageBuffer::new(built_in);
    let read = |updater: &mut Updater<_, _>, candidate: &Candidate| -> Result<ImageBuffer> {
        let mut bytes = vec![0; candidate.length as usize];
        let flash: &mut Ram<'_, 4, SECTOR> = Updater::slots(updater).flash();
        flash.read(candidate.address, &mut bytes).map_err(|e| anyhow::anyhow!("{e:?}"))?;
        Ok(ImageBuffer::new(&bytes))
    };
    loop {
        let good = test(&buffer).is_ok();
        [Check::Image, Check::SelfTest].into_iter().for_each(|check| safety.check(check, good));
        let image = buffer.image(Path::new("the controller's image"))?;
        endpoint.facts.image = image.crc();
        let mut scratch = vec![0; image.scratch_words()];
        let mut head = Head::new(image, &mut scratch)?;
        let budget = head.least_budget();
        let mut stepping = None;
        let next = loop {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let micros = 1000 * ticks;
            let (mut out, mut sent, mut bytes) = ([0; 512], Vec::new(), [0; BYTES_PER_TURN]);
            if port.is_none()
                && let Ok((stream, _)) = {
                    listener.set_nonblocking(true)?;
                    listener.accept()
                }
            {
                stream.set_nonblocking(false)?;
                stream.set_read_timeout(Some(Duration::from_millis(1)))?;
                stream.set_nodelay(true)?;
                port = Some(stream);
            }
            let count = match port.as_mut().map(|port| port.read(&mut bytes)) {
                Some(Ok(count)) if count > 0 => count,
                Some(Err(e)) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => 0,
                // The host has closed the connection; another one may come.
                _ => {
                    port = None;
                    thread::sleep(Duration::from_millis(1));
                    0
                }
            };
            for byte in &bytes[..count] {
                let answer = endpoint.receive(*byte, micros, &mut safety, &mut updater, &mut out);
                sent.extend(answer.unwrap_or_default());
            }
            quiet = if count > 0 { 0 } else { quiet + 1 };
            if quiet <= DEADLINE / 4 {
                ticks += 1;
                safety.tick();
                armed.store(safety.state() == State::Armed, Ordering::Relaxed);
                sent.extend(endpoint.report(micros, &mut safety, &mut out).unwrap_or_default());
            }
            if stepping.is_none()
                && let Some(step) = endpoint.step(&mut safety)
            {
                if step.reset {
                    head.reset();
                }
                stepping = head.begin(step.observation).is_ok().then_some(step.of);
            }
            // Some slices of the step, and its action after the last one.
            for _ in 0..SLICES_PER_TURN {
                let acted = stepping.and_then(|of| match head.poll(budget) {
                    Ok(Poll::Pending) => None,
                    Ok(Poll::Ready(action)) => Some((of, Ok(action))),
                    Err(error) => Some((of, Err(error))),
                });
                if let Some((of, action)) = acted {
                    stepping = None;
                    sent.extend(endpoint.acted(of, action, micros, &mut safety, &mut out).unwrap_or_default());
                }
            }
            if let Some(port) = &mut port {
                // The next read notices a closed connection.
                drop(port.write_all(&sent));
            }
            if let Work::Test(candidate) = updater.work() {
                let new = read(&mut updater, &candidate)?;
                if updater.tested(test(&new)) {
                    endpoint.facts.slot = candidate.slot as u8;
                    break new;
                }
            }
        };
        buffer = next;
    }
}

/// A folder for files, with a recording in it.
fn folder() -> Result<(TempDir, PathBuf)> {
    let folder = TempDir::new()?;
    let path = folder.path().join("drive.npz");
    let mut random = Random::new(3);
    write_observations(&path, &Array3::from_shape_simple_fn((2, 20, OBS), || random.unit()))?;
    Ok((folder, path))
}

#[test]
fn the_command_watches_streams_and_updates() -> Result<()> {
    let (folder, recording) = folder()?;
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (old, new) = (image("old", 0)?, image("new", 50)?);
    for (name, bytes) in [("old.actq", &old), ("new.actq", &new), ("wrong.actq", &with_wrong_self_test(&new)?)] {
        fs::write(path(name), bytes)?;
    }
    let key = path("key.pem");
    let printed = succeeded(&run(actq(&["keygen", "--out", &key]), &[])?)?;
    let public = printed.rsplit_once("public key: ").context("no public key")?.1.trim().to_owned();
    failed(&run(actq(&["keygen", "--out", &key]), &[])?, 1, &["key.pem", "never replaced"])?;
    let bytes: Vec<u8> = public
        .as_bytes()
        .chunks(2)
        .map(|d| Ok(u8::from_str_radix(std::str::from_utf8(d)?, 16)?))
        .collect::<Result<_>>()?;
    let controller = Controller::start(old.clone(), bytes.as_slice().try_into()?)?;

    let shown = succeeded(&controller.actq("watch", &["--once"])?)?;
    for words in ["disarmed", "refused: no valid observation", "built in, 24 values to 3", "power on"] {
        assert!(shown.contains(words), "no {words:?} in\n{shown}");
    }
    failed(&controller.actq("arm", &[])?, 1, &["not armed", "send observations"])?;
    assert_eq!(succeeded(&controller.actq("get", &["high", "--axis", "2"])?)?, "100\n");
    succeeded(&controller.actq("set", &["high", "--axis", "2", "50"])?)?;
    assert_eq!(succeeded(&controller.actq("get", &["high", "--axis", "2"])?)?, "50\n");
    failed(&controller.actq("set", &["low", "-101"])?, 1, &["lower limit", "outside the parameter's range"])?;
    failed(&controller.actq("get", &["low", "--axis", "3"])?, 1, &["unknown parameter or axis"])?;

    let (recording, log) = (recording.display().to_string(), path("log.npz"));
    let arguments = [&path("old.actq"), &recording, "--arm", "--rate", "50", "--log", &log];
    succeeded(&controller.actq("stream", &arguments)?)?;
    check_log(&log, &old)?;

    for (name, version) in [("new", "2"), ("old", "1"), ("wrong", "3")] {
        let (image, signature) = (path(&format!("{name}.actq")), path(&format!("{name}.sig")));
        let sign = ["sign", &image, "--key", &key, "--version", version, "--out", &signature];
        succeeded(&run(actq(&sign), &[])?)?;
    }
    let push = |image: &str, more: &[&str]| controller.actq("push", &[&[&*path(image)], more].concat());
    failed(&push("new.actq", &[])?, 1, &["signature is missing"])?;
    failed(&push("new.actq", &["--signature", &path("old.sig")])?, 1, &["old.sig", "does not match this image"])?;
    failed(&push("wrong.actq", &["--signature", &path("wrong.sig")])?, 1, &["self-test failed"])?;
    let printed = succeeded(&push("new.actq", &["--signature", &path("new.sig")])?)?;
    assert!(printed.contains("new runs, version 2"), "{printed}");
    failed(
        &push("old.actq", &["--signature", &path("old.sig")])?,
        1,
        &["lower than that of an image that already ran"],
    )?;
    assert!(succeeded(&controller.actq("watch", &["--once"])?)?.contains("slot "));
    failed(&controller.actq("stream", &arguments)?, 1, &["runs another image", "actq link push"])?;
    let arguments = [&path("new.actq"), &recording, "--rate", "50", "--log", &log];
    succeeded(&controller.actq("stream", &arguments)?)?;
    check_log(&log, &new)?;
    controller.end()
}

/// The noise of a recorded flow stays on the host: the controller takes observations alone, and draws its own.
#[test]
fn flow_observations_are_streamed_without_noise() -> Result<()> {
    let (folder, recording) = folder()?;
    let path = |name: &str| folder.path().join(name).display().to_string();
    let image = flow()?;
    fs::write(path("flow.actq"), &image)?;
    let controller = Controller::start(image.clone(), [0; 32])?;
    let (recording, log) = (recording.display().to_string(), path("log.npz"));
    let arguments = [&path("flow.actq"), &recording, "--rate", "50", "--log", &log];
    succeeded(&controller.actq("stream", &arguments)?)?;
    check_log(&log, &image)?;
    controller.end()
}

/// A signal ends the stream and the answers to a simulator as their end does: the controller is disarmed.
#[cfg(unix)]
#[test]
fn signals_disarm_the_controller() -> Result<()> {
    let (folder, recording) = folder()?;
    let path = |name: &str| folder.path().join(name).display().to_string();
    fs::write(path("image.actq"), image("image", 0)?)?;
    let controller = Controller::start(fs::read(path("image.actq"))?, [0; 32])?;
    let (recording, log) = (recording.display().to_string(), path("log.npz"));
    let stream = ["link", "stream", &controller.port, &path("image.actq"), &recording, "--arm", "--rate", "5"];
    for arguments in [&[&stream[..], &["--log", &log]].concat()[..], &["link", "serve", &controller.port, "--arm"]] {
        let mut child = actq(&[arguments, &["--timeout", "600"]].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let mut requests = child.stdin.take().context("no input")?;
        requests.write_all(&[&[b'S'][..], &[0; 4 * OBS]].concat())?;
        while !controller.armed.load(Ordering::Relaxed) {
            ensure!(child.try_wait()?.is_none(), "{arguments:?} ended too early");
            thread::sleep(Duration::from_millis(5));
        }
        std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status()?;
        let output = child.wait_with_output()?;
        drop(requests);
        let stderr = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.code() == Some(143) && stderr.ends_with("actq: interrupted\n"), "{output:?}");
        ensure!(succeeded(&controller.actq("watch", &["--once"])?)?.contains("disarmed"), "{arguments:?}");
    }
    let rows = arrays(Path::new(&log))?["obs"].shape[0];
    ensure!((5..40).contains(&rows), "the log has {rows} observations");
    controller.end()
}

/// Requires that every action has the same bits as the image on this host.
fn check_log(log: &str, image: &[u8]) -> Result<()> {
    let log = arrays(Path::new(log))?;
    assert_eq!((&log["obs"].shape[..], &log["action"].shape[..]), (&[40, OBS][..], &[40, ACT][..]));
    let [obs, actions] = ["obs", "action"].map(|name| log[name].values.to_f32().expect("numbers"));
    let buffer = ImageBuffer::new(image);
    actq::runtime::with_head::<_, anyhow::Error>(buffer.image(Path::new("image"))?, |head| {
        let mut answered = 0;
        let steps = obs.chunks_exact(OBS).zip(actions.chunks_exact(ACT));
        for (obs, action) in steps.filter(|(_, action)| !action[0].is_nan()) {
            assert_eq!(bits(action), bits(head.step(obs)?));
            answered += 1;
        }
        assert_eq!(answered, 40);
        Ok(())
    })
}

#[test]
fn missing_controllers_and_wrong_command_lines_are_reported() -> Result<()> {
    let link = |arguments: &[&str]| run(actq(&[&["link"], arguments].concat()), &[]);
    succeeded(&link(&["ports"])?)?;
    failed(&link(&["watch", "tcp:127.0.0.1:1", "--once"])?, 1, &["tcp:127.0.0.1:1", "cannot be opened"])?;
    failed(&link(&["arm", "/dev/no-such-port"])?, 1, &["/dev/no-such-port", "cannot be opened", "actq link ports"])?;
    for arguments in
        [&["arm", "tcp:host"][..], &["arm"], &["set", "COM3", "high"], &["stream", "COM3", "a", "b", "--rate", "0"]]
    {
        failed(&link(arguments)?, 2, &["error"])?;
    }
    for arguments in [&["get", "deadline"][..], &["set", "max-age", "5"]] {
        let line = [&[arguments[0], "tcp:127.0.0.1:1"], &arguments[1..], &["--axis", "1"]].concat();
        failed(&link(&line)?, 1, &["--axis 1", "remove --axis"])?;
    }
    // A recording that ends before the controller would be armed.
    let (folder, recording) = folder()?;
    write_observations(&recording, &Array3::zeros((1, 5, OBS)))?;
    let image_file = folder.path().join("image.actq");
    fs::write(&image_file, image("image", 0)?)?;
    let (image_file, recording) = (image_file.display().to_string(), recording.display().to_string());
    let line = ["stream", "tcp:127.0.0.1:1", &image_file, &recording, "--arm"];
    failed(&link(&line)?, 1, &["drive.npz: has 5 observations, and --arm arms after 5", "record more"])?;
    // A listener that is no controller.
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let port = format!("tcp:{}", listener.local_addr()?);
    failed(&link(&["arm", &port, "--timeout", "0.3"])?, 1, &["no answer", &port])
}
