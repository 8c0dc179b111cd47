//! The action contract, chunk playback, and saved states, against plain arithmetic in f64. There is no network: the
//! observation is the raw output, bit for bit.

use std::task::Poll;

use actq::contract::{ActionContract, Binarise, Ensemble, Playback};
use actq::graph::ops::{Linear, Lstm, Normalize};
use actq::graph::{Graph, NodeKind};
use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::command::{actq, answered, failed, run, succeeded};
use actq_bench::networks::Builder;
use actq_bench::qemu::{self, Server, step_request};
use actq_bench::{Target, bits, firmware};
use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::update::NoUpdate;
use actq_controller::{Axis, Endpoint, Guard, Safety, Settings};
use actq_firmware_demo::running::{Running, SLICE};
use actq_kernels::image::{Kind, checksum};
use actq_kernels::{Head, SavedError, StepError, Width};
use actq_link::code::ResetCause;
use actq_link::report::BUILT_IN;
use actq_link::{Floats, Message, NO_ACTION, RESET, Receiver, Sender, frame};
use anyhow::{Context as _, Result, ensure};
use proptest::prelude::*;

use crate::ops::wide;

const ACT: usize = 2;

/// An image that returns its observation as the raw output.
fn echo(chunk: usize, execute: usize, contract: ActionContract) -> ImageBuffer {
    echo_of(1, chunk, execute, contract)
}

/// The same, in a number of operations.
fn echo_of(operations: usize, chunk: usize, execute: usize, contract: ActionContract) -> ImageBuffer {
    let len = chunk * ACT;
    let mut graph = Graph::new(len);
    let unlimited = f32::INFINITY;
    let same = Normalize { mean: vec![0.0; len], scale: vec![1.0; len], pre_clip: unlimited, clip: unlimited };
    for value in 0..operations {
        graph.add(NodeKind::from(same.clone()), &[value]).expect("it fits");
    }
    let kind = if chunk > 1 { Kind::Chunk } else { Kind::Step };
    let policy = Policy { kind, chunk, execute, act_len: ACT, contract, ..Policy::of("echo", graph) };
    policy.check().expect("the policy fits together");
    ImageBuffer::new(&actq::emit::image(&policy, &[]).expect("the policy fits the format"))
}

pub(crate) fn with_head<T>(buffer: &ImageBuffer, work: impl FnOnce(&mut Head<'_, '_>) -> T) -> T {
    let image = buffer.image("memory".as_ref()).expect("the image is valid");
    let mut scratch = vec![0; image.scratch_words()];
    work(&mut Head::new(image, &mut scratch).expect("the scratch memory has the image's size"))
}

/// Sixty-fourths: sums and products of a few are exact in f32, so that thresholds agree with f64.
fn sixty_fourths(from: i32, to: i32) -> impl Strategy<Value = f32> + Clone {
    (from..=to).prop_map(|n| n as f32 / 64.0)
}

fn each<T: std::fmt::Debug + Clone>(of: impl Strategy<Value = T> + Clone) -> impl Strategy<Value = Vec<T>> {
    prop::collection::vec(of, ACT)
}

fn contracts() -> impl Strategy<Value = ActionContract> {
    let value = || sixty_fourths(-128, 128);
    let some = |of: BoxedStrategy<Vec<f32>>| prop::option::of(of);
    let binarise = (each(value()), each(sixty_fourths(0, 64)), each(value()), each(prop::bool::ANY)).prop_map(
        |(off, gap, off_value, concerned)| Binarise {
            on: off.iter().zip(&gap).map(|(off, gap)| off + gap).collect(),
            on_value: off_value.iter().zip(&concerned).map(|(v, yes)| if *yes { v + 0.75 } else { *v }).collect(),
            off_value,
            off,
        },
    );
    let limits = (each(value()), each(sixty_fourths(0, 96)))
        .prop_map(|(low, range)| (low.iter().zip(range).map(|(low, range)| low + range).collect::<Vec<f32>>(), low));
    let affine = (some(each(value()).boxed()), some(each(value()).boxed()), prop::option::of(binarise));
    let steps = (some(each(sixty_fourths(0, 64)).boxed()), some(each(sixty_fourths(1, 64)).boxed()));
    (affine, prop::option::of(limits), steps).prop_map(|((scale, offset, binarise), limits, (max_step, smoothing))| {
        let (high, low) = limits.unzip();
        ActionContract { scale, offset, binarise, low, high, max_step, smoothing, ..ActionContract::default() }
    })
}

