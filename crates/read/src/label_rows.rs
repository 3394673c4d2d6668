//! Tables of labels as text: `.ctbl` of 3D Slicer, the lookup table of FreeSurfer, label descriptions of ITK-SNAP and `.lut` of FSL → a name, a colour
//! and an opacity a label.
//!
//! One label a line, columns between blanks; `#` and `%` begin lines that are comments. The first row tells the columns:
//!
//! - `number name R G B A` (3D Slicer, FreeSurfer): from 0 to 255, A may be missing;
//! - `number R G B A VIS MSH "name"` (ITK-SNAP): R, G and B from 0 to 255, A from 0 to 1; VIS and MSH are 0 where a label is hidden;
//! - `number R G B name` (FSL): from 0 to 1.

use crate::error::{Place, ReadError};
use crate::stream::input::{self, Stream};
use crate::text::{Line, Lines, Word};
use crate::{Fault, ReadParams};
use splat_core::srgb::linear_from_srgb;
use splat_core::text::{counted, escaped, escaped_path};
use std::collections::BTreeMap;
use std::path::Path;

/// Longest name that is kept, bytes: legends cut longer ones.
const LONGEST_NAME: usize = 128;
/// The largest label: beyond it single precision, which voxels have, leaves numbers out.
const LARGEST: f64 = 16_777_216.0;
/// Bytes that a row takes beside its name.
const BYTES_PER_ROW: u64 = 128;

/// What a table says of one label.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelRow {
    /// The whole number of its voxels.
    pub number: u32,
    /// Its name as the file has it, with control characters escaped.
    pub name: String,
    /// Linear Rec.709.
    pub color: [f32; 3],
    /// In \[0, 1\]; 0 where it is hidden.
    pub opacity: f32,
}

/// The rows of a table of labels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LabelRows {
    /// By rising number, each number once.
    pub rows: Vec<LabelRow>,
    /// How the table was understood where that is not plain, one sentence without a full stop each.
    pub remarks: Vec<String>,
}

/// The order of a row's columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Columns {
    /// `number name R G B`, and A where that is so.
    NameFirst { has_alpha: bool },
    /// `number R G B A VIS MSH "name"`.
    ItkSnap,
    /// `number R G B name`.
    Fsl,
}

/// Reads the table of a file, which may be packed by gzip.
///
/// # Errors
/// [`ReadError`] with the file's name, the line, what was expected and what was found.
pub fn label_rows(path: &Path, params: &ReadParams) -> Result<LabelRows, ReadError> {
    let name = escaped_path(path);
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    let rows = Stream::open(path, params).and_then(|stream| whole(stream, params));
    rows.map_err(|e| match e.fault {
        // The folder of a volume is no table of it.
        Fault::FileSystem if path.is_dir() => {
            ReadError::file_system("a table of labels", "a folder", "name a file").in_file(&name)
        }
        _ => e.in_file(&name),
    })
}

/// Reads a table that is in memory; `name` serves messages.
///
/// # Errors
/// [`ReadError`] as [`label_rows`] gives it.
pub fn label_rows_of_bytes(name: &str, content: &[u8], params: &ReadParams) -> Result<LabelRows, ReadError> {
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    whole(Stream::in_memory(content, params), params).map_err(|e| e.in_file(&escaped(name.as_bytes(), usize::MAX)))
}

/// The table of a stream.
fn whole(mut stream: Stream<'_>, params: &ReadParams) -> Result<LabelRows, ReadError> {
    let is_packed = stream.peek(2)? == [0x1f, 0x8b];
    let stream = if is_packed { stream.gunzip() } else { stream };
    table(&stream.rest()?, params)
}

