//! Facts about a bundle, each with its source. A fact without a source becomes a question.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::text::printable;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::document::Document;
use crate::families::Schema;
use crate::yaml::Node;

/// Most places of a key that a question lists.
const MAX_PLACES: usize = 3;

/// Fixed rules of a family, as data: its file is a `profile.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Profile {
    /// Name of the family.
    pub family: String,
    /// Repository that the rules were read from; may be omitted for one's own.
    #[serde(default)]
    pub upstream: String,
    /// Its commit.
    #[serde(default)]
    pub commit: String,
    /// Releases that the rules and keys were read in.
    #[serde(default)]
    pub versions: Vec<String>,
    /// Key of the files that states their version, and its values that were read.
    #[serde(default)]
    pub format: Option<Format>,
    /// Keys by which the family's files are told, a list for each kind of file.
    #[serde(default, rename = "mark")]
    pub marks: Vec<Mark>,
    /// Keys of the family's files that no deployment reads, with `*` for any text within a part of a path. Any other one
    /// that nothing reads is a question.
    #[serde(default)]
    pub ignored: Vec<String>,
    /// The rules.
    #[serde(default, rename = "rule")]
    pub rules: Vec<Rule>,
    /// The stack, if its reader is data.
    #[serde(default)]
    pub stack: Option<Schema>,
}

/// Versions of a family's files.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Format {
    pub key: String,
    pub read: Vec<String>,
}

/// Keys that a file of a family has.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mark {
    /// Ending of the file's name: "onnx" for its metadata, "yaml" or "json".
    pub ending: String,
    pub keys: Vec<String>,
}

/// A fact that no file of a bundle states.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Rule {
    /// Key of the answer.
    pub key: String,
    /// Text of the question.
    pub meaning: String,
    /// The family's value; none if it differs between the family's policies.
    pub value: Option<toml::Value>,
    /// Texts that an answer may be; empty for any.
    #[serde(default)]
    pub choices: Vec<String>,
    /// File and lines of the repository that have it.
    #[serde(default)]
    pub from: String,
}

impl Profile {
    /// Parses a profile.
    ///
    /// # Errors
    ///
    /// If it is not one.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        toml::from_str(text).map_err(|error| Error::input(error.to_string()))
    }
}

/// The user's answers, by key.
#[derive(Clone, Debug, Default)]
pub struct Answers(BTreeMap<String, toml::Value>);

impl Answers {
    pub(crate) fn keys(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Parses a TOML file; tables in it are parts of the keys.
    ///
    /// # Errors
    ///
    /// If it is not TOML.
    pub fn parse(text: &str) -> Result<Self> {
        let table: toml::Table = toml::from_str(text).map_err(|error| Error::input(error.to_string()))?;
        let mut answers = Self::default();
        answers.add(String::new(), table);
        Ok(answers)
    }

    /// Answers a question by what a person typed: a TOML value, or a text without its quotes. An empty line accepts
    /// what the profile says.
    ///
    /// # Errors
    ///
    /// If the line is empty and the profile says nothing, or if it begins as a TOML value and is none.
    pub fn set(&mut self, question: &Question, line: &str) -> Result<()> {
        let line = match (line.trim(), &question.profile) {
            ("", Some((value, _))) => value,
            ("", None) => bail!("{}: give a value", question.key),
            (line, _) => line,
        };
        let value = match toml::from_str::<toml::Table>(&format!("value = {line}")) {
            Ok(mut table) if table.len() == 1 => table.remove("value"),
            _ if line.starts_with(['[', '{', '"', '\'']) => None,
            _ => Some(toml::Value::String(line.to_owned())),
        };
        let value = value.with_context(|| format!("{}: {line:?} is not a TOML value", question.key))?;
        self.0.insert(question.key.clone(), value);
        Ok(())
    }

    fn add(&mut self, prefix: String, table: toml::Table) {
        for (key, value) in table {
            let key = if prefix.is_empty() { key } else { format!("{prefix}.{key}") };
            match value {
                toml::Value::Table(inner) => self.add(key, inner),
                other => drop(self.0.insert(key, other)),
            }
        }
    }
}

impl fmt::Display for Answers {
    /// Writes them as [`Answers::parse`] reads them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|(key, value)| writeln!(f, "{key} = {value}"))
    }
}