/// The contract in f64, in the order of docs/FORMAT.md.
struct Oracle<'c> {
    by: &'c ActionContract,
    last: Option<Vec<f64>>,
    on: Vec<bool>,
}

impl<'c> Oracle<'c> {
    fn new(by: &'c ActionContract) -> Self {
        Self { by, last: None, on: vec![false; ACT] }
    }

    fn action(&mut self, raw: &[f64]) -> Vec<f64> {
        let at = |array: &Option<Vec<f32>>, i: usize| array.as_ref().map(|values| f64::from(values[i]));
        let one = |(i, x): (usize, &f64)| {
            let mut a = x * at(&self.by.scale, i).unwrap_or(1.0) + at(&self.by.offset, i).unwrap_or(0.0);
            if let Some(by) = &self.by.binarise
                && by.on_value[i] != by.off_value[i]
            {
                if a >= f64::from(by.on[i]) {
                    self.on[i] = true;
                } else if a <= f64::from(by.off[i]) {
                    self.on[i] = false;
                }
                a = f64::from(if self.on[i] { by.on_value[i] } else { by.off_value[i] });
            }
            a = a.max(at(&self.by.low, i).unwrap_or(f64::MIN)).min(at(&self.by.high, i).unwrap_or(f64::MAX));
            if let Some(last) = self.last.as_ref().map(|last| last[i]) {
                let step = at(&self.by.max_step, i).unwrap_or(f64::MAX);
                a = a.clamp(last - step, last + step);
                a = last + at(&self.by.smoothing, i).unwrap_or(1.0) * (a - last);
            }
            a
        };
        let action: Vec<f64> = raw.iter().enumerate().map(one).collect();
        self.last = Some(action.clone());
        action
    }
}

fn close(ours: &[f32], expected: &[f64]) -> bool {
    ours.len() == expected.len() && ours.iter().zip(expected).all(|(a, e)| (f64::from(*a) - e).abs() <= 1e-5)
}

proptest! {
    #[test]
    fn the_contract_matches_plain_arithmetic(
        contract in contracts(),
        raw in prop::collection::vec(each(sixty_fourths(-160, 160)), 1..40),
    ) {
        let mut oracle = Oracle::new(&contract);
        with_head(&echo(1, 1, contract.clone()), |head| {
            let mut last: Option<Vec<f32>> = None;
            for raw in &raw {
                let action = head.step(raw).expect("it is finite").to_vec();
                let expected = oracle.action(&wide(raw));
                prop_assert!(close(&action, &expected), "found {action:?}, expected {expected:?}");
                for (i, a) in action.iter().enumerate() {
                    // Limits are exact, however the low-pass filter rounds.
                    prop_assert!(contract.low.as_ref().is_none_or(|low| *a >= low[i]));
                    prop_assert!(contract.high.as_ref().is_none_or(|high| *a <= high[i]));
                    if let (Some(last), Some(step)) = (&last, &contract.max_step) {
                        prop_assert!(*a >= last[i] - step[i] && *a <= last[i] + step[i]);
                    }
                }
                last = Some(action);
            }
            Ok(())
        })?;
    }
}