/// The table of a text.
fn table(content: &[u8], params: &ReadParams) -> Result<LabelRows, ReadError> {
    if content.contains(&0) {
        let hint = "tables of labels are text: .ctbl, .lut, .txt or .toml";
        return Err(ReadError::input(Place::File, "a table of labels", "a binary file", hint));
    }
    let mut lines = Lines::new(content);
    let mut columns = None;
    let mut rows: BTreeMap<u32, LabelRow> = BTreeMap::new();
    let mut repeated = Vec::new();
    let mut held = input::Growing::new("the table of labels");
    while let Some(line) = lines.next()? {
        let words: Vec<Word<'_>> = line.words(false).collect();
        let [first, ..] = words.as_slice() else { continue };
        if first.text.starts_with(b"#") || first.text.starts_with(b"%") {
            continue;
        }
        let columns = *columns.get_or_insert_with(|| Columns::of_row(&words));
        let row = columns.row(line, &words)?;
        held.hold((rows.len() as u64 + 1) * (BYTES_PER_ROW + LONGEST_NAME as u64), params)?;
        if let Some(before) = rows.insert(row.number, row) {
            repeated.push(before.number);
        }
    }
    if rows.is_empty() {
        let hint = "a row is `number name R G B A`, such as `3 liver 180 60 50 255`";
        return Err(ReadError::input(Place::File, "a row for each label", "none", hint));
    }
    let mut remarks = Vec::new();
    if let Some(first) = repeated.first() {
        let rows = counted(repeated.len() as u64, "row");
        remarks.push(format!(
            "label {first} stands more than once: of {rows} with a number that comes again the last counts"
        ));
    }
    // FreeSurfer writes transparencies, 0 for all of its labels.
    let are_all_clear = |rows: &BTreeMap<u32, LabelRow>| rows.values().all(|row| row.opacity == 0.0);
    if matches!(columns, Some(Columns::NameFirst { has_alpha: true })) && are_all_clear(&rows) {
        rows.values_mut().for_each(|row| row.opacity = 1.0);
        remarks.push("all alphas are 0, as in tables of FreeSurfer: its labels are opaque".to_owned());
    }
    Ok(LabelRows { rows: rows.into_values().collect(), remarks })
}

impl Columns {
    /// The columns of a table by its first row.
    fn of_row(words: &[Word<'_>]) -> Self {
        let are_numbers = |words: Option<&[Word<'_>]>| {
            words.is_some_and(|words| !words.is_empty() && words.iter().all(|word| word.decimal().is_some()))
        };
        let last = |count: usize| words.len().checked_sub(count).filter(|from| *from >= 2).map(|from| &words[from..]);
        match () {
            () if are_numbers(words.get(1..7)) && words.get(7).is_some_and(|word| word.decimal().is_none()) => {
                Self::ItkSnap
            }
            () if are_numbers(last(4)) => Self::NameFirst { has_alpha: true },
            () if are_numbers(last(3)) => Self::NameFirst { has_alpha: false },
            () if are_numbers(words.get(1..4)) => Self::Fsl,
            () => Self::NameFirst { has_alpha: true },
        }
    }

    /// Its columns in words.
    fn shown(self) -> &'static str {
        match self {
            Self::NameFirst { has_alpha: true } => "`number name R G B A`",
            Self::NameFirst { has_alpha: false } => "`number name R G B`",
            Self::ItkSnap => "`number R G B A VIS MSH \"name\"`",
            Self::Fsl => "`number R G B name`",
        }
    }

    /// The label of a row.
    fn row(self, line: Line<'_>, words: &[Word<'_>]) -> Result<LabelRow, ReadError> {
        let least = match self {
            Self::NameFirst { has_alpha } => 5 + usize::from(has_alpha),
            Self::ItkSnap => 8,
            Self::Fsl => 4,
        };
        if words.len() < least {
            let expected = self.shown();
            let found = counted(words.len() as u64, "column");
            let hint = "rows have the columns of the first one, between blanks; `#` begins a comment";
            return Err(ReadError::input(line.place(), expected, found, hint));
        }
        let number = number(words[0])?;
        // A name may have blanks, so colours are counted from the end.
        let [color, name] = match self {
            Self::NameFirst { has_alpha } => {
                let from = words.len() - 3 - usize::from(has_alpha);
                [from..from + 3, 1..from]
            }
            Self::ItkSnap => [1..4, 7..words.len()],
            Self::Fsl => [1..4, 4..words.len()],
        };
        let full = if self == Self::Fsl { 1.0 } else { 255.0 };
        let mut channels = [0.0; 3];
        for (channel, word) in channels.iter_mut().zip(&words[color]) {
            *channel = linear_from_srgb(within(*word, full)? / full);
        }
        let opacity = match self {
            Self::NameFirst { has_alpha: true } => within(words[words.len() - 1], 255.0)? / 255.0,
            Self::ItkSnap if within(words[5], 1.0)? == 0.0 || within(words[6], 1.0)? == 0.0 => 0.0,
            Self::ItkSnap => within(words[4], 1.0)?,
            _ => 1.0,
        };
        let name: Vec<&[u8]> = words[name].iter().map(|word| word.text).collect();
        let name = name.join(&b' ');
        let unquoted = name.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\"")).unwrap_or(&name);
        Ok(LabelRow { number, name: escaped(unquoted, LONGEST_NAME), color: channels, opacity: opacity as f32 })
    }
}

