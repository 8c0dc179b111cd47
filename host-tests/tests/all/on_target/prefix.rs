//! A prefix that a host sends to the application in QEMU: the actions have the host's bits, and no old one is used.

use std::time::{Duration, Instant};

use actq::runtime::{ImageBuffer, with_head};
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

use crate::attention::Prefixed;
use crate::draft::Draft;

/// Six axes, and a prefix of several frames.
fn prefixed() -> Prefixed {
    let cache = Cache { heads: 1, dim: 3, slots: 200 };
    Prefixed { heads: 2, caches: vec![cache, Cache { slots: 30, ..cache }], tokens: 1, factor: 0.5 }
}

/// The board, its client, the image's checksum, an observation, and two prefixes with the bits of their actions.
struct Bench {
    _controller: Controller,
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
        let observation: Vec<f32> = (0..prefixed.len()).map(|_| random.unit()).collect();
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
        Ok(Self { _controller: controller, client, image: image.crc(), observation, prefixes })
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