/// The event of a control period.
#[derive(Clone, Debug)]
enum Period {
    /// A step that ends after this many periods, in each of which the previous chunk continued, or nothing played.
    Step(Vec<f32>, Vec<bool>),
    /// The chunk continues without an observation.
    Play,
    /// No event.
    Pass(usize),
}

fn periods(chunk: usize) -> impl Strategy<Value = Vec<Period>> {
    let raw = prop::collection::vec(-1.0f32..1.0, chunk * ACT);
    let prompt = raw.clone().prop_map(|raw| Period::Step(raw, Vec::new()));
    let late = (raw, prop::collection::vec(prop::bool::weighted(0.7), 0..chunk + 2));
    let period = prop_oneof![
        6 => prompt,
        4 => late.prop_map(|(raw, waits)| Period::Step(raw, waits)),
        1 => Just(Period::Play),
        1 => (0..chunk + 2).prop_map(Period::Pass),
    ];
    prop::collection::vec(period, 1..60)
}

/// Chunk length, execute length, and playback.
fn playbacks() -> impl Strategy<Value = (usize, usize, Playback)> {
    (2usize..9).prop_flat_map(|chunk| {
        let late = move |oldest: usize| prop::option::of(oldest..=chunk + 1);
        let ensemble = (1..=chunk, -0.5f64..1.0).prop_flat_map(move |(horizon, m)| {
            late(horizon).prop_map(move |deadline| {
                (chunk, 1, Playback { ensemble: Some(Ensemble { horizon, m }), overlap: 0, deadline })
            })
        });
        let overlap = (1..=chunk).prop_flat_map(move |execute| {
            (0..=chunk - execute, late(execute))
                .prop_map(move |(overlap, deadline)| (chunk, execute, Playback { ensemble: None, overlap, deadline }))
        });
        prop_oneof![ensemble, overlap]
    })
}

/// Playback in f64, in absolute time.
struct Player {
    chunk: usize,
    execute: usize,
    by: Playback,
    now: usize,
    /// The chunk under playback: its observation time, and its actions.
    plan: Option<(usize, Vec<Vec<f64>>)>,
    /// All chunks, the oldest first: observation time, and start of playback.
    all: Vec<(usize, usize, Vec<Vec<f64>>)>,
}

impl Player {
    fn new(chunk: usize, execute: usize, by: Playback) -> Self {
        Self { chunk, execute, by, now: 0, plan: None, all: Vec::new() }
    }

    /// Returns the present action, or `None` if none is recent enough.
    fn action(&self) -> Option<Vec<f64>> {
        if let Some(Ensemble { horizon, m }) = self.by.ensemble {
            let now = self.now;
            let young = self.all.iter().filter(|(seen, from, _)| *from <= now && now < seen + horizon);
            let young: Vec<&Vec<f64>> = young.map(|(seen, _, chunk)| &chunk[now - seen]).collect();
            let weight = |i: usize| (-m * i as f64).exp();
            let sum: f64 = (0..young.len()).map(weight).sum();
            let mean = |d: usize| young.iter().enumerate().map(|(i, a)| weight(i) * a[d]).sum::<f64>() / sum;
            return (!young.is_empty()).then(|| (0..ACT).map(mean).collect());
        }
        let (seen, plan) = self.plan.as_ref()?;
        let age = self.now - seen;
        plan.get(age).filter(|_| self.by.deadline.is_none_or(|deadline| age < deadline)).cloned()
    }

    fn runs(&self) -> bool {
        self.plan.as_ref().is_none_or(|(seen, _)| self.now - seen >= self.execute)
    }

