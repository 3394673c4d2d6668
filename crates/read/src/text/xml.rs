//! XML of files, within what its parser can bear: that holds every attribute of an element against all others, and every namespace of an
//! element against all of those around it, so that a file of a megabyte could keep it busy for hours.

use roxmltree::{Document, ParsingOptions};

/// Most attributes of an element, and most declarations of namespaces; real files have a dozen.
const MOST: usize = 64;

/// Why a text is refused.
pub(crate) struct Refused {
    /// Where in the text.
    pub(crate) byte: usize,
    /// Line and column from 1, where the parser says so.
    pub(crate) line: Option<(u32, u32)>,
    pub(crate) expected: String,
    pub(crate) found: String,
}

/// Parses a text of at most so many elements, attributes and texts.
pub(crate) fn parse(text: &str, nodes: u32) -> Result<Document<'_>, Refused> {
    check(text)?;
    let options = ParsingOptions { allow_dtd: false, nodes_limit: nodes, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|e| {
        let line = Some((e.pos().row, e.pos().col));
        Refused { byte: 0, line, expected: "XML".to_owned(), found: e.to_string() }
    })
}

/// Counts attributes and namespaces. What is no tag is passed over; what is malformed the parser refuses.
fn check(text: &str) -> Result<(), Refused> {
    let refused = |byte, what: &str| {
        let expected = format!("at most {MOST} {what}");
        let found = "more".to_owned();
        Err(Refused { byte, line: None, expected, found })
    };
    let mut namespaces = 0;
    let mut at = 0;
    while let Some(start) = text[at..].find('<').map(|n| at + n) {
        let rest = &text[start..];
        let passed =
            [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")].into_iter().find(|(open, _)| rest.starts_with(open));
        if let Some((open, end)) = passed {
            let Some(length) = rest[open.len()..].find(end) else { return Ok(()) };
            at = start + open.len() + length + end.len();
            continue;
        }
        let mut quote = None;
        let mut attributes = 0;
        let mut end = rest.len();
        for (i, byte) in rest.bytes().enumerate() {
            match (quote, byte) {
                (None, b'>') => {
                    end = i + 1;
                    break;
                }
                (None, b'=') => attributes += 1,
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, b'x') if rest[i..].starts_with("xmlns") => namespaces += 1,
                (Some(open), byte) if byte == open => quote = None,
                _ => {}
            }
        }
        if attributes > MOST {
            return refused(start, "attributes of an element");
        }
        if namespaces > MOST {
            return refused(start, "declarations of namespaces");
        }
        at = start + end;
    }
    Ok(())
}
