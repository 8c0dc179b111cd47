//! Observations that reach the head.

use actq_controller::Guard;
use actq_controller::guard::{Range, Refused};
use actq_link::Floats;
use actq_link::code::Refusal;
use actq_testkit::Random;

const RANGES: [Range; 3] =
    [Range { low: -1.0, high: 1.0 }, Range { low: 0.0, high: 100.0 }, Range { low: -1e30, high: 1e30 }];
const MAX_AGE: u32 = 20_000;

fn guard() -> Guard<'static, 4> {
    Guard::new(3, &RANGES, MAX_AGE).expect("the values fit")
}

fn take(guard: &mut Guard<'_, 4>, values: &[f32]) -> Result<(), Refused> {
    guard.take(1, Floats::Values(values), 0, 0)
}

#[test]
fn length_finiteness_and_range_are_checked() {
    let good = [1.0, 0.0, -1e30];
    let cases = [
        (vec![], Refused::Length { expected: 3, given: 0 }),
        (vec![0.0; 2], Refused::Length { expected: 3, given: 2 }),
        (vec![0.0; 4], Refused::Length { expected: 3, given: 4 }),
        (vec![1.0, f32::NAN, 0.0], Refused::NotFinite { index: 1 }),
        (vec![1.0, 0.0, f32::INFINITY], Refused::NotFinite { index: 2 }),
        (vec![f32::NEG_INFINITY, 0.0, 0.0], Refused::NotFinite { index: 0 }),
        (vec![1.000_001, 0.0, 0.0], Refused::OutOfRange { index: 0 }),
        (vec![1.0, -1e-9, 0.0], Refused::OutOfRange { index: 1 }),
        (vec![1.0, 0.0, 2e30], Refused::OutOfRange { index: 2 }),
    ];
    let mut guard = guard();
    assert_eq!(take(&mut guard, &good), Ok(()));
    for (i, (values, why)) in cases.into_iter().enumerate() {
        assert_eq!(take(&mut guard, &values), Err(why));
        assert_eq!(guard.refused() as usize, i + 1);
    }
    // The last valid one is kept and returned once.
    assert_eq!(guard.newest(), Some((1, &good[..])));
    assert_eq!(guard.newest(), None);
}

#[test]
fn values_without_a_range_among_ranges_are_refused() {
    let mut guard = Guard::<4>::new(4, &RANGES, MAX_AGE).expect("the values fit");
    assert_eq!(take(&mut guard, &[0.0; 4]), Err(Refused::OutOfRange { index: 3 }));
    let mut free = Guard::<4>::new(4, &[], MAX_AGE).expect("the values fit");
    assert_eq!(take(&mut free, &[f32::MAX; 4]), Ok(()));
    assert!(Guard::<4>::new(5, &[], MAX_AGE).is_none(), "five values do not fit");
}

/// Sends an observation every millisecond, by two clocks; returns the accepted frames.
fn accepted(frames: u32, remote: impl Fn(u32) -> u32, delay: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut guard = guard();
    // Both clocks wrap during the test.
    let (local_start, remote_start) = (u32::MAX - 700_000, u32::MAX - 300_000);
    let mut good = Vec::new();
    for n in 0..frames {
        let sent = remote_start.wrapping_add(remote(n));
        let came = local_start.wrapping_add(1000 * n + delay(n));
        if guard.take(n, Floats::Values(&[0.0; 3]), sent, came).is_ok() {
            good.push(n);
        }
    }
    good
}

#[test]
fn wrapping_clocks_and_small_jitter_are_accepted() {
    let all: Vec<u32> = (0..2000).collect();
    assert_eq!(accepted(2000, |n| 1000 * n, |_| 0), all);
    assert_eq!(accepted(2000, |n| 1000 * n, |n| n * 7919 % MAX_AGE), all);
}

#[test]
fn a_delayed_frame_is_refused() {
    // A share of the delay's duration counts as clock drift.
    let late = |n| if (500..510).contains(&n) { MAX_AGE + MAX_AGE / 16 } else { 0 };
    let good = accepted(1000, |n| 1000 * n, late);
    assert_eq!(good, (0..500).chain(510..1000).collect::<Vec<_>>());
}

#[test]
fn a_stopped_clock_makes_observations_old() {
    let good = accepted(1000, |n| 1000 * n.min(300), |_| 0);
    assert_eq!(good, (0..=320).collect::<Vec<_>>());
}

/// A jump back is forgotten no faster than a 16th of the time; a jump forward is the new time.
#[test]
fn only_a_clock_that_jumps_back_is_refused() {
    let back = |jump| accepted(1000, |n| if n < 400 { 1000 * n } else { (1000 * n).wrapping_sub(jump) }, |_| 0);
    assert_eq!(back(MAX_AGE + 600_000 / 16), (0..400).collect::<Vec<_>>());
    assert_eq!(back(1_000_000_000), (0..400).collect::<Vec<_>>());
    let forward = accepted(1000, |n| if n < 400 { 1000 * n } else { 1000 * n + 1_000_000_000 }, |_| 0);
    assert_eq!(forward.len(), 1000);
}

/// A host that sends more than the line carries: the queue grows by 1 ms in 10. Observations are refused before they
/// are three times as old as allowed, with an accurate, slow or fast sender's clock.
#[test]
fn a_growing_queue_is_refused() {
    for percent in [-3, 0, 3] {
        let remote = |n: u32| (n as i32 * (1000 + 10 * percent)) as u32;
        let good = accepted(3000, remote, |n| n * 100);
        assert!(good.last().is_some_and(|n| n * 100 < 3 * MAX_AGE), "{percent} %: {:?}", good.last());
    }
}

