//! The phases of the gait and of the reference motion.

use actq::error::{Result, bail, ensure};

use super::reader::{Reader, Term};
use crate::description::{Clock, Op, Operand, When};
use crate::yaml::Node;

impl Reader<'_> {
    /// Returns the value that is the phase of the gait, from 0 to 1; makes it first.
    pub(super) fn phase(&mut self) -> Result<String> {
        let is_raw = match self.facts.find::<String>("phase")?.as_deref() {
            Some("clock") | None => false,
            Some("raw") => true,
            Some(other) => bail!("phase = {other:?}: give \"clock\" or \"raw\""),
        };
        if is_raw {
            self.parts.raw("phase_time", 1, "periods");
            return Ok("phase_time".to_owned());
        }
        if !self.has_phase {
            self.has_phase = true;
            let period = match self.yaml.maybe("GAIT_PERIOD", "a number of s", Node::number)? {
                Some(period) => period,
                None => self.facts.find("gait_period")?.unwrap_or(1.0),
            };
            ensure!(period > 0.0, "{} = {period}: give a number above 0", self.yaml.at("GAIT_PERIOD"));
            let clock = self.clock("gait_clock", period);
            self.parts.clock(Clock { wrap: Some([0.0, 1.0]), ..clock });
            // The deploy code multiplies the time by the command, so that the phase is 0 while the robot stands.
            self.parts.raw("command_stand", 1, "1 to walk, 0 to stand");
            let stand = Op::Scale(Operand::Name("command_stand".to_owned()));
            self.parts.value("gait_phase", "gait_clock", vec![stand]);
            self.facts.note("gait_phase", format!("{}; {}", self.yaml.at("GAIT_PERIOD"), self.facts.source("phase")));
        }
        Ok("gait_phase".to_owned())
    }

    /// Makes the phase of the reference motion, from 0 to 1.
    pub(super) fn motion_phase(&mut self) -> Result<Term> {
        let kind: Option<String> = self.facts.find("motion_phase")?;
        match (kind.as_deref(), self.motion) {
            (Some("raw"), _) => Ok(self.raw("ref_motion_phase", 1, "motions")),
            (Some("clock") | None, Some(length)) => {
                ensure!(length > 0.0, "motion_length_s = {length}: give a number above 0");
                let clock = self.clock("motion_clock", length);
                self.parts.clock(Clock { wrap: Some([0.0, 1.0]), ..clock });
                Ok(Term { from: "motion_clock".to_owned(), ops: Vec::new(), len: 1, stated: 1 })
            }
            (Some("clock") | None, None) => {
                let meaning = "nothing states the length of the reference motion; \
                               does the application compute ref_motion_phase (true)?";
                self.facts.of_application("raw.ref_motion_phase", meaning)?;
                Ok(self.raw("ref_motion_phase", 1, "motions"))
            }
            (Some(other), _) => bail!("motion_phase = {other:?}: give \"clock\" or \"raw\""),
        }
    }

    fn clock(&self, name: &str, period: f64) -> Clock {
        Clock {
            name: name.to_owned(),
            start: vec![0.0],
            advance: 1.0 / (self.rate * period),
            when: When::After,
            wrap: None,
            restart_above: None,
            standing: None,
        }
    }
}
