//! Tables of labels as text: `.ctbl` of 3D Slicer, the lookup table of FreeSurfer, label descriptions of ITK-SNAP and `.lut` of FSL → a name, a colour
//! and an opacity a label.
//!
//! One label a line, columns between blanks; `#` and `%` begin lines that are comments. The first row tells the columns:
//!
//! - `number name R G B A` (3D Slicer, FreeSurfer): from 0 to 255, A may be missing;
//! - `number R G B A VIS MSH "name"` (ITK-SNAP): R, G and B from 0 to 255, A from 0 to 1; VIS and MSH are 0 where a label is hidden;
//! - `number R G B name` (FSL): from 0 to 1.
//!
//! A table of one of the first two forms whose colours are all at most 1 has them from 0 to 1.

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

/// A row as it is written.
struct Written {
    number: u32,
    name: String,
    /// R, G and B, and A, in the range of the form.
    channels: [f64; 3],
    alpha: f64,
    is_hidden: bool,
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
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    if is_utf16(content) {
        let hint = "save the table in UTF-8";
        return Err(ReadError::input(Place::File, "a table of labels in UTF-8", "a text in UTF-16", hint));
    }
    if content.contains(&0) {
        let hint = "tables of labels are text: .ctbl, .lut, .txt or .toml";
        return Err(ReadError::input(Place::File, "a table of labels", "a binary file", hint));
    }
    let mut lines = Lines::new(content);
    let mut columns = None;
    let mut rows: BTreeMap<u32, Written> = BTreeMap::new();
    let mut repeated = Vec::new();
    let mut held = input::Growing::new("the table of labels");
    while let Some(line) = lines.next()? {
        let words: Vec<Word<'_>> = line.words(false).collect();
        let [first, ..] = words.as_slice() else { continue };
        if first.text.starts_with(b"#") || first.text.starts_with(b"%") {
            continue;
        }
        let columns = *columns.get_or_insert_with(|| Columns::of_row(&words));
        let row = columns.row(line, &words).map_err(|error| of_separators(line).unwrap_or(error))?;
        held.hold((rows.len() as u64 + 1) * (BYTES_PER_ROW + LONGEST_NAME as u64), params)?;
        if let Some(before) = rows.insert(row.number, row) {
            repeated.push(before.number);
        }
    }
    let Some(columns) = columns else {
        let hint = "a row is `number name R G B A`, such as `3 liver 180 60 50 255`";
        return Err(ReadError::input(Place::File, "a row for each label", "none", hint));
    };
    let mut remarks = Vec::new();
    if let Some(first) = repeated.first() {
        let rows = counted(repeated.len() as u64, "row");
        remarks.push(format!(
            "label {first} stands more than once: of {rows} with a number that comes again the last counts"
        ));
    }
    let [mut full, mut full_alpha] = columns.full();
    let colors = || rows.values().flat_map(|row| row.channels);
    // Bytes of a whole table that are all 0 or 1 would be black.
    if full > 1.0 && colors().all(|channel| channel <= 1.0) && colors().any(|channel| channel > 0.0) {
        full = 1.0;
        let are_shares = rows.values().all(|row| row.alpha <= 1.0);
        full_alpha = if are_shares { 1.0 } else { full_alpha };
        let alphas =
            if columns == (Columns::NameFirst { has_alpha: true }) && are_shares { ", and alphas too" } else { "" };
        remarks.push(format!("no colour is above 1: colours are read from 0 to 1{alphas}, not from 0 to 255"));
    }
    // FreeSurfer writes transparencies, 0 for all of its labels.
    if columns == (Columns::NameFirst { has_alpha: true }) && rows.values().all(|row| row.alpha == 0.0) {
        rows.values_mut().for_each(|row| row.alpha = full_alpha);
        remarks.push("all alphas are 0, as in tables of FreeSurfer: its labels are opaque".to_owned());
    }
    let finished = |row: Written| LabelRow {
        number: row.number,
        name: row.name,
        color: row.channels.map(|channel| linear_from_srgb(channel / full)),
        opacity: if row.is_hidden { 0.0 } else { (row.alpha / full_alpha) as f32 },
    };
    Ok(LabelRows { rows: rows.into_values().map(finished).collect(), remarks })
}

/// Whether a text is UTF-16: it has its mark, or every other byte of its beginning is 0.
fn is_utf16(content: &[u8]) -> bool {
    /// Bytes that are looked at.
    const BEGINNING: usize = 64;
    let pairs = || content.chunks_exact(2).take(BEGINNING / 2);
    let is_of = |zero: usize| pairs().count() >= 2 && pairs().all(|pair| pair[zero] == 0 && pair[1 - zero] != 0);
    content.starts_with(b"\xff\xfe") || content.starts_with(b"\xfe\xff") || is_of(0) || is_of(1)
}

