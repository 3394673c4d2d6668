//! Splats of an order by the tiles that they reach: an entry (tile, splat) for each, sorted by tile, in the order inside one.

use crate::Error;
use splat_shaders::layouts::{Scan, SortState, SplatState};
use splat_shaders::radix::{SCAN_BLOCK, SORT_BLOCK, Scanned, SortPass, sort_pass};
use splat_shaders::{BufferId, Groups, Recording, kernels};

/// Splats whose tiles a workgroup counts.
const COUNT_BLOCK: u32 = 1024;
/// Splats whose entries a workgroup writes, and threads of any workgroup.
const EMIT_BLOCK: u32 = 256;

/// What a list makes room for.
pub(super) struct ListRoom {
    /// Tiles of the image.
    pub(super) tiles: u32,
    /// Splats of the order.
    pub(super) ordered: u32,
    pub(super) entries: u32,
}

/// Buffers of a list.
pub(super) struct List {
    pub(super) state: BufferId,
    places: Scanned,
    sort: BufferId,
    digits: Scanned,
    keys: [BufferId; 2],
    ids: [BufferId; 2],
    /// Where each tile begins among the ids, and where the last one ends.
    pub(super) starts: BufferId,
}

impl List {
    pub(super) fn scratch(r: &mut Recording, room: &ListRoom) -> Self {
        let words = |n: u32| 4 * u64::from(n);
        let ListRoom { tiles, ordered, entries } = *room;
        let state = r.scratch("state", size_of::<SplatState>() as u64);
        let place_scan = r.scratch("place scan", size_of::<Scan>() as u64);
        let places = Scanned::scratch(r, place_scan, ["places", "place sums"], ordered);
        let sort = r.scratch("sort", size_of::<SortState>() as u64);
        let digit_scan = r.scratch("digit scan", size_of::<Scan>() as u64);
        let digits = Scanned::scratch(r, digit_scan, ["digits", "digit sums"], 256 * entries.div_ceil(SORT_BLOCK));
        let keys = [r.scratch("tiles", words(entries)), r.scratch("tiles'", words(entries))];
        let ids = [r.scratch("ids", words(entries)), r.scratch("ids'", words(entries))];
        let starts = r.scratch("starts", words(tiles + 1));
        Self { state, places, sort, digits, keys, ids, starts }
    }

    /// Lists the splats of an order, and gives the buffer of the sorted ids.
    pub(super) fn record(&self, r: &mut Recording, room: &ListRoom, buffers: [BufferId; 3]) -> BufferId {
        let [view, order, splats] = buffers;
        let ListRoom { tiles, ordered, entries } = *room;
        let Self { state, places, sort, digits, keys, ids, starts } = *self;
        r.dispatch(&kernels::SPLAT_BEGIN, Groups::cover(1), &[view, state, places.scan], &[]);
        let counted = [view, order, splats, places.numbers, state];
        r.dispatch(&kernels::SPLAT_COUNT, Groups::cover(ordered.div_ceil(COUNT_BLOCK)), &counted, &[]);
        places.record(r, Groups::cover(ordered.div_ceil(SCAN_BLOCK)));
        r.dispatch(&kernels::SPLAT_PREPARE, Groups::cover(1), &[state, sort, digits.scan], &[entries]);
        let emitted = [view, order, splats, places.numbers, places.scan, sort, keys[0], ids[0]];
        r.dispatch(&kernels::SPLAT_EMIT, Groups::cover(ordered.div_ceil(EMIT_BLOCK)), &emitted, &[]);
        // Bits of the greatest tile.
        let passes = (tiles - 1).checked_ilog2().map_or(0, |top| top as usize / 8 + 1);
        for pass in 0..passes {
            let from = pass % 2;
            let to = 1 - pass % 2;
            sort_pass(
                r,
                SortPass {
                    shift: 8 * pass as u32,
                    state: sort,
                    from: [keys[from], ids[from]],
                    to: [keys[to], ids[to]],
                    digits,
                },
            );
        }
        let keys = keys[passes % 2];
        let ids = ids[passes % 2];
        let ranged = [view, sort, keys, starts, state];
        r.dispatch(&kernels::SPLAT_RANGES, Groups::cover((tiles + 1).div_ceil(256)), &ranged, &[]);
        ids
    }
}

/// What a device did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Splats that reach a tile.
    pub splats: u64,
    /// Pairs of a splat and a tile that it reaches.
    pub entries: u64,
    /// Those of the tile that has most: as many splats one thread folds in a row.
    pub longest: u64,
}

impl Counts {
    /// Of this list and another together.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let splats = self.splats + other.splats;
        let entries = self.entries + other.entries;
        Self { splats, entries, longest: self.longest.max(other.longest) }
    }

    /// From the bytes of a [`SplatState`], of a list with so much room.
    pub(super) fn read(state: &[u8], room: u32) -> Result<Self, Error> {
        let attribute = "state read back";
        let found = state.len();
        let expected = size_of::<SplatState>();
        let bytes = state.get(..expected).ok_or(Error::ColumnLength { attribute, found, expected })?;
        let state: SplatState = bytemuck::pod_read_unaligned(bytes);
        let entries = u64::from(state.entries_low) | u64::from(state.entries_high) << 32;
        super::fits("tile entries", entries, room)?;
        Ok(Self { splats: state.splats.into(), entries, longest: state.longest.into() })
    }
}