    /// Starts a chunk whose observation was at `seen`.
    fn take(&mut self, seen: usize, raw: &[f32]) {
        let mut plan: Vec<Vec<f64>> = raw.chunks(ACT).map(wide).collect();
        self.all.push((seen, self.now, plan.clone()));
        if let Some((old_seen, old)) = self.plan.take()
            && self.by.overlap > 0
        {
            let (old_age, age) = (self.now - old_seen, self.now - seen);
            let left = self.chunk.saturating_sub(old_age).min(self.chunk.saturating_sub(age));
            let lead = self.by.overlap.min(left);
            for k in 0..lead {
                let share = (k + 1) as f64 / (lead + 1) as f64;
                for (new, old) in plan[age + k].iter_mut().zip(&old[old_age + k]) {
                    *new = old * (1.0 - share) + *new * share;
                }
            }
        }
        self.plan = Some((seen, plan));
    }
}

proptest! {
    #[test]
    fn chunk_playback_matches_plain_arithmetic(
        ((chunk, execute, playback), periods) in playbacks().prop_flat_map(|by| (Just(by), periods(by.0))),
    ) {
        let contract = ActionContract { playback, ..ActionContract::default() };
        let mut player = Player::new(chunk, execute, playback);
        let agree = |ours: Result<&[f32], StepError>, expected: &Option<Vec<f64>>| match (ours, expected) {
            (Ok(ours), Some(expected)) => close(ours, expected),
            (Err(StepError::Stale), None) => true,
            _ => false,
        };
        with_head(&echo(chunk, execute, contract), |head| {
            for (i, period) in periods.iter().enumerate() {
                match period {
                    Period::Pass(n) => {
                        head.pass(*n);
                        player.now += n;
                    }
                    Period::Play => {
                        let expected = player.action();
                        prop_assert!(agree(head.play(), &expected), "period {i}: {expected:?}");
                        player.now += usize::from(expected.is_some());
                    }
                    Period::Step(raw, waits) => {
                        let (seen, runs) = (player.now, player.runs());
                        head.begin(raw).expect("it is finite");
                        if runs && playback.overlap == 0 {
                            // Nothing remains of a chunk under replacement.
                            player.plan = None;
                        }
                        for &play in waits {
                            let expected = player.action().filter(|_| play);
                            if play {
                                prop_assert!(agree(head.play(), &expected), "period {i}, waiting: {expected:?}");
                            }
                            if expected.is_none() {
                                head.pass(1);
                            }
                            player.now += 1;
                        }
                        let late = player.now - seen;
                        if runs && playback.deadline.is_some_and(|deadline| late >= deadline) {
                            player.all.clear();
                            player.plan = None;
                        } else if runs {
                            player.take(seen, raw);
                        }
                        let expected = player.action();
                        let ours = head.poll(u32::MAX).map(|ours| match ours {
                            Poll::Ready(action) => action.to_vec(),
                            Poll::Pending => Vec::new(),
                        });
                        let agrees = agree(ours.as_deref().map_err(|e| *e), &expected);
                        prop_assert!(agrees, "period {i}: found {ours:?}, expected {expected:?}");
                        match expected {
                            Some(_) => player.now += 1,
                            None => {
                                player.all.clear();
                                player.plan = None;
                            }
                        }
                    }
                }
            }
            Ok(())
        })?;
    }

    #[test]
    fn a_new_chunk_takes_over_without_a_jump(chunk in 4usize..12, raw in prop::collection::vec(-1.0f32..1.0, 12 * ACT)) {
        // The old chunk is all 0: the new one's part grows by its share in each action.
        let overlap = chunk - 2;
        let by = Playback { overlap, ..Playback::default() };
        with_head(&echo(chunk, 2, ActionContract { playback: by, ..ActionContract::default() }), |head| {
            let (old, new) = (vec![0.0; chunk * ACT], &raw[..chunk * ACT]);
            head.step(&old).expect("an action");
            head.step(&old).expect("an action");
            let mut shares = Vec::new();
            for (k, new) in new.chunks(ACT).enumerate() {
                let action = if k < 2 { head.step(&raw[..chunk * ACT]) } else { head.play() }.expect("an action");
                shares.push(action.iter().zip(new).map(|(a, n)| a / n).fold(0.0, f32::max));
            }
            for (k, share) in shares.iter().enumerate() {
                let expected = ((k + 1) as f32 / (overlap + 1) as f32).min(1.0);
                prop_assert!((share - expected).abs() < 1e-5, "{shares:?}");
            }
            Ok(())
        })?;
    }
}

