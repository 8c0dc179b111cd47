//! Phases that advance with the ticks.

use crate::description::{Clock, When};

/// A clock's phases.
///
/// They are summed tick by tick in f64, as deploy code does, since the tick of a restart depends on the sum's rounding.
#[derive(Clone, Debug)]
pub(crate) struct Phases {
    clock: Clock,
    phases: Vec<f64>,
    /// No tick has read it since the reset.
    fresh: bool,
    standing: bool,
}

impl Phases {
    pub(crate) fn new(clock: Clock) -> Self {
        Self { phases: clock.start.clone(), clock, fresh: true, standing: false }
    }

    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.clock.clone());
    }

    /// Returns the phases of this tick, with the norms of the values that decide whether the robot stands.
    pub(crate) fn step(&mut self, norms: &[f64]) -> Vec<f64> {
        if !self.fresh || self.clock.when == When::Before {
            self.phases.iter_mut().for_each(|phase| *phase = advanced(&self.clock, *phase));
        }
        self.fresh = false;
        if let Some(standing) = &self.clock.standing {
            let stands = norms.iter().all(|norm| *norm < standing.below);
            if stands {
                self.phases.clone_from(&standing.at);
            } else if self.standing {
                self.phases.clone_from(&self.clock.start);
            }
            self.standing = stands;
        }
        self.phases.clone()
    }
}

fn advanced(clock: &Clock, phase: f64) -> f64 {
    let next = phase + clock.advance;
    if clock.restart_above.is_some_and(|above| next > above) {
        return 0.0;
    }
    match clock.wrap {
        Some([low, high]) => (next - low).rem_euclid(high - low) + low,
        None => next,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Standing;

    fn clock() -> Clock {
        Clock {
            name: "phase".to_owned(),
            start: vec![0.0],
            advance: 0.25,
            when: When::After,
            wrap: None,
            restart_above: None,
            standing: None,
        }
    }

    fn run(clock: Clock, norms: &[f64]) -> Vec<f64> {
        let mut phases = Phases::new(clock);
        norms.iter().map(|norm| phases.step(&[*norm])[0]).collect()
    }

    #[test]
    fn phases_advance_as_described() {
        let standing = Standing { of: vec!["command".to_owned()], below: 0.01, at: vec![9.0] };
        let cases: [(&str, Clock, &[f64]); 5] = [
            ("after", clock(), &[0.0, 0.25, 0.5, 0.75, 1.0, 1.25]),
            ("before", Clock { when: When::Before, ..clock() }, &[0.25, 0.5, 0.75, 1.0, 1.25, 1.5]),
            ("wrap", Clock { wrap: Some([-0.5, 0.5]), ..clock() }, &[0.0, 0.25, -0.5, -0.25, 0.0, 0.25]),
            ("restart", Clock { restart_above: Some(0.5), ..clock() }, &[0.0, 0.25, 0.5, 0.0, 0.25, 0.5]),
            ("standing", Clock { standing: Some(standing), ..clock() }, &[0.0, 9.0, 9.0, 0.0, 0.25, 0.5]),
        ];
        for (name, clock, expected) in cases {
            assert_eq!(run(clock, &[1.0, 0.0, 0.0, 1.0, 1.0, 1.0]), expected, "{name}");
        }
    }
}
