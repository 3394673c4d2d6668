//! Times that rows state by the name of a benchmark: `{a}` is how long it took, `{1 / a}` how often it runs in a second and `{a / b}`
//! how many times as long as another it took; `{a / all}` how long each of its elements took, `{all / a}` how many it does in a second.
//!
//! `docs/papers/NAME-times.csv` holds means by the clock, of criterion or of a benchmark that prints a table of its own. `cargo xtask
//! papers --times` takes those of the last run; a line with a name alone asks for one that is not there yet.

use super::ledger::Row;
use crate::repo::{Outcome, Repo};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const HEAD: &str = "what,low_ms,mean_ms,high_ms,elements";

/// What a benchmark took; none where it was not run.
type Span = Option<Took>;

/// Lower end, mean and upper end, milliseconds; and of how many elements, where it says so.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Took {
    ms: [f64; 3],
    elements: Option<f64>,
}

/// Benchmarks of one file, in its order.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Times(Vec<(String, Span)>);

impl Times {
    /// The times that belong to a ledger.
    pub(crate) fn for_ledger(repo: &Repo, ledger: &str) -> Result<Self, String> {
        let path = ledger.replace(".toml", "-times.csv");
        repo.text(&path).map_or_else(|| Ok(Self::default()), |text| Self::parse(&path, text))
    }

    fn parse(path: &str, text: &str) -> Result<Self, String> {
        let mut lines = text.lines().enumerate();
        if lines.next().is_none_or(|(_, head)| head != HEAD) {
            return Err(format!("{path}:1: expected {HEAD}"));
        }
        let row = |(at, line): (usize, &str)| {
            let wrong =
                || format!("{path}:{}: expected a name in quotes and three or four numbers, or none: {line}", at + 1);
            let (what, rest) = line.strip_prefix('"').and_then(|l| l.split_once('"')).ok_or_else(wrong)?;
            let numbers: Result<Vec<f64>, _> = rest.split(',').filter(|n| !n.is_empty()).map(str::parse).collect();
            match numbers.map_err(|_| wrong())?[..] {
                [] => Ok((what.to_owned(), None)),
                [low, mean, high, ref elements @ ..] if low > 0.0 && elements.len() < 2 => {
                    Ok((what.to_owned(), Some(Took { ms: [low, mean, high], elements: elements.first().copied() })))
                }
                _ => Err(wrong()),
            }
        };
        lines.map(row).collect::<Result<_, _>>().map(Self)
    }

    /// A text with its times in place of their names.
    pub(crate) fn fill(&self, text: &str) -> Result<String, String> {
        let mut parts = text.split('{');
        let mut filled = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let (name, rest) = part.split_once('}').ok_or_else(|| format!("no }} after {{{part}"))?;
            filled.push_str(&match name.split_once(" / ") {
                None => duration(self.mean(name)?),
                Some(("1", one)) => rate(1e3 / self.mean(one)?),
                Some(("all", one)) => rate(1e3 * self.elements(one)? / self.mean(one)?),
                Some((one, "all")) => duration(self.mean(one)? / self.elements(one)?),
                Some((one, other)) => format!("{:.2}", self.mean(one)? / self.mean(other)?),
            });
            filled.push_str(rest);
        }
        Ok(filled)
    }

    fn mean(&self, name: &str) -> Result<f64, String> {
        self.took(name).map(|took| took.ms[1])
    }

    fn elements(&self, name: &str) -> Result<f64, String> {
        self.took(name)?.elements.ok_or_else(|| format!("{{{name}}} does not say of how many elements"))
    }

    fn took(&self, name: &str) -> Result<Took, String> {
        let found = self.0.iter().find(|(what, _)| what == name);
        let (_, span) = found.ok_or_else(|| format!("no benchmark {{{name}}} in its -times.csv"))?;
        span.ok_or_else(|| format!("{{{name}}} was not run yet"))
    }
}

/// Why a row's number is not one that a benchmark wrote, where it names one: it has no time by its name, or one by hand.
pub(crate) fn by_hand(row: &Row) -> Option<&'static str> {
    let named = row.code.iter().any(|place| place.starts_with("benches/benches/"));
    if named && !format!("{}{}", row.ours, row.reason).contains('{') {
        return Some("names a benchmark, and no time that it left");
    }
    let words: Vec<&str> =
        row.ours.split_whitespace().map(|word| word.trim_end_matches([',', ';', ':', ')'])).collect();
    let is_time = |pair: &[&str]| {
        pair[0].starts_with(|c: char| c.is_ascii_digit()) && ["ns", "µs", "ms", "s", "seconds"].contains(&pair[1])
    };
    words.windows(2).any(is_time).then_some("has a time that stands in no -times.csv")
}

fn duration(ms: f64) -> String {
    match ms {
        1e3.. => format!("{} s", significant(1e-3 * ms)),
        1.0.. => format!("{} ms", significant(ms)),
        1e-3.. => format!("{} µs", significant(1e3 * ms)),
        _ => format!("{} ns", significant(1e6 * ms)),
    }
}

fn rate(a_second: f64) -> String {
    match a_second {
        1e6.. => format!("{} million", significant(1e-6 * a_second)),
        1e5.. => format!("{} thousand", significant(1e-3 * a_second)),
        _ => significant(a_second),
    }
}

/// Three digits, and no fewer than an integer has.
fn significant(x: f64) -> String {
    let digits = if x >= 100.0 { 0 } else { usize::from(x < 10.0) + 1 };
    format!("{x:.digits$}")
}

