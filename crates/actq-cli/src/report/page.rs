//! The report as a page: one HTML file without a network, in which the image runs.
//!
//! The data is one JSON object ([`Page`]) in the file; the scripts in `page/`, joined, draw it from the top down.

pub mod facts;
pub mod parts;
pub mod runs;

use std::io::Write as _;

use actq::emit::Core;
use actq::measure::interval::wilson;
use actq::pipeline::driven::DriveOutcome;
use actq_jobs::results::MergedPolicy;
use anyhow::{Context as _, Result, ensure};
use base64ct::{Base64, Encoding as _};
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;

use super::notes::useless;
use facts::Facts;
use parts::Part;
use runs::{HeadData, Runs};

/// The data of a page.
#[derive(Debug, Serialize)]
pub struct Page {
    /// The image's properties.
    pub facts: Facts,
    /// Reasons not to drive a robot with the image.
    pub warnings: Vec<String>,
    /// `true` if the policy was given that the image was made from.
    pub has_policy: bool,
    /// Error on the image's own path (NMSE), and its observations.
    pub own_path: Option<(f64, usize)>,
    /// Success of the image's rollouts, if it was reported.
    pub success: Option<Success>,
    /// The sweep that the image is of.
    pub sweep: Option<Sweep>,
    /// Actions of the image and of the f32 policy on recordings.
    pub runs: Option<Runs>,
    /// The image, to run in the page.
    pub head: HeadData,
    /// Parts that the reader chooses from.
    pub parts: &'static [Part],
}

/// Images of the policy at several budgets.
#[derive(Debug, Serialize)]
pub struct Sweep {
    /// Clock of the predicted times in Hz.
    pub clock_hz: f64,
    /// All images.
    pub images: Vec<SweptImage>,
    /// The page's image, if it is none of the sweep's, and its error is known.
    pub outside: Option<SweptImage>,
}

/// An image of a sweep.
#[derive(Debug, Serialize)]
pub struct SweptImage {
    /// Name of its curve: method, seed, round.
    pub curve: String,
    /// Bytes.
    pub bytes: usize,
    /// Predicted milliseconds of a step.
    pub milliseconds: f64,
    /// Error on the held-out recording (NMSE).
    pub nmse: f64,
    /// Success of its rollouts.
    pub success: Option<Success>,
    /// `true` for the image of the page.
    pub is_own: bool,
}

/// Share of successful episodes, their number, and the 95% interval of the share.
pub type Success = (f64, u64, [f64; 2]);

/// Reads the success that a robot or simulator reported of an image's rollouts: its last line that is a JSON object.
///
/// # Errors
///
/// If no object has `success` and `episodes` in range.
pub fn success_of(text: &str) -> Result<Success> {
    let outcome = text.lines().rev().find_map(|line| DriveOutcome::parse(line.trim()));
    let reported =
        outcome.as_ref().and_then(|outcome| Some((outcome, outcome.success()?, outcome.number("episodes")?)));
    let (outcome, share, episodes) =
        reported.context("it has no line of JSON with \"success\", a share, and \"episodes\", their number")?;
    ensure!(
        (0.0..=1.0).contains(&share) && episodes >= 1.0 && episodes.fract() == 0.0,
        "success {share} of {episodes} episodes: give a share of 0 to 1 and a whole number"
    );
    Ok((share, episodes as u64, outcome.interval().unwrap_or_else(|| wilson(share * episodes, episodes))))
}

impl Page {
    /// Adds the sweep that the image is of, and takes its success from there. An image that the sweep does not have is
    /// added by its own figures.
    pub fn add(&mut self, mut sweep: Sweep) {
        if let Some(own) = sweep.own() {
            self.success = sweep.images.iter().filter(|image| image.is_own).find_map(|image| image.success);
            if self.runs.is_none() {
                self.warnings.extend(useless(own.nmse));
            }
        } else if let Some((nmse, _)) = self.runs.as_ref().and_then(|runs| runs.nmse) {
            let cycles = self.facts.cores.get(Core::M4f.name()).map_or(0, |core| core.cycles);
            sweep.outside = Some(SweptImage {
                curve: "this image".to_owned(),
                bytes: self.facts.bytes,
                milliseconds: 1e3 * cycles as f64 / sweep.clock_hz,
                nmse,
                success: None,
                is_own: true,
            });
        }
        self.sweep = Some(sweep);
    }
}

