//! The arrays of a legacy VTK file: where they lie, without reading them.

use super::{HINT, next, wrong};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::text::{Line, Lines, Word, Words};
use crate::volumes::cells::Numbers;
use crate::volumes::selection::{Candidate, GHOSTS, Selection, Value, chosen_array, shown_column};
use crate::volumes::voxels::Kind;
use crate::{Notes, ReadParams};
use splat_core::text::{counted, escaped};
use std::ops::Range;

/// Most arrays, each name of which is held against all others; real files have some dozens.
const MAX_ARRAYS: usize = 4096;

/// What an array belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Owner {
    Points,
    Cells,
    /// Nothing in particular.
    File,
}

/// An array of numbers.
#[derive(Debug, Clone)]
pub(super) struct Array {
    pub(super) name: String,
    pub(super) owner: Owner,
    /// Numbers of one point or cell, and how many there are of those.
    pub(super) numbers: u64,
    pub(super) tuples: u64,
    pub(super) kind: Kind,
    /// Where it is announced.
    pub(super) place: Place,
    /// Its bytes, which begin in the line of this number.
    pub(super) data: Range<usize>,
    pub(super) line: u64,
    /// Cells that it tells of; 0 where it says nothing of them.
    pub(super) cells: u64,
    role: Role,
}

/// An array of the cells themselves, as it is announced.
pub(super) struct Part<'n> {
    pub(super) name: &'n str,
    pub(super) kind: Kind,
    /// Numbers of a tuple.
    pub(super) numbers: u64,
    pub(super) tuples: u64,
    pub(super) cells: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Scalars,
    /// Scalars of bytes, which stand in a text as shares of 255.
    Colors,
    Normals,
    /// Vectors and tensors, of which the length can be drawn.
    Vectors,
    Field,
    /// Of the cells themselves.
    Part,
    Other,
}

impl Array {
    /// Whether it may be colours of three or four bytes.
    pub(super) fn is_of_colors(&self) -> bool {
        self.kind == Kind::U8 && matches!(self.numbers, 3 | 4)
    }

    /// Its numbers.
    pub(super) fn read(&self, content: &[u8], is_binary: bool, reading: &Reading<'_>) -> Result<Numbers, ReadError> {
        // It was found to lie in the file.
        let count = self.numbers * self.tuples;
        let mut numbers = Numbers::room(count, reading)?;
        if is_binary {
            numbers.all.extend(self.kind.numbers(&content[self.data.clone()], true));
            return Ok(numbers);
        }
        for word in Words::new(content, self.data.start, self.line).take(count as usize) {
            // NaN is a gap in a field; places and counts refuse it where they are made.
            numbers.all.push(word.decimal().filter(|v| v.is_nan()).map_or_else(|| word.number(), Ok)?);
        }
        Ok(numbers)
    }

    /// Which of the numbers of a tuple is its value: `value`, or what one number or a colour is.
    pub(super) fn selection(
        &self,
        value: Option<Value>,
        place: Place,
        params: &ReadParams,
        notes: &mut Notes,
    ) -> Result<Selection, ReadError> {
        let selection = Selection::of_frames(1, place, params, notes)?;
        match value {
            Some(value) => Ok(selection.with_value(self.numbers, value)),
            None => selection.with_numbers(self.numbers, self.kind, false, self.place, notes),
        }
    }

    /// Whether a text has shares of 255 in the place of its numbers.
    pub(super) fn is_of_shares(&self) -> bool {
        self.role == Role::Colors
    }
}

/// The arrays found so far.
pub(super) struct Arrays<'a> {
    content: &'a [u8],
    is_binary: bool,
    owner: Owner,
    tuples: u64,
    found: Vec<Array>,
}

impl<'a> Arrays<'a> {
    pub(super) fn new(content: &'a [u8], is_binary: bool) -> Self {
        Self { content, is_binary, owner: Owner::File, tuples: 0, found: Vec::new() }
    }

    /// Those of points, cells and the file.
    pub(super) fn all(&self) -> impl Iterator<Item = &Array> {
        self.found.iter().filter(|array| array.role != Role::Part)
    }

    /// An array of the cells themselves by its name.
    pub(super) fn part(&self, name: &str) -> Option<&Array> {
        self.found.iter().find(|array| array.role == Role::Part && array.name == name)
    }

    /// Normals of the points.
    pub(super) fn normals(&self) -> Option<&Array> {
        self.found.iter().find(|array| array.owner == Owner::Points && array.role == Role::Normals)
    }

    /// Colours of the points.
    pub(super) fn colors(&self) -> Option<&Array> {
        let colors = || self.found.iter().filter(|array| array.owner == Owner::Points && array.is_of_colors());
        colors().find(|array| array.role == Role::Colors).or_else(|| colors().next())
    }

