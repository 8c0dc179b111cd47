//! Choices that ActQuant's paper and code leave open, or that this project makes differently, with the authors' choice
//! for each.
//!
//! `research/README.md` has the sources and the reasons.

use std::fmt;
use std::str::FromStr;

use actq_kernels::layout::Width;

use super::fisher::Sampling;
use super::hsic::Bandwidth;
use super::loss::Signs;

/// Definition of a matrix's score.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScoreOf {
    /// Gain of the matrix: `F(output) - F(input)`.
    Gain,
    /// Only `F(output)`.
    Output,
}

/// Bits of a format in its assumed error `2^(-2 bits)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseBits {
    /// Bits of a code.
    Codes,
    /// All bits per weight of the matrix in the format, scales and padding counted.
    Format,
}

/// Choices of ActQuant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choices {
    /// Bandwidth of the Gaussian kernels.
    pub bandwidth: Bandwidth,
    /// Most frames for HSIC, evenly spaced.
    pub frames: usize,
    /// Definition of the score.
    pub score: ScoreOf,
    /// Definition of a format's error in the allocation.
    pub noise: NoiseBits,
    /// Widest codes of the allocation.
    pub widest: Width,
    /// Width of the matrices that give the action; the allocation leaves them unchanged.
    pub head: Option<Width>,
    /// Sampling of the Fisher information.
    pub fisher: Sampling,
    /// `true` if fits of scales multiply the importance by `sqrt(mean of the row's w^2 + w^2)`, as in llama.cpp.
    pub magnitude: bool,
}

/// The choices of this project.
impl Default for Choices {
    fn default() -> Self {
        Self {
            bandwidth: Bandwidth::Median,
            frames: 512,
            score: ScoreOf::Gain,
            noise: NoiseBits::Codes,
            widest: Width::W8,
            head: None,
            fisher: Sampling { samples: 4096, batch: 1, signs: Signs::Random, alpha: 1.0 },
            magnitude: false,
        }
    }
}

/// Value that represents no limit.
const ALL: usize = usize::MAX;

impl Choices {
    /// The authors' choices, as far as the image format supports them.
    pub const AUTHORS: Self = Self {
        bandwidth: Bandwidth::SquaredMedian,
        frames: ALL,
        score: ScoreOf::Gain,
        noise: NoiseBits::Format,
        widest: Width::W4,
        head: Some(Width::W8),
        fisher: Sampling { samples: ALL, batch: 8, signs: Signs::Loss, alpha: 1.0 },
        magnitude: true,
    };

    /// Returns the default choices with alpha 0.5 in the loss.
    pub fn half() -> Self {
        let plain = Self::default();
        Self { fisher: Sampling { alpha: 0.5, ..plain.fisher }, ..plain }
    }

