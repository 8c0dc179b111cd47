//! A notation for graphs.
//!
//! A line is an expression: `Op(value, attribute=1)`, `a + b`, `a - b`, `a * b`, `a / b`, or a value. A value is a
//! name, a real scalar `0.5`, integers `[1, 4]`, reals `[0.5, 1.0]`, random weights `drawn(3, 4)` of a shape,
//! `full(0.5, 3, 4)` of one number and a shape, or a layer `gemm(x, 3, 4)` of rows and columns. An argument may be
//! empty. `name = ..` names a value within the text, `name := ..` and `first, second := ..` name the outputs of a node
//! in the file.

use std::collections::BTreeMap;
use std::str::FromStr;

use super::file::{File, Value};

/// A node without outputs yet, or a value of the file.
enum Term {
    Value(String),
    Node { op: String, inputs: Vec<String>, attributes: Vec<(String, Value)> },
}

struct Reader<'f, 't> {
    file: &'f mut File,
    names: BTreeMap<&'t str, String>,
    rest: &'t str,
}

impl File {
    /// Adds the nodes of the lines, in which the names `x`, `y` and `z` stand for the given values. Returns the value
    /// of the last line.
    pub(super) fn write(&mut self, given: &[&str], text: &str) -> String {
        let names = ["x", "y", "z"].into_iter().zip(given.iter().map(|name| (*name).to_owned())).collect();
        let mut reader = Reader { file: self, names, rest: "" };
        let mut last = String::new();
        for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
            if let Some((outputs, node)) = line.split_once(" := ") {
                let outputs: Vec<&str> = outputs.split(", ").collect();
                reader.rest = node;
                let Term::Node { op, inputs, attributes } = reader.sum() else { panic!("{line:?} is no node") };
                reader.add(&op, &inputs, &outputs, &attributes);
                last = outputs[0].to_owned();
            } else {
                let (name, value) = line.split_once(" = ").map_or((None, line), |(name, value)| (Some(name), value));
                reader.rest = value;
                let term = reader.sum();
                last = reader.value(term);
                reader.names.extend(name.map(|name| (name, last.clone())));
            }
            assert!(reader.rest.is_empty(), "{:?} is left of {line:?}", reader.rest);
        }
        last
    }
}

impl<'t> Reader<'_, 't> {
    fn add(&mut self, op: &str, inputs: &[String], outputs: &[&str], attributes: &[(String, Value)]) {
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        let attributes: Vec<_> = attributes.iter().map(|(name, value)| (name.as_str(), value.clone())).collect();
        self.file.nodes(op, &inputs, outputs, &attributes);
    }

    fn value(&mut self, term: Term) -> String {
        match term {
            Term::Value(name) => name,
            Term::Node { op, inputs, attributes } => {
                let name = self.file.fresh(&op);
                self.add(&op, &inputs, &[&name], &attributes);
                name
            }
        }
    }

    /// Takes a sign after spaces, if it is next.
    fn takes(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        let after = rest.strip_prefix(sign);
        self.rest = after.map_or(rest, str::trim_start);
        after.is_some()
    }

    fn sum(&mut self) -> Term {
        self.binary([('+', "Add"), ('-', "Sub")], |reader| reader.binary([('*', "Mul"), ('/', "Div")], Self::operand))
    }

    fn binary(&mut self, signs: [(char, &str); 2], operand: impl Fn(&mut Self) -> Term) -> Term {
        let mut left = operand(self);
        while let Some((_, op)) = signs.into_iter().find(|(sign, _)| self.takes(*sign)) {
            let right = operand(self);
            let inputs = [left, right].map(|term| self.value(term)).into();
            left = Term::Node { op: op.to_owned(), inputs, attributes: Vec::new() };
        }
        left
    }

    /// Takes characters up to the first that no name or number has.
    fn word(&mut self) -> &'t str {
        let is_part = |(i, c): &(usize, char)| {
            c.is_alphanumeric() || "_.".contains(*c) || (*c == '-' && (*i == 0 || self.rest[..*i].ends_with('e')))
        };
        let end = self.rest.char_indices().find(|place| !is_part(place)).map_or(self.rest.len(), |(i, _)| i);
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word
    }

    fn list<T: FromStr<Err: std::fmt::Debug>>(&mut self, end: char) -> Vec<T> {
        let (list, rest) = self.rest.split_once(end).expect("the list has an end");
        self.rest = rest;
        list.split(',').map(|number| number.trim().parse().expect("a number")).collect()
    }

    fn operand(&mut self) -> Term {
        if self.takes('(') {
            let term = self.sum();
            assert!(self.takes(')'), "no parenthesis before {:?}", self.rest);
            return term;
        }
        if self.takes('[') {
            let is_real = self.rest.split(']').next().is_some_and(|list| list.contains(['.', 'e']));
            return Term::Value(if is_real {
                let values = self.list(']');
                self.file.reals(&[values.len()], &values)
            } else {
                let values = self.list(']');
                self.file.ints(&values)
            });
        }
        let word = self.word();
        match word {
            _ if word.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
                Term::Value(self.file.reals(&[], &[word.parse().expect("a real number")]))
            }
            "drawn" if self.takes('(') => {
                let shape: Vec<usize> = self.list(')');
                Term::Value(self.file.drawn(&shape))
            }
            "full" if self.takes('(') => {
                let number = self.word().parse().expect("a real number");
                assert!(self.takes(','), "no shape before {:?}", self.rest);
                let shape: Vec<usize> = self.list(')');
                Term::Value(self.file.reals(&shape, &vec![number; shape.iter().product()]))
            }
            "gemm" if self.takes('(') => {
                let x = self.sum();
                let x = self.value(x);
                assert!(self.takes(','), "no size before {:?}", self.rest);
                let [rows, cols] = self.list(')')[..] else { panic!("a layer has rows and columns") };
                Term::Value(self.file.gemm(&x, rows, cols))
            }
            _ if self.takes('(') => self.node(word),
            _ => Term::Value(self.names.get(word).cloned().unwrap_or_else(|| word.to_owned())),
        }
    }

    fn node(&mut self, op: &str) -> Term {
        let (mut inputs, mut attributes) = (Vec::new(), Vec::new());
        while !self.takes(')') {
            let before = self.rest;
            let name = self.word();
            if self.takes('=') {
                attributes.push((name.to_owned(), self.attribute()));
            } else if before.starts_with(',') {
                inputs.push(String::new());
            } else {
                self.rest = before;
                let term = self.sum();
                inputs.push(self.value(term));
            }
            if self.takes(',') && self.rest.starts_with(')') {
                inputs.push(String::new());
            }
        }
        Term::Node { op: op.to_owned(), inputs, attributes }
    }

    fn attribute(&mut self) -> Value {
        if self.takes('[') {
            return Value::Ints(self.list(']'));
        }
        if self.takes('"') {
            let (text, rest) = self.rest.split_once('"').expect("the text has an end");
            self.rest = rest;
            return Value::Text(text.to_owned());
        }
        let number = self.word();
        number.parse().map_or_else(|_| Value::Real(number.parse().expect("a number")), Value::Int)
    }
}
