//! COPC, LAZ whose chunks are the nodes of an octree: which chunks make a level of detail (specification 1.0, copc.io).

use super::las::{Layout, variable_records};
use crate::error::{Place, ReadError};

const HINT: &str = "the file is truncated or damaged; fetch it again";
/// Bytes of the record that says where the hierarchy lies, and of an entry of the hierarchy.
const INFO: usize = 160;
const ENTRY: usize = 32;
/// Where the record says it: the first byte and the length of the first page.
const ROOT: usize = 40;
/// Stands for the number of points of an entry that leads to another page.
const PAGE: i32 = -1;
/// Most levels: halves of halves, until an f64 has no more.
const MAX_LEVEL: usize = 52;

/// The levels of a file that are read, coarsest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Levels {
    /// Points of these levels.
    pub(crate) points: u64,
    /// How many levels are read, and how many there are.
    pub(crate) read: usize,
    pub(crate) count: usize,
    /// Bytes at which their chunks begin, rising.
    chunks: Vec<u64>,
}

impl Levels {
    /// As many levels as have at most `most` points together, and the coarsest in any case; `None` for a file that has no levels.
    pub(crate) fn within(content: &[u8], layout: &Layout, most: u64) -> Result<Option<Self>, ReadError> {
        let record = variable_records(content, layout).next().filter(|r| r.user == b"copc" && r.id == 1);
        let Some(record) = record else { return Ok(None) };
        let info = record.data.first_chunk::<INFO>();
        let info =
            info.ok_or_else(|| damaged(record.at, format!("{INFO} bytes of COPC"), record.data.len().to_string()))?;
        let nodes = nodes(content, record.at, [number(info, ROOT), number(info, ROOT + 8)])?;
        let count = nodes.iter().map(|node| node.level + 1).max().unwrap_or(0);
        let of_level = |level: usize| nodes.iter().filter(move |n| n.level == level);
        let mut points = 0u64;
        let mut read = 0;
        for level in 0..count {
            let more = of_level(level).fold(points, |n, node| n.saturating_add(node.points));
            if more > most && level > 0 {
                break;
            }
            (points, read) = (more, level + 1);
        }
        let mut chunks: Vec<u64> = nodes.iter().filter(|n| n.level < read).map(|n| n.chunk).collect();
        chunks.sort_unstable();
        Ok(Some(Self { points, read, count, chunks }))
    }

    /// Whether the chunk at a byte of the file belongs to them.
    pub(crate) fn have(&self, chunk: usize) -> bool {
        self.chunks.binary_search(&(chunk as u64)).is_ok()
    }
}

/// A node of the octree that has points.
struct Node {
    level: usize,
    /// Byte at which its chunk begins.
    chunk: u64,
    points: u64,
}

/// All nodes, page by page; `at` is where the first page is told of.
fn nodes(content: &[u8], at: usize, root: [u64; 2]) -> Result<Vec<Node>, ReadError> {
    let mut nodes = Vec::new();
    let mut pages = vec![root];
    // Each page counts once: pages that lead back to others end here.
    let mut left = content.len();
    while let Some([start, length]) = pages.pop() {
        let range = usize::try_from(start).ok().zip(usize::try_from(length).ok());
        let bytes = range.and_then(|(start, length)| content.get(start..start.checked_add(length)?));
        let bytes = bytes.filter(|bytes| bytes.len().is_multiple_of(ENTRY) && bytes.len() <= left);
        let bytes = bytes.ok_or_else(|| {
            damaged(at, "pages of the hierarchy within the file", format!("one of {length} bytes at {start}"))
        })?;
        left -= bytes.len();
        for entry in bytes.as_chunks::<ENTRY>().0 {
            let word = |i: usize| i32::from_le_bytes([entry[i], entry[i + 1], entry[i + 2], entry[i + 3]]);
            let level = word(0);
            let size = word(24);
            let points = word(28);
            let level = usize::try_from(level).ok().filter(|level| *level <= MAX_LEVEL);
            match (level, u64::try_from(size), u64::try_from(points)) {
                (Some(_), Ok(size), Err(_)) if points == PAGE => pages.push([number(entry, 16), size]),
                (Some(_), _, Ok(0)) => {}
                (Some(level), _, Ok(points)) => nodes.push(Node { level, chunk: number(entry, 16), points }),
                _ => {
                    let found = format!("level {}, {points} points", word(0));
                    return Err(damaged(
                        start as usize,
                        format!("entries of level 0 to {MAX_LEVEL} with points"),
                        found,
                    ));
                }
            }
        }
    }
    Ok(nodes)
}

fn number(bytes: &[u8], at: usize) -> u64 {
    bytes[at..at + 8].iter().rev().fold(0, |n, b| n << 8 | u64::from(*b))
}

fn damaged(byte: usize, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
    ReadError::input(Place::Byte(byte as u64), expected, found, HINT)
}
