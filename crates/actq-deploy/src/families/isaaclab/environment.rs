//! `env.yaml`: the configuration of an environment, as a training of Isaac Lab stores it.

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use super::model::{
    Action, Kind, Layout, MODULES, Policy, Sourced, Term, TermSource, known, observation, parts_of, plain,
};
use super::patterns::{Joints, MAX_COUNT};
use super::values::{bounds, history, no_delay, numbers};
use crate::document::Document;
use crate::facts::Facts;
use crate::families::common::count;
use crate::yaml::Node;

/// Keys of a group of observations that are not terms.
const SETTINGS: [&str; 6] = [
    "concatenate_terms",
    "concatenate_dim",
    "enable_corruption",
    "history_length",
    "flatten_history_dim",
    "history_order",
];

/// Returns `true` if a file has the keys of an environment.
pub(super) fn is_one(yaml: &Document) -> bool {
    let has_terms = |path| yaml.peek(path).is_some_and(|node| !node.entries().is_empty());
    ["decimation", "sim.dt", "scene"].iter().all(|key| yaml.peek(key).is_some())
        && has_terms("observations")
        && has_terms("actions")
}

/// A file that is read.
pub(super) struct Environment<'a> {
    pub(super) yaml: &'a Document,
    /// Name of the robot in the scene.
    pub(super) asset: &'a str,
    /// Name of the observations that the policy reads.
    pub(super) group: &'a str,
    pub(super) joints: Joints,
}

