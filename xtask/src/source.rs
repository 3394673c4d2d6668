//! Rust source as far as the rules need it: code without its comments and string contents, functions, attributes.
//!
//! Not a parser. It knows strings, characters, comments and brackets, which is enough to find where a function ends
//! and what an attribute says in code that compiles.

use std::ops::Range;

/// A function with its body.
#[derive(Debug, PartialEq)]
pub(crate) struct Function<'a> {
    pub(crate) name: &'a str,
    /// Line of its `fn`, from 1.
    pub(crate) line: usize,
}

/// The same text with comments as blanks and the contents of strings and characters as `x`. Line ends stay.
pub(crate) fn code_only(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = bytes.to_vec();
    let mut at = 0;
    while at < bytes.len() {
        let (end, filler) = match literal_or_comment(bytes, at) {
            Some(found) => found,
            None => {
                at += 1;
                continue;
            }
        };
        for (byte, source) in out[at..end].iter_mut().zip(&bytes[at..end]) {
            if !source.is_ascii_whitespace() {
                *byte = filler;
            }
        }
        at = end;
    }
    String::from_utf8(out).expect("invariant: whole characters are replaced")
}

/// End of the comment or literal that begins at `at`, and what to put in its place.
fn literal_or_comment(bytes: &[u8], at: usize) -> Option<(usize, u8)> {
    let rest = &bytes[at..];
    let starts_word = at == 0 || !is_word(bytes[at - 1]);
    match rest {
        [b'/', b'/', ..] => Some((end_of(bytes, at, b"\n"), b' ')),
        [b'/', b'*', ..] => Some((block_comment_end(bytes, at), b' ')),
        [b'"', ..] => Some((quoted_end(bytes, at + 1, b'"'), b'x')),
        [b'\'', b'\\', ..] => Some((quoted_end(bytes, at + 1, b'\''), b'x')),
        [b'\'', first, ..] => {
            // `'a'` is a character, `'a` a lifetime.
            let width = (first.leading_ones() as usize).max(1);
            (*first != b'\'' && rest.get(1 + width) == Some(&b'\'')).then_some((at + width + 2, b'x'))
        }
        [b'r' | b'b' | b'c', ..] if starts_word => raw_string_end(bytes, at).map(|end| (end, b'x')),
        _ => None,
    }
}

/// End of `r"…"`, `r#"…"#`, `br"…"`; `None` where no raw string begins.
fn raw_string_end(bytes: &[u8], at: usize) -> Option<usize> {
    let mut open = at + usize::from(bytes[at] != b'r');
    if bytes.get(open) != Some(&b'r') {
        return None;
    }
    open += 1;
    let hashes = bytes[open..].iter().take_while(|b| **b == b'#').count();
    if bytes.get(open + hashes) != Some(&b'"') {
        return None;
    }
    let mut closing = vec![b'"'];
    closing.resize(hashes + 1, b'#');
    Some(end_of(bytes, open + hashes + 1, &closing))
}

