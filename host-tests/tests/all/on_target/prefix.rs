//! A prefix that a host sends to the application in QEMU: the actions have the host's bits, and no old one is used.

use std::fs;
use std::time::{Duration, Instant};

use actq::data::arrays;
use actq::runtime::{ImageBuffer, prefix_len, take_prefix, with_head};
use actq_bench::command::{actq, run, succeeded};
use actq_bench::controller::{Controller, HANG_TIMEOUT, wait_until};
use actq_bench::{Target, bits, firmware, qemu};
use actq_boards::Clock;
use actq_client::client::Client;
use actq_client::event::Event;
use actq_client::push::{Prefix, Push, push_prefix};
use actq_kernels::image::Cache;
use actq_link::code::{Fault, Refusal, State};
use actq_testkit::Random;
use anyhow::{Context as _, Result, bail, ensure};
use ndarray::Array3;
use tempfile::TempDir;

use crate::attention::Prefixed;
use crate::draft::Draft;
use crate::folder::write_observations;

/// Six axes, and a prefix of several frames.
fn prefixed() -> Prefixed {
    let cache = Cache { heads: 1, dim: 3, slots: 200, own: 0 };
    let caches = vec![cache, Cache { slots: 30, own: 4, ..cache }];
    Prefixed { heads: 2, caches, tokens: 1, is_causal: false, factor: 0.5 }
}

/// The board, its client, the image's checksum, an observation, and two prefixes with the bits of their actions.
struct Bench {
    controller: Controller,
    client: Client,
    image: u32,
    observation: Vec<f32>,
    prefixes: [(Vec<u8>, Vec<u32>); 2],
}

impl Bench {
    /// Starts the board, as fast as the host: lifetimes must not pass in its time while a busy machine stops the host.
    fn start() -> Result<Self> {
        let (prefixed, mut random) = (prefixed(), Random::new(15));
        let draft = Draft(prefixed.image());
        let file = qemu::slot(draft.bytes())?;
        let buffer = ImageBuffer::new(draft.bytes());
        let image = buffer.image(file.path())?;
        let observation: Vec<f32> = (0..prefixed.obs_len()).map(|_| random.unit()).collect();
        let mut prefixes = [(); 2].map(|()| (prefixed.bytes(&prefixed.keys_and_values(&mut random)), Vec::new()));
        for (bytes, action) in &mut prefixes {
            *action = with_head::<_, anyhow::Error>(image, |head| {
                head.set_prefix(bytes)?;
                Ok(bits(head.step(&observation)?))
            })?;
        }
        ensure!(prefixes[0].1 != prefixes[1].1);
        let elf = firmware::controller_with(Target::Fpu, file.path())?;
        let controller = Controller::start_by(Target::Fpu, &elf, None, Clock::Host)?;
        let client = controller.client()?;
        Ok(Self { controller, client, image: image.crc(), observation, prefixes })
    }

    /// Sends a prefix before anything is armed.
    fn send(&mut self, i: usize, lifetime: u32) -> Result<()> {
        let bytes = self.prefixes[i].0.clone();
        push_prefix(&mut self.client, &Prefix { bytes: &bytes, image: self.image, lifetime })
    }
}

impl Bench {
    /// Sends a prefix and an observation; returns the bits of the action, and `true` if it is applied. Both again if the
    /// observation arrived too late or after the lifetime.
    fn act(&mut self, i: usize) -> Result<(bool, Vec<u32>)> {
        let begun = Instant::now();
        while begun.elapsed() < HANG_TIMEOUT {
            self.send(i, 10_000)?;
            let number = self.client.observe(&self.observation)?;
            let sent = Instant::now();
            while sent.elapsed() < Duration::from_secs(2) {
                for event in self.client.events()? {
                    if let Event::Action { of, applied, values, .. } = event
                        && of == number
                    {
                        return Ok((applied, bits(&values)));
                    }
                }
            }
        }
        bail!("no action came: {:?}", self.client.status()?)
    }
}

#[test]
fn a_prefix_over_the_link_gives_the_hosts_bits() -> Result<()> {
    let mut bench = Bench::start()?;
    let status = bench.client.status()?;
    assert_eq!((status.image, status.refusal), (bench.image, Some(Refusal::Prefix)));
    let error = format!("{:#}", bench.client.arm().expect_err("there is no prefix"));
    assert!(error.contains("prefix is missing"), "{error}");
    for i in [0, 1, 0] {
        assert_eq!(bench.act(i)?, (false, bench.prefixes[i].1.clone()), "prefix {i}");
    }
    // Prefixes that the head refuses.
    let mut wrong = bench.prefixes[1].0.clone();
    wrong[..4].copy_from_slice(&201u32.to_le_bytes());
    let refused = |bench: &mut Bench, prefix: Prefix<'_>, refusal: Refusal| {
        let error = format!("{:#}", push_prefix(&mut bench.client, &prefix).expect_err("it is wrong"));
        assert!(error.contains(&refusal.to_string()), "{error}");
    };
    let image = bench.image;
    refused(&mut bench, Prefix { bytes: &wrong, image, lifetime: 10_000 }, Refusal::Range);
    refused(&mut bench, Prefix { bytes: &wrong, image, lifetime: 10_001 }, Refusal::Range);
    refused(&mut bench, Prefix { bytes: &wrong, image: image ^ 1, lifetime: 10_000 }, Refusal::Unfit);
    refused(&mut bench, Prefix { bytes: &wrong[4..], image, lifetime: 10_000 }, Refusal::Length);
    // Its lifetime ends.
    bench.send(1, 100)?;
    wait_until(&mut bench.client, "over", |status| status.refusal == Some(Refusal::Prefix))?;
    let number = bench.client.observe(&bench.observation)?;
    let status = bench.client.status()?;
    assert_eq!(status.state, State::Disarmed, "frame {number} has no action");
    assert_eq!(bench.act(1)?, (false, bench.prefixes[1].1.clone()));
    Ok(())
}

