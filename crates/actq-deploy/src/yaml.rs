//! Untrusted YAML files as data: tags are ignored and never run, aliases cannot grow beyond a limit, and each value
//! knows its line.

use actq::error::{Error, Result, bail, ensure};
use actq::text::printable;
use saphyr_parser::{Event, Parser, ScalarStyle};

/// Most values of a file, with those that aliases repeat.
const MAX_NODES: usize = 100_000;
/// Most levels.
const MAX_LEVELS: usize = 64;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    /// Line of the file, from 1.
    pub line: usize,
    /// Content.
    pub data: Data,
}

/// Content of a value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Data {
    /// A text, number, truth value or nothing, as written; `true` if it was quoted.
    Scalar(String, bool),
    /// Values in order.
    List(Vec<Node>),
    /// Values by key, in the order of the file.
    Map(Vec<(String, Node)>),
}

impl Node {
    /// Parses a file with one document.
    ///
    /// # Errors
    ///
    /// If it is not YAML, has a key twice, or is larger than the limits.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        // Other parsers accept a closing bracket in the column of its key, as many files have it.
        Self::parse_strictly(text).or_else(|error| match with_deeper_brackets(text) {
            Some(text) => Self::parse_strictly(&text),
            None => Err(error),
        })
    }

    fn parse_strictly(text: &str) -> Result<Self> {
        let mut reader = Reader { open: Vec::new(), anchors: Vec::new(), nodes: 0, root: None };
        for event in Parser::new_from_str(text) {
            let (event, span) =
                event.map_err(|error| Error::input(format!("not YAML: {}", printable(&error.to_string()))))?;
            reader.take(event, span.start.line())?;
        }
        reader.root.ok_or_else(|| Error::input("the file is empty"))
    }

    pub(crate) fn get(&self, key: &str) -> Option<&Self> {
        match &self.data {
            Data::Map(entries) => entries.iter().find(|(name, _)| name == key).map(|(_, node)| node),
            _ => None,
        }
    }

    /// Returns keys and values of a map; nothing for other values.
    pub(crate) fn entries(&self) -> &[(String, Self)] {
        if let Data::Map(entries) = &self.data { entries } else { &[] }
    }

    /// Returns the values of a list; nothing for other values.
    pub(crate) fn items(&self) -> &[Self] {
        if let Data::List(items) = &self.data { items } else { &[] }
    }

    /// Returns the text of a scalar.
    pub(crate) fn text(&self) -> Option<&str> {
        if let Data::Scalar(text, _) = &self.data { Some(text) } else { None }
    }

    /// Returns `true` if nothing is given: null, or an empty scalar.
    pub(crate) fn is_null(&self) -> bool {
        matches!(&self.data, Data::Scalar(text, false) if ["", "~", "null", "Null", "NULL"].contains(&text.as_str()))
    }

    /// Returns a number, if it is one and finite.
    pub(crate) fn number(&self) -> Option<f64> {
        match &self.data {
            Data::Scalar(text, false) => text.replace('_', "").parse().ok().filter(|number: &f64| number.is_finite()),
            _ => None,
        }
    }

    pub(crate) fn truth(&self) -> Option<bool> {
        match self.text()? {
            "true" | "True" | "TRUE" | "yes" | "on" => Some(true),
            "false" | "False" | "FALSE" | "no" | "off" => Some(false),
            _ => None,
        }
    }

    pub(crate) fn numbers(&self) -> Option<Vec<f64>> {
        match &self.data {
            Data::List(items) => items.iter().map(Self::number).collect(),
            Data::Map(_) | Data::Scalar(..) => None,
        }
    }

    /// Returns a list of numbers, or one number as a list.
    pub(crate) fn one_or_several(&self) -> Option<Vec<f64>> {
        self.numbers().or_else(|| Some(vec![self.number()?]))
    }

    /// Returns a list of two numbers.
    pub(crate) fn pair(&self) -> Option<[f64; 2]> {
        self.numbers()?.try_into().ok()
    }

    pub(crate) fn texts(&self) -> Option<Vec<String>> {
        match &self.data {
            Data::List(items) => items.iter().map(|item| item.text().map(str::to_owned)).collect(),
            _ => None,
        }
    }

    /// Makes lists of maps to maps with the keys 0, 1 and so on, so that their values have paths.
    pub(crate) fn numbered(self) -> Self {
        let data = match self.data {
            Data::List(items) if items.iter().any(|item| matches!(item.data, Data::Map(_))) => {
                Data::Map(items.into_iter().enumerate().map(|(i, item)| (i.to_string(), item.numbered())).collect())
            }
            Data::Map(entries) => Data::Map(entries.into_iter().map(|(key, inner)| (key, inner.numbered())).collect()),
            other => other,
        };
        Self { line: self.line, data }
    }

    fn count(&self) -> usize {
        1 + match &self.data {
            Data::Scalar(..) => 0,
            Data::List(items) => items.iter().map(Self::count).sum(),
            Data::Map(entries) => entries.iter().map(|(_, node)| node.count()).sum(),
        }
    }
}

/// Moves closing brackets that begin a line to the right of the line before; `None` if there are none, or the text
/// would grow to a multiple.
fn with_deeper_brackets(text: &str) -> Option<String> {
    let mut deeper = String::with_capacity(text.len());
    let mut before = 0;
    for line in text.split_inclusive('\n') {
        let content = line.trim_start_matches(' ');
        let mut column = line.len() - content.len();
        if content.starts_with([']', '}']) && column <= before {
            deeper.extend(std::iter::repeat_n(' ', before + 1 - column));
            column = before + 1;
        }
        if !content.trim().is_empty() {
            before = column;
        }
        deeper.push_str(line);
        if deeper.len() > 2 * text.len() + 1024 {
            return None;
        }
    }
    (deeper.len() > text.len()).then_some(deeper)
}