#[test]
fn step_policies_refuse_stale_observations() {
    let by = Playback { deadline: Some(3), ..Playback::default() };
    with_head(&echo(1, 1, ActionContract { playback: by, ..ActionContract::default() }), |head| {
        for (late, plays) in [(0, true), (2, true), (3, false), (usize::MAX, false), (2, true)] {
            head.begin(&[0.5, -0.5]).expect("it is finite");
            head.pass(late);
            let outcome = head.poll(u32::MAX).map(|ready| ready.is_ready());
            assert_eq!(outcome, if plays { Ok(true) } else { Err(StepError::Stale) }, "{late} periods late");
            assert_eq!(head.play().map(|_| ()), Err(StepError::Stale), "an action plays once");
        }
    });
}

/// A contract and playback with memory of every kind.
fn memory(m: f64) -> ActionContract {
    let binarise =
        Binarise { on: vec![0.2; ACT], off: vec![-0.2; ACT], on_value: vec![0.9, 0.0], off_value: vec![-0.9, 0.0] };
    ActionContract {
        binarise: Some(binarise),
        max_step: Some(vec![0.7; ACT]),
        smoothing: Some(vec![0.6; ACT]),
        playback: Playback { ensemble: Some(Ensemble { horizon: 3, m }), ..Playback::default() },
        ..ActionContract::default()
    }
}

fn remembering(m: f64) -> ImageBuffer {
    echo(4, 1, memory(m))
}

/// Observations of a wave.
fn wave(step: usize) -> Vec<f32> {
    (0..4 * ACT).map(|i| ((step * 7 + i * 3) as f32 * 0.37).sin()).collect()
}

fn saved(head: &Head<'_, '_>) -> Vec<u8> {
    let mut bytes = vec![0; head.saved_len()];
    head.save(&mut bytes).expect("no step has begun");
    bytes
}

#[test]
fn a_restored_head_continues_with_the_same_bits() {
    let buffer = remembering(0.1);
    let whole: Vec<Vec<f32>> =
        with_head(&buffer, |head| (0..40).map(|i| head.step(&wave(i)).expect("an action").to_vec()).collect());
    for at in 0..40 {
        let state = with_head(&buffer, |head| {
            for i in 0..at {
                head.step(&wave(i)).expect("an action");
            }
            saved(head)
        });
        with_head(&buffer, |head| {
            // State of an unrelated run.
            for i in 0..5 {
                head.step(&wave(3 * i)).expect("an action");
            }
            head.restore(&state).expect("the state is from this image");
            assert_eq!(saved(head), state);
            for (i, expected) in whole.iter().enumerate().skip(at) {
                assert_eq!(head.step(&wave(i)).expect("an action"), expected, "saved at {at}, step {i}");
            }
        });
    }
}

/// A right checksum does not make a state possible.
#[test]
fn impossible_states_are_refused() {
    const CHUNK: usize = 4;
    let limits = |at: f32| Some(vec![at; ACT]);
    let buffer = echo(CHUNK, 1, ActionContract { low: limits(-2.0), high: limits(2.0), ..memory(0.1) });
    with_head(&buffer, |head| {
        for i in 0..5 {
            head.step(&wave(i)).expect("an action");
        }
        let state = saved(head);
        let last = state.len() / 4 - 1;
        let action = 10 + CHUNK * ACT;
        let mut restore = |word: usize, value: u32| {
            let mut bytes = state.clone();
            bytes[4 * word..][..4].copy_from_slice(&value.to_le_bytes());
            let sum = checksum(&bytes);
            bytes[12..16].copy_from_slice(&sum.to_le_bytes());
            head.restore(&bytes)
        };
        for (word, value) in [
            (6, 4),
            (8, CHUNK as u32 - 1),
            (9, 3),
            (action, f32::NAN.to_bits()),
            (action + ACT - 1, 2.5f32.to_bits()),
            (last, 3),
            (last, u32::MAX),
        ] {
            assert_eq!(restore(word, value), Err(SavedError::Damaged), "word {word}: {value:#x}");
        }
        for (word, value) in [(4, 7), (9, 2), (action, (-2.0f32).to_bits()), (last, 2)] {
            assert_eq!(restore(word, value), Ok(()), "word {word}: {value:#x}");
        }
    });
}

