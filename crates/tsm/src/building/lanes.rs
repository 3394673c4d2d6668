//! Splats side by side: columns of numbers, [`LANES`] splats long, and queues of those that take the same way.
//!
//! Loops over the lanes of columns, without branches, become vector instructions, where splats one after the other are
//! a chain of scalar ones. Since neighbours in a cloud differ in size, they queue by the number of cells they span
//! first.

/// Splats that are looked at together: so many that compilers keep loops of them loops.
pub(crate) const LANES: usize = 64;
/// Most cells along a side of what goes side by side.
pub(crate) const MOST: i32 = 11;
/// Queues for up to so many cells a side.
const SIDES: [i32; 4] = [2, 4, 8, MOST];

/// One number of each splat.
pub(crate) type Lane<T = f32> = [T; LANES];

/// `F` numbers of each splat, and the greatest number of cells along a side: 0 for splats that cover none, negative for
/// those that take another way.
#[derive(Debug)]
pub(crate) struct Columns<const F: usize> {
    pub(crate) column: [Lane; F],
    pub(crate) side: Lane<i32>,
}

impl<const F: usize> Default for Columns<F> {
    fn default() -> Self {
        Self { column: [[0.0; LANES]; F], side: [0; LANES] }
    }
}

impl<const F: usize> Columns<F> {
    /// Writes some numbers of one splat.
    #[inline(always)]
    pub(crate) fn set<const N: usize>(&mut self, first: usize, l: usize, values: [f32; N]) {
        (0..N).for_each(|k| self.column[first + k][l] = values[k]);
    }
}

#[cfg(feature = "gpu")]
impl<const F: usize> Columns<F> {
    /// Parts splats `ids` by the way that they take.
    #[inline(always)]
    pub(crate) fn part(&self, ids: &[u32], plain: &mut Vec<u32>, others: &mut Vec<u32>) {
        for (side, id) in self.side.iter().zip(ids) {
            match side.signum() {
                1 => plain.push(*id),
                -1 => others.push(*id),
                _ => {}
            }
        }
    }
}

/// Splats that wait for others of their size; room for twice as many as leave at once, so that a batch always fits.
#[derive(Debug)]
pub(crate) struct Queue<const F: usize> {
    len: usize,
    column: [[f32; 2 * LANES]; F],
}

impl<const F: usize> Queue<F> {
    /// Number of its first lanes in use.
    #[inline(always)]
    pub(crate) fn lanes(&self) -> usize {
        self.len.min(LANES)
    }

    /// A column of the first splats.
    #[inline(always)]
    pub(crate) fn column(&self, f: usize) -> &Lane {
        self.column[f].first_chunk().expect("invariant: a queue is longer than a batch")
    }

    /// Lets the first splats go.
    #[inline(always)]
    pub(crate) fn advance(&mut self) {
        self.len = self.len.saturating_sub(LANES);
        for column in &mut self.column {
            let (front, rest) = column.split_at_mut(LANES);
            front.copy_from_slice(rest);
        }
    }
}

/// Queues by size.
#[derive(Debug)]
pub(crate) struct Queues<const F: usize> {
    queue: [Queue<F>; SIDES.len()],
}

impl<const F: usize> Default for Queues<F> {
    fn default() -> Self {
        // Numbers that no loop stumbles over in lanes that were never used.
        Self { queue: std::array::from_fn(|_| Queue { len: 0, column: [[1.0; 2 * LANES]; F] }) }
    }
}

impl<const F: usize> Queues<F> {
    /// Adds splats `ids`, those that take another way to `others`.
    #[inline(always)]
    pub(crate) fn push(&mut self, from: &Columns<F>, ids: &[u32], others: &mut Vec<u32>) {
        for (l, id) in ids.iter().enumerate().take(LANES) {
            let side = from.side[l];
            if side <= 0 {
                if side < 0 {
                    others.push(*id);
                }
                continue;
            }
            debug_assert!(side <= MOST, "invariant: {side} cells a side go one by one");
            let queue = &mut self.queue[SIDES.iter().filter(|most| side > **most).count().min(SIDES.len() - 1)];
            let to = queue.len % (2 * LANES);
            (0..F).for_each(|f| queue.column[f][to] = from.column[f][l]);
            queue.len += 1;
        }
    }

    /// Those that are full; with `is_last` all that are not empty. Each must [`Queue::advance`] then.
    #[inline(always)]
    pub(crate) fn ready(&mut self, is_last: bool) -> impl Iterator<Item = &mut Queue<F>> {
        self.queue.iter_mut().filter(move |queue| queue.len >= LANES || is_last && queue.len > 0)
    }
}

/// Batches of ids, and an empty one at the end.
pub(crate) fn batches(ids: &[u32]) -> impl Iterator<Item = &[u32]> {
    ids.chunks(LANES).chain(std::iter::once(&[][..]))
}