impl Sweep {
    /// Takes the images of a policy, with times at a clock; `sha256` is the digest of the page's image.
    pub fn new(policy: &MergedPolicy, clock_hz: f64, sha256: &str) -> Self {
        let image = |image: &actq_jobs::results::MergedImage| {
            let made = image.made.as_ref()?;
            let episodes = made.driven.as_ref().map(|driven| driven.episodes);
            let success = made.success().zip(episodes).zip(made.interval);
            Some(SweptImage {
                curve: policy.curve(image),
                bytes: made.image.bytes,
                milliseconds: made.milliseconds(clock_hz),
                nmse: made.nmse,
                success: success.map(|((share, episodes), interval)| (share, episodes, interval)),
                is_own: made.image.image == sha256,
            })
        };
        Self { clock_hz, images: policy.images.iter().filter_map(image).collect(), outside: None }
    }

    /// Returns the page's image.
    pub fn own(&self) -> Option<&SweptImage> {
        self.images.iter().find(|image| image.is_own)
    }
}

const HTML: &str = include_str!("page/page.html");
/// The style of the page.
pub const CSS: &str = include_str!("page/page.css");
const SCRIPT: &str = concat!(
    include_str!("page/elements.js"),
    include_str!("page/top.js"),
    include_str!("page/charts.js"),
    include_str!("page/network.js"),
    include_str!("page/errors.js"),
    include_str!("page/live.js"),
    include_str!("page/flash.js"),
    include_str!("page/diagram.js"),
    include_str!("page/contract.js"),
);
/// Functions that read the data of a page.
pub const UNPACK: &str = include_str!("page/unpack.js");

/// Formats the file.
///
/// # Errors
///
/// If a number cannot be formatted.
pub fn html(page: &Page) -> Result<String> {
    let data = script_safe(&serde_json::to_string(page)?);
    let parts = [
        ("TITLE", escaped(&page.facts.name)),
        ("CSS", CSS.to_owned()),
        ("DATA", data),
        ("MODULE", Base64::encode_string(actq_wasm::MODULE)),
        ("FACE", actq_wasm::FACE.to_owned()),
        ("UNPACK", UNPACK.to_owned()),
        ("SCRIPT", SCRIPT.to_owned()),
    ];
    Ok(filled(HTML, &parts))
}

/// Returns the bytes of a page without its data.
#[cfg(test)]
fn code_bytes() -> usize {
    [HTML, CSS, SCRIPT, UNPACK, actq_wasm::FACE].map(str::len).iter().sum::<usize>()
        + Base64::encode_string(actq_wasm::MODULE).len()
}

/// Replaces each `{{NAME}}` of a template, once: values are not searched.
pub fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        text += before;
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        text += parts.iter().find(|(part, _)| *part == name).map_or("", |(_, value)| value);
        rest = after;
    }
    text + rest
}

/// Escapes text for HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Escapes JSON for a script element, which `</script` would end.
fn script_safe(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// Encodes bytes for the page.
pub fn encoded(bytes: &[u8]) -> String {
    Base64::encode_string(bytes)
}

/// Compresses bytes, and encodes them for the page.
///
/// # Errors
///
/// If the compressor fails, which it does not in memory.
pub fn packed(bytes: &[u8]) -> Result<String> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(bytes)?;
    Ok(encoded(&gzip.finish()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_a_template_are_not_searched() {
        let parts = [("A", "{{B}}".to_owned()), ("B", "b".to_owned())];
        assert_eq!(filled("<{{A}}|{{B}}|{{C}}>", &parts), "<{{B}}|b|>");
    }

    #[test]
    fn success_is_read_from_the_last_object() {
        let text =
            "begins\n{\"success\": 0.1, \"episodes\": 2}\n{\"success\": 0.5, \"episodes\": 4, \"ci\": [0.2, 0.8]}\n";
        assert_eq!(success_of(text).expect("an outcome"), (0.5, 4, [0.2, 0.8]));
        let (share, episodes, [low, high]) = success_of("{\"success\": 1, \"episodes\": 10}").expect("an outcome");
        assert!(share == 1.0 && episodes == 10 && (0.69..0.75).contains(&low) && high == 1.0, "{low} to {high}");
        for text in [
            "",
            "3 of 4",
            "{\"success\": 1}",
            "{\"success\": 1.5, \"episodes\": 2}",
            "{\"success\": 1, \"episodes\": 0}",
        ] {
            assert!(success_of(text).is_err(), "{text}");
        }
    }

    #[test]
    fn markup_does_not_leave_its_element() {
        let name = "</script><img src=x onerror=alert(1)>";
        assert!(!script_safe(&serde_json::to_string(name).expect("JSON")).contains('<'));
        assert_eq!(escaped("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
    }
}
