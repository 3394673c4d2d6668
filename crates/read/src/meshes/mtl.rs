//! MTL: the diffuse colours of an OBJ's materials, `Kd` and `map_Kd`.
//!
//! Material files and textures are opened only in the folder of the OBJ or below; where one is not, a remark says so and the
//! rest is read. `Kd` is a linear colour, as that of vertices is; a texture is multiplied by it.

use super::paint::{Alpha, Paint};
use super::texture::Texture;
use crate::error::{Fault, ReadError};
use crate::reading::Reading;
use crate::stream::beside::Beside;
use crate::stream::input::{self, Content, Growing};
use crate::text::{Line, Lines, Word};
use splat_core::text::escaped;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Bytes that a material or a name takes beside its text: two paints, two names of textures, and entries of tables.
const BYTES_PER_ENTRY: u64 = 320;
/// Lines between two looks at whether to stop.
const LOOK: u64 = 1 << 14;

const WHITE: Paint = Paint { factor: [1.0; 4], texture: None, alpha: Alpha::Blended };

/// The materials of an OBJ file.
pub(crate) struct Materials<'a> {
    beside: Beside<'a>,
    /// Two of each material, first with its texture and then without; the first two belong to no material.
    pub(crate) paints: Vec<Paint>,
    pub(crate) textures: Vec<Texture>,
    rank: HashMap<Vec<u8>, usize>,
    /// Name of the texture of each paint, until the material is used.
    maps: Vec<Option<String>>,
    /// Ranks of textures by name, and by the file that the name stands for; `None` for those that are not there.
    decoded: HashMap<String, Option<usize>>,
    files: HashMap<PathBuf, usize>,
    /// Material files that were read.
    libraries: HashSet<PathBuf>,
    /// Memory of materials and of what is known of names.
    held: Growing,
    bytes: u64,
    current: usize,
    /// Whether a material of a file was chosen.
    pub(crate) is_used: bool,
}

impl<'a> Materials<'a> {
    /// For the OBJ at that place; `None` for one in memory.
    pub(crate) fn new(file: Option<&'a Path>) -> Self {
        Self {
            beside: Beside::new(file),
            paints: vec![WHITE; 2],
            textures: Vec::new(),
            rank: HashMap::new(),
            maps: vec![None; 2],
            decoded: HashMap::new(),
            files: HashMap::new(),
            libraries: HashSet::new(),
            held: Growing::new("the materials"),
            bytes: 0,
            current: 0,
            is_used: false,
        }
    }

    /// Rank of the current paint, with its texture or without.
    pub(crate) fn paint(&self, is_textured: bool) -> u32 {
        (self.current + usize::from(!is_textured)) as u32
    }

    /// Whether the current material has a texture.
    pub(crate) fn has_texture(&self) -> bool {
        self.paints[self.current].texture.is_some()
    }

    /// `usemtl`: what follows is of that material.
    pub(crate) fn choose(&mut self, line: Line<'_>, reading: &mut Reading<'_>) -> Result<(), ReadError> {
        let name = rest(line);
        let Some(&rank) = self.rank.get(name) else {
            self.current = 0;
            reading.notes.not_used([&b"usemtl"[..]]);
            return Ok(());
        };
        (self.current, self.is_used) = (rank, true);
        if let Some(map) = self.maps[rank].take() {
            self.paints[rank].texture = self.texture(map, reading)?;
        }
        Ok(())
    }

    /// Says where material files state materials, and no face has one of them.
    pub(crate) fn remark_unused(&self, reading: &mut Reading<'_>) {
        if !self.is_used && !self.rank.is_empty() {
            reading.notes.remark("its material file is not used: no face names one of its materials by `usemtl`");
        }
    }

