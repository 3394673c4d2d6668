//! Lists as a recording: the GPU's twin of [`Deposits::into_map`] (Gunjee 2007, section 4.1, step 3, which the paper leaves
//! to the CPU and its GPU to future work).
//!
//! Entries are sorted by distance, then by cell, with a stable radix sort. A segmented scan adds up the absorbances of each
//! cell, in blocks of 1024 entries (reduce, spine, apply; no workgroup waits for another). Each cell bisects its list for
//! the limit, and knots move to their places.
//!
//! Lists equal the CPU's bit for bit on every device. Sums are the same 64-bit fixed point, in pairs of 32-bit words, and
//! do not depend on their order; every other operation is a comparison. The deposits are the CPU's, or made on the device
//! too ([`record_map`]), where the map may stay ([`record_shadow`]).
//!
//! A device's kernels see so many bytes of a buffer and no more ([`Capacities::most`]). Beyond, runs of cells are done one
//! after the other ([`Deposits::batches`]) and joined on the host ([`Deposits::join`]): the same bits.
//!
//! ```
//! use tsm::gpu::{Capacities, record};
//!
//! let recorded = record(Capacities { entries: 1_000_000, cells: 200_000, channels: 1 });
//! recorded.recording.check().unwrap();
//! // 12 bytes an entry come in; it is sorted in 16, which hold what comes next as well, and summed up in 12 more. A cell
//! // takes 8.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 42);
//! ```

mod batches;
mod casting;
mod deposit;
mod look_up;
mod received;
mod run;
mod shadow;

use crate::table::stop_of;
use crate::{Deposits, Error};
use splat_shaders::layouts::{ListView, Scan, SortState};
use splat_shaders::radix::{Scanned, SortPass, sort_pass};
use splat_shaders::{BufferId, Groups, Overflow, Recording, kernels};

pub use batches::{Batch, Listed};
pub use casting::Casting;
pub use deposit::{CastRoom, CastUploads, RecordedCast, record_cast};
pub use look_up::{MapUploads, ReceiverUploads, RecordedLookUp, Room, record_look_up};
pub use received::{ReceivedUploads, RecordedReceived, record_received};
pub use run::{MapRun, map_on};
pub use shadow::{RecordedMap, RecordedShadow, ShadowUploads, record_map, record_shadow};

/// Threads of a workgroup.
const GROUP: u32 = 256;
/// Entries whose sums a workgroup takes.
const SUM_BLOCK: u32 = 1024;
/// Most entries: the upper bit of a knot's number is taken.
const MOST_ENTRIES: u32 = i32::MAX as u32;

/// Capacities of a recording, in elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Entries, fewer than 2³¹.
    pub entries: u32,
    /// Cells.
    pub cells: u32,
    /// Channels of absorbance: 3, or 1 for anything else.
    pub channels: u32,
}

/// The recorded lists and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The commands of the device.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: first entry and number of kept knots of each cell.
    pub spans: BufferId,
    /// Read back: distances of the knots, f32.
    pub distances: BufferId,
    /// Read back: absorbance up to and with each knot, f32 a channel.
    pub totals: BufferId,
    inputs: [BufferId; 6],
}

/// The bytes of some deposits.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    bytes: [Vec<u8>; 6],
}