#[test]
fn damaged_or_foreign_states_are_refused() {
    let buffer = remembering(0.1);
    with_head(&buffer, |head| {
        for i in 0..5 {
            head.step(&wave(i)).expect("an action");
        }
        let state = saved(head);
        let len = state.len();
        head.step(&wave(5)).expect("an action");
        let before = saved(head);
        for bit in 0..8 * len {
            let mut damaged = state.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let expected = match bit / 32 {
                0 | 1 => SavedError::Version,
                2 => SavedError::Image,
                _ => SavedError::Damaged,
            };
            assert_eq!(head.restore(&damaged), Err(expected), "bit {bit}");
        }
        for given in [0, 39, len - 1, len + 4] {
            let error = Err(SavedError::Length { needed: len, given });
            assert_eq!((head.restore(&vec![0; given]), head.save(&mut vec![0; given])), (error, error));
        }
        let other = with_head(&remembering(0.2), |other| saved(other));
        assert_eq!(head.restore(&other), Err(SavedError::Image));
        assert_eq!(saved(head), before, "a refusal must change nothing");
        head.begin(&wave(6)).expect("it is finite");
        assert_eq!(
            (head.restore(&state), head.save(&mut vec![0; len])),
            (Err(SavedError::Begun), Err(SavedError::Begun))
        );
        head.reset();
        assert_eq!(head.restore(&state), Ok(()));
    });
}

/// On the target a warm restart precedes every step; on the host none does.
#[test]
fn restarts_between_steps_keep_the_bits() -> Result<()> {
    const HIDDEN: usize = 24;
    let mut builder = Builder::new(4 * ACT);
    let mut matrix = |rows: usize, cols| builder.matrix(rows, cols, Activations::Int8, &vec![Some(Width::W3); rows], 0);
    let (input, state) = (matrix(4 * HIDDEN, 4 * ACT)?, matrix(4 * HIDDEN, HIDDEN)?);
    let output = matrix(4 * ACT, HIDDEN)?;
    let [bias, last] = [builder.values(4 * HIDDEN), builder.values(4 * ACT)];
    let hidden = builder.node(Lstm { hidden: HIDDEN, input, state, bias }, &[0])?;
    builder.node(Linear { matrix: output, bias: last }, &[hidden])?;
    let (mut policy, outcomes) = builder.finish("restarts".to_owned(), false);
    (policy.kind, policy.chunk, policy.act_len, policy.contract) = (Kind::Chunk, 4, ACT, memory(0.1));
    let buffer = ImageBuffer::new(&actq::emit::image(&policy, &outcomes)?);
    let slot = qemu::slot(buffer.bytes())?;
    let elf = firmware::harness(Target::Fpu)?;
    let mut target = Server::start(qemu::command(&elf, Some(slot.path()), "restart")?, ACT)?;
    let mut different = 0;
    with_head(&buffer, |head| -> Result<()> {
        let mut before = Vec::new();
        for step in 0..600 {
            let (here, there) = (head.step(&wave(step))?, target.step(&wave(step))?);
            ensure!(bits(here) == bits(&there), "step {step}: {there:?} on the target, {here:?} on the host");
            different += usize::from(before != there);
            before = there;
        }
        Ok(())
    })?;
    ensure!(different > 300, "too few actions differ");
    target.finish()
}

