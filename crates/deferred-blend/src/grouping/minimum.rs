//! MGC, minimum graph colouring: as few groups as the largest-first rule finds (section 4.1).
//!
//! Nodes are coloured in the order of falling degree, each with the least colour that none of its neighbours has. So there are never
//! more colours than the greatest degree plus one. The least number, the chromatic number, is NP-hard to find.

use super::graph::{FETCHED, OverlapGraph};
use super::{Groups, MOST_GROUPS, check_cancelled, check_count};
use crate::Error;
use splat_core::Progress;

/// Colour of a node without one.
const NONE: u16 = MOST_GROUPS as u16;

/// Groups of a colouring.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Coloring {
    /// The group of each disc.
    pub groups: Groups,
    /// Edges within a group: 0 unless the number of groups was capped.
    pub overlaps: u64,
}

/// Colours an overlap graph by the largest-first rule. Nodes of one degree come in the order of the graph, which is one of size and
/// place.
///
/// A disc whose neighbours have all of `most_groups` colours takes the colour that the fewest of them have, and
/// [`Coloring::overlaps`] counts what is left; so ten thousand discs at one place take as many groups as there may be.
///
/// # Errors
/// [`Error::Parameter`] for a number of groups outside 1..=256; [`Error::Cancelled`].
pub fn minimum_coloring(
    graph: &OverlapGraph,
    most_groups: u32,
    progress: Option<&Progress>,
) -> Result<Coloring, Error> {
    check_count(most_groups)?;
    let mut colors = vec![NONE; graph.nodes()];
    let mut count = 0;
    let mut overlaps = 0;
    let order = largest_first(graph);
    for batch in order.chunks(FETCHED) {
        check_cancelled(progress)?;
        graph.fetch(batch);
        for &node in batch {
            let neighbors = graph.neighbors(node as usize);
            let mut color = least_free(neighbors, &colors);
            if u32::from(color) >= most_groups {
                let (rarest, shared) = rarest(neighbors, &colors, most_groups);
                color = rarest;
                overlaps += shared;
            }
            colors[node as usize] = color;
            count = count.max(u32::from(color) + 1);
        }
    }
    let of_node: Vec<u8> = colors.into_iter().map(|color| color as u8).collect();
    Ok(Coloring { groups: Groups::of_each(count.max(1), graph.by_place(&of_node)), overlaps })
}

/// Nodes by falling degree, then ascending.
fn largest_first(graph: &OverlapGraph) -> Vec<u32> {
    let most = graph.max_degree();
    let mut starts = vec![0u32; most + 2];
    (0..graph.nodes()).for_each(|node| starts[most - graph.degree(node) + 1] += 1);
    (0..=most).for_each(|class| starts[class + 1] += starts[class]);
    let mut order = vec![0; graph.nodes()];
    for node in 0..graph.nodes() {
        let next = &mut starts[most - graph.degree(node)];
        order[*next as usize] = node as u32;
        *next += 1;
    }
    order
}

/// The least colour that no neighbour has; 256 where there is none.
#[inline]
fn least_free(neighbors: &[u32], colors: &[u16]) -> u16 {
    // Nearly always all colours are below 64: one word, and a look at whether there were others.
    let mut taken = 0u64;
    let mut seen = 0u16;
    for &n in neighbors {
        let color = colors[n as usize];
        seen |= color;
        taken |= u64::from(color < 64) << (color & 63);
    }
    if seen & 0xc0 == 0 && taken != u64::MAX {
        return taken.trailing_ones() as u16;
    }
    least_free_of_many(neighbors, colors)
}

fn least_free_of_many(neighbors: &[u32], colors: &[u16]) -> u16 {
    // One bit a colour, and one more for nodes without.
    let mut taken = [0u64; MOST_GROUPS as usize / 64 + 1];
    for &n in neighbors {
        let color = colors[n as usize];
        taken[usize::from(color >> 6)] |= 1 << (color & 63);
    }
    let word = taken[..4].iter().position(|&bits| bits != u64::MAX);
    word.map_or(NONE, |word| 64 * word as u16 + taken[word].trailing_ones() as u16)
}

/// The colour that the fewest neighbours have, and how many.
fn rarest(neighbors: &[u32], colors: &[u16], most: u32) -> (u16, u64) {
    let mut counts = [0u64; MOST_GROUPS as usize + 1];
    neighbors.iter().for_each(|&n| counts[usize::from(colors[n as usize])] += 1);
    let rarest = (0..most as usize).min_by_key(|&color| counts[color]).unwrap_or(0);
    (rarest as u16, counts[rarest])
}