/// The number of a label.
fn number(word: Word<'_>) -> Result<u32, ReadError> {
    let found = word.decimal().filter(|n| (0.0..=LARGEST).contains(n) && n.fract() == 0.0);
    found.map(|number| number as u32).ok_or_else(|| {
        let hint = "a row is `number name R G B A`, such as `3 liver 180 60 50 255`; `#` begins a comment";
        ReadError::input(word.place(), "the number of a label, whole, from 0 to 16777216", word.shown(), hint)
    })
}

/// A number from 0 to another one.
fn within(word: Word<'_>, most: f64) -> Result<f64, ReadError> {
    word.decimal().filter(|value| (0.0..=most).contains(value)).ok_or_else(|| {
        let hint = "colours and opacities have the range of the table's form, see docs/formats.md";
        ReadError::input(word.place(), format!("a number from 0 to {most}"), word.shown(), hint)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<LabelRows, ReadError> {
        label_rows_of_bytes("a.lut", text.as_bytes(), &ReadParams::default())
    }

    /// Number, name, whether red is full, and opacity of each row.
    fn told(text: &str) -> Vec<(u32, String, bool, f32)> {
        let rows = read(text).expect("a table").rows;
        rows.into_iter().map(|row| (row.number, row.name, row.color == [1.0, 0.0, 0.0], row.opacity)).collect()
    }

    fn row(number: u32, name: &str, opacity: f32) -> (u32, String, bool, f32) {
        (number, name.to_owned(), true, opacity)
    }

    #[test]
    fn every_form_gives_its_names_colours_and_opacities() {
        let slicer = "# Color table file\r\n# 2 values\r\n7 left_lung 255 0 0 0\r\n3 \"the liver\" 255 0 0 255\r\n";
        assert_eq!(told(slicer), [row(3, "the liver", 1.0), row(7, "left_lung", 0.0)]);
        let free_surfer = "#No. Label Name:  R G B A\n\n3 Left-Cerebral-Cortex 255 0 0 0\n4\tX  Y 255 0 0 0";
        assert_eq!(told(free_surfer), [row(3, "Left-Cerebral-Cortex", 1.0), row(4, "X Y", 1.0)]);
        assert!(read(free_surfer).expect("a table").remarks[0].contains("FreeSurfer"));
        let snap =
            "  1 255 0 0  0.5 1 1 \"one of them\"\n  2 255 0 0  1 0 1 \"unseen\"\n 3 255 0 0 1 1 0 \"no mesh\"\n";
        assert_eq!(told(snap), [row(1, "one of them", 0.5), row(2, "unseen", 0.0), row(3, "no mesh", 0.0)]);
        let fsl = "1 1.00000 0.00000 0.00000 Frontal Pole\n2 1 0 0 Insula";
        assert_eq!(told(fsl), [row(1, "Frontal Pole", 1.0), row(2, "Insula", 1.0)]);
        assert_eq!(told("5 12 255 0 0 255\n"), [row(5, "12", 1.0)]);
        assert_eq!(told("5 a b 255 0 0\n"), [row(5, "a b", 1.0)]);
    }

    #[test]
    fn a_number_that_comes_again_is_said_and_the_last_row_counts() {
        let found = read("3 a 255 0 0 255\n3 b 0 0 0 255\n").expect("a table");
        assert_eq!((found.rows.len(), found.rows[0].name.as_str()), (1, "b"));
        assert!(found.remarks[0].contains("label 3 stands more than once"), "{:?}", found.remarks);
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, expected) in [
            ("", "a.lut: expected a row for each label, found none"),
            ("# nothing\n", "a.lut: expected a row for each label, found none"),
            ("index name\n", "a.lut:1: expected `number name R G B A`, found 2 columns"),
            ("1 a 255 0 0 255\n2 b 300 0 0 255", "a.lut:2:5: expected a number from 0 to 255, found '300'"),
            ("1 a 255 0 0 255\n2 b 0 0 0", "a.lut:2: expected `number name R G B A`"),
            ("-1 a 255 0 0 255", "a.lut:1:1: expected the number of a label, whole, from 0 to 16777216, found '-1'"),
            ("1.5 a 255 0 0 255", "a.lut:1:1: expected the number of a label"),
            ("99999999 a 255 0 0 255", "a.lut:1:1: expected the number of a label"),
            ("1 255 0 0 nan 1 1 \"a\"", "a.lut:1:11: expected a number from 0 to 1, found 'nan'"),
            ("\0\0", "a.lut: expected a table of labels, found a binary file"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.starts_with(expected), "{text:?}: {error}");
        }
    }

    #[test]
    fn every_truncation_ends_in_a_table_or_in_an_error() {
        let text = "# x\n 1 255 0 0  0.5 1 1 \"one of them\"\n2 255 0 0 1 1 1 \"b";
        for end in 0..text.len() {
            let _ = read(&text[..end]);
        }
    }
}
