//! The paths in the code of a source file, read from its tokens. Comments, strings and tests do not count.

use anyhow::{Result, anyhow};
use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};

/// The parts of a path: `crate`, `a` and `b` of `crate::a::b`.
pub(super) type Parts = Vec<String>;

/// The names in a file.
#[derive(Default)]
pub(super) struct Uses {
    /// The paths of every `use`, and all others of two parts or more.
    pub(super) paths: Vec<Parts>,
    /// The files that it declares as test modules.
    pub(super) test_modules: Vec<String>,
}

impl Uses {
    /// Reads the text of a file.
    pub(super) fn of(text: &str) -> Result<Self> {
        let mut uses = Self::default();
        uses.read(text.parse().map_err(|error| anyhow!("cannot read the tokens: {error}"))?);
        Ok(uses)
    }

    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut rest = &tokens[..];
        while let [token, after @ ..] = rest {
            rest = match token {
                TokenTree::Ident(word) if word == "use" => {
                    let (tree, after) = after.split_at(after.iter().position(|t| is(t, ';')).unwrap_or(after.len()));
                    self.expand(tree, &[]);
                    after
                }
                TokenTree::Ident(_) => {
                    let (path, after) = path(rest);
                    self.paths.extend((path.len() > 1).then_some(path));
                    after
                }
                TokenTree::Punct(_) if is(token, '#') => match after {
                    [TokenTree::Group(attribute), item @ ..] if is_test(&attribute.to_string()) => self.skip(item),
                    _ => after,
                },
                TokenTree::Group(group) => {
                    self.read(group.stream());
                    after
                }
                _ => after,
            };
        }
    }

    /// Adds the paths of a `use`: `a::{b, c::d}` adds `a::b` and `a::c::d`.
    fn expand(&mut self, tree: &[TokenTree], front: &[String]) {
        let (path, after) = path(tree);
        let path = [front, &path].concat();
        let [TokenTree::Group(group), ..] = after else { return self.paths.push(path) };
        let inner: Vec<TokenTree> = group.stream().into_iter().collect();
        inner.split(|token| is(token, ',')).filter(|part| !part.is_empty()).for_each(|part| self.expand(part, &path));
    }

    /// Skips a test item, which ends with its braces or a semicolon.
    fn skip<'t>(&mut self, item: &'t [TokenTree]) -> &'t [TokenTree] {
        let ends = |token: &TokenTree| match token {
            TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
            _ => is(token, ';'),
        };
        let (item, after) = item.split_at(item.iter().position(ends).map_or(item.len(), |end| end + 1));
        if let [.., TokenTree::Ident(word), TokenTree::Ident(name), end] = item
            && word == "mod"
            && is(end, ';')
        {
            self.test_modules.push(name.to_string());
        }
        after
    }
}

/// Returns the path at the begin of the tokens, and the tokens after it.
fn path(mut tokens: &[TokenTree]) -> (Parts, &[TokenTree]) {
    let mut path = Parts::new();
    while let [TokenTree::Ident(part), after @ ..] = tokens {
        path.push(part.to_string());
        match after {
            [TokenTree::Punct(colon), second, next @ ..]
                if colon.as_char() == ':' && colon.spacing() == Spacing::Joint && is(second, ':') =>
            {
                tokens = next;
            }
            _ => return (path, after),
        }
    }
    (path, tokens)
}

fn is(token: &TokenTree, character: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == character)
}

/// Returns `true` for an attribute of an item that only tests have: `[cfg(test)]`, `[cfg(all(test, ...))]`.
fn is_test(attribute: &str) -> bool {
    let words: Vec<&str> = attribute.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    words.first() == Some(&"cfg") && words.contains(&"test") && !words.contains(&"not")
}