/// Records the making of lists with this room.
pub fn record(capacities: Capacities) -> Recorded {
    let channels = if capacities.channels == 3 { 3 } else { 1 };
    let entries = capacities.entries.min(MOST_ENTRIES);
    let capacities = Capacities { entries, cells: capacities.cells, channels };
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("view", size_of::<ListView>() as u64);
    let state = r.input("sort", size_of::<SortState>() as u64);
    let digit_scan = r.input("digit scan", size_of::<Scan>() as u64);
    let cells = r.input("cells", words(entries));
    let distances = r.input("distances", words(entries));
    let absorbances = r.input("absorbances", words(entries) * u64::from(channels));
    let pairs = |r: &mut Recording, names: [&'static str; 2]| names.map(|name| r.scratch(name, words(entries)));
    let digits = Scanned::digits(r, digit_scan, entries);
    let mut sort = Sort { state, digits, keys: pairs(r, ["keys", "keys'"]), places: pairs(r, ["places", "places'"]) };
    let [arranged, running, totals] =
        ["arranged", "running", "totals"].map(|name| r.scratch(name, words(entries) * u64::from(channels)));
    let states = r.scratch("states", words(entries.div_ceil(SUM_BLOCK)) * u64::from(2 + 2 * channels));
    let spans = r.scratch("spans", 2 * words(capacities.cells));

    let each = Groups::cover(entries.div_ceil(GROUP));
    r.dispatch(&kernels::TSM_KEYS, each, &[view, distances, sort.keys[0], sort.places[0]], &[]);
    sort.by_bits(r, 32);
    r.dispatch(&kernels::TSM_GATHER, each, &[view, sort.places[0], cells, sort.keys[0]], &[]);
    sort.by_bits(r, capacities.cells.saturating_sub(1).checked_ilog2().map_or(0, |top| top + 1));
    // From here on the halves of the sort that are done with hold what comes next.
    let [sorted, near] = sort.keys;
    let [places, list] = sort.places;
    let arrange = [view, places, distances, absorbances, near, arranged];
    r.dispatch(&kernels::TSM_ARRANGE, each, &arrange, &[]);
    let blocks = Groups::cover(entries.div_ceil(SUM_BLOCK));
    r.dispatch(&kernels::TSM_REDUCE, blocks, &[view, sorted, near, arranged, states], &[]);
    r.dispatch(&kernels::TSM_SPINE, Groups::cover(1), &[view, states], &[]);
    let marks = places;
    r.dispatch(&kernels::TSM_APPLY, blocks, &[view, sorted, near, arranged, states, marks, running], &[]);
    let each_cell = Groups::cover(capacities.cells.div_ceil(GROUP));
    r.dispatch(&kernels::TSM_SPANS, each_cell, &[view, sorted, near, marks, spans], &[]);
    r.dispatch(&kernels::TSM_SETTLE, each, &[view, sorted, near, marks, running, spans, list, totals], &[]);
    [spans, list, totals].into_iter().for_each(|buffer| r.read(buffer));
    let inputs = [view, state, digit_scan, cells, distances, absorbances];
    Recorded { recording, capacities, spans, distances: list, totals, inputs }
}

/// A radix sort on the way; the first of each pair holds what is sorted.
struct Sort {
    state: BufferId,
    digits: Scanned,
    keys: [BufferId; 2],
    places: [BufferId; 2],
}

impl Sort {
    /// Sorts by the lower bits of the keys.
    fn by_bits(&mut self, r: &mut Recording, bits: u32) {
        for shift in (0..bits).step_by(8) {
            let [keys, sorted_keys] = self.keys;
            let [places, sorted_places] = self.places;
            sort_pass(
                r,
                SortPass {
                    shift,
                    state: self.state,
                    from: [keys, places],
                    to: [sorted_keys, sorted_places],
                    digits: self.digits,
                },
            );
            self.keys.reverse();
            self.places.reverse();
        }
    }
}

impl Recorded {
    /// The bytes that the recording takes for a batch of these deposits.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more entries or cells than the capacities, or for other channels than the recording's.
    pub fn uploads(&self, deposits: &Deposits, batch: &Batch) -> Result<Uploads, Error> {
        let Capacities { entries, cells, channels } = self.capacities;
        let room = [
            ("entries", batch.entries(), entries),
            ("cells", batch.cells(), cells),
            ("channels", deposits.channels() as u64, channels),
        ];
        for (what, needed, had) in room {
            if needed > u64::from(had) || (what == "channels" && needed != u64::from(had)) {
                return Err(Error::Overflow(Overflow { what, needed, had: had.into() }));
            }
        }
        let entries = batch.entries() as u32;
        // As the CPU takes it.
        let stop = stop_of(deposits.limit) as u64;
        let view = ListView {
            stop: [stop as u32, (stop >> 32) as u32],
            entries,
            cells: batch.cells() as u32,
            channels,
            unused: 0,
        };
        let [cells, distances, absorbances] = deposits.columns(batch);
        Ok(Uploads {
            bytes: [
                bytemuck::bytes_of(&view).to_vec(),
                bytemuck::bytes_of(&SortState::for_entries(entries)).to_vec(),
                bytemuck::bytes_of(&Scan::of_digits(entries)).to_vec(),
                cells,
                distances,
                absorbances,
            ],
        })
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> Vec<(BufferId, &'a [u8])> {
        self.inputs.into_iter().zip(uploads.bytes.iter().map(Vec::as_slice)).collect()
    }
}