/// A question that nothing answers.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// Key of the answer.
    pub key: String,
    /// Text of the question.
    pub meaning: String,
    /// Value of the family's profile, and its source.
    pub profile: Option<(String, String)>,
}

/// Facts about a bundle.
#[derive(Debug)]
pub(crate) struct Facts {
    profile: Profile,
    accepted: bool,
    answers: Answers,
    used: BTreeSet<String>,
    questions: Vec<Question>,
    sources: BTreeMap<String, String>,
}

impl Facts {
    /// Starts with a profile, whether the user accepts its values, and the user's answers.
    pub(crate) fn new(profile: Profile, accepted: bool, answers: Answers) -> Self {
        Self { profile, accepted, answers, used: BTreeSet::new(), questions: Vec::new(), sources: BTreeMap::new() }
    }

    /// Returns the answer, else the accepted profile value. While the question is open, returns a placeholder.
    ///
    /// # Errors
    ///
    /// If the answer has another type, or the profile has no such rule.
    pub(crate) fn value_or_default<T: DeserializeOwned + Default>(&mut self, key: &str) -> Result<T> {
        Ok(self.value(key)?.unwrap_or_default())
    }

    /// As [`Self::value_or_default`], but `None` while it is a question.
    ///
    /// # Errors
    ///
    /// As [`Self::value_or_default`].
    pub(crate) fn value<T: DeserializeOwned>(&mut self, key: &str) -> Result<Option<T>> {
        let rule = self.profile.rules.iter().find(|rule| rule.key == key);
        let rule = rule.with_context(|| format!("profile {}: there is no rule {key}", self.profile.family))?.clone();
        if let Some(answer) = self.answers.0.get(key) {
            self.used.insert(key.to_owned());
            self.sources.insert(key.to_owned(), "answers".to_owned());
            let is_choice =
                rule.choices.is_empty() || rule.choices.iter().any(|choice| answer.as_str() == Some(choice));
            ensure!(
                is_choice,
                "answer {key} = {}: give one of {}",
                printable(&answer.to_string()),
                rule.choices.join(", ")
            );
            return read(answer, &format!("answer {key}")).map(Some);
        }
        match (&rule.value, self.accepted) {
            (Some(value), true) => {
                self.sources.insert(key.to_owned(), self.of_profile(&rule));
                read(value, &format!("profile {}: {key}", self.profile.family)).map(Some)
            }
            _ => {
                let profile = rule.value.as_ref().map(|value| (value.to_string(), self.of_profile(&rule)));
                self.ask(Question { key: key.to_owned(), meaning: rule.meaning, profile });
                Ok(None)
            }
        }
    }

    /// Returns the profile's value of a rule, which stands for the answer while the rule is a question.
    pub(crate) fn suggested<T: DeserializeOwned>(&self, key: &str) -> Option<T> {
        self.profile.rules.iter().find(|rule| rule.key == key)?.value.clone()?.try_into().ok()
    }

    /// Returns `true` if a rule with choices has this one; `false` while it is a question.
    ///
    /// # Errors
    ///
    /// As [`Self::value_or_default`].
    pub(crate) fn is_choice(&mut self, key: &str, choice: &str) -> Result<bool> {
        Ok(self.value::<String>(key)?.as_deref() == Some(choice))
    }

    /// As [`Self::is_choice`], for a bundle of which the profile does not know: its value is no answer.
    ///
    /// # Errors
    ///
    /// As [`Self::value_or_default`].
    pub(crate) fn is_answered(&mut self, key: &str, choice: &str) -> Result<bool> {
        if self.answers.0.contains_key(key) {
            return self.is_choice(key, choice);
        }
        let rule = self.profile.rules.iter().find(|rule| rule.key == key);
        let rule = rule.with_context(|| format!("profile {}: there is no rule {key}", self.profile.family))?;
        self.ask(Question { key: key.to_owned(), meaning: rule.meaning.clone(), profile: None });
        Ok(false)
    }