    /// Returns every choice as key and value, in the order of the documentation.
    fn pairs(&self) -> [(&'static str, String); 11] {
        let number = |n: usize| if n == ALL { "all".to_owned() } else { n.to_string() };
        let bits = |width: Width| width.bits().to_string();
        let word = str::to_owned;
        [
            ("bandwidth", word(if self.bandwidth == Bandwidth::Median { "median" } else { "squared" })),
            ("frames", number(self.frames)),
            ("score", word(if self.score == ScoreOf::Gain { "gain" } else { "output" })),
            ("noise", word(if self.noise == NoiseBits::Codes { "codes" } else { "format" })),
            ("widest", bits(self.widest)),
            ("head", self.head.map_or(word("free"), bits)),
            ("samples", number(self.fisher.samples)),
            ("batch", self.fisher.batch.to_string()),
            ("signs", word(if self.fisher.signs == Signs::Random { "random" } else { "loss" })),
            ("alpha", self.fisher.alpha.to_string()),
            ("magnitude", word(if self.magnitude { "yes" } else { "no" })),
        ]
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        let wrong = |allowed: &str| format!("{key}={value}: {key} takes {allowed}");
        let number = |least: usize| match value {
            "all" => Ok(ALL),
            _ => value.parse().ok().filter(|n| *n >= least).ok_or(wrong(&format!("a number from {least}, or all"))),
        };
        let width = || value.parse().ok().and_then(Width::from_bits);
        match (key, value) {
            ("bandwidth", "median") => self.bandwidth = Bandwidth::Median,
            ("bandwidth", "squared") => self.bandwidth = Bandwidth::SquaredMedian,
            ("bandwidth", _) => return Err(wrong("median or squared")),
            ("frames", _) => self.frames = number(2)?,
            ("score", "gain") => self.score = ScoreOf::Gain,
            ("score", "output") => self.score = ScoreOf::Output,
            ("score", _) => return Err(wrong("gain or output")),
            ("noise", "codes") => self.noise = NoiseBits::Codes,
            ("noise", "format") => self.noise = NoiseBits::Format,
            ("noise", _) => return Err(wrong("codes or format")),
            ("widest", _) => self.widest = width().ok_or(wrong("2, 3, 4 or 8"))?,
            ("head", "free") => self.head = None,
            ("head", _) => self.head = Some(width().ok_or(wrong("2, 3, 4 or 8, or free"))?),
            ("samples", _) => self.fisher.samples = number(1)?,
            ("batch", _) => {
                let batch = value.parse().ok().filter(|n| (1..=MAX_BATCH).contains(n));
                self.fisher.batch = batch.ok_or(wrong(&format!("1 to {MAX_BATCH}")))?;
            }
            ("signs", "random") => self.fisher.signs = Signs::Random,
            ("signs", "loss") => self.fisher.signs = Signs::Loss,
            ("signs", _) => return Err(wrong("random or loss")),
            ("alpha", _) => {
                let alpha = value.parse().ok().filter(|alpha| (0.0..=1.0).contains(alpha));
                self.fisher.alpha = alpha.ok_or(wrong("a number from 0 to 1"))?;
            }
            ("magnitude", "no") => self.magnitude = false,
            ("magnitude", "yes") => self.magnitude = true,
            ("magnitude", _) => return Err(wrong("yes or no")),
            _ => {
                let keys = self.pairs().map(|(key, _)| key).join(", ");
                return Err(format!("{key} is not a key; the keys are {keys}"));
            }
        }
        Ok(())
    }
}

/// Most frames whose gradients are averaged before they are squared.
const MAX_BATCH: usize = 1024;

/// Parses `KEY=VALUE,KEY=VALUE`; in the first place, `authors` selects all of the authors' choices.
impl FromStr for Choices {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut choices = Self::default();
        let mut seen: Vec<&str> = Vec::new();
        for (at, part) in text.split(',').enumerate() {
            if at == 0 && part == "authors" {
                choices = Self::AUTHORS;
                continue;
            }
            let form = || format!("{part:?}: use KEY=VALUE, or authors in the first place");
            let (key, value) = part.split_once('=').ok_or_else(form)?;
            if seen.contains(&key) {
                return Err(format!("{key} occurs twice"));
            }
            seen.push(key);
            choices.set(key, value)?;
        }
        Ok(choices)
    }
}

/// Formats the choices for [`FromStr`]: the differences from the defaults, or from the authors' choices if these are
/// fewer; nothing for the defaults.
impl fmt::Display for Choices {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let differing = |from: &Self| -> Vec<String> {
            let pairs = self.pairs().into_iter().zip(from.pairs()).filter(|(own, other)| own != other);
            pairs.map(|((key, value), _)| format!("{key}={value}")).collect()
        };
        let (plain, mut authors) = (differing(&Self::default()), differing(&Self::AUTHORS));
        authors.insert(0, "authors".to_owned());
        f.write_str(&if authors.len() <= plain.len() { authors } else { plain }.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_parse_as_formatted() {
        let fisher = Sampling { alpha: 0.5, ..Choices::AUTHORS.fisher };
        let other = Choices { score: ScoreOf::Output, fisher, ..Choices::AUTHORS };
        for (from, to) in [(Choices::default(), other), (other, Choices::default())] {
            for (key, value) in to.pairs() {
                let mut one = from;
                one.set(key, &value).expect(key);
                assert_eq!(one.to_string().parse(), Ok(one), "{key}={value}");
                let at = |c: &Choices| c.pairs().into_iter().find(|(k, _)| *k == key);
                assert_eq!(at(&one), at(&to));
            }
        }
        assert_eq!(Choices::default().to_string(), "");
        assert_eq!(Choices::AUTHORS.to_string(), "authors");
        assert_eq!("authors,head=free".parse::<Choices>().map(|c| c.to_string()), Ok("authors,head=free".into()));
        assert_eq!("alpha=0.5".parse::<Choices>().map(|c| c.to_string()), Ok("alpha=0.5".into()));
        assert_eq!("head=4,frames=all".parse::<Choices>().map(|c| c.to_string()), Ok("frames=all,head=4".into()));
    }

    #[test]
    fn unknown_choices_are_named() {
        for (text, words) in [
            ("", "KEY=VALUE"),
            ("frames", "KEY=VALUE"),
            ("head=8,authors", "first place"),
            ("heads=8", "the keys are bandwidth, frames, score"),
            ("head=8,head=4", "head occurs twice"),
            ("head=5", "2, 3, 4 or 8, or free"),
            ("frames=1", "a number from 2, or all"),
            ("batch=0", "1 to 1024"),
            ("batch=all", "1 to 1024"),
            ("bandwidth=", "median or squared"),
            ("alpha=1.5", "a number from 0 to 1"),
        ] {
            let error = text.parse::<Choices>().expect_err(text);
            assert!(error.contains(words), "{text:?}: {error}");
        }
    }
}
