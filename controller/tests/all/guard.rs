//! What gets to the head.

use actq_controller::Guard;
use actq_controller::guard::{Range, Refused};
use actq_link::Floats;

const RANGES: [Range; 3] =
    [Range { low: -1.0, high: 1.0 }, Range { low: 0.0, high: 100.0 }, Range { low: -1e30, high: 1e30 }];
const MAX_AGE: u32 = 20_000;

fn guard() -> Guard<'static, 4> {
    Guard::new(3, &RANGES, MAX_AGE).expect("there is room")
}

fn take(guard: &mut Guard<'_, 4>, values: &[f32]) -> Result<(), Refused> {
    guard.take(1, Floats::Values(values), 0, 0)
}

#[test]
fn length_finiteness_and_range_of_each_value_are_checked() {
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
    // The last good one is still there, and is given once.
    assert_eq!(guard.newest(), Some((1, &good[..])));
    assert_eq!(guard.newest(), None);
}

#[test]
fn values_without_a_range_are_refused_where_others_have_one() {
    let mut guard = Guard::<4>::new(4, &RANGES, MAX_AGE).expect("there is room");
    assert_eq!(take(&mut guard, &[0.0; 4]), Err(Refused::OutOfRange { index: 3 }));
    let mut free = Guard::<4>::new(4, &[], MAX_AGE).expect("there is room");
    assert_eq!(take(&mut free, &[f32::MAX; 4]), Ok(()));
    assert!(Guard::<4>::new(5, &[], MAX_AGE).is_none(), "no room for five values");
}

/// Sends an observation every millisecond by two clocks; the frames that are let through.
fn let_through(frames: u32, remote: impl Fn(u32) -> u32, delay: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut guard = guard();
    // Both clocks wrap on the way.
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
fn clocks_that_wrap_and_jitter_below_the_limit_change_nothing() {
    let all: Vec<u32> = (0..2000).collect();
    assert_eq!(let_through(2000, |n| 1000 * n, |_| 0), all);
    assert_eq!(let_through(2000, |n| 1000 * n, |n| n * 7919 % MAX_AGE), all);
}

#[test]
fn a_frame_that_was_held_up_is_refused() {
    let late = |n| if (500..510).contains(&n) { MAX_AGE + 200 } else { 0 };
    let good = let_through(1000, |n| 1000 * n, late);
    assert_eq!(good, (0..500).chain(510..1000).collect::<Vec<_>>());
}

#[test]
fn a_clock_that_stands_still_grows_old() {
    let good = let_through(1000, |n| 1000 * n.min(300), |_| 0);
    assert_eq!(good, (0..=320).collect::<Vec<_>>());
}

#[test]
fn a_clock_that_jumps_back_is_refused_from_then_on_and_one_that_jumps_forward_is_not() {
    let back = let_through(1000, |n| if n < 400 { 1000 * n } else { 1000 * n - 30_000 }, |_| 0);
    assert_eq!(back, (0..400).collect::<Vec<_>>());
    let forward = let_through(1000, |n| if n < 400 { 1000 * n } else { 1000 * n + 1_000_000_000 }, |_| 0);
    assert_eq!(forward.len(), 1000);
}

/// An hour of clocks that differ by 200 ppm either way.
#[test]
fn drift_of_two_crystals_is_followed() {
    for ppm in [-200i64, 200] {
        let mut guard = guard();
        for n in 0..360_000i64 {
            let local = n * 10_000;
            let remote = local + local * ppm / 1_000_000;
            assert_eq!(guard.take(0, Floats::Values(&[0.0; 3]), remote as u32, local as u32), Ok(()), "{ppm}, {n}");
        }
    }
}

#[test]
fn begun_anew_the_clocks_may_stand_otherwise() {
    let mut guard = guard();
    assert_eq!(guard.take(1, Floats::Values(&[0.0; 3]), 1_000_000, 0), Ok(()));
    let old = guard.take(2, Floats::Values(&[0.0; 3]), 0, 10);
    assert_eq!(old, Err(Refused::Old { age: 1_000_010 }));
    guard.reopen();
    assert_eq!(guard.newest(), None, "what came before is gone");
    assert_eq!(guard.take(3, Floats::Values(&[0.0; 3]), 0, 20), Ok(()));
}