/// Sends for `ms` of local time, by a clock with an error of `wrong` parts in 1000. Passes each frame's age (0 if
/// accepted), its delay, and its local arrival time to `each`.
fn ages(ms: u64, period: u64, wrong: i64, mut delay: impl FnMut() -> Option<u64>, mut each: impl FnMut(u32, u64, u64)) {
    let mut guard = Guard::<4>::new(3, &[], 0).expect("the values fit");
    let (local_start, remote_start) = (u32::MAX - 700_000, u32::MAX - 300_000);
    let mut last = 0;
    for sent in (0..ms * 1000).step_by(period as usize) {
        let Some(delay) = delay() else { continue };
        // Frames arrive in order.
        last = last.max(sent + delay);
        let remote = sent as i64 + sent as i64 * wrong / 1000;
        let (remote, local) = (remote_start.wrapping_add(remote as u32), local_start.wrapping_add(last as u32));
        let age = match guard.take(0, Floats::Values(&[0.0; 3]), remote, local) {
            Ok(()) => 0,
            Err(Refused::Old { age }) => age,
            Err(other) => panic!("{other}"),
        };
        each(age, last - sent, last);
    }
}

/// In two hours, in which both clocks wrap, with 3 frames in 10 lost, no frame's age exceeds its largest possible
/// delay.
#[test]
fn clock_drift_makes_no_frame_too_old() {
    for (seed, wrong) in [-30, -20, -5, 0, 5, 20, 30].into_iter().enumerate() {
        for period in [1000, 20_000, 100_000] {
            let mut random = Random::new(seed as u64);
            let delay = || (random.below(10) >= 3).then(|| random.below(MAX_AGE as usize) as u64);
            let mut frames = 0;
            ages(2 * 3_600_000, period, wrong, delay, |age, _, at| {
                frames += 1;
                assert!(age <= MAX_AGE, "{wrong} in 1000, every {period} µs, at {at}: {age}");
            });
            assert!(frames > 7_200_000_000 / period * 6 / 10);
        }
    }
}

/// The inequality of docs/LINK.md for every two frames: a frame that took D longer than one sent W before has an age of
/// at least D - W/16. No frame's age exceeds its delay minus that of the fastest frame before it. A tolerance of 1 µs
/// covers rounding.
#[test]
fn age_underestimates_delay_by_at_most_a_sixteenth() {
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let (wrong, period) = (random.below(61) as i64 - 30, [1000, 10_000, 100_000][random.below(3)]);
        // A base delay for some frames, a growing queue, and jitter.
        let (mut base, mut growth) = (0, 0);
        let delay = || {
            if random.below(20) == 0 {
                (base, growth) = (random.below(500_000) as u64, random.below(period as usize) as u64);
            }
            base += growth;
            (random.below(10) > 0).then(|| base + random.below(2000) as u64)
        };
        let mut seen: Vec<(u64, u64)> = Vec::new();
        ages(200 * period / 1000, period, wrong, delay, |age, delay, at| {
            let longer = |than: u64| delay as i64 - than as i64;
            let fastest = seen.iter().map(|(before, _)| longer(*before)).max().unwrap_or(0).max(0);
            assert!(i64::from(age) <= fastest + 1, "seed {seed} at {at}: {age} of {fastest}");
            for (before, when) in &seen {
                let least = longer(*before) - ((at - when) / 16) as i64;
                assert!(i64::from(age) + 1 >= least, "seed {seed} at {at}: {age}, not {least} since {when}");
            }
            seen.push((delay, at));
        });
    }
}

#[test]
fn reopening_resets_the_clock_tracking() {
    let mut guard = guard();
    assert_eq!(guard.take(1, Floats::Values(&[0.0; 3]), 1_000_000, 0), Ok(()));
    let old = guard.take(2, Floats::Values(&[0.0; 3]), 0, 10);
    assert_eq!(old, Err(Refused::Old { age: 1_000_010 }));
    guard.reopen();
    assert_eq!(guard.newest(), None, "the earlier observation is dropped");
    assert_eq!(guard.take(3, Floats::Values(&[0.0; 3]), 0, 20), Ok(()));
}

#[test]
fn the_largest_age_is_still_accepted() {
    let (mut guard, before) = (guard(), |micros| 0u32.wrapping_sub(micros));
    assert_eq!(guard.date(0, 0), Ok(()));
    assert_eq!(guard.date(before(MAX_AGE), 0), Ok(()));
    assert_eq!(guard.date(before(MAX_AGE + 1), 0), Err(Refused::Old { age: MAX_AGE + 1 }));
    assert_eq!((guard.set_max_age(MAX_AGE + 1), guard.set_max_age(MAX_AGE)), (Err(Refusal::Range), Ok(())));
}

/// The sender's time leaps by any amount before the controller is armed, and after that by 2^20 µs at most.
#[test]
fn a_bounded_guard_refuses_a_leap_of_the_clock() {
    const LEAP: u32 = 1 << 20;
    let old = |age| Err(Refused::Old { age });
    for (leap, is_bounded, expected, then) in [
        (LEAP, true, Ok(()), old(LEAP)),
        (LEAP + 1, true, Err(Refused::Ahead), Ok(())),
        (LEAP + 1, false, Ok(()), old(LEAP + 1)),
        // Half of the clock's range counts as ahead, and not as old.
        (1 << 31, false, Ok(()), Ok(())),
    ] {
        let mut guard = guard();
        assert_eq!(guard.date(0, 0), Ok(()));
        guard.bound(is_bounded);
        assert_eq!(guard.date(leap, 0), expected, "{leap} {is_bounded}");
        assert_eq!(guard.date(0, 0), then, "{leap} {is_bounded}: a refused leap changes nothing");
    }
}