    /// Rank of the texture of that name; `None` where it is not there, which a remark says.
    fn texture(&mut self, name: String, reading: &mut Reading<'_>) -> Result<Option<usize>, ReadError> {
        if let Some(known) = self.decoded.get(&name) {
            return Ok(*known);
        }
        let file = self.beside.real(&name);
        let mut found = file.as_ref().and_then(|file| self.files.get(file).copied());
        if found.is_none()
            && let Some(content) = self.content(&name, "the texture", reading)?
        {
            let what = format!("texture '{}'", escaped(name.as_bytes(), 60));
            if Texture::is_left_out(&content, &what, reading) {
                self.decoded.insert(name, None);
                return Ok(None);
            }
            self.textures.push(Texture::decode(&content, &what, reading)?);
            found = Some(self.textures.len() - 1);
        }
        if let (Some(file), Some(rank)) = (file, found) {
            self.files.insert(file, rank);
        }
        self.hold(2 * name.len(), reading)?;
        self.decoded.insert(name, found);
        Ok(found)
    }

    /// Counts another name or material, with so many bytes of text.
    fn hold(&mut self, text: usize, reading: &Reading<'_>) -> Result<(), ReadError> {
        self.bytes += BYTES_PER_ENTRY + text as u64;
        self.held.hold(self.bytes, reading.params)
    }

    /// The content of a file that is named, or a remark why it is left out.
    fn content(&self, name: &str, what: &str, reading: &mut Reading<'_>) -> Result<Option<Content>, ReadError> {
        match self.beside.open(name, what, reading.params) {
            Ok(stream) => stream.rest().map(Some),
            Err(error) if error.fault == Fault::Limit => Err(error),
            Err(error) => {
                // The text before the colon names the purpose of the file, which the remark has already.
                let expected =
                    error.expected.rsplit_once(": ").map_or(error.expected.as_str(), |(_, expected)| expected);
                let name = escaped(name.as_bytes(), 60);
                reading
                    .notes
                    .remark(format!("{what} '{name}': expected {expected}, found {}: it is left out", error.found));
                Ok(None)
            }
        }
    }

    /// `mtllib`: the materials of one file, whose name may have blanks, or of several.
    pub(crate) fn library(&mut self, line: Line<'_>, reading: &mut Reading<'_>) -> Result<(), ReadError> {
        let whole = path(rest(line));
        let several = whole.contains(char::is_whitespace) && self.beside.open(&whole, "", reading.params).is_err();
        let names: Vec<&str> = if several { whole.split_whitespace().collect() } else { vec![whole.as_str()] };
        for name in names {
            reading.go_on()?;
            // The same file may be named in several ways; its materials are read once.
            if let Some(file) = self.beside.real(name)
                && !self.libraries.insert(file)
            {
                continue;
            }
            self.hold(2 * name.len(), reading)?;
            let Some(content) = self.content(name, "the material file", reading)? else { continue };
            let folder = name.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
            self.take(&content, &folder, reading).map_err(|e| {
                let shown = escaped(name.as_bytes(), 60);
                ReadError { place: line.place(), expected: format!("in '{shown}'{}: {}", e.place, e.expected), ..e }
            })?;
        }
        Ok(())
    }

    /// The materials of a file in that folder.
    fn take(&mut self, content: &[u8], folder: &str, reading: &mut Reading<'_>) -> Result<(), ReadError> {
        let mut lines = Lines::new(content);
        let mut rank = None;
        // Of a material that states both, `d` counts: programs disagree about `Tr`.
        let mut has_dissolve = false;
        while let Some(line) = lines.next()? {
            if line.number.is_multiple_of(LOOK) {
                reading.go_on()?;
            }
            let mut words = line.words(false).take_while(|w| !w.text.starts_with(b"#"));
            let Some(keyword) = words.next() else { continue };
            let values: Vec<Word<'_>> = words.collect();
            match (keyword.text, rank) {
                (b"newmtl", _) => {
                    rank = Some(self.add(rest(line), reading)?);
                    has_dissolve = false;
                }
                (b"Kd", Some(rank)) => {
                    if let Some([r, g, b]) = color(keyword, &values)? {
                        let of_both: &mut [Paint] = &mut self.paints[rank..rank + 2];
                        of_both.iter_mut().for_each(|p| p.factor = [r, g, b, p.factor[3]]);
                    } else {
                        reading.notes.not_used([&b"Kd of a spectrum"[..]]);
                    }
                }
                (b"map_Kd", Some(rank)) => {
                    let name = map(line, &values, folder, reading);
                    self.hold(name.as_ref().map_or(0, String::len), reading)?;
                    self.maps[rank] = name;
                }
                (b"d", Some(rank)) => {
                    if let Some(opacity) = share(keyword, &values, reading) {
                        has_dissolve = true;
                        self.set_opacity(rank, opacity);
                    }
                }
                (b"Tr", Some(rank)) => {
                    if let Some(transparency) = share(keyword, &values, reading).filter(|_| !has_dissolve) {
                        self.set_opacity(rank, 1.0 - transparency);
                    }
                }
                (other, _) => reading.notes.not_used([other]),
            }
        }
        Ok(())
    }