/// The error of a row whose columns lie between commas or semicolons.
fn of_separators(line: Line<'_>) -> Option<ReadError> {
    /// Fewer are those of a name.
    const LEAST: usize = 3;
    let count = |separator: u8| line.text.iter().filter(|byte| **byte == separator).count();
    let (separator, named) =
        [(b',', "commas"), (b';', "semicolons")].into_iter().find(|(byte, _)| count(*byte) >= LEAST)?;
    let hint = "write blanks or tabulators in the place of commas and semicolons, and leave out a row of headings";
    let found = format!("{named} ('{}')", char::from(separator));
    Some(ReadError::input(line.place(), "columns between blanks, such as `3 liver 180 60 50 255`", found, hint))
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

    /// The greatest number of a colour and of an alpha.
    fn full(self) -> [f64; 2] {
        match self {
            Self::NameFirst { .. } => [255.0; 2],
            Self::ItkSnap => [255.0, 1.0],
            Self::Fsl => [1.0; 2],
        }
    }

    /// The label of a row.
    fn row(self, line: Line<'_>, words: &[Word<'_>]) -> Result<Written, ReadError> {
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
        let [full, full_alpha] = self.full();
        let mut channels = [0.0; 3];
        for (channel, word) in channels.iter_mut().zip(&words[color]) {
            *channel = self.within(*word, full)?;
        }
        let mut is_hidden = false;
        let alpha = match self {
            Self::NameFirst { has_alpha: true } => self.within(words[words.len() - 1], full_alpha)?,
            Self::ItkSnap => {
                is_hidden = self.within(words[5], 1.0)? == 0.0 || self.within(words[6], 1.0)? == 0.0;
                self.within(words[4], full_alpha)?
            }
            _ => full_alpha,
        };
        let name: Vec<&[u8]> = words[name].iter().map(|word| word.text).collect();
        let name = name.join(&b' ');
        let unquoted = name.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\"")).unwrap_or(&name);
        Ok(Written { number, name: escaped(unquoted, LONGEST_NAME), channels, alpha, is_hidden })
    }

    /// A number from 0 to another one.
    fn within(self, word: Word<'_>, most: f64) -> Result<f64, ReadError> {
        word.decimal().filter(|value| (0.0..=most).contains(value)).ok_or_else(|| {
            let hint = match self {
                Self::NameFirst { .. } => "rows `number name R G B A` have colours and alphas from 0 to 255",
                Self::ItkSnap => "rows `number R G B A VIS MSH \"name\"` have colours from 0 to 255, and A, VIS and MSH from 0 to 1",
                Self::Fsl => "rows `number R G B name` have colours from 0 to 1; colours from 0 to 255 stand behind the name, `number name R G B`",
            };
            ReadError::input(word.place(), format!("a number from 0 to {most}"), word.shown(), hint)
        })
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
    fn colours_of_at_most_1_are_read_from_0_to_1_in_every_form() {
        for (text, opacity) in [
            ("3 liver 1 0.5 0 1\n4 spleen 0 0 1 0.5\n", 1.0),
            ("3 liver 1 0.5 0 255\n", 1.0),
            ("3 liver 1 0.5 0 0\n", 1.0),
            ("3 liver 1 0.5 0\n", 1.0),
            ("3 1 0.5 0 0.25 1 1 \"liver\"\n", 0.25),
        ] {
            let found = read(text).expect(text);
            assert_eq!((found.rows[0].color, found.rows[0].opacity), ([1.0, linear_from_srgb(0.5), 0.0], opacity));
            assert!(found.remarks[0].starts_with("no colour is above 1"), "{text}: {:?}", found.remarks);
        }
        for text in ["0 Unknown 0 0 0 0\n", "3 liver 1 0 0 255\n4 spleen 2 0 0 255\n", "1 1 0.5 0 Frontal Pole\n"] {
            let found = read(text).expect(text);
            assert!(found.remarks.iter().all(|remark| !remark.contains("colour")), "{text}: {:?}", found.remarks);
        }
    }

    #[test]
    fn other_encodings_and_separators_are_named() {
        let text = "3 liver 255 0 0 255\n";
        let [low, high] =
            [u16::to_le_bytes, u16::to_be_bytes].map(|bytes| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>());
        for content in [[&b"\xff\xfe"[..], &low].concat(), [&b"\xfe\xff"[..], &high].concat(), low, high] {
            let error = label_rows_of_bytes("a.lut", &content, &ReadParams::default()).expect_err("UTF-16").to_string();
            assert!(error.starts_with("a.lut: expected a table of labels in UTF-8, found a text in UTF-16"), "{error}");
        }
        assert_eq!(read(&format!("\u{feff}{text}")).expect("a mark of UTF-8").rows[0].number, 3);
        for (text, found) in [
            ("number,name,R,G,B,A\n3,liver,255,0,0,255\n", "a.lut:1: expected columns between blanks"),
            ("# a\n3, liver, 255, 0, 0, 255\n", "a.lut:2: expected columns between blanks"),
            ("3 liver,255,0,0,255\n", "found commas"),
            ("3;liver;255;0;0;255\n", "found semicolons"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains(found), "{error}");
        }
        assert_eq!(read("3 left, right, up, down 255 0 0\n").expect("a name").rows[0].name, "left, right, up, down");
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
