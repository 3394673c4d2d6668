//! Files of VTK that name others, beside them or below: the pieces of one dataset (`.pvtu`, `.pvtp`, `.pvti`, `.pvts`, `.pvtr`), blocks
//! (`.vtm`, partitioned datasets) and the times of a series (`.pvd`).
//!
//! All files are in memory together, because arrays are joined over pieces. A list may name lists.

use super::data::{Appended, Encoding};
use super::extents::{self, Extent, Filling};
use super::pasted;
use super::pieces::{self, Source, in_file};
use super::{HINT, MAX_NODES, dataset, extent, numbers, one, parsed, place, wrong};
use crate::error::{Fault, Place, ReadError};
use crate::reading::Reading;
use crate::stream::beside::{Beside, from_uri};
use crate::stream::input::{self, Content};
use crate::volumes::selection::Selection;
use crate::{Loaded, Notes, ReadParams};
use roxmltree::{Document, Node};
use splat_core::text::{counted, escaped};
use std::borrow::Cow;
use std::path::Path;

/// How often a list may name a list.
const DEEPEST: usize = 4;

/// Bytes of a file in which its root element begins.
const HEAD: usize = 4096;

/// Kinds of datasets whose pieces are listed; `P` stands before them.
const OF_PIECES: [&str; 5] = ["PImageData", "PRectilinearGrid", "PStructuredGrid", "PUnstructuredGrid", "PPolyData"];

/// Kinds of datasets of blocks.
const OF_BLOCKS: [&str; 3] = ["vtkMultiBlockDataSet", "vtkPartitionedDataSet", "vtkPartitionedDataSetCollection"];

/// A series of datasets by their times.
const OF_TIMES: &str = "Collection";

/// What the files of a list are to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Together {
    /// Pieces of one dataset with the same arrays.
    Pieces,
    /// The same of an image or a rectilinear grid.
    Lattice,
    Blocks,
}

/// Attributes of an image that say where its points lie, and how the axes of one lie that states no direction.
const OF_LATTICE: [&str; 3] = ["Origin", "Spacing", "Direction"];
const UNTURNED: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// How far apart a number of the list and of a piece may be, of the largest of them: as much as six digits leave open.
const SAME: f64 = 1e-6;

/// Files of a folder that are looked at for a list, and bytes of one, at most.
const MOST_FILES: usize = 4096;
const MOST_BYTES: u64 = 1 << 20;

/// Extensions of lists of pieces.
const EXTENSIONS: [&str; 5] = ["pvti", "pvtr", "pvts", "pvtu", "pvtp"];

/// A file that a list names.
struct Member {
    name: String,
    content: Content,
    /// Which part of the whole the list says that it is.
    extent: Option<Extent>,
}

/// The files of a list and of the lists in it.
struct Members<'p> {
    /// Where the first list lies.
    path: Option<&'p Path>,
    files: Vec<Member>,
    series: Option<Series>,
    /// The whole of the pieces of a grid.
    whole: Option<Extent>,
    /// Places and steps that the list states of the points of an image.
    stated: Vec<StatedNumbers>,
}

/// The numbers of an attribute of a list, by its name.
struct StatedNumbers {
    name: &'static str,
    numbers: Vec<f64>,
    place: Place,
}

/// Which time of a series is read.
struct Series {
    time: f64,
    frame: u64,
    count: usize,
}

/// The kind of dataset that a file announces in its root element.
fn kind_of(content: &[u8]) -> Option<&str> {
    let head = &content[..content.len().min(HEAD)];
    let mark = b"<VTKFile";
    let start = head.windows(mark.len()).position(|window| window == mark)? + mark.len();
    let tag = &head[start..];
    let tag = &tag[..tag.iter().position(|b| *b == b'>')?];
    let tag = std::str::from_utf8(tag).ok()?;
    let value = tag.split_once("type=").filter(|(before, _)| before.ends_with(char::is_whitespace))?.1;
    let quote = value.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
    value[1..].split_once(quote).map(|(kind, _)| kind)
}

