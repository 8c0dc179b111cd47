//! Stacks whose profile describes them: terms in order, scale, clip, history and joints as data.

mod action;
mod observation;
mod schema;
mod values;

use actq::error::{Context as _, Result, bail, ensure};
use actq_onnx::Signature;

use self::observation::Ports;
pub(crate) use self::schema::Schema;
use self::schema::{Rate, Source};
use self::values::Values;
use super::common::{Parts, counts};
use crate::bundle::Bundle;
use crate::description::{Description, Order};
use crate::document::Document;
use crate::facts::{Facts, Profile};
use crate::family::{Family, Recognized};
use crate::yaml::{Data, Node};

/// Reader of the stack that a profile describes.
#[derive(Debug)]
pub(crate) struct Stack<'a>(pub(crate) &'a str);

impl Family for Stack<'_> {
    fn profile(&self) -> &str {
        self.0
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let (profile, schema) = parse(self.0)?;
        match &schema.file {
            Some(file) => of_file(bundle, &profile, &schema, file),
            None => of_metadata(bundle, &profile),
        }
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let (profile, schema) = parse(self.0)?;
        let (document, file) = (&found.documents[0], &found.networks[0]);
        let signature = bundle.signature(file)?;
        let ports = Ports::of(file, &signature, &schema)?;
        let mut values = Values { document, facts };
        let (rate, at) = rate(&schema.rate, &mut values)?;
        let mut parts = Parts::new("policy", rate);
        values.facts.note("rate_hz", at);
        let robot = Robot::read(&schema, &ports, &mut parts, &mut values)?;
        let mut reader = Reader {
            family: &profile.family,
            schema: &schema,
            rate,
            robot,
            action_len: ports.action_len.unwrap_or(0),
            clock: None,
            parts,
            values,
        };
        if reader.action_len == 0 {
            reader.action_len = reader.robot.len;
        }
        reader.check_action(&ports)?;
        reader.observe(&ports)?;
        reader.parts.network(file, &ports.input, &ports.output);
        reader.act()?;
        reader.gains()?;
        Ok(reader.parts.finish())
    }
}

fn parse(text: &str) -> Result<(Profile, Schema)> {
    let profile = Profile::parse(text)?;
    let schema = profile.stack.clone();
    let schema = schema.with_context(|| format!("profile {}: it has no [stack] table", profile.family))?;
    Ok((profile, schema))
}

/// Finds the file of a name with the profile's keys.
fn of_file(bundle: &Bundle, profile: &Profile, schema: &Schema, file: &str) -> Result<Option<Recognized>> {
    let Some(file) = bundle.find(file)? else { return Ok(None) };
    let root = bundle.text(file).and_then(|text| Node::parse(&text).context(file.to_owned()))?;
    let document = Document::of(file, root.numbered());
    let keys = profile.marks.first().map_or(&[][..], |mark| &mark.keys);
    let missing: Vec<&String> = keys.iter().filter(|key| !document.has(key)).collect();
    match missing[..] {
        [] => {}
        [key] if keys.len() > 2 => {
            bail!("{}: it looks like a file of {}, and this key is missing", document.location(key), profile.family)
        }
        _ => return Ok(None),
    }
    let network = match &schema.network {
        Some(name) => bundle.find(name)?.with_context(|| format!("{file}: there is no {name} with it"))?,
        None => match bundle.with_ending("onnx").collect::<Vec<_>>()[..] {
            [only] => only,
            [] => bail!("{file}: there is no ONNX file with it"),
            _ => bail!("{file}: there are several ONNX files with it; name the folder of one policy"),
        },
    };
    Ok(Some(Recognized { documents: vec![document], networks: vec![network.to_owned()], others: Vec::new() }))
}