/// Arms with a prefix of this lifetime and runs `run`; both again if the machine is too busy for the deadline, as `run` tells
/// by `false`.
fn armed(lifetime: u32, mut run: impl FnMut(&mut Bench) -> Result<bool>) -> Result<()> {
    let mut bench = Bench::start()?;
    let begun = Instant::now();
    loop {
        ensure!(begun.elapsed() < HANG_TIMEOUT, "the host never was in time: {:?}", bench.client.status()?);
        bench.client.disarm()?;
        bench.send(0, lifetime)?;
        bench.client.observe(&bench.observation)?;
        if bench.client.arm().is_ok() && run(&mut bench)? {
            return Ok(());
        }
    }
}

#[test]
fn an_armed_controller_takes_the_next_prefix() -> Result<()> {
    armed(10_000, |bench| {
        // Observations in between keep the controller armed.
        let bytes = bench.prefixes[1].0.clone();
        let mut push = Push::prefix(&mut bench.client, Prefix { bytes: &bytes, image: bench.image, lifetime: 10_000 })?;
        loop {
            bench.client.observe(&bench.observation)?;
            if push.advance(&mut bench.client)? {
                break;
            }
        }
        let (applied, action) = bench.act(1)?;
        assert_eq!(action, bench.prefixes[1].1);
        Ok(applied)
    })
}

#[test]
fn an_old_prefix_latches() -> Result<()> {
    armed(1500, |bench| {
        let status = loop {
            bench.client.observe(&bench.observation)?;
            let status = bench.client.status()?;
            if status.state != State::Armed {
                break status;
            }
        };
        let fault = status.fault.context("it has stopped")?;
        if fault == Fault::Prefix {
            assert_eq!((status.state, status.refusal), (State::Latched, Some(Refusal::Prefix)));
            return Ok(true);
        }
        ensure!([Fault::Stale, Fault::Late].contains(&fault), "{fault}");
        Ok(false)
    })
}

/// `actq link stream` sends the prefix of a recording's first row before all observations, and another one between them.
#[test]
fn a_recorded_prefix_is_streamed() -> Result<()> {
    const EACH: usize = 20;
    let bench = Bench::start()?;
    drop(bench.client);
    let folder = TempDir::new()?;
    let path = |name: &str| folder.path().join(name).display().to_string();
    let [image_file, recording, log] = ["image.actq", "rows.npz", "log.npz"].map(path);
    let draft = Draft(prefixed().image());
    fs::write(&image_file, draft.bytes())?;
    let buffer = ImageBuffer::new(draft.bytes());
    let image = buffer.image(image_file.as_ref())?;
    let (own, prefix, mut random) = (image.obs_len(), prefix_len(&image), Random::new(16));
    let prefixes = [(); 2].map(|()| (0..prefix).map(|_| random.unit()).collect::<Vec<f32>>());
    let rows = Array3::from_shape_fn((1, 2 * EACH, own + prefix), |(_, row, i)| match i.checked_sub(own) {
        Some(i) => prefixes[row / EACH][i],
        None => random.unit(),
    });
    write_observations(recording.as_ref(), &rows)?;
    let port = bench.controller.address().to_string();
    let line = ["link", "stream", &port, &image_file, &recording, "--rate", "20", "--log", &log, "--timeout", "600"];
    let begun = Instant::now();
    loop {
        ensure!(begun.elapsed() < HANG_TIMEOUT, "the second prefix never came in time");
        succeeded(&run(actq(&line), &[])?)?;
        let log = arrays(log.as_ref())?;
        let [observations, actions] = ["obs", "action"].map(|name| log[name].values.to_f32().unwrap_or_default());
        let steps = observations.chunks_exact(own).zip(actions.chunks_exact(image.act_len())).enumerate();
        let answered = steps.filter(|(_, (_, action))| !action[0].is_nan());
        let mut of_second = false;
        with_head::<_, anyhow::Error>(image, |head| {
            for (row, (observation, action)) in answered {
                let mut with = |prefix: &[f32]| -> Result<bool> {
                    let row = [observation, prefix].concat();
                    let (observation, _) = take_prefix(head, &row)?;
                    Ok(bits(head.step(observation)?) == bits(action))
                };
                let [first, second] = [with(&prefixes[0])?, with(&prefixes[1])?];
                ensure!(first != second && (!of_second || second) && (row >= EACH || first), "row {row}");
                of_second |= second;
            }
            Ok(())
        })?;
        if of_second {
            return Ok(());
        }
    }
}