/// Takes what criterion measured last into every file that names it.
pub(crate) fn refresh(repo: &Repo) -> Outcome {
    let measured = measured(&repo.root.join("target/criterion"))?;
    let mut said = Vec::new();
    for (path, text) in repo.texts().filter(|(path, _)| path.ends_with("-times.csv")) {
        let Times(mut rows) = Times::parse(path, text)?;
        let mut taken = 0;
        for (what, span) in &mut rows {
            if let Some(found) = measured.get(what) {
                *span = Some(*found);
                taken += 1;
            }
        }
        let mut csv = format!("{HEAD}\n");
        for (what, span) in &rows {
            let ms = span.map_or(",,".to_owned(), |took| took.ms.map(|ms| format!("{ms:.4}")).join(","));
            let elements = span.and_then(|took| took.elements).map_or(String::new(), |n| n.to_string());
            let _ = writeln!(csv, "\"{what}\",{ms},{elements}");
        }
        std::fs::write(repo.root.join(path), csv).map_err(|e| format!("{path}: {e}"))?;
        said.push(format!("{path}: {taken} of {} benchmarks taken from target/criterion", rows.len()));
    }
    Ok(said.join("\n"))
}

/// All that lies in criterion's folder, by the whole name.
fn measured(folder: &Path) -> Result<BTreeMap<String, Took>, String> {
    let mut found = BTreeMap::new();
    let mut folders: Vec<PathBuf> = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}; run a benchmark", folder.display()))?;
        folders.extend(entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()));
        let text = |name: &str| std::fs::read_to_string(folder.join(name)).ok();
        if !folder.ends_with("new") {
            continue;
        }
        let (Some(name), Some(estimates)) = (text("benchmark.json"), text("estimates.json")) else { continue };
        let ms = span(&estimates).ok_or_else(|| format!("{}: estimates.json has no mean", folder.display()))?;
        let elements = after(&name, "\"Elements\":").and_then(|rest| rest.split(['}', ',']).next()?.parse().ok());
        if let Some(name) = after(&name, "\"full_id\":\"").and_then(|rest| rest.split('"').next()) {
            found.insert(name.to_owned(), Took { ms, elements });
        }
    }
    Ok(found)
}

/// The mean and its 95 % interval, from nanoseconds.
fn span(estimates: &str) -> Option<[f64; 3]> {
    let mean = after(estimates, "\"mean\":")?;
    let number = |key: &str| after(mean, key)?.split([',', '}']).next()?.parse::<f64>().ok().map(|ns| 1e-6 * ns);
    Some([number("\"lower_bound\":")?, number("\"point_estimate\":")?, number("\"upper_bound\":")?])
}

fn after<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    text.split_once(key).map(|(_, rest)| rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CSV: &str = "what,low_ms,mean_ms,high_ms,elements\n\"sort/1, exact\",1.9,2,2.1,4000\n\"sort/2\",7,8.125,9,\n\
        \"sort/3\",2000,2345.6,2400,1e6\n\"sort/4\",,,,\n";

    #[test]
    fn times_rates_and_ratios_take_the_place_of_names() {
        let times = Times::parse("t", CSV).expect("well formed");
        let fill = |text| times.fill(text);
        assert_eq!(fill("{sort/1, exact} and {sort/3}, no more"), Ok("2.00 ms and 2.35 s, no more".to_owned()));
        assert_eq!(fill("{1 / sort/2} a second"), Ok("123 a second".to_owned()));
        assert_eq!(fill("{all / sort/1, exact} and {sort/1, exact / all}"), Ok("2.00 million and 500 ns".to_owned()));
        assert_eq!(fill("{sort/3 / all}, {all / sort/3}"), Ok("2.35 µs, 426 thousand".to_owned()));
        assert_eq!(fill("{all / sort/2}"), Err("{sort/2} does not say of how many elements".to_owned()));
        assert_eq!(fill("{sort/2 / sort/1, exact} times"), Ok("4.06 times".to_owned()));
        assert_eq!(fill("none"), Ok("none".to_owned()));
        assert_eq!(fill("{sort/9}"), Err("no benchmark {sort/9} in its -times.csv".to_owned()));
        assert_eq!(fill("{sort/4}"), Err("{sort/4} was not run yet".to_owned()));
        assert_eq!(fill("a {sort/1"), Err("no } after {sort/1".to_owned()));
    }

    #[test]
    fn faulty_lines_are_named() {
        assert_eq!(Times::parse("t", "what\n"), Err("t:1: expected what,low_ms,mean_ms,high_ms,elements".to_owned()));
        for line in ["a,1,2,3", "\"a\",1,2", "\"a\",1,x,3", "\"a\",0,1,2", "\"a\",1,2,3,4,5"] {
            let why = Times::parse("t", &format!("{HEAD}\n{line}\n")).expect_err("not a row");
            assert!(why.starts_with("t:2: expected a name in quotes"), "{why}");
        }
    }

    #[test]
    fn criterion_s_mean_is_found() {
        let json = "{\"mean\":{\"confidence_interval\":{\"confidence_level\":0.95,\"lower_bound\":1000000.0,\
                    \"upper_bound\":3000000.0},\"point_estimate\":2000000.0,\"standard_error\":1.0},\"median\":{}}";
        assert_eq!(span(json), Some([1.0, 2.0, 3.0]));
        assert_eq!(span("{}"), None);
    }
}