    /// Returns a number above 0 by its rule; 1 while it is a question.
    ///
    /// # Errors
    ///
    /// As [`Self::value_or_default`], or if it is another number.
    pub(crate) fn positive(&mut self, key: &str) -> Result<f64> {
        let number = self.value(key)?.unwrap_or(1.0);
        ensure!(number > 0.0, "{key} = {number}: give a number above 0");
        Ok(number)
    }

    /// Returns one of `choices`, by the rule `key`; the first while it is a question.
    ///
    /// # Errors
    ///
    /// As [`Self::value_or_default`], or if there is none of this name.
    pub(crate) fn choose_one_of(&mut self, key: &str, choices: &[&str]) -> Result<String> {
        let name = self.value(key)?.or_else(|| choices.first().map(|&name| name.to_owned())).unwrap_or_default();
        ensure!(choices.contains(&name.as_str()), "{key} = {name:?}: expected one of {}", choices.join(", "));
        Ok(name)
    }

    /// Asks for something that the reader finds missing, unless the user has answered it.
    ///
    /// # Errors
    ///
    /// If the answer has another type.
    pub(crate) fn missing<T: DeserializeOwned>(&mut self, key: &str, meaning: &str) -> Result<Option<T>> {
        if let Some(answer) = self.answers.0.get(key) {
            self.used.insert(key.to_owned());
            self.sources.insert(key.to_owned(), "answers".to_owned());
            return read(answer, &format!("answer {key}")).map(Some);
        }
        self.ask(Question { key: key.to_owned(), meaning: meaning.to_owned(), profile: None });
        Ok(None)
    }

    /// Compares an answer, if there is one, with what a file states.
    ///
    /// # Errors
    ///
    /// If they differ.
    pub(crate) fn agrees<T>(&mut self, key: &str, stated: &T, at: &str) -> Result<()>
    where
        T: DeserializeOwned + PartialEq + fmt::Debug,
    {
        let Some(answer) = self.answers.0.get(key) else { return Ok(()) };
        self.used.insert(key.to_owned());
        let given: T = read(answer, &format!("answer {key}"))?;
        if given == *stated {
            return Ok(());
        }
        Err(Self::contradiction(key, ("the answer", &format!("{given:?}")), (at, &format!("{stated:?}"))))
    }

    /// Asks whether the application computes a value that no reader knows.
    ///
    /// # Errors
    ///
    /// If the answer is another than `true`.
    pub(crate) fn require_from_application(&mut self, key: &str, meaning: &str) -> Result<()> {
        let given = self.missing::<bool>(key, meaning)?;
        ensure!(given != Some(false), "answer {key} = false: nothing else can compute it; describe it in deploy.toml");
        Ok(())
    }

    /// Asks for the keys that nothing reads, and for a version that was not read. Returns the keys of files that nothing
    /// reads at all, as those of another policy, with their files.
    ///
    /// # Errors
    ///
    /// If an answer is another than those that the question names.
    pub(crate) fn unread(&mut self, documents: &[Document]) -> Result<Vec<String>> {
        let profile = self.profile.clone();
        let (mut other, mut asked) = (Vec::new(), BTreeMap::<String, Vec<String>>::new());
        for document in documents {
            self.version(document)?;
            for path in document.unread(&profile.ignored) {
                let node = document.peek(&path);
                let says_nothing = |node: &Node| node.is_null() || node.text().is_none() && node.items().is_empty();
                if node.is_some_and(says_nothing) {
                    continue;
                }
                let at = document.location(&path);
                if document.is_read() {
                    let value = node.and_then(Node::text).map_or_else(|| "a list".to_owned(), printable_start);
                    let name = path.rsplit('.').next().unwrap_or(&path).to_owned();
                    asked.entry(name).or_default().push(format!("{at} = {value}"));
                } else {
                    other.push(at);
                }
            }
        }
        for (name, places) in asked {
            let more = places.len().saturating_sub(MAX_PLACES);
            let more = if more > 0 { format!("; {more} more") } else { String::new() };
            let meaning = format!(
                "nothing reads {}{more}, which could change a number; the family was read in {}. Does the deployment do without (\"unused\")?",
                places[..places.len().min(MAX_PLACES)].join("; "),
                if profile.versions.is_empty() { profile.family.clone() } else { profile.versions.join(", ") }
            );
            self.confirmed(&format!("unread.{name}"), &meaning, "unused")?;
        }
        Ok(other)
    }