/// Finds the ONNX file whose metadata have the profile's keys.
fn of_metadata(bundle: &Bundle, profile: &Profile) -> Result<Option<Recognized>> {
    let (mut networks, mut documents) = (Vec::new(), Vec::new());
    for file in bundle.with_ending("onnx") {
        // A file that is not ONNX decides nothing.
        let Ok(Signature { metadata, .. }) = bundle.signature(file) else { continue };
        if profile.marks.iter().any(|mark| mark.keys.iter().all(|key| metadata.contains_key(key))) {
            // Texts are JSON and so YAML. What cannot be parsed stays a text.
            let entry = |(key, text): (String, String)| {
                let node = Node::parse(&text).map(Node::numbered);
                (key, node.unwrap_or(Node { line: 1, data: Data::Scalar(text, true) }))
            };
            let data = Data::Map(metadata.into_iter().map(entry).collect());
            networks.push(file.to_owned());
            documents.push(Document::of(&format!("{file} metadata"), Node { line: 1, data }));
        }
    }
    ensure!(networks.len() <= 1, "several files are policies: {}; name one of them", networks.join(", "));
    Ok((!networks.is_empty()).then(|| Recognized { documents, networks, others: Vec::new() }))
}

/// Returns the ticks per second, and where they are from.
fn rate(rate: &Rate, values: &mut Values<'_>) -> Result<(f64, String)> {
    let mut positive = |source: &Source| values.positive(source);
    Ok(match rate {
        Rate::Hz(source) => positive(source)?,
        Rate::Period(source) => {
            let (period, at) = positive(source)?;
            (1.0 / period, at)
        }
        Rate::Steps([step, steps]) => {
            let ((step, at), (steps, other)) = (positive(step)?, positive(steps)?);
            (1.0 / (step * steps), format!("1 / ({at} * {other})"))
        }
    })
}

/// A description under construction.
struct Reader<'a> {
    family: &'a str,
    schema: &'a Schema,
    rate: f64,
    robot: Robot,
    action_len: usize,
    /// Number of the clock's phases, once it is there.
    clock: Option<usize>,
    parts: Parts,
    values: Values<'a>,
}

/// The joints.
struct Robot {
    /// Number of joints of the policy.
    len: usize,
    is_named: bool,
    /// Raw value of each joint of the policy, if they are in another order.
    map: Option<Vec<usize>>,
    /// Key that states the number of joints.
    at: String,
}

impl Robot {
    fn read(schema: &Schema, ports: &Ports, parts: &mut Parts, values: &mut Values<'_>) -> Result<Self> {
        let document = values.document;
        let keys = &schema.joints;
        let names =
            keys.names.as_ref().map(|key| Ok::<_, actq::error::Error>((key, document.texts(key)?))).transpose()?;
        if let Some((key, names)) = &names {
            let at = document.location(key);
            ensure!(!names.is_empty(), "{at} is empty");
            ensure!(names.iter().enumerate().all(|(i, name)| !names[..i].contains(name)), "{at}: a name occurs twice");
        }
        let map = keys.map.as_ref().map(|key| {
            let map = document.required(key, "a list of places, from 0", counts)?;
            let at = document.location(key);
            let mut sorted = map.clone();
            sorted.sort_unstable();
            sorted.dedup();
            ensure!(sorted.len() == map.len(), "{at}: a place occurs twice");
            let count = sorted.last().map_or(0, |last| last + 1);
            ensure!(
                count == map.len(),
                "{at}: it has {} joints of {count}, and a target of some is not supported",
                map.len()
            );
            Ok(map)
        });
        let map = map.transpose()?;
        let stated = names.as_ref().map(|(key, names)| (*key, names.len()));
        let stated = stated.or(keys.map.as_ref().zip(map.as_ref().map(Vec::len)));
        let (default, default_at) = match values.list(&keys.default, "")? {
            Some(default) => default,
            None => (
                vec![0.0; stated.or(ports.action_len.map(|len| (&ports.output, len))).map_or(1, |(_, len)| len)],
                "a question".to_owned(),
            ),
        };
        let (len, at) = stated.map_or((default.len(), default_at.clone()), |(key, len)| (len, document.location(key)));
        ensure!(default.len() == len, "default ({default_at}) has {} values, but {at} has {len}", default.len());
        values.facts.note("default", default_at);
        parts.constant("default", default);
        let is_named = names.is_some();
        if let Some((key, names)) = names {
            values.facts.note("joints.robot", document.location(key));
            parts.joints("robot", names);
        }
        if let Some(key) = &keys.map {
            values.facts.note("joint order", document.location(key));
        }
        Ok(Self { len, is_named, map, at })
    }

    fn order(&self) -> Option<Order> {
        self.map.clone().map(Order::Places)
    }
}