/// A network that takes several control periods, in the controller: what it predicts for a period is the period's number,
/// so that this must be the answer to every observation, however long a chunk takes.
#[test]
fn a_slow_chunk_is_answered_by_the_one_before() -> Result<()> {
    const CHUNK: usize = 16;
    const OBS: usize = CHUNK * ACT;
    const FRAME: usize = frame::bytes(4 * OBS);
    const PERIODS: usize = 100;
    let ensemble = Some(Ensemble { horizon: CHUNK, m: 0.01 });
    let playbacks =
        [(8, Playback { overlap: 8, ..Playback::default() }), (1, Playback { ensemble, ..Playback::default() })];
    for (execute, playback) in playbacks {
        let contract = ActionContract { playback, ..ActionContract::default() };
        let buffer = echo_of(400, CHUNK, execute, contract);
        let image = buffer.image("memory".as_ref())?;
        let slices = with_head(&buffer, |head| -> Result<usize> {
            head.begin(&[0.0; OBS])?;
            let mut polls = 1;
            while head.poll(SLICE)?.is_pending() {
                polls += 1;
            }
            Ok(polls)
        })?;
        ensure!(slices > 15, "only {slices} slices");
        for turns in [slices + 3, slices.div_ceil(2), slices.div_ceil(5)] {
            let mut scratch = vec![0; image.scratch_words()];
            let head = Head::new(image, &mut scratch)?;
            let mut running = Running::new((head, &mut []), buffer.bytes(), 0);
            let breadcrumb = Record::report(ResetCause::Power, None);
            let facts = Facts { image: 0, slot: BUILT_IN, timing: Default::default(), breadcrumb };
            let settings = Settings { status_period: 0, flash_while_armed: false, quiet: 1 << 20 };
            let mut endpoint = Endpoint::<OBS, FRAME>::new(Guard::full(&[], u32::MAX >> 1), facts, settings);
            let (mut safety, mut out) = (Safety::new([Axis::STILL; ACT], 1..=1 << 20, 0), [0; 256]);
            endpoint.report(0, &mut safety, &mut out).context("the first status reports the token")?;
            let (mut host, mut answers) = (Sender::new(0), Receiver::<FRAME>::new());
            let mut answered = [0; PERIODS];
            for (period, count) in answered.iter_mut().enumerate() {
                let observation: Vec<f32> = (0..OBS).map(|i| (period + i / ACT) as f32).collect();
                let mut bytes = [0; 256];
                let sent = host.frame(&Message::Observation(Floats::Values(&observation)), 0, &mut bytes);
                for byte in [&[0], sent.context("room for a frame")?].concat() {
                    endpoint.receive(byte, 0, &mut safety, &mut NoUpdate, &mut out);
                }
                for _ in 0..turns {
                    let Some(frame) = running.slice(&mut endpoint, 0, &mut safety, &mut out) else { continue };
                    for byte in frame {
                        let Some(received) = answers.push(*byte) else { continue };
                        let Message::Action { of, values, .. } = received.message else { continue };
                        let error = values.iter().map(|value| (value - period as f32).abs()).fold(0.0, f32::max);
                        ensure!(of as usize == period && error < 1e-4, "{values:?} for {of} in period {period}");
                        *count += 1;
                    }
                }
            }
            ensure!(answered[20..] == [1; PERIODS - 20], "{turns} of {slices} slices, {playback:?}: {answered:?}");
        }
    }
    Ok(())
}

