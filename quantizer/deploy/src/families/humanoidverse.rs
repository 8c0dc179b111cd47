//! humanoidverse's sim2real code (FALCON, ASAP): one YAML file beside ONNX files.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::path::Path;

use actq::error::{Context as _, Result, bail, ensure};
use actq_onnx::Signature;

use super::common::{Histories, Parts, given_gravity};
use crate::bundle::Bundle;
use crate::description::{Clock, Description, Gains, History, Op, Operand, Order, TargetKind, When};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Found};
use crate::yaml::Node;

/// The family.
#[derive(Debug)]
pub(super) struct Humanoidverse;

/// Keys that every file of this family has.
const KEYS: [&str; 3] = ["DEFAULT_DOF_ANGLES", "obs_scales", "obs_dims"];

/// Policies of ASAP's files: name, key of the histories, key of the lengths, and scale of the histories.
const ASAP: [[&str; 4]; 3] = [
    ["locomotion", "history_loco_config", "obs_loco_dims", "history_loco"],
    ["locomotion_height", "history_loco_height_config", "obs_loco_dims", "history_loco"],
    ["mimic", "history_mimic_config", "obs_mimic_dims", "history_mimic"],
];

impl Family for Humanoidverse {
    fn profile(&self) -> &'static str {
        include_str!("humanoidverse/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Found>> {
        let mut documents = Vec::new();
        for file in bundle.with_ending("yaml").chain(bundle.with_ending("yml")) {
            // Other YAML files of a folder decide nothing, even if they are damaged.
            if bundle.text(file).is_ok_and(|text| KEYS.iter().all(|key| text.contains(key))) {
                let document = Document::read(bundle, file)?;
                if KEYS.iter().all(|key| document.look(key).is_some()) {
                    documents.push(document);
                }
            }
        }
        if documents.is_empty() {
            return Ok(None);
        }
        let files: Vec<&str> = documents.iter().map(|document| document.file.as_str()).collect();
        ensure!(files.len() == 1, "several files describe a robot: {}; name the folder of one", files.join(", "));
        let networks = bundle.with_ending("onnx").map(str::to_owned).collect();
        Ok(Some(Found { documents, networks, others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Found, facts: &mut Facts) -> Result<Description> {
        let yaml = found.documents.first().context("there is no YAML file")?;
        let robot = Robot::read(yaml, facts)?;
        let asap = yaml.look("obs_dict").is_none() && yaml.look("obs_list").is_none();
        ensure!(
            !asap || ASAP.iter().any(|[_, histories, ..]| yaml.look(histories).is_some()),
            "{}: it has neither obs_dict (FALCON) nor history_loco_config or history_mimic_config (ASAP)",
            yaml.file
        );
        let file = network(yaml, &found.networks, facts)?;
        let signature = Signature::read(&bundle.path(&file)?)?;
        let port = match &signature.inputs[..] {
            [one] => Some(one),
            several => several.iter().find(|(name, _)| name == "actor_obs"),
        };
        let (input, seen) = port.with_context(|| format!("{file}: it has no input actor_obs"))?;
        // The deploy code reads the first output only.
        let (output, acts) = signature.outputs.first().with_context(|| format!("{file}: it has no output"))?;
        // A graph whose axes are all dynamic does not tell its lengths.
        let told = |len: &Option<usize>| len.filter(|len| *len > 1);

        let rate = match yaml.maybe("rl_rate", "a number of ticks a second", Node::number)? {
            Some(rate) => {
                facts.note("rate_hz", yaml.at("rl_rate"));
                rate
            }
            None => facts.find("rate_hz")?.unwrap_or(1.0),
        };
        ensure!(rate > 0.0, "rate_hz = {rate}: give a number above 0");
        let mut reader = Reader {
            yaml,
            parts: Parts::new("policy", rate),
            facts,
            rate,
            dims: "obs_dims".to_owned(),
            acts: told(acts),
            acts_from: format!("{file}, output {output:?}"),
            robot,
            active: None,
            motion: None,
            has_phase: false,
        };
        reader.parts.constant("default", reader.robot.default.clone());
        if reader.robot.by_name {
            reader.parts.joints("robot", reader.robot.names.clone());
        }
        let len = if asap { reader.asap(&file, told(seen))? } else { reader.falcon()? };
        if let Some(seen) = told(seen)
            && seen != len
        {
            return Err(Facts::contradiction(
                "length of the observation",
                (&yaml.file, &format!("{len} values, by its terms, dimensions and histories")),
                (&format!("{file}, input {input:?}"), &format!("{seen} values")),
            ));
        }
        reader.parts.network(&file, input, output);
        reader.act()?;
        reader.gains()?;
        Ok(reader.parts.finish())
    }
}

/// Returns the network: the file that model_path names, the only one, or the answer.
fn network(yaml: &Document, networks: &[String], facts: &mut Facts) -> Result<String> {
    let path = yaml.maybe("model_path", "a path", Node::text)?.map(|path| path.trim_start_matches("./"));
    let named = |path: &str| {
        let mut found = networks.iter().filter(|file| !path.is_empty() && Path::new(file).ends_with(path));
        found.next().filter(|_| found.next().is_none())
    };
    if let Some(file) = path.and_then(named) {
        facts.note("network", yaml.at("model_path"));
        return Ok(file.clone());
    }
    match networks {
        [] => bail!("{}: there is no ONNX file with it", yaml.file),
        [only] => {
            let other = path.map_or(String::new(), |path| format!("; {} names {path:?}", yaml.at("model_path")));
            facts.note("network", format!("the only ONNX file{other}"));
            Ok(only.clone())
        }
        [first, ..] => {
            let answer: Option<String> = facts.find("network")?;
            let file = answer.unwrap_or_else(|| first.clone());
            ensure!(networks.contains(&file), "network = {file:?}: there are {}", networks.join(", "));
            Ok(file)
        }
    }
}

/// A robot's joints, in the order of DEFAULT_DOF_ANGLES.
struct Robot {
    default: Vec<f64>,
    names: Vec<String>,
    /// Whether the names are those of the joints; the raw values are by position otherwise.
    by_name: bool,
    /// Places of the joints of the upper body.
    upper: Vec<usize>,
}

impl Robot {
    fn read(yaml: &Document, facts: &mut Facts) -> Result<Self> {
        let default = yaml.numbers("DEFAULT_DOF_ANGLES")?;
        let n = default.len();
        ensure!(n > 0, "{} is empty", yaml.at("DEFAULT_DOF_ANGLES"));
        facts.note("default", yaml.at("DEFAULT_DOF_ANGLES"));
        let same = |key: &str, len: usize, what: &str| {
            let (at, of) = (yaml.at("DEFAULT_DOF_ANGLES"), yaml.at(key));
            if len == n {
                return Ok(());
            }
            Err(Facts::contradiction(
                "number of joints",
                (&at, &format!("{n} joints")),
                (&of, &format!("{len} {what}")),
            ))
        };
        if let Some(joints) = yaml.maybe("NUM_JOINTS", "a number of joints", count)? {
            same("NUM_JOINTS", joints, "joints")?;
        }
        let mut reordered = false;
        for key in ["JOINT2MOTOR", "MOTOR2JOINT"] {
            let map = yaml.maybe(key, "a list of numbers", Node::numbers)?;
            reordered |= map.is_some_and(|map| !map.iter().enumerate().all(|(i, place)| *place == i as f64));
        }
        let parallel = yaml.maybe("MOTOR_TYPE", "a text", Node::text)? == Some("parallel");
        if reordered || parallel {
            let what = if parallel { "MOTOR_TYPE is parallel" } else { "JOINT2MOTOR is not the identity" };
            let meaning = format!(
                "{what}; does the application give and take joint values in the order of DEFAULT_DOF_ANGLES (true)?"
            );
            let given = facts.missing::<bool>("raw.joints", &meaning)?;
            ensure!(given != Some(false), "raw.joints = false: values of motors are not supported; convert them first");
        }

        let names = yaml.maybe("dof_names", "a list of texts", Node::texts)?.unwrap_or_default();
        if !names.is_empty() {
            same("dof_names", names.len(), "names")?;
            ensure!(names.iter().collect::<BTreeSet<_>>().len() == n, "{}: a name occurs twice", yaml.at("dof_names"));
        }
        let number = yaml.maybe("NUM_UPPER_BODY_JOINTS", "a number of joints", whole)?;
        let upper: Vec<usize> = match yaml.maybe("dof_names_upper_body", "a list of texts", Node::texts)? {
            Some(upper) => {
                let place = |name: &String| {
                    let place = names.iter().position(|other| other == name);
                    place.with_context(|| {
                        format!("{}: {name:?} is not one of dof_names", yaml.at("dof_names_upper_body"))
                    })
                };
                upper.iter().map(place).collect::<Result<_>>()?
            }
            None => {
                let number = number.unwrap_or(0);
                ensure!(number <= n, "{} = {number}, but there are {n} joints", yaml.at("NUM_UPPER_BODY_JOINTS"));
                (n - number..n).collect()
            }
        };
        ensure!(
            upper.iter().collect::<BTreeSet<_>>().len() == upper.len(),
            "{}: a name occurs twice",
            yaml.at("dof_names_upper_body")
        );
        if let Some(number) = number.filter(|number| *number != upper.len()) {
            return Err(Facts::contradiction(
                "number of joints of the upper body",
                (&yaml.at("NUM_UPPER_BODY_JOINTS"), &number.to_string()),
                (&yaml.at("dof_names_upper_body"), &format!("{} names", upper.len())),
            ));
        }
        let by_name = if names.is_empty() {
            false
        } else {
            match facts.find::<String>("joint_order")?.as_deref() {
                Some("names") => true,
                Some("position") | None => false,
                Some(other) => bail!("joint_order = {other:?}: give \"position\" or \"names\""),
            }
        };
        let order = if names.is_empty() { yaml.at("DEFAULT_DOF_ANGLES") } else { facts.source("joint_order") };
        facts.note("joint order", order);
        Ok(Self { default, names, by_name, upper })
    }

    fn len(&self) -> usize {
        self.default.len()
    }
}

/// What a term is made of.
struct Term {
    from: String,
    ops: Vec<Op>,
    len: usize,
    /// Length that the file must state, which is that without a selection of joints.
    stated: usize,
}

/// A description in the making.
struct Reader<'a> {
    yaml: &'a Document,
    parts: Parts,
    facts: &'a mut Facts,
    rate: f64,
    /// Key of the terms' lengths.
    dims: String,
    /// Length of the action, if known, and what says so.
    acts: Option<usize>,
    acts_from: String,
    robot: Robot,
    /// Places of the joints that the policy reads and moves; none for all.
    active: Option<Vec<usize>>,
    /// Length of the reference motion in s.
    motion: Option<f64>,
    has_phase: bool,
}

impl Reader<'_> {
    /// Adds the observation of FALCON; returns its length.
    fn falcon(&mut self) -> Result<usize> {
        let yaml = self.yaml;
        let listed = if yaml.look("obs_dict").is_some() { "obs_dict.actor_obs" } else { "obs_list" };
        let mut terms = yaml.texts(listed)?;
        let order: Option<String> = self.facts.find("terms.order")?;
        match order.as_deref() {
            Some("sorted") | None => terms.sort(),
            Some("listed") => {}
            Some(other) => bail!("terms.order = {other:?}: give \"sorted\" or \"listed\""),
        }
        let lengths =
            if yaml.look("history_length_dict").is_some() { "history_length_dict.actor_obs" } else { "history_length" };
        let length = yaml.need(lengths, "a number of frames", count)?;
        let histories = Histories::of(self.facts)?;
        let rules = ["terms.order", "history.layout"].map(|rule| self.facts.source(rule)).join("; ");
        self.facts.note("observation", format!("{}; {}; {rules}", yaml.at(listed), yaml.at(lengths)));
        if self.acts.is_none() && terms.iter().any(|term| term == "actions") {
            self.acts_from = yaml.at("obs_dims.actions");
            self.acts = Some(self.dim("actions")?);
        }
        let mut all = 0;
        for (i, name) in terms.iter().enumerate() {
            ensure!(!terms.iter().take(i).any(|other| other == name), "{}: {name:?} occurs twice", yaml.at(listed));
            let term = self.term(name)?;
            self.parts.begin(name, &term.from);
            let value = self.parts.term(term.ops, length);
            self.facts.note(&value, yaml.at(&format!("obs_scales.{name}")));
            all += term.len;
        }
        self.parts.observe(&histories)?;
        all.checked_mul(length).context("the observation is too long")
    }

    /// Adds the observation of ASAP; returns its length.
    fn asap(&mut self, file: &str, seen: Option<usize>) -> Result<usize> {
        let [policy, histories, dims, scale] = self.asap_policy(file, seen)?;
        self.dims = dims.to_owned();
        let yaml = self.yaml;
        if policy == "mimic" {
            let skill = self.skill(file)?;
            let kind = yaml.need(&format!("mimic_robot_types.{skill}"), "a text", Node::text)?;
            let mask = yaml.numbers(&format!("robot_dofs.{kind}"))?;
            self.active = Some(self.places(&mask, &format!("robot_dofs.{kind}"))?);
            self.motion = yaml.maybe(&format!("motion_length_s.{skill}"), "a number of s", Node::number)?;
            self.facts.note("joints of the policy", yaml.at(&format!("robot_dofs.{kind}")));
        }
        if self.acts.is_none() {
            self.acts_from = yaml.at(&format!("{dims}.actions"));
            let len = self.dim("actions")?;
            self.acts = Some(self.active.as_ref().map_or(len, Vec::len));
        }
        let flag = if policy == "mimic" { "USE_HISTORY_MIMIC" } else { "USE_HISTORY_LOCO" };
        let with_history = yaml.maybe(flag, "True or False", Node::truth)?.unwrap_or(false);
        let mut terms = yaml.keys(histories);
        terms.sort_unstable();
        ensure!(!terms.is_empty(), "{} has no terms", yaml.at(histories));
        self.facts.note("observation", format!("{}; {}", yaml.at(histories), self.facts.source("asap.terms")));
        let spec = History {
            length: 1,
            stride: 1,
            first: self.facts.get("asap.history.first")?,
            fill: self.facts.get("asap.history.fill")?,
            current: self.facts.find("asap.history.current")?.unwrap_or(false),
        };
        let (mut before, mut past, mut after, mut all) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for name in terms {
            let term = self.term(name)?;
            let value = if term.from == name { format!("{name}_term") } else { name.to_owned() };
            let len = term.len;
            self.parts.value(&value, &term.from, term.ops);
            self.facts.note(&value, yaml.at(&format!("obs_scales.{name}")));
            let key = format!("{histories}.{name}");
            let length = yaml.need(&key, "a number of frames", count)?;
            all += len;
            if with_history {
                let by = yaml.number(&format!("obs_scales.{scale}"))?;
                let ops = vec![Op::History(History { length, ..spec }), Op::Scale(Operand::Number(by))];
                let history = format!("{name}_history");
                self.parts.value(&history, &value, ops);
                self.facts.note(&history, format!("{}; {}", yaml.at(&key), self.facts.source("asap.history.first")));
                past.push(history);
                all = len.checked_mul(length).and_then(|len| len.checked_add(all)).context("a history is too long")?;
            }
            // The histories are one term, whose name begins with "history".
            if name < "history" { before.push(value) } else { after.push(value) }
        }
        let names: Vec<&str> = before.iter().chain(&past).chain(&after).map(String::as_str).collect();
        self.parts.values("observation", &names);
        Ok(all)
    }

    /// Returns which of ASAP's policies a network is: by its folder, by its length, or by the answer.
    fn asap_policy(&mut self, file: &str, seen: Option<usize>) -> Result<[&'static str; 4]> {
        // The order of the terms is the same for all; it is asked for here, since nothing else states it.
        let listed: bool = self.facts.find("asap.terms")?.unwrap_or(true);
        ensure!(listed, "asap.terms = false: write the terms of the observation in deploy.toml");
        let there: Vec<[&str; 4]> =
            ASAP.into_iter().filter(|[_, histories, ..]| self.yaml.look(histories).is_some()).collect();
        let skills = self.yaml.keys("mimic_models");
        let is_mimic = Path::new(file)
            .iter()
            .filter_map(|part| part.to_str())
            .any(|part| part == "mimic" || skills.contains(&part));
        let fits = |policy: &[&str; 4]| {
            let mimic = policy[0] == "mimic";
            mimic == is_mimic && (mimic || seen.is_none_or(|seen| self.asap_len(policy) == Some(seen)))
        };
        let fitting: Vec<[&str; 4]> = there.iter().filter(|policy| fits(policy)).copied().collect();
        if let [one] = fitting[..] {
            self.facts.note("policy", format!("{file}: its folder and the length of its input"));
            return Ok(one);
        }
        let answer: Option<String> = self.facts.find("asap.policy")?;
        let first = there.first().copied().context("it has no policies")?;
        let Some(answer) = answer else { return Ok(first) };
        let names = || there.iter().map(|policy| policy[0]).collect::<Vec<_>>().join(", ");
        let found = there.iter().copied().find(|policy| policy[0] == answer);
        found.with_context(|| format!("asap.policy = {answer:?}: there are {}", names()))
    }

    /// Returns the length of an observation of ASAP that selects no joints.
    fn asap_len(&self, [_, histories, dims, _]: &[&str; 4]) -> Option<usize> {
        let with_history = self.yaml.look("USE_HISTORY_LOCO").and_then(Node::truth).unwrap_or(false);
        let terms = self.yaml.keys(histories);
        let len = |term: &&str| {
            let dim = count(self.yaml.look(&format!("{dims}.{term}"))?)?;
            let frames = count(self.yaml.look(&format!("{histories}.{term}"))?)?;
            dim.checked_mul(if with_history { frames.checked_add(1)? } else { 1 })
        };
        terms.iter().try_fold(0_usize, |all, term| all.checked_add(len(term)?))
    }

    /// Returns the name of a skill of ASAP: the network's folder, the only one of the file, or the answer.
    fn skill(&mut self, file: &str) -> Result<String> {
        let skills = self.yaml.keys("mimic_models");
        let folder = Path::new(file).parent().and_then(Path::file_name).and_then(|name| name.to_str());
        let found = skills.iter().find(|skill| Some(**skill) == folder);
        self.yaml.get("mimic_models");
        if let Some(skill) = found {
            return Ok((*skill).to_owned());
        }
        if let [only] = skills[..] {
            return Ok(only.to_owned());
        }
        let answer: Option<String> = self.facts.find("asap.skill")?;
        let skill = answer.or_else(|| Some((*skills.first()?).to_owned()));
        let skill = skill.with_context(|| format!("{} has no skills", self.yaml.at("mimic_models")))?;
        ensure!(skills.contains(&skill.as_str()), "asap.skill = {skill:?}: there are {}", skills.join(", "));
        Ok(skill)
    }

    /// Returns the places of a mask.
    fn places(&self, mask: &[f64], key: &str) -> Result<Vec<usize>> {
        let n = self.robot.len();
        let at = self.yaml.at(key);
        ensure!(mask.len() == n, "{at} has {} values, but there are {n} joints", mask.len());
        ensure!(mask.iter().all(|flag| *flag == 0.0 || *flag == 1.0), "{at} must hold 0 and 1 only");
        let places: Vec<usize> = (0..n).filter(|i| mask[*i] == 1.0).collect();
        ensure!(!places.is_empty(), "{at} selects no joint");
        Ok(places)
    }

    /// Returns the length of a term that the file states.
    fn dim(&self, term: &str) -> Result<usize> {
        self.yaml.need(&format!("{}.{term}", self.dims), "a number of values", count)
    }

    /// Makes a term with its scale.
    fn term(&mut self, name: &str) -> Result<Term> {
        let (yaml, n) = (self.yaml, self.robot.len());
        let dim = self.dim(name)?;
        let mut term = self.content(name, dim)?;
        if term.stated != dim {
            let what = match name {
                "actions" => self.acts_from.clone(),
                "ref_upper_dof_pos" => yaml.at("dof_names_upper_body"),
                _ => format!("the deploy code, for {n} joints"),
            };
            return Err(Facts::contradiction(
                &format!("length of {name}"),
                (&yaml.at(&format!("{}.{name}", self.dims)), &format!("{dim} values")),
                (&what, &format!("{} values", term.stated)),
            ));
        }
        let key = format!("obs_scales.{name}");
        let scale = yaml.need(&key, "a number, or a list of them", |node| {
            Some(match node.number() {
                Some(number) => Operand::Number(number),
                None => Operand::List(node.numbers()?),
            })
        })?;
        term.ops.push(Op::Scale(scale));
        Ok(term)
    }

    fn content(&mut self, name: &str, dim: usize) -> Result<Term> {
        let n = self.robot.len();
        let from = |from: &str, ops: Vec<Op>, len: usize| Term { from: from.to_owned(), ops, len, stated: len };
        Ok(match name {
            "base_ang_vel" => self.raw(name, 3, "rad/s"),
            "base_lin_vel" => self.raw(name, 3, "m/s"),
            "command_lin_vel" => self.raw(name, 2, "m/s"),
            "command_ang_vel" => self.raw(name, 1, "rad/s"),
            "command_stand" => self.raw(name, 1, "1 to walk, 0 to stand"),
            "command_base_height" => self.raw(name, 1, "m"),
            "command_waist_dofs" => self.raw(name, 3, "rad"),
            "ref_upper_dof_pos" => self.raw(name, self.robot.upper.len(), "rad"),
            "projected_gravity" => self.gravity()?,
            "dof_pos" | "dof_vel" => {
                let unit = if name == "dof_pos" { "rad" } else { "rad/s" };
                if self.robot.by_name {
                    self.parts.raw_joints(name, "robot", unit);
                } else {
                    self.parts.raw(name, n, unit);
                }
                let mut ops = Vec::new();
                if name == "dof_pos" {
                    ops.push(Op::Subtract(Operand::Name("default".to_owned())));
                }
                let mut len = n;
                if let Some(active) = &self.active {
                    ops.push(Op::Select(Order::Places(active.clone())));
                    len = active.len();
                }
                Term { stated: n, ..from(name, ops, len) }
            }
            "actions" => {
                let acts = self.acts.unwrap_or(dim);
                let raw = match self.facts.find::<String>("last_action")?.as_deref() {
                    Some("clipped") | None => false,
                    Some("raw") => true,
                    Some(other) => bail!("last_action = {other:?}: give \"clipped\" or \"raw\""),
                };
                self.parts.kept("last_action", acts, if raw { "policy.ACTION" } else { "clipped" });
                self.facts.note("last_action", self.facts.source("last_action"));
                // The file states the number of all joints for a policy that moves a selection of them.
                let stated = if self.active.is_some() { n } else { acts };
                Term { stated, ..from("last_action", Vec::new(), acts) }
            }
            "phase_time" => from(&self.phase()?, Vec::new(), 1),
            "sin_phase" => from(&self.phase()?, vec![Op::Scale(Operand::Number(TAU)), Op::Sin], 1),
            "cos_phase" => from(&self.phase()?, vec![Op::Scale(Operand::Number(TAU)), Op::Cos], 1),
            "ref_motion_phase" => self.motion_phase()?,
            other => {
                // Only the application's code says what it is, so it is an input of its own name.
                self.facts.of_application(
                    &format!("raw.{other}"),
                    &format!("term {other:?} is not known to this reader; does the application compute it (true)?"),
                )?;
                self.raw(other, dim, "")
            }
        })
    }

    fn raw(&mut self, name: &str, len: usize, unit: &str) -> Term {
        self.parts.raw(name, len, unit);
        Term { from: name.to_owned(), ops: Vec::new(), len, stated: len }
    }

    fn gravity(&mut self) -> Result<Term> {
        let booster = self.yaml.maybe("SDK_TYPE", "a text", Node::text)? == Some("booster");
        let rule = if booster { "gravity.booster" } else { "gravity.unitree" };
        let (name, len, ops) = given_gravity(self.facts, rule, "wxyz", "base_quat")?;
        let raw = self.raw(name, len, "");
        self.facts.note(name, self.facts.source(rule));
        Ok(Term { ops, len: 3, stated: 3, ..raw })
    }

    /// Returns the value that is the phase of the gait, from 0 to 1; makes it first.
    fn phase(&mut self) -> Result<String> {
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
    fn motion_phase(&mut self) -> Result<Term> {
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

    /// Adds the target: the action, scaled, with what the upper body gets, relative to the default.
    fn act(&mut self) -> Result<()> {
        let (yaml, n) = (self.yaml, self.robot.len());
        let clip: f64 = self.facts.find("action.clip")?.unwrap_or(100.0);
        let number = Operand::Number;
        self.parts.value("clipped", "policy.ACTION", vec![Op::Clip([number(-clip), number(clip)])]);
        self.facts.note("clipped", self.facts.source("action.clip"));
        let scale: f64 = self.facts.get("action_scale")?;
        let scaled = || Op::Scale(number(scale));
        let acts = self.acts.unwrap_or(n);
        let mut source = self.facts.source("action_scale");
        let mut ops = Vec::new();
        let from = if let Some(active) = self.active.clone() {
            if active.len() != acts {
                return Err(self.wrong_action(acts, active.len(), "robot_dofs"));
            }
            let places = (0..n).map(|i| active.iter().position(|place| *place == i).unwrap_or(acts)).collect();
            self.with_zero("clipped");
            ops.extend([Op::Select(Order::Places(places)), scaled()]);
            "clipped_and_zero".to_owned()
        } else if acts == n {
            ops.push(scaled());
            let key = "residual_upper_body_action";
            if yaml.maybe(key, "True or False", Node::truth)?.unwrap_or(false) {
                self.residual()?;
                ops.push(Op::Add(Operand::Name("residual".to_owned())));
                source = format!("{source}; {}; {}", yaml.at(key), self.facts.source("residual"));
            }
            "clipped".to_owned()
        } else if acts < n {
            self.short(acts, scaled())?
        } else {
            return Err(self.wrong_action(acts, n, "DEFAULT_DOF_ANGLES"));
        };
        ops.push(Op::Add(Operand::Name("default".to_owned())));
        let limits = ["motor_pos_lower_limit_list", "motor_pos_upper_limit_list"];
        let lists = limits.map(|key| yaml.maybe(key, "a list of finite numbers", Node::numbers));
        let [low, high] = lists;
        if let (Some(low), Some(high)) = (low?, high?)
            && !low.is_empty()
            && !high.is_empty()
            && self.facts.find("target.clip")?.unwrap_or(true)
        {
            for (key, list) in limits.iter().zip([&low, &high]) {
                ensure!(list.len() == n, "{} has {} values, but there are {n} joints", yaml.at(key), list.len());
            }
            ops.push(Op::Clip([Operand::List(low), Operand::List(high)]));
            source = format!("{source}; {}", yaml.at(limits[0]));
        }
        self.parts.value("target", &from, ops);
        self.facts.note("target", source);
        if self.robot.by_name {
            self.parts.target_joints(TargetKind::Position, "target", "robot");
        } else {
            self.parts.target(TargetKind::Position, "target");
        }
        Ok(())
    }

    fn wrong_action(&self, acts: usize, expected: usize, key: &str) -> actq::error::Error {
        Facts::contradiction(
            "length of the action",
            (&self.acts_from, &format!("{acts} values")),
            (&self.yaml.at(key), &format!("{expected} joints")),
        )
    }

    /// Adds the value `NAME_and_zero`, which has one 0 after a value, for places that nothing moves.
    fn with_zero(&mut self, name: &str) {
        self.parts.unchanged("zero", vec![0.0]);
        self.parts.values(&format!("{name}_and_zero"), &[name, "zero"]);
    }

    /// Adds the reference of the upper body relative to the default, and 0 for the lower body.
    fn residual(&mut self) -> Result<()> {
        let (n, upper) = (self.robot.len(), self.robot.upper.clone());
        ensure!(
            !upper.is_empty(),
            "{}: residual_upper_body_action is True, but dof_names_upper_body is missing or empty",
            self.yaml.file
        );
        let added: bool = self.facts.find("residual")?.unwrap_or(true);
        let source = self.facts.source("residual");
        ensure!(added, "residual = false: set residual_upper_body_action in {} to False", self.yaml.file);
        self.parts.raw("ref_upper_dof_pos", upper.len(), "rad");
        let default = upper.iter().map(|place| self.robot.default[*place]).collect();
        self.parts.value("upper_residual", "ref_upper_dof_pos", vec![Op::Subtract(Operand::List(default))]);
        self.with_zero("upper_residual");
        let places = (0..n).map(|i| upper.iter().position(|place| *place == i).unwrap_or(upper.len())).collect();
        self.parts.value("residual", "upper_residual_and_zero", vec![Op::Select(Order::Places(places))]);
        for name in ["upper_residual", "upper_residual_and_zero", "residual"] {
            self.facts.note(name, source.clone());
        }
        Ok(())
    }

    /// Makes values for all joints of an action that has fewer; returns their name.
    fn short(&mut self, acts: usize, scaled: Op) -> Result<String> {
        let n = self.robot.len();
        self.parts.value("scaled", "clipped", vec![scaled]);
        match self.facts.find::<String>("target.short")?.as_deref() {
            Some("reference") | None => {
                let upper = self.robot.upper.len();
                if acts + upper != n {
                    let key = if self.yaml.look("dof_names_upper_body").is_some() {
                        "dof_names_upper_body"
                    } else {
                        "NUM_UPPER_BODY_JOINTS"
                    };
                    return Err(self.wrong_action(acts, n - upper, key));
                }
                self.parts.raw("ref_upper_dof_pos", upper, "rad");
                self.parts.values("all", &["scaled", "ref_upper_dof_pos"]);
                Ok("all".to_owned())
            }
            Some(fill @ ("zeros_first" | "zeros_last")) => {
                self.with_zero("scaled");
                let moved = if fill == "zeros_first" { n - acts..n } else { 0..acts };
                let places = (0..n).map(|i| if moved.contains(&i) { i - moved.start } else { acts }).collect();
                self.parts.value("all", "scaled_and_zero", vec![Op::Select(Order::Places(places))]);
                Ok("all".to_owned())
            }
            Some(other) => bail!("target.short = {other:?}: give \"reference\", \"zeros_first\" or \"zeros_last\""),
        }
    }

    fn gains(&mut self) -> Result<()> {
        let (yaml, n) = (self.yaml, self.robot.len());
        let list = |key: &str| yaml.maybe(key, "a list of finite numbers", Node::numbers);
        if let (Some(stiffness), Some(damping)) = (list("MOTOR_KP")?, list("MOTOR_KD")?) {
            for (key, list) in [("MOTOR_KP", &stiffness), ("MOTOR_KD", &damping)] {
                ensure!(list.len() == n, "{} has {} values, but there are {n} joints", yaml.at(key), list.len());
            }
            let joints = self.robot.by_name.then(|| "robot".to_owned());
            self.parts.gains(Gains { joints, stiffness, damping });
            self.facts.note("gains", yaml.at("MOTOR_KP"));
        }
        Ok(())
    }
}

/// Reads a number of values, joints or frames.
fn count(node: &Node) -> Option<usize> {
    whole(node).filter(|number| *number > 0)
}

fn whole(node: &Node) -> Option<usize> {
    let number = node.number()?;
    (number >= 0.0 && number.fract() == 0.0 && number < 1e4).then_some(number as usize)
}
