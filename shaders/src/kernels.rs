//! The kernels: for each the words of its module and what it does with its buffers. `tests/reflection.rs` holds this
//! table against the modules themselves.

use crate::SubgroupOps;

/// What a kernel does with a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// It reads.
    Read,
    /// It writes, and may read what it or a step before it wrote.
    Write,
}

/// A compute shader of this package; nobody else makes one, so executors may trust its words.
#[derive(Debug, PartialEq)]
#[non_exhaustive]
pub struct Kernel {
    /// Its file's name without the extension.
    pub name: &'static str,
    /// SPIR-V 1.3, little endian.
    pub spirv: &'static [u8],
    /// Storage buffers of set 0, binding 0 onwards.
    pub bindings: &'static [Access],
    /// Size of its push constants, bytes.
    pub push_bytes: u32,
    /// Whether it takes the least of numbers of 64 bits in a buffer, which not every device can.
    pub wide_atomics: bool,
    /// What it does across the threads of a subgroup, which not every device can.
    pub subgroup_ops: SubgroupOps,
}

impl Kernel {
    /// The module's words.
    pub fn words(&self) -> Vec<u32> {
        let (words, _) = self.spirv.as_chunks::<4>();
        words.iter().map(|w| u32::from_le_bytes(*w)).collect()
    }
}