/// A network of `late` control periods, in `actq serve`: what a chunk predicts for a period is the period's number, and a
/// single action is the number of its observation's period.
#[test]
fn a_served_network_is_late() -> Result<()> {
    const PERIODS: usize = 40;
    let overlap = Playback { overlap: 8, ..Playback::default() };
    let average = Playback { ensemble: Some(Ensemble { horizon: 16, m: 0.01 }), ..Playback::default() };
    let cases = [
        (16, 8, overlap, 0),
        (16, 8, overlap, 1),
        (16, 8, overlap, 7),
        (16, 1, average, 7),
        (1, 1, Playback::default(), 3),
    ];
    for (chunk, execute, playback, late) in cases {
        let buffer = echo(chunk, execute, ActionContract { playback, ..ActionContract::default() });
        let slot = qemu::slot(buffer.bytes())?;
        let observation = |period| -> Vec<f32> { (0..chunk * ACT).map(|i| (period + i / ACT) as f32).collect() };
        let episode: Vec<u8> = (0..PERIODS).flat_map(|period| step_request(&observation(period))).collect();
        let [path, late_of] = [slot.path().to_string_lossy().into_owned(), late.to_string()];
        let output = run(actq(&["serve", &path, "--late", &late_of]), &[&episode[..], &[RESET], &episode].concat())?;
        let answers = answered(&output)?.as_chunks().0.iter().map(|value| f32::from_le_bytes(*value));
        for (i, answer) in answers.step_by(ACT).enumerate() {
            let period = i % PERIODS;
            let expected = if chunk > 1 { Some(period) } else { (period / late).checked_sub(1).map(|n| n * late) };
            let expected = expected.filter(|_| period >= late).map_or(NO_ACTION, |number| number as f32);
            let is_close = answer.to_bits() == expected.to_bits() || (answer - expected).abs() < 1e-4;
            ensure!(is_close, "{late} periods late: {answer} in period {period}, expected {expected}");
        }
    }
    let dropped = qemu::slot(echo(16, 8, ActionContract::default()).bytes())?;
    let output = run(actq(&["serve", &dropped.path().to_string_lossy(), "--late", "1"]), b"")?;
    failed(&output, 1, &["keeps no rest of a chunk", "give its policy.json an overlap"])?;
    Ok(())
}

#[test]
fn inspect_says_what_a_slow_network_means() -> Result<()> {
    let overlap = Playback { overlap: 8, ..Playback::default() };
    let average = Playback { ensemble: Some(Ensemble { horizon: 16, m: 0.01 }), ..Playback::default() };
    let cases = [
        (16, 8, overlap, 0.9, ""),
        (16, 8, overlap, 3.5, "in which the rest of the chunk before plays; `actq serve --late 4`"),
        (
            16,
            8,
            overlap,
            7.5,
            "with more than 7 some periods have no action: take a faster processor, fewer bits, a lower rate.",
        ),
        (16, 4, overlap, 7.5, "with more than 7 some periods"),
        (16, 1, average, 6.5, "`actq serve --late 7`"),
        (
            16,
            8,
            Playback::default(),
            1.5,
            "with more than 1 some periods have no action: take a faster processor, fewer bits, a lower rate, or an overlap",
        ),
        (
            1,
            1,
            Playback::default(),
            1.5,
            "with more than 1 some periods have no action: take a faster processor, fewer bits, a lower rate.",
        ),
    ];
    for (chunk, execute, playback, periods, expected) in cases {
        let buffer = echo(chunk, execute, ActionContract { playback, ..ActionContract::default() });
        let image = buffer.image("memory".as_ref())?;
        let clock = image.step_cost().cycles as f64 * f64::from(image.rate_hz()) / periods;
        let slot = qemu::slot(buffer.bytes())?;
        let arguments = ["inspect", &slot.path().to_string_lossy(), "--clock", &clock.to_string()].map(str::to_owned);
        let text = succeeded(&run(actq(&arguments.each_ref().map(String::as_str)), b"")?)?;
        let is_said = text.contains(&format!("It takes {periods:.1} control periods of 20.0 ms"));
        ensure!(is_said != expected.is_empty() && text.contains(expected), "{periods} periods, {playback:?}: {text}");
    }
    Ok(())
}