    /// Gives a material its opacity, with its texture and without.
    fn set_opacity(&mut self, rank: usize, opacity: f32) {
        self.paints[rank..rank + 2].iter_mut().for_each(|paint| paint.factor[3] = opacity);
    }

    /// Rank of a new material; one of a name that is known takes its place.
    fn add(&mut self, name: &[u8], reading: &Reading<'_>) -> Result<usize, ReadError> {
        let rank = self.paints.len();
        self.hold(name.len(), reading)?;
        input::reserve(&mut self.paints, 2)?;
        input::reserve(&mut self.maps, 2)?;
        self.paints.extend([WHITE; 2]);
        self.maps.extend([None, None]);
        self.rank.insert(name.to_vec(), rank);
        Ok(rank)
    }
}

/// What stands behind the keyword of a line: names may have blanks.
fn rest(line: Line<'_>) -> &[u8] {
    let text = line.text.trim_ascii();
    let keyword = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    text[keyword..].trim_ascii()
}

/// A path, with the separators of every system.
fn path(name: &[u8]) -> String {
    String::from_utf8_lossy(name).replace('\\', "/")
}

/// A linear colour; `None` for one that is stated otherwise.
fn color(keyword: Word<'_>, values: &[Word<'_>]) -> Result<Option<[f32; 3]>, ReadError> {
    if values.first().is_some_and(|w| matches!(w.text, b"spectral" | b"xyz")) {
        return Ok(None);
    }
    if !matches!(values.len(), 1 | 3) {
        let found = format!("{} numbers", values.len());
        return Err(ReadError::input(keyword.place(), "Kd R G B", found, "complete the colour"));
    }
    let mut numbers = [0.0; 3];
    for (number, word) in numbers.iter_mut().zip(values.iter().cycle()) {
        *number = word.number()? as f32;
        if !(0.0..=1.0).contains(number) {
            let hint = "colours are 0.0 to 1.0";
            return Err(ReadError::input(word.place(), "a colour from 0 to 1", word.shown(), hint));
        }
    }
    Ok(Some(numbers))
}

/// The opacity that `d` states, or the transparency of `Tr`; `None` for what is no share, which a remark says.
fn share(keyword: Word<'_>, values: &[Word<'_>], reading: &mut Reading<'_>) -> Option<f32> {
    // Factors of a halo come before the number.
    if values.first().is_some_and(|word| word.text == b"-halo") {
        reading.notes.not_used([&b"d -halo"[..]]);
    }
    let number = values.last().and_then(|word| word.decimal()).filter(|number| (0.0..=1.0).contains(number));
    if number.is_none() {
        let keyword = escaped(keyword.text, 4);
        reading.notes.remark(format!("a material states no number from 0 to 1 as its `{keyword}`, which is left out"));
    }
    number.map(|number| number as f32)
}

/// The name of a texture, beside the OBJ; its options are not used.
fn map(line: Line<'_>, values: &[Word<'_>], folder: &str, reading: &mut Reading<'_>) -> Option<String> {
    let has_options = values.first()?.text.starts_with(b"-");
    if has_options {
        reading.notes.not_used([&b"options of map_Kd"[..]]);
    }
    let name = if has_options { values.last()?.text } else { rest(line) };
    Some(format!("{folder}{}", path(name)))
}
