//! The rows of one paper, as `docs/papers/NAME.toml` holds them.

use crate::toml_lines::{lines, string};

/// What became of a claim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    Holds,
    Differs,
    /// Nothing of the kind exists here, such as a pass of a graphics board.
    NotBuilt,
    NotReproducible,
    NotMeasured,
}

impl Verdict {
    pub(crate) const ALL: [Self; 5] =
        [Self::Holds, Self::Differs, Self::NotBuilt, Self::NotReproducible, Self::NotMeasured];

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Differs => "differs",
            Self::NotBuilt => "not built",
            Self::NotReproducible => "not reproducible",
            Self::NotMeasured => "not measured",
        }
    }
}

/// One equation or claim.
#[derive(Debug, PartialEq)]
pub(crate) struct Row {
    /// Where the paper says it: `Eq. 1`, `Table 1`, `§4.2`.
    pub(crate) id: String,
    /// What it says, in our words.
    pub(crate) claim: String,
    /// `path::item`, each.
    pub(crate) code: Vec<String>,
    /// Names of test functions; `ts06_*` stands for all that begin so.
    pub(crate) tests: Vec<String>,
    /// Our number; `—` where there is none.
    pub(crate) ours: String,
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
}

/// One paper.
#[derive(Debug, PartialEq)]
pub(crate) struct Ledger {
    pub(crate) title: String,
    pub(crate) authors: String,
    pub(crate) year: String,
    /// What a reader of the table must know.
    pub(crate) note: String,
    pub(crate) rows: Vec<Row>,
}

/// The keys of one table of the file, with the line that the first of them stands on.
type Fields = (usize, Vec<(String, String)>);

impl Ledger {
    /// Reads a file; every key of a row must be there, and no other.
    pub(crate) fn parse(path: &str, text: &str) -> Result<Self, String> {
        let mut tables: Vec<(usize, &str, Fields)> = Vec::new();
        for line in lines(text) {
            let value = string(line.value).map_err(|e| format!("{path}:{}: {e}", line.number))?;
            if tables.last().is_none_or(|(heading, ..)| *heading != line.heading) {
                tables.push((line.heading, line.table, (line.number, Vec::new())));
            }
            let (_, _, (_, fields)) = tables.last_mut().expect("invariant: pushed above");
            fields.push((line.key.to_owned(), value));
        }
        let mut tables = tables.into_iter();
        let Some((_, "paper", paper)) = tables.next() else { return Err(format!("{path}: expected [paper] first")) };
        let [title, authors, year, note] = take(path, paper, ["title", "authors", "year", "note"])?;
        let mut rows = Vec::new();
        for (_, table, fields) in tables {
            if table != "row" {
                return Err(format!("{path}:{}: expected [[row]], found [{table}]", fields.0));
            }
            rows.push(row(path, fields)?);
        }
        Ok(Self { title, authors, year, note, rows })
    }
}

fn row(path: &str, fields: Fields) -> Result<Row, String> {
    let line = fields.0;
    let keys = ["id", "claim", "code", "test", "ours", "verdict", "reason"];
    let [id, claim, code, test, ours, verdict, reason] = take(path, fields, keys)?;
    let verdict = Verdict::ALL
        .into_iter()
        .find(|v| v.words() == verdict)
        .ok_or_else(|| format!("{path}:{line}: unknown verdict {verdict}"))?;
    if reason.is_empty() || claim.is_empty() {
        return Err(format!("{path}:{line}: {id} needs a claim and a reason"));
    }
    Ok(Row { id, claim, code: list(&code), tests: list(&test), ours, verdict, reason })
}

fn list(words: &str) -> Vec<String> {
    words.split(',').map(str::trim).filter(|w| !w.is_empty() && *w != "—").map(str::to_owned).collect()
}

/// The values of exactly these keys.
fn take<const N: usize>(path: &str, table: Fields, keys: [&str; N]) -> Result<[String; N], String> {
    let (line, fields) = table;
    if let Some((stray, _)) = fields.iter().find(|(key, _)| !keys.contains(&key.as_str())) {
        return Err(format!("{path}:{line}: unknown key {stray}"));
    }
    let mut values = [const { String::new() }; N];
    for (value, key) in values.iter_mut().zip(keys) {
        let mut of_key = fields.iter().filter(|(k, _)| k == key);
        match (of_key.next(), of_key.next()) {
            (Some((_, found)), None) => value.clone_from(found),
            (None, _) => return Err(format!("{path}:{line}: {key} is missing")),
            _ => return Err(format!("{path}:{line}: {key} stands twice")),
        }
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "[paper]\ntitle = \"T\"\nauthors = \"A\"\nyear = \"2007\"\nnote = \"N\"\n";
    const ROW: &str = "[[row]]\nid = \"Eq. 1\"\nclaim = \"c\"\ncode = \"a.rs::f, b.rs::g\"\ntest = \"—\"\nours = \"1\"\n\
        verdict = \"not measured\"\nreason = \"r\"\n";

    #[test]
    fn rows_are_read() {
        let ledger = Ledger::parse("p", &[HEAD, ROW, ROW].concat()).expect("well formed");
        assert_eq!(ledger.rows.len(), 2);
        let row = &ledger.rows[1];
        assert_eq!((row.code.len(), row.tests.len(), row.verdict), (2, 0, Verdict::NotMeasured));
    }

    #[test]
    fn every_verdict_is_read_by_its_words() {
        for verdict in Verdict::ALL {
            let text = [HEAD, &ROW.replace("not measured", verdict.words())].concat();
            assert_eq!(Ledger::parse("p", &text).expect("well formed").rows[0].verdict, verdict);
        }
        let words = Verdict::ALL.map(Verdict::words);
        assert_eq!(words, ["holds", "differs", "not built", "not reproducible", "not measured"]);
    }

    #[test]
    fn malformed_rows_are_refused_with_their_line() {
        let cases = [
            ("claim = \"c\"\n", "", "p:7: claim is missing"),
            ("\"not measured\"", "\"maybe\"", "p:7: unknown verdict maybe"),
            ("ours", "hours", "p:7: unknown key hours"),
            ("id", "ours", "p:7: id is missing"),
            ("reason = \"r\"", "reason = \"\"", "p:7: Eq. 1 needs a claim and a reason"),
            ("\"Eq. 1\"", "Eq. 1", "p:7: expected a string in quotes, found Eq. 1"),
            ("[[row]]", "[[column]]", "p:7: expected [[row]], found [column]"),
        ];
        for (from, to, expected) in cases {
            let text = [HEAD, &ROW.replacen(from, to, 1)].concat();
            assert_eq!(Ledger::parse("p", &text), Err(expected.to_owned()));
        }
        assert_eq!(Ledger::parse("p", ROW), Err("p: expected [paper] first".to_owned()));
    }
}
