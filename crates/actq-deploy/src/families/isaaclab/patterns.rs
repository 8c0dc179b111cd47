//! Joints by regular expressions, with the rules of Isaac Lab. A pattern matches a whole name, each pattern matches at
//! least one joint, and each joint at most one pattern.

use actq::error::{Error, Result, ensure};
use actq::text::printable;
use regex_lite::Regex;

use crate::families::common::check_names;

/// Most joints of a robot, and most patterns for them.
pub(super) const MAX_COUNT: usize = 1000;

/// Names of joints in an order.
#[derive(Clone, Debug)]
pub(super) struct Joints {
    pub(super) names: Vec<String>,
    /// Their file and key, for reports and errors.
    pub(super) from: String,
    /// Set while the order is a question: the names are placeholders, which no pattern needs to match.
    pub(super) open: bool,
}

impl Joints {
    /// Takes a list of names.
    ///
    /// # Errors
    ///
    /// If it is empty or too long, or a name occurs twice or has characters that a report cannot show.
    pub(super) fn new(names: Vec<String>, from: String) -> Result<Self> {
        ensure!((1..=MAX_COUNT).contains(&names.len()), "{from}: {} joints; give 1 to {MAX_COUNT}", names.len());
        check_names(&names, &from)?;
        Ok(Self { names, from, open: false })
    }

    /// Makes placeholders for joints whose order is a question.
    pub(super) fn placeholders(count: usize) -> Self {
        let names = (0..count.clamp(1, MAX_COUNT)).map(|i| format!("joint_{i}")).collect();
        Self { names, from: "a question".to_owned(), open: true }
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    pub(super) fn at(&self, places: &[usize]) -> Self {
        let names = places.iter().filter_map(|place| self.names.get(*place).cloned()).collect();
        Self { names, from: self.from.clone(), open: self.open }
    }

    /// Returns the places of names that are all there.
    pub(super) fn places(&self, names: &[String], at: &str) -> Result<Vec<usize>> {
        let place = |(i, name): (usize, &String)| {
            ensure!(!names[..i].contains(name), "{at}: {:?} occurs twice", printable(name));
            let place = self.names.iter().position(|own| own == name);
            place.ok_or_else(|| {
                Error::input(format!(
                    "{at}: {:?} matches none of the joints {} ({})",
                    printable(name),
                    self.names.join(", "),
                    self.from
                ))
            })
        };
        ensure!(names.len() <= MAX_COUNT, "{at}: {} names; give at most {MAX_COUNT}", names.len());
        names.iter().enumerate().map(place).collect()
    }

    /// Returns the value of each joint by the pattern that matches it, if one does.
    pub(super) fn resolve<T: Clone>(&self, pairs: &[(String, T)], at: &str) -> Result<Vec<Option<T>>> {
        let of_joint = self.matches(pairs.iter().map(|(text, _)| text.as_str()), at)?;
        Ok(of_joint.into_iter().map(|pattern| pattern.map(|i| pairs[i].1.clone())).collect())
    }

    /// Returns the places of all joints that patterns match: in the order of the joints, or of the patterns.
    pub(super) fn select(&self, patterns: &[String], in_their_order: bool, at: &str) -> Result<Vec<usize>> {
        let of_joint = self.matches(patterns.iter().map(String::as_str), at)?;
        if self.open {
            return Ok((0..self.len()).collect());
        }
        let mut places: Vec<usize> = (0..self.len()).filter(|place| of_joint[*place].is_some()).collect();
        if in_their_order {
            places.sort_by_key(|place| of_joint[*place]);
        }
        Ok(places)
    }

    /// Returns the number of the pattern that matches each joint.
    fn matches<'a>(&self, patterns: impl Iterator<Item = &'a str>, at: &str) -> Result<Vec<Option<usize>>> {
        let mut of_joint: Vec<Option<usize>> = vec![None; self.len()];
        let mut texts = Vec::new();
        for (i, text) in patterns.enumerate() {
            ensure!(i < MAX_COUNT, "{at}: more than {MAX_COUNT} patterns");
            let pattern = compile(text, at)?;
            texts.push(printable(text));
            if self.open {
                continue;
            }
            let mut is_used = false;
            for (joint, found) in self.names.iter().zip(&mut of_joint).filter(|(joint, _)| pattern.is_match(joint)) {
                if let Some(other) = *found {
                    return Err(Error::input(format!(
                        "{at}: {:?} and {:?} match both joint {joint:?}; let one of them match it",
                        texts[other], texts[i]
                    )));
                }
                *found = Some(i);
                is_used = true;
            }
            ensure!(
                is_used,
                "{at}: {:?} matches none of the joints {} ({}); correct one of them",
                texts[i],
                self.names.join(", "),
                self.from
            );
        }
        Ok(of_joint)
    }
}

/// Compiles a pattern that must match a whole name, as Python's `re.fullmatch`.
fn compile(text: &str, at: &str) -> Result<Regex> {
    // Alone first: `a)|(b` would be valid within the group.
    let compiled = Regex::new(text).and_then(|_| Regex::new(&format!(r"\A(?:{text})\z")));
    compiled.map_err(|error| {
        Error::input(format!(
            "{at}: {:?} is not a regular expression that this reader knows: {}; list the joints instead",
            printable(text),
            printable(&error.to_string())
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joints() -> Result<Joints> {
        let names = ["FL_hip", "FR_hip", "FL_knee", "FR_knee", "torso"];
        Joints::new(names.map(str::to_owned).to_vec(), "answers".to_owned())
    }

    fn select(patterns: &[&str], in_their_order: bool) -> Result<Vec<usize>> {
        let patterns: Vec<String> = patterns.iter().map(|&pattern| pattern.to_owned()).collect();
        joints()?.select(&patterns, in_their_order, "env.yaml: joint_names")
    }

    #[test]
    fn patterns_select_joints_in_either_order() -> Result<()> {
        assert_eq!(select(&[".*"], false)?, [0, 1, 2, 3, 4]);
        assert_eq!(select(&["torso", ".*_hip"], false)?, [0, 1, 4]);
        assert_eq!(select(&["torso", ".*_hip"], true)?, [4, 0, 1]);
        assert_eq!(select(&["F[L,R]_(hip|knee)"], true)?, [0, 1, 2, 3]);
        let pairs = [("FL_.*".to_owned(), 1.0), ("torso|FR_hip".to_owned(), 2.0)];
        assert_eq!(joints()?.resolve(&pairs, "")?, [Some(1.0), Some(2.0), Some(1.0), None, Some(2.0)]);
        Ok(())
    }

    #[test]
    fn wrong_patterns_are_refused() {
        let cases: [(&[&str], &str); 5] = [
            (&["hip"], "\"hip\" matches none of the joints FL_hip"),
            (&[".*_hip", "FL_.*"], "\".*_hip\" and \"FL_.*\" match both joint \"FL_hip\""),
            (&["FL_hip)|(FR_hip"], "is not a regular expression"),
            (&["(?=FL).*"], "is not a regular expression"),
            (&["[\u{1b}"], "\"[\\\\u{1b}\" is not a regular expression"),
        ];
        for (patterns, expected) in cases {
            let error = select(patterns, false).map_or_else(|error| error.to_string(), |places| format!("{places:?}"));
            assert!(error.contains(expected), "{patterns:?}: {error}");
        }
    }
}