    /// The array that is read, and the part of a vector that is the value: of the points where there are scalars or a field, else of the cells.
    pub(super) fn chosen(
        &self,
        params: &ReadParams,
        notes: &mut Notes,
    ) -> Result<Option<(&Array, Option<Value>)>, ReadError> {
        let (offered, candidates) = self.offered();
        let place = offered.first().map_or(Place::File, |array| array.place);
        Ok(chosen_array(&candidates, place, params, notes)?.map(|chosen| (offered[chosen.rank], chosen.value)))
    }

    /// The column of a mesh that is shown where nobody names one.
    pub(super) fn shown_column(&self, has_bodies: bool) -> Option<String> {
        shown_column(&self.offered().1, has_bodies)
    }

    /// The arrays that can be a field, those of points before those of cells, and the same as far as choosing needs them.
    fn offered(&self) -> (Vec<&Array>, Vec<Candidate>) {
        let is_field = |array: &&Array| {
            matches!(array.role, Role::Scalars | Role::Colors | Role::Vectors | Role::Field) && array.name != GHOSTS
        };
        let owned_by = |owner: Owner| self.found.iter().filter(move |array| array.owner == owner).filter(is_field);
        let offered: Vec<&Array> = owned_by(Owner::Points).chain(owned_by(Owner::Cells)).collect();
        let first = offered.iter().find(|array| array.role != Role::Vectors).map(|array| array.owner);
        let candidate = |array: &&Array| Candidate {
            name: array.name.clone(),
            numbers: array.numbers,
            kind: Some(array.kind),
            is_named: Some(array.owner) == first && matches!(array.role, Role::Scalars | Role::Colors),
            is_of_cells: array.owner == Owner::Cells,
        };
        let candidates = offered.iter().map(candidate).collect();
        (offered, candidates)
    }

    /// Takes a line, and passes over the arrays that it announces.
    pub(super) fn take(&mut self, line: Line<'a>, lines: &mut Lines<'a>) -> Result<(), ReadError> {
        let words: Vec<Word<'_>> = line.words(false).collect();
        let whole = |i: usize| whole(words.get(i), line);
        let keyword = words.first().map(|w| w.text.to_ascii_uppercase()).unwrap_or_default();
        let (role, numbers) = match keyword.as_slice() {
            b"POINT_DATA" | b"CELL_DATA" => {
                self.owner = if keyword == b"POINT_DATA" { Owner::Points } else { Owner::Cells };
                self.tuples = whole(1)?;
                return Ok(());
            }
            b"METADATA" => {
                while lines.next()?.is_some_and(|line| !line.text.trim_ascii().is_empty()) {}
                return Ok(());
            }
            b"FIELD" => return self.field(whole(2)?, lines),
            b"LOOKUP_TABLE" => return self.pass(&words, line, Kind::U8, 4, whole(2)?, Role::Other, lines),
            // What VTK writes of bytes.
            b"COLOR_SCALARS" => {
                return self.pass(&words, line, Kind::U8, whole(2)?, self.tuples, Role::Colors, lines);
            }
            b"SCALARS" => (Role::Scalars, if words.len() > 3 { whole(3)? } else { 1 }),
            b"VECTORS" => (Role::Vectors, 3),
            b"NORMALS" => (Role::Normals, 3),
            b"TENSORS" => (Role::Vectors, 9),
            b"TENSORS6" => (Role::Vectors, 6),
            b"TEXTURE_COORDINATES" => (Role::Other, whole(2)?),
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => (Role::Other, 1),
            _ => return Err(wrong(line, "SCALARS, FIELD or another keyword of this dataset")),
        };
        let kind = kind(words.get(if keyword == b"TEXTURE_COORDINATES" { 3 } else { 2 }), line)?;
        if keyword == b"SCALARS" {
            self.pass_table_name(lines)?;
        }
        self.pass(&words, line, kind, numbers, self.tuples, role, lines)
    }

    /// The arrays of a field.
    fn field(&mut self, arrays: u64, lines: &mut Lines<'a>) -> Result<(), ReadError> {
        let mut left = arrays;
        while left > 0 {
            let Some(line) = next(lines)? else {
                return Err(ReadError::input(lines.end(), format!("{left} more arrays"), "the end of the file", HINT));
            };
            if line.text.trim_ascii().eq_ignore_ascii_case(b"METADATA") {
                self.take(line, lines)?;
                continue;
            }
            let words: Vec<Word<'_>> = line.words(false).collect();
            let numbers = whole(words.get(1), line)?;
            let tuples = whole(words.get(2), line)?;
            // The name stands where other arrays have their keyword.
            let named = [&words[..1], &words].concat();
            self.pass(&named, line, kind(words.get(3), line)?, numbers, tuples, Role::Field, lines)?;
            left -= 1;
        }
        Ok(())
    }