macro_rules! kernels {
    ($($(#[$about:meta])* $constant:ident = $file:literal [$($access:ident),*] $(push $push:literal)? $(wide $wide:literal)? $(subgroup $ops:ident)?;)*) => {
        $(
            $(#[$about])*
            pub static $constant: Kernel = Kernel {
                name: $file,
                spirv: include_bytes!(concat!("../spirv/", $file, ".spv")),
                bindings: &[$(Access::$access),*],
                push_bytes: 0 $(+ $push)?,
                wide_atomics: false $(|| $wide)?,
                subgroup_ops: SubgroupOps::NONE $(.and(SubgroupOps::$ops))?,
            };
        )*

        /// Every kernel.
        pub static ALL: &[&Kernel] = &[$(&$constant),*];
    };
}

kernels! {
    /// Sums of blocks of 1024 numbers: scan, numbers → sums.
    SCAN_REDUCE = "scan_reduce" [Read, Read, Write];
    /// The exclusive scan of the sums, by one workgroup, and the total: scan, sums.
    SCAN_SPINE = "scan_spine" [Write, Write];
    /// The exclusive scan of the numbers, in place, begun at their block's sum: scan, numbers, sums.
    SCAN_APPLY = "scan_apply" [Read, Write, Read];
    /// As [`SCAN_REDUCE`], by subgroups.
    SCAN_REDUCE_SUBGROUP = "scan_reduce_subgroup" [Read, Read, Write] subgroup SUMS;
    /// As [`SCAN_SPINE`], by subgroups.
    SCAN_SPINE_SUBGROUP = "scan_spine_subgroup" [Write, Write] subgroup SUMS;
    /// As [`SCAN_APPLY`], by subgroups.
    SCAN_APPLY_SUBGROUP = "scan_apply_subgroup" [Read, Write, Read] subgroup SUMS;

    /// How often each digit occurs in each block of 2048: state, keys → counts. Push: shift.
    RADIX_HISTOGRAM = "radix_histogram" [Read, Read, Write] push 4;
    /// Moves every key and its companion to their digit's place, equal digits in their order:
    /// state, keys, companions, scanned counts → keys, companions. Push: shift.
    RADIX_SCATTER = "radix_scatter" [Read, Read, Read, Read, Write, Write] push 4;
    /// As [`RADIX_SCATTER`], by subgroups.
    RADIX_SCATTER_SUBGROUP = "radix_scatter_subgroup" [Read, Read, Read, Read, Write, Write] push 4 subgroup ALL;

    /// Nothing counted yet: view → state, scan of places.
    SPLAT_BEGIN = "splat_begin" [Read, Write, Write];
    /// How many tiles each splat of an order reaches: view, order, splats → counts, state.
    SPLAT_COUNT = "splat_count" [Read, Read, Read, Write, Write];
    /// Sizes of the sort by tiles, or nothing to sort where there is too little room: state → sort, scan of digits.
    /// Push: room.
    SPLAT_PREPARE = "splat_prepare" [Read, Write, Write] push 4;
    /// An entry for each tile of each splat, in the order of splats:
    /// view, order, splats, scanned counts, scan of places, sort → tiles, ids.
    SPLAT_EMIT = "splat_emit" [Read, Read, Read, Read, Read, Read, Write, Write];
    /// Where each tile begins among the sorted entries, and the most that one has: view, sort, tiles → starts, state.
    SPLAT_RANGES = "splat_ranges" [Read, Read, Read, Write, Write];
    /// Composites the entries of each tile, one plane of optical depth and three channels:
    /// view, starts, ids, splats, values, tables, opaque depth → planes.
    SPLAT_COMPOSITE_BEAUTY = "splat_composite_beauty" [Read, Read, Read, Read, Read, Read, Read, Write];
    /// The same for any number of planes and channels.
    SPLAT_COMPOSITE = "splat_composite" [Read, Read, Read, Read, Read, Read, Read, Write];
    /// The same with depths and objects.
    SPLAT_COMPOSITE_LAYERS = "splat_composite_layers" [Read, Read, Read, Read, Read, Read, Read, Write];
    /// Resolves the opaque entries of each tile, three channels: view, starts, ids, splats, values, tables → image.
    SPLAT_RESOLVE_BEAUTY = "splat_resolve_beauty" [Read, Read, Read, Read, Read, Read, Write];
    /// The same for any number of channels.
    SPLAT_RESOLVE = "splat_resolve" [Read, Read, Read, Read, Read, Read, Write];

    /// Nothing projected yet: → state.
    SPLAT_NOTHING = "splat_nothing" [Write];
    /// Splats to footprints: view, positions, radii, looks, frames, tables → splats, state.
    SPLAT_PROJECT = "splat_project" [Read, Read, Read, Read, Read, Read, Write, Write];
    /// Attributes to radiance: view, positions, radii, looks, frames, tables, received light → values.
    SPLAT_SHADE = "splat_shade" [Read, Read, Read, Read, Read, Read, Read, Write];
    /// The number of composited splats is that of the sorted ones: state of the sort → view.
    SPLAT_FOLLOW = "splat_follow" [Read, Write];

    /// Sets the state of a sort to nothing found: view → state, scan of blocks.
    HBSORT_BEGIN = "hbsort_begin" [Read, Write, Write];
    /// View depths as keys, culling, extremes, and how many of each block of 1024 are kept:
    /// view, positions, radii → keys, kept counts, state.
    HBSORT_PROJECT = "hbsort_project" [Read, Read, Read, Write, Write, Write];
    /// Moves the kept splats together in their order: view, keys, places of blocks → kept keys, kept places. Push: room.
    HBSORT_COMPACT = "hbsort_compact" [Read, Read, Read, Write, Write] push 4;
    /// Sizes of what follows: scan of blocks → state, scan of digits. Push: room.
    HBSORT_PREPARE = "hbsort_prepare" [Read, Write, Write] push 4;

    /// Sets the sums of pixels to nothing: view → sums.
    PBSR_BEGIN = "pbsr_begin" [Read, Write];
    /// Sets depths to the limits, and winners to none: view, limits → nearest, winners.
    PBSR_CLEAR = "pbsr_clear" [Read, Read, Write, Write];
    /// Particles onto pixels, nearest depths: view, objects, sets, particles → footings, nearest. Push: level.
    PBSR_PROJECT = "pbsr_project" [Read, Read, Read, Read, Write, Write] push 4;
    /// Who is seen among equals: view, sets, limits, footings, nearest → winners. Push: level.
    PBSR_RANK = "pbsr_rank" [Read, Read, Read, Read, Read, Write] push 4;
    /// Adds who is seen: view, objects, sets, particles, footings, nearest, winners → sums. Push: level.
    PBSR_ADD = "pbsr_add" [Read, Read, Read, Read, Read, Read, Read, Write] push 4;

    /// Sets depths to the limits, above no rank: view, limits → keys.
    PBSR_KEYS = "pbsr_keys" [Read, Read, Write];
    /// Particles onto pixels, nearest depth and lowest rank in one number of 64 bits: view, objects, sets, particles → keys.
    /// Push: level.
    PBSR_NEAREST = "pbsr_nearest" [Read, Read, Read, Read, Write] push 4 wide true;
    /// Adds who is seen of each pixel: view, objects, sets, particles, limits, keys → sums. Push: level.
    PBSR_GATHER = "pbsr_gather" [Read, Read, Read, Read, Read, Write, Write] push 4;
    /// Who is seen on the pixels of a part: view, sets, limits, nearest, winners → found, seen. Push: level, first pixel, place
    /// of the part among what is found.
    PBSR_SEE = "pbsr_see" [Read, Read, Read, Read, Read, Write, Write] push 12;
    /// The same, and pixels ready for the next set: view, sets, limits → keys, found, seen. Push: as before.
    PBSR_SEE_WIDE = "pbsr_see_wide" [Read, Read, Read, Write, Write, Write] push 12;
    /// Where those lie that are seen: view, objects, particles, found, seen → positions, frames. Push: place of the part.
    PBSR_PLACE = "pbsr_place" [Read, Read, Read, Read, Read, Write, Write] push 4;
    /// How they look: objects, particles, found, seen → radii, looks, shares of shadows. Push: place of the part.
    PBSR_LOOK = "pbsr_look" [Read, Read, Read, Read, Write, Write, Write] push 4;
    /// Adds what was shaded: view, found, seen, values → sums. Push: place of the part.
    PBSR_SUM = "pbsr_sum" [Read, Read, Read, Read, Write] push 4;
    /// How many arrivals each chunk of each set has: source, tables → arrivals, counts.
    PBSR_ARRIVE = "pbsr_arrive" [Read, Read, Write, Write];
    /// How many particles each part of a set has that the caller gives: spans → counts. Push: spans.
    PBSR_GIVEN_COUNT = "pbsr_given_count" [Read, Write] push 4;
    /// Particles that the caller gives: spans, given, scanned counts → particles. Push: spans.
    PBSR_GIVEN = "pbsr_given" [Read, Read, Read, Write] push 4;
    /// Where each set begins, and what was found: source, scan, scanned counts → sets, found. Push: room for all sets, room
    /// for one.
    PBSR_SETS = "pbsr_sets" [Read, Read, Read, Write, Write] push 8;
    /// Particles on triangles: source, tables, triangles, vertices, arrivals, scanned counts → particles.
    PBSR_MESH = "pbsr_mesh" [Read, Read, Read, Read, Read, Read, Write];
    /// Particles of splats: source, tables, splats, kernels, arrivals, scanned counts → particles.
    PBSR_SPLATS = "pbsr_splats" [Read, Read, Read, Read, Read, Read, Write];
    /// How many arrivals in a volume stay: source, tables, cells, values, transfer, arrivals → counts.
    PBSR_VOLUME_COUNT = "pbsr_volume_count" [Read, Read, Read, Read, Read, Read, Write];
    /// Particles in a volume: source, tables, cells, values, transfer, arrivals, scanned counts → particles.
    PBSR_VOLUME = "pbsr_volume" [Read, Read, Read, Read, Read, Read, Read, Write];

    /// How many lines along a lattice leave a particle on an isosurface: source, tables, cells, values, arrivals → counts.
    PBSR_LATTICE_COUNT = "pbsr_lattice_count" [Read, Read, Read, Read, Read, Write];
    /// Particles on an isosurface: source, tables, cells, values, arrivals, scanned counts → particles.
    PBSR_LATTICE = "pbsr_lattice" [Read, Read, Read, Read, Read, Read, Write];

    /// Distances as keys, and places: view, distances → keys, places.
    TSM_KEYS = "tsm_keys" [Read, Read, Write, Write];
    /// Cells by distance: view, places, cells → keys.
    TSM_GATHER = "tsm_gather" [Read, Read, Read, Write];
    /// Entries in order: view, places, distances, absorbances → distances, absorbances.
    TSM_ARRANGE = "tsm_arrange" [Read, Read, Read, Read, Write, Write];
    /// Knots and running absorbance of blocks of 1024: view, cells, distances, absorbances → states.
    TSM_REDUCE = "tsm_reduce" [Read, Read, Read, Read, Write];
    /// What goes on where blocks begin, by one workgroup: view, states.
    TSM_SPINE = "tsm_spine" [Read, Write];
    /// Running sums along cells: view, cells, distances, absorbances, states → marks, totals.
    TSM_APPLY = "tsm_apply" [Read, Read, Read, Read, Read, Write, Write];
    /// First entry and kept knots of each cell: view, cells, distances, marks → spans.
    TSM_SPANS = "tsm_spans" [Read, Read, Read, Read, Write];
    /// The lists: view, cells, distances, marks, totals, spans → distances, totals.
    TSM_SETTLE = "tsm_settle" [Read, Read, Read, Read, Read, Read, Write, Write];
    /// The light that arrives at receivers:
    /// view, receivers, spans, distances, totals, opaque distances, directions → lights.
    TSM_LOOK_UP = "tsm_look_up" [Read, Read, Read, Read, Read, Read, Read, Write];
    /// Casters to footprints on a table: view, casters, positions, radii, looks, frames, tables → footprints.
    TSM_CAST = "tsm_cast" [Read, Read, Read, Read, Read, Read, Read, Write];
    /// How many cells each footprint deposits in: view, footprints, opaque distances, directions → counts.
    TSM_COUNT = "tsm_count" [Read, Read, Read, Read, Write];
    /// Sizes of what makes the lists, or no entries where there is too little room:
    /// view, scan of counts → list view, sort, scan of digits, state. Push: room.
    TSM_PREPARE = "tsm_prepare" [Read, Read, Write, Write, Write, Write] push 4;
    /// An entry for each cell of each footprint:
    /// view, footprints, opaque distances, directions, scanned counts → cells, distances, absorbances. Push: room.
    TSM_DEPOSIT = "tsm_deposit" [Read, Read, Read, Read, Read, Write, Write, Write] push 4;
    /// Splats as receivers in the light's frame: view, positions, radii, looks, frames → receivers.
    TSM_RECEIVE = "tsm_receive" [Read, Read, Read, Read, Read, Write];
    /// Light to what shading receives: view, lights, shares of the shadow → received. Push: which light.
    TSM_HAND_ON = "tsm_hand_on" [Read, Read, Read, Write] push 4;
}
