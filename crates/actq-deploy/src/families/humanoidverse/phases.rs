//! The phases of the gait and of the reference motion.

use actq::error::{Result, ensure};

use super::reader::{Reader, Term};
use crate::description::{Clock, Op, Operand, When};
use crate::yaml::Node;

impl Reader<'_> {
    /// Returns the value that is the phase of the gait, from 0 to 1; makes it first.
    pub(super) fn phase(&mut self) -> Result<String> {
        if self.facts.is_choice("phase", "raw")? {
            self.parts.raw("phase_time", 1, "periods");
            return Ok("phase_time".to_owned());
        }
        if !self.has_phase {
            self.has_phase = true;
            let period = match self.yaml.optional("GAIT_PERIOD", "a number of s", Node::number)? {
                Some(period) => period,
                None => self.facts.value("gait_period")?.unwrap_or(1.0),
            };
            ensure!(period > 0.0, "{} = {period}: give a number above 0", self.yaml.location("GAIT_PERIOD"));
            self.clock("gait_clock", period);
            // The deploy code multiplies the time by the command, so that the phase is 0 while the robot stands.
            self.parts.raw("command_stand", 1, "1 to walk, 0 to stand");
            let stand = Op::Scale(Operand::Name("command_stand".to_owned()));
            self.parts.value("gait_phase", "gait_clock", vec![stand]);
            self.facts
                .note("gait_phase", format!("{}; {}", self.yaml.location("GAIT_PERIOD"), self.facts.source("phase")));
        }
        Ok("gait_phase".to_owned())
    }

    /// Makes the phase of the reference motion, from 0 to 1.
    pub(super) fn motion_phase(&mut self) -> Result<Term> {
        match (self.facts.is_choice("motion_phase", "raw")?, self.motion) {
            (true, _) => Ok(self.raw("ref_motion_phase", 1, "motions")),
            (false, Some(length)) => {
                ensure!(length > 0.0, "motion_length_s = {length}: give a number above 0");
                self.clock("motion_clock", length);
                Ok(Term { from: "motion_clock".to_owned(), ops: Vec::new(), len: 1, stated: 1 })
            }
            (false, None) => {
                let meaning = "nothing states the length of the reference motion; \
                               does the application compute ref_motion_phase (true)?";
                self.facts.require_from_application("raw.ref_motion_phase", meaning)?;
                Ok(self.raw("ref_motion_phase", 1, "motions"))
            }
        }
    }

    fn clock(&mut self, name: &str, period: f64) {
        let advance = 1.0 / (self.rate * period);
        self.parts.clock(Clock { wrap: Some([0.0, 1.0]), ..Clock::from_zero(name, advance, When::After) });
    }
}
