//! The terms of the observation.

use std::f64::consts::TAU;

use actq::error::{Result, ensure};

use super::super::common::action::clip_to;
use super::super::common::{Parts, count, given_gravity};
use super::action::masked;
use super::config::Config;
use super::frames::frames;
use super::joints::Joints;
use crate::description::{Clock, Op, Operand, When};
use crate::facts::Facts;
use crate::yaml::Node;

/// Terms of the observation under construction.
pub(super) struct Terms<'a, 'b> {
    pub(super) config: &'a Config<'b>,
    pub(super) joints: &'a Joints,
    /// Value that the deploy code feeds back.
    pub(super) action: &'static str,
    pub(super) rate: f64,
    pub(super) parts: &'a mut Parts,
    pub(super) facts: &'a mut Facts,
}

/// A term that was begun.
struct Term {
    /// Number of its values, unless it is a question.
    len: Option<usize>,
    ops: Vec<Op>,
    source: String,
}

impl Terms<'_, '_> {
    /// Adds the observation; returns its length, or `None` while that of a term is a question.
    pub(super) fn observe(mut self) -> Result<Option<usize>> {
        let config = self.config;
        let terms =
            config.required("observations", "a list of terms", |node| node.texts().filter(|t| !t.is_empty()))?;
        let clip = config.required("clip_obs", "a number from 0", |node| node.number().filter(|clip| *clip >= 0.0))?;
        let (length, histories) = frames(config, self.facts)?;
        let mut all = Some(0);
        for (i, name) in terms.iter().enumerate() {
            let shown = config.location("observations");
            ensure!(is_plain(name), "{shown}: term {i} (from 0) is not a name: use letters, digits, _ - /");
            ensure!(!terms[..i].contains(name), "{shown}: {name:?} occurs twice");
            let mut term = self.term(name)?;
            term.ops.push(clip_to(clip));
            let value = self.parts.term(term.ops, length);
            self.facts.note(&value, format!("{shown}; {}", term.source));
            all = all.zip(term.len).map(|(all, len)| all + len);
        }
        self.parts.observe(&histories)?;
        let given = config.optional("num_observations", "a number of values", count)?;
        match (given, all) {
            (Some(given), Some(all)) if given != all => Err(Facts::contradiction(
                "length of the observation",
                (&config.location("num_observations"), &given.to_string()),
                (&config.location("observations"), &format!("terms of {all} values")),
            )),
            _ => Ok(all.map(|all| all * length)),
        }
    }

    /// Begins a term.
    fn term(&mut self, name: &str) -> Result<Term> {
        let (config, n) = (self.config, self.joints.len());
        let scaled = |key: &str, len: usize, mut ops: Vec<Op>| -> Result<Term> {
            ops.push(Op::Scale(Operand::Number(config.number(key)?)));
            Ok(Term { len: Some(len), ops, source: config.location(key) })
        };
        match name {
            "lin_vel" => {
                let mut term = scaled("lin_vel_scale", 3, Vec::new())?;
                if self.facts.is_choice("lin_vel", "input")? {
                    self.parts.input(name, 3, "m/s");
                } else {
                    self.parts.constant_value("no_lin_vel", vec![0.0; 3]);
                    self.parts.begin(name, "no_lin_vel");
                }
                term.source = format!("{}; {}", term.source, self.facts.source("lin_vel"));
                Ok(term)
            }
            "ang_vel" | "ang_vel_body" | "ang_vel_world" => {
                if name == "ang_vel_world" {
                    self.facts.require_from_application(
                        "raw.ang_vel",
                        "the term ang_vel_world rotates a velocity of the world's frame into the body's; \
                         does the application give it in the body's frame (true)?",
                    )?;
                }
                scaled("ang_vel_scale", 3, self.parts.input_as(name, "ang_vel", 3, "rad/s"))
            }
            "gravity_vec" => {
                let (input, len, ops) = given_gravity(self.facts, "gravity", "wxyz", "base_quat")?;
                self.parts.input_as(name, input, len, "");
                Ok(Term { len: Some(3), ops, source: self.facts.source("gravity") })
            }
            "commands" => {
                let three = |node: &Node| node.numbers().filter(|scales| scales.len() == 3);
                let by = config.required("commands_scale", "three finite numbers", three)?;
                self.parts.input(name, 3, "m/s, m/s, rad/s");
                let ops = vec![Op::Scale(Operand::List(by))];
                Ok(Term { len: Some(3), ops, source: config.location("commands_scale") })
            }
            "dof_pos" => {
                let (wheels, by) = (config.places("wheel_indices")?, config.number("dof_pos_scale")?);
                let mut ops = self.joints.input(self.parts, name, "rad");
                ops.push(Op::Subtract(Operand::Name("default".to_owned())));
                // The angle of a wheel is observed as 0.
                ops.push(Op::Scale(Operand::List(masked(&vec![by; n], |i| !wheels.contains(&i)))));
                Ok(Term { len: Some(n), ops, source: config.location("dof_pos_scale") })
            }
            "dof_vel" => scaled("dof_vel_scale", n, self.joints.input(self.parts, name, "rad/s")),
            "actions" => {
                let is_raw = self.facts.is_choice("last_action", "raw")?;
                let ops = self.parts.state_term(name, n, if is_raw { "policy.ACTION" } else { self.action });
                Ok(Term { len: Some(n), ops, source: self.facts.source("last_action") })
            }
            // One turn of the clock is one of the slowest sine, and four of the fastest.
            "phase" => self.waves(name, "phase.period", 4.0, &[4.0, 2.0, 1.0]),
            "g1_phase" => self.waves(name, "g1_phase.period", 1.0, &[1.0]),
            "g1_mimic_phase" | "RoboMimic_Deploy/phase" => {
                let seconds = self.seconds("motion_length")?;
                self.clock("motion_progress", seconds, None)?;
                self.parts.begin("motion_phase", "motion_progress");
                Ok(Term { len: Some(1), ops: Vec::new(), source: self.facts.source("motion_length") })
            }
            "whole_body_tracking/motion_command" => self.of_motion(name, 2 * n),
            "whole_body_tracking/motion_anchor_ori_b" => self.of_motion(name, 6),
            other => self.unknown(other),
        }
    }