/// A list or map whose end has not come.
struct Open {
    line: usize,
    anchor: usize,
    data: Data,
    /// Key of a map whose value has not come.
    key: Option<String>,
}

/// Makes a value of a parser's events.
struct Reader {
    open: Vec<Open>,
    /// Values by the number of their anchor.
    anchors: Vec<(usize, Node)>,
    nodes: usize,
    root: Option<Node>,
}

impl Reader {
    fn take(&mut self, event: Event<'_>, line: usize) -> Result<()> {
        match event {
            Event::Scalar(text, style, anchor, _) => {
                let node = Node { line, data: Data::Scalar(text.into_owned(), style != ScalarStyle::Plain) };
                self.add(node, anchor)
            }
            Event::SequenceStart(anchor, ..) => self.begin(line, anchor, Data::List(Vec::new())),
            Event::MappingStart(anchor, ..) => self.begin(line, anchor, Data::Map(Vec::new())),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                Some(open) => self.add(Node { line: open.line, data: open.data }, open.anchor),
                None => Ok(()),
            },
            Event::Alias(anchor) => {
                let node = self.anchors.iter().find(|(number, _)| *number == anchor).map(|(_, node)| node.clone());
                let Some(node) = node else { bail!("line {line}: it repeats a value that is not complete") };
                self.add(node, 0)
            }
            Event::DocumentStart(_) if self.root.is_some() => {
                bail!("line {line}: the file has a second document; remove it")
            }
            _ => Ok(()),
        }
    }

    fn begin(&mut self, line: usize, anchor: usize, data: Data) -> Result<()> {
        ensure!(self.open.len() < MAX_LEVELS, "line {line}: more than {MAX_LEVELS} levels");
        self.open.push(Open { line, anchor, data, key: None });
        Ok(())
    }

    fn add(&mut self, node: Node, anchor: usize) -> Result<()> {
        let line = node.line;
        self.nodes += node.count();
        ensure!(self.nodes <= MAX_NODES, "line {line}: more than {MAX_NODES} values, with those that aliases repeat");
        if anchor > 0 {
            self.anchors.push((anchor, node.clone()));
        }
        let Some(open) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        match &mut open.data {
            Data::List(items) => items.push(node),
            Data::Map(entries) => match open.key.take() {
                Some(key) => {
                    ensure!(
                        entries.iter().all(|(name, _)| *name != key),
                        "line {line}: key {:?} occurs twice",
                        printable(&key)
                    );
                    ensure!(
                        key != "<<",
                        "line {line}: it merges another map (<<), which is not supported; write its keys out"
                    );
                    entries.push((key, node));
                }
                None => match node.data {
                    Data::Scalar(text, _) => open.key = Some(text),
                    _ => bail!("line {line}: a key is not a text"),
                },
            },
            Data::Scalar(..) => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_with_their_lines() -> Result<()> {
        let text = "a: 1.5\nb: [1, -2e-3, null]\nc:\n  d: 'x'\n  e: true\ntag: !!python/object/apply:builtins.slice [null, 1]\n";
        let node = Node::parse(text)?;
        assert_eq!(node.get("a").and_then(Node::number), Some(1.5));
        let b = node.get("b").map_or(&[][..], Node::items);
        assert_eq!((b[1].number(), b[2].is_null()), (Some(-2e-3), true));
        let e = node.get("c").and_then(|c| c.get("e"));
        assert_eq!((e.and_then(Node::truth), e.map(|e| e.line)), (Some(true), Some(5)));
        assert_eq!(node.get("tag").map(|tag| tag.items().len()), Some(2), "a tag is data");
        Ok(())
    }

    #[test]
    fn closing_brackets_may_align_with_their_key() -> Result<()> {
        let text = "a:\n  b: [\n    1,\n    # more\n    2,\n  ] \n  c: {\n    x: [\n      3,\n    ],\n}\n  d: [\n  ]\n  e: 4\n";
        let node = Node::parse(text)?;
        let at = |key: &str| node.get("a").and_then(|a| a.get(key)).cloned();
        assert_eq!(at("b").and_then(|b| b.numbers()), Some(vec![1.0, 2.0]));
        assert_eq!(at("c").and_then(|c| c.get("x")?.numbers()), Some(vec![3.0]));
        assert_eq!(at("e").map(|e| (e.number(), e.line)), Some((Some(4.0), 14)));
        let error = Node::parse("a:\n  b: [\n  ]\n  b: 1\n").expect_err("a key twice");
        assert!(error.to_string().contains("occurs twice"), "{error}");
        Ok(())
    }

    #[test]
    fn hostile_files_are_refused() {
        let bomb: String = (0..30)
            .fold("a0: &a0 [x, x]\n".to_owned(), |text, i| text + &format!("a{0}: &a{0} [*a{i}, *a{i}]\n", i + 1));
        let cases = [
            ("aliases that explode", bomb, "more than 100000 values"),
            ("deep lists", "[".repeat(1000), "limit"),
            ("a key twice", "a: 1\na: 2\n".to_owned(), "occurs twice"),
            ("two documents", "a: 1\n---\nb: 2\n".to_owned(), "second document"),
            ("an alias of itself", "a: &a [*a]\n".to_owned(), "not complete"),
            ("nothing", String::new(), "empty"),
            ("no YAML", "a: [1, 2\n".to_owned(), "not YAML"),
        ];
        for (name, text, expected) in cases {
            let error =
                Node::parse(&text).map_or_else(|error| error.to_string(), |node| format!("accepted as {node:?}"));
            assert!(error.contains(expected), "{name}: {error}");
        }
    }
}