fn is_kind_of_list(kind: &str) -> bool {
    OF_PIECES.contains(&kind) || OF_BLOCKS.contains(&kind) || kind == OF_TIMES
}

/// Whether a file names others.
pub(super) fn is_list(content: &[u8]) -> bool {
    kind_of(content).is_some_and(is_kind_of_list)
}

/// Indices that an element states, if it does.
fn stated(node: Node<'_, '_>, name: &str) -> Result<Option<Extent>, ReadError> {
    node.attribute(name).map(|_| extent(node, name)).transpose()
}

/// The error of a file that a list names and that cannot be opened.
fn missing(error: ReadError) -> ReadError {
    if error.fault != Fault::FileSystem {
        return error;
    }
    ReadError { hint: "fetch the pieces that the list names, too, or draw those that there are one by one", ..error }
}

/// Reads what the files of a list are together.
pub(super) fn read(content: &[u8], path: Option<&Path>, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let mut members = Members { path, files: Vec::new(), series: None, whole: None, stated: Vec::new() };
    let together = members.collect(content, &Found { folder: String::new(), depth: 0 }, reading)?;
    if members.series.is_none() {
        Selection::of_frames(1, Place::File, reading.params, &mut Notes::default())?;
    }
    // One time of a series is chosen already.
    let params = ReadParams { frame: 0, ..reading.params.clone() };
    let mut within = reading.within(&params);
    let loaded = members.loaded(together, &mut within);
    reading.notes = within.notes;
    let loaded = loaded?;
    if let Some(Series { time, frame, count }) = members.series.filter(|series| series.count > 1) {
        let other = match &loaded {
            Loaded::Grid(_) => "`frame` chooses another",
            _ => "of another draw its file",
        };
        reading.notes.remark(format!("time {time}, {frame} of {count} counted from 0; {other}"));
    }
    Ok(loaded)
}

/// Where a list was found.
struct Found {
    /// Its folder below that of the first list, with a slash behind it.
    folder: String,
    depth: usize,
}

/// The files that a list names.
struct Names {
    names: Vec<Named>,
    together: Together,
}

/// A file that a list names, and which part of the whole it says that that is.
struct Named {
    name: String,
    extent: Option<Extent>,
}

/// The list beside a file that names it as a piece, if its name has a number and there is one.
pub(super) fn naming(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let (stem, _) = name.rsplit_once('.')?;
    let digits = stem.bytes().rev().take_while(u8::is_ascii_digit).count();
    if digits == 0 {
        return None;
    }
    let mentions = format!("\"{name}\"");
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let lists = std::fs::read_dir(folder).ok()?.take(MOST_FILES).flatten().map(|entry| entry.path());
    let mut lists: Vec<_> = lists
        .filter(|list| list.extension().is_some_and(|found| EXTENSIONS.iter().any(|known| found == *known)))
        .filter(|list| list.metadata().is_ok_and(|about| about.is_file() && about.len() <= MOST_BYTES))
        .collect();
    lists.sort();
    let found = lists.into_iter().find(|list| std::fs::read_to_string(list).is_ok_and(|text| text.contains(&mentions)));
    found?.file_name()?.to_str().map(str::to_owned)
}

