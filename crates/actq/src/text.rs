//! Text from files, made safe for a terminal or quoted for a shell.

use std::borrow::Cow;
use std::ffi::OsStr;

use crate::error::{Context as _, Result};

/// Returns `true` if a character controls the terminal or the order of the text around it.
pub(crate) fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Returns `text` in one line, with control characters escaped as in Rust: `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_control) {
        return text.into();
    }
    let escaped = |c: char| -> String { if is_control(c) { c.escape_default().collect() } else { c.into() } };
    text.chars().map(escaped).collect::<String>().into()
}

/// Formats a number of things, as "1 frame" or "2 frames". The noun's plural must end in -s.
pub fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// Quotes a word for a POSIX shell and Python's `shlex.split`.
pub fn quoted(word: &OsStr) -> Result<String> {
    let text = word.to_str().with_context(|| format!("{}: the path is not UTF-8", word.to_string_lossy()))?;
    let plain = |c: char| c.is_ascii_alphanumeric() || "@%+=:,./_-".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return Ok(text.to_owned());
    }
    Ok(format!("'{}'", text.replace('\'', "'\"'\"'")))
}

/// Returns text of several lines, each [`printable`].
pub fn printable_lines(text: &str) -> String {
    let lines: Vec<_> = text.split('\n').map(printable).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_singular() {
        assert_eq!([0, 1, 2].map(|number| count(number, "frame")), ["0 frames", "1 frame", "2 frames"]);
    }

    #[test]
    fn only_control_characters_are_escaped() {
        assert_eq!(printable("arm \"ä\" \\ 腕"), "arm \"ä\" \\ 腕");
        assert_eq!(printable("a\x1b[2Jb\r\n\u{9b}\u{7f}\u{202e}c"), "a\\u{1b}[2Jb\\r\\n\\u{9b}\\u{7f}\\u{202e}c");
    }
}