fn quoted_end(bytes: &[u8], mut at: usize, quote: u8) -> usize {
    while at < bytes.len() && bytes[at] != quote {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(bytes.len())
}

fn block_comment_end(bytes: &[u8], mut at: usize) -> usize {
    let mut depth = 0;
    while at < bytes.len() {
        match &bytes[at..] {
            [b'/', b'*', ..] => depth += 1,
            [b'*', b'/', ..] => depth -= 1,
            _ => {
                at += 1;
                continue;
            }
        }
        at += 2;
        if depth == 0 {
            return at;
        }
    }
    bytes.len()
}

/// Just behind the first `pattern` from `at` on, or the end.
fn end_of(bytes: &[u8], at: usize, pattern: &[u8]) -> usize {
    let from = at.min(bytes.len());
    let found = bytes[from..].windows(pattern.len()).position(|w| w == pattern);
    found.map_or(bytes.len(), |p| from + p + pattern.len())
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Where `word` stands as a whole word.
pub(crate) fn words<'a>(code: &'a str, word: &'a str) -> impl Iterator<Item = usize> + 'a {
    let bytes = code.as_bytes();
    let alone = move |at: usize| {
        let end = at + word.len();
        (at == 0 || !is_word(bytes[at - 1])) && bytes.get(end).is_none_or(|b| !is_word(*b))
    };
    code.match_indices(word).map(|(at, _)| at).filter(move |at| alone(*at))
}

/// The number of the line that the byte `at` stands in, from 1.
pub(crate) fn line_of(text: &str, at: usize) -> usize {
    text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count() + 1
}

/// Just behind the bracket that closes the one at `open`.
fn closing(code: &str, open: usize) -> usize {
    let mut depth = 0;
    for (at, byte) in code.bytes().enumerate().skip(open) {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    code.len()
}

/// The ranges of `#[…]` and `#![…]` in code without comments.
pub(crate) fn attributes(code: &str) -> Vec<Range<usize>> {
    let open = |at: usize| match &code.as_bytes()[at..] {
        [b'#', b'[', ..] => Some(at + 1),
        [b'#', b'!', b'[', ..] => Some(at + 2),
        _ => None,
    };
    let starts = code.match_indices('#').map(|(at, _)| at);
    starts.filter_map(|at| Some(at..closing(code, open(at)?))).collect()
}

/// The text between the brackets of every `name(…)` inside a piece of code.
pub(crate) fn calls<'a>(code: &'a str, name: &'a str) -> impl Iterator<Item = &'a str> + 'a {
    let opens = words(code, name).map(|at| at + name.len()).filter(|open| code[*open..].starts_with('('));
    opens.map(|open| &code[open..closing(code, open)])
}

/// The functions with a body, nested ones too, in code without comments.
pub(crate) fn functions(code: &str) -> Vec<Function<'_>> {
    let with_body = words(code, "fn").filter_map(|at| {
        let name = code[at + 2..].trim_start();
        let name = &name[..name.bytes().take_while(|b| is_word(*b)).count()];
        let is_whole = !name.is_empty() && has_body(code, at);
        is_whole.then(|| Function { name, line: line_of(code, at) })
    });
    with_body.collect()
}

/// Whether the item that begins at `at` has a body, no `;` before it.
fn has_body(code: &str, at: usize) -> bool {
    let bytes = code.as_bytes();
    let mut here = at;
    while here < bytes.len() {
        match bytes[here] {
            b'{' => return true,
            b';' => return false,
            b'(' | b'[' => here = closing(code, here),
            _ => here += 1,
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_string_contents_vanish() {
        let text =
            "let a = \"fn x() { // }\"; // fn y() {\n/* { /* nested */ { */ let b = '{'; let c: &'a str = r#\"}\"#;\n";
        let code = code_only(text);
        assert_eq!(code.len(), text.len());
        assert!(!code.contains(['{', '}', '"']), "{code}");
        assert!(code.contains("let b = xxx; let c: &'a str = xxx"), "{code}");
    }

    #[test]
    fn escapes_do_not_end_a_literal() {
        assert!(code_only("let q = '\\''; let s = \"\\\"{\"; tail()").ends_with("; tail()"));
        assert!(code_only("let o = 'ω'; let s = \"ρ{\"; tail()").ends_with("xxxx; tail()"));
    }

    #[test]
    fn functions_without_a_body_are_left_out() {
        let text =
            "trait T { fn none(x: [u8; 3]); }\nfn one() {}\nfn two(f: fn(u8) -> u8) {\n    // why\n\n    f(1);\n}\n";
        let code = code_only(text);
        let seen: Vec<_> = functions(&code).iter().map(|f| (f.name, f.line)).collect();
        assert_eq!(seen, [("one", 2), ("two", 3)]);
    }

    #[test]
    fn attributes_and_calls_are_whole() {
        let code = "#![allow(a, reason = xx)]\n#[cfg_attr(x, allow(b[0]))]\nfn disallow() { allow }\n";
        let found: Vec<_> = attributes(code).into_iter().map(|r| &code[r]).collect();
        assert_eq!(found, ["#![allow(a, reason = xx)]", "#[cfg_attr(x, allow(b[0]))]"]);
        assert_eq!(calls(found[1], "allow").collect::<Vec<_>>(), ["(b[0])"]);
    }
}