impl Environment<'_> {
    pub(super) fn read(self, facts: &mut Facts) -> Result<Policy> {
        let yaml = self.yaml;
        let (dt, decimation) = (yaml.number("sim.dt")?, yaml.number("decimation")?);
        ensure!(
            (1e-6..1e3).contains(&dt) && (1.0..1e6).contains(&decimation),
            "{} = {dt} and decimation = {decimation}: give the seconds of a simulation's step, and steps in a tick",
            yaml.location("sim.dt")
        );
        let robot = |key: &str| format!("scene.{}.{key}", self.asset);
        let path = robot("init_state");
        ensure!(
            yaml.peek(&path).is_some(),
            "{} is missing; answer asset with the name of the robot in the scene: {}",
            yaml.location(&path),
            yaml.keys("scene").iter().take(MAX_COUNT).map(|name| printable(name)).collect::<Vec<_>>().join(", ")
        );
        let pose = |key: &str, facts: &mut Facts| {
            let path = robot(&format!("init_state.{key}"));
            Ok::<_, actq::error::Error>(Sourced {
                numbers: self
                    .by_joint(&path, &self.joints, 0.0, facts)?
                    .unwrap_or_else(|| vec![0.0; self.joints.len()]),
                from: yaml.location(&path),
            })
        };
        let (default, default_velocity) = (pose("joint_pos", facts)?, pose("joint_vel", facts)?);
        let gains = self.gains(&robot("actuators"), facts)?;
        // The rest of the robot is for the simulation.
        yaml.node(&format!("scene.{}", self.asset));
        let actions = self.actions(&default, &default_velocity, facts)?;
        let (terms, layout) = self.terms(&actions, &default, &default_velocity)?;
        let rate = Sourced {
            numbers: vec![1.0 / (dt * decimation)],
            from: format!("{}; {}", yaml.location("sim.dt"), yaml.location("decimation")),
        };
        let joints = self.joints;
        Ok(Policy { rate, decimation, joints, default, default_velocity, limits: None, gains, terms, layout, actions })
    }

    /// Reads a number for all joints, or numbers by pattern; `otherwise` is that of joints that none matches.
    fn by_joint(&self, path: &str, joints: &Joints, otherwise: f64, facts: &mut Facts) -> Result<Option<Vec<f64>>> {
        let Some(node) = self.yaml.node(path) else { return Ok(None) };
        let what = "a finite number, or finite numbers by patterns of joints";
        if let Some(number) = node.number() {
            return Ok(Some(vec![number; joints.len()]));
        }
        let pairs = node.entries().iter().map(|(pattern, number)| Some((pattern.clone(), number.number()?)));
        let pairs: Option<Vec<(String, f64)>> = pairs.collect();
        let pairs = pairs.filter(|pairs| !pairs.is_empty());
        let pairs =
            pairs.with_context(|| format!("{} (line {}) must be {what}", self.yaml.location(path), node.line))?;
        let found = joints.resolve(&pairs, &self.yaml.location(path))?;
        self.unmatched(&found, joints, path, facts)?;
        Ok(Some(found.into_iter().map(|number| number.unwrap_or(otherwise)).collect()))
    }

    /// Asks for the rule of joints that no pattern matches, if there are some.
    fn unmatched<T>(&self, found: &[Option<T>], joints: &Joints, path: &str, facts: &mut Facts) -> Result<()> {
        let Some(place) = found.iter().position(Option::is_none) else { return Ok(()) };
        let holds: Option<bool> = facts.value("unmatched")?;
        ensure!(
            joints.open || holds != Some(false),
            "{}: no pattern matches joint {:?}; add one",
            self.yaml.location(path),
            joints.names[place]
        );
        Ok(())
    }

    /// Reads the gains of all actuators; nothing if the USD file has some of them.
    fn gains(&self, path: &str, facts: &mut Facts) -> Result<Option<[Sourced; 2]>> {
        let yaml = self.yaml;
        let mut gains = ["stiffness", "damping"].map(|key| Sourced {
            numbers: vec![0.0; self.joints.len()],
            from: yaml.location(&format!("{path}.*.{key}")),
        });
        let mut actuated = vec![None; self.joints.len()];
        let mut is_complete = !yaml.keys(path).is_empty();
        for actuator in yaml.keys(path) {
            let of = |key: &str| format!("{path}.{actuator}.{key}");
            let patterns = texts(yaml, &of("joint_names_expr"))?;
            let at = yaml.location(&of("joint_names_expr"));
            let places = self.joints.select(&patterns.with_context(|| format!("{at} is missing"))?, false, &at)?;
            for place in &places {
                ensure!(
                    self.joints.open || actuated[*place].is_none(),
                    "{at}: joint {:?} has another actuator, too; let one of them move it",
                    self.joints.names[*place]
                );
                actuated[*place] = Some(());
            }
            let joints = self.joints.at(&places);
            for (gain, key) in gains.iter_mut().zip(["stiffness", "damping"]) {
                match self.by_joint(&of(key), &joints, 0.0, facts)? {
                    Some(numbers) => {
                        places.iter().zip(numbers).for_each(|(place, number)| gain.numbers[*place] = number);
                    }
                    None => is_complete = false,
                }
            }
        }
        if is_complete {
            self.unmatched(&actuated, &self.joints, path, facts)?;
        }
        Ok(is_complete.then_some(gains))
    }

    fn actions(&self, default: &Sourced, default_velocity: &Sourced, facts: &mut Facts) -> Result<Vec<Action>> {
        let yaml = self.yaml;
        let mut actions = Vec::new();
        for name in yaml.keys("actions") {
            let of = |key: &str| format!("actions.{name}.{key}");
            let from = yaml.location(&format!("actions.{name}"));
            if yaml.peek(&format!("actions.{name}")).is_some_and(Node::is_null) {
                yaml.node(&format!("actions.{name}"));
                continue;
            }
            plain(name, &from)?;
            let class = yaml.required(&of("class_type"), "a class", Node::text)?;
            let kind = Kind::of(&class.replace(':', "."), &yaml.location(&of("class_type")))?;
            let asset = yaml.required(&of("asset_name"), "the name of the robot", Node::text)?;
            ensure!(
                asset == self.asset,
                "{} = {:?}: the robot is {:?}; answer asset with its name in the scene",
                yaml.location(&of("asset_name")),
                printable(asset),
                self.asset
            );
            let path = of("joint_names");
            let patterns = texts(yaml, &path)?.with_context(|| format!("{} is missing", yaml.location(&path)))?;
            let in_their_order = yaml.optional(&of("preserve_order"), "true or false", Node::truth)?.unwrap_or(false);
            let places = self.joints.select(&patterns, in_their_order, &yaml.location(&path))?;
            let joints = self.joints.at(&places);
            let scale = self.by_joint(&of("scale"), &joints, 1.0, facts)?.unwrap_or_else(|| vec![1.0; joints.len()]);
            let own = self.by_joint(&of("offset"), &joints, 0.0, facts)?.unwrap_or_else(|| vec![0.0; joints.len()]);
            let needs = |key: &str| yaml.required(&of(key), "true or false", Node::truth);
            let of_default = |all: &Sourced| places.iter().map(|place| all.numbers[*place]).collect();
            let offset = match kind {
                Kind::Position if needs("use_default_offset")? => of_default(default),
                Kind::Velocity if needs("use_default_offset")? => of_default(default_velocity),
                Kind::Relative if needs("use_zero_offset")? => vec![0.0; joints.len()],
                _ => own,
            };
            let clip = self.clip(&of("clip"), &joints)?;
            actions.push(Action { name: name.to_owned(), kind, joints: places, scale, offset, clip, from });
        }
        ensure!(!actions.is_empty(), "{} has no actions", yaml.location("actions"));
        Ok(actions)
    }

    /// Reads the limits of an action by patterns of its joints.
    fn clip(&self, path: &str, joints: &Joints) -> Result<Option<Vec<[f64; 2]>>> {
        let Some(node) = self.yaml.node(path) else { return Ok(None) };
        let pairs = node.entries().iter().map(|(pattern, pair)| Some((pattern.clone(), bounds(pair)?)));
        let pairs: Option<Vec<(String, [f64; 2])>> = pairs.collect();
        let pairs = pairs.filter(|pairs| !pairs.is_empty()).with_context(|| {
            format!("{} (line {}) must be pairs of numbers by patterns of joints", self.yaml.location(path), node.line)
        })?;
        let found = joints.resolve(&pairs, &self.yaml.location(path))?;
        Ok(Some(found.into_iter().map(|pair| pair.unwrap_or([f64::NEG_INFINITY, f64::INFINITY])).collect()))
    }

    /// Refuses a group that is missing, or whose terms are read one by one. Other groups are not read.
    fn check_group(&self, group: &str) -> Result<()> {
        let yaml = self.yaml;
        ensure!(
            yaml.peek(group).is_some_and(|node| !node.is_null()),
            "{} is missing; answer group with one of {}",
            yaml.location(group),
            yaml.keys("observations").iter().take(MAX_COUNT).map(|name| printable(name)).collect::<Vec<_>>().join(", ")
        );
        for other in yaml.keys("observations").into_iter().filter(|other| *other != self.group) {
            yaml.node(&format!("observations.{other}"));
        }
        let path = format!("{group}.concatenate_terms");
        let joined = yaml.optional(&path, "true or false", Node::truth)?.unwrap_or(true);
        ensure!(
            joined,
            "{} = false: the policy reads each term by itself, which is not supported",
            yaml.location(&path)
        );
        Ok(())
    }

    /// Reads the terms of the group that the policy reads, and the layout of their histories, if it is stated.
    fn terms(
        &self,
        actions: &[Action],
        default: &Sourced,
        default_velocity: &Sourced,
    ) -> Result<(Vec<Term>, Option<Layout>)> {
        let (yaml, group) = (self.yaml, format!("observations.{}", self.group));
        let in_group = |key: &str| format!("{group}.{key}");
        self.check_group(&group)?;
        let has_history = yaml.optional(&in_group("history_length"), "a number of frames", count)?.is_some();
        let mut terms = Vec::new();
        for name in yaml.keys(&group).into_iter().filter(|name| !SETTINGS.contains(name)) {
            let path = in_group(name);
            let Some(node) = yaml.peek(&path) else { continue };
            if node.is_null() {
                yaml.node(&path);
                continue;
            }
            // A setting of a later version, which stays unread.
            if node.entries().is_empty() {
                continue;
            }
            let mut term = self.term(name, &path, actions, [default, default_velocity])?;
            // A group's settings replace those of its terms.
            term.frames = history(yaml, if has_history { &group } else { &path })?;
            for key in ["history_length", "flatten_history_dim"] {
                yaml.node(&format!("{path}.{key}"));
            }
            no_delay(yaml, &path);
            terms.push(term);
        }
        yaml.node(&in_group("flatten_history_dim"));
        let path = in_group("history_order");
        // Only the group's own length makes an order of time.
        let layout = yaml.optional(&path, "\"term\" or \"time\"", |node| match node.text()? {
            "time" if has_history => Some(Layout::Frames(yaml.location(&path))),
            "term" | "time" => Some(Layout::Terms(yaml.location(&path))),
            _ => None,
        })?;
        Ok((terms, layout))
    }

    /// Reads a term without its history. `defaults` are the positions and velocities of all joints.
    fn term(&self, name: &str, path: &str, actions: &[Action], defaults: [&Sourced; 2]) -> Result<Term> {
        let yaml = self.yaml;
        let of = |key: &str| format!("{path}.{key}");
        plain(name, &yaml.location(path))?;
        let function = yaml.required(&of("func"), "a function", Node::text)?.replace(':', ".");
        let (what, relative) = self.what(name, &function, path, actions)?;
        let joints =
            if matches!(what, TermSource::Joints(..)) { self.observed(&of("params.asset_cfg"))? } else { Vec::new() };
        yaml.node(&of("params"));
        let [default, default_velocity] = defaults;
        let offset = match what {
            TermSource::Joints("joint_pos", _) if relative => {
                joints.iter().map(|place| default.numbers[*place]).collect()
            }
            TermSource::Joints(..) if relative => joints.iter().map(|place| default_velocity.numbers[*place]).collect(),
            _ => Vec::new(),
        };
        Ok(Term {
            name: name.to_owned(),
            function,
            what,
            joints,
            offset,
            clip: yaml.optional(&of("clip"), "two numbers", bounds)?,
            scale: yaml.optional(&of("scale"), "finite numbers", numbers)?,
            frames: 1,
            from: yaml.location(path),
        })
    }

    /// Returns a term's content, and `true` if a default is subtracted from it.
    fn what(&self, name: &str, function: &str, path: &str, actions: &[Action]) -> Result<(TermSource, bool)> {
        let yaml = self.yaml;
        let unknown = |why: String| Ok((TermSource::Unknown(why, None), false));
        let modifiers = yaml.node(&format!("{path}.modifiers"));
        if modifiers.is_some_and(|node| !node.items().is_empty() || !node.entries().is_empty()) {
            return unknown(format!("term {name:?} has modifiers, which this reader does not know"));
        }
        let param = |key: &str| yaml.node(&format!("{path}.params.{key}"));
        let text = |key: &str| yaml.optional(&format!("{path}.params.{key}"), "a name", Node::text);
        let own = yaml.keys(&format!("{path}.params"));
        let other = own.iter().find(|key| !["asset_cfg", "command_name", "action_name"].contains(*key));
        if let Some(other) = other.filter(|other| param(other).is_some()) {
            return unknown(format!(
                "term {name:?} has the parameter {:?}, which this reader does not know",
                printable(other)
            ));
        }
        let asset = text("asset_cfg.name")?.unwrap_or(self.asset);
        match observation(function) {
            Some("last_action") => {
                let Some(of) = text("action_name")? else { return Ok((TermSource::LastAction(None), false)) };
                let part = actions.iter().position(|action| action.name == of);
                let part = part.with_context(|| {
                    format!("{}.params.action_name = {:?}: there is no such action", yaml.location(path), printable(of))
                })?;
                Ok((TermSource::LastAction(parts_of(actions).into_iter().nth(part)), false))
            }
            Some("generated_commands") => match text("command_name")? {
                Some(command) => self.command(command, name),
                None => unknown(format!("term {name:?} names no command")),
            },
            // An IMU's configuration names the sensor instead.
            Some(own) if asset == self.asset || ["imu_", "pva_"].iter().any(|sensor| own.starts_with(sensor)) => {
                match known(function) {
                    Some(found) => Ok(found),
                    None => unknown(format!(
                        "the function of term {name:?}, {}, is not known to this reader",
                        printable(function)
                    )),
                }
            }
            Some(_) => unknown(format!("term {name:?} is of {:?}, not of the robot", printable(asset))),
            None => {
                unknown(format!("the function of term {name:?}, {}, is not known to this reader", printable(function)))
            }
        }
    }

    /// Returns a velocity command with its ranges; any other command is unknown.
    fn command(&self, command: &str, term: &str) -> Result<(TermSource, bool)> {
        let yaml = self.yaml;
        let class =
            yaml.optional(&format!("commands.{command}.class_type"), "a class", Node::text)?.unwrap_or_default();
        let class = class.replace(':', ".");
        let is_velocity = MODULES.iter().any(|module| {
            let own = class.strip_prefix(module).and_then(|rest| rest.strip_prefix("commands.velocity_command."));
            matches!(own, Some("UniformVelocityCommand" | "NormalVelocityCommand"))
        });
        if !is_velocity {
            let why = format!("command {:?} of term {term:?} is not one of Isaac Lab's velocities", printable(command));
            return Ok((TermSource::Unknown(why, None), false));
        }
        plain(command, &yaml.location("commands"))?;
        let range = |axis: &str| yaml.optional(&format!("commands.{command}.ranges.{axis}"), "two numbers", bounds);
        let ranges = [range("lin_vel_x")?, range("lin_vel_y")?, range("ang_vel_z")?];
        Ok((TermSource::Command(command.to_owned(), 3, ranges.into_iter().collect()), false))
    }

    /// Returns the places of the joints that a term observes.
    fn observed(&self, path: &str) -> Result<Vec<usize>> {
        let yaml = self.yaml;
        let (names, ids) = (format!("{path}.joint_names"), format!("{path}.joint_ids"));
        let in_their_order = format!("{path}.preserve_order");
        let in_their_order = yaml.optional(&in_their_order, "true or false", Node::truth)?.unwrap_or(false);
        let places = match texts(yaml, &names)? {
            Some(patterns) => self.joints.select(&patterns, in_their_order, &yaml.location(&names))?,
            None => (0..self.joints.len()).collect(),
        };
        // A slice of all joints is a list of three nothings.
        let listed = yaml.node(&ids).filter(|node| node.items().iter().any(|item| !item.is_null()));
        let Some(listed) = listed else { return Ok(places) };
        let listed: Option<Vec<usize>> = listed.items().iter().map(count).collect();
        let listed = listed.with_context(|| format!("{} must be places of joints", yaml.location(&ids)))?;
        if self.joints.open {
            return Ok(listed.iter().map(|_| 0).collect());
        }
        if yaml.node(&names).is_none() {
            ensure!(
                listed.iter().all(|place| *place < self.joints.len()) && listed.len() <= self.joints.len(),
                "{}: the robot has {} joints ({})",
                yaml.location(&ids),
                self.joints.len(),
                self.joints.from
            );
            return Ok(listed);
        }
        if listed != places {
            return Err(Facts::contradiction(
                "joints of a term",
                (&yaml.location(&ids), &format!("{listed:?}")),
                (&format!("{} with the joints of {}", yaml.location(&names), self.joints.from), &format!("{places:?}")),
            ));
        }
        Ok(places)
    }
}

/// Reads a text or a list of texts, if it is there.
fn texts(yaml: &Document, path: &str) -> Result<Option<Vec<String>>> {
    let one_or_more = |node: &Node| node.texts().or_else(|| Some(vec![node.text()?.to_owned()]));
    let texts = yaml.optional(path, "a text or a list of texts", one_or_more)?;
    if texts.as_ref().is_some_and(Vec::is_empty) {
        bail!("{} is empty", yaml.location(path));
    }
    Ok(texts)
}