impl Members<'_> {
    /// Opens the files of a list and of those in it.
    fn collect(&mut self, content: &[u8], found: &Found, reading: &mut Reading<'_>) -> Result<Together, ReadError> {
        let text = std::str::from_utf8(content)
            .map_err(|e| ReadError::input(Place::Byte(e.valid_up_to() as u64), "UTF-8 text", "another byte", HINT))?;
        let document = parsed(text)?;
        let Names { names, mut together } = self.names(&document, reading)?;
        let is_alone = names.len() == 1;
        for Named { name, extent } in names {
            reading.go_on()?;
            if self.files.len() >= MAX_NODES as usize {
                let expected = format!("at most {MAX_NODES} files");
                return Err(ReadError::input(Place::File, expected, "more", "draw a part of them"));
            }
            let name = format!("{}{}", found.folder, from_uri(&name));
            let stream = Beside::new(self.path).open(&name, "a file of the list", reading.params);
            let mut stream = stream.map_err(missing)?;
            if stream.peek(2)? == [0x1f, 0x8b] {
                stream = stream.gunzip();
            }
            let content = stream.rest().map_err(|e| in_file(Some(&name), e))?;
            if !is_list(&content) {
                self.files.push(Member { name, content, extent });
                continue;
            }
            if found.depth == DEEPEST {
                let expected = format!("lists of lists at most {DEEPEST} deep");
                let error = ReadError::input(Place::File, expected, "a deeper one", "does it name itself?");
                return Err(in_file(Some(&name), error));
            }
            let folder = name.rfind('/').map_or_else(String::new, |end| name[..=end].to_owned());
            let below = self.collect(&content, &Found { folder, depth: found.depth + 1 }, reading);
            let below = below.map_err(|e| in_file(Some(&name), e))?;
            if is_alone {
                together = below;
            }
        }
        Ok(together)
    }

    /// The files that a list names, of a series those of the time that is asked for.
    fn names(&mut self, document: &Document<'_>, reading: &Reading<'_>) -> Result<Names, ReadError> {
        let root = document.root_element();
        let kind = root.attribute("type").unwrap_or_default();
        let named = |element: &str, attribute: &str| -> Result<Vec<Named>, ReadError> {
            let nodes = root.descendants().filter(|node| node.has_tag_name(element));
            // A piece that is empty has no file.
            let named =
                nodes.filter_map(|node| Some((node, node.attribute(attribute).filter(|name| !name.is_empty())?)));
            let named = named.map(|(node, name)| Ok(Named { name: name.to_owned(), extent: stated(node, "Extent")? }));
            named.collect()
        };
        let (names, together) = match kind {
            "PImageData" | "PRectilinearGrid" => (named("Piece", "Source")?, Together::Lattice),
            kind if OF_PIECES.contains(&kind) => (named("Piece", "Source")?, Together::Pieces),
            OF_TIMES => {
                let files = self.at_a_time(root, reading)?.into_iter();
                (files.map(|name| Named { name, extent: None }).collect(), Together::Blocks)
            }
            _ => (named("DataSet", "file")?, Together::Blocks),
        };
        let grid = root.children().find(|node| node.has_tag_name(kind));
        self.whole = grid.map(|grid| stated(grid, "WholeExtent")).transpose()?.flatten();
        if let Some(grid) = grid.filter(|_| kind == "PImageData") {
            for name in OF_LATTICE {
                let numbers = if name == "Direction" {
                    numbers::<9>(grid, name)?.map(Vec::from)
                } else {
                    numbers::<3>(grid, name)?.map(Vec::from)
                };
                self.stated.extend(numbers.map(|numbers| StatedNumbers { name, numbers, place: place(grid) }));
            }
        }
        if names.is_empty() {
            return Err(wrong(root, "a list that names files", "none"));
        }
        Ok(Names { names, together })
    }

    /// The files of the time that is asked for, of a series.
    fn at_a_time(&mut self, root: Node<'_, '_>, reading: &Reading<'_>) -> Result<Vec<String>, ReadError> {
        let mut files: Vec<(f64, String)> = Vec::new();
        for node in root.descendants().filter(|node| node.has_tag_name("DataSet")) {
            let text = node.attribute("timestep").unwrap_or("0");
            let time = text.trim().parse::<f64>().ok().filter(|time| time.is_finite());
            let time = time.ok_or_else(|| wrong(node, "a finite number as timestep", text))?;
            files.extend(node.attribute("file").map(|file| (time, file.to_owned())));
        }
        let mut times: Vec<f64> = files.iter().map(|(time, _)| *time).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let frame = reading.params.frame;
        // Its remark is another one of surfaces, which are not read yet.
        Selection::of_frames(times.len().max(1) as u64, place(root), reading.params, &mut Notes::default())?;
        let Some(time) = times.get(frame as usize).copied() else { return Ok(Vec::new()) };
        self.series = Some(Series { time, frame, count: times.len() });
        Ok(files.into_iter().filter(|(other, _)| *other == time).map(|(_, file)| file).collect())
    }

    /// Refuses images that do not lie where the list says, or have other steps.
    fn check_stated(&self, sources: &[Source<'_, '_, '_>]) -> Result<(), ReadError> {
        for StatedNumbers { name, numbers: expected, place } in &self.stated {
            for source in sources.iter().filter(|source| source.dataset.has_tag_name("ImageData")) {
                let found = if *name == "Direction" {
                    numbers::<9>(source.dataset, name).map(|found| found.unwrap_or(UNTURNED).to_vec())
                } else {
                    let usual = if *name == "Spacing" { 1.0 } else { 0.0 };
                    numbers::<3>(source.dataset, name).map(|found| found.unwrap_or([usual; 3]).to_vec())
                };
                let found = found.map_err(|e| in_file(source.file, e))?;
                let size = expected.iter().fold(0.0, |most: f64, number| most.max(number.abs()));
                if expected.iter().zip(&found).any(|(a, b)| (a - b).abs() > SAME * size) {
                    let told = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
                    let file = escaped(source.file.unwrap_or_default().as_bytes(), 60);
                    let expected = format!("pieces of the {name} that the list states, {}", told(expected));
                    let found = format!("{} in '{file}'", told(&found));
                    let hint = "write the list and its pieces anew: one of them is of another run";
                    return Err(ReadError::input(*place, expected, found, hint));
                }
            }
        }
        Ok(())
    }

    /// What the files are together.
    fn loaded(&self, together: Together, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
        let mut texts: Vec<(Option<Appended>, Cow<'_, str>)> = Vec::new();
        for member in &self.files {
            texts.push(Appended::split(&member.content).map_err(|e| in_file(Some(&member.name), e))?);
        }
        let bytes = texts.iter().filter(|(appended, _)| appended.is_some()).map(|(_, text)| text.len() as u64).sum();
        input::hold("the descriptions", bytes, reading.params)?;
        let mut documents = Vec::new();
        for (member, (_, text)) in self.files.iter().zip(&texts) {
            documents.push(parsed(text).map_err(|e| in_file(Some(&member.name), e))?);
        }
        let mut encodings = Vec::new();
        for (member, (document, (appended, _))) in self.files.iter().zip(documents.iter().zip(&texts)) {
            let encoding = Encoding::stated_by(document.root_element(), &member.content, appended.clone());
            encodings.push(encoding.map_err(|e| in_file(Some(&member.name), e))?);
        }
        let mut sources = Vec::new();
        for (member, (document, encoding)) in self.files.iter().zip(documents.iter().zip(&encodings)) {
            let file = Some(member.name.as_str());
            let dataset = dataset(document).map_err(|e| in_file(file, e))?;
            sources.push(Source { dataset, encoding, file });
        }
        if together == Together::Lattice {
            self.check_stated(&sources)?;
        }
        let stated: Vec<Option<Extent>> = self.files.iter().map(|member| member.extent).collect();
        let is_grid =
            |source: &Source<'_, '_, '_>| !["UnstructuredGrid", "PolyData"].contains(&source.dataset.tag_name().name());
        if together != Together::Blocks && sources.iter().all(is_grid) {
            let parts = extents::parts(&sources, &stated)?;
            if together == Together::Lattice {
                extents::check_filled(&parts, self.whole, Filling::Points)?;
            } else {
                extents::check_beside(&parts)?;
                extents::check_filled(&parts, self.whole, Filling::Cells)?;
            }
        }
        if let [source] = sources.as_slice() {
            return one(source, reading).map_err(|e| in_file(source.file, e));
        }
        match together {
            Together::Lattice => pasted::read(&sources, reading).map(Loaded::Grid),
            Together::Pieces => pieces::read(&sources, false, reading),
            Together::Blocks => {
                let blocks = counted(sources.len() as u64, "block");
                reading
                    .notes
                    .remark(format!("{blocks} drawn as one; where one lacks the array that is drawn it draws nothing"));
                pieces::read(&sources, true, reading)
            }
        }
    }
}