    /// Asks for the version of a document, if it states one that the rules were not read in.
    ///
    /// # Errors
    ///
    /// As [`Self::unread`].
    pub(crate) fn version(&mut self, document: &Document) -> Result<()> {
        let Some(Format { key, read }) = self.profile.format.clone() else { return Ok(()) };
        match document.peek(&key).and_then(Node::text) {
            Some(version) if !read.iter().any(|read| read == version) => {
                let (at, read) = (document.location(&key), read.join(", "));
                let meaning =
                    format!("{at} = {}: the rules were read in {read}; do they hold (\"holds\")?", printable(version));
                self.confirmed("version", &meaning, "holds")
            }
            _ => Ok(()),
        }
    }

    /// Asks a question that has one answer.
    fn confirmed(&mut self, key: &str, meaning: &str, answer: &str) -> Result<()> {
        let given: Option<String> = self.missing(key, meaning)?;
        let fits = given.as_ref().is_none_or(|given| given == answer);
        ensure!(
            fits,
            "answer {key} = {given:?}: give {answer:?}, or describe the bundle in deploy.toml by docs/DEPLOY.md"
        );
        Ok(())
    }

    /// Returns `true` if a key is a question that nothing has answered.
    pub(crate) fn is_open(&self, key: &str) -> bool {
        self.questions.iter().any(|question| question.key == key)
    }

    fn ask(&mut self, question: Question) {
        if !self.is_open(&question.key) {
            self.questions.push(question);
        }
    }

    fn of_profile(&self, rule: &Rule) -> String {
        let from = if rule.from.is_empty() { String::new() } else { format!(" ({})", rule.from) };
        format!("profile {}{from}", self.profile.family)
    }

    /// Records where a part of the description comes from, for the report.
    pub(crate) fn note(&mut self, item: &str, source: impl Into<String>) {
        self.sources.insert(item.to_owned(), source.into());
    }

    /// Returns where a fact or a part comes from, for [`Self::note`].
    pub(crate) fn source(&self, key: &str) -> String {
        self.sources.get(key).cloned().unwrap_or_else(|| "a question".to_owned())
    }

    /// Makes an error of two statements that contradict each other.
    pub(crate) fn contradiction(what: &str, first: (&str, &str), second: (&str, &str)) -> Error {
        let shown = |text: &str| text.chars().take(300).collect::<String>();
        Error::input(format!(
            "{what}: the bundle contradicts itself: {} says {}, and {} says {}; correct one of them",
            first.0,
            shown(first.1),
            second.0,
            shown(second.1)
        ))
    }

    /// Returns all sources and the open questions.
    ///
    /// # Errors
    ///
    /// If the user answered what nobody asked.
    pub(crate) fn finish(self) -> Result<(BTreeMap<String, String>, Vec<Question>)> {
        let unasked: Vec<&str> =
            self.answers.0.keys().filter(|key| !self.used.contains(*key)).map(String::as_str).collect();
        let is_rule = |key: &str| self.profile.rules.iter().any(|rule| rule.key == key);
        if let Some(key) = unasked.iter().find(|key| is_rule(key)) {
            bail!(
                "answers: nothing asks for {key} in this bundle: its files say it, or do not need it; remove the answer"
            );
        }
        ensure!(
            unasked.is_empty(),
            "answers: nothing asks for {}; the keys of this bundle are {}",
            unasked.join(", "),
            self.profile.rules.iter().map(|rule| rule.key.as_str()).collect::<Vec<_>>().join(", ")
        );
        Ok((self.sources, self.questions))
    }
}

/// Returns the start of a text, for a message.
fn printable_start(text: &str) -> String {
    printable(&text.chars().take(40).collect::<String>()).to_string()
}

fn read<T: DeserializeOwned>(value: &toml::Value, key: &str) -> Result<T> {
    let shown: String = value.to_string().chars().take(100).collect();
    match value.clone().try_into() {
        Ok(value) => Ok(value),
        Err(error) => bail!("{key} = {}: {}", printable(&shown), printable(error.message())),
    }
}