    /// Begins a term of sines and cosines of a time.
    fn waves(&mut self, name: &str, rule: &str, turn: f64, multiples: &[f64]) -> Result<Term> {
        let seconds = self.seconds(rule)?;
        let clock = format!("{name}_turn");
        self.clock(&clock, turn * seconds, Some([0.0, 1.0]))?;
        let mut waves = Vec::new();
        for multiple in multiples {
            for (wave, op) in [("sin", Op::Sin), ("cos", Op::Cos)] {
                let value = format!("{name}_{wave}_{multiple}");
                self.parts.value(&value, &clock, vec![Op::Scale(Operand::Number(multiple * TAU)), op]);
                waves.push(value);
            }
        }
        let all = format!("{name}_waves");
        self.parts.values(&all, &waves.iter().map(String::as_str).collect::<Vec<_>>());
        self.parts.begin(name, &all);
        Ok(Term { len: Some(waves.len()), ops: Vec::new(), source: self.facts.source(rule) })
    }

    /// Returns a time by its rule; 1 while it is a question.
    fn seconds(&mut self, rule: &str) -> Result<f64> {
        let seconds: f64 = self.facts.value(rule)?.unwrap_or(1.0);
        ensure!(seconds > 0.0 && seconds.is_finite(), "{rule} = {seconds}: give a number above 0");
        Ok(seconds)
    }

    /// Adds a clock that advances by 1 in some seconds.
    fn clock(&mut self, name: &str, seconds: f64, wrap: Option<[f64; 2]>) -> Result<()> {
        let when: Option<When> = self.facts.value("clock.when")?;
        let advance = 1.0 / (self.rate * seconds);
        self.parts.clock(Clock { wrap, ..Clock::from_zero(name, advance, when.unwrap_or(When::Before)) });
        self.facts.note(name, self.facts.source("clock.when"));
        Ok(())
    }

    /// Begins a term that the deploy code computes of a motion's file, and the application for an image.
    fn of_motion(&mut self, name: &str, len: usize) -> Result<Term> {
        let key = format!("raw.{}", last_part(name));
        self.facts.require_from_application(
            &key,
            &format!("the deploy code computes {name} of the motion's file; does the application compute it (true)?"),
        )?;
        Ok(Term { len: Some(len), ops: self.parts.input(last_part(name), len, ""), source: self.facts.source(&key) })
    }

    /// Begins a term that is not one of the deploy code's, so that only the application knows it.
    fn unknown(&mut self, name: &str) -> Result<Term> {
        let key = format!("raw.{}", last_part(name));
        let len: Option<usize> = self
            .facts
            .missing(&key, &format!("term {name:?}: unknown length; how many values does the application give?"))?;
        ensure!(len.is_none_or(|len| (1..=10_000).contains(&len)), "{key}: give 1 to 10000");
        let ops = self.parts.input(last_part(name), len.unwrap_or(1), "");
        Ok(Term { len, ops, source: self.facts.source(&key) })
    }
}

/// Returns a term's name without its task.
fn last_part(name: &str) -> &str {
    name.rsplit_once('/').map_or(name, |(_, last)| last)
}

fn is_plain(name: &str) -> bool {
    let is_part =
        |part: &str| !part.is_empty() && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    name.split('/').all(is_part)
}