    /// Takes an array of the cells themselves.
    pub(super) fn take_part(&mut self, line: Line<'_>, part: Part<'_>, lines: &mut Lines<'a>) -> Result<(), ReadError> {
        if self.part(part.name).is_some() {
            return Err(wrong(line, &format!("{} once", part.name)));
        }
        self.pass(&[], line, part.kind, part.numbers, part.tuples, Role::Part, lines)?;
        if let Some(array) = self.found.last_mut() {
            part.name.clone_into(&mut array.name);
            array.cells = part.cells;
        }
        Ok(())
    }

    /// Whether the next line begins with a word.
    pub(super) fn continues_with(&self, word: &str, lines: &Lines<'_>) -> bool {
        let next = &self.content[lines.offset()..];
        next.get(..word.len()).is_some_and(|found| found.eq_ignore_ascii_case(word.as_bytes()))
    }

    /// `LOOKUP_TABLE NAME` belongs to the scalars before it; old files leave it out.
    fn pass_table_name(&self, lines: &mut Lines<'a>) -> Result<(), ReadError> {
        if self.continues_with("LOOKUP_TABLE", lines) {
            lines.next()?;
        }
        Ok(())
    }

    /// Passes over an array of so many numbers a tuple and so many tuples, whose name is the second word.
    fn pass(
        &mut self,
        words: &[Word<'_>],
        line: Line<'_>,
        kind: Kind,
        numbers: u64,
        tuples: u64,
        role: Role,
        lines: &mut Lines<'a>,
    ) -> Result<(), ReadError> {
        let mut data = lines.words();
        let (start, first) = data.end();
        let count = numbers.checked_mul(tuples).filter(|n| *n <= self.content.len() as u64);
        let bytes = count.and_then(|n| n.checked_mul(if self.is_binary { kind.size() } else { 1 }));
        let Some((count, bytes)) = count.zip(bytes).filter(|(_, bytes)| *bytes <= data.left() as u64) else {
            let expected = format!("at most {} bytes of data", data.left());
            let found = format!("{tuples} times {numbers} numbers of {} bytes", kind.size());
            return Err(ReadError::input(line.place(), expected, found, HINT));
        };
        let (end, last) = if self.is_binary {
            (start + bytes as usize, first)
        } else {
            for passed in 0..count {
                if !data.next().is_some_and(|word| may_be_number(word.text)) {
                    let expected = counted(count, "number");
                    let found = passed.to_string();
                    return Err(ReadError::input(line.place(), expected, found, HINT));
                }
            }
            data.end()
        };
        if self.found.len() == MAX_ARRAYS {
            return Err(wrong(line, &format!("at most {MAX_ARRAYS} arrays")));
        }
        lines.go_to(end, last);
        let name = words.get(1).map(|w| escaped(w.text, 40)).unwrap_or_default();
        let owner = self.owner;
        let place = line.place();
        self.found.push(Array {
            name,
            owner,
            numbers,
            tuples,
            kind,
            place,
            data: start..end,
            line: first,
            cells: 0,
            role,
        });
        Ok(())
    }
}

/// Whether a word is none of those that keywords are; a reader of the numbers looks closer.
fn may_be_number(word: &[u8]) -> bool {
    let letters = &word[..word.iter().take_while(|b| b.is_ascii_alphabetic()).count()];
    letters.is_empty() || [&b"nan"[..], b"inf", b"infinity"].iter().any(|name| letters.eq_ignore_ascii_case(name))
}

pub(super) fn whole(word: Option<&Word<'_>>, line: Line<'_>) -> Result<u64, ReadError> {
    let number = word.and_then(|w| std::str::from_utf8(w.text).ok()?.parse().ok());
    number.ok_or_else(|| wrong(line, "a whole number of values or components"))
}

/// The type of a number by its name.
pub(super) fn kind(word: Option<&Word<'_>>, line: Line<'_>) -> Result<Kind, ReadError> {
    Ok(match word.map(|w| w.text.to_ascii_lowercase()).unwrap_or_default().as_slice() {
        b"unsigned_char" => Kind::U8,
        b"char" | b"signed_char" => Kind::I8,
        b"unsigned_short" => Kind::U16,
        b"short" => Kind::I16,
        b"unsigned_int" => Kind::U32,
        b"int" | b"vtkidtype" => Kind::I32,
        b"unsigned_long" | b"vtktypeuint64" | b"unsigned_long_long" => Kind::U64,
        b"long" | b"vtktypeint64" | b"long_long" => Kind::I64,
        b"float" => Kind::F32,
        b"double" => Kind::F64,
        _ => return Err(wrong(line, "a type of numbers, from unsigned_char to double (neither bit nor string)")),
    })
}
