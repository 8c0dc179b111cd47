//! An image's sizes, names and places as source code, for applications that run it.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use actq_deploy::description::Gains;
use actq_kernels::{Image, Port, PortKind};
use serde_json::Value;

/// Languages of the source code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// A module of Rust.
    Rust,
    /// A header of C99 and C++.
    C,
}

/// Gains of the joints, and the names of these.
pub type NamedGains<'a> = (&'a Gains, &'a [String]);

/// Returns the source code. Names of C begin with `prefix`, in capitals.
pub fn source(language: Language, image: &Image<'_>, prefix: &str, gains: Option<NamedGains<'_>>) -> String {
    let mut code = Code { language, prefix: identifier(prefix), names: BTreeSet::new(), text: String::new() };
    code.begin(image);
    let mut offsets = [0; 2];
    for port in image.ports() {
        let offset = &mut offsets[usize::from(port.kind != PortKind::Input)];
        code.port(&port, *offset);
        *offset += port.len;
    }
    if let Some((gains, joints)) = gains {
        code.gains(gains, joints);
    }
    code.end()
}

struct Code {
    language: Language,
    prefix: String,
    /// Names that are taken.
    names: BTreeSet<String>,
    text: String,
}

impl Code {
    fn begin(&mut self, image: &Image<'_>) {
        let about = format!("Constants of the image {}, made by actq. Do not edit.", quoted(image.name()));
        match self.language {
            Language::Rust => {
                let _ = writeln!(self.text, "//! {about}\n");
            }
            Language::C => {
                let prefix = &self.prefix;
                let about = comment(&about);
                let _ = writeln!(self.text, "/* {about} */\n#ifndef ACTQ_{prefix}_H\n#define ACTQ_{prefix}_H\n");
            }
        }
        self.value("IMAGE_BYTES", "Bytes of the image.", Type::Size, &image.bytes().to_string());
        self.value(
            "IMAGE_CRC",
            "Checksum in the image's header (CRC-32).",
            Type::Word,
            &format!("{:#010x}", image.crc()),
        );
        self.value("RATE_HZ", "Control steps a second.", Type::Float, &float(f64::from(image.rate_hz())));
        self.value("OBSERVATION_LEN", "Values of an observation.", Type::Size, &image.obs_len().to_string());
        self.value("ACTION_LEN", "Values of an action.", Type::Size, &image.act_len().to_string());
        self.value("SCRATCH_WORDS", "Words of scratch memory.", Type::Size, &image.scratch_words().to_string());
    }

    /// Adds a raw input, or a target, that begins at `offset` of the observation, or of the action.
    fn port(&mut self, port: &Port<'_>, offset: usize) {
        let (what, vector) = match port.kind {
            PortKind::Input => ("Raw input", "observation"),
            PortKind::Position => ("Target positions", "action"),
            PortKind::Velocity => ("Target velocities", "action"),
            PortKind::Torque => ("Target torques", "action"),
            _ => ("Targets", "action"),
        };
        let group =
            format!("{}_{}", if port.kind == PortKind::Input { "INPUT" } else { "TARGET" }, identifier(port.name));
        let about = format!("{what} {}: its place in the {vector}.", quoted(port.name));
        self.value(&group, &about, Type::Size, &offset.to_string());
        self.value(&format!("{group}_LEN"), "Its number of values.", Type::Size, &port.len.to_string());
        let [low, high] = port.range;
        if low.is_finite() {
            self.value(&format!("{group}_LOW"), "Its lowest value.", Type::Float, &float(f64::from(low)));
        }
        if high.is_finite() {
            self.value(&format!("{group}_HIGH"), "Its highest value.", Type::Float, &float(f64::from(high)));
        }
        if port.names.is_empty() {
            return;
        }
        for (i, name) in port.names.split('\n').enumerate() {
            let about = format!("Place of {} in the {vector}.", quoted(name));
            self.value(&format!("{group}_{}", identifier(name)), &about, Type::Size, &(offset + i).to_string());
        }
    }

    fn gains(&mut self, gains: &Gains, joints: &[String]) {
        let order = if joints.is_empty() { String::new() } else { format!(", in this order: {}", joints.join(", ")) };
        for (name, about, values) in
            [("STIFFNESS", "Stiffness", &gains.stiffness), ("DAMPING", "Damping", &gains.damping)]
        {
            let values: Vec<String> = values.iter().map(|value| float(*value)).collect();
            self.list(name, &format!("{about} of the joints{order}."), &values);
        }
    }

    fn value(&mut self, name: &str, about: &str, of: Type, value: &str) {
        let name = self.unique(name);
        let _ = match self.language {
            Language::Rust => {
                let of = match of {
                    Type::Size => "usize",
                    Type::Word => "u32",
                    Type::Float => "f32",
                };
                writeln!(self.text, "/// {about}\npub const {name}: {of} = {value};")
            }
            Language::C => {
                let ending = if of == Type::Float { "f" } else { "u" };
                writeln!(self.text, "/* {} */\n#define {}_{name} {value}{ending}", comment(about), self.prefix)
            }
        };
    }

    fn list(&mut self, name: &str, about: &str, values: &[String]) {
        let name = self.unique(name);
        let _ = match self.language {
            Language::Rust => {
                let (len, values) = (values.len(), values.join(", "));
                writeln!(self.text, "/// {about}\npub const {name}: [f32; {len}] = [{values}];")
            }
            // A macro for an initializer: a header defines no object.
            Language::C => {
                let values: Vec<String> = values.iter().map(|value| format!("{value}f")).collect();
                writeln!(
                    self.text,
                    "/* {} */\n#define {}_{name} {{{}}}",
                    comment(about),
                    self.prefix,
                    values.join(", ")
                )
            }
        };
    }

    /// Returns a name that nothing has: names that differ in other characters only may become equal.
    fn unique(&mut self, name: &str) -> String {
        let numbered = (2..).map(|i| format!("{name}_{i}"));
        let mut names = std::iter::once(name.to_owned()).chain(numbered);
        let name = names.find(|name| !self.names.contains(name)).unwrap_or_default();
        self.names.insert(name.clone());
        name
    }

    fn end(mut self) -> String {
        if self.language == Language::C {
            self.text += "\n#endif\n";
        }
        self.text
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Type {
    Size,
    Word,
    Float,
}

/// Returns a name in capitals, with an underscore for each character that no identifier has.
fn identifier(name: &str) -> String {
    let capital = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    let name: String = name.chars().map(capital).collect();
    if name.starts_with(|c: char| c.is_ascii_digit()) { format!("_{name}") } else { name }
}

/// Returns a number with a point or an exponent, as f32 literals of both languages have it.
fn float(value: f64) -> String {
    format!("{:?}", value as f32)
}

pub(super) fn quoted(name: &str) -> String {
    Value::from(name).to_string()
}

/// Returns a text that neither ends a comment of C nor begins another.
pub(super) fn comment(text: &str) -> String {
    text.replace("*/", "* /").replace("/*", "/ *")
}
