//! An image's sizes, names and places as source code, for applications that run it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use actq_deploy::description::Gains;
use actq_kernels::{Image, Port, PortKind};
use anyhow::{Result, bail};
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
///
/// # Errors
///
/// If two constants would have the same name, because the names of inputs, targets or joints differ only in characters
/// that an identifier cannot have, or in a suffix such as `_LEN`.
pub fn source(language: Language, image: &Image<'_>, prefix: &str, gains: Option<NamedGains<'_>>) -> Result<String> {
    let mut code = Code { language, prefix: identifier(prefix), names: BTreeMap::new(), text: String::new() };
    code.begin(image)?;
    let mut offsets = [0; 2];
    for port in image.ports() {
        let offset = &mut offsets[usize::from(port.kind != PortKind::Input)];
        code.port(&port, *offset)?;
        *offset += port.len;
    }
    if let Some((gains, joints)) = gains {
        code.gains(gains, joints)?;
    }
    Ok(code.end())
}

struct Code {
    language: Language,
    prefix: String,
    /// The names, and what each is the name of.
    names: BTreeMap<String, String>,
    text: String,
}

impl Code {
    fn begin(&mut self, image: &Image<'_>) -> Result<()> {
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
        // In C a word names the head.
        let scratch_words = image.scratch_words() + usize::from(self.language == Language::C);
        let crc = format!("{:#010x}", image.crc());
        for (name, about, of, value) in [
            ("IMAGE_BYTES", "Bytes of the image.", Type::Size, image.bytes().to_string()),
            ("IMAGE_CRC", "Checksum in the image's header (CRC-32).", Type::Word, crc),
            ("RATE_HZ", "Control steps a second.", Type::Float, float(f64::from(image.rate_hz()))),
            ("OBSERVATION_LEN", "Values of an observation.", Type::Size, image.obs_len().to_string()),
            ("ACTION_LEN", "Values of an action.", Type::Size, image.act_len().to_string()),
            ("SCRATCH_WORDS", "Words of scratch memory.", Type::Size, scratch_words.to_string()),
        ] {
            self.value(name, "the image", about, of, &value)?;
        }
        Ok(())
    }

    /// Adds a raw input, or a target, that begins at `offset` of the observation, or of the action.
    fn port(&mut self, port: &Port<'_>, offset: usize) -> Result<()> {
        let (what, vector) = match port.kind {
            PortKind::Input => ("Raw input", "observation"),
            PortKind::Position => ("Target positions", "action"),
            PortKind::Velocity => ("Target velocities", "action"),
            PortKind::Torque => ("Target torques", "action"),
            _ => ("Targets", "action"),
        };
        let (group, own) = match port.kind {
            PortKind::Input => ("INPUT", format!("input {}", quoted(port.name))),
            _ => ("TARGET", format!("target {}", quoted(port.name))),
        };
        let group = format!("{group}_{}", identifier(port.name));
        let about = format!("{what} {}: its place in the {vector}.", quoted(port.name));
        self.value(&group, &own, &about, Type::Size, &offset.to_string())?;
        let of = format!("the length of {own}");
        self.value(&format!("{group}_LEN"), &of, "Its number of values.", Type::Size, &port.len.to_string())?;
        let [low, high] = port.range;
        for (suffix, which, limit) in [("LOW", "lowest", low), ("HIGH", "highest", high)] {
            if limit.is_finite() {
                let (of, about) = (format!("the {which} value of {own}"), format!("Its {which} value."));
                self.value(&format!("{group}_{suffix}"), &of, &about, Type::Float, &float(f64::from(limit)))?;
            }
        }
        if port.names.is_empty() {
            return Ok(());
        }
        for (i, name) in port.names.split('\n').enumerate() {
            let (of, about) =
                (format!("value {} of {own}", quoted(name)), format!("Place of {} in the {vector}.", quoted(name)));
            let name = format!("{group}_{}", identifier(name));
            self.value(&name, &of, &about, Type::Size, &(offset + i).to_string())?;
        }
        Ok(())
    }

    fn gains(&mut self, gains: &Gains, joints: &[String]) -> Result<()> {
        let order = if joints.is_empty() { String::new() } else { format!(", in this order: {}", joints.join(", ")) };
        for (name, about, values) in
            [("STIFFNESS", "Stiffness", &gains.stiffness), ("DAMPING", "Damping", &gains.damping)]
        {
            let values: Vec<String> = values.iter().map(|value| float(*value)).collect();
            self.list(name, &format!("{about} of the joints{order}."), &values)?;
        }
        Ok(())
    }

    /// Adds a constant; `owner` is what it belongs to, for errors.
    fn value(&mut self, name: &str, owner: &str, about: &str, of: Type, value: &str) -> Result<()> {
        self.take(name, owner)?;
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
        Ok(())
    }

    fn list(&mut self, name: &str, about: &str, values: &[String]) -> Result<()> {
        self.take(name, "the gains")?;
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
        Ok(())
    }

    /// Takes a name; `of` is what it is the name of.
    fn take(&mut self, name: &str, of: &str) -> Result<()> {
        if let Some(other) = self.names.insert(name.to_owned(), of.to_owned()) {
            bail!("the constant {name} would be the name of {other} and of {of}; rename one of them in deploy.toml");
        }
        Ok(())
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
